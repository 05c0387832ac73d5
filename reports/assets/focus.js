// Redrawing without taking the keyboard's focus away: what takes the place of the focused control gets it.

const kControls = 'a[href], button, input, select, summary, [tabindex]';
const controlsIn = (box) => [...box.querySelectorAll(kControls)].filter((control) => !control.hidden);

/** What stays of a control when it is drawn anew. */
const keyOf = (control) => `${control.tagName} ${
    control.dataset.focus || control.id || control.getAttribute('name') || control.getAttribute('aria-label') ||
    control.textContent}`;

/** As replaceChildren(). The control with the same key keeps the focus; else that which stands in its place. */
export function refill(box, ...children) {
  const focused = document.activeElement;
  const isHere = focused !== box && box.contains(focused);
  const before = isHere ? controlsIn(box) : [];
  box.replaceChildren(...children);
  if (!isHere) return;
  const isSame = (control) => keyOf(control) === keyOf(focused);
  const after = controlsIn(box);
  const same = after.filter(isSame);
  const nth = before.filter(isSame).indexOf(focused);
  const next = same[Math.min(nth, same.length - 1)] ?? after[Math.min(before.indexOf(focused), after.length - 1)];
  if (!next) box.tabIndex = -1;  // nothing is left to go to: the place itself
  (next ?? box).focus({preventScroll: true});
}

// Charts are pictures: they are drawn anew where the page's colours change.

/** redraw(): after a switch of colour scheme, and before and after printing: paper is white whatever the screen is. */
export function whenColorsChange(redraw) {
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => redraw());
  for (const printing of [true, false]) {
    window.addEventListener(printing ? 'beforeprint' : 'afterprint', () => {
      document.documentElement.classList.toggle('printing', printing);
      redraw();
    });
  }
}

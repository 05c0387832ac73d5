// What is shown, kept in the URL's fragment: a link shows the same, and the browser's back button goes back.

const kFields = ['view', 'event', 'series', 'search', 'machine', 'backend', 'technique', 'map', 'format', 'scene'];

/** Texts, '' where nothing is chosen. view: '' (overview), event, series, machines or log. */
export const state = Object.fromEntries(kFields.map((field) => [field, '']));

/** Whether the view is another one than before. */
export function readState() {
  const before = state.view + state.event;
  const words = new URLSearchParams(location.hash.slice(1));
  for (const field of kFields) state[field] = words.get(field) || '';
  return before !== state.view + state.event;
}

/** A link's target. fields: those that are chosen there. */
export const linkTo = (fields) =>
    '#' + new URLSearchParams(kFields.filter((name) => fields[name]).map((name) => [name, String(fields[name])]));

/** Takes the new state without a step for the back button, as for every letter of a search. */
export function replaceState(fields) {
  Object.assign(state, fields);
  history.replaceState(null, '', linkTo(state));
}

/** Says to eye and screen reader which of the links is the one that is shown. */
export function markCurrent(links, isCurrent) {
  for (const link of links) {
    if (isCurrent(link))
      link.setAttribute('aria-current', 'true');
    else
      link.removeAttribute('aria-current');
  }
}

// What the trend page shows, kept in the URL's fragment.

import {fragmentOf, readFragment, replaceFragment} from './url_state.js';

const kFields = ['view', 'event', 'series', 'search', 'machine', 'backend', 'technique', 'map', 'format', 'scene'];

/** Texts, '' where nothing is chosen. view: '' (overview), event, series, machines or log. */
export const state = Object.fromEntries(kFields.map((field) => [field, '']));

/** Whether the view is another one than before. */
export function readState() {
  const before = state.view + state.event;
  Object.assign(state, readFragment(kFields));
  return before !== state.view + state.event;
}

/** A link's target. fields: those that are chosen there. */
export const linkTo = (fields) => fragmentOf(kFields, fields);

/** Takes the new state without a step for the back button, as for every letter of a search. */
export function replaceState(fields) {
  Object.assign(state, fields);
  replaceFragment(kFields, state);
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

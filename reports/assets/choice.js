// What the reader has chosen: kept here and in the URL's fragment. Parts of the page redraw when their fields change.

import {data} from './page.js';
import {metricIndex} from './points.js';
import {readFragment, replaceFragment} from './url_state.js';

/** Filters by a parameter of the setting. */
export const kParamFilters = ['map', 'format', 'encoding'];

const fromNumber = (value) => (value === null ? '' : String(Number(value.toPrecision(6))));
const toNumber = (text) => (text !== '' && Number.isFinite(Number(text)) ? Number(text) : null);
const toIndex = (text, list) => (/^\d+$/.test(text) && Number(text) < list.length ? Number(text) : null);
const indices = (text, list) => text.split(',').map((word) => toIndex(word, list)).filter((index) => index !== null);
const byName = (list, name) => {
  const at = list.findIndex(({id}) => id === name);
  return at < 0 ? null : at;
};

// Of each field how it is written in the fragment and read from it; '' is its default.
const kFields = {
  metric: {
    write: (v) => (v === metricIndex.get(data.front_metric) ? '' : data.metrics[v].id),
    read: (text) => byName(data.metrics, text) ?? metricIndex.get(data.front_metric),
  },
  scene: {write: (v) => (v === 0 ? '' : v), read: (text) => toIndex(text, data.scenes) ?? 0},
  group: {write: (v) => v ?? '', read: (text) => toIndex(text, data.groups)},
  error:
      {write: (v) =>
           (v === undefined ? '' :
                v === null  ? 'any' :
                              fromNumber(v)),
       read: readError},
  time_ms: {write: fromNumber, read: toNumber},
  hidden: {
    write: (v) => [...v].map((index) => data.techniques[index].id).join(','),
    read: (text) =>
        new Set(text.split(',').map((name) => byName(data.techniques, name)).filter((index) => index !== null)),
  },
  search: {write: (v) => v, read: (text) => text},
  pins: {write: (v) => v.join(','), read: (text) => indices(text, data.points)},
  picture: {write: (v) => v ?? '', read: (text) => toIndex(text, data.points)},
  other: {write: (v) => v ?? '', read: (text) => toIndex(text, data.points)},
  kind: {write: (v) => (v === 'frame' ? '' : v), read: (text) => (['error', 'taps'].includes(text) ? text : 'frame')},
  mode: {write: (v) => (v === 'split' ? '' : v), read: (text) => (['side', 'all'].includes(text) ? text : 'split')},
  ...Object.fromEntries(kParamFilters.map((name) => [name, {write: (v) => v, read: (text) => text}])),
};
const kNames = Object.keys(kFields);

/** undefined: the run's own budget; null: none. */
function readError(text) { return text === 'any' ? null : toNumber(text) ?? undefined; }

/**
 * metric, scene: indices. group: index, null: all. error: limit on the metric, null: none, undefined: the run's.
 * time_ms: limit or null. hidden: techniques. pins: points. picture, other: points of the pictures or null.
 */
export const choice = /** @type {any} */ ({});

const listeners = [];
export const changes = {
  count: 0
};  // so that what was found for one choice is kept until the next

/** redraw(): once any of the fields has changed. */
export const whenChanged = (fields, redraw) => listeners.push({fields, redraw});

function notify(changed) {
  ++changes.count;
  if (data.points.length === 0) return;
  for (const {fields, redraw} of listeners)
    if (fields.some((field) => changed.includes(field))) redraw();
}

/** Takes a new choice, and redraws what shows it. */
export function choose(fields) {
  Object.assign(choice, fields);
  replaceFragment(kNames, Object.fromEntries(kNames.map((name) => [name, kFields[name].write(choice[name])])));
  notify(Object.keys(fields));
}

/** Takes what the fragment says. */
export function readChoice() {
  const texts = readFragment(kNames);
  for (const name of kNames) choice[name] = kFields[name].read(texts[name]);
}

readChoice();
window.addEventListener('hashchange', () => {
  if (location.hash && document.getElementById(location.hash.slice(1))) return;  // a link to a section
  readChoice();
  notify(kNames);
});

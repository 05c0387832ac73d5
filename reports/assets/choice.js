// What the reader has chosen: kept here and in the URL's fragment. Parts of the page redraw when their fields change.

import {data} from './page.js';
import {metricIndex} from './points.js';
import {readFragment, replaceFragment} from './url_state.js';

/** Filters by a parameter of the setting. */
export const kParamFilters = ['map', 'format', 'encoding'];

const fromNumber = (value) => (value === null ? '' : String(Number(value.toPrecision(6))));
const toNumber = (text) => (text !== '' && Number.isFinite(Number(text)) ? Number(text) : null);
const toIndex = (text, list) => (/^\d+$/.test(text) && Number(text) < list.length ? Number(text) : null);
const byName = (list, name) => {
  const at = list.findIndex(({id}) => id === name);
  return at < 0 ? null : at;
};

/** What the fragment names and this report has not. */
export const missing = [];

// A link shows the same in a report that was made again, so it names things by what they are, not by their places.
const partOf = (text) => text.replace(/[%,:]/g, encodeURIComponent);
const isOnly = (group, ...names) =>
    data.groups.filter((other) => names.every((name) => other[name] === group[name])).length === 1;
function groupName(group) {
  const {backend, device, run} = group;
  const names = isOnly(group, 'backend') ? [backend] :
      isOnly(group, 'backend', 'device') ? [backend, device] :
                                           [backend, device, data.runs[run].folder];
  return names.map(partOf).join(':');
}
function pointName({scene, group, setting, id}) {
  return [partOf(data.scenes[scene].id), groupName(data.groups[group]), partOf(data.settings[setting].key ?? id)].join(
      ':');
}

const nameOf = {
  scenes: ({id}) => id,
  groups: groupName,
  points: pointName
};
const made = new Map();  // list -> names, and the places that have them, once they are asked for
function tableOf(list) {
  if (!made.has(list)) {
    const names = data[list].map(nameOf[list]);
    made.set(list, {names, places: new Map(names.map((name, index) => [name, index]).reverse())});
  }
  return made.get(list);
}

/** The place of what has that name. Links of older pages have the place itself. */
function placeOfName(list, name) {
  if (name === '') return null;
  const place = tableOf(list).places.get(name) ?? toIndex(name, data[list]);
  if (place === null) missing.push(name);
  return place;
}
const named = (list) => ({
  write: (v) => (v === null ? '' : tableOf(list).names[v]),
  read: (text) => placeOfName(list, text),
});

// Of each field how it is written in the fragment and read from it; '' is its default.
const kFields = {
  metric: {
    write: (v) => (v === metricIndex.get(data.front_metric) ? '' : data.metrics[v].id),
    read: (text) => byName(data.metrics, text) ?? metricIndex.get(data.front_metric),
  },
  scene: {write: (v) => (v === 0 ? '' : data.scenes[v].id), read: (text) => placeOfName('scenes', text) ?? 0},
  group: named('groups'),
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
  pins: {
    write: (v) => v.map((index) => tableOf('points').names[index]).join(','),
    read: (text) => text.split(',').map((name) => placeOfName('points', name)).filter((index) => index !== null),
  },
  picture: named('points'),
  other: named('points'),
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
function readChoice() {
  const texts = readFragment(kNames);
  missing.length = 0;
  for (const name of kNames) choice[name] = kFields[name].read(texts[name]);
}

readChoice();
window.addEventListener('hashchange', () => {
  if (location.hash && document.getElementById(location.hash.slice(1))) return;  // a link to a section
  readChoice();
  notify(kNames);
});

// What the trend page derives from its data: a night's place on the axis of its machine, and what things are called.

import {data, formatNumber, formatTime, make, percent, shortNumber, timeUnit} from './page.js';

/** Of each machine, its runs by time. A run's place on an axis of nights is its index there. */
export const runsOf = data.machines.map(() => []);
export const placeOf = data.runs.map((run, index) => runsOf[run.machine].push(index) - 1);

const dateFormat = (options) => new Intl.DateTimeFormat('en-GB', {timeZone: 'UTC', ...options});
const kDay = dateFormat({day: 'numeric', month: 'short', year: 'numeric'});
const kShortDay = dateFormat({day: 'numeric', month: 'short'});
const kMoment = dateFormat({day: 'numeric', month: 'short', year: 'numeric', hour: '2-digit', minute: '2-digit'});
const formatDate = (format, time) => {
  const date = new Date(time);
  return Number.isNaN(date.getTime()) ? String(time ?? 'unknown') : format.format(date);
};
export const formatDay = (time) => formatDate(kDay, time);
export const formatShortDay = (time) => formatDate(kShortDay, time);
export const formatMoment = (time) => formatDate(kMoment, time);

/** What git and a shell take for a revision and nothing else. */
export const isRevision = (text) => /^\w[\w./-]*$/.test(text ?? '') && text !== 'unknown';
/** Hexadecimal ids in the length that people quote. */
export const shortCommit = (text) => (/^[0-9a-f]{12,}$/i.test(text ?? '') ? text.slice(0, 8) : text || 'unknown');

export const machineName = (index) => data.machines[index].name;
export const runText = (run) => `${formatMoment(run.time)}, ${shortCommit(run.commit)}${run.dirty ? ' and more' : ''}`;
export const environmentOf = (run) => data.environments[run.environment] || {hash: '', text: 'unknown environment'};

const isWorse = (event) => event.kind === 'slower' || (event.kind === 'drift' && event.effect > 0);
const isBetter = (event) => event.kind === 'faster' || (event.kind === 'drift' && event.effect < 0);
/** worse, better or other: a class name, too. */
export const toneOf = (event) =>
    (isWorse(event) || event.kind === 'lost' ? 'worse' :
         isBetter(event)                     ? 'better' :
                                               'other');
export const glyphOf = (event) => (event.kind === 'lost' ? '✕' : {worse: '▲', better: '▼', other: '◆'}[toneOf(event)]);

export function effectText(event) {
  if (event.effect === null) return event.kind === 'lost' ? 'lost' : 'errors changed';
  const word = {slower: 'slower', faster: 'faster'}[event.kind] || (event.effect > 0 ? 'slower' : 'faster');
  return `${percent(Math.abs(event.effect), 2)} ${word}${event.kind === 'drift' ? ', drifting' : ''}`;
}

/** "4.7 to 5.7 %"; of what is faster, how much faster. */
export function intervalOf(event) {
  if (event.low === null || event.high === null) return '';
  const [low, high] = event.effect < 0 ? [-event.high, -event.low] : [event.low, event.high];
  return `${shortNumber(100 * low, 2)} to ${percent(high, 2)}`;
}

const isOpen = (event) => event.state === 'suspect' || event.state === 'confirmed';
const kGroups = [
  {title: 'Confirmed regressions', holds: (event) => event.state === 'confirmed' && isWorse(event)},
  {title: 'Lost: ok before, not any more', holds: (event) => event.kind === 'lost' && isOpen(event)},
  {title: 'Suspects', holds: (event) => event.state === 'suspect' && event.effect !== null},
  {title: 'Improvements', holds: (event) => event.state === 'confirmed' && isBetter(event)},
  {title: 'Errors changed', holds: isOpen},
  {title: 'Moved with the machine', holds: (event) => event.state === 'environment'},
  {title: 'Accepted and cleared', holds: () => true, folded: true},
];

/**
 * The events by what is to be done about them, the worst first.
 * @returns {{title: string, folded?: boolean, events: any[]}[]}
 */
export function eventGroups() {
  const groups = kGroups.map((group) => ({...group, events: []}));
  for (const event of data.events) groups.find(({holds}) => holds(event)).events.push(event);
  for (const {events} of groups) events.sort((a, b) => Math.abs(b.effect ?? 0) - Math.abs(a.effect ?? 0));
  return groups.filter(({events}) => events.length > 0);
}

export const eventOf = new Map(data.events.map((event) => [String(event.id), event]));
/** A series' name in links: its number in the database, where the data has it. */
export const seriesId = (index) => String(data.series[index].id ?? index);
export const seriesOf = new Map(data.series.map((_, index) => [seriesId(index), index]));

/** Where a series was measured, in parts that are not broken in two. */
export const whereParts =
    ({scene, map, format, backend, machine}) => [scene, map, format, backend, machineName(machine)].filter(Boolean);
export const whereElement = (series) => make(
    'span', {class: 'where muted'},
    ...whereParts(series).flatMap((part, index) => [index ? ' · ' : '', make('span', {}, part)]));

const placeText = ({setting, scene, backend, machine, device}) => [setting, scene, backend, machine, device].join('|');
const metricsOf = new Map();  // by what was measured where
for (const series of data.series)
  metricsOf.set(placeText(series), (metricsOf.get(placeText(series)) ?? new Set()).add(series.metric));

/** A series' name for people: with its metric where the same was measured by several. */
export const seriesName = (series) =>
    series.name + (metricsOf.get(placeText(series)).size > 1 ? `, ${series.metric.replaceAll('_', ' ')}` : '');

export const formatValue = (series, value) =>
    (series.unit === 'ns' ? formatTime(value) : `${formatNumber(value)} ${series.unit}`);
/** What to divide by, and how it is called then. */
export const unitOf = (series, value) => (series.unit === 'ns' ? timeUnit(value) : {name: series.unit, ns: 1});

/** The last step within an environment, or what a drift sums up to over its nights: a share. */
export function changeOf({nights, levels, drift}) {
  const [last, before] = [...levels].reverse();
  const environment = (at) => data.runs[nights[at]].environment;
  if (drift && last) return (1 + drift.per_night) ** (last.end - last.first - 1) - 1;
  return before && environment(before.first) === environment(last.first) ? last.value / before.value - 1 : 0;
}
/** The level that holds a run, or nothing. */
export const levelAt = ({nights, levels}, run) =>
    run === null ? undefined : levels.find(({first, end}) => nights[first] <= run && run <= nights[end - 1]);

/** What a level is on one of its nights: the mean, or a place on the line of the drift. */
export function levelOn({levels, drift}, level, at) {
  if (!drift || level !== levels[levels.length - 1]) return level.value;
  return level.value * (1 + drift.per_night) ** (at - (level.first + level.end - 1) / 2);
}

/** Places between which an event's change lies: none of a drift, nor of what began before the nights shown. */
export const stepOf = ({kind, good_run: good, bad_run: bad}) =>
    (kind === 'drift' || good === null || bad === null ? null : [placeOf[good], placeOf[bad]]);

/** Day of a run that may lie before the nights shown. */
export const dayOf = (run) => (run === null ? 'before these nights' : formatDay(data.runs[run].time));

/** What an event did to a series: a share. */
export function changeAcross(series, {good_run: good, bad_run: bad}) {
  const [before, after] = [levelAt(series, good), levelAt(series, bad)];
  return series.drift || !before || !after ? changeOf(series) : after.value / before.value - 1;
}

/** The levels as lines from place to place; the last is sloped where the series drifts: then it has no interval. */
export const levelLines = ({nights, levels, drift}) => levels.map(({first, end, value, low, high}, index) => {
  const line = {from: placeOf[nights[first]], to: placeOf[nights[end - 1]]};
  if (!drift || index < levels.length - 1) return {...line, start: value, end: value, low, high};
  const tilt = (1 + drift.per_night) ** ((end - first) / 2);
  return {...line, start: value / tilt, end: value * tilt};
});

export const changeText = (share) =>
    (share === 0 ? 'steady' : `${share > 0 ? '▲ +' : '▼ −'}${percent(Math.abs(share), 2)}`);

export const shiftText = (share) =>
    (share === null ? 'too few nights to say' : `${percent(share, 2)} would be found within 5 nights in 9 of 10 cases`);

// Small charts: of an event in its row, of a series among others of an event, of a machine's control case.

import {drawn} from './marks.js';
import {data} from './page.js';
import {levelAt, levelLines, placeOf, runsOf, stepOf, toneOf} from './trend_data.js';

const kWidth = 240;
const kHeight = 56;

/** The values without the few that stand far out, and all levels: [low, high], never empty. */
function rangeOf(values, levels) {
  const sorted = [...values].sort((a, b) => a - b);
  const cut = Math.floor(sorted.length / 30);
  const all = [
    ...sorted.slice(cut, sorted.length - cut),
    ...levels.flatMap(({low, high, start, end}) => [low ?? start, high ?? end])
  ];
  if (all.length === 0) return [0, 1];
  const [low, high] = [Math.min(...all), Math.max(...all)];
  const margin = Math.max(0.08 * (high - low), 1e-3 * Math.abs(high), 1e-9);
  return [low - margin, high + margin];
}

/**
 * dots: [{x, y}], x from 0 to count - 1; levels: as levelLines() gives them; step: [from, to],
 * where the change lies, or nothing; tone: of the change.
 */
function spark({count, dots, levels = [], step = null, tone = '', label}) {
  const [low, high] = rangeOf(dots.map(({y}) => y), levels);
  const x = (place) => ((place + 0.5) / Math.max(count, 1)) * kWidth;
  const y = (value) => kHeight - 3 - (kHeight - 6) * Math.max(0, Math.min(1, (value - low) / (high - low)));
  const radius = Math.max(0.8, Math.min(2.2, kWidth / count / 2.4));
  const svg =
      drawn('svg', {viewBox: `0 0 ${kWidth} ${kHeight}`, role: 'img', 'aria-label': label, class: `spark ${tone}`});
  if (step)
    svg.append(drawn(
        'rect', {class: 'step', x: x(step[0]), y: 0, width: Math.max(2, x(step[1]) - x(step[0])), height: kHeight}));
  for (const level of levels.filter((l) => l.low !== undefined)) {
    svg.append(drawn('rect', {
      class: 'interval',
      x: x(level.from - 0.5),
      y: y(level.high),
      width: x(level.to + 0.5) - x(level.from - 0.5),
      height: Math.max(1, y(level.low) - y(level.high))
    }));
  }
  const path = dots.map((dot) => `M${x(dot.x).toFixed(1)} ${y(dot.y).toFixed(1)}h0`).join('');
  svg.append(drawn('path', {class: 'dots', d: path, 'stroke-width': 2 * radius}));
  svg.append(drawn('path', {
    class: 'level',
    d: levels.map((l) => `M${x(l.from - 0.5)} ${y(l.start)}L${x(l.to + 0.5)} ${y(l.end)}`).join('')
  }));
  return svg;
}

const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;

const quantile = (values, share) => [...values].sort((a, b) => a - b)[Math.floor(share * values.length)];

/** Where three of four series are on the level that they have in a run: [from, to], or nothing. */
function commonSpan(series, run) {
  const held = series.map((one) => [one.nights, levelAt(one, run)]).filter(([, level]) => level);
  if (held.length === 0) return null;
  return [
    quantile(held.map(([nights, {first}]) => placeOf[nights[first]]), 0.75),
    quantile(held.map(([nights, {end}]) => placeOf[nights[end - 1]]), 0.25)
  ];
}

/** What series did together: the means of their log values, each less its level at the run before the event. */
function pooled(series, good) {
  const sums = new Map();
  for (const one of series) {
    const {nights, values, invalid, spikes} = one;
    const base = Math.log(levelAt(one, good)?.value ?? values.find((value) => value > 0));
    const left = new Set([...invalid, ...spikes]);
    nights.forEach((run, at) => {
      if (left.has(at) || !(values[at] > 0)) return;
      const [sum, count] = sums.get(placeOf[run]) || [0, 0];
      sums.set(placeOf[run], [sum + Math.log(values[at]) - base, count + 1]);
    });
  }
  return [...sums].sort(([a], [b]) => a - b).map(([x, [sum, count]]) => ({x, y: sum / count}));
}

/** With the levels before and after, where most of the series have them. */
export function eventSpark(event) {
  const series = event.series.map((index) => data.series[index]);
  const dots = pooled(series, event.good_run);
  if (dots.length === 0) return null;
  const step = stepOf(event);
  const level = (span, from, to) => {
    const side = span ? dots.filter(({x}) => Math.max(from, span[0]) <= x && x <= Math.min(to, span[1])) : [];
    if (side.length === 0) return [];
    const height = mean(side.map(({y}) => y));
    return [{from: side[0].x, to: side[side.length - 1].x, start: height, end: height}];
  };
  const levels = !step ? [] : [
    ...level(commonSpan(series, event.good_run), 0, step[0]),
    ...level(commonSpan(series, event.bad_run), step[1], Infinity)
  ];
  return spark({
    count: runsOf[event.machine].length,
    dots,
    levels,
    step,
    tone: toneOf(event),
    label: `${dots.length} nights, the mean of ${series.length} series`
  });
}

export function seriesSpark(series, event) {
  const invalid = new Set(series.invalid);
  const dots = series.nights.map((run, at) => ({x: placeOf[run], y: series.values[at], at}))
                   .filter(({y, at}) => y !== null && !invalid.has(at));
  return spark({
    count: runsOf[series.machine].length,
    dots,
    levels: levelLines(series),
    step: event && stepOf(event),
    tone: event ? toneOf(event) : '',
    label: `${series.nights.length} nights`
  });
}

/** The control case of a device over the nights. */
export function controlSpark(machine, {nights, control_ns: control}) {
  const dots = nights.map((run, at) => ({x: placeOf[run], y: control[at]}));
  return spark({
    count: runsOf[machine].length,
    dots: dots.filter(({y}) => y !== null),
    label: `control case of ${nights.length} nights`
  });
}

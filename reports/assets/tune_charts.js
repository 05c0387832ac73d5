// How a search went: the gap that it could certify, and its front or pick over time.

import {readTheme, seriesColor, shapeOf} from './marks.js';
import {byId, data, shortNumber} from './page.js';
import {linearAxis, scatterChart} from './scatter.js';

export const fourDigits = (value) => shortNumber(value, 4);
export const tunedTime = (ns) => (ns === null || ns === undefined ? '' : `${fourDigits(ns / 1e6)} ms`);
/** With the digits that `tune` prints. */
export const gapText = (gap) => (gap === null ? 'unknown' : `${(100 * gap).toFixed(2)} %`);

/** "within 2 % of the best", of what the search knows: where some were not scored, of those that were. */
export function withinText({gap, high_ns: high, rival_low_ns: rival}) {
  const {unscored} = data.tune.space;
  const known = gap ?? (unscored && rival ? Math.max(0, high / rival - 1) : null);
  return known === null ? 'by an unknown share from the best' :
                          `within ${gapText(known)} of the best${gap === null ? ' of those scored' : ''}`;
}

/** "relief linear_steps=32 [0123abcd]" */
const tunedName = (setting) => `${data.tune.names[setting].name} [${data.tune.names[setting].key}]`;

const power = (value) => fourDigits(Number((10 ** value).toPrecision(2)));

function tuneChart(id, theme, datasets, x, y, tooltip) {
  Chart.getChart(id)?.destroy();
  return scatterChart(byId(id), datasets, {
    x,
    y,
    legend: {
      display: datasets.length > 1,
      labels: {
        color: theme.ink,
        usePointStyle: true,
        filter: ({datasetIndex}) => datasets[datasetIndex].data.length > 0,
      }
    },
    tooltip: {callbacks: {label: (item) => tooltip(item.raw)}},
  });
}

/** Errors reach from exact zero over many decades: log10, zeros at a place of their own under the least other error. */
function errorPlaces({settings}) {
  const errors = settings.map((s) => s.error).filter((e) => e > 0);
  const least = errors.reduce((a, b) => Math.min(a, b), errors[0] || 1);
  return {
    place: (error) => Math.log10(error > 0 ? error : least / 10),
    tick: (value) =>
        (errors.length < settings.length && value <= Math.log10(least / 5) ? '0' : fourDigits(10 ** value)),
  };
}

/** The front as steps: each answer holds up to the error of the next cheaper one. */
function stepsOf(points) {
  const corners = [];
  points.forEach((point, i) => {
    corners.push(point);
    if (points[i + 1]) corners.push({...point, y: points[i + 1].y});
  });
  return corners;
}

function drawGap(tune, theme) {
  const asked = Math.log10(tune.question.epsilon);
  const line = (label, gap, series) => ({
    label,
    data: tune.path.filter((p) => p[gap] > 0).map((p) => ({x: p.samples, y: Math.log10(p[gap]), p, gap: p[gap]})),
    showLine: true,
    borderColor: seriesColor(theme, series),
    backgroundColor: seriesColor(theme, series),
    pointStyle: shapeOf(series),
    radius: 3,
  });
  const last = tune.path.length ? tune.path[tune.path.length - 1].samples : 1;
  const limit = {
    label: 'asked',
    data: [0, last].map((x) => ({x, y: asked})),
    showLine: true,
    borderColor: seriesColor(theme, 3),
    borderDash: [6, 4],
    radius: 0,
    pointStyle: 'line'
  };
  tuneChart(
      'gap', theme, [line('of all settings', 'worst_gap', 0), line('of those timed so far', 'timed_gap', 1), limit],
      linearAxis(theme, 'samples', fourDigits),
      linearAxis(theme, 'gap, %', (value) => fourDigits(Number((100 * 10 ** value).toPrecision(2)))),
      ({p, gap}) => (p ? `${p.samples} samples, ${p.measured} settings: ${gapText(gap)}` : 'asked'));
}

/** With one answer: how long what was its pick takes, as it turned out. */
function drawPickHistory(tune, theme) {
  const title = 'Frame time of the pick over the search, as finally estimated';
  byId('history-title').textContent = title;
  byId('history').setAttribute('aria-label', title);
  byId('budget-gap-figure')?.remove();
  const points = tune.path.filter(({picks}) => picks.length > 0).map(({samples, picks}) => {
    const s = tune.settings[picks[0]];
    return {x: samples, y: s.time_ns / 1e6, s};
  });
  const line = {
    label: 'pick',
    data: points,
    showLine: true,
    stepped: true,
    borderColor: seriesColor(theme, 0),
    backgroundColor: seriesColor(theme, 0),
    radius: 3,
  };
  tuneChart(
      'history', theme, [line], linearAxis(theme, 'samples', fourDigits), linearAxis(theme, 'ms', fourDigits),
      ({x, s}) => `${x} samples: ${tunedTime(s.time_ns)}: ${tunedName(s.setting)}`);
}

function drawFrontHistory(tune, theme) {
  const {place, tick} = errorPlaces(tune);
  const answered = tune.path.filter(({picks}) => picks.length > 0);
  const shown = [0.05, 0.2, 0.5, 1].map((share) => answered[Math.ceil(share * answered.length) - 1]).filter(Boolean);
  const fronts = shown.map((point, i) => {
    const picks = point.picks.map((index) => tune.settings[index]).filter((s) => s.time_ns !== null);
    const color = seriesColor(theme, i);
    return {
      label: `${point.samples} samples`,
      data: stepsOf(picks.map((s) => ({x: Math.log10(s.time_ns / 1e6), y: place(s.error), s}))),
      showLine: true,
      borderColor: color,
      backgroundColor: color,
      borderWidth: 1 + 0.5 * i,
      pointStyle: shapeOf(i),
      radius: 2,
    };
  });
  tuneChart(
      'history', theme, fronts, linearAxis(theme, 'frame time, ms (final estimate)', power),
      linearAxis(theme, tune.error_metric, tick),
      ({s}) => `${tunedTime(s.time_ns)}, ${fourDigits(s.error)}: ${tunedName(s.setting)}`);
}

function drawBudgetGap(tune, theme) {
  const {place, tick} = errorPlaces(tune);
  const dots = {
    label: 'gap',
    data: tune.answers.filter((a) => a.gap !== null).map((a) => ({x: place(a.error), y: 100 * a.gap, a})),
    backgroundColor: seriesColor(theme, 0),
    borderColor: seriesColor(theme, 0),
    radius: 4
  };
  tuneChart(
      'budget-gap', theme, [dots], linearAxis(theme, `${tune.error_metric} at most`, tick),
      {...linearAxis(theme, 'gap, %', fourDigits), min: 0},
      ({a}) => `${fourDigits(a.error)}: ${tunedTime(a.time_ns)}, ${withinText(a)}: ${tunedName(a.setting)}`);
}

export function drawTuneCharts(tune) {
  const theme = readTheme();
  drawGap(tune, theme);
  if (tune.question.max_error.length) {
    drawPickHistory(tune, theme);
  } else {
    drawFrontHistory(tune, theme);
    drawBudgetGap(tune, theme);
  }
}

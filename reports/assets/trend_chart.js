// A series over its nights, and the control case of its device below it on the same axis.

import {readTheme, seriesColor, withAlpha} from './marks.js';
import {data, make, percent, shortNumber} from './page.js';
import {linearAxis, moveActive, scatterChart, tooltipLook} from './scatter.js';
import {environmentOf, eventOf, formatShortDay, formatValue, glyphOf, levelLines, levelOn, placeOf, runsOf, runText, seriesName, stepOf, toneOf, unitOf} from './trend_data.js';
import {epochsOf} from './trend_epochs.js';
import {kStripHeight, plotPlugin} from './trend_plot.js';

const kAxisWidth = 62;  // of both charts, so that their nights lie under each other
const kSteps = [1, 2, 3, 5, 7, 14, 28, 56, 91, 182, 364];
const kDotStyles = {
  night: 'circle',
  spike: 'triangle',
  left: 'circle',
  missing: 'crossRot'
};

/** Where the nights are that count, with their levels, and some room for the others. */
function shownRange(series, kindOf) {
  const {values, levels} = series;
  const counted = values.filter((_, at) => kindOf(at) === 'night');
  const known = counted.length ? counted : values.filter((value) => value !== null);
  const all = [...known, ...levels.flatMap(({low, high}) => [low, high])];
  if (all.length === 0) return [0.5, 1.5];
  const [low, high] = [Math.min(...all), Math.max(...all)];
  const room = Math.max(0.12 * (high - low), 0.005 * high);
  return [low - room, high + room];
}

/** One dot a night. Spikes and what was not looked at go to the edge where they lie beyond the rest. */
export function dotsOf(series) {
  const {nights, values} = series;
  const invalid = new Set(series.invalid);
  const spikes = new Set(series.spikes);
  const kindOf = (at) =>
      (values[at] === null ? 'missing' :
           invalid.has(at) ? 'left' :
           spikes.has(at)  ? 'spike' :
                             'night');
  const [low, high] = shownRange(series, kindOf);
  const unit = unitOf(series, high);
  const dots = nights.map((run, at) => ({
                            x: placeOf[run],
                            y: Math.max(low, Math.min(high, values[at] ?? low)) / unit.ns,
                            beyond: (values[at] > high ? 1 : 0) - (values[at] !== null && values[at] < low ? 1 : 0),
                            at,
                            error: series.errors[at],
                            kind: kindOf(at),
                          }));
  return {unit, dots, range: [low / unit.ns, high / unit.ns]};
}

/** Notes of the machine's nights, and of the series' events. */
export function notesOf(series) {
  return data.annotations.filter(
      ({run, event}) => (run !== null ? data.runs[run].machine === series.machine : series.events.includes(event)));
}
/** Where a note lies: an event's where it was sure. */
const notePlace = ({run, event}) => placeOf[run ?? eventOf.get(String(event)).bad_run];

/**
 * Nights with dates under them, as many as there is room for; hasDates: or none, where another chart below has them.
 */
function nightAxis(machine, theme, hasDates) {
  const runs = runsOf[machine];
  const year = (place) => String(data.runs[runs[place]].time).slice(0, 4);
  let step = 1;
  const label = (place) =>
      [formatShortDay(data.runs[runs[place]].time),
       place < step || year(place) !== year(place - step) ? year(place) : ''];
  const axis = linearAxis(theme, '', label);
  return {
    ...axis,
    title: {display: false},
    min: -0.7,
    max: runs.length - 0.3,
    grid: {...axis.grid, display: false},
    afterBuildTicks: (scale) => {
      const room = Math.max(2, Math.floor((scale.chart.width - kAxisWidth) / 76));
      step = kSteps.find((size) => size * room >= runs.length) || Math.ceil(runs.length / room);
      scale.ticks = runs.map((_, place) => ({value: place})).filter(({value}) => value % step === 0);
    },
    ticks: {...axis.ticks, autoSkip: false, display: hasDates},
  };
}

const fixedWidth = {
  afterFit: (scale) => (scale.width = kAxisWidth)
};

function levelText(series, level, at) {
  const value = levelOn(series, level, at);
  return value === level.value ?
      `level ${formatValue(series, value)} (${formatValue(series, level.low)} to ${formatValue(series, level.high)})` :
      `the drift's line: ${formatValue(series, value)}`;
}

function tooltipLines(series, {at, kind}) {
  const run = data.runs[series.nights[at]];
  const [value, error] = [series.values[at], series.errors[at]];
  const level = series.levels.find(({first, end}) => first <= at && at < end);
  return [
    value === null ? 'no value' :
                     formatValue(series, value) + (error ? ` ± ${percent(error, 2)} (standard error)` : ''),
    level && levelText(series, level, at),
    kind === 'left' || kind === 'missing' ? 'not looked at for changes' :
        kind === 'spike'                  ? 'stands alone: a spike' :
                                            null,
    environmentOf(run).text,
    ...notesOf(series)
        .filter((note) => notePlace(note) === placeOf[series.nights[at]])
        .map(({by, text}) => `${by}: ${text}`),
  ].filter(Boolean);
}

const tooltipOf = (title, lines) => ({
  ...tooltipLook,
  callbacks: {title: ([item]) => (item ? title(item.raw) : ''), label: (item) => lines(item.raw)},
});

function stepsOf(series, theme) {
  const color = {worse: seriesColor(theme, 1), better: seriesColor(theme, 2), other: seriesColor(theme, 3)};
  const label = (event) => event.effect !== null ? percent(Math.abs(event.effect), 2) :
      event.kind === 'lost'                      ? 'lost' :
                                                   'errors';
  return series.events.map((id) => eventOf.get(String(id)))
      .filter(stepOf)
      .map((event) => {
        const [from, to] = stepOf(event);
        return {from, to, color: color[toneOf(event)], label: `${glyphOf(event)} ${label(event)}`};
      })
      .sort((a, b) => a.from - b.from);
}

function drawSeries(canvas, series, theme) {
  const {unit, dots, range} = dotsOf(series);
  const place = (at) => placeOf[series.nights[at]];
  const divided = (value) => (value === undefined ? value : value / unit.ns);
  const inUnit = ({from, to, start, end, low, high}) =>
      ({from, to, start: divided(start), end: divided(end), low: divided(low), high: divided(high)});
  const color = {night: seriesColor(theme, 0), spike: seriesColor(theme, 4), left: theme.muted, missing: theme.muted};
  const radius = dots.length > 150 ? 2.5 : 4;
  const picture = {
    hasStrips: true,
    epochs: epochsOf(series.machine),
    steps: stepsOf(series, theme),
    levels: levelLines(series).map(inUnit),
    notes: notesOf(series).map(notePlace).filter((at) => at !== undefined),
    scores: series.scores.slice(1).map(([at]) => place(at)),
  };
  const dataset = {
    data: dots,
    pointStyle: dots.map(({kind}) => kDotStyles[kind]),
    pointRotation: dots.map(({beyond}) => (beyond < 0 ? 180 : 0)),
    pointRadius: dots.map(({kind}) => (kind === 'spike' ? radius + 2 : radius)),
    pointBorderColor: dots.map(({kind}) => color[kind]),
    pointBackgroundColor: dots.map(({kind}) => (kind === 'left' ? 'transparent' : withAlpha(color[kind], 0.75))),
    pointBorderWidth: dots.map(({kind}) => (kind === 'night' ? 0 : 1.5)),
    pointHoverRadius: 7,
    pointHitRadius: 6,
    clip: 12,  // px: a mark at the axis' end is drawn whole
  };
  return scatterChart(canvas, [dataset], {
    x: nightAxis(series.machine, theme, !controlOf(series)),
    y: {
      ...linearAxis(theme, `${series.metric.replaceAll('_', ' ')}, ${unit.name}`, (value) => shortNumber(value, 4)),
      ...fixedWidth,
      min: range[0],  // what lies beyond is drawn at the edge: there the axis must end, too
      max: range[1]
    },
    legend: {display: false},
    layout: {padding: {top: 2 * kStripHeight, right: 12}},
    tooltip: tooltipOf(({at}) => runText(data.runs[series.nights[at]]), (dot) => tooltipLines(series, dot)),
    plugins: [plotPlugin(picture, theme)],
  });
}

/** Of the series' device; of the first of its backend where the data does not say. */
export const controlOf = ({machine, backend, device}) => {
  const {devices} = data.machines[machine];
  return (devices[device] || devices.find((one) => one.backend === backend) || {}).calibration;
};

function drawControl(canvas, series, theme) {
  const {nights, control_ns: control} = controlOf(series);
  const sorted = control.filter((ns) => ns !== null).sort((a, b) => a - b);
  const middle = sorted[Math.floor(sorted.length / 2)];
  const dots = nights.map(
      (run, at) =>
          ({x: placeOf[run], y: control[at] === null ? NaN : 100 * (control[at] / middle - 1), run, ns: control[at]}));
  const picture = {
    epochs: epochsOf(series.machine),
    steps: stepsOf(series, theme),
    levels: [],
    notes: [],
    scores: [],
    hasStrips: false
  };
  const dataset = {
    data: dots,
    showLine: true,
    borderColor: withAlpha(seriesColor(theme, 7), 0.5),
    borderWidth: 1,
    backgroundColor: seriesColor(theme, 7),
    pointStyle: 'rect',
    radius: dots.length > 150 ? 1.5 : 2.5,
    hoverRadius: 6,
    pointHitRadius: 6
  };
  const signed = (value) => `${value > 0 ? '+' : value < 0 ? '−' : ''}${shortNumber(Math.abs(value))}`;
  const axis = linearAxis(theme, 'control, %', signed);
  return scatterChart(canvas, [dataset], {
    x: nightAxis(series.machine, theme, true),
    y: {...axis, ticks: {...axis.ticks, maxTicksLimit: 4}, ...fixedWidth, suggestedMin: -2, suggestedMax: 2},
    legend: {display: false},
    layout: {padding: {right: 12}},
    tooltip: tooltipOf(
        ({run}) => runText(data.runs[run]),
        ({ns, y}) => [`control case ${formatValue({unit: 'ns'}, ns)}`, `${signed(y)} % off its median`]),
    plugins: [plotPlugin(picture, theme)],
  });
}

function chartCanvas(label) {
  const canvas = make('canvas', {tabindex: 0, role: 'img', 'aria-label': label});
  canvas.addEventListener('keydown', (event) => {
    const step = {ArrowRight: 1, ArrowLeft: -1}[event.key];
    if (!step) return;
    event.preventDefault();
    moveActive(Chart.getChart(canvas), step);
  });
  return canvas;
}

const drawings = new Map();  // canvas -> how its chart is made

/** Makes the charts of a place anew: those just put there, or all after a change of colours. */
export function drawCharts(place = document.body) {
  const theme = readTheme();
  for (const [canvas, draw] of drawings) {
    if (canvas.isConnected && !place.contains(canvas)) continue;
    Chart.getChart(canvas)?.destroy();
    if (canvas.isConnected)
      draw(theme);
    else
      drawings.delete(canvas);
  }
}

/** The charts of a series, which drawCharts() fills once they are in the page. */
export function seriesCharts(series, summary) {
  const canvas = chartCanvas(`${seriesName(series)}. ${summary} The table below has the same figures.`);
  drawings.set(canvas, (theme) => drawSeries(canvas, series, theme));
  const boxes = [make('div', {class: 'canvas-box'}, canvas)];
  if (controlOf(series)) {
    const control =
        chartCanvas('The control case of its device over the same nights: it moves where the machine does.');
    drawings.set(control, (theme) => drawControl(control, series, theme));
    boxes.push(make('div', {class: 'canvas-box control-box'}, control));
  }
  return boxes;
}

// Scatter charts of frame time against error. Both axes are linear scales of already transformed values (log10, or the
// negated value where higher is better), so that an exact zero has a place: a marked band under the axis.

import {pin} from './details.js';
import {readTheme, seriesColor, shapeOf, withAlpha} from './marks.js';
import {data, formatInterval, formatTime} from './page.js';
import {comparison, errorOf, groupLabel, metricTitle, state, techniqueOf} from './points.js';
import {tooltipLook} from './scatter.js';

export const charts = [];  // one entry a canvas: {chart, spec, canvas, details, pinned}
const kBandShare = 0.1;    // of the axis height

const bandLabel = ({id, lower_is_better}) => !lower_is_better ? 'identical pictures' :
    id.startsWith('e_')                                       ? '0 (exact)' :
                                                                '0';

/** How a metric lies on the vertical axis. */
function metricAxis(metricId, points) {
  const {lower_is_better} = data.metrics[metricId];
  const values = points.map((point) => point.errors[metricId]);
  const forward = lower_is_better ? (v) => Math.log10(v) : (v) => -v;
  const backward = lower_is_better ? (a) => 10 ** a : (a) => -a;
  const inBand = lower_is_better ? (v) => v === 0 : (v) => v === null;
  const placed = values.filter((v) => v !== null && !inBand(v)).map(forward);
  let low = placed.reduce((a, b) => Math.min(a, b), Infinity);
  let high = placed.reduce((a, b) => Math.max(a, b), -Infinity);
  if (placed.length === 0) [low, high] = [forward(1), forward(1)];
  if (high - low < 0.3) [low, high] = [low - 0.5, high + 0.5];
  const margin = 0.05 * (high - low);
  const bandTop = low - margin;
  const hasBand = values.some(inBand);
  const min = hasBand ? bandTop - kBandShare * (high - low) : bandTop;
  return {
    min,
    max: high + margin,
    backward,
    isLog: lower_is_better,
    band: hasBand ? {top: bandTop, label: bandLabel(data.metrics[metricId])} : null,
    place: (v) => (inBand(v) ? (min + bandTop) / 2 : forward(v)),
    ticksFrom: hasBand ? bandTop : min,
  };
}

function timeAxis(points) {
  let low = Infinity;
  let high = -Infinity;
  for (const point of points) {
    low = Math.min(low, point.time_ns[1]);
    high = Math.max(high, point.time_ns[2]);
  }
  if (!(low > 0 && high > 0)) [low, high] = [1e6, 1e6];
  let [min, max] = [Math.log10(low / 1e6), Math.log10(high / 1e6)];
  const margin = Math.max(0.05 * (max - min), 0.02);
  return {min: min - margin, max: max + margin, backward: (a) => 10 ** a, isLog: true, ticksFrom: min - margin};
}

/** Ticks in axis units: decades, 1-2-5, or even steps of the value, whichever gives a readable few. */
function axisTicks(axis) {
  const span = axis.max - axis.ticksFrom;
  if (!axis.isLog || span < 0.8) return evenTicks(axis);
  const ticks = [];
  const mantissas = span > 4 ? [1] : span > 1.6 ? [1, 3] : [1, 2, 5];
  const stride = Math.ceil(span / 9);
  for (let decade = Math.floor(axis.ticksFrom); decade <= axis.max; decade += stride) {
    for (const mantissa of mantissas) ticks.push(decade + Math.log10(mantissa));
  }
  return ticks.filter((tick) => tick >= axis.ticksFrom && tick <= axis.max);
}

function evenTicks(axis) {
  const [a, b] = [axis.backward(axis.ticksFrom), axis.backward(axis.max)].sort((x, y) => x - y);
  const rough = (b - a) / 5;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough);
  const ticks = [];
  for (let value = Math.ceil(a / step) * step; value <= b; value += step) {
    if (!axis.isLog || value > 0) ticks.push(axis.isLog ? Math.log10(value) : -value);
  }
  return ticks;
}

function scaleOptions(axis, title, theme) {
  return {
    type: 'linear',
    min: axis.min,
    max: axis.max,
    title: {display: true, text: title, color: theme.muted},
    grid: {color: theme.grid, drawBorder: false},
    afterBuildTicks: (scale) => (scale.ticks = axisTicks(axis).map((value) => ({value}))),
    // Ticks are round numbers: twelve digits only take off the rounding of 10 ** x.
    ticks: {
      color: theme.muted,
      autoSkip: false,
      maxRotation: 0,
      callback: (value) => String(Number(axis.backward(value).toPrecision(3)))
    },
  };
}

/** Draws what Chart.js has no element for: the exact band, time intervals of the front, rings of the recommended. */
const extras = {
  id: 'extras',
  beforeDatasetsDraw(chart, _args, {axis, theme}) {
    if (!axis.band) return;
    const {ctx, chartArea, scales} = chart;
    const top = scales.y.getPixelForValue(axis.band.top);
    ctx.save();
    ctx.fillStyle = theme.band;
    ctx.fillRect(chartArea.left, top, chartArea.width, chartArea.bottom - top);
    ctx.fillStyle = theme.muted;
    ctx.font = '11px system-ui, sans-serif';
    ctx.textAlign = 'left';
    ctx.textBaseline = 'bottom';
    ctx.fillText(axis.band.label, chartArea.left + 4, chartArea.bottom - 2);
    ctx.restore();
  },
  afterDatasetsDraw(chart, _args, {entry, theme}) {
    const {ctx, scales} = chart;
    ctx.save();
    chart.data.datasets[0].data.forEach(({point, y, onFront, picked}) => {
      const pinned = entry.pinned === point;
      if (!onFront && !picked && !pinned) return;
      const [x, left, right] = point.time_ns.map((ns) => scales.x.getPixelForValue(Math.log10(ns / 1e6)));
      const height = scales.y.getPixelForValue(y);
      ctx.strokeStyle = theme.ink;
      ctx.lineWidth = 1;
      ctx.beginPath();
      ctx.moveTo(left, height);
      ctx.lineTo(right, height);
      ctx.stroke();
      if (!picked && !pinned) return;
      ctx.lineWidth = pinned ? 2.5 : 1.5;
      ctx.beginPath();
      ctx.arc(x, height, pinned ? 11 : 8.5, 0, 2 * Math.PI);
      ctx.stroke();
    });
    ctx.restore();
  },
};

function tooltipLines({point}) {
  const settings = point.params.map(([name, value]) => `${name}=${value}`);
  const lines = [];
  for (let i = 0; i < settings.length; i += 3) lines.push(settings.slice(i, i + 3).join('  '));
  const others = [...data.metrics.keys()].filter((index) => data.metrics[index].is_column && index !== state.metric);
  lines.push(`${formatTime(point.time_ns[0])}  (${formatInterval(point.time_ns)}, ${point.coverage})`);
  for (const index of [state.metric, ...others]) lines.push(`${data.metrics[index].id}  ${errorOf(point, index)}`);
  for (const broken of point.breaks) lines.push(`breaks ${comparison(broken)}`);
  return lines;
}

export function chartConfig(spec, entry) {
  const theme = readTheme();
  const axis = metricAxis(state.metric, spec.rangePoints);
  const front = frontsOf(spec);
  const onFront = new Set(front.flatMap((f) => f.points.map((p) => p.point)));
  const picks = new Set(data.answers.map((answer) => answer.pick));
  const rank = (index) => (picks.has(index) ? 2 : onFront.has(index) ? 1 : 0);
  const shown = spec.indices.filter((index) => !state.hidden.has(data.points[index].technique))
                    .sort((a, b) => rank(a) - rank(b));  // the front is drawn over the rest
  const places = shown.map((index) => {
    const point = data.points[index];
    return {
      x: Math.log10(point.time_ns[0] / 1e6),
      y: axis.place(point.errors[state.metric]),
      point,
      onFront: onFront.has(index),
      picked: picks.has(index)
    };
  });
  const color = places.map(
      (p) => withAlpha(
          seriesColor(theme, spec.seriesOf(p.point)),
          p.onFront || p.picked     ? 1 :
              p.point.breaks.length ? 0.6 :
                                      0.3));
  const dots = {
    type: 'scatter',
    data: places,
    pointBorderColor: color,
    pointBackgroundColor: places.map((p, i) => (p.point.breaks.length ? 'transparent' : color[i])),
    pointBorderWidth: places.map((p) => (p.point.breaks.length ? 1.5 : 0)),
    pointStyle: places.map((p) => shapeOf(spec.seriesOf(p.point))),
    pointRadius: places.map((p) => (p.onFront ? 5 : 3.5)),
    pointHoverRadius: 7,
    pointHitRadius: 5,
  };
  const lines = front.map(
      (f) => ({
        type: 'line',
        stepped: 'before',
        pointRadius: 0,
        pointHitRadius: 0,
        borderWidth: 1.5,
        fill: false,
        borderColor: spec.overlaid ? seriesColor(theme, f.group) : theme.ink,
        data: f.points.map((p) => data.points[p.point])
                  .map((point) => ({x: Math.log10(point.time_ns[0] / 1e6), y: axis.place(point.errors[state.metric])})),
      }));
  return {
    data: {datasets: [dots, ...lines]},
    options: {
      animation: false,
      responsive: true,
      maintainAspectRatio: false,
      normalized: true,
      parsing: false,
      interaction: {mode: 'nearest', intersect: true},
      onClick: (_event, hits) => pin(entry, hits.length ? dots.data[hits[0].index].point : null),
      scales: {
        x: scaleOptions(timeAxis(spec.rangePoints), 'frame time (ms)', theme),
        y: scaleOptions(axis, axisTitle(), theme),
      },
      plugins: {
        legend: {display: false},
        extras: {axis, entry, theme},
        tooltip: {
          ...tooltipLook,
          filter: (item, index) => index === 0 && item.datasetIndex === 0,
          callbacks: {
            title: ([item]) => (item ? tooltipTitle(item.raw.point, spec) : ''),
            label: (item) => tooltipLines(item.raw)
          },
        },
      },
    },
    plugins: [extras],
  };
}

const tooltipTitle = (point, spec) =>
    (spec.overlaid ? `${techniqueOf(point)} · ${groupLabel(point.group)}` : techniqueOf(point));

function axisTitle() {
  const metric = data.metrics[state.metric];
  return metricTitle(metric) + (metric.lower_is_better ? '' : ', better downwards');
}

const frontsOf = (spec) => data.fronts[state.metric].fronts.filter(
    (front) => front.scene === spec.scene && (spec.group === null || front.group === spec.group));

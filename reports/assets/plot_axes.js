// The axes of the plot. Both are linear scales of already transformed values (log10, or the negated value where higher
// is better), so that an exact zero has a place: a marked band under the axis.

import {data} from './page.js';

const kBandShare = 0.1;  // of the axis height

const bandLabel = ({id, lower_is_better}) => !lower_is_better ? 'identical pictures' :
    id.startsWith('e_')                                       ? '0 (exact)' :
                                                                '0';

/** How a metric lies on the vertical axis. */
export function metricAxis(metric, points) {
  const {lower_is_better} = data.metrics[metric];
  const forward = lower_is_better ? (v) => Math.log10(v) : (v) => -v;
  const backward = lower_is_better ? (a) => 10 ** a : (a) => -a;
  const inBand = lower_is_better ? (v) => v === 0 : (v) => v === null;
  let low = Infinity;
  let high = -Infinity;
  let hasBand = false;
  for (const point of points) {
    const value = point.errors[metric];
    if (inBand(value)) {
      hasBand = true;
    } else if (value !== null) {
      low = Math.min(low, forward(value));
      high = Math.max(high, forward(value));
    }
  }
  if (low > high) [low, high] = [forward(1), forward(1)];
  if (high - low < 0.3) [low, high] = [low - 0.5, high + 0.5];
  const margin = 0.05 * (high - low);
  const bandTop = low - margin;
  const min = hasBand ? bandTop - kBandShare * (high - low) : bandTop;
  return {
    min,
    max: high + margin,
    backward,
    isLog: lower_is_better,
    band: hasBand ? {top: bandTop, label: bandLabel(data.metrics[metric])} : null,
    /** null: what has no value has no place */
    place: (v) =>
        (inBand(v)      ? (min + bandTop) / 2 :
             v === null ? null :
                          forward(v)),
    ticksFrom: hasBand ? bandTop : min,
  };
}

export const placeOfTime = (ns) => Math.log10(ns / 1e6);

export function timeAxis(points) {
  let low = Infinity;
  let high = -Infinity;
  for (const point of points) {
    low = Math.min(low, point.time_ns[1]);
    high = Math.max(high, point.time_ns[2]);
  }
  if (!(low > 0 && high > 0)) [low, high] = [1e6, 1e6];
  const [min, max] = [placeOfTime(low), placeOfTime(high)];
  const margin = Math.max(0.04 * (max - min), 0.02);
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

export function scaleOptions(axis, title, theme) {
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

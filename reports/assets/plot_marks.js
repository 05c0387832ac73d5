// What Chart.js has no element for: the band of exact zeros, budgets, intervals of the front, its numbers, and rings
// round picks and pins.

import {drawLine, withAlpha} from './marks.js';
import {byId, data, letterOf} from './page.js';
import {placeOfTime} from './plot_axes.js';

const kFont = '11px system-ui, sans-serif';

/** A text that is read over lines and dots, too. */
function drawText(ctx, theme, text, x, y) {
  ctx.strokeStyle = withAlpha(theme.paper, 0.8);
  ctx.lineWidth = 3;
  ctx.strokeText(text, x, y);
  ctx.fillStyle = theme.ink;
  ctx.fillText(text, x, y);
}

function drawBand({ctx, chartArea: area, scales}, {axis, theme}) {
  if (!axis.band) return;
  const top = scales.y.getPixelForValue(axis.band.top);
  ctx.fillStyle = theme.band;
  ctx.fillRect(area.left, top, area.width, area.bottom - top);
  ctx.fillStyle = theme.muted;
  ctx.textAlign = 'left';
  ctx.textBaseline = 'bottom';
  ctx.fillText(axis.band.label, area.left + 4, area.bottom - 2);
}

/** The sides that the budgets forbid are shaded. */
function drawLimits(ctx, {chartArea: area, scales}, {budgets, theme}) {
  const {error, time_ns} = budgets;
  ctx.fillStyle = withAlpha(theme.muted, 0.1);
  ctx.textBaseline = 'bottom';
  if (error) {
    const y = Math.max(area.top, Math.min(area.bottom, scales.y.getPixelForValue(error.place)));
    ctx.fillRect(area.left, area.top, area.width, y - area.top);
    drawLine(ctx, area.left, y, area.right, y, theme.accent, 1.5, [6, 4]);
    ctx.fillStyle = theme.accent;
    ctx.textAlign = 'right';
    ctx.fillText(error.text, area.right - 4, y - 3 < area.top + 12 ? y + 14 : y - 3);
  }
  if (time_ns === null) return;
  const x = Math.max(area.left, Math.min(area.right, scales.x.getPixelForValue(placeOfTime(time_ns))));
  ctx.fillStyle = withAlpha(theme.muted, 0.1);
  ctx.fillRect(x, area.top, area.right - x, area.bottom - area.top);
  drawLine(ctx, x, area.top, x, area.bottom, theme.accent, 1.5, [6, 4]);
}

function placeOf({scales}, axis, index, metric) {
  const point = data.points[index];
  return {
    x: scales.x.getPixelForValue(placeOfTime(point.time_ns[0])),
    y: scales.y.getPixelForValue(axis.place(point.errors[metric])),
    low: scales.x.getPixelForValue(placeOfTime(point.time_ns[1])),
    high: scales.x.getPixelForValue(placeOfTime(point.time_ns[2])),
  };
}

function drawInterval({ctx}, {low, high, y}, color) {
  drawLine(ctx, low, y, high, y, color, 1);
  for (const x of [low, high]) drawLine(ctx, x, y - 3, x, y + 3, color, 1);
}

function ring(ctx, {x, y}, radius, width, color) {
  ctx.strokeStyle = color;
  ctx.lineWidth = width;
  ctx.beginPath();
  ctx.arc(x, y, radius, 0, 2 * Math.PI);
  ctx.stroke();
}

/** The first front's points are numbered as the strip of pictures numbers them. Their names stand in the legend. */
function drawFronts(chart, {fronts, axis, metric, theme}) {
  const {ctx} = chart;
  const taken = [];
  ctx.textAlign = 'right';
  ctx.textBaseline = 'top';
  for (const {indices, isNumbered} of fronts) {
    indices.forEach((index, at) => {
      const place = placeOf(chart, axis, index, metric);
      drawInterval(chart, place, theme.ink);
      if (!isNumbered || taken.some(([x, y]) => Math.hypot(x - place.x, y - place.y) < 14)) return;
      taken.push([place.x, place.y]);
      drawText(ctx, theme, String(at + 1), place.x - 6, place.y + 4);
    });
  }
}

/** What moves with the budgets and pins, on a canvas of its own: thousands of dots need not be drawn anew for it. */
export function drawOverlay(chart, options) {
  const {axis, metric, theme} = options;
  const overlay = /** @type {HTMLCanvasElement} */ (byId('plot-overlay'));
  const {canvas} = chart;
  [overlay.width, overlay.height] = [canvas.width, canvas.height];  // clears it, too
  Object.assign(overlay.style, {width: canvas.style.width, height: canvas.style.height});
  const ctx = overlay.getContext('2d');
  ctx.scale(chart.currentDevicePixelRatio, chart.currentDevicePixelRatio);
  ctx.font = kFont;
  drawLimits(ctx, chart, options);
  for (const index of options.picks) ring(ctx, placeOf(chart, axis, index, metric), 9, 2, theme.accent);
  if (options.active !== null) ring(ctx, placeOf(chart, axis, options.active, metric), 7, 2.5, theme.ink);
  options.pins.forEach((index, at) => {
    const place = placeOf(chart, axis, index, metric);
    ring(ctx, place, 11.5, 2, theme.ink);
    ctx.textAlign = 'left';
    ctx.textBaseline = 'middle';
    drawText(ctx, theme, letterOf(at), place.x + 14, place.y);
  });
}

/** options: {axis, metric, theme, fronts, budgets, picks, pins, active} */
export const plotMarks = {
  id: 'plotMarks',
  beforeDatasetsDraw(chart, _args, {marks}) {
    const {ctx} = chart;
    ctx.save();
    ctx.font = kFont;
    drawBand(chart, marks());
    ctx.restore();
  },
  afterDatasetsDraw(chart, _args, {marks}) {
    const {ctx} = chart;
    ctx.save();
    ctx.font = kFont;
    drawFronts(chart, marks());
    ctx.restore();
    drawOverlay(chart, marks());
  },
};

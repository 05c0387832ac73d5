// What Chart.js has no element for: epochs, changes, levels, error bars, notes and changed errors, drawn round the
// dots.

import {drawLine, withAlpha} from './marks.js';

export const kStripHeight = 16;  // over the plot: names of epochs, and under them changes and notes
const kFont = '11px system-ui, sans-serif';

/** The text, cut to what fits. */
function fitted(ctx, text, width) {
  if (ctx.measureText(text).width <= width) return text;
  let length = text.length;
  while (length > 0 && ctx.measureText(text.slice(0, length) + '…').width > width) --length;
  return length > 3 ? text.slice(0, length) + '…' : '';
}

function drawEpochs(chart, {epochs, hasStrips}, theme) {
  const {ctx, chartArea: area, scales: {x}} = chart;
  epochs.forEach((epoch, index) => {
    const left = Math.max(area.left, x.getPixelForValue(epoch.from - 0.5));
    const right = Math.min(area.right, x.getPixelForValue(epoch.to + 0.5));
    if (index % 2 === 1) {
      ctx.fillStyle = theme.band;
      ctx.fillRect(left, area.top, right - left, area.bottom - area.top);
    }
    if (index > 0)
      drawLine(ctx, left, area.top - (hasStrips ? 2 * kStripHeight : 0), left, area.bottom, theme.muted, 1);
    if (!hasStrips) return;
    ctx.fillStyle = theme.muted;
    ctx.textAlign = 'left';
    ctx.fillText(fitted(ctx, epoch.label, right - left - 8), left + 4, area.top - 1.5 * kStripHeight);
  });
}

function drawSteps(chart, {steps, hasStrips}) {
  const {ctx, chartArea: area, scales: {x}} = chart;
  let free = area.left;  // where the next label may begin
  ctx.font = `600 ${kFont}`;
  ctx.textAlign = 'left';
  for (const step of steps) {
    const [left, right] = [x.getPixelForValue(step.from), x.getPixelForValue(step.to)];
    ctx.fillStyle = withAlpha(step.color, 0.18);
    ctx.fillRect(left, area.top, right - left, area.bottom - area.top);
    for (const edge of [left, right])
      drawLine(ctx, edge, area.top, edge, area.bottom, withAlpha(step.color, 0.7), 1, [3, 3]);
    if (!hasStrips) continue;
    const {width} = ctx.measureText(step.label);
    const at = Math.max(free, Math.min(area.right - width, (left + right - width) / 2));
    ctx.fillStyle = step.color;
    ctx.fillText(step.label, at, area.top - kStripHeight / 2);
    free = at + width + 6;
  }
  ctx.font = kFont;
}

function drawIntervals(chart, {levels}, theme) {
  const {ctx, scales: {x, y}} = chart;
  ctx.fillStyle = withAlpha(theme.series[0], 0.18);
  for (const {from, to, low, high} of levels.filter((level) => level.low !== undefined)) {
    const [left, top] = [x.getPixelForValue(from - 0.5), y.getPixelForValue(high)];
    ctx.fillRect(left, top, x.getPixelForValue(to + 0.5) - left, y.getPixelForValue(low) - top);
  }
}

function drawErrorBars(chart, theme) {
  const {ctx, chartArea: area, scales: {x, y}} = chart;
  for (const dot of chart.data.datasets[0].data) {
    if (!dot.error || dot.kind !== 'night') continue;
    const place = x.getPixelForValue(dot.x);
    const end = (sign) =>
        Math.max(area.top, Math.min(area.bottom, y.getPixelForValue(dot.y * Math.exp(sign * dot.error))));
    drawLine(ctx, place, end(-1), place, end(1), withAlpha(theme.series[0], 0.55), 1);
  }
}

/** What lies beyond the axis stands at its end, on a shaft: an arrow. */
function drawShafts(chart, theme) {
  const {ctx, scales: {x, y}} = chart;
  for (const {x: place, y: value, beyond} of chart.data.datasets[0].data) {
    if (!beyond) continue;
    const [at, end] = [x.getPixelForValue(place), y.getPixelForValue(value)];
    drawLine(ctx, at, end, at, end + 16 * beyond, theme.series[4], 2);
  }
}

function drawMarks(chart, {notes, scores}, theme) {
  const {ctx, chartArea: area, scales: {x}} = chart;
  const filled = (path, color) => {
    ctx.fillStyle = color;
    ctx.fill(new Path2D(path));
  };
  for (const place of notes) {
    const at = x.getPixelForValue(place);
    drawLine(ctx, at, area.top, at, area.bottom, withAlpha(theme.ink, 0.45), 1, [1, 3]);
    filled(`M${at} ${area.top + 1}h9l-2.5 3.5 2.5 3.5h-9z`, theme.ink);
  }
  for (const place of scores) {
    const at = x.getPixelForValue(place - 0.5);
    filled(`M${at} ${area.bottom - 6}l6 6-6 6-6-6z`, theme.series[3]);
  }
}

/** picture: {epochs, steps, levels, notes, scores, hasStrips}, in places and in units of the axis. */
export const plotPlugin = (picture, theme) => ({
  id: 'plot',
  beforeDatasetsDraw(chart) {
    const {ctx} = chart;
    ctx.save();
    ctx.font = kFont;
    ctx.textBaseline = 'middle';
    drawEpochs(chart, picture, theme);
    drawSteps(chart, picture);
    drawIntervals(chart, picture, theme);
    drawErrorBars(chart, theme);
    drawShafts(chart, theme);
    ctx.restore();
  },
  afterDatasetsDraw(chart) {
    const {ctx, scales: {x, y}} = chart;
    ctx.save();
    for (const {from, to, start, end} of picture.levels)
      drawLine(
          ctx, x.getPixelForValue(from - 0.5), y.getPixelForValue(start), x.getPixelForValue(to + 0.5),
          y.getPixelForValue(end), theme.ink, 2);
    drawMarks(chart, picture, theme);
    ctx.restore();
  },
});

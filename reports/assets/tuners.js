// Search strategies compared: regret and hypervolume against settings timed.

import {readTheme, seriesColor, shapeOf} from './marks.js';
import {byId, data, make, percent} from './page.js';
import {whenColorsChange} from './redraw.js';

const kLeastRegret = 1e-4;  // a log axis has no zero: what is less is drawn here

/** One line of means and one of worst seeds for each strategy. */
function datasets(figure, place, theme) {
  const lines = [];
  data.strategies.forEach((strategy, index) => {
    for (const part of ['mean', 'worst']) {
      lines.push({
        label: part === 'mean' ? strategy.strategy : `${strategy.strategy}, worst seed`,
        data: strategy.points.map((point) => ({x: point.timed.mean, y: place(point[figure][part])})),
        borderColor: seriesColor(theme, index),
        backgroundColor: seriesColor(theme, index),
        borderWidth: part === 'mean' ? 2 : 1,
        borderDash: part === 'mean' ? [] : [3, 4],
        pointStyle: shapeOf(index),
        pointRadius: part === 'mean' ? 5 : 0,
        pointHitRadius: 8,
        fill: false,
        tension: 0,
      });
    }
  });
  return lines;
}

function draw(id, figure, place, yAxis) {
  const theme = readTheme();
  Chart.getChart(id)?.destroy();
  const grid = {color: theme.grid};
  return new Chart(byId(id), {
    type: 'line',
    data: {datasets: datasets(figure, place, theme)},
    options: {
      animation: false,
      parsing: false,
      responsive: true,
      maintainAspectRatio: false,
      scales: {
        x: {
          type: 'logarithmic',
          min: 0.9 * Math.min(...data.strategies.flatMap(({points}) => points.map(({timed}) => timed.mean))),
          title: {display: true, text: 'settings timed', color: theme.muted},
          grid,
          ticks: {color: theme.muted, callback: (value) => (/^[125]0*$/.test(String(value)) ? String(value) : '')}
        },
        y: {
          grid,
          ...yAxis,
          title: {display: true, text: yAxis.name, color: theme.muted},
          ticks: {color: theme.muted, ...yAxis.ticks}
        },
      },
      plugins: {
        legend: {
          labels: {
            color: theme.ink,
            usePointStyle: true,
            filter: (item) => !item.text.endsWith('worst seed'),
          },
          onClick: (_event, item, legend) => {
            const visible = !legend.chart.isDatasetVisible(item.datasetIndex);
            for (const index of [item.datasetIndex, item.datasetIndex + 1])
              legend.chart.setDatasetVisibility(index, visible);
            legend.chart.update();
          },
        },
        tooltip: {
          callbacks: {
            label: ({dataset, parsed}) => `${dataset.label}: ${
                parsed.y === noAnswer ? 'no answer' : percent(parsed.y)} at ${Math.round(parsed.x)}`
          }
        },
      },
    },
  });
}

const figureCell = (value, text, className = 'number') =>
    make('td', {class: className}, value === null ? '∞' : text(value));
const figureCells =
    ({mean, most, worst},
     text) => [figureCell(mean, text), figureCell(most, text), figureCell(worst, text, 'number worst')];

function figureRow({strategy, description}, point) {
  const count = (value) => String(Math.round(value));
  const share = (value) => percent(value);
  return make(
      'tr', {}, make('td', {title: description}, strategy),
      make('td', {class: 'number'}, point.share < 1 ? percent(point.share) : 'to its end'),
      figureCell(point.timed.mean, count), figureCell(point.samples.mean, count),
      ...figureCells(point.worst_regret, share), ...figureCells(point.mean_regret, share),
      ...figureCells(point.hypervolume, (value) => value.toFixed(4)), figureCell(point.false_front.mean, share),
      make('td', {class: 'number'}, point.uncovered ? `${point.uncovered} of ${data.seeds}` : ''));
}

function drawTable() {
  const heads = [
    ['strategy', 1], ['share', 1], ['settings', 1], ['frames', 1], ['worst regret', 3], ['mean regret', 3],
    ['hypervolume', 3], ['false front', 1], ['no answer', 1]
  ];
  byId('table').append(
      make(
          'thead', {},
          make('tr', {}, ...heads.map(([head, columns]) => make('th', {scope: 'col', colspan: columns}, head)))),
      ...data.strategies.map(
          (strategy) => make('tbody', {}, ...strategy.points.map((point) => figureRow(strategy, point)))));
}

function certificateText(
    {epsilon, confidence, seeds, certified, held, frames_per_setting: frames, worst_regret: regret}) {
  if (seeds === 0) return 'Not tried: no search was run to its end.';
  const regretText = (value) => (value === null ? 'a budget without an answer' : percent(value));
  return `"Every answer is within ${percent(epsilon)} of the best, with ${percent(confidence)} confidence": given in ` +
      `${certified} of ${seeds} seeds, true in ${held} of these. Frames a setting: ${
             frames.mean.toFixed(2)}, at most ` +
      `${frames.worst.toFixed(2)}; those of a round correlated by ${data.correlation}. Worst regret: ${
             regretText(regret.mean)}, at most ${regretText(regret.worst)}.`;
}

byId('certificate').textContent = certificateText(data.certificate);
byId('subtitle').textContent = `${data.scene} on ${data.backend}, ${data.device}: ${data.settings} settings, ` +
    `${data.feasible} with ${data.constraints.join(', ') || 'no constraint'}, ${data.front} on the front of ` +
    `${data.error_metric}; ${data.seeds} seeds` +
    (data.part < 1 ? `, each on ${percent(data.part)} of the settings, drawn at random` : '');
// A budget without an answer is infinitely far from the best: drawn on a line of its own, above all others.
const regrets = data.strategies.flatMap(({points}) => points.flatMap(({worst_regret: r}) => [r.mean, r.worst]))
                    .filter((value) => value !== null && value > 0);
const lowest = Math.max(kLeastRegret, Math.min(1, ...regrets));
const noAnswer = 3 * Math.max(lowest, ...regrets);
const regretTicks = [-4, -3, -2, -1, 0, 1, 2]
                        .flatMap((decade) => [1, 2, 5].map((m) => m * 10 ** decade))
                        .filter((value) => value >= lowest / 2 && value <= noAnswer / 2);
function drawCharts() {
  draw('regret', 'worst_regret', (value) => (value === null ? noAnswer : Math.max(value, kLeastRegret)), {
    type: 'logarithmic',
    name: 'slower than the best',
    min: lowest / 2,
    max: noAnswer * 1.2,
    afterBuildTicks: (scale) => (scale.ticks = [...regretTicks, noAnswer].map((value) => ({value}))),
    ticks: {autoSkip: false, callback: (value) => (value === noAnswer ? 'no answer' : percent(value))},
  });
  draw(
      'hypervolume', 'hypervolume', (value) => value,
      {type: 'linear', name: 'share of the front', suggestedMax: 1, ticks: {callback: (value) => percent(value)}});
}

drawCharts();
whenColorsChange(drawCharts);
drawTable();
document.body.dataset.rendered = 'true';

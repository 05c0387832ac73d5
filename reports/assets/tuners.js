'use strict';
const data = JSON.parse(document.getElementById('data').textContent);
const byId = (id) => document.getElementById(id);
// Told apart by shape as well as by colour.
const kShapes = ['circle', 'rect', 'triangle', 'rectRot', 'star', 'crossRot'];
const kLeastRegret = 1e-4;  // a log axis has no zero: what is less is drawn here

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const seriesColor = (index) => css(`--series-${index % 8}`);
const percent = (share, digits = 3) => `${Number((100 * share).toPrecision(digits))} %`;

function make(tag, text = '', className = '') {
  const element = document.createElement(tag);
  element.textContent = text;
  if (className) element.className = className;
  return element;
}

/** One line of means and one of worst seeds for each strategy. */
function datasets(figure, place) {
  const lines = [];
  data.strategies.forEach((strategy, index) => {
    for (const part of ['mean', 'worst']) {
      lines.push({
        label: part === 'mean' ? strategy.strategy : `${strategy.strategy}, worst seed`,
        data: strategy.points.map((point) => ({x: point.timed.mean, y: place(point[figure][part])})),
        borderColor: seriesColor(index),
        backgroundColor: seriesColor(index),
        borderWidth: part === 'mean' ? 2 : 1,
        borderDash: part === 'mean' ? [] : [3, 4],
        pointStyle: kShapes[index % kShapes.length],
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
  const text = css('--muted');
  const grid = {color: css('--grid')};
  return new Chart(byId(id), {
    type: 'line',
    data: {datasets: datasets(figure, place)},
    options: {
      animation: false,
      parsing: false,
      responsive: true,
      maintainAspectRatio: false,
      scales: {
        x: {
          type: 'logarithmic',
          min: 0.9 * Math.min(...data.strategies.flatMap(({points}) => points.map(({timed}) => timed.mean))),
          title: {display: true, text: 'settings timed', color: text},
          grid,
          ticks: {color: text, callback: (value) => (/^[125]0*$/.test(String(value)) ? String(value) : '')}
        },
        y: {grid, ...yAxis, title: {display: true, text: yAxis.name, color: text}, ticks: {color: text, ...yAxis.ticks}},
      },
      plugins: {
        legend: {
          labels: {
            color: css('--ink'),
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
        tooltip: {callbacks: {label: ({dataset, parsed}) => `${dataset.label}: ${parsed.y === noAnswer ? 'no answer' : percent(parsed.y)} at ${Math.round(parsed.x)}`}},
      },
    },
  });
}

function figureCells(row, {mean, worst}, text) {
  for (const [value, className] of [[mean, 'number'], [worst, 'number worst']])
    row.appendChild(make('td', value === null ? '∞' : text(value), className));
}

function drawTable() {
  const table = byId('table');
  const head = table.appendChild(make('thead')).appendChild(make('tr'));
  for (const name of ['strategy', 'share', 'settings', '', 'frames', '', 'worst regret', '', 'mean regret', '',
                      'hypervolume', '', 'false front', '', 'seeds without an answer'])
    head.appendChild(make('th', name));
  for (const strategy of data.strategies) {
    const body = table.appendChild(make('tbody'));
    for (const point of strategy.points) {
      const row = body.appendChild(make('tr'));
      const name = row.appendChild(make('td', strategy.strategy));
      name.title = strategy.description;
      row.appendChild(make('td', point.share < 1 ? percent(point.share) : 'to its end', 'number'));
      figureCells(row, point.timed, (value) => String(Math.round(value)));
      figureCells(row, point.samples, (value) => String(Math.round(value)));
      figureCells(row, point.worst_regret, percent);
      figureCells(row, point.mean_regret, percent);
      figureCells(row, point.hypervolume, (value) => value.toFixed(4));
      figureCells(row, point.false_front, percent);
      row.appendChild(make('td', point.uncovered ? `${point.uncovered} of ${data.seeds}` : '', 'number'));
    }
  }
}

byId('subtitle').textContent = `${data.scene} on ${data.backend}, ${data.device}: ${data.settings} settings, ` +
    `${data.feasible} with ${data.constraints.join(', ') || 'no constraint'}, ${data.front} on the front of ` +
    `${data.error_metric}; ${data.seeds} seeds`;
// A budget without an answer is infinitely far from the best: drawn on a line of its own, above all others.
const regrets = data.strategies.flatMap(({points}) => points.flatMap(({worst_regret: r}) => [r.mean, r.worst]))
                    .filter((value) => value !== null && value > 0);
const lowest = Math.max(kLeastRegret, Math.min(1, ...regrets));
const noAnswer = 3 * Math.max(lowest, ...regrets);
const regretTicks = [-4, -3, -2, -1, 0, 1, 2].flatMap((decade) => [1, 2, 5].map((m) => m * 10 ** decade))
                        .filter((value) => value >= lowest / 2 && value <= noAnswer / 2);
draw('regret', 'worst_regret', (value) => (value === null ? noAnswer : Math.max(value, kLeastRegret)), {
  type: 'logarithmic',
  name: 'slower than the best',
  min: lowest / 2,
  max: noAnswer * 1.2,
  afterBuildTicks: (scale) => (scale.ticks = [...regretTicks, noAnswer].map((value) => ({value}))),
  ticks: {autoSkip: false, callback: (value) => (value === noAnswer ? 'no answer' : percent(value))},
});
draw('hypervolume', 'hypervolume', (value) => value,
     {type: 'linear', name: 'share of the front', suggestedMax: 1, ticks: {callback: (value) => percent(value)}});
drawTable();
document.body.dataset.rendered = 'true';
document.body.dataset.lines = data.strategies.length;

// Draws the page, and redraws what depends on the metric, the legend, the colour scheme or the printer.

import {drawAnswers} from './answers.js';
import {charts} from './charts.js';
import {drawChartFigures, redrawCharts} from './details.js';
import {drawEnvironment} from './environment.js';
import {drawExtremes} from './extremes.js';
import {drawFronts} from './fronts.js';
import {drawMarkLegend, drawTechniqueLegend} from './legends.js';
import {byId, data, make} from './page.js';
import {drawPictures} from './pictures.js';
import {metricTitle, state} from './points.js';

function drawMetricControl() {
  const select = /** @type {HTMLSelectElement} */ (byId('metric'));
  select.append(...data.metrics.map(
      (metric, index) =>
          make('option', {value: index, selected: index === state.metric ? '' : null}, metricTitle(metric))));
  const describe = () => (byId('metric-description').textContent = data.metrics[state.metric].description);
  select.addEventListener('change', () => {
    state.metric = Number(select.value);
    describe();
    drawFronts();
    redrawCharts();
  });
  describe();
}

drawAnswers();
drawMetricControl();
drawTechniqueLegend(redrawCharts);
drawMarkLegend();
drawChartFigures();
drawFronts();
drawPictures();
if (data.stress) drawExtremes(data.stress);
drawEnvironment();
Chart.defaults.font.family = 'system-ui, sans-serif';
redrawCharts();

matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redrawCharts);
// Paper is white whatever the screen is; charts are pictures, so they must be redrawn for it.
for (const printing of [true, false]) {
  window.addEventListener(printing ? 'beforeprint' : 'afterprint', () => {
    document.documentElement.classList.toggle('printing', printing);
    redrawCharts();
    for (const entry of charts) entry.chart.resize();
  });
}

document.body.dataset.charts = String(charts.length);
document.body.dataset.points = String(charts.filter((entry) => !entry.spec.overlaid)
                                          .reduce((sum, entry) => sum + entry.chart.data.datasets[0].data.length, 0));
document.body.dataset.rendered = 'true';

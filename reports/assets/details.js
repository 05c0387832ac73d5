// The figure round a chart: its caption, the pinned details under it, and the keyboard.

import {chartConfig, charts} from './charts.js';
import {seriesSwatch} from './marks.js';
import {byId, data, formatTime, make} from './page.js';
import {command, comparison, errorOf, formatBytes, groupLabel, intervalText, settingsElement} from './points.js';
import {moveActive} from './scatter.js';

function detailsElement(point) {
  const metricRows = data.metrics.map(
      (metric, index) => make(
          'tr', {}, make('th', {scope: 'row', title: metric.description}, metric.id),
          make('td', {}, errorOf(point, index))));
  const facts = [
    ['Frame time', `${formatTime(point.time_ns[0])}, ${intervalText(point)}`],
    ['Measured', `${point.samples} samples by ${point.timer}`],
    ['Relief map', `${formatBytes(point.memory_bytes)}, baked in ${formatTime(point.bake_ns)}`],
    ['First draw', `${formatTime(point.first_draw_ns)} with compilation`],
    ...point.breaks.map((text) => ['Breaks', comparison(text)]),
  ];
  return make(
      'div', {}, make('p', {}, settingsElement(point)), make('p', {class: 'case-id'}, make('code', {}, point.id)),
      make(
          'table', {class: 'facts'},
          make(
              'tbody', {},
              ...facts.map(
                  ([name, value]) => make('tr', {}, make('th', {scope: 'row'}, name), make('td', {}, value))))),
      make(
          'details', {}, make('summary', {}, 'All errors'),
          make('table', {class: 'facts'}, make('tbody', {}, ...metricRows))),
      command(point));
}

export function pin(entry, point) {
  entry.pinned = point;
  entry.details.hidden = point === null;
  if (point === null) {
    entry.details.replaceChildren();
  } else {
    const close =
        make('button', {type: 'button', class: 'close', 'aria-label': 'Unpin', onclick: () => pin(entry, null)}, '×');
    entry.details.replaceChildren(close, detailsElement(point));
  }
  entry.chart.draw();
}

function onChartKey(entry, event) {
  const active = entry.chart.getActiveElements()[0];
  if (event.key === 'ArrowRight' || event.key === 'ArrowLeft')
    moveActive(entry.chart, event.key === 'ArrowRight' ? 1 : -1);
  else if (event.key === 'Enter' && active)
    pin(entry, entry.chart.data.datasets[0].data[active.index].point);
  else if (event.key === 'Escape')
    pin(entry, null);
  else
    return;
  event.preventDefault();
}

/** spec: {caption, scene, group (null: all), overlaid, indices, rangePoints, seriesOf(point)} */
function chartFigure(spec) {
  const canvas = make('canvas', {
    tabindex: 0,
    role: 'img',
    'aria-label': `Frame time against error, ${spec.caption}. The table of the front below has the same figures.`
  });
  const details = make('div', {class: 'pinned', 'aria-live': 'polite', hidden: ''});
  const entry = {spec, canvas, details, pinned: null, chart: null};
  canvas.addEventListener('keydown', (event) => onChartKey(entry, event));
  charts.push(entry);
  const legend = spec.overlaid ?
      make(
          'div', {class: 'legend'},
          ...spec.series.map((s) => make('span', {class: 'mark'}, seriesSwatch(s), groupLabel(s)))) :
      null;
  return make(
      'figure', {class: 'chart'}, make('figcaption', {}, spec.caption), legend,
      make('div', {class: 'canvas-box'}, canvas), details);
}

/** Charts are made in the page, for they take their size from it. */
export function redrawCharts() {
  for (const entry of charts) {
    const {data: content, options, plugins} = chartConfig(entry.spec, entry);
    if (entry.chart) {
      entry.chart.data = content;
      entry.chart.options = options;
      entry.chart.update('none');
    } else {
      entry.chart = new Chart(entry.canvas, {type: 'scatter', data: content, options, plugins});
    }
  }
}

export function drawChartFigures() {
  const several = data.groups.length > 1;
  const overlays = [];
  const singles = [];
  data.scenes.forEach((name, scene) => {
    const inScene = data.points.map((_, index) => index).filter((index) => data.points[index].scene === scene);
    if (inScene.length === 0) return;
    const rangePoints = inScene.map((index) => data.points[index]);  // shared, so charts of a scene compare by eye
    const series = [...new Set(rangePoints.map((point) => point.group))];
    if (series.length > 1) {
      overlays.push(chartFigure({
        caption: name,
        scene,
        group: null,
        overlaid: true,
        indices: inScene,
        rangePoints,
        series,
        seriesOf: (point) => point.group
      }));
    }
    const figures = series.map((group) => chartFigure({
                                 caption: groupLabel(group),
                                 scene,
                                 group,
                                 overlaid: false,
                                 rangePoints,
                                 seriesOf: (point) => point.technique,
                                 indices: inScene.filter((index) => data.points[index].group === group)
                               }));
    singles.push(make('h3', {}, name), make('div', {class: 'chart-grid'}, ...figures));
  });
  if (overlays.length) {
    byId('device-charts').append(make('h3', {}, 'Devices compared'), make('div', {class: 'chart-grid'}, ...overlays));
  }
  byId('chart-note').textContent = several ? 'Charts of one scene share their axes.' : '';
  byId('case-charts').append(...singles);
}

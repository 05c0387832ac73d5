// Frame time against error of the chosen scene: one colour and shape a technique, the fronts as step lines.

import {choice, choose, whenChanged} from './choice.js';
import {answerOf, chosenGroups, constraintsOf, frontOf, groupsOf, isShown, isWithin, limitOf, pointsIn} from './decide.js';
import {hideHover, showHover} from './hover.js';
import {readTheme, seriesColor, shapeOf, withAlpha} from './marks.js';
import {byId, data, formatTime} from './page.js';
import {metricAxis, placeOfTime, scaleOptions, timeAxis} from './plot_axes.js';
import {drawOverlay, plotMarks} from './plot_marks.js';
import {briefLabel, metricTitle, sceneName, settingTitle, shortLabel, techniqueIndex} from './points.js';

// Series of techniques: in the order of the registry, of those that are there, so that up to eight have a colour each.
const used = [...new Set(data.points.map(techniqueIndex))].sort((a, b) => a - b);
const seriesOfTechnique = new Map(used.map((technique, series) => [technique, series]));
export const usedTechniques = used;
export const seriesOf = (technique) => seriesOfTechnique.get(technique);

/** What is drawn: fronts by device, and every point that passes the filters; of these `drawn` have a value. */
export const plotted = {
  chart: null,
  marks: null,
  fronts: [],
  dots: [],
  drawn: [],
  active: null
};

/** The numbered front: that of the first device shown, which the strip of pictures goes along. */
export const numberedFront = () => plotted.fronts[0]?.indices ?? [];

function frontsShown(scene) {
  return chosenGroups(scene).map(
      (group) => ({
        group,
        indices: frontOf(pointsIn(scene, group).filter(isShown), choice.metric, constraintsOf(group)),
      }));
}

/** Datasets of one look each: Chart.js draws thousands of points quickly only where they share their options. */
function datasetsOf(axis, theme) {
  const onFront = new Set(plotted.fronts.flatMap(({indices}) => indices));
  const sets = new Map();
  for (const index of plotted.drawn) {
    const point = data.points[index];
    const isFront = onFront.has(index);
    const breaks = !isFront && !constraintsOf(point.group).every((budget) => isWithin(point, budget));
    const series = seriesOf(techniqueIndex(point));
    const isHollow = breaks || (isFront && isOpenMark(point.group));
    const key = `${isFront ? 2 : breaks ? 0 : 1} ${series} ${isHollow}`;
    if (!sets.has(key)) sets.set(key, dotSet(series, theme, {isFront, breaks, isHollow}));
    sets.get(key).data.push({x: placeOfTime(point.time_ns[0]), y: axis.place(point.errors[choice.metric]), index});
  }
  const dots = [...sets.entries()].sort(([a], [b]) => (a < b ? -1 : 1)).map(([, set]) => set);
  const lines = plotted.fronts.map(({indices, group}) => ({
                                     type: 'line',
                                     stepped: 'before',
                                     pointRadius: 0,
                                     pointHitRadius: 0,
                                     borderWidth: 1.5,
                                     borderDash: dashOf(group),
                                     fill: false,
                                     borderColor: withAlpha(theme.ink, 0.75),
                                     data: indices.map((index) => ({
                                                         x: placeOfTime(data.points[index].time_ns[0]),
                                                         y: axis.place(data.points[index].errors[choice.metric])
                                                       })),
                                   }));
  return [...lines, ...dots];
}

function dotSet(series, theme, {isFront, breaks, isHollow}) {
  const shape = shapeOf(series);
  const isOpen = shape === 'star' || shape === 'crossRot';
  const color = withAlpha(seriesColor(theme, series), isFront ? 1 : breaks ? 0.55 : 0.35);
  return {
    type: 'scatter',
    data: [],
    pointBorderColor: color,
    pointBackgroundColor: isHollow ? 'transparent' : color,
    pointBorderWidth: isOpen ? 1.8 :
        breaks               ? 1.2 :
        isHollow             ? 2.2 :
                               0,
    pointStyle: shape,
    pointRadius: isFront ? 5.5 : 3.5,
    pointHoverRadius: 7,
    pointHitRadius: 4,
  };
}

// Fronts of several devices are told apart by their lines' dashes and by full or open marks.
const kDashes = [[], [7, 3], [2, 3], [10, 3, 2, 3]];
const placeAmongDevices = (group) => Math.max(0, groupsOf(choice.scene).indexOf(group));
export const dashOf = (group) => kDashes[placeAmongDevices(group) % kDashes.length];
export const isOpenMark = (group) => placeAmongDevices(group) % 2 === 1;

const dotOf = (chart, hit) => chart.data.datasets[hit.datasetIndex].data[hit.index].index;

function onHover(event, hits, chart) {
  const hit = hits.find(({datasetIndex}) => chart.data.datasets[datasetIndex].type === 'scatter');
  if (hit)
    showHover(dotOf(chart, hit), hit.element.x, hit.element.y, chart);
  else
    hideHover();
}

export function togglePin(index) {
  const pins = choice.pins.includes(index) ? choice.pins.filter((pin) => pin !== index) : [...choice.pins, index];
  choose({pins, picture: index});
}

function budgetLines(axis) {
  const [group] = chosenGroups(choice.scene);
  const limit = group === undefined ? null : limitOf(group);
  const {id, lower_is_better} = data.metrics[choice.metric];
  const text = limit === null ? '' : `${id} ${lower_is_better ? '≤' : '≥'} ${Number(limit.toPrecision(3))}`;
  return {
    error: limit === null ? null : {place: axis.place(limit), text},
    time_ns: choice.time_ms === null ? null : choice.time_ms * 1e6,
  };
}

/** The marks that move with the budgets: drawn anew without a new chart. */
function marksOptions(axis, theme) {
  const groups = chosenGroups(choice.scene);
  const answers = groups.map((group) => answerOf(choice.scene, group));
  const isHere = (index) => index !== null && plotted.drawn.includes(index);
  return {
    axis,
    theme,
    metric: choice.metric,
    fronts: plotted.fronts.map(({group, indices}, at) => ({
                                 indices,
                                 label: groups.length > 1 ? `front, ${shortLabel(group)}` : 'Pareto front',
                                 isNumbered: at === 0
                               })),
    budgets: budgetLines(axis),
    picks: [...new Set(answers.flatMap(({pick, accurate}) => [pick, accurate]).filter(isHere))],
    pins: choice.pins.filter(isHere),
    active: isHere(plotted.active) ? plotted.active : null,
  };
}

export function drawPlot() {
  const theme = readTheme();
  const {scene} = choice;
  plotted.fronts = frontsShown(scene);
  const inScene = chosenGroups(scene).flatMap((group) => pointsIn(scene, group));
  plotted.dots = inScene.filter(isShown);
  const points = inScene.map((index) => data.points[index]);
  const axis = metricAxis(choice.metric, points);
  plotted.axis = axis;
  plotted.drawn = plotted.dots.filter((index) => axis.place(data.points[index].errors[choice.metric]) !== null);
  plotted.marks = marksOptions(axis, theme);
  const metric = data.metrics[choice.metric];
  const options = {
    animation: false,
    responsive: true,
    maintainAspectRatio: false,
    normalized: true,
    parsing: false,
    interaction: {mode: 'nearest', intersect: true},
    onHover,
    onClick: (_event, hits, chart) => {
      const hit = hits.find(({datasetIndex}) => chart.data.datasets[datasetIndex].type === 'scatter');
      if (hit) togglePin(dotOf(chart, hit));
    },
    scales: {
      x: scaleOptions(timeAxis(points), 'frame time (ms)', theme),
      y: scaleOptions(axis, metricTitle(metric) + (metric.lower_is_better ? '' : ', better downwards'), theme),
    },
    plugins: {legend: {display: false}, tooltip: {enabled: false}, plotMarks: {marks: () => plotted.marks}},
  };
  const datasets = datasetsOf(axis, theme);
  if (plotted.chart) {
    plotted.chart.data = {datasets};
    plotted.chart.options = options;
    plotted.chart.update('none');
  } else {
    plotted.chart = new Chart(byId('plot'), {type: 'scatter', data: {datasets}, options, plugins: [plotMarks]});
  }
  describePlot();
}

/** "63 settings on 2 devices" */
export function countText(indices) {
  const settings = new Set(indices.map((index) => data.points[index].setting)).size;
  const devices = new Set(indices.map((index) => data.points[index].group)).size;
  return `${settings} setting${settings === 1 ? '' : 's'}${devices > 1 ? ` on ${devices} devices` : ''}`;
}

/** "on the fronts: opengl 13, vulkan 12"; and what is not drawn */
function frontCounts() {
  const counts = plotted.fronts.map(({group, indices}) => [briefLabel(group), indices.length]);
  const missing = plotted.dots.length - plotted.drawn.length;
  const {id} = data.metrics[choice.metric];
  return (counts.length > 1 ? `; on the fronts: ${counts.map((words) => words.join(' ')).join(', ')}` :
                              `, ${counts[0]?.[1] ?? 0} on the front`) +
      (missing ? `; not drawn, as they have no ${id}: ${missing}` : '');
}

/** "The front goes from flat in 0.2 ms to relief, 8 steps in 0.9 ms." */
function frontEnds({group, indices}) {
  const end = (index) => `${settingTitle(data.points[index])} in ${formatTime(data.points[index].time_ns[0])}`;
  const where = plotted.fronts.length > 1 ? ` of ${briefLabel(group)}` : '';
  return indices.length ? `The front${where} goes from ${end(indices[0])} to ${end(indices[indices.length - 1])}.` :
                          `No setting is on a front${where}.`;
}

/** What a screen reader says instead of the picture. */
function describePlot() {
  const counted = countText(plotted.dots) + frontCounts();
  byId('plot').setAttribute(
      'aria-label',
      `Frame time against ${data.metrics[choice.metric].id} in ${sceneName(choice.scene)}: ${counted}. ${
          plotted.fronts.map(frontEnds).join(' ')} The table below has the same figures.`);
  byId('plot-count').textContent = counted;
}

/** Only what lies over the dots has changed. */
function drawPlotMarks() {
  if (!plotted.chart) return;
  plotted.marks = marksOptions(plotted.axis, readTheme());
  drawOverlay(plotted.chart, plotted.marks);
}

function moveBy(step) {
  const ordered = [...plotted.drawn].sort((a, b) => data.points[a].time_ns[0] - data.points[b].time_ns[0] || a - b);
  if (ordered.length === 0) return;
  const at = ordered.indexOf(plotted.active);
  const next = at < 0 ? (step > 0 ? 0 : ordered.length - 1) : Math.max(0, Math.min(ordered.length - 1, at + step));
  plotted.active = ordered[next];
  drawPlotMarks();
  const {scales} = plotted.chart;
  const point = data.points[plotted.active];
  showHover(
      plotted.active, scales.x.getPixelForValue(placeOfTime(point.time_ns[0])),
      scales.y.getPixelForValue(plotted.axis.place(point.errors[choice.metric])), plotted.chart);
}

function leavePlot() {
  plotted.active = null;
  hideHover();
  drawPlotMarks();
}

function onPlotKey(event) {
  if (event.key === 'ArrowRight' || event.key === 'ArrowLeft')
    moveBy(event.key === 'ArrowRight' ? 1 : -1);
  else if (event.key === 'Enter' && plotted.active !== null)
    togglePin(plotted.active);
  else if (event.key === 'Escape')
    leavePlot();
  else
    return;
  event.preventDefault();
}

export function startPlot() {
  byId('plot').addEventListener('keydown', onPlotKey);
  byId('plot').addEventListener('pointerleave', hideHover);
  byId('plot').addEventListener('blur', leavePlot);
  drawPlot();
}

whenChanged(['scene', 'group', 'metric', 'hidden', 'search', 'map', 'format', 'encoding'], drawPlot);
whenChanged(['error', 'time_ms', 'pins'], drawPlotMarks);

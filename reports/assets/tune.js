// The search's page: the pick, how it was found, and every answer.

import {readTheme, seriesColor, shapeOf, withAlpha} from './marks.js';
import {byId, data, dataTable, make, numberCell, percent, shortNumber} from './page.js';
import {linearAxis, scatterChart} from './scatter.js';

const theme = readTheme();
const number = (value) => shortNumber(value, 4);
const time = (ns) => (ns === null ? '' : `${number(ns / 1e6)} ms`);
const gapText = (gap) => (gap === null ? 'unknown' : percent(gap, 4));

const coarselyFiltered = new Set(data.filter.marked);
const named = (setting) => (coarselyFiltered.has(setting) ? `${setting} *` : setting);

function fillTable(id, heads, rows) {
  const cell = (value, column) => {
    if (heads[column] === 'setting') return make('span', {class: 'settings'}, named(value));
    return /^[\d.]+( (ms|%))?$/.test(value) ? numberCell(value) : value;
  };
  byId(id).append(dataTable(heads, rows.map((row) => row.map(cell))));
}

function showPick() {
  const {certificate: c, pick} = data;
  const none = data.nearest ? `Nothing meets the budgets: ${data.miss}` :
      c.stopped ? 'No pick yet: stopped too early.' :
                  'No pick.';
  const answer = pick ?
      [
        make('p', {class: 'settings'}, named(pick.setting)),
        make(
            'p', {},
            `${time(pick.time_ns)}, at most ${time(pick.high_ns)}; ${data.error_metric} ${number(pick.error)}; ` +
                `within ${gapText(pick.gap)} of the best`)
      ] :
      [
        make('p', {class: 'open'}, none),
        data.nearest ? make('p', {class: 'settings'}, `nearest: ${data.nearest}`) : null
      ];
  byId('pick').append(
      ...answer.filter(Boolean), coarselyFiltered.size ? make('p', {class: 'notice'}, data.filter.note) : '',
      make('p', {class: c.held ? 'certified' : 'open'}, `${c.claim[0].toUpperCase()}${c.claim.slice(1)}.`),
      make(
          'p', {class: 'muted'},
          `${c.measured} settings timed with ${c.samples} samples, those of a round correlated by at most ` +
              `${number(c.correlation)}; slack of the monotone assumption ` +
              `${gapText(c.slack)}, ${c.audits} audits, ${c.audit_failures} wrong.`));
}

function showRungs() {
  fillTable('rungs', ['time', 'setting', 'more', 'less', 'buys'], data.rungs.map((rung, i) => {
    const before = data.rungs[i - 1];
    return [
      time(rung.time_ns), rung.setting, rung.gained.join(', '), rung.dropped.join(', '),
      before ? `${number(100 * (1 - rung.time_ns / before.time_ns))} % less time` : ''
    ];
  }));
}

function showScenes() {
  const place = byId('scenes');
  for (const [title, list, text] of [
           [
             'Each scene by itself', data.scene_answers,
             (s) => s.own ?
                 `${time(s.own_time_ns)} (the common pick takes ${time(s.common_time_ns)}): ${s.own.setting}` :
                 'no answer'
           ],
           [
             'Held out', data.holdout,
             (s) => s.failure || `${s.meets ? 'meets the budgets' : s.miss}, ${time(s.time_ns)}`
           ]]) {
    if (list.length === 0) continue;
    place.append(
        make('h3', {}, title),
        make('ul', {}, ...list.map((scene) => make('li', {}, `${scene.scene}: ${text(scene)}`))));
  }
}

// Errors reach from exact zero over many decades: log10, zeros at a place of their own under the least other error.
const errors = data.settings.map((s) => s.error).filter((e) => e > 0);
const leastError = errors.reduce((a, b) => Math.min(a, b), errors[0] || 1);
const placeError = (error) => Math.log10(error > 0 ? error : leastError / 10);
const placeTime = (ns) => Math.log10(ns / 1e6);
const errorTick = (value) =>
    (errors.length < data.settings.length && value <= Math.log10(leastError / 5) ? '0' : number(10 ** value));

const axis = (title, callback) => linearAxis(theme, title, callback);
const power = (value) => number(Number((10 ** value).toPrecision(2)));

const draw = (id, datasets, x, y, tooltip) => scatterChart(byId(id), datasets, {
  x,
  y,
  legend: {display: datasets.length > 1, labels: {color: theme.ink, usePointStyle: true}},
  tooltip: {callbacks: {label: (item) => tooltip(item.raw)}},
});

/** The front as steps: each answer holds up to the error of the next cheaper one. */
function steps(points) {
  const corners = [];
  points.forEach((point, i) => {
    corners.push(point);
    if (points[i + 1]) corners.push({...point, y: points[i + 1].y});
  });
  return corners;
}

function drawFront() {
  const of = (evidence, bound) =>
      data.settings.filter((s) => s.feasible && s.evidence === evidence && s[bound] !== null)
          .map((s) => ({
                 x: placeTime(s[bound]),
                 y: placeError(s.error),
                 s,
               }));
  const picks = steps(data.answers.map((a) => ({x: placeTime(a.time_ns), y: placeError(a.error), s: a})));
  const dots = (label, points, series) => ({
    label,
    data: points,
    backgroundColor: withAlpha(seriesColor(theme, series), 0.6),
    borderColor: seriesColor(theme, series),
    pointStyle: shapeOf(series),
    radius: 3.5,
  });
  draw(
      'front',
      [
        {
          label: 'answers',
          data: picks,
          showLine: true,
          borderColor: theme.ink,
          backgroundColor: theme.ink,
          borderWidth: 1.5,
          radius: 0
        },
        dots('measured', of('measured', 'time_ns'), 0), dots('ruled out: lower bound', of('assumed', 'low_ns'), 1)
      ],
      axis('frame time, ms', power), axis(data.error_metric, errorTick),
      ({s}) => `${time(s.time_ns || s.low_ns)}, ${number(s.error)}: ${s.setting}`);
}

function drawGap() {
  const asked = Math.log10(data.question.epsilon);
  const line = (label, gap, series) => ({
    label,
    data: data.path.filter((p) => p[gap] > 0).map((p) => ({x: p.samples, y: Math.log10(p[gap]), p, gap: p[gap]})),
    showLine: true,
    borderColor: seriesColor(theme, series),
    backgroundColor: seriesColor(theme, series),
    pointStyle: shapeOf(series),
    radius: 3,
  });
  const last = data.path.length ? data.path[data.path.length - 1].samples : 1;
  draw(
      'gap',
      [
        line('of all settings', 'worst_gap', 0), line('of those timed so far', 'timed_gap', 1), {
          label: 'asked',
          data: [0, last].map((x) => ({x, y: asked})),
          showLine: true,
          borderColor: seriesColor(theme, 3),
          borderDash: [6, 4],
          radius: 0,
          pointStyle: 'line'
        }
      ],
      axis('samples', number), axis('gap, %', (value) => number(Number((100 * 10 ** value).toPrecision(2)))),
      ({p, gap}) => (p ? `${p.samples} samples, ${p.measured} settings: ${gapText(gap)}` : 'asked'));
}

/** With one answer: how long what was its pick takes, as it turned out. */
function drawPickHistory() {
  const title = 'The pick over time';
  byId('history-title').textContent = title;
  byId('history').setAttribute('aria-label', title);
  byId('budget-gap-figure').remove();
  const points = data.path.filter(({picks}) => picks.length > 0).map(({samples, picks}) => {
    const s = data.settings[picks[0]];
    return {x: samples, y: s.time_ns / 1e6, s};
  });
  draw(
      'history', [{
        label: 'pick',
        data: points,
        showLine: true,
        stepped: true,
        borderColor: seriesColor(theme, 0),
        backgroundColor: seriesColor(theme, 0),
        radius: 3,
      }],
      axis('samples', number), axis('frame time of the pick so far, ms (final estimate)', number),
      ({x, s}) => `${x} samples: ${time(s.time_ns)}: ${s.setting}`);
}

function drawHistory() {
  const answered = data.path.filter(({picks}) => picks.length > 0);
  const shown = [0.05, 0.2, 0.5, 1].map((share) => answered[Math.ceil(share * answered.length) - 1]).filter(Boolean);
  const fronts = shown.map((point, i) => {
    const picks = point.picks.map((index) => data.settings[index]).filter((s) => s.time_ns !== null);
    const color = seriesColor(theme, i);
    return {
      label: `${point.samples} samples`,
      data: steps(picks.map((s) => ({x: placeTime(s.time_ns), y: placeError(s.error), s}))),
      showLine: true,
      borderColor: color,
      backgroundColor: color,
      borderWidth: 1 + 0.5 * i,
      pointStyle: shapeOf(i),
      radius: 2,
    };
  });
  draw(
      'history', fronts, axis('frame time, ms (final estimate)', power), axis(data.error_metric, errorTick),
      ({s}) => `${time(s.time_ns)}, ${number(s.error)}: ${s.setting}`);
}

function drawBudgetGap() {
  const points = data.answers.filter((a) => a.gap !== null).map((a) => ({x: placeError(a.error), y: 100 * a.gap, a}));
  draw(
      'budget-gap', [{
        label: 'gap',
        data: points,
        backgroundColor: seriesColor(theme, 0),
        borderColor: seriesColor(theme, 0),
        radius: 4
      }],
      axis(`${data.error_metric} at most`, errorTick), {...axis('gap, %', number), min: 0},
      ({a}) => `${number(a.error)}: ${time(a.time_ns)}, within ${gapText(a.gap)}: ${a.setting}`);
}

function showSettings() {
  const {space} = data;
  const count = (evidence) => data.settings.filter((s) => s.evidence === evidence).length;
  byId('counts').textContent =
      `${space.settings} settings, ${space.conflicts} combinations refused by the registry. ${space.scored} scored` +
      (space.bisected ? `, by bisection: ${space.assumed} taken to be no faster than a scored one with fewer steps, ` +
               `${space.hopeless} miss the budgets as more steps do` :
                        '') +
      `; ${space.failed} failed, ${space.unscored} left when the time was up. Of the scored: ${
          count('measured')} measured, ` +
      `${count('assumed')} ruled out by assumption, ${
          data.settings.filter((s) => !s.feasible).length} miss the budgets.`;
  const rows = data.settings.filter((s) => s.evidence === 'measured' || s.evidence === 'assumed')
                   .sort((a, b) => (a.time_ns || a.low_ns) - (b.time_ns || b.low_ns));
  fillTable(
      'states', ['time', 'low', 'high', data.error_metric, 'samples', 'evidence', 'setting'],
      rows.map(
          (s) =>
              [time(s.time_ns), time(s.low_ns), time(s.high_ns), number(s.error), String(s.samples), s.evidence,
               s.setting]));
}

byId('subtitle').textContent = `${data.scenes.join(', ')}; ${data.backend}, ${data.device}` +
    (data.replayed ? `; replayed from ${data.replayed}` : '') +
    (data.question.max_error.length ? `; asked: ${data.question.max_error.join(', ')}` : '; asked: every budget');
showPick();
showRungs();
showScenes();
drawFront();
drawGap();
if (data.question.max_error.length) {
  drawPickHistory();
} else {
  drawHistory();
  drawBudgetGap();
}
fillTable(
    'answers', [`${data.error_metric} at most`, 'time', 'at most', 'within', 'setting'],
    data.answers.map((a) => [number(a.error), time(a.time_ns), time(a.high_ns), gapText(a.gap), a.setting]));
showSettings();
document.body.dataset.rendered = 'true';

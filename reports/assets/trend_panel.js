// One series: its charts, their legend, what is known of it, and all of its nights as a table.

import {swatch} from './marks.js';
import {data, dataTable, factsTable, make, numberCell, percent, shortNumber} from './page.js';
import {controlOf, dotsOf, drawCharts, notesOf, seriesCharts} from './trend_chart.js';
import {changeOf, changeText, effectText, environmentOf, eventOf, formatDay, formatMoment, formatValue, glyphOf, levelOn, seriesName, shiftText, shortCommit, toneOf, whereElement} from './trend_data.js';
import {epochsOf, epochTable} from './trend_epochs.js';
import {linkTo} from './trend_state.js';

/** The levels as a sentence. */
function summaryOf(series) {
  if (series.levels.length === 0) return `No level in ${series.nights.length} nights.`;
  const last = series.levels[series.levels.length - 1];
  if (series.drift) {
    const [from, to] = [last.first, last.end - 1].map((at) => formatValue(series, levelOn(series, last, at)));
    return `Drifting from ${from} to ${to}.`;
  }
  const parts = series.levels.map(
      ({first, value}) => `${formatValue(series, value)} from ${formatDay(data.runs[series.nights[first]].time)}`);
  return `${parts.join(', then ')}.`;
}

function legend(series, dots) {
  const kinds = new Set(dots.map(({kind}) => kind));
  const entry = (shown, shape, style, text) =>
      (shown ? make('span', {class: 'mark'}, swatch(shape, style), text) : null);
  const outline = (color) => ({fill: 'none', stroke: color, 'stroke-width': 1.5});
  const levels = percent(data.options.confidence);
  const hasStep = series.events.some((id) => eventOf.get(String(id)).kind !== 'drift');
  return make(
      'div', {class: 'legend'},
      entry(
          kinds.has('night'), 'M8 1v3M8 12v3M8 4.5a3.5 3.5 0 1 0 .01 0z',
          {fill: 'var(--series-0)', stroke: 'var(--series-0)'}, 'night, with standard error'),
      entry(
          series.levels.length > 0, 'M1 4h14v8H1zM1 8h14',
          {fill: 'var(--series-0)', 'fill-opacity': 0.25, stroke: 'var(--ink)', 'stroke-width': 1},
          series.drift ? 'drift' : `level, with ${levels} interval`),
      entry(
          kinds.has('spike'), 'triangle', {fill: 'var(--series-4)'},
          'spike: a night that stands alone; on a shaft: beyond the axis'),
      entry(kinds.has('left'), 'circle', outline('var(--muted)'), 'not looked at'),
      entry(kinds.has('missing'), 'M4 4l8 8M12 4l-8 8', outline('var(--muted)'), 'no value'),
      entry(
          hasStep, 'M4 1v14M12 1v14', {...outline('var(--series-1)'), 'stroke-dasharray': '2.5 2'},
          'where the change lies'),
      entry(
          notesOf(series).length > 0, 'M4 1v14M4 1h9l-3 3.5 3 3.5h-9', {fill: 'var(--ink)', stroke: 'var(--ink)'},
          'note'),
      entry(series.scores.length > 1, 'rectRot', {fill: 'var(--series-3)'}, 'errors changed'),
      entry(
          controlOf(series), 'M1 8h14M5.5 5.5h5v5h-5z', {fill: 'var(--series-7)', stroke: 'var(--series-7)'},
          'control case, off its median'));
}

function eventLinks(series) {
  if (series.events.length === 0) return null;
  return make('span', {}, ...series.events.map((id) => {
    const event = eventOf.get(String(id));
    return make(
        'a', {class: `event-link ${toneOf(event)}`, href: linkTo({view: 'event', event: id})},
        `${glyphOf(event)} ${effectText(event)}, ${event.state}`);
  }));
}

function facts(series) {
  const last = series.levels[series.levels.length - 1];
  const share = (value, digits = 2) => (value === null ? null : percent(value, digits));
  return factsTable([
    ['Events', eventLinks(series)],
    [
      'Level now',
      last &&
          (series.drift ? `${formatValue(series, levelOn(series, last, last.end - 1))}, where the drift has come to` :
                          `${formatValue(series, last.value)} (${formatValue(series, last.low)} to ${
                              formatValue(series, last.high)})`)
    ],
    [series.drift ? 'Over all nights' : 'Last step', last && changeText(changeOf(series))],
    ['Drift', series.drift && `${percent(series.drift.per_night, 2)} a night`],
    [
      'Noise of a night',
      series.sigma === null ? null :
                              share(series.sigma) +
              (series.autocorrelation === null ? '' : `, autocorrelation ${shortNumber(series.autocorrelation, 2)}`)
    ],
    ['Smallest shift', series.drift ? null : shiftText(series.smallest_shift)],
    ['Setting', make('code', {}, series.setting)],
  ]);
}

const kKindTexts = {
  night: '',
  spike: 'spike',
  left: 'not looked at',
  missing: 'no value'
};

function nightsTable(series, dots) {
  const rows = dots.map(({at, kind}) => {
    const run = data.runs[series.nights[at]];
    const [value, error] = [series.values[at], series.errors[at]];
    return [
      formatMoment(run.time), make('code', {}, shortCommit(run.commit)),
      numberCell(value === null ? '–' : formatValue(series, value)), numberCell(error ? percent(error, 2) : '–'),
      environmentOf(run).hash, kKindTexts[kind]
    ];
  });
  return dataTable(['Night', 'Commit', series.metric, 'Standard error', 'Environment', ''], rows.reverse());
}

/** Filled when it is first opened: hundreds of rows that few want. */
function lazyDetails(title, content) {
  const details = make('details', {}, make('summary', {}, title));
  details.addEventListener('toggle', () => details.append(content()), {once: true});
  return details;
}

function noteList(series) {
  const notes = notesOf(series);
  return notes.length === 0 ?
      null :
      make(
          'ul', {class: 'notes'},
          ...notes.map(
              ({run, time, by, text}) => make(
                  'li', {},
                  make('span', {class: 'muted'}, `${formatDay(run === null ? time : data.runs[run].time)}, ${by}: `),
                  text)));
}

/** Shows the series in `place`. */
export function showSeries(place, series) {
  const {dots} = dotsOf(series);
  place.replaceChildren(make(
      'figure', {class: 'chart'}, make('h3', {class: 'series-name'}, seriesName(series)),
      make('p', {}, whereElement(series)), ...seriesCharts(series, summaryOf(series)), legend(series, dots),
      noteList(series), facts(series), epochsOf(series.machine).length > 1 ? epochTable(series.machine) : null,
      lazyDetails(`All ${dots.length} nights as a table`, () => nightsTable(series, dots))));
  drawCharts(place);
}

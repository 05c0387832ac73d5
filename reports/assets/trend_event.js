// One event: what moved, its history, the chosen one of its series, and all of them small.

import {byId, data, make} from './page.js';
import {changeOf, changeText, effectText, eventOf, formatDay, formatMoment, glyphOf, intervalOf, seriesId, seriesOf, toneOf, whereElement} from './trend_data.js';
import {commitsElement, factsOf, statePill} from './trend_overview.js';
import {fillPaged} from './trend_paged.js';
import {showSeries} from './trend_panel.js';
import {seriesSpark} from './trend_spark.js';
import {linkTo, markCurrent, state} from './trend_state.js';

function historyList(event) {
  const notes = data.annotations.filter((note) => String(note.event) === String(event.id))
                    .map((note) => ({...note, state: 'note'}));
  const lines = [...event.states, ...notes].sort((a, b) => (a.time < b.time ? -1 : 1));
  return make(
      'ol', {class: 'history'},
      ...lines.map(
          (line) => make(
              'li', {}, make('span', {class: 'muted'}, formatMoment(line.time)), statePill(line.state),
              make('span', {}, `${line.by}${line.text ? `: ${line.text}` : ''}`))));
}

const headOf = (event) => make(
    'div', {class: `card event-card ${toneOf(event)}`}, make('h2', {tabindex: -1}, event.what),
    make(
        'p', {class: 'headline'}, make('span', {class: 'glyph', 'aria-hidden': 'true'}, glyphOf(event)),
        effectText(event), make('span', {class: 'muted'}, intervalOf(event))),
    make(
        'p', {class: 'facts-line'}, statePill(event.state),
        ...factsOf(event).map((fact) => make('span', {class: 'muted'}, fact))),
    make(
        'p', {class: 'facts-line'},
        make(
            'span', {},
            `last seen as before on ${formatDay(data.runs[event.good_run].time)}, moved by ${
                formatDay(data.runs[event.bad_run].time)}`),
        commitsElement(event)),
    event.text ? make('p', {}, event.text) : null, historyList(event));

function multiple(event, index) {
  const series = data.series[index];
  return make(
      'li', {},
      make(
          'a', {
            class: 'multiple',
            href: linkTo({view: 'event', event: event.id, series: seriesId(index)}),
            'data-series': seriesId(index)
          },
          make(
              'span', {class: 'multiple-head'}, make('strong', {}, series.name),
              make('span', {}, changeText(changeOf(series)))),
          whereElement(series), seriesSpark(series, event)));
}

function drawMultiples(event) {
  const sorted =
      [...event.series].sort((a, b) => Math.abs(changeOf(data.series[b])) - Math.abs(changeOf(data.series[a])));
  byId('event-multiples')
      .replaceChildren(
          make('h2', {}, `All of its ${event.series.length} series`),
          fillPaged(make('ul', {class: 'multiples'}), sorted, (index) => multiple(event, index), 24));
  return sorted[0];
}

let drawn_event = null;
let first_series;

export function drawEvent() {
  const event = eventOf.get(state.event);
  if (!event) {
    byId('event-head')
        .replaceChildren(
            make('h2', {tabindex: -1}, `No event ${state.event} here`),
            make('p', {}, make('a', {href: '#'}, 'Back to the overview')));
    byId('event-series').replaceChildren();
    byId('event-multiples').replaceChildren();
    drawn_event = null;
    return;
  }
  if (drawn_event !== event) {
    drawn_event = event;
    byId('event-head').replaceChildren(headOf(event));
    first_series = drawMultiples(event);
  }
  const index = seriesOf.get(state.series) ?? first_series;
  markCurrent(byId('event-multiples').querySelectorAll('a'), (link) => link.dataset.series === seriesId(index));
  if (index !== undefined) showSeries(byId('event-series'), data.series[index]);
}

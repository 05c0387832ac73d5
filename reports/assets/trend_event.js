// One event: what moved, its history, the chosen one of its series, and all of them small.

import {byId, data, make} from './page.js';
import {changeAcross, changeText, dayOf, effectText, eventOf, formatMoment, glyphOf, intervalOf, seriesId, seriesName, seriesOf, toneOf, whereElement} from './trend_data.js';
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

function whenText({kind, good_run: good, bad_run: bad}) {
  if (kind === 'drift') return `from ${dayOf(good)} to ${dayOf(bad)}`;
  return bad === null ? 'changed before these nights' :
                        `last seen as before on ${dayOf(good)}, changed by ${dayOf(bad)}`;
}

/** What the history does not end in anyway. */
const reasonOf = ({text, states}) => (text && text !== states[states.length - 1].text ? make('p', {}, text) : null);

const headOf = (event) => make(
    'div', {class: `card event-card ${toneOf(event)}`}, make('h2', {tabindex: -1}, event.what),
    make(
        'p', {class: 'headline'}, make('span', {class: 'glyph', 'aria-hidden': 'true'}, glyphOf(event)),
        effectText(event), make('span', {class: 'muted'}, intervalOf(event))),
    make(
        'p', {class: 'facts-line'}, statePill(event.state),
        ...factsOf(event).map((fact) => make('span', {class: 'muted'}, fact))),
    make('p', {class: 'facts-line'}, make('span', {}, whenText(event)), commitsElement(event)), reasonOf(event),
    historyList(event));

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
          make('strong', {}, seriesName(series)),
          make(
              'span', {class: 'multiple-line'},
              make('span', {class: 'change'}, changeText(changeAcross(series, event))), whereElement(series)),
          seriesSpark(series, event)));
}

function drawMultiples(event) {
  const size = (index) => Math.abs(changeAcross(data.series[index], event));
  const sorted = [...event.series].sort((a, b) => size(b) - size(a));
  byId('event-multiples')
      .replaceChildren(
          make('h2', {}, `All of its ${event.series.length} series`),
          fillPaged(make('ul', {class: 'multiples'}), sorted, (index) => multiple(event, index), 24));
  return sorted[0];
}

let drawnEvent = null;
let firstSeries;

export function drawEvent() {
  const event = eventOf.get(state.event);
  if (!event) {
    byId('event-head')
        .replaceChildren(
            make('h2', {tabindex: -1}, `No event ${state.event} here`),
            make('p', {}, make('a', {href: '#'}, 'Back to the overview')));
    byId('event-series').replaceChildren();
    byId('event-multiples').replaceChildren();
    drawnEvent = null;
    return;
  }
  if (drawnEvent !== event) {
    drawnEvent = event;
    byId('event-head').replaceChildren(headOf(event));
    firstSeries = drawMultiples(event);
  }
  const index = seriesOf.get(state.series) ?? firstSeries;
  markCurrent(byId('event-multiples').querySelectorAll('a'), (link) => link.dataset.series === seriesId(index));
  if (index === undefined)
    byId('event-series').replaceChildren(make('p', {class: 'missing'}, 'None of its series is on this page.'));
  else
    showSeries(byId('event-series'), data.series[index]);
}

// The answer first: did anything move, and what to do about it.

import {copyButton} from './copy.js';
import {byId, data, make, percent, shortNumber} from './page.js';
import {dayOf, effectText, eventGroups, formatDay, glyphOf, intervalOf, isRevision, machineName, shortCommit, toneOf} from './trend_data.js';
import {fillPaged} from './trend_paged.js';
import {eventSpark} from './trend_spark.js';
import {linkTo} from './trend_state.js';

const kLate_ms = 2.5 * 86400e3;
const sentence = (text) => text.charAt(0).toUpperCase() + text.slice(1);

/** What would have been seen, had it been there. */
function sensitivityText() {
  const known = data.machines.filter((machine) => machine.smallest_shift !== null);
  if (known.length === 0) return 'Too few nights to say which shift would be seen.';
  const shifts = known.map(({name, smallest_shift: shift}) => `${percent(shift, 2)} on ${name}`);
  return `A shift of ${shifts.join(', ')} would be found within 5 nights in 9 of 10 cases.`;
}

function lateMachines() {
  const late = data.machines.filter(({last}) => last && Date.parse(data.made) - Date.parse(last) > kLate_ms);
  return late.map(({name, last}) => make('p', {class: 'notice'}, `${name} was last seen on ${formatDay(last)}.`));
}

function drawVerdict() {
  if (data.runs.length === 0) {
    byId('verdict').append(
        make('p', {class: 'headline'}, 'No nights yet'),
        make('p', {class: 'muted'}, 'Once nights are recorded, this page says what moved between them.'));
    return;
  }
  const [answer, scope] = data.verdict.text.split('; ');
  const isEarly = data.verdict.exit === 0 && data.verdict.nights_to_wait > 0;
  const glyph = isEarly ? '…' : data.verdict.exit === 0 ? '✓' : '▲';
  if (!isEarly) byId('verdict').classList.add(data.verdict.exit === 0 ? 'calm' : 'alert');
  byId('verdict').append(
      make(
          'p', {class: 'headline'}, make('span', {class: 'glyph', 'aria-hidden': 'true'}, glyph), sentence(answer),
          make('span', {class: 'muted'}, scope ?? '')),
      make('p', {class: 'muted'}, sensitivityText()), ...lateMachines());
}

export const statePill = (state) => make('span', {class: `pill ${state}`}, state);

/** "good..bad", with the command that lists what lies between. */
export function commitsElement({commits: [good, bad]}) {
  const range = make('code', {}, `${shortCommit(good)}..${shortCommit(bad)}`);
  if (!isRevision(good) || !isRevision(bad)) return range;
  return make('span', {class: 'commits'}, range, ' ', copyButton(`git log ${good}..${bad}`, 'Copy git log'));
}

const surenessText = ({q, effect}) =>
    (q === null || effect === null ?
         null :
         `q ${q < 1e-3 ? Number(q).toExponential(0).replace('e-', 'e−') : shortNumber(q, 2)}`);
/** Facts of an event as short texts: where, how many series, how sure. */
export const factsOf =
    (event) => [machineName(event.machine), `${event.series.length} series`, surenessText(event)].filter(Boolean);

function eventRow(event) {
  return make(
      'li', {class: `event-row ${toneOf(event)} ${event.state}`},
      make(
          'div', {class: 'effect'},
          make('strong', {}, make('span', {class: 'glyph', 'aria-hidden': 'true'}, glyphOf(event)), effectText(event)),
          make('span', {class: 'muted'}, intervalOf(event))),
      make(
          'div', {}, make('a', {class: 'what', href: linkTo({view: 'event', event: event.id})}, event.what),
          make(
              'p', {class: 'muted facts-line'}, statePill(event.state),
              ...factsOf(event).map((fact) => make('span', {}, fact))),
          make(
              'p', {class: 'facts-line'},
              make('span', {}, `since ${dayOf(event.kind === 'drift' ? event.good_run : event.bad_run)}`),
              commitsElement(event)),
          event.text ? make('p', {class: 'muted'}, event.text) : null),
      event.effect === null ? null : eventSpark(event));
}

function groupElement({title, folded, events}) {
  const list = fillPaged(make('ul', {class: 'event-list'}), events, eventRow);
  const head = `${title} (${events.length})`;
  return folded ? make('details', {class: 'event-group'}, make('summary', {}, make('h2', {}, head)), list) :
                  make('div', {class: 'event-group'}, make('h2', {}, head), list);
}

export function drawOverview() {
  drawVerdict();
  byId('events').append(...eventGroups().map(groupElement));
  const {least_effect: effect, least_nights: nights, false_discovery_rate: rate, confidence} = data.options;
  const question = `Looked for: steps of at least ${percent(effect)} that last ${nights} nights, with at most ${
      percent(rate)} false alarms. `;
  const terms =
      `Ranges are ${percent(confidence)} intervals; q is the share of false alarms among changes as clear as ` +
      'this one. Commits: the last before the change, and the first surely after it.';
  byId('events').append(make('p', {class: 'muted footnote'}, question, data.events.length ? terms : ''));
}

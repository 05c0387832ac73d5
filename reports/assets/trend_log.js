// Every state of every event and every note, the newest first.

import {byId, data, make} from './page.js';
import {effectText, eventOf, formatMoment, glyphOf, machineName, runText} from './trend_data.js';
import {statePill} from './trend_overview.js';
import {fillPaged} from './trend_paged.js';
import {linkTo} from './trend_state.js';

const eventLink = (event) =>
    make('a', {href: linkTo({view: 'event', event: event.id})}, `${event.what} on ${machineName(event.machine)}`);

function subjectOf({event, run}) {
  if (event)
    return [eventLink(event), ' ', make('span', {class: 'muted mark'}, `${glyphOf(event)} ${effectText(event)}`)];
  return [`night of ${runText(data.runs[run])} on ${machineName(data.runs[run].machine)}`];
}

const logItem = (entry) => make(
    'li', {}, make('span', {class: 'muted when'}, formatMoment(entry.time)), statePill(entry.state),
    make(
        'div', {}, make('p', {}, ...subjectOf(entry)),
        make('p', {class: 'muted'}, `${entry.by}${entry.text ? `: ${entry.text}` : ''}`)));

export function drawLog() {
  const states = data.events.flatMap((event) => event.states.map((line) => ({...line, event})));
  const notes = data.annotations.map(
      ({time, by, text, run, event}) =>
          ({time, by, text, run, state: 'note', event: event === null ? null : eventOf.get(String(event))}));
  const lines = [...states, ...notes].sort((a, b) => (a.time < b.time ? 1 : -1));
  byId('log-entries')
      .append(
          lines.length ? fillPaged(make('ol', {class: 'log'}), lines, logItem) :
                         make('p', {class: 'missing'}, 'Nothing was decided or noted yet.'));
}

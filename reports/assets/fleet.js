// One setting for all places, and what it costs to ship the best of one place in another: what `choose` says.

import {byId, data, dataTable, formatTime, letterOf, make, numberCell, percent} from './page.js';
import {comparison} from './points.js';
import {nameElement} from './setting_name.js';

const shareText = (share) => (share < 0.0005 ? '0 %' : percent(share, share < 0.1 ? 2 : 3));
const lossText = ({loss, interval: [low, high]}) => `${shareText(loss)} [${shareText(low)}, ${shareText(high)}]`;

/** Where an error rests on a sampler that is coarser than a GPU's. */
const markOf = (...losses) => (losses.some((loss) => loss && loss.coarse_filter > 0) ? '*' : '');

/** The deeper the colour, the more is lost: full at half as much time again. */
function lossCell(loss, isOwn) {
  if (loss === null) return make('td', {class: 'muted'}, 'not within, or not measured');
  const cell = make('td', {class: 'number'}, isOwn ? 'own best' : lossText(loss));
  const depth = Math.round(45 * Math.min(1, loss.loss / 0.5));
  if (!isOwn) cell.style.background = `color-mix(in srgb, var(--bad) ${depth}%, transparent)`;
  return cell;
}

export function drawFleet() {
  const {fleet} = data;
  const section = byId('fleet');
  section.hidden = fleet === null;
  byId('fleet-link').hidden = fleet === null;
  if (fleet === null) return;
  if (fleet.refusal) {
    byId('fleet-rows').replaceChildren(make('p', {class: 'notice'}, `No setting for all: ${fleet.refusal}`));
    return;
  }
  const {places, settings: [pick]} = fleet;
  const budgets = fleet.budgets.map(comparison).join(' and ');
  const worst = pick.combined;
  byId('fleet-rows')
      .replaceChildren(
          make(
              'p', {class: 'sentence'}, nameElement(pick.name, pick.key, {mark: markOf(...pick.places)}),
              `: at most ${lossText(worst)} slower than each place's own best`),
          make(
              'p', {class: 'muted'},
              `Of ${fleet.common_settings} settings that are within ${budgets} in all ${places.length} places; ` +
                  (fleet.ties ? `${fleet.ties} others cannot be told from it. ` : '') +
                  `All intervals hold together with ${percent(fleet.confidence)}.`),
          dataTable(
              ['', 'Place', 'Its time', 'Slower by', 'Own best'],
              places.map(
                  (place, p) =>
                      [letterOf(p),
                       `${place.scene}, ${place.device} (${place.backend}) ${markOf(pick.places[p])}`.trim(),
                       numberCell(formatTime(pick.places[p].time_ns)), lossCell(pick.places[p], false),
                       place.key === pick.key ?
                           'the same' :
                           nameElement(place.name, place.key, {mark: markOf(place.best_in_each_place[p])})])),
          ...(fleet.filter_notes || []).map((note) => make('p', {class: 'muted'}, note)),
          make(
              'details', {open: places.length <= 3 ? '' : null},
              make('summary', {}, 'What it costs to ship the best of one place in another'),
              dataTable(
                  ['best of', ...places.map((_, p) => `in ${letterOf(p)}`)],
                  places.map(
                      (place,
                       p) => [letterOf(p), ...place.best_in_each_place.map((loss, q) => lossCell(loss, p === q))]))));
}

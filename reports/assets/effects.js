// What each axis of the space does, all else equal: ratios of time and error over matched pairs, with intervals.

import {choice, whenChanged} from './choice.js';
import {chosenGroups} from './decide.js';
import {refill} from './focus.js';
import {drawn} from './marks.js';
import {byId, data, formatNumber, make} from './page.js';
import {shortLabel} from './points.js';

const kRowsShown = 10;
const kFewPairs = 4;   // under these there is hardly an interval
const kMostRatio = 4;  // where the scale ends, and its inverse
const kWidth = 120;

const placeOfRatio = (ratio) => {
  const share = Math.log(Math.max(1 / kMostRatio, Math.min(kMostRatio, ratio))) / Math.log(kMostRatio);
  return kWidth / 2 + share * (kWidth / 2 - 5);
};

/**
 * A dot with its interval, on a logarithmic scale from a quarter to four times; the line in the middle is no change.
 */
function ratioPicture([median, low, high]) {
  const tone = high < 1 ? 'var(--good)' : low > 1 ? 'var(--bad)' : 'var(--muted)';
  const [at, from, to] = [median, low, high].map(placeOfRatio);
  return drawn(
      'svg', {viewBox: `0 0 ${kWidth} 14`, width: kWidth, height: 14, 'aria-hidden': 'true'},
      drawn('path', {d: `M${kWidth / 2} 0V14`, stroke: 'var(--line)', fill: 'none'}),
      drawn('path', {d: `M${from} 7H${Math.max(to, from + 0.5)}`, stroke: tone, 'stroke-width': 2, fill: 'none'}),
      drawn('circle', {cx: at, cy: 7, r: 4, fill: tone}));
}

const ratioNumber = (ratio) =>
    (ratio >= 1000                    ? 'over 1000' :
         ratio < 0.001                ? 'under 0.001' :
         Math.abs(ratio - 1) < 0.0005 ? '1' :
                                        formatNumber(ratio));

function ratioCell(ratio) {
  if (ratio === null) return make('td', {class: 'muted'}, '–');
  const [median, low, high] = ratio;
  return make(
      'td', {class: 'ratio'}, ratioPicture(ratio), make('strong', {}, `${ratioNumber(median)}×`),
      make('span', {class: 'muted'}, ` ${ratioNumber(low)} to ${ratioNumber(high)}`));
}

const effectRow = (effect) => make(
    'tr', {class: effect.pairs < kFewPairs ? 'breaks' : null}, make('th', {scope: 'row'}, effect.axis),
    make('td', {}, `${effect.from} → ${effect.to}`), ratioCell(effect.time), ratioCell(effect.errors[choice.metric]),
    make('td', {class: 'number'}, `${effect.pairs} (${effect.coverage})`));

function effectTable(effects) {
  const {id} = data.metrics[choice.metric];
  return make(
      'div', {class: 'table-box', tabindex: 0, role: 'region', 'aria-label': 'Effects'},
      make(
          'table', {class: 'data effects'},
          make(
              'thead', {},
              make(
                  'tr', {}, ...['Axis', 'Step', 'Time', id].map((text) => make('th', {scope: 'col'}, text)),
                  make('th', {scope: 'col', class: 'number'}, 'Pairs'))),
          make('tbody', {}, ...effects.map(effectRow))));
}

/** How much a step says: the smaller end of what it does to time and error. */
function weightOf({time, errors}) {
  const sure = ([, low, high]) => (low > 1 ? Math.log(low) : high < 1 ? -Math.log(high) : 0);
  const error = errors[choice.metric];
  return sure(time) + (error ? Math.min(3, sure(error)) : 0);
}

export function drawEffects() {
  const [group] = chosenGroups(choice.scene);
  const effects = data.effects.filter((effect) => effect.group === group);
  if (effects.length === 0) {
    byId('effect-rows').replaceChildren(make('p', {class: 'muted'}, 'No two settings differ in one parameter only.'));
    return;
  }
  const byWeight = effects.filter(({pairs}) => pairs >= kFewPairs).sort((a, b) => weightOf(b) - weightOf(a));
  const features = effects.filter((effect) => effect.prices_feature);
  const first = new Set(byWeight.filter((effect) => !effect.prices_feature).slice(0, kRowsShown));
  const rest = effects.filter((effect) => !effect.prices_feature && !first.has(effect));
  refill(
      byId('effect-rows'),
      ...[make('p', {class: 'muted'}, `On ${shortLabel(group)}, over all scenes.`),
          features.length ? make('h3', {}, 'Features of the scene, on instead of off: price and gain') : null,
          features.length ? effectTable(features) : null, features.length ? make('h3', {}, 'Everything else') : null,
          first.size ? effectTable(effects.filter((effect) => first.has(effect))) :
                       make('p', {}, `No step has ${kFewPairs} pairs or more.`),
          rest.length ?
              make('details', {}, make('summary', {}, `${rest.length} more, of less weight`), effectTable(rest)) :
              null]
          .filter(Boolean));
}

whenChanged(['metric', 'group', 'scene'], drawEffects);

// Frame, reference and error map of each recommended setting: flipped in place or side by side.

import {frontMetricText} from './answers.js';
import {copyButton} from './copy.js';
import {heatLegend} from './heat_legend.js';
import {byId, data, formatTime, make} from './page.js';
import {groupLabel, picturesCommand, settingsElement} from './points.js';

const kKinds = [['frame', 'Frame'], ['reference', 'Reference'], ['error', 'Error map']];

function show(card, kind) {
  card.dataset.kind = kind;
  for (const tab of card.querySelectorAll('.tabs button'))
    tab.setAttribute('aria-pressed', String(tab.dataset.kind === kind));
}

/** What stands where the run's folder has no picture. */
function missing(command) {
  if (command === null) return make('p', {class: 'missing'}, 'no picture in the run\'s folder');
  return make(
      'p', {class: 'missing'}, 'no picture in the run\'s folder; this draws it: ', make('code', {}, command), ' ',
      copyButton(command));
}

function pictureCard(answer) {
  const point = data.points[answer.pick];
  const figures = kKinds.map(([kind, name]) => {
    const image = answer.pictures[kind];
    const content = image === null ?
        missing(picturesCommand(point)) :
        make(
            'img',
            {src: data.images[image], alt: `${name}, ${data.scenes[answer.scene]}, ${groupLabel(answer.group)}`});
    return make('figure', {'data-kind': kind}, content, make('figcaption', {}, name));
  });
  const card = make('article', {class: 'card picture-card'});
  const tabs = kKinds.map(
      ([kind, name], index) => make(
          'button', {
            type: 'button',
            'data-kind': kind,
            onclick: () => show(card, kind),
            onpointerenter: () => show(card, kind),
            onfocus: () => show(card, kind)
          },
          make('kbd', {}, String(index + 1)), ` ${name}`));
  card.append(
      make(
          'div', {class: 'card-head'}, make('h3', {}, data.scenes[answer.scene]),
          make('p', {class: 'muted'}, groupLabel(answer.group))),
      make(
          'p', {}, settingsElement(point),
          make('span', {class: 'muted'}, ` ${formatTime(point.time_ns[0])} · ${frontMetricText(point)}`)),
      make('div', {class: 'tabs', role: 'group', 'aria-label': 'Picture shown'}, ...tabs),
      make('div', {class: 'stage'}, ...figures));
  show(card, 'frame');
  return card;
}

export function drawPictures() {
  const answered =
      data.answers.filter((answer) => answer.pick !== null).sort((a, b) => a.scene - b.scene || a.group - b.group);
  const cards = answered.map(pictureCard);
  byId('heat-legend').append(heatLegend(data.heat_map));
  byId('picture-cards').append(...cards);
  if (cards.length === 0) byId('picture-cards').append(make('p', {class: 'muted'}, 'No setting is recommended.'));
  const container = byId('picture-cards');
  for (const radio of /** @type {NodeListOf<HTMLInputElement>} */ (document.querySelectorAll('input[name=layout]'))) {
    radio.addEventListener(
        'change', () => container.classList.toggle('side-by-side', radio.value === 'row' && radio.checked));
  }
  document.addEventListener('keydown', (event) => {
    const kind = kKinds[['1', '2', '3'].indexOf(event.key)];
    if (!kind || event.ctrlKey || event.metaKey || event.altKey ||
        /^(INPUT|SELECT|TEXTAREA)$/.test(/** @type {Element} */ (event.target).tagName))
      return;
    // The card under the pointer or with the focus; else all of them flip together.
    const chosen = cards.filter((card) => card.matches(':hover, :focus-within'));
    for (const card of chosen.length ? chosen : cards) show(card, kind[0]);
  });
}

// The strip of pictures along the front: each setting that has some, by rising time, and the one that just fails.

import {choice, choose, whenChanged} from './choice.js';
import {answerOf, chosenGroups} from './decide.js';
import {refill} from './focus.js';
import {hasPictures, pictureOf} from './images.js';
import {byId, data, formatTime, letterOf, make} from './page.js';
import {numberedFront} from './plot.js';
import {errorOf, settingTitle} from './points.js';

/** What stands in the strip: [{index, number (of the front) or null, notes}] */
export function stripEntries() {
  const [group] = chosenGroups(choice.scene);
  if (group === undefined) return [];
  const answer = answerOf(choice.scene, group);
  const front = numberedFront();
  const wanted = [
    ...front, answer.pick, answer.justFails, answer.baseline,
    ...choice.pins.filter((pin) => data.points[pin].scene === choice.scene)
  ];
  const shown = [...new Set(wanted)].filter((index) => index !== null && hasPictures(data.points[index]));
  shown.sort((a, b) => data.points[a].time_ns[0] - data.points[b].time_ns[0]);
  return shown.map((index) => ({
                     index,
                     number: front.includes(index) ? front.indexOf(index) + 1 : null,
                     notes: [
                       index === answer.pick ? 'pick' : '', index === answer.justFails ? 'just fails' : '',
                       index === answer.baseline && index !== answer.pick ? 'compared with' : '',
                       choice.pins.includes(index) ? `pin ${letterOf(choice.pins.indexOf(index))}` : ''
                     ].filter(Boolean)
                   }));
}

/** The point whose pictures are looked at: the chosen one, else the pick, else the first that there is; or null. */
export function shownPicture() {
  const isHere = (index) =>
      index !== null && data.points[index].scene === choice.scene && hasPictures(data.points[index]);
  if (isHere(choice.picture)) return choice.picture;
  const entries = stripEntries();
  return (entries.find(({notes}) => notes.includes('pick')) ?? entries[0])?.index ?? null;
}

export function drawStrip() {
  const shown = shownPicture();
  const cards = stripEntries().map(({index, number, notes}) => {
    const point = data.points[index];
    return make(
        'button', {
          type: 'button',
          'data-focus': index,
          class: `strip-card${notes.includes('just fails') ? ' fails' : ''}`,
          'aria-pressed': String(index === shown),
          onclick: () => choose({picture: index})
        },
        make('img', {src: pictureOf(point, 'frame') || pictureOf(point, 'error'), alt: '', loading: 'lazy'}),
        make('span', {}, number === null ? null : make('strong', {}, `${number}  `), settingTitle(point)),
        make('span', {class: 'muted'}, `${formatTime(point.time_ns[0])} · ${errorOf(point, choice.metric)}`),
        notes.length ? make('span', {class: 'note'}, notes.join(', ')) : null);
  });
  refill(byId('strip'), ...cards);
  byId('strip').hidden = cards.length === 0;
}

whenChanged(
    [
      'scene', 'group', 'metric', 'error', 'time_ms', 'hidden', 'search', 'map', 'format', 'encoding', 'pins', 'picture'
    ],
    drawStrip);

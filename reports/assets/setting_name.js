// How a setting is written for people: its technique, what differs from the defaults, and its key.

import {make} from './page.js';

/** Between the words stand real blanks, so that they are there in a copy. */
export function nameElement(name, key, {hasTechnique = true, mark = ''} = {}) {
  const [technique, ...settings] = name.split(' ');
  const words = [
    hasTechnique ? make('strong', {}, technique) : null, ...settings.map((word) => make('span', {}, word)),
    key ? make('span', {class: 'muted'}, `[${key}]`) : null, mark || null
  ].filter(Boolean);
  return make('span', {class: 'settings'}, ...words.flatMap((word, at) => (at ? [' ', word] : [word])));
}

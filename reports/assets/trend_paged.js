// Long lists, a page at a time.

import {make} from './page.js';

/** Fills `list` with elements made of the items, the first `size` now and as many with every press of a button. */
export function fillPaged(list, items, render, size = 50) {
  const more = make('button', {type: 'button', class: 'more'});
  const showMore = () => {
    const shown = Number(list.dataset.shown || 0);
    const added = items.slice(shown, shown + size).map(render);
    list.append(...added);
    list.dataset.shown = shown + added.length;
    const left = items.length - shown - added.length;
    more.hidden = left === 0;
    more.textContent = `Show ${Math.min(left, size)} more of ${left}`;
    return added[0];
  };
  more.addEventListener('click', () => showMore()?.querySelector('a')?.focus());
  showMore();
  return make('div', {class: 'paged'}, list, more);
}

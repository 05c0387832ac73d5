// All series: a search, filters, the list by size of the last step, and the chosen one.

import {byId, data, make} from './page.js';
import {changeOf, changeText, machineName, seriesId, seriesName, seriesOf, whereElement, whereParts} from './trend_data.js';
import {fillPaged} from './trend_paged.js';
import {showSeries} from './trend_panel.js';
import {linkTo, markCurrent, replaceState, state} from './trend_state.js';

const kFilters = ['machine', 'backend', 'technique', 'map', 'format', 'scene'];
const traitOf = (series, trait) => (trait === 'machine' ? machineName(series.machine) : series[trait]);

const entries =
    data.series
        .map(
            (series, index) => ({
              series,
              index,
              change: changeOf(series),
              text:
                  [seriesName(series), series.setting, series.technique, ...whereParts(series)].join(' ').toLowerCase(),
            }))
        .sort((a, b) => Math.abs(b.change) - Math.abs(a.change) || a.index - b.index);

function matching() {
  const words = state.search.toLowerCase().split(/\s+/).filter(Boolean);
  const chosen = kFilters.filter((trait) => state[trait]);
  return entries.filter(
      ({series, text}) => chosen.every((trait) => traitOf(series, trait) === state[trait]) &&
          words.every((word) => text.includes(word)));
}

function listItem({series, index, change}) {
  const tone = change > 0 ? 'worse' : change < 0 ? 'better' : '';
  return make(
      'li', {},
      make(
          'a',
          {class: 'series-link', href: linkTo({...state, series: seriesId(index)}), 'data-series': seriesId(index)},
          make('span', {class: `change ${tone}`}, changeText(change)),
          make('span', {}, make('strong', {}, seriesName(series)), whereElement(series))));
}

/** Up and down go from link to link, as in any list. */
function onListKey(event) {
  const step = {ArrowDown: 'nextElementSibling', ArrowUp: 'previousElementSibling'}[event.key];
  const item = step && event.target.closest('li')?.[step];
  if (!item) return;
  event.preventDefault();
  item.querySelector('a').focus();
}

let listed = null;  // what the list was made for, so that choosing a series leaves it, and the focus in it, alone

function drawList() {
  const question = linkTo({...state, series: '', view: ''});
  if (question !== listed) {
    listed = question;
    const found = matching();
    byId('series-list').hidden = found.length === 0;
    byId('series-count').textContent = `${found.length} of ${data.series.length} series, by size of their last step`;
    byId('series-list').replaceChildren(fillPaged(make('ol', {onkeydown: onListKey}), found, listItem));
    byId('series-list').dataset.first = found.length ? seriesId(found[0].index) : '';
  }
  const chosen = state.series || byId('series-list').dataset.first;
  markCurrent(byId('series-list').querySelectorAll('a'), (link) => link.dataset.series === chosen);
  return chosen;
}

let shown = null;

function drawChosen(chosen) {
  if (chosen === shown) return;
  shown = chosen;
  const index = seriesOf.get(chosen);
  if (index === undefined)
    byId('series-shown')
        .replaceChildren(make(
            'p', {class: 'missing'},
            data.series.length === 0 ? 'No series yet.' : 'No series here: another search or filter may find one.'));
  else
    showSeries(byId('series-shown'), data.series[index]);
}

function filterControl(trait) {
  const values = [...new Set(data.series.map((series) => traitOf(series, trait)))].filter(Boolean).sort();
  if (values.length < 2) return null;
  const select = make(
      'select', {name: trait, onchange: ({target}) => change({[trait]: target.value})},
      make('option', {value: ''}, 'all'), ...values.map((value) => make('option', {value}, value)));
  return make('label', {}, `${trait} `, select);
}

const kRest_ms = 120;
let resting = 0;

/** The list answers every letter of a search; the charts follow once the typing rests. */
function change(fields) {
  replaceState({...fields, series: ''});
  drawList();
  clearTimeout(resting);
  resting = setTimeout(() => {
    if (state.view === 'series') drawChosen(drawList());
  }, kRest_ms);
}

/** Once: the controls. */
export function makeFilters() {
  const form = byId('filters');
  const search = make('input', {
    type: 'search',
    name: 'search',
    placeholder: 'words of a name or setting',
    'aria-label': 'Search',
    oninput: ({target}) => change({search: target.value})
  });
  const clear = make(
      'button', {
        type: 'button',
        onclick: () => {
          change(Object.fromEntries(['search', ...kFilters].map((field) => [field, ''])));
          fillForm();
        }
      },
      'Clear');
  form.append(...[search, ...kFilters.map(filterControl), clear].filter(Boolean));
  form.addEventListener('submit', (event) => event.preventDefault());
}

function fillForm() {
  const form = /** @type {HTMLFormElement} */ (byId('filters'));
  for (const control of /** @type {any} */ (form.elements)) {
    if (control.name) control.value = state[control.name];
  }
}

export function drawBrowser() {
  fillForm();
  drawChosen(drawList());
}

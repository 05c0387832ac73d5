// The pictures of a setting beside its reference or another setting: split, blinking, side by side, or all four.

import {choice, choose, whenChanged} from './choice.js';
import {copyButton} from './copy.js';
import {refill} from './focus.js';
import {heatLegend} from './heat_legend.js';
import {colorAt, hasPictures, pictureOf, valueOfColor} from './images.js';
import {byId, data, formatNumber, formatTime, make} from './page.js';
import {errorOf, picturesCommand, settingElement, settingOf, settingTitle} from './points.js';
import {shownPicture, stripEntries} from './strip.js';
import {applyZoom, panBy, pictureAt, resetZoom, zoomBy} from './zoom.js';

const kKinds = [['frame', 'Frame'], ['error', 'Error map'], ['taps', 'Taps']];
const kModes = [['split', 'Split', 's'], ['side', 'Side by side', 'd'], ['all', 'All four', 'a']];

let split = 0.5;      // share of the stage's width that is the left picture's
let isOther = false;  // blink: the right picture all over
const stageBox = () => byId('stage');

/** What the right side shows: another setting of the scene, or null for the reference. */
function otherPoint() {
  const index = choice.other;
  if (index === null || index === shownPicture()) return null;
  const point = data.points[index];
  return point.scene === choice.scene && hasPictures(point) ? point : null;
}

/** The two sides: [{title, uri, point, kind}] */
function sides() {
  const shown = shownPicture();
  const point = data.points[shown];
  const other = otherPoint();
  const kindName = kKinds.find(([kind]) => kind === choice.kind)[1];
  const left = {
    title: `${settingTitle(point)}: ${kindName.toLowerCase()}`,
    uri: pictureOf(point, choice.kind),
    kind: choice.kind,
    point
  };
  if (other)
    return [
      left, {
        title: `${settingTitle(other)}: ${kindName.toLowerCase()}`,
        uri: pictureOf(other, choice.kind),
        kind: choice.kind,
        point: other
      }
    ];
  return [left, {title: 'exact reference', uri: pictureOf(point, 'reference'), kind: 'reference', point}];
}

function paneOf({title, uri, point}, className = '') {
  return make(
      'figure', {class: `pane ${className}`},
      make(
          'div', {class: 'pane-picture'},
          uri ? make('img', {src: uri, alt: `${title}, ${settingOf(point).name}`, draggable: 'false'}) :
                make('p', {class: 'missing'}, 'no picture in the run\'s folder')),
      make('figcaption', {}, title));
}

function setSplit(share) {
  split = Math.max(0, Math.min(1, share));
  const stage = stageBox();
  stage.style.setProperty('--split', `${100 * split}%`);
  stage.querySelector('.divider')?.setAttribute('aria-valuenow', String(Math.round(100 * split)));
}

function setBlink(shows) {
  isOther = shows;
  stageBox().classList.toggle('other', isOther);
  byId('blink')?.setAttribute('aria-pressed', String(isOther));
}

function splitStage() {
  const [left, right] = sides();
  const onKey = (event) => {
    const step = {ArrowLeft: -0.02, ArrowRight: 0.02, Home: -1, End: 1}[event.key];
    if (!step) return;
    event.preventDefault();
    setSplit(split + step);
  };
  const divider = make('div', {
    class: 'divider',
    role: 'slider',
    tabindex: 0,
    'aria-label': 'Where the pictures meet',
    'aria-valuemin': 0,
    'aria-valuemax': 100,
    'aria-valuenow': Math.round(100 * split),
    onkeydown: onKey
  });
  return [paneOf(right, 'under'), paneOf(left, 'over'), divider];
}

function allStage() {
  const point = data.points[shownPicture()];
  return [['frame', 'Frame'], ['reference', 'Exact reference'], ['error', 'Error map'], ['taps', 'Taps']].map(
      ([kind, title]) => paneOf({title, uri: pictureOf(point, kind), point}));
}

const button = (text, isOn, onclick, key = null, id = null) => make(
    'button', {type: 'button', id, 'aria-pressed': String(isOn), onclick}, key ? make('kbd', {}, key) : null,
    key ? ` ${text}` : text);

function otherSelect() {
  const shown = shownPicture();
  const entries = stripEntries().filter(({index}) => index !== shown);
  const other = otherPoint();
  return make(
      'label', {}, 'against ',
      make(
          'select',
          {onchange: (event) => choose({other: event.target.value === '' ? null : Number(event.target.value)})},
          make('option', {value: '', selected: other ? null : ''}, 'the exact reference'),
          ...entries.map(
              ({index, notes}) => make(
                  'option', {value: index, selected: other === data.points[index] ? '' : null},
                  `${settingTitle(data.points[index])}, ${formatTime(data.points[index].time_ns[0])}${
                      notes.length ? ` (${notes.join(', ')})` : ''}`))));
}

function drawTools() {
  const point = data.points[shownPicture()];
  refill(
      byId('stage-tools'),
      make(
          'div', {class: 'stage-title'}, settingElement(point),
          make('span', {class: 'muted'}, ` ${formatTime(point.time_ns[0])} · ${errorOf(point, choice.metric)}`)),
      make(
          'div', {class: 'tabs', role: 'group', 'aria-label': 'Picture'},
          ...kKinds.map(([kind, name], at) => button(name, choice.kind === kind, () => choose({kind}), String(at + 1))),
          otherSelect()),
      make(
          'div', {class: 'tabs', role: 'group', 'aria-label': 'How'},
          ...kModes.map(([mode, name, key]) => button(name, choice.mode === mode, () => choose({mode}), key)),
          choice.mode === 'split' ? button('Blink', isOther, () => setBlink(!isOther), 'b', 'blink') : null,
          button('+', false, () => zoomBy(stageBox(), 2)), button('−', false, () => zoomBy(stageBox(), 0.5)),
          button('1:1', false, () => resetZoom(stageBox()), '0')));
  for (const [label, element] of [['Zoom in', '+'], ['Zoom out', '−']])
    [...byId('stage-tools').querySelectorAll('button')]
        .find((b) => b.textContent === element)
        .setAttribute('aria-label', label);
}

/** What the pixel under the pointer is, in each picture. */
function pixelText(u, v) {
  const point = data.points[shownPicture()];
  const texts = [];
  let where = '';
  const add = (title, uri, legend, unit) => {
    const color = colorAt(uri, u, v);
    if (!color) return;
    where = `pixel ${color.x}, ${color.y} of ${color.width} × ${color.height}`;
    if (!legend) {
      texts.push(`${title} ${color.r} ${color.g} ${color.b}`);
      return;
    }
    const {mark, value, isEnd} = valueOfColor(legend, color);
    texts.push(`${title} ${mark ?? `${isEnd}${formatNumber(value, 2)} ${unit}`}`);
  };
  add('frame', pictureOf(point, 'frame'), null, '');
  add('reference', pictureOf(point, 'reference'), null, '');
  add('error', pictureOf(point, 'error'), data.heat_map, 'texels');
  add('taps', pictureOf(point, 'taps'), data.taps_map, 'taps');
  const other = otherPoint();
  if (other) {
    add('other frame', pictureOf(other, 'frame'), null, '');
    add('its error', pictureOf(other, 'error'), data.heat_map, 'texels');
  }
  return texts.length ? `${where}: ${texts.join(' · ')}` : '';
}

function onPointer(event) {
  const pane = event.target.closest?.('.pane-picture') ?? stageBox().querySelector('.pane-picture');
  const at = pane && pictureAt(pane, event.clientX, event.clientY);
  byId('pixel').textContent = at ? pixelText(at.u, at.v) : '';
}

function startDragging(event) {
  const stage = stageBox();
  const pane = stage.querySelector('.pane-picture');
  if (!pane || event.button !== 0) return;
  event.preventDefault();
  const isDivider = event.target.closest('.divider') !== null;
  let [x, y] = [event.clientX, event.clientY];
  const box = pane.getBoundingClientRect();
  const move = (moved) => {
    if (isDivider)
      setSplit((moved.clientX - box.left) / box.width);
    else
      panBy(stage, (moved.clientX - x) / box.width, (moved.clientY - y) / box.height);
    [x, y] = [moved.clientX, moved.clientY];
  };
  const stop = () => {
    window.removeEventListener('pointermove', move);
    window.removeEventListener('pointerup', stop);
  };
  window.addEventListener('pointermove', move);
  window.addEventListener('pointerup', stop);
  (event.target.closest('.divider') ?? stage).focus({preventScroll: true});
}

function onWheel(event) {
  if (!event.ctrlKey && !event.altKey && document.activeElement !== stageBox()) return;  // the page scrolls
  const pane = event.target.closest('.pane-picture') ?? stageBox().querySelector('.pane-picture');
  const at = pane && pictureAt(pane, event.clientX, event.clientY);
  if (!at) return;
  event.preventDefault();
  zoomBy(stageBox(), event.deltaY < 0 ? 1.3 : 1 / 1.3, at.paneU, at.paneV);
}

function onStageKey(event) {
  if (event.ctrlKey || event.metaKey || event.altKey || shownPicture() === null) return;
  if (/^(INPUT|SELECT|TEXTAREA)$/.test(/** @type {Element} */ (event.target).tagName)) return;
  const kind = kKinds[Number(event.key) - 1]?.[0];
  const mode = kModes.find(([, , key]) => key === event.key)?.[0];
  if (kind)
    choose({kind});
  else if (mode)
    choose({mode});
  else if (event.key === 'b' && choice.mode === 'split')
    setBlink(!isOther);
  else if (event.key === '+' || event.key === '=')
    zoomBy(stageBox(), 2);
  else if (event.key === '-')
    zoomBy(stageBox(), 0.5);
  else if (event.key === '0')
    resetZoom(stageBox());
}

function drawLegend() {
  const legends = choice.mode === 'all' ? ['error', 'taps'] : [choice.kind];
  byId('heat-legend')
      .replaceChildren(
          ...legends.includes('error') ?
              [heatLegend(data.heat_map, 'e_xy of a pixel (texels, same scale in every picture)')] :
              [],
          ...legends.includes('taps') ? [heatLegend(data.taps_map, 'texture instructions of a pixel')] : []);
}

/** What stands where the run's folder has no picture. */
function drawNone() {
  const commands = data.runs.map(picturesCommand).filter(Boolean);
  const parts = data.runs.flatMap(({info}) => (info.parts || []).map(({folder}) => folder));
  const said = !data.points.length ? 'No setting was measured.' :
      commands.length              ? 'No pictures in the run\'s folder; this draws them:' :
      parts.length                 ? `No pictures in the run's folder, which was merged: sweep its parts (${
                         parts.join(', ')}) to their ends with pictures, and merge them again.` :
                                     'No pictures in the run\'s folder.';
  byId('stage-tools').replaceChildren();
  byId('heat-legend').replaceChildren();
  stageBox().replaceChildren(make(
      'div', {class: 'missing'}, make('p', {}, said),
      ...(data.points.length ? commands : [])
          .map((text) => make('p', {}, make('code', {}, text), ' ', copyButton(text)))));
}

function drawStage() {
  const stage = stageBox();
  stage.className = `stage mode-${choice.mode}`;
  byId('viewing').classList.toggle('wide', choice.mode !== 'split');
  if (shownPicture() === null) {
    drawNone();
    return;
  }
  drawTools();
  refill(
      stage,
      ...(choice.mode === 'split'    ? splitStage() :
              choice.mode === 'side' ? sides().map((side) => paneOf(side)) :
                                       allStage()));
  setSplit(split);
  setBlink(isOther && choice.mode === 'split');
  applyZoom(stage);
  drawLegend();
}

export function startStage() {
  const stage = stageBox();
  stage.addEventListener('pointermove', onPointer);
  stage.addEventListener('pointerdown', startDragging);
  stage.addEventListener('wheel', onWheel, {passive: false});
  byId('viewing').addEventListener('keydown', onStageKey);  // elsewhere letters are for other things
  drawStage();
}

whenChanged(
    [
      'scene', 'group', 'metric', 'error', 'hidden', 'search', 'map', 'format', 'encoding', 'picture', 'other', 'kind',
      'mode', 'pins'
    ],
    drawStage);

// The pinned settings beside each other: what they cost, err and differ in, and the command that measures each again.

import {choice, choose, whenChanged} from './choice.js';
import {copyButton} from './copy.js';
import {refill} from './focus.js';
import {pictureOf} from './images.js';
import {byId, data, formatInterval, formatTime, letterOf, make} from './page.js';
import {commandsOf, errorAsSeen, formatBytes, sceneName, settingElement, settingOf, shortLabel} from './points.js';

const unpin = (index) => choose({pins: choice.pins.filter((pin) => pin !== index)});

function headOf(index, at) {
  const point = data.points[index];
  const uri = pictureOf(point, 'frame');
  return make(
      'th', {scope: 'col'},
      make(
          'div', {class: 'pin-head'}, make('span', {class: 'pin-name'}, letterOf(at)),
          make(
              'button',
              {type: 'button', class: 'close', 'aria-label': `Unpin ${letterOf(at)}`, onclick: () => unpin(index)},
              '×')),
      uri ? make(
                'button',
                {type: 'button', class: 'thumb', title: 'Show its pictures', onclick: () => choose({picture: index})},
                make('img', {src: uri, alt: `frame of ${settingOf(point).name}`})) :
            null,
      settingElement(point));
}

/** Rows of parameters in which the pinned differ. */
function differingParams(points) {
  const names = [...new Set(points.flatMap((point) => settingOf(point).params.map(([name]) => name)))];
  const text = (point, name) => settingOf(point).params.find(([id]) => id === name)?.[1] ?? '–';
  return names.map((name) => [name, points.map((point) => text(point, name))])
      .filter(([, texts]) => new Set(texts).size > 1);
}

function metricRows(points) {
  const rank = (index) =>
      (index === choice.metric           ? 0 :
           data.metrics[index].is_seen   ? 1 :
           data.metrics[index].is_column ? 2 :
                                           3);
  const order = [...data.metrics.keys()].filter((index) => points.some((point) => point.errors[index] !== null));
  order.sort((a, b) => rank(a) - rank(b) || a - b);
  const rows = order.map((index) => ({
                           name: data.metrics[index].id,
                           hint: data.metrics[index].description,
                           cells: points.map((point) => errorAsSeen(point, index)),
                           isFirst: rank(index) < 3
                         }));
  return [rows.filter((row) => row.isFirst), rows.filter((row) => !row.isFirst)];
}

/** null where there is no command. */
function commandButtons(point) {
  const commands = commandsOf(point);
  if (commands.length === 0) return null;
  return make('span', {}, ...commands.flatMap(([label, text]) => [copyButton(text, label), ' ']));
}

export function drawPins() {
  const points = choice.pins.map((index) => data.points[index]);
  const box = byId('pins');
  if (points.length === 0) {
    refill(
        box,
        make(
            'p', {class: 'muted'},
            `Click a dot to pin its setting: what it costs, its pictures and ${
                data.tune ? 'the commands that show and ship it' : 'the command that measures it again'} stand here. ` +
                'Pin several to compare them. With the keyboard: focus the plot, ',
            make('kbd', {}, '←'), ' ', make('kbd', {}, '→'), ' go from dot to dot by time, ', make('kbd', {}, 'Enter'),
            ' pins.'));
    return;
  }
  const [first] = points;
  const timeText = (point) => {
    const ratio = point.time_ns[0] / first.time_ns[0];
    return formatTime(point.time_ns[0]) + (point === first ? '' : ` (${Number(ratio.toPrecision(3))}×)`);
  };
  const row = (name, cells, hint) =>
      make('tr', {}, make('th', {scope: 'row', title: hint}, name), ...cells.map((cell) => make('td', {}, cell)));
  const knownRow = (name, cellOf, none = 'not known') => {
    const cells = points.map(cellOf);
    return cells.every((cell) => cell === null) ? null : row(name, cells.map((cell) => cell ?? none));
  };
  const [main, more] = metricRows(points);
  const isOnePlace = new Set(points.map((point) => `${point.scene} ${point.group}`)).size === 1;
  refill(
      box,
      make(
          'div', {class: 'table-box', tabindex: 0, role: 'region', 'aria-label': 'Pinned settings'},
          make(
              'table', {class: 'data pins'}, make('thead', {}, make('tr', {}, make('td'), ...choice.pins.map(headOf))),
              make(
                  'tbody', {},
                  isOnePlace && data.groups.length < 2 ?
                      null :
                      row('Where', points.map((point) => `${sceneName(point.scene)}, ${shortLabel(point.group)}`)),
                  row('Frame time', points.map(timeText)),
                  row('Interval',
                      points.map(
                          (point) =>
                              `${formatInterval(point.time_ns)} (${point.coverage} of ${point.samples} samples)`)),
                  ...main.map(({name, cells, hint}) => row(name, cells, hint)),
                  ...differingParams(points).map(([name, texts]) => row(name, texts)),
                  knownRow(
                      'Map',
                      ({memory_bytes: bytes, bake_ns: ns, device_bake_ns: deviceNs}) => bytes === null ?
                          null :
                          `${formatBytes(bytes)}, baked in ${formatTime(ns)}${
                              deviceNs === null ? '' : `, by the device in ${formatTime(deviceNs)}`}`),
                  knownRow('First draw', ({first_draw_ns:
                                               ns}) => (ns === null ? null : `${formatTime(ns)} with compilation`)),
                  row('Timer', points.map((point) => point.timer)),
                  knownRow(data.tune ? 'Use it' : 'Again', commandButtons, 'not in the folder\'s records')))),
      make(
          'details', {}, make('summary', {}, 'All errors, ids and commands'),
          make(
              'div', {class: 'table-box'},
              make(
                  'table', {class: 'data pins'},
                  make('tbody', {}, ...more.map(({name, cells, hint}) => row(name, cells, hint))))),
          ...points.map(
              (point, at) =>
                  make('p', {class: 'case-id'}, make('strong', {}, `${letterOf(at)} `), make('code', {}, point.id))),
          ...points.flatMap(commandsOf).map(([, text]) => make('p', {class: 'command-line'}, make('code', {}, text)))));
}

whenChanged(['pins', 'metric'], drawPins);

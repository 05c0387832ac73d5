// All settings that the filters leave, as a table: sorted by any column, a part at a time, and as CSV.

import {choice, whenChanged} from './choice.js';
import {constraintsOf, isWithin} from './decide.js';
import {refill} from './focus.js';
import {byId, data, formatNumber, make} from './page.js';
import {countText, plotted, togglePin} from './plot.js';
import {columnMetrics, formatBytes, formatMetric, metricTitle, sceneName, settingElement, settingOf, shortLabel, techniqueIndex} from './points.js';

const kRowsAtOnce = 40;
const sorted = {
  column: 'time',
  rising: true,
  rows: kRowsAtOnce
};

const hasFrameSizes = new Set(data.scenes.map(({frame_px}) => String(frame_px))).size > 1;

const metricColumn = (index) => ({
  id: data.metrics[index].id,
  title: metricTitle(data.metrics[index]),
  hint: data.metrics[index].description,
  numeric: true,
  // No psnr is that of identical pictures: more than any number. Else none is no number.
  value: (point) => point.errors[index] ?? (data.metrics[index].none_is_best ? Infinity : null),
  text: (point) => (point.errors[index] === null ? formatMetric(index, null) : formatNumber(point.errors[index])),
});

function columnsShown() {
  const seen = [...data.metrics.keys()].filter((index) => data.metrics[index].is_seen);
  const metrics = [...new Set([choice.metric, ...seen, ...columnMetrics])];
  return [
    {
      id: 'setting',
      title: 'Setting',
      value: (point) => settingOf(point).name,
      element: (point, index) => make(
          'button',
          {type: 'button', class: 'row-pin', title: 'Pin it', 'data-focus': index, onclick: () => togglePin(index)},
          settingElement(point))
    },
    ...(data.groups.length > 1 ?
            [{id: 'device', title: 'Device', value: (p) => shortLabel(p.group), text: (p) => shortLabel(p.group)}] :
            []),
    {
      id: 'time',
      title: 'Time (ms)',
      numeric: true,
      hint: 'median frame time',
      value: (point) => point.time_ns[0],
      text: (point) => formatNumber(point.time_ns[0] / 1e6)
    },
    {
      id: 'interval',
      title: 'Interval (ms)',
      numeric: true,
      hint: 'of the median; what it covers depends on the number of samples',
      value: (point) => point.time_ns[2],
      text: (point) => `${point.time_ns.slice(1).map((ns) => formatNumber(ns / 1e6)).join(' – ')}`
    },
    ...(hasFrameSizes ? [{
      id: 'ns_per_px',
      title: 'ns/px',
      numeric: true,
      hint: 'median frame time over the pixels of the frame: scenes have frames of several sizes',
      value: (point) => point.ns_per_px ?? null,
      text: (point) => (point.ns_per_px === undefined ? 'none' : formatNumber(point.ns_per_px))
    }] :
                        []),
    ...metrics.map(metricColumn),
    ...(data.points.some(({memory_bytes: bytes}) => bytes !== null) ? [{
      id: 'map',
      title: 'Map',
      numeric: true,
      hint: 'memory of the relief map',
      value: (point) => point.memory_bytes,
      text: (point) => (point.memory_bytes === null ? 'not known' : formatBytes(point.memory_bytes))
    }] :
                                                                      []),
  ];
}

/** What has no value comes last, whichever way the others go. */
function compareValues(a, b, sign) {
  if (a === null || b === null) return (a === null ? 1 : 0) - (b === null ? 1 : 0);
  return sign * compareKnown(a, b);
}

function compareKnown(a, b) {
  if (typeof a === 'string') return a.localeCompare(b, 'en', {numeric: true});
  return a < b ? -1 : a > b ? 1 : 0;
}

function headOfColumn(column) {
  const isSorted = column.id === sorted.column;
  const take = () => {
    Object.assign(sorted, {column: column.id, rising: isSorted ? !sorted.rising : true, rows: kRowsAtOnce});
    drawTable();
  };
  return make(
      'th', {
        scope: 'col',
        class: column.numeric ? 'number' : null,
        'aria-sort': !isSorted ? 'none' :
            sorted.rising      ? 'ascending' :
                                 'descending'
      },
      make('button', {type: 'button', title: column.hint, onclick: take}, column.title));
}

/** Indices of the points in the table's order. */
export function tableOrder() {
  const columns = columnsShown();
  const column = columns.find(({id}) => id === sorted.column) || columns[0];
  const values = new Map(plotted.dots.map((index) => [index, column.value(data.points[index])]));
  const sign = sorted.rising ? 1 : -1;
  return [...plotted.dots].sort((a, b) => compareValues(values.get(a), values.get(b), sign) || a - b);
}

export function drawTable() {
  const details = /** @type {HTMLDetailsElement} */ (byId('table'));
  const order = tableOrder();
  details.querySelector('summary').textContent = `The ${countText(order)} as a table`;
  if (!details.open) return;
  const columns = columnsShown();
  const onFront = new Set(plotted.fronts.flatMap(({indices}) => indices));
  const rows = order.slice(0, sorted.rows).map((index) => {
    const point = data.points[index];
    const breaks = !constraintsOf(point.group).every((budget) => isWithin(point, budget));
    return make(
        'tr',
        {class: onFront.has(index) ? 'picked' :
             breaks                ? 'breaks' :
                                     null},
        ...columns.map(
            (column) => make(
                'td', {class: column.numeric ? 'number' : null},
                column.element ? column.element(point, index) : column.text(point))));
  });
  const more = order.length > sorted.rows ? make(
                                                'button', {
                                                  type: 'button',
                                                  onclick: () => {
                                                    sorted.rows += 5 * kRowsAtOnce;
                                                    drawTable();
                                                  }
                                                },
                                                `${order.length - sorted.rows} more`) :
                                            null;
  refill(
      byId('table-rows'),
      ...[make(
              'div', {class: 'table-box', tabindex: 0, role: 'region', 'aria-label': 'Settings'},
              make(
                  'table', {class: 'data'},
                  make(
                      'caption', {}, make('strong', {}, sceneName(choice.scene)),
                      ' Rows on a front are shaded; grey ones break a constraint.'),
                  make('thead', {}, make('tr', {}, ...columns.map(headOfColumn))), make('tbody', {}, ...rows))),
          more]
          .filter(Boolean));
}

/**
 * As RFC 4180 has it, with the columns' names of table.csv. What a spreadsheet would take for a formula is kept from
 * being one by a quote.
 */
export function csvText() {
  const cell = (value) => {
    const text = value === null ? '' : String(value);
    const safe = typeof value === 'string' && /^[=+\-@\t\r]/.test(text) ? `'${text}` : text;
    return /[",\r\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
  };
  const params = [...new Set(plotted.dots.flatMap((i) => settingOf(data.points[i]).params.map(([name]) => name)))];
  const head = [
    'case', 'technique', 'backend', 'device', 'scene', 'key', ...params, ...data.metrics.map(({id}) => id),
    'memory_bytes', 'bake_time_ns', 'device_bake_ns', 'first_draw_ns', 'median_ns', 'ci_low_ns', 'ci_high_ns', 'samples'
  ];
  const rows = tableOrder().map((index) => {
    const point = data.points[index];
    const {backend, device} = data.groups[point.group];
    const own = new Map(settingOf(point).params);
    return [
      point.id, data.techniques[techniqueIndex(point)].id, backend, device, sceneName(point.scene),
      settingOf(point).key, ...params.map((name) => own.get(name) ?? null), ...point.errors, point.memory_bytes,
      point.bake_ns, point.device_bake_ns, point.first_draw_ns, ...point.time_ns, point.samples
    ];
  });
  return [head, ...rows].map((row) => row.map(cell).join(',')).join('\r\n') + '\r\n';
}

function download() {
  const url = URL.createObjectURL(new Blob([csvText()], {type: 'text/csv'}));
  const link = make('a', {href: url, download: 'reliefbench.csv'});
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}

export function startTable() {
  byId('table').addEventListener('toggle', drawTable);
  byId('csv').addEventListener('click', download);
  drawTable();
}

whenChanged(['scene', 'group', 'metric', 'hidden', 'search', 'map', 'format', 'encoding'], () => {
  sorted.rows = kRowsAtOnce;
  drawTable();
});

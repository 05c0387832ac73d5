// Tables of the fronts, sortable by every column.

import {copyButton} from './copy.js';
import {byId, data, formatNumber, formatTime, make} from './page.js';
import {commandOf, errorOf, formatBytes, formatMetric, groupLabel, metricIndex, metricTitle, settingsElement, state} from './points.js';

const metricCell = (id) => {
  const index = metricIndex.get(id);
  return {
    title: metricTitle(data.metrics[index]),
    numeric: true,
    hint: data.metrics[index].description,
    value: (row) => row.point.errors[index],
    text: (row) => {
      const value = row.point.errors[index];
      return value === null ? formatMetric(index, null) : formatNumber(value);
    }
  };
};

function frontColumns() {
  const shown = data.metrics[state.metric].id;
  const more = data.metrics.filter((metric) => metric.is_column && metric.id !== shown).map((metric) => metric.id);
  return [
    {title: 'Settings', value: (row) => row.point.id, element: (row) => settingsElement(row.point)},
    {
      title: 'Time (ms)',
      numeric: true,
      hint: 'median frame time',
      value: (row) => row.point.time_ns[0],
      text: (row) => formatNumber(row.point.time_ns[0] / 1e6)
    },
    {
      title: 'Interval',
      hint: 'of the median; what it covers depends on the number of samples',
      numeric: true,
      value: (row) => row.point.time_ns[1],
      text: (row) =>
          `${row.point.time_ns.slice(1).map((ns) => formatNumber(ns / 1e6)).join(' – ')} (${row.point.coverage})`
    },
    metricCell(shown),
    ...more.map(metricCell),
    {
      title: 'Map',
      numeric: true,
      hint: 'memory of the relief map',
      value: (row) => row.point.memory_bytes,
      text: (row) => formatBytes(row.point.memory_bytes)
    },
    {title: 'Equivalents', numeric: true, value: (row) => row.equivalents.length, element: equivalentsElement},
    {title: '', value: null, element: (row) => copyButton(commandOf(row.point), 'Copy')},
  ];
}

function equivalentsElement(row) {
  if (row.equivalents.length === 0) return make('span', {class: 'muted'}, '–');
  const items = row.equivalents.map((index) => data.points[index])
                    .map(
                        (p) => make(
                            'li', {}, settingsElement(p),
                            make('span', {class: 'muted'}, ` ${formatTime(p.time_ns[0])}, ${errorOf(p)}`)));
  return make('details', {}, make('summary', {}, String(items.length)), make('ul', {}, ...items));
}

function frontTable(front) {
  const columns = frontColumns();
  const rows = front.points.map((p) => ({point: data.points[p.point], index: p.point, equivalents: p.equivalents}));
  const picked = new Set(data.answers.map((answer) => answer.pick));
  const body = make('tbody');
  const fill = () => body.replaceChildren(...rows.map(
      (row) => make(
          'tr', {class: picked.has(row.index) ? 'picked' : null},
          ...columns.map(
              (column) => make(
                  'td', {class: column.numeric ? 'number' : null},
                  column.element ? column.element(row) : column.text(row))))));
  const heads = columns.map((column) => {
    if (!column.value) return make('td', {});
    const button = make('button', {type: 'button', title: column.hint}, column.title);
    const head = make('th', {scope: 'col', class: column.numeric ? 'number' : null, 'aria-sort': 'none'}, button);
    button.addEventListener('click', () => {
      const rising = head.getAttribute('aria-sort') !== 'ascending';
      heads.forEach((other) => other.hasAttribute('aria-sort') && other.setAttribute('aria-sort', 'none'));
      head.setAttribute('aria-sort', rising ? 'ascending' : 'descending');
      rows.sort((a, b) => compareValues(column.value(a), column.value(b)) * (rising ? 1 : -1));
      fill();
    });
    return head;
  });
  heads[1].setAttribute('aria-sort', 'ascending');
  fill();
  const caption = make('caption', {}, make('strong', {}, data.scenes[front.scene]), ` ${groupLabel(front.group)}`);
  return make(
      'div', {class: 'table-box'},
      make('table', {class: 'data'}, caption, make('thead', {}, make('tr', {}, ...heads)), body));
}

/** No psnr is that of identical pictures: more than any number. */
function compareValues(a, b) {
  if (typeof a === 'string') return a.localeCompare(b, 'en', {numeric: true});
  return (a ?? Number.MAX_VALUE) - (b ?? Number.MAX_VALUE);
}

export function drawFronts() {
  const metric = data.metrics[state.metric];
  byId('front-metric').textContent = metricTitle(metric);
  const filled = data.fronts[state.metric].fronts.filter((front) => front.points.length > 0);
  const sorted = [...filled].sort((a, b) => a.scene - b.scene || a.group - b.group);
  byId('front-tables').replaceChildren(...(sorted.length ? sorted.map(frontTable) : [
    make('p', {class: 'notice'}, 'No setting meets the constraints.')
  ]));
}

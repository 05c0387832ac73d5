// What every page shares: its data, how elements are made, how numbers are written.

export const data = JSON.parse(document.getElementById('data').textContent);
export const byId = (id) => document.getElementById(id);

/** An element with attributes and children; text is always set as text, never as HTML. */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith('on'))
      element.addEventListener(name.slice(2), value);
    else if (value !== undefined && value !== null && value !== false)
      element.setAttribute(name, value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return element;
}

export const numberCell = (text) => make('td', {class: 'number'}, text);

/** rows: lists of cells, each a text, an element, or a whole td; a head is set like the cells under it. */
export function dataTable(heads, rows, caption) {
  const cell = (content) => (content instanceof HTMLTableCellElement ? content : make('td', {}, content));
  const cells = rows.map((row) => row.map(cell));
  const kind = (column) => cells[0]?.[column].className || null;
  return make(
      'div', {class: 'table-box'},
      make(
          'table', {class: 'data'}, caption ? make('caption', {}, caption) : null,
          make(
              'thead', {},
              make('tr', {}, ...heads.map((head, column) => make('th', {scope: 'col', class: kind(column)}, head)))),
          make('tbody', {}, ...cells.map((row) => make('tr', {}, ...row)))));
}

/** Two columns, a fact a row; rows without a value are left out. */
export function factsTable(rows) {
  const filled = rows.filter(([, value]) => value !== undefined && value !== null && value !== '');
  return make(
      'table', {class: 'facts'},
      make(
          'tbody', {},
          ...filled.map(([name, value]) => make('tr', {}, make('th', {scope: 'row'}, name), make('td', {}, value)))));
}

/** Three significant digits, no exponent in the range people read. */
export function formatNumber(value, digits = 3) {
  if (value === 0) return '0';
  const size = Math.abs(value);
  if (size < 1e-4 || size >= 1e7) return value.toExponential(digits - 1).replace('e+', 'e');
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  return value.toFixed(Math.min(decimals, 8));
}

/** As short as it goes, without trailing zeros: for axes and sentences. */
export const shortNumber = (value, digits = 3) => String(Number(value.toPrecision(digits)));
/** What names the columns and pins of a comparison: A, B, ... */
export const letterOf = (at) => (at < 26 ? String.fromCharCode(65 + at) : String(at));
export const percent = (share, digits = 3) => `${shortNumber(100 * share, digits)} %`;

// Milliseconds throughout, as frame budgets are; below a hundredth, microseconds.
export const timeUnit = (ns) => (ns < 1e4 ? {name: 'µs', ns: 1e3} : {name: 'ms', ns: 1e6});
export const formatTime = (ns) => `${formatNumber(ns / timeUnit(ns).ns)} ${timeUnit(ns).name}`;
export function formatInterval([median, low, high]) {
  const unit = timeUnit(median);
  return `${formatNumber(low / unit.ns)} to ${formatNumber(high / unit.ns)} ${unit.name}`;
}

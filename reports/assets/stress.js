'use strict';
const data = JSON.parse(document.getElementById('data').textContent);
const byId = (id) => document.getElementById(id);

function make(tag, text = '', className = '') {
  const element = document.createElement(tag);
  element.textContent = text;
  if (className) element.className = className;
  return element;
}

const number = (value) => (value === 0 ? '0' : Number(value.toPrecision(3)).toString());
const percent = (share) => `${number(100 * share)} %`;

/** The results of one technique at one extreme. */
function resultsAt(technique, extreme) {
  return data.results.filter((r) => r.technique === technique && r.extreme === extreme);
}

function cellOf(results) {
  const run = results.filter((r) => !r.skipped);
  if (run.length === 0) return {text: results.length ? 'left out' : '', className: 'left-out'};
  const failing = run.filter((r) => !r.holds).length;
  if (failing) return {text: `fails ${failing}`, className: 'fails'};
  if (run.some((r) => r.guarantee !== 'none')) return {text: 'held', className: 'held'};
  const missed = Math.max(...run.map((r) => r.missed_rate));
  return {text: missed > 0 ? percent(missed) : 'ok', className: ''};
}

function resultTable(results) {
  const table = make('table');
  const head = table.appendChild(make('tr'));
  for (const name of ['map', 'format', 'backend', 'missed', 'unconverged', 'capped', 'e_xy p99', 'e_xy max', 'faults', 'settings'])
    head.appendChild(make('th', name));
  for (const r of results) {
    const row = table.appendChild(make('tr'));
    const faults = r.skipped || Object.entries(r.faults).map(([check, px]) => `${check}: ${px} px`).join(', ');
    const values = r.skipped ? ['', '', '', '', ''] :
        [percent(r.missed_rate), percent(r.unconverged_rate), r.capped, number(r.e_xy_p99), number(r.e_xy_max)];
    for (const value of [r.map, r.format, r.backend, ...values, faults]) row.appendChild(make('td', String(value)));
    row.appendChild(make('td', r.settings.replaceAll('&', ' '), 'settings'));
  }
  const scroll = make('div', '', 'scroll');
  scroll.appendChild(table);
  return scroll;
}

function showCell(technique, extreme) {
  byId('cell').replaceChildren(make('h3', `${technique} at ${extreme.id}: ${extreme.about}`),
                               resultTable(resultsAt(technique, extreme.id)));
}

function drawMatrix() {
  const table = byId('table');
  const head = table.appendChild(make('tr'));
  head.appendChild(make('th', ''));
  for (const technique of data.techniques) head.appendChild(make('th', technique));
  for (const extreme of data.extremes) {
    const row = table.appendChild(make('tr'));
    const name = row.appendChild(make('th', extreme.id));
    name.title = extreme.about;
    for (const technique of data.techniques) {
      const {text, className} = cellOf(resultsAt(technique, extreme.id));
      const cell = row.appendChild(make('td', text, className));
      cell.onclick = () => showCell(technique, extreme);
    }
  }
}

function drawFaults() {
  const failing = data.results.filter((r) => r.holds === false);
  byId('fault-list').replaceChildren(failing.length ? resultTable(failing) : make('p', 'None: every check holds.'));
}

function drawPictures() {
  for (const worst of data.worst) {
    const figure = byId('pictures').appendChild(make('figure'));
    const image = figure.appendChild(make('img'));
    image.src = data.pictures[worst.technique];
    image.alt = `error map of ${worst.technique} at ${worst.extreme}`;
    figure.appendChild(make('figcaption',
        `${worst.technique} at ${worst.extreme}, ${worst.map} ${worst.format}, ${worst.backend}: p99 ` +
        `${number(worst.e_xy_p99)} texels, missed ${percent(worst.missed_rate)}, ${worst.capped} of ${worst.pixels} px at the cap`));
  }
}

const frames = data.results.filter((r) => !r.skipped).length;
byId('subtitle').textContent = `${data.holds ? 'Everything holds' : 'Something fails'}: ${frames} pairs of frames in ` +
    `${number(data.wall_s)} s on ${data.devices.join('; ')}`;
drawMatrix();
drawFaults();
drawPictures();

// Where the numbers come from: machine, timers, the harness's own time, and every case that did not end well.

import {auditTable} from './audits.js';
import {shellQuote} from './copy.js';
import {kColors} from './marks.js';
import {byId, data, dataTable, factsTable, formatNumber, formatTime, make} from './page.js';
import {formatBytes, formatSeconds} from './points.js';

function wallSplit(wall) {
  const parts = Object.entries(wall).filter(([name, s]) => name !== 'total' && s > 0).sort((a, b) => b[1] - a[1]);
  const total = wall.total || parts.reduce((sum, [, s]) => sum + s, 0);
  const bar = make('div', {class: 'split', 'aria-hidden': 'true'}, ...parts.map(([, s], index) => {
    const part = make('span');
    part.style.width = `${(100 * s) / total}%`;
    part.style.background = `var(--series-${index % kColors})`;
    return part;
  }));
  const items = parts.map(([name, s], index) => {
    const box = make('span', {class: 'color-box'});
    box.style.background = `var(--series-${index % kColors})`;
    return make('span', {class: 'mark'}, box, `${name} ${formatSeconds(s)} (${formatNumber((100 * s) / total, 2)} %)`);
  });
  return make(
      'div', {}, make('h4', {}, `Wall time of the harness: ${formatSeconds(total)}`), bar,
      make('div', {class: 'legend'}, ...items));
}

function statusTables(run) {
  const sums = new Map();
  for (const row of run.statuses) sums.set(row.status, (sums.get(row.status) || 0) + row.count);
  const summary = [...sums].map(
      ([status, count]) => make('span', {class: `status ${status === 'ok' ? 'ok' : 'bad'}`}, `${count} ${status}`));
  const failed = run.statuses.filter((row) => row.status !== 'ok');
  const table = failed.length === 0 ?
      null :
      dataTable(
          ['Status', 'Backend', 'Cases', 'Reason', 'For example'],
          failed.map((row) => [row.status, row.backend, String(row.count), row.reason, make('code', {}, row.example)]),
          'Cases that did not end well');
  return make('div', {}, make('h4', {}, 'Cases by status'), make('p', {class: 'legend'}, ...summary), table);
}

/** As the sampler's own results show it; of older runs, as the driver reports it. */
function filterBits(device) {
  if ((device.filter || []).length) return device.filter.map((f) => `${f.texels} ${f.bits}`).join(', ');
  return device.subtexel_bits ? String(device.subtexel_bits) : 'not reported';
}

/** Least and greatest of what a device told of itself before and after its blocks; undefined where it told nothing. */
const rangeText = ({states}, id) => states?.[id]?.map((value) => formatNumber(value)).join(' – ');

function heldBackText({states}) {
  if (!states?.blocks_held_back && !states?.held_back) return undefined;
  return [`${states.blocks_held_back || 0} of ${states.blocks} blocks`, ...states.held_back || []].join(', ');
}

/** What a pixel costs in frames of each size, over its cost in larger ones. */
const fillText = ({frame_fill: fills}) =>
    fills?.map((fill) => `${(fill.frame_px || []).join('x')}: ${formatNumber(fill.pixel_cost)}`).join(', ');

/** What some of the devices told. */
function stateColumns(devices) {
  /** @type {[string, (device: any) => string][]} */
  const columns = [
    ['Clock (MHz)', (device) => rangeText(device, 'clock_mhz')],
    ['Temperature (C)', (device) => rangeText(device, 'temperature_c')],
    ['Power (W)', (device) => rangeText(device, 'power_w')],
    ['Held back', heldBackText],
    ['Pixel, of twice the size', fillText],
  ];
  return columns.filter(([, text]) => devices.some(text));
}

function deviceTable(devices) {
  if (devices.length === 0) return null;
  /** @type {[string, (device: any) => string][]} */
  const columns = [
    ['Device', (device) => device.name],
    ['Backend', (device) => `${device.backend} ${device.index}`],
    ['Vendor', (device) => device.vendor],
    ['Type', (device) => device.type],
    ['Driver', (device) => device.driver],
    ['API', (device) => device.api_version],
    ['Filter weight bits', filterBits],
    ['Control case', (device) => (device.control_reference_ns ? formatTime(device.control_reference_ns) : '–')],
    ...stateColumns(devices),
  ];
  return dataTable(
      columns.map(([title]) => title), devices.map((device) => columns.map(([, text]) => text(device) ?? '–')),
      'Devices');
}

function runElement(run) {
  const {info} = run;
  const host = info.host || {};
  const counts = info.counts || {};
  const cached = (made, reused) =>
      (counts[made] === undefined ? null : `${counts[made]} made, ${counts[reused] || 0} read from the cache`);
  const devices = info.devices || [];
  return make(
      'article', {class: 'run'}, make('h3', {}, info.name || run.folder), factsTable([
        ['Folder', run.folder],
        ['Started', info.started],
        ['Finished', info.finished || 'no'],
        ['Processor', host.cpu && `${host.cpu}, ${host.cores} cores`],
        ['System', host.os],
        ['Memory', host.memory_bytes && formatBytes(host.memory_bytes)],
        ['reliefbench', [info.version, info.git_sha].filter(Boolean).join(', ')],
        ['Config', info.config_path],
        ['Config\'s SHA-256', info.identity && info.identity.config_sha256],
        ['Command', info.argv && make('code', {}, info.argv.map(shellQuote).join(' '))],
        ['Bakes', cached('bakes', 'bakes_cached')],
        ['References', cached('references', 'references_cached')],
        ['Shaders', counts.shaders === undefined ? null : String(counts.shaders)],
      ]),
      deviceTable(devices), auditTable(devices), info.wall_s ? wallSplit(info.wall_s) : null, statusTables(run));
}

export function drawEnvironment() { byId('environment-runs').append(...data.runs.map(runElement)); }

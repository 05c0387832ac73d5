// The top of the page: what was measured on what, and what to know before one reads on.

import {missing, whenChanged} from './choice.js';
import {byId, data, make} from './page.js';

function notices() {
  const found = [];
  if (data.runs.length && data.points.length === 0)
    found.push('Nothing was measured: no case ended well. The reasons are below.');
  for (const run of data.runs) {
    const name = run.info.name || run.folder;
    if (!run.info.finished) found.push(`${name} was not finished: what follows is what was measured until then.`);
    for (const device of run.info.devices || []) {
      if (device.software) {
        found.push(
            `${device.name} is a software rasteriser, it runs on the processor: its errors hold on a GPU too` +
            `${run.filter_notes.length ? ', but for those marked *' : ''}, its times do not.`);
      }
    }
  }
  for (const run of data.runs) found.push(...run.filter_notes);
  return [...new Set(found)];
}

export function drawHeader() {
  const names = [...new Set(data.runs.map((run) => run.info.name || run.folder))];
  if (names.length === 0) return;
  byId('title').textContent = names.join(' · ');
  document.title = `${names.join(' · ')} – reliefbench`;
  const backendsOf = new Map();
  for (const {device, backend} of data.groups)
    backendsOf.set(device, [...new Set([...(backendsOf.get(device) || []), backend])]);
  const devices = [...backendsOf].map(([device, backends]) => `${device} (${backends.join(', ')})`);
  const started = [...new Set(data.runs.map((run) => run.info.started).filter(Boolean))].sort();
  const when = started.map((time) => time.replace('T', ' ').replace(/:\d\dZ$/, ' UTC'));
  const {version} = data.runs[0].info;
  byId('subtitle').textContent = [
    devices.join(', '), when.length > 1 ? `${when[0]} to ${when[when.length - 1]}` : when[0],
    `${data.points.length} cases measured`, version ? `reliefbench ${version}` : null
  ].filter(Boolean).join(' · ');
  const texts = notices();
  if (texts.length === 0) return;
  const [first, ...more] = texts.map((text) => make('p', {}, text));
  byId('notices').append(make(
      'div', {class: 'notice'}, first,
      more.length ? make('details', {}, make('summary', {}, `${more.length} more`), ...more) : null));
}

/** Says what a link names that is not here. */
export function drawMissing() {
  const box = byId('link-missing');
  box.hidden = missing.length === 0;
  box.textContent = `Not in this report, though the link names it: ${missing.join(', ')}`;
}

whenChanged(['pins'], drawMissing);

// May the machines be believed: their noise, what they would show, and the audits of their timers and filters.

import {auditTable} from './audits.js';
import {byId, data, factsTable, formatTime, make, percent} from './page.js';
import {formatDay, formatMoment, shiftText} from './trend_data.js';
import {epochTable} from './trend_epochs.js';
import {controlSpark} from './trend_spark.js';

const filterText = ({texels, bits, rounds}) => `${texels}: ${bits} bits, ${rounds ? 'rounded' : 'cut off'}`;

function controlText({control_ns: control}) {
  const known = control.filter((ns) => ns !== null);
  if (known.length === 0) return 'not measured';
  const [low, high] = [Math.min(...known), Math.max(...known)];
  return `${formatTime(low)} to ${formatTime(high)} over ${known.length} nights`;
}

function controlFigure(machine, calibration) {
  const [first, last] = [calibration.nights[0], calibration.nights[calibration.nights.length - 1]];
  return make(
      'figure', {}, controlSpark(machine, calibration),
      make(
          'figcaption', {}, `control case, ${formatDay(data.runs[first].time)} to ${formatDay(data.runs[last].time)}`));
}

function deviceCard(device, machine) {
  const {calibration} = device;
  return make(
      'div', {class: 'card'}, make('h4', {}, device.name), factsTable([
        ['Backend', device.backend],
        ['Driver', device.driver],
        ['Timer', device.timer],
        ['Filter', (device.filter || []).map(filterText).join('; ')],
        ['Control case', calibration && controlText(calibration)],
      ]),
      calibration && calibration.nights.length > 1 ? controlFigure(machine, calibration) : null);
}

function machineElement(machine, index) {
  return make(
      'article', {class: 'run'}, make('h3', {}, machine.name), factsTable([
        ['Nights', String(machine.nights)],
        ['Last seen', machine.last && formatMoment(machine.last)],
        ['Noise of a night', machine.noise === null ? null : percent(machine.noise, 2)],
        ['Smallest shift', shiftText(machine.smallest_shift)],
      ]),
      make('div', {class: 'cards'}, ...machine.devices.map((device) => deviceCard(device, index))),
      auditTable(machine.devices), epochTable(index));
}

export function drawHealth() {
  byId('machine-health').append(...(data.machines.length ? data.machines.map(machineElement) : [
    make('p', {class: 'missing'}, 'No machine yet.')
  ]));
}

// The audit of a device's timers.

import {dataTable, formatNumber, make} from './page.js';

function auditRow(device, audit) {
  const verdict = !audit.valid ? 'rejected' : audit.timer === device.timer ? 'used' : 'valid';
  return [
    `${device.name} (${device.backend})`, audit.timer, make('span', {class: `verdict ${verdict}`}, verdict),
    audit.wall_ratio ? formatNumber(audit.wall_ratio) : '–', audit.doubling ? formatNumber(audit.doubling) : '–',
    audit.reason || ''
  ];
}

/** devices: with their `audit`. Nothing where none was audited. */
export function auditTable(devices) {
  const audits = devices.flatMap((device) => (device.audit || []).map((audit) => auditRow(device, audit)));
  if (audits.length === 0) return null;
  return dataTable(
      ['Device', 'Timer', 'Verdict', 'Device / wall', '2N / N', 'Why rejected'], audits,
      'Timer audit: a timer is believed if it agrees with the fenced wall clock and doubles with the work');
}

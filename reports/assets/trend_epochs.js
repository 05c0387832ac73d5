// Runs of nights that one environment made, which alone are compared.

import {data, dataTable} from './page.js';
import {environmentOf, formatDay, runsOf} from './trend_data.js';

/** Of a machine, by time: {environment, from, to, label}, in places. */
export function epochsOf(machine) {
  const epochs = [];
  runsOf[machine].forEach((run, place) => {
    const {environment} = data.runs[run];
    const last = epochs[epochs.length - 1];
    if (last && last.environment === environment)
      last.to = place;
    else
      epochs.push({environment, from: place, to: place, label: environmentOf(data.runs[run]).text});
  });
  return epochs;
}

export function epochTable(machine) {
  const dayOf = (place) => formatDay(data.runs[runsOf[machine][place]].time);
  const rows = epochsOf(machine).map(
      ({environment,
        from,
        to,
        label}) => [dayOf(from), String(to - from + 1), data.environments[environment].hash, label]);
  return rows.length === 0 ?
      null :
      dataTable(['From', 'Nights', 'Environment', ''], rows, 'Epochs: nights are compared within one environment');
}

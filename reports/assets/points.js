// The report's points and metrics, how they are written, and the command that measures a point again.

import {copyButton, shellQuote} from './copy.js';
import {data, formatInterval, formatNumber, make} from './page.js';

export const metricIndex = new Map(data.metrics.map((metric, index) => [metric.id, index]));
export const state = {
  metric: metricIndex.get(data.front_metric),
  hidden: new Set()
};

/** With what the interval covers: fewer than six samples give no 95 %. */
export function intervalText(point) { return `${point.coverage} interval ${formatInterval(point.time_ns)}`; }

export function formatMetric(index, value) {
  const metric = data.metrics[index];
  if (value === null) return metric.none_is_best ? 'identical' : 'none';
  return metric.unit ? `${formatNumber(value)} ${metric.unit}` : formatNumber(value);
}
export const errorOf = (point, metric = state.metric) => formatMetric(metric, point.errors[metric]);
export const metricTitle = (metric) => (metric.unit ? `${metric.id} (${metric.unit})` : metric.id);

export function formatBytes(bytes) {
  const units = ['B', 'KiB', 'MiB', 'GiB'];
  const power = Math.min(units.length - 1, bytes > 0 ? Math.floor(Math.log2(bytes) / 10) : 0);
  return `${formatNumber(bytes / 1024 ** power)} ${units[power]}`;
}

export const formatSeconds = (s) => (s >= 90 ? `${formatNumber(s / 60)} min` : `${formatNumber(s)} s`);

/** A budget's text as read by people. */
export const comparison = (text) => text.replace('<=', ' ≤ ').replace('>=', ' ≥ ');

export const techniqueOf = (point) => data.techniques[point.technique].id;
export const groupLabel = (group) => data.groups[group].label;
const runOf = (point) => data.runs[data.groups[point.group].run];

/** Technique with its settings and their mark; settings wrap between, not within, assignments. */
export function settingsElement(point) {
  const settings = point.params.map(([name, value]) => make('span', {}, `${name}=${value} `));
  return make('span', {class: 'settings'}, make('strong', {}, techniqueOf(point)), ' ', ...settings, point.mark);
}

/** The command line that measures a point again. */
export function commandOf(point) {
  const config = runOf(point).info.config_path || 'CONFIG';
  return `reliefbench sweep ${shellQuote(config)} -o out/one --filter ${shellQuote(point.id)}`;
}

/** The command line that ends an interrupted run and draws the pictures that its folder lacks; null: not known. */
export function picturesCommand(point) {
  const words = runOf(point).info.argv;
  if (!words) return null;
  const kept = words.filter(
      (word, index) => words[index - 1] !== '--pictures' && word !== '--pictures' && !word.startsWith('--pictures='));
  return kept.map(shellQuote).join(' ');
}

export const command = (point) =>
    make('div', {class: 'command'}, make('code', {}, commandOf(point)), copyButton(commandOf(point), 'Copy'));

// The report's points and metrics, how they are written, and the command that measures a point again.

import {shellQuote} from './copy.js';
import {data, formatNumber, make} from './page.js';

export const metricIndex = new Map(data.metrics.map((metric, index) => [metric.id, index]));
export const columnMetrics = data.metrics.map((_, index) => index).filter((index) => data.metrics[index].is_column);

const hasUnit = ({unit}) => unit !== '' && unit !== '1';

export function formatMetric(index, value) {
  const metric = data.metrics[index];
  if (value === null) return metric.none_is_best ? 'identical' : 'none';
  return hasUnit(metric) ? `${formatNumber(value)} ${metric.unit}` : formatNumber(value);
}
export const errorOf = (point, metric) => formatMetric(metric, point.errors[metric]);
export const metricTitle = (metric) => (hasUnit(metric) ? `${metric.id} (${metric.unit})` : metric.id);

/** In texels and, where the scene's map is known, in pixels of the middle of the picture. */
export function errorAsSeen(point, metric) {
  const {unit} = data.metrics[metric];
  const {texel_px} = data.scenes[point.scene];
  const value = point.errors[metric];
  if (unit !== 'texels' || !texel_px || value === null) return errorOf(point, metric);
  return `${errorOf(point, metric)} = ${formatNumber(value * texel_px, 2)} px`;
}

export function formatBytes(bytes) {
  const units = ['B', 'KiB', 'MiB', 'GiB'];
  const power = Math.min(units.length - 1, bytes > 0 ? Math.floor(Math.log2(bytes) / 10) : 0);
  return `${formatNumber(bytes / 1024 ** power)} ${units[power]}`;
}

export const formatSeconds = (s) => (s >= 90 ? `${formatNumber(s / 60)} min` : `${formatNumber(s)} s`);

/** A budget's text as read by people. */
export const comparison = (text) => text.replace('<=', ' ≤ ').replace('>=', ' ≥ ');

export const settingOf = (point) => data.settings[point.setting];
export const techniqueIndex = (point) => settingOf(point).technique;
export const techniqueName = (index) => data.techniques[index].id.replaceAll('_', ' ');
export const techniqueOf = (point) => techniqueName(techniqueIndex(point));
export const sceneName = (scene) => data.scenes[scene].id;
export const groupLabel = (group) => data.groups[group].label;
const devices = new Set(data.groups.map(({device}) => device));
const isOneRun = new Set(data.groups.map(({run}) => run)).size < 2;
/** Where all is of one device, the backend alone. */
export const shortLabel = (group) => (devices.size === 1 && isOneRun ? data.groups[group].backend : groupLabel(group));
const runOf = (point) => data.runs[data.groups[point.group].run];

/** A parameter's text; '' where the setting has none. */
export const paramOf = (point, name) => {
  const found = settingOf(point).params.find(([id]) => id === name);
  return found ? found[1] : '';
};

/** "relaxed cone, 32 steps" */
export function settingTitle(point) {
  const steps = settingOf(point).params.find(([id, text]) => /steps/.test(id) && /^\d+$/.test(text));
  return steps ? `${techniqueOf(point)}, ${steps[1]} steps` : techniqueOf(point);
}

/** What differs from the defaults, and the key; settings wrap between, not within, assignments. */
export function settingElement(point, {hasTechnique = true} = {}) {
  const {name, key} = settingOf(point);
  const words = name.split(' ');
  const settings = words.slice(1).map((word) => make('span', {}, `${word} `));
  return make(
      'span', {class: 'settings'}, hasTechnique ? make('strong', {}, `${words[0]} `) : null, ...settings,
      key ? make('span', {class: 'muted'}, `[${key}]`) : null, point.mark ? ` ${point.mark}` : null);
}

/** What a run's command line gave an option; undefined: nothing. */
function optionOf(run, name) {
  const words = run.info.argv || [];
  const at = words.findIndex((word) => word === name || word.startsWith(`${name}=`));
  if (at < 0) return undefined;
  return words[at] === name ? words[at + 1] : words[at].slice(name.length + 1);
}

/** The command line that measures a point again, into a folder of its own. */
export function commandOf(point) {
  const run = runOf(point);
  const config = run.info.config_path || 'CONFIG';
  const {key} = settingOf(point);
  const scene = point.id.slice(point.id.indexOf('@') + 1).split('?')[0];
  const words = ['reliefbench', 'sweep', config, '-o', `out/${key || 'one'}`];
  if (key)
    words.push('--case', key, '--filter', `*@${scene}?*`, '--backend', data.groups[point.group].backend);
  else
    words.push('--filter', point.id);
  const framePx = optionOf(run, '--frame-px');
  if (framePx) words.push('--frame-px', framePx);
  return words.map(shellQuote).join(' ');
}

/** The command line that ends an interrupted run and draws the pictures that its folder lacks; null: not known. */
export function picturesCommand(run) {
  const words = run.info.argv;
  if (!words) return null;
  const kept = words.filter(
      (word, index) => words[index - 1] !== '--pictures' && word !== '--pictures' && !word.startsWith('--pictures='));
  return kept.map(shellQuote).join(' ');
}

// The report's points and metrics, how they are written, and the command that measures a point again.

import {shellQuote} from './copy.js';
import {data, formatNumber} from './page.js';
import {nameElement} from './setting_name.js';

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
const techniqueOf = (point) => techniqueName(techniqueIndex(point));
export const sceneName = (scene) => data.scenes[scene].id;
const groupLabel = (group) => data.groups[group].label;
const devices = new Set(data.groups.map(({device}) => device));
const isOneRun = new Set(data.groups.map(({run}) => run)).size < 2;
/** Where all is of one device, the backend alone. */
export const shortLabel = (group) => (devices.size === 1 && isOneRun ? data.groups[group].backend : groupLabel(group));

/**
 * As short as tells the devices apart: of "llvmpipe (LLVM 15.0.6, 256 bits)" the first word, where several are there.
 */
const briefLabels = data.groups.map(({device, backend, run}) => {
  const differ = (name) => new Set(data.groups.map((group) => group[name])).size > 1;
  const twins = data.groups.filter((group) => group.device === device && group.backend === backend);
  const parts = [
    differ('device') ? device.replace(/ \(.*$/, '') : '', differ('backend') ? backend : '',
    twins.length > 1 ? data.runs[run].folder.replace(/\/+$/, '').replace(/^.*\//, '') : ''
  ];
  return parts.filter(Boolean).join(' ') || backend;
});
export const briefLabel = (group) => {
  const label = briefLabels[group];
  return briefLabels.filter((other) => other === label).length > 1 ? groupLabel(group) : label;
};
const runOf = (point) => data.runs[data.groups[point.group].run];

/** A parameter's text; '' where the setting has none. The map also of a technique that has but one kind. */
export const paramOf = (point, name) => {
  const {params, map} = settingOf(point);
  const found = params.find(([id]) => id === name);
  return found?.[1] ?? (name === 'map' ? map : '');
};

/** "relaxed cone, 32 steps" */
export function settingTitle(point) {
  const steps = settingOf(point).params.find(([id, text]) => /steps/.test(id) && /^\d+$/.test(text));
  return steps ? `${techniqueOf(point)}, ${steps[1]} steps` : techniqueOf(point);
}

/** What differs from the defaults, and the key; settings wrap between, not within, assignments. */
export function settingElement(point, {hasTechnique = true} = {}) {
  const {name, key} = settingOf(point);
  return nameElement(name, key, {hasTechnique, mark: point.mark.trim()});
}

/** What a run's command line gave an option, each time that it stands there. */
function optionsOf(run, name) {
  const words = run.info.argv || [];
  return words.flatMap((word, at) => {
    if (word === name) return words[at + 1] === undefined ? [] : [words[at + 1]];
    return word.startsWith(`${name}=`) ? [word.slice(name.length + 1)] : [];
  });
}

/**
 * What a case's time depends on beside its id: frame, device and injected slowdowns. A merged run's argv tells none.
 */
function conditionsOf(point, run) {
  const {backend, device} = data.groups[point.group];
  const {devices = [], injected_slowdown: slowdowns = {}} = run.info.identity || {};
  const px = data.scenes[point.scene].frame_px;
  const framePx = optionsOf(run, '--frame-px').at(-1) ?? px?.join('x');
  const index = devices.find((one) => one.backend === backend && one.name === device)?.index;
  return [
    ...(framePx ? ['--frame-px', framePx] : []), ...(index ? ['--device', String(index)] : []),
    ...Object.entries(slowdowns).flatMap(([technique, factor]) => ['--inject-slowdown', `${technique}:${factor}`])
  ];
}

/** The command line that measures a point again, into a folder of its own. */
function sweepOf(point) {
  const run = runOf(point);
  const config = run.info.config_path || 'CONFIG';
  const {key} = settingOf(point);
  const scene = point.id.slice(point.id.indexOf('@') + 1).split('?')[0];
  const words = ['reliefbench', 'sweep', config, '-o', `out/${key || 'one'}`];
  if (key)
    words.push('--case', key, '--filter', `*@${scene}?*`, '--backend', data.groups[point.group].backend);
  else
    words.push('--filter', point.id);
  return [...words, ...conditionsOf(point, run)].map(shellQuote).join(' ');
}

/** Of a search: what shows and ships a setting that its folder has recorded, as `tune` itself says. */
function searchCommands(point) {
  const {key, recorded_in: folder} = settingOf(point);
  if (!folder) return [];
  const {scenes} = data.tune;
  const words = ['--run', folder, '--case', key, ...(scenes.length > 1 ? ['--scene', scenes[0]] : [])];
  const command = (name, ...more) => ['reliefbench', name, ...words, ...more].map(shellQuote).join(' ');
  return [
    ['Copy view command', command('view')], ['Copy export command', command('export', '-o', `${folder}/shipped`)]
  ];
}

/** What can be done with a point on the command line: [[label of the button that copies it, command line]]. */
export const commandsOf = (point) => (data.tune ? searchCommands(point) : [['Copy command', sweepOf(point)]]);

/**
 * The command lines that end an interrupted run and draw the pictures that its folder lacks; none where it is not
 * known, or where the run was merged: its parts were swept elsewhere.
 */
export function picturesCommand(run) {
  const words = run.info.argv;
  if (!words || words[1] !== 'sweep') return null;
  const kept = words.filter(
      (word, index) => words[index - 1] !== '--pictures' && word !== '--pictures' && !word.startsWith('--pictures='));
  return kept.map(shellQuote).join(' ');
}

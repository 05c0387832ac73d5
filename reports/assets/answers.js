// The headline: what to ship, by device and scene.

import {copyButton} from './copy.js';
import {byId, data, formatNumber, formatTime, make} from './page.js';
import {commandOf, comparison, errorOf, groupLabel, intervalText, metricIndex, settingsElement} from './points.js';

export function budgetText(budget) {
  const {unit} = data.metrics[metricIndex.get(budget.metric)];
  return comparison(budget.text) + (unit ? ` ${unit}` : '');
}

function answerRow(label, point, hint) {
  if (point === null) return null;
  const p = data.points[point];
  return make(
      'div', {class: 'answer-row'}, make('dt', {title: hint}, label),
      make(
          'dd', {}, make('span', {class: 'figure'}, formatTime(p.time_ns[0])), ' ', settingsElement(p),
          make('span', {class: 'muted'}, ` ${frontMetricText(p)}`)));
}

// The headline keeps the run's own error metric; the selector is for exploring.
export const frontMetricText = (p) => {
  const index = metricIndex.get(data.front_metric);
  return `${data.front_metric} ${errorOf(p, index)}`;
};

function answerCard(answer) {
  const scene = data.scenes[answer.scene];
  const head =
      make('div', {class: 'card-head'}, make('h3', {}, scene), make('p', {class: 'muted'}, groupLabel(answer.group)));
  const runnerUp = answer.runner_up === answer.tie ? null : answer.runner_up;
  const rows = [
    answer.tie === null ?
        null :
        answerRow(
            'Tie', answer.tie, 'as fast as far as the intervals tell; the pick has fewer features or a smaller map'),
    runnerUp === answer.simplest ?
        answerRow('Runner-up and simplest', runnerUp) :
        [
          answerRow('Runner-up', runnerUp, 'next best of other settings'),
          answer.simplest === answer.pick ?
              null :
              answerRow('Simplest', answer.simplest, 'the setting with the fewest features that meets the budget')
        ],
    answerRow('Flat floor', answer.flat, 'the same frame without relief'),
  ].flat();
  if (answer.pick === null) {
    return make(
        'article', {class: 'card no-answer'}, head, make('p', {class: 'headline'}, 'Nothing meets the budget'),
        answer.miss ? make('p', {}, `Nearest: ${answer.miss}.`) : null,
        make('dl', {}, answerRow('Nearest', answer.nearest), answerRow('Flat floor', answer.flat)));
  }
  const pick = data.points[answer.pick];
  const floor = answer.flat === null || answer.flat === answer.pick ?
      null :
      make('span', {class: 'muted'}, ` ${formatNumber(pick.time_ns[0] / data.points[answer.flat].time_ns[0])} × flat`);
  return make(
      'article', {class: 'card'}, head, make('p', {class: 'headline'}, formatTime(pick.time_ns[0]), floor),
      make('p', {class: 'muted'}, `${intervalText(pick)} · ${frontMetricText(pick)}`),
      make('p', {}, settingsElement(pick)),
      answer.simplest === answer.pick ?
          make('p', {class: 'muted'}, 'Also the simplest setting that meets the budget.') :
          null,
      make('dl', {}, ...rows), copyButton(commandOf(pick)));
}

function notices() {
  const found = [];
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
  if (data.points.length === 0) found.push('Nothing was measured: no case ended well. The reasons are below.');
  return [...new Set(found)];
}

export function drawAnswers() {
  const first = data.runs[0].info;
  const names = [...new Set(data.runs.map((run) => run.info.name || run.folder))];
  byId('title').textContent = names.join(' · ');
  document.title = `${names.join(' · ')} – reliefbench`;
  const backendsOf = new Map();
  for (const {device, backend} of data.groups)
    backendsOf.set(device, [...new Set([...(backendsOf.get(device) || []), backend])]);
  const devices = [...backendsOf].map(([device, backends]) => `${device} (${backends.join(', ')})`);
  const started = [...new Set(data.runs.map((run) => run.info.started).filter(Boolean))].sort();
  const when = started.map((time) => time.replace('T', ' ').replace(/:\d\dZ$/, ' UTC'));
  const version = first.version ? `reliefbench ${first.version}` : null;
  byId('subtitle').textContent = [
    devices.join(', '), when.length > 1 ? `${when[0]} to ${when[when.length - 1]}` : when[0],
    `${data.points.length} settings measured`, version
  ].filter(Boolean).join(' · ');
  byId('notices').append(...notices().map((text) => make('p', {class: 'notice'}, text)));
  const budgets = [...new Set(data.runs.map((run) => run.budgets.map(budgetText).join(' and ')))];
  byId('budget').textContent = `The fastest setting with ${budgets.join('; or ')}:`;
  const byScene = [...data.answers].sort((a, b) => a.scene - b.scene || a.group - b.group);
  byId('answer-cards').append(...byScene.map(answerCard));
}

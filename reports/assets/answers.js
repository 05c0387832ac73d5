// The answer first: a card for each scene, with a sentence and the price of what it picks.

import {choice, choose, whenChanged} from './choice.js';
import {copyButton} from './copy.js';
import {answerOf, budgetsOf, groupsOf, isFiltered, missText} from './decide.js';
import {byId, data, formatInterval, formatNumber, formatTime, make} from './page.js';
import {commandOf, comparison, errorAsSeen, errorOf, formatBytes, metricIndex, sceneName, settingElement, settingTitle, shortLabel, techniqueIndex, techniqueName} from './points.js';

const kCardsShown = 6;
const times = (ratio) => (ratio >= 10 ? String(Math.round(ratio)) : formatNumber(ratio, 2));

/** How the pick's error stands to another setting's that is within the same budgets. */
function errorCompared(pick, other, hasLimit) {
  const {lower_is_better, id} = data.metrics[choice.metric];
  const [own, its] = [pick.errors[choice.metric], other.errors[choice.metric]];
  const rank = (value) => (value === null ? -Infinity : lower_is_better ? value : -value);
  if (rank(own) === rank(its)) return 'at the same error';
  if (rank(own) < rank(its)) return 'at no more error';
  if (hasLimit) return 'within the same error budget';
  return lower_is_better && its > 0 ? `at ${times(own / its)}× the ${id}` :
                                      `with ${id} ${errorOf(pick, choice.metric)}`;
}

function comparedTo(pick, other, hasLimit) {
  const ratio = other.time_ns[0] / pick.time_ns[0];
  const name = techniqueName(techniqueIndex(other));
  const error = errorCompared(pick, other, hasLimit);
  const overlaps = other.time_ns[1] <= pick.time_ns[2] && pick.time_ns[1] <= other.time_ns[2];
  if (overlaps) return `as fast as ${name}, as far as the intervals tell, and simpler or smaller`;
  return `${ratio < 1 ? `${times(1 / ratio)}× slower` : `${times(ratio)}× faster`} than ${name} ${error}`;
}

/** "relaxed cone, 32 steps: 3.4× faster than relief at no more error" */
function sentenceOf(answer) {
  const pick = data.points[answer.pick];
  const hasLimit = answer.budgets.some(({metric}) => metric === data.metrics[choice.metric].id);
  // Against the simplest technique that does; if it is that, against the best of the others.
  const isSimplest = answer.baseline === null || techniqueIndex(data.points[answer.baseline]) === techniqueIndex(pick);
  const other = isSimplest ? answer.rival : answer.baseline;
  if (other === null) return `${settingTitle(pick)}: no other technique that was measured is within the budget`;
  return `${settingTitle(pick)}: ${comparedTo(pick, data.points[other], hasLimit)}`;
}

/** The answers of a scene: lists of those that are one setting. */
function answersIn(scene) {
  const bySetting = new Map();
  for (const group of groupsOf(scene)) {
    const answer = answerOf(scene, group);
    const key = answer.pick === null ? 'none' : data.points[answer.pick].setting;
    if (!bySetting.has(key)) bySetting.set(key, []);
    bySetting.get(key).push(answer);
  }
  return [...bySetting.values()];
}

const answerRow = (label, content, hint) =>
    make('div', {class: 'answer-row'}, make('dt', {title: hint}, label), make('dd', {}, content));

function pointRow(label, index, hint) {
  if (index === null) return null;
  const point = data.points[index];
  return answerRow(
      label,
      [
        make('span', {class: 'figure'}, formatTime(point.time_ns[0])), ' ', settingElement(point),
        make('span', {class: 'muted'}, ` ${errorOf(point, choice.metric)}`)
      ],
      hint);
}

const show = (index) => () => {
  const point = data.points[index];
  choose({scene: point.scene, picture: index, pins: [...new Set([...choice.pins, index])]});
};

/** What a pick costs on a device, and how sure that is. */
function priceRow(answer) {
  const point = data.points[answer.pick];
  const flat = answer.flat === null || answer.flat === answer.pick ? null : data.points[answer.flat];
  const floor = flat ? ` · ${formatNumber(point.time_ns[0] / flat.time_ns[0], 2)}× flat` : '';
  const sure = answer.ties ? ` · ties with ${answer.ties}` : '';
  const hint = `${point.coverage} interval of ${point.samples} samples` +
      (flat ? '; flat: the same frame without relief' : '') +
      (answer.ties ? '; ties: as fast as far as the intervals tell, with more features or a larger map' : '');
  return make(
      'p', {class: 'price', title: hint}, make('strong', {}, formatTime(point.time_ns[0])),
      make('span', {class: 'muted'}, ` ${formatInterval(point.time_ns)} · ${shortLabel(answer.group)}${floor}${sure}`));
}

function errorTexts(point) {
  const own = metricIndex.get(data.front_metric);
  const shown = [...data.metrics.keys()].filter(
      (index) => index === choice.metric || index === own || data.metrics[index].is_seen);
  return shown.filter((index) => point.errors[index] !== null || data.metrics[index].none_is_best)
      .map((index) => `${data.metrics[index].id} ${errorAsSeen(point, index)}`)
      .join(' · ');
}

const missBlock = (answers) => make(
    'div', {class: 'answer no-answer'}, make('p', {class: 'sentence'}, 'Nothing meets the budget'),
    make('p', {class: 'muted'}, answers.map(({group}) => shortLabel(group)).join(', ')),
    answers[0].nearest === null ? null : make('p', {}, `Nearest: ${missText(answers[0].nearest, answers[0].budgets)}.`),
    make('dl', {}, pointRow('Nearest', answers[0].nearest), pointRow('Flat floor', answers[0].flat)));

/** isFirst: of its scene; the others are told in short. */
function answerBlock(answers, isFirst) {
  const [answer] = answers;
  if (answer.pick === null) return missBlock(answers);
  const pick = data.points[answer.pick];
  const accurate = answers.map((a) => a.accurate).find((index) => index !== null) ?? null;
  const inTime = accurate === null ? answerRow('Within time', 'nothing is so fast') :
                                     pointRow('Within time', accurate, 'the most accurate within the time budget');
  const more = make(
      'details', {}, make('summary', {}, 'What else does, what just fails'),
      make(
          'dl', {}, pointRow('Tie', answer.tie, 'as fast as far as the intervals tell'),
          answer.runnerUp === answer.tie ? null : pointRow('Runner-up', answer.runnerUp, 'next best of other settings'),
          [answer.pick, answer.tie, answer.runnerUp].includes(answer.baseline) ?
              null :
              pointRow('Simplest', answer.baseline, 'the fastest of the simplest technique that does'),
          pointRow('Just fails', answer.justFails, 'faster, and misses the budget by least'),
          pointRow('Flat floor', answer.flat, 'the same frame without relief')));
  const buttons = make(
      'p', {class: 'card-buttons no-print'},
      make('button', {type: 'button', class: 'copy', onclick: show(answer.pick)}, 'Pin and show'), ' ',
      copyButton(commandOf(pick)));
  const errors = make(
      'p', {class: 'errors'}, errorTexts(pick) + (pick.memory_bytes ? ` · map ${formatBytes(pick.memory_bytes)}` : ''));
  const sentence = isFirst ? sentenceOf(answer) : settingTitle(pick);
  if (!isFirst) more.append(errors, buttons);
  return make(
      'div', {class: 'answer'}, make('p', {class: 'sentence'}, sentence), ...answers.map(priceRow),
      isFirst ? errors : null, make('p', {}, settingElement(pick)),
      choice.time_ms === null ? null : make('dl', {}, inTime), more, isFirst ? buttons : null);
}

const answerCard = (scene) => make(
    'article', {class: 'card'}, make('h3', {}, sceneName(scene)),
    ...answersIn(scene).map((answers, at) => answerBlock(answers, at === 0)));

function budgetSentence() {
  const texts = data.groups.map((_, group) => budgetsOf(group).map((b) => comparison(b.text)).join(' and '));
  const within = [...new Set(texts)].filter(Boolean).join('; or ');
  const filtered = isFiltered() ? ', of what the filters leave' : '';
  return `The fastest setting${within ? ` with ${within}` : ''}${filtered}:`;
}

export function drawAnswers() {
  const scenes = [...data.scenes.keys()];
  byId('budget').textContent = data.points.length ? budgetSentence() : '';
  byId('answer-cards').replaceChildren(...scenes.slice(0, kCardsShown).map(answerCard));
  const rest = scenes.slice(kCardsShown);
  const more = /** @type {HTMLDetailsElement} */ (byId('more-answers'));
  more.hidden = rest.length === 0;
  more.querySelector('summary').textContent = `${rest.length} more scenes`;
  if (more.open || rest.length === 0) more.querySelector('div').replaceChildren(...rest.map(answerCard));
}

export const startAnswers = () => {
  byId('more-answers').addEventListener('toggle', drawAnswers);
  drawAnswers();
};

whenChanged(['metric', 'error', 'time_ms', 'hidden', 'search', 'map', 'format', 'encoding'], drawAnswers);

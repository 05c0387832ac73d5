// The answer first: a card for each scene, with a sentence and the price of what it picks.

import {choice, choose, whenChanged} from './choice.js';
import {copyButton} from './copy.js';
import {answerOf, budgetsOf, groupsOf, isFiltered, keptBudgets, missText} from './decide.js';
import {refill} from './focus.js';
import {byId, data, formatInterval, formatNumber, formatTime, make} from './page.js';
import {briefLabel, commandsOf, comparison, errorAsSeen, errorOf, formatBytes, metricIndex, sceneName, settingElement, settingTitle, shortLabel, techniqueIndex, techniqueName} from './points.js';

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

/** Lists of the things that have the same text: [[text, things]]. */
function byText(things, textOf) {
  const lists = new Map();
  for (const one of things) {
    const text = textOf(one);
    if (!lists.has(text)) lists.set(text, []);
    lists.get(text).push(one);
  }
  return [...lists];
}
const devicesOf = (answers) => answers.map(({group}) => briefLabel(group)).join(', ');

/**
 * What devices have as one part of their answers: a row for each setting, with its time on every device. none: what
 * stands where a device has none.
 */
function pointRows(label, answers, part, hint, none = null) {
  const pointIn = (answer) => data.points[part(answer)] ?? null;
  const lists = byText(answers, (answer) => pointIn(answer)?.setting ?? -1);
  return lists.filter(([setting]) => setting >= 0 || none).map(([setting, here]) => {
    const where = lists.length > 1 || here.length > 1;
    if (setting < 0) return answerRow(label, where ? `${none} on ${devicesOf(here)}` : none, hint);
    const figures = here.flatMap(
        (answer) =>
            [make('span', {class: 'figure'}, formatTime(pointIn(answer).time_ns[0])),
             make(
                 'span', {class: 'muted'},
                 ` ${errorOf(pointIn(answer), choice.metric)}${where ? ` on ${briefLabel(answer.group)}` : ''} `)]);
    return answerRow(label, [settingElement(pointIn(here[0])), ' ', ...figures], hint);
  });
}

const show = (answers) => () => {
  const picks = answers.map(({pick}) => pick);
  choose({scene: answers[0].scene, picture: picks[0], pins: [...new Set([...choice.pins, ...picks])]});
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

const mapText = ({memory_bytes: bytes}) => (bytes ? ` · map ${formatBytes(bytes)}` : '');

/** A sentence of each device; one where they are the same. */
const sentences = (answers, textOf) =>
    byText(answers, textOf).map(([text, here], _, lists) => (lists.length > 1 ? `${text} (${devicesOf(here)})` : text));

const inTimeRows = (answers) =>
    (choice.time_ms === null ? [] :
                               pointRows(
                                   'Within time', answers, ({accurate}) => accurate,
                                   'the most accurate within the time budget', 'nothing is so fast'));

const missBlock = (answers) => make(
    'div', {class: 'answer no-answer'}, make('p', {class: 'sentence'}, 'Nothing meets the budget'),
    make('p', {class: 'muted'}, devicesOf(answers)),
    ...sentences(answers.filter(({nearest}) => nearest !== null), ({nearest, budgets}) => missText(nearest, budgets))
        .map((text) => make('p', {}, `Nearest: ${text}.`)),
    make(
        'dl', {}, ...pointRows('Nearest', answers, ({nearest}) => nearest), ...inTimeRows(answers),
        ...pointRows('Flat floor', answers, ({flat}) => flat)));

function moreOf(answers) {
  const isNew = (index, ...others) => (others.includes(index) ? null : index);
  return make(
      'details', {}, make('summary', {}, 'What else does, what just fails'),
      make(
          'dl', {}, ...pointRows('Tie', answers, ({tie}) => tie, 'as fast as far as the intervals tell'),
          ...pointRows('Runner-up', answers, (a) => isNew(a.runnerUp, a.tie), 'next best of other settings'),
          ...pointRows(
              'Simplest', answers, (a) => isNew(a.baseline, a.pick, a.tie, a.runnerUp),
              'the fastest of the simplest technique that does'),
          ...pointRows('Just fails', answers, ({justFails}) => justFails, 'faster, and misses the budget by least'),
          ...pointRows('Flat floor', answers, ({flat}) => flat, 'the same frame without relief')));
}

/** answers: of devices that pick one setting. isFirst: of its scene; the others are told in short. */
function answerBlock(answers, isFirst) {
  if (answers[0].pick === null) return missBlock(answers);
  const pickOf = ({pick}) => data.points[pick];
  const pick = pickOf(answers[0]);
  const where = (answer) => (answers.length > 1 ? ` of ${briefLabel(answer.group)}` : '');
  const buttons = make(
      'p', {class: 'card-buttons no-print'},
      make('button', {type: 'button', class: 'copy', onclick: show(answers)}, 'Pin and show'),
      ...answers.flatMap(
          (answer) =>
              commandsOf(pickOf(answer)).flatMap(([label, text]) => [' ', copyButton(text, label + where(answer))])));
  const errors = sentences(answers, (answer) => errorTexts(pickOf(answer)) + mapText(pickOf(answer)))
                     .map((text) => make('p', {class: 'errors'}, text));
  const more = moreOf(answers);
  if (!isFirst) more.append(...errors, buttons);
  const said = isFirst ? sentences(answers, sentenceOf) : [settingTitle(pick)];
  const inTime = inTimeRows(answers);
  return make(
      'div', {class: 'answer'}, ...said.map((text) => make('p', {class: 'sentence'}, text)), ...answers.map(priceRow),
      ...(isFirst ? errors : []), make('p', {}, settingElement(pick)), inTime.length ? make('dl', {}, ...inTime) : null,
      more, isFirst ? buttons : null);
}

const answerCard = (scene) => make(
    'article', {class: 'card'}, make('h3', {}, sceneName(scene)),
    ...answersIn(scene).map((answers, at) => answerBlock(answers, at === 0)));

function budgetSentence() {
  const texts = data.groups.map((_, group) => budgetsOf(group).map((b) => comparison(b.text)).join(' and '));
  const within = [...new Set(texts)].filter(Boolean).join('; or ');
  const filtered = isFiltered() ? ', of what the filters leave' : '';
  const kept = keptBudgets().join(' and ');
  return `The fastest setting${within ? ` with ${within}` : ''}${filtered}${
      kept ? ` (all that is shown keeps ${kept})` : ''}:`;
}

function drawAnswers() {
  const scenes = [...data.scenes.keys()];
  byId('budget').textContent = data.points.length ? budgetSentence() : '';
  refill(byId('answer-cards'), ...scenes.slice(0, kCardsShown).map(answerCard));
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

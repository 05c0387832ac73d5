// Fronts and picks, as tuner/decide makes them (pareto.h, recommend.h, choose.h), for budgets that move.
// tests/report_browser_test.cpp holds this to those.

import {changes, choice, kParamFilters} from './choice.js';
import {data} from './page.js';
import {comparison, metricIndex, paramOf, settingOf, techniqueIndex} from './points.js';

const searchTexts = [];
/** What a search looks through. */
function searchText(index) {
  const point = data.points[index];
  const {name, key} = settingOf(point);
  searchTexts[index] ??= `${point.id} ${name} ${key} ${data.groups[point.group].label}`.toLowerCase();
  return searchTexts[index];
}

/** Whether a point passes the filters by technique, parameter and text. */
export function isShown(index) {
  const point = data.points[index];
  if (choice.hidden.has(techniqueIndex(point))) return false;
  for (const name of kParamFilters)
    if (choice[name] && paramOf(point, name) !== choice[name]) return false;
  if (!choice.search) return true;
  return choice.search.toLowerCase().split(/\s+/).every((word) => searchText(index).includes(word));
}

export const isFiltered = () =>
    choice.hidden.size > 0 || choice.search !== '' || kParamFilters.some((name) => choice[name]);

/** Groups that have points in a scene. */
const groupsIn = data.scenes.map(
    (_, scene) => [...new Set(data.points.filter((p) => p.scene === scene).map((p) => p.group))].sort((a, b) => a - b));
export const groupsOf = (scene) => groupsIn[scene] || [];
/** Those of them that the reader looks at. */
export const chosenGroups = (scene) => {
  const groups = groupsOf(scene);
  return choice.group !== null && groups.includes(choice.group) ? [choice.group] : groups;
};

const byPlace = new Map();
data.points.forEach((point, index) => {
  const key = `${point.scene} ${point.group}`;
  if (!byPlace.has(key)) byPlace.set(key, []);
  byPlace.get(key).push(index);
});
/** All points of a device in a scene. */
export const pointsIn = (scene, group) => byPlace.get(`${scene} ${group}`) || [];

/** Lower is better, whatever the metric's direction. */
function badness(point, metric) {
  const {lower_is_better, none_is_best} = data.metrics[metric];
  const value = point.errors[metric];
  if (value === null) return none_is_best ? -Infinity : Infinity;
  return lower_is_better ? value : -value;
}

export function isWithin(point, {metric, limit}) {
  const index = metricIndex.get(metric);
  const sign = data.metrics[index].lower_is_better ? 1 : -1;
  return badness(point, index) <= sign * limit;
}

const runOfGroup = (group) => data.runs[data.groups[group].run];
export const constraintsOf = (group) => runOfGroup(group).constraints;

/** The limit that the run itself sets on a metric; null: none. */
export function ownLimit(group, metric) {
  const own = runOfGroup(group).budgets.find((budget) => budget.metric === data.metrics[metric].id);
  return own ? own.limit : null;
}
/** The limit that holds on the chosen metric; null: none. */
export const limitOf = (group) => (choice.error === undefined ? ownLimit(group, choice.metric) : choice.error);

/** Budgets of a search that all its points are within, as texts: its points have no value of those metrics. */
export const keptBudgets = () => (data.tune?.kept_budgets || []).map(comparison);

/** The run's budgets, with the reader's limit in the place of its own on the chosen metric. */
export function budgetsOf(group) {
  const {id, lower_is_better} = data.metrics[choice.metric];
  const others = runOfGroup(group).budgets.filter((budget) => choice.error === undefined || budget.metric !== id);
  if (choice.error === undefined || choice.error === null) return others;
  const text = `${id}${lower_is_better ? '<=' : '>='}${Number(choice.error.toPrecision(3))}`;
  return [{metric: id, limit: choice.error, text}, ...others];
}

/** Indices of the points that no other is both faster and better than, by rising time. */
export function frontOf(indices, metric, constraints) {
  const met = indices.filter((index) => constraints.every((budget) => isWithin(data.points[index], budget)));
  const key = met.map((index) => ({
                        index,
                        time: data.points[index].time_ns[0],
                        error: badness(data.points[index], metric),
                      }));
  key.sort((a, b) => a.time - b.time || a.error - b.error || a.index - b.index);
  const front = [];
  let least = Infinity;
  for (const {index, error} of key) {
    if (!(error < least)) continue;
    least = error;
    front.push(index);
  }
  return front;
}

const judgedTime = (index) => data.points[index].time_ns[2];
const compareTexts = (a, b) => (a < b ? -1 : a > b ? 1 : 0);
const compareNumbers = (a, b) => (a < b ? -1 : a > b ? 1 : 0);  // infinities have no difference

const byTime = (metric) => (a, b) => compareNumbers(judgedTime(a), judgedTime(b)) ||
    compareNumbers(badness(data.points[a], metric), badness(data.points[b], metric)) ||
    compareTexts(data.points[a].id, data.points[b].id);
const byError = (metric) => (a, b) =>
    compareNumbers(badness(data.points[a], metric), badness(data.points[b], metric)) || byTime(metric)(a, b);

/**
 * Of settings that all do: the least judged time leads; of all that can't be told from it, the simplest and smallest.
 */
function chooseAmong(indices) {
  const leader = indices.reduce((best, index) => (judgedTime(index) < judgedTime(best) ? index : best));
  const tied = indices.filter((index) => data.points[index].time_ns[1] <= judgedTime(leader));
  const rank = (index) => {
    const point = data.points[index];
    return [settingOf(point).features, point.memory_bytes, settingOf(point).technique, judgedTime(index)];
  };
  const isBefore = (a, b) => {
    const [left, right] = [rank(a), rank(b)];
    const at = left.findIndex((value, i) => value !== right[i]);
    return at >= 0 && left[at] < right[at];
  };
  const pick = tied.reduce((best, index) => (isBefore(index, best) ? index : best));
  const others = tied.filter((index) => index !== pick);
  const tie = others.length ? others.reduce((best, i) => (judgedTime(i) < judgedTime(best) ? i : best)) : null;
  return {pick, tie, ties: others.length};
}

/** Of a search only its answers are certified: the pick is one of them. */
function chooseOfSearch(meeting) {
  const {pick_point, answer_points} = data.tune;
  const isOwn = choice.error === undefined && pick_point !== null && meeting.includes(pick_point);
  const certified = meeting.filter((index) => answer_points.includes(index));
  if (certified.length === 0) return chooseAmong(meeting);
  const median = (index) => data.points[index].time_ns[0];
  const fastest = certified.reduce((best, index) => (median(index) < median(best) ? index : best));
  return {pick: isOwn ? pick_point : fastest, tie: null, ties: 0};
}

/** How far beyond the budgets a point is, relative to the worst missed limit. */
function worstMiss(point, budgets) {
  let worst = 0;
  for (const budget of budgets) {
    if (isWithin(point, budget)) continue;
    const value = point.errors[metricIndex.get(budget.metric)];
    const excess = value === null ? Infinity : Math.abs(value - budget.limit);
    worst = Math.max(worst, excess / (budget.limit === 0 ? 1 : Math.abs(budget.limit)));
  }
  return worst;
}
const leastBy = (indices, value) =>
    (indices.length ? indices.reduce((best, index) => (value(index) < value(best) ? index : best)) : null);

const sortedOf = new Map();
/** All points of a place by their judged time, error and id. */
function sortedIn(scene, group, metric) {
  const key = `${scene} ${group} ${metric}`;
  if (!sortedOf.has(key)) sortedOf.set(key, [...pointsIn(scene, group)].sort(byTime(metric)));
  return sortedOf.get(key);
}

let answersFound = new Map();
let foundAt = -1;
/** The answer of a device in a scene; indices of points, null where there is none. */
export function answerOf(scene, group) {
  if (foundAt !== changes.count) [answersFound, foundAt] = [new Map(), changes.count];
  const key = `${scene} ${group}`;
  if (!answersFound.has(key)) answersFound.set(key, findAnswer(scene, group));
  return answersFound.get(key);
}

function findAnswer(scene, group) {
  const {metric} = choice;
  const sorted = sortedIn(scene, group, metric);
  const all = isFiltered() ? sorted.filter(isShown) : sorted;
  const budgets = budgetsOf(group);
  const misses = new Map(all.map((index) => [index, worstMiss(data.points[index], budgets)]));
  const miss = (index) => misses.get(index);
  const meeting = all.filter((index) => miss(index) === 0);
  const flat = all.find((index) => data.techniques[techniqueIndex(data.points[index])].id === 'flat') ?? null;
  const answer = {
    scene,
    group,
    budgets,
    flat,
    pick: null,
    tie: null,
    ties: 0,
    runnerUp: null,
    baseline: null,
    rival: null,
    justFails: null,
    nearest: null,
    accurate: null
  };
  if (choice.time_ms !== null) {
    // With the limit of the other slider left out: it asks the other question.
    const others = budgets.filter((budget) => budget.metric !== data.metrics[metric].id);
    const inTime = all.filter(
        (index) => judgedTime(index) <= choice.time_ms * 1e6 &&
            others.every((budget) => isWithin(data.points[index], budget)));
    inTime.sort(byError(metric));
    const least = inTime.filter((i) => badness(data.points[i], metric) === badness(data.points[inTime[0]], metric));
    if (inTime.length) answer.accurate = chooseAmong(least).pick;
  }
  if (meeting.length === 0) return {...answer, nearest: leastBy(all, miss)};
  Object.assign(answer, data.tune ? chooseOfSearch(meeting) : chooseAmong(meeting));
  answer.runnerUp = meeting.find((index) => index !== answer.pick) ?? null;
  const cheaper = all.filter((index) => miss(index) > 0 && judgedTime(index) < judgedTime(answer.pick));
  answer.justFails = leastBy(cheaper, miss);
  // The technique that stands first in the registry, which goes from simple to involved, of those that do.
  const techniqueAt = (index) => techniqueIndex(data.points[index]);
  const simplest = meeting.reduce((least, index) => Math.min(least, techniqueAt(index)), Infinity);
  answer.rival = meeting.find((index) => techniqueAt(index) !== techniqueAt(answer.pick)) ?? null;
  answer.baseline = meeting.find((index) => techniqueAt(index) === simplest) ?? null;
  return answer;
}

export function missText(index, budgets) {
  return budgets.filter((budget) => !isWithin(data.points[index], budget))
      .map((budget) => {
        const value = data.points[index].errors[metricIndex.get(budget.metric)];
        return `${budget.metric} is ${value === null ? 'undefined' : Number(value.toPrecision(3))} where ${
            Number(budget.limit.toPrecision(3))} is asked`;
      })
      .join(', ');
}

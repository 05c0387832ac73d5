// Budgets, metric, scene, device and filters.

import {choice, choose, kParamFilters, whenChanged} from './choice.js';
import {budgetsOf, chosenGroups, groupsOf, isFiltered, keptBudgets, limitOf, ownLimit, pointsIn} from './decide.js';
import {refill} from './focus.js';
import {seriesSwatch, swatch} from './marks.js';
import {byId, data, make} from './page.js';
import {dashOf, isOpenMark, seriesOf, usedTechniques} from './plot.js';
import {briefLabel, comparison, metricTitle, paramOf, sceneName, shortLabel, techniqueName} from './points.js';

const kSteps = 400;  // of a slider, on a logarithmic scale where the values allow it

/** The values that a slider goes over: those that were measured anywhere, so that each step may move a pick. */
function rangeOf(values) {
  const positive = values.filter((value) => Number.isFinite(value) && value > 0);
  if (positive.length === 0) return null;
  let low = positive.reduce((a, b) => Math.min(a, b));
  const high = positive.reduce((a, b) => Math.max(a, b));
  if (low === high) low = high / 2;
  const toValue = (step) => Number((low * (high / low) ** (step / kSteps)).toPrecision(3));
  const toStep = (value) => Math.round((kSteps * Math.log(Math.max(low, value) / low)) / Math.log(high / low));
  return {toValue, toStep};
}

const errorRange = () => rangeOf(data.points.map((point) => point.errors[choice.metric]));
const timeRange = rangeOf(data.points.map((point) => point.time_ns[2] / 1e6));

/** A slider with a number beside it; both set the same. onValue(null): no limit. */
function limitControl({id, label, unit, range, value, isLeast, onValue}) {
  const slider = make('input', {
    type: 'range',
    id,
    min: 0,
    max: kSteps + 1,  // the last is no limit
    value: value === null ? kSteps + 1 : Math.min(kSteps, range.toStep(value)),
    'aria-valuetext': value === null ? 'no limit' : `${value} ${unit}`,
    oninput: (event) => {
      const step = Number(event.target.value);
      onValue(step > kSteps ? null : range.toValue(step));
    }
  });
  const number = make('input', {
    type: 'number',
    class: 'limit',
    step: 'any',
    min: 0,
    placeholder: 'any',
    value: value === null ? '' : Number(value.toPrecision(3)),
    'aria-label': `${label}, as a number`,
    // Later: leaving the field changes it, and the focus must be where it goes before all is drawn anew.
    onchange: ({target}) => setTimeout(() => onValue(target.value === '' ? null : Number(target.value)))
  });
  return make('div', {class: 'budget'}, make('label', {for: id
              }, label), slider, make('span', {class: 'budget-value'}, isLeast ? '≥ ' : '≤ ', number, ` ${unit}`));
}

function metricSelect() {
  return make(
      'label', {}, 'Error ',
      make(
          'select', {id: 'metric', onchange: (event) => choose({metric: Number(event.target.value), error: undefined})},
          ...data.metrics.map(
              (metric, index) => make(
                  'option', {value: index, selected: index === choice.metric ? '' : null, title: metric.description},
                  metricTitle(metric)))));
}

let held = null;  // the slider that is being moved: it stays, so that the pointer keeps it

function setHeld(box, name) {
  const slider = /** @type {HTMLInputElement} */ (box.querySelector('input[type=range]'));
  slider.addEventListener('pointerdown', () => (held = name));
  slider.addEventListener('pointerup', () => (held = null));
  return box;
}

function drawBudgets() {
  const metric = data.metrics[choice.metric];
  const group = chosenGroups(choice.scene)[0] ?? 0;
  const limit = data.groups.length ? limitOf(group) : null;
  const range = errorRange();
  const error = range === null ?
      make('div', {class: 'budget muted'}, 'no bound: nothing has this metric, or all is 0') :
      setHeld(
          limitControl({
            id: 'error-limit',
            label: metric.lower_is_better ? 'Error at most' : 'At least',
            unit: metric.unit,
            range,
            value: limit,
            isLeast: !metric.lower_is_better,
            onValue: (value) => choose({error: value})
          }),
          'error');
  const time = timeRange === null ? null :
                                    setHeld(
                                        limitControl({
                                          id: 'time-limit',
                                          label: 'Time at most',
                                          unit: 'ms',
                                          range: timeRange,
                                          value: choice.time_ms,
                                          isLeast: false,
                                          onValue: (value) => choose({time_ms: value})
                                        }),
                                        'time');
  const others = data.groups.length ?
      [
        ...budgetsOf(group).filter((budget) => budget.metric !== metric.id).map((b) => comparison(b.text)),
        ...keptBudgets()
      ] :
      [];
  const isMoved = choice.error !== undefined || choice.time_ms !== null;
  const own = data.groups.length ? ownLimit(group, choice.metric) : null;
  const reset = make(
      'button', {type: 'button', onclick: () => choose({error: undefined, time_ms: null}), hidden: isMoved ? null : ''},
      own === null ? 'No budget of mine' : 'The run\'s budgets');
  if (held === null) {
    refill(
        byId('budgets'),
        ...[metricSelect(), error, time,
            make('span', {class: 'muted'}, others.length ? `and ${others.join(', ')}` : ''), reset]
            .filter(Boolean));
    return;
  }
  const number = /** @type {HTMLInputElement} */ (byId(`${held}-limit`).parentElement.querySelector('.limit'));
  const value = held === 'error' ? choice.error : choice.time_ms;
  number.value = value === null || value === undefined ? '' : String(value);
}

const option = (value, text, chosen) => make('option', {value, selected: value === chosen ? '' : null}, text);

function choiceOf(label, name, values, chosen, take) {
  if (values.length < 2) return null;
  return make(
      'label', {}, `${label} `,
      make(
          'select', {name, onchange: (event) => take(event.target.value)}, option('', 'all', chosen),
          ...values.map(([value, text]) => option(String(value), text, chosen))));
}

function drawFilters() {
  const groups = groupsOf(choice.scene);
  const device = choiceOf(
      'Device', 'group', groups.map((group) => [group, shortLabel(group)]), String(choice.group ?? ''),
      (value) => choose({group: value === '' ? null : Number(value)}));
  const inScene = groups.flatMap((group) => pointsIn(choice.scene, group));
  const params = kParamFilters.map((name) => {
    const values = [...new Set(inScene.map((index) => paramOf(data.points[index], name)))].filter(Boolean).sort();
    return choiceOf(
        name[0].toUpperCase() + name.slice(1), name, values.map((value) => [value, value]), choice[name],
        (value) => choose({[name]: value}));
  });
  const search = make('label', {}, 'Search ', make('input', {
                        type: 'search',
                        id: 'search',
                        value: choice.search,
                        placeholder: 'cone rg8 16',
                        oninput: (event) => choose({search: event.target.value})
                      }));
  const all = {hidden: new Set(), search: '', ...Object.fromEntries(kParamFilters.map((name) => [name, '']))};
  const reset =
      make('button', {type: 'button', onclick: () => choose(all), hidden: isFiltered() ? null : ''}, 'All settings');
  // The search field keeps its caret.
  const focused = document.activeElement?.id === 'search';
  if (focused)
    byId('filters').querySelector('button').hidden = !isFiltered();
  else
    refill(byId('filters'), ...[device, ...params, search, reset].filter(Boolean));
}

function drawScenes() {
  byId('scenes').hidden = data.scenes.length < 2;
  refill(
      byId('scenes'),
      ...data.scenes.map(
          (_, scene) => make(
              'button', {
                type: 'button',
                'aria-pressed': String(scene === choice.scene),
                onclick: () => choose({scene, picture: null})
              },
              sceneName(scene))));
}

function drawTechniques() {
  const toggle = (technique) => {
    const hidden = new Set(choice.hidden);
    if (!hidden.delete(technique)) hidden.add(technique);
    choose({hidden});
  };
  refill(
      byId('technique-legend'),
      ...usedTechniques.map(
          (technique) => make(
              'button', {
                type: 'button',
                class: 'chip',
                'aria-pressed': String(!choice.hidden.has(technique)),
                title: data.techniques[technique].description,
                onclick: () => toggle(technique)
              },
              seriesSwatch(seriesOf(technique)), techniqueName(technique))));
}

function drawMarkLegend() {
  const ink = 'var(--ink)';
  const all = [...data.points].sort((a, b) => a.samples - b.samples).map((point) => point.coverage);
  const coverages = [...new Set([all[0], all[all.length - 1]])].join(' to ') || 'none';
  const constraints =
      [...new Set(data.runs.flatMap((run) => run.constraints.map((b) => comparison(b.text))))].join(', ');
  const entry = (mark, text) => make('span', {class: 'mark'}, mark, text);
  const line = (group) => swatch(
      'M0 8H32', {fill: 'none', stroke: ink, 'stroke-width': 1.5, 'stroke-dasharray': dashOf(group).join(' ')}, 32);
  const mark = (group) =>
      swatch('circle', isOpenMark(group) ? {fill: 'none', stroke: ink, 'stroke-width': 2.2} : {fill: ink});
  const groups = chosenGroups(choice.scene);
  const fronts = groups.length > 1 ?
      groups.map(
          (group) =>
              entry(make('span', {class: 'front-mark'}, line(group), mark(group)), `front, ${briefLabel(group)}`)) :
      [];
  const hollow = (radius, color) =>
      swatch(`M8 ${8 - radius}a${radius} ${radius} 0 1 0 .01 0z`, {fill: 'none', stroke: color, 'stroke-width': 1.8});
  byId('mark-legend')
      .replaceChildren(
          entry(
              swatch('M1 4H9V12H15', {fill: 'none', stroke: ink, 'stroke-width': 1.5}),
              groups.length > 1 ? `intervals of time (${coverages})` : `front, with intervals of time (${coverages})`),
          ...fronts, entry(swatch('circle', {fill: ink, opacity: 0.35}), 'dominated'),
          ...(constraints ? [entry(hollow(4, ink), `breaks ${constraints}`)] : []),
          entry(hollow(6, 'var(--accent)'), 'pick'), entry(hollow(6, ink), 'pinned'));
}

export function drawControls() {
  drawBudgets();
  drawScenes();
  drawFilters();
  drawTechniques();
  drawMarkLegend();
}

whenChanged(['metric', 'error', 'time_ms', 'scene', 'group'], drawBudgets);
whenChanged(['scene'], drawScenes);
whenChanged(['scene', 'group', 'search', 'hidden', ...kParamFilters], drawFilters);
whenChanged(['hidden'], drawTechniques);
whenChanged(['scene', 'group'], drawMarkLegend);

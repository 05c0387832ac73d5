// What a search found, beside the settings that it timed: the pick with its certificate, the ladder of features, every
// answer, and what is known of every setting.

import {byId, data, dataTable, make, numberCell} from './page.js';
import {nameElement} from './setting_name.js';
import {drawTuneCharts, fourDigits, gapText, tunedTime, withinText} from './tune_charts.js';

const isMarked = (setting) => data.tune.filter.marked.includes(setting);
function settingName(setting) {
  const {name, key} = data.tune.names[setting];
  return nameElement(name, key, {mark: isMarked(setting) ? '*' : ''});
}

function fillTable(id, heads, rows) {
  const cell = (value, column) => {
    if (heads[column] === 'setting') return settingName(value);
    return /^[\d.]+( (ms|%))?$/.test(value) ? numberCell(value) : value;
  };
  byId(id).append(dataTable(heads, rows.map((row) => row.map(cell))));
}

function showPick(tune) {
  const {certificate: c, pick} = tune;
  const none = tune.nearest ? `Nothing meets the budgets: ${tune.miss}` :
      c.stopped ? 'No pick yet: stopped too early.' :
                  'No pick.';
  const answer = pick ?
      [
        make('p', {}, settingName(pick.setting)),
        make(
            'p', {},
            `${tunedTime(pick.time_ns)}, at most ${tunedTime(pick.high_ns)}; ${tune.error_metric} ${
                fourDigits(pick.error)}; ` +
                withinText(pick))
      ] :
      [make('p', {class: 'open'}, none), tune.nearest ? make('p', {}, 'nearest: ', settingName(tune.nearest)) : null];
  byId('tune-pick')
      .append(
          ...answer.filter(Boolean), tune.filter.marked.length ? make('p', {class: 'notice'}, tune.filter.note) : '',
          make('p', {class: c.held ? 'certified' : 'open'}, `${c.claim[0].toUpperCase()}${c.claim.slice(1)}.`),
          make(
              'p', {class: 'muted'},
              `${c.measured} settings timed with ${c.samples} samples, those of a round correlated by at most ` +
                  `${fourDigits(c.correlation)}; slack of the monotone assumption ` +
                  `${gapText(c.slack)}, ${c.audits} audits, ${c.audit_failures} wrong.`));
}

function showRungs({rungs}) {
  fillTable('rungs', ['time', 'setting', 'more', 'less', 'buys'], rungs.map((rung, i) => {
    const before = rungs[i - 1];
    return [
      tunedTime(rung.time_ns), rung.setting, rung.gained.join(', '), rung.dropped.join(', '),
      before ? `${(100 * (1 - rung.time_ns / before.time_ns)).toFixed(1)} % less time` : ''
    ];
  }));
}

function showScenes(tune) {
  const place = byId('tune-scenes');
  for (const [title, list, text] of [
           [
             'Each scene by itself', tune.scene_answers,
             (s) => s.own ?
                 [
                   `${tunedTime(s.own_time_ns)} (the common pick takes ${tunedTime(s.common_time_ns)}): `,
                   settingName(s.own.setting)
                 ] :
                 'no answer'
           ],
           [
             'Held out', tune.holdout,
             (s) => s.failure || `${s.meets ? 'meets the budgets' : s.miss}, ${tunedTime(s.time_ns)}`
           ]]) {
    if (list.length === 0) continue;
    place.append(
        make('h3', {}, title), make('ul', {}, ...list.map((scene) => make('li', {}, `${scene.scene}: `, text(scene)))));
  }
}

function showStates(tune) {
  const {space} = tune;
  const count = (evidence) => tune.settings.filter((s) => s.evidence === evidence).length;
  const bisected = space.bisected ?
      `, by bisection: ${space.assumed} taken to be no faster than a scored one with fewer steps, ` +
          `${space.hopeless} miss the budgets as more steps do` :
      '';
  byId('tune-counts').textContent =
      `${space.settings} settings, ${space.conflicts} combinations refused by the registry. ${space.scored} scored` +
      `${bisected}; ${space.failed} failed, ${space.unscored} left when the time was up. Of the scored: ` +
      `${count('measured')} measured, ${count('assumed')} ruled out by assumption, ` +
      `${tune.settings.filter((s) => !s.feasible).length} miss the budgets.`;
  const rows = tune.settings.filter((s) => s.evidence === 'measured' || s.evidence === 'assumed')
                   .sort((a, b) => (a.time_ns || a.low_ns) - (b.time_ns || b.low_ns));
  fillTable(
      'tune-states', ['time', 'low', 'high', tune.error_metric, 'samples', 'evidence', 'setting'],
      rows.map(
          (s) =>
              [tunedTime(s.time_ns), tunedTime(s.low_ns), tunedTime(s.high_ns), fourDigits(s.error), String(s.samples),
               s.evidence, s.setting]));
}

export function drawTune() {
  const {tune} = data;
  byId('tune').hidden = false;
  byId('subtitle').textContent = `${tune.scenes.join(', ')}; ${tune.backend}, ${tune.device}` +
      (tune.replayed ? `; replayed from ${tune.replayed}` : '') +
      (tune.question.max_error.length ? `; asked: ${tune.question.max_error.join(', ')}` : '; asked: every budget');
  showPick(tune);
  showRungs(tune);
  showScenes(tune);
  fillTable(
      'tune-answers', [`${tune.error_metric} at most`, 'time', 'at most', 'within', 'setting'],
      tune.answers.map(
          (a) =>
              [fourDigits(a.error), tunedTime(a.time_ns), tunedTime(a.high_ns), withinText(a).replace(/^within /, ''),
               a.setting]));
  showStates(tune);
  drawTuneCharts(tune);
}

// The report's legends: of techniques, which they show and hide, and of marks.

import {budgetText} from './answers.js';
import {seriesSwatch, swatch} from './marks.js';
import {byId, data, make} from './page.js';
import {state} from './points.js';

/** Buttons that show and hide a technique in all charts. */
export function drawTechniqueLegend(onChange) {
  const used = [...new Set(data.points.map((point) => point.technique))].sort((a, b) => a - b);
  byId('technique-legend').replaceChildren(...used.map((technique) => {
    const {id, description} = data.techniques[technique];
    return make(
        'button', {
          type: 'button',
          class: 'chip',
          'aria-pressed': String(!state.hidden.has(technique)),
          title: description,
          onclick: (event) => {
            if (!state.hidden.delete(technique)) state.hidden.add(technique);
            event.currentTarget.setAttribute('aria-pressed', String(!state.hidden.has(technique)));
            onChange();
          },
        },
        seriesSwatch(technique), id);
  }));
}

/** "97.9 %", or "75 % to 97.9 %" where cases have different numbers of samples. */
function coverages() {
  const all = [...data.points].sort((a, b) => a.samples - b.samples).map((point) => point.coverage);
  return [...new Set([all[0], all[all.length - 1]])].join(' to ') || 'none';
}

export function drawMarkLegend() {
  const ink = 'var(--ink)';
  const constraints = [...new Set(data.runs.flatMap((run) => run.constraints.map(budgetText)))].join(', ');
  const entry = (mark, text) => make('span', {class: 'mark'}, mark, text);
  const line = 'M1 4H9V12H15';
  byId('mark-legend')
      .replaceChildren(
          entry(
              swatch(line, {fill: 'none', stroke: ink, 'stroke-width': 1.5}),
              `front, with intervals of time (${coverages()})`),
          entry(swatch('circle', {fill: ink, opacity: 0.35}), 'dominated'),
          entry(
              swatch('circle', {fill: 'none', stroke: ink, 'stroke-width': 1.5}),
              `breaks ${constraints || 'the constraint'}`),
          entry(
              swatch(
                  'M8 1a7 7 0 1 0 .01 0zM8 5a3 3 0 1 0 .01 0z',
                  {fill: ink, stroke: ink, 'fill-rule': 'evenodd', 'fill-opacity': 0.25}),
              'recommended'));
}

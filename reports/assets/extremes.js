// The stability suite: the matrix of techniques and extremes, its faults, the worst frame of each technique.

import {heatLegend} from './heat_legend.js';
import {byId, data, dataTable, formatNumber, make, numberCell, percent, shortNumber} from './page.js';
import {nameElement} from './setting_name.js';

/** What the matrix says of a technique at an extreme. */
function extremesCell(results) {
  const run = results.filter((r) => !r.skipped);
  const failing = results.filter((r) => r.holds === false).length;
  if (failing) return {text: `fails ${failing}`, className: 'fails'};
  if (run.length === 0) return {text: results.length ? 'left out' : '', className: 'left-out'};
  if (run.some((r) => r.guarantee !== 'none')) return {text: 'held', className: 'held'};
  const missed = Math.max(...run.map((r) => r.missed_rate));
  return {text: missed > 0 ? percent(missed) : 'ok', className: null};
}

function resultRow(r) {
  const faults = r.skipped || Object.entries(r.faults).map(([check, px]) => `${check}: ${px} px`).join(', ');
  const figures = r.skipped ? ['', '', '', '', ''] : [
    percent(r.missed_rate), percent(r.unconverged_rate), r.capped, formatNumber(r.e_xy_p99), formatNumber(r.e_xy_max)
  ];
  const settings =
      r.name ? nameElement(r.name, r.key) : make('span', {class: 'settings'}, r.settings.replaceAll('&', ' '));
  return [r.map, r.format, r.backend, ...figures.map(numberCell), faults, settings];
}

const resultTable = (results) => dataTable(
    ['map', 'format', 'backend', 'missed', 'unconverged', 'capped', 'e_xy p99', 'e_xy max', 'faults', 'settings'],
    results.map(resultRow));

function extremesMatrix({techniques, extremes, results}) {
  const cell = (technique, extreme) => {
    const here = results.filter((r) => r.technique === technique && r.extreme === extreme.id);
    const {text, className} = extremesCell(here);
    const show = () =>
        byId('extremes-cell')
            .replaceChildren(make('h4', {}, `${technique} at ${extreme.id}: ${extreme.about}`), resultTable(here));
    return make('td', {class: className}, text ? make('button', {type: 'button', onclick: show}, text) : null);
  };
  return [
    make('tr', {}, make('td'), ...techniques.map((technique) => make('th', {scope: 'col'}, technique))),
    ...extremes.map(
        (extreme) => make(
            'tr', {}, make('th', {scope: 'row', title: extreme.about}, extreme.id),
            ...techniques.map((technique) => cell(technique, extreme))))
  ];
}

function worstFigure(r, picture) {
  const image = picture ? make('img', {src: picture, alt: `error map of ${r.technique} at ${r.extreme}`}) :
                          make('p', {class: 'missing'}, 'no picture in the folder');
  return make(
      'figure', {}, image,
      make(
          'figcaption', {},
          `${r.technique} at ${r.extreme}, ${r.map} ${r.format}, ${r.backend}: p99 ${formatNumber(r.e_xy_p99)} ` +
              `texels, missed ${percent(r.missed_rate)}, ${r.capped} of ${r.pixels} px at the cap`));
}

/** stress: stress.json with its pictures by technique. */
export function drawExtremes(stress) {
  const frames = stress.results.filter((r) => !r.skipped).length;
  const failing = stress.results.filter((r) => r.holds === false);
  const verdict = failing.length ? 'Something fails' : stress.undone ? 'What was drawn holds' : 'Everything holds';
  const undone = stress.undone ? ` Interrupted: ${stress.undone} settings at extremes were not drawn.` : '';
  byId('extremes-summary').textContent = `${verdict}: ${frames} pairs of frames in ` +
      `${shortNumber(stress.wall_s)} s on ${stress.devices.join('; ')}.${undone}`;
  byId('extremes-matrix').append(...extremesMatrix(stress));
  byId('extremes-faults').append(failing.length ? resultTable(failing) : make('p', {}, 'None: every check holds.'));
  byId('extremes-legend').append(heatLegend(data.heat_map, 'e_xy of a pixel (texels, same scale in every picture)'));
  byId('extremes-worst').append(...stress.worst.map((r) => worstFigure(r, stress.pictures[r.technique])));
  for (const element of document.querySelectorAll('#extremes, a[href="#extremes"]')) element.removeAttribute('hidden');
}

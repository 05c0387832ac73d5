// Draws the page, and redraws what depends on what is chosen, the colour scheme or the printer.

import {startAnswers} from './answers.js';
import {drawControls} from './controls.js';
import {drawEffects} from './effects.js';
import {drawEnvironment} from './environment.js';
import {drawExtremes} from './extremes.js';
import {drawFleet} from './fleet.js';
import {drawHeader, drawMissing} from './header.js';
import {byId, data} from './page.js';
import {drawPins} from './pins.js';
import {drawPlot, plotted, startPlot} from './plot.js';
import {whenColorsChange} from './redraw.js';
import {startStage} from './stage.js';
import {drawStrip} from './strip.js';
import {startTable} from './table.js';
import {drawTuneCharts} from './tune_charts.js';
import {drawTune} from './tune_part.js';

Chart.defaults.font.family = 'system-ui, sans-serif';
drawHeader();
drawMissing();

/** What is told of settings; a page of `stress` alone has none. */
function drawSettings() {
  startAnswers();
  drawControls();
  startPlot();
  drawPins();
  startTable();
  drawEffects();
  drawFleet();
}

/** Hides sections, and the links to them. */
function hideSections(ids) {
  for (const id of ids)
    for (const element of document.querySelectorAll(`#${id}, a[href="#${id}"]`)) element.setAttribute('hidden', '');
}

const hasRuns = data.runs.length > 0;
const hasPoints = data.points.length > 0;
if (hasPoints)
  drawSettings();
else
  hideSections(['budgets', 'charts', 'pictures', 'effects', 'fleet', ...hasRuns ? [] : ['answers', 'where']]);
if (data.tune) {
  drawTune();
  document.querySelector('a[href="#tune"]').removeAttribute('hidden');
  if (!hasRuns) byId('title').textContent = 'What to ship';
}
if (!hasRuns && data.stress) byId('title').textContent = 'reliefbench stress';

/** Folds of what is long are filled when they are opened. */
function whenOpened(id, draw) {
  const details = /** @type {HTMLDetailsElement} */ (byId(id));
  details.addEventListener('toggle', () => draw(), {once: true});
}
whenOpened('environment', drawEnvironment);
if (hasRuns && !hasPoints) {
  const environment = /** @type {HTMLDetailsElement} */ (byId('environment'));
  environment.open = true;  // that holds why
}
if (data.stress) drawExtremes(data.stress);

// Pictures stand after this script.
document.addEventListener('DOMContentLoaded', () => {
  if (hasPoints) {
    drawStrip();
    startStage();
    drawPins();
  }
  document.body.dataset.points = String(data.points.length);
  document.body.dataset.rendered = 'true';
});

/** The links to sections go there, and leave the fragment to what is chosen. */
for (const link of document.querySelectorAll('nav a')) {
  const section = byId(link.getAttribute('href').slice(1));
  link.addEventListener('click', (event) => {
    event.preventDefault();
    section.scrollIntoView();
    section.tabIndex = -1;  // the keyboard goes on from there
    section.focus({preventScroll: true});
  });
}

whenColorsChange(() => {
  if (hasPoints) drawPlot();
  if (data.tune) drawTuneCharts(data.tune);
  plotted.chart?.resize();
});

// The trend page: shows the view that the URL's fragment names.

import {byId, data} from './page.js';
import {whenColorsChange} from './redraw.js';
import {drawCharts} from './trend_chart.js';
import {formatMoment} from './trend_data.js';
import {drawEvent} from './trend_event.js';
import {drawHealth} from './trend_health.js';
import {drawLog} from './trend_log.js';
import {drawOverview} from './trend_overview.js';
import {drawBrowser, makeFilters} from './trend_series.js';
import {markCurrent, readState, state} from './trend_state.js';

const kViews = {
  overview: once(drawOverview),
  event: drawEvent,
  series: drawBrowser,
  machines: once(drawHealth),
  log: once(drawLog),
};

function once(draw) {
  let done = false;
  return () => {
    if (!done) draw();
    done = true;
  };
}

function showView() {
  const view = kViews[state.view] ? state.view : 'overview';
  for (const name of Object.keys(kViews)) byId(name).hidden = name !== view;
  const viewOf = (link) => new URLSearchParams(link.hash.slice(1)).get('view') || 'overview';
  markCurrent(document.querySelectorAll('nav a'), (link) => viewOf(link) === view);
  kViews[view]();
}

function onNavigation() {
  const isOther = readState();
  showView();
  if (!isOther) return;
  window.scrollTo(0, 0);
  /** @type {HTMLElement} */ (document.querySelector('section:not([hidden]) [tabindex="-1"]'))?.focus({
    preventScroll: true
  });
}

byId('subtitle').textContent = `${data.title}; checked ${formatMoment(data.made)} UTC`;
Chart.defaults.font.family = 'system-ui, sans-serif';
makeFilters();
readState();
showView();
window.addEventListener('hashchange', onNavigation);

whenColorsChange(() => drawCharts());
document.body.dataset.rendered = 'true';

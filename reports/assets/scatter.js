// Scatter charts in the page's colours, and moving over their dots with the keyboard.

/** Of tooltips: dark in both colour schemes. */
export const tooltipLook = {
  displayColors: false,
  backgroundColor: 'rgb(24 28 34 / 0.95)',
  titleColor: '#fff',
  bodyColor: '#fff',
};

export const linearAxis = (theme, title, callback) => ({
  type: 'linear',
  title: {display: true, text: title, color: theme.muted},
  grid: {color: theme.grid, drawBorder: false},
  ticks: {color: theme.muted, callback, maxTicksLimit: 7, maxRotation: 0, includeBounds: false},
});

/** plugins: those of the chart alone; the rest are Chart.js's own options. */
export function scatterChart(canvas, datasets, {x, y, legend, tooltip, layout = {}, plugins = []}) {
  return new Chart(canvas, {
    type: 'scatter',
    data: {datasets},
    options: {animation: false, maintainAspectRatio: false, layout, scales: {x, y}, plugins: {legend, tooltip}},
    plugins,
  });
}

/** Moves the active dot of a chart's first data set, by x. */
export function moveActive(chart, step) {
  const dots = chart.data.datasets[0].data;
  if (dots.length === 0) return;
  const byX = dots.map((_, index) => index).sort((a, b) => dots[a].x - dots[b].x || dots[b].y - dots[a].y);
  const active = chart.getActiveElements()[0];
  const at = active ? byX.indexOf(active.index) + step : step > 0 ? 0 : byX.length - 1;
  const index = byX[Math.max(0, Math.min(byX.length - 1, at))];
  const hit = [{datasetIndex: 0, index}];
  chart.setActiveElements(hit);
  chart.tooltip.setActiveElements(hit, {x: 0, y: 0});
  chart.update();
}

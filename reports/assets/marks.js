'use strict';
// Colours and shapes of the marks, and their legends. A series is told by both, so that neither colour vision nor a
// colour printer is needed.

const kShapes = ['circle', 'triangle', 'rect', 'rectRot', 'rectRounded'];
const kColors = 8;  // --series-0 to --series-7 of page.css
const shapeOf = (series) => kShapes[series % kShapes.length];

const cssValue = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
function readTheme() {
  const series = Array.from({length: kColors}, (_, i) => cssValue(`--series-${i}`));
  return {
    series,
    ink: cssValue('--ink'),
    muted: cssValue('--muted'),
    grid: cssValue('--grid'),
    band: cssValue('--band'),
    paper: cssValue('--paper')
  };
}
const seriesColor = (theme, series) => theme.series[series % kColors];
const withAlpha = (hex, alpha) => hex + Math.round(alpha * 255).toString(16).padStart(2, '0');

const kSvg = 'http://www.w3.org/2000/svg';
const kShapePaths = {
  circle: 'M8 3a5 5 0 1 0 .01 0z',
  triangle: 'M8 2.5 13.5 12.5 2.5 12.5z',
  rect: 'M3.5 3.5h9v9h-9z',
  rectRot: 'M8 2 14 8 8 14 2 8z',
  rectRounded: 'M5.5 3.5h5a2 2 0 0 1 2 2v5a2 2 0 0 1-2 2h-5a2 2 0 0 1-2-2v-5a2 2 0 0 1 2-2z',
};

/** style: fill, stroke, opacity (SVG attributes) */
function swatch(shape, style) {
  const svg = document.createElementNS(kSvg, 'svg');
  svg.setAttribute('viewBox', '0 0 16 16');
  svg.setAttribute('aria-hidden', 'true');
  const path = document.createElementNS(kSvg, 'path');
  path.setAttribute('d', kShapePaths[shape] || shape);
  for (const [name, value] of Object.entries(style)) path.setAttribute(name, value);
  svg.append(path);
  return svg;
}

const seriesSwatch = (series) => swatch(shapeOf(series), {fill: `var(--series-${series % kColors})`});

/** Buttons that show and hide a technique in all charts. */
function drawTechniqueLegend(onChange) {
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

function drawMarkLegend() {
  const ink = 'var(--ink)';
  const constraints = [...new Set(data.runs.flatMap((run) => run.constraints.map(budgetText)))].join(', ');
  const entry = (mark, text) => make('span', {class: 'mark'}, mark, text);
  const line = 'M1 4H9V12H15';
  byId('mark-legend')
      .replaceChildren(
          entry(swatch(line, {fill: 'none', stroke: ink, 'stroke-width': 1.5}), `front, with intervals of time (${coverages()})`),
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

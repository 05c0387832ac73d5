// Colours and shapes of the marks. A series is told by both, so that neither colour vision nor a
// colour printer is needed. Seven shapes and eight colours have no common factor: 56 series are told apart.

const kShapes = ['circle', 'triangle', 'rect', 'rectRot', 'star', 'crossRot', 'rectRounded'];
export const kColors = 8;  // --series-0 to --series-7 of page.css
export const shapeOf = (series) => kShapes[series % kShapes.length];

const cssValue = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
export function readTheme() {
  const series = Array.from({length: kColors}, (_, i) => cssValue(`--series-${i}`));
  return {
    series,
    ink: cssValue('--ink'),
    muted: cssValue('--muted'),
    grid: cssValue('--grid'),
    band: cssValue('--band'),
    paper: cssValue('--paper'),
    accent: cssValue('--accent')
  };
}
export const seriesColor = (theme, series) => theme.series[series % kColors];
export const withAlpha = (hex, alpha) => hex + Math.round(alpha * 255).toString(16).padStart(2, '0');

/** On a canvas. dash: lengths of dashes and gaps, px */
export function drawLine(ctx, x0, y0, x1, y1, color, width, dash = []) {
  ctx.strokeStyle = color;
  ctx.lineWidth = width;
  ctx.setLineDash(dash);
  ctx.beginPath();
  ctx.moveTo(x0, y0);
  ctx.lineTo(x1, y1);
  ctx.stroke();
  ctx.setLineDash([]);
}

const kSvg = 'http://www.w3.org/2000/svg';
const kShapePaths = {
  circle: 'M8 3a5 5 0 1 0 .01 0z',
  triangle: 'M8 2.5 13.5 12.5 2.5 12.5z',
  rect: 'M3.5 3.5h9v9h-9z',
  rectRot: 'M8 2 14 8 8 14 2 8z',
  rectRounded: 'M5.5 3.5h5a2 2 0 0 1 2 2v5a2 2 0 0 1-2 2h-5a2 2 0 0 1-2-2v-5a2 2 0 0 1 2-2z',
  star: 'M7 2h2v12h-2zM2 7h12v2h-12zM3.1 4.5 4.5 3.1 12.9 11.5 11.5 12.9zM11.5 3.1 12.9 4.5 4.5 12.9 3.1 11.5z',
  crossRot: 'M2.6 4 4 2.6 13.4 12 12 13.4zM12 2.6 13.4 4 4 13.4 2.6 12z',
};

/** An element of SVG, as make() makes one of HTML. */
export function drawn(tag, attributes, ...children) {
  const element = document.createElementNS(kSvg, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** style: fill, stroke, opacity (SVG attributes). width: of what is wider than high, in sixteenths of its height */
export function swatch(shape, style, width = 16) {
  return drawn(
      'svg', {viewBox: `0 0 ${width} 16`, 'aria-hidden': 'true'},
      drawn('path', {d: kShapePaths[shape] || shape, ...style}));
}

export const seriesSwatch = (series) => swatch(shapeOf(series), {fill: `var(--series-${series % kColors})`});

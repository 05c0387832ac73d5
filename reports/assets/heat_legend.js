import {make} from './page.js';

const rgb = ([r, g, b]) => `rgb(${r} ${g} ${b})`;

/** What the colours of an error or taps map mean. */
export function heatLegend({stops, marks}, title) {
  const ramp = make('div', {class: 'ramp'});
  ramp.style.background = `linear-gradient(to right, ${stops.map((stop) => rgb(stop.color)).join(', ')})`;
  const label = (value) => (value < 1 ? `1/${Math.round(1 / value)}` : String(value));
  const labels = stops.filter((_, index) => index % 2 === 0).map((stop) => make('span', {}, label(stop.value)));
  const entries = marks.map((mark) => {
    const box = make('span', {class: 'color-box'});
    box.style.background = rgb(mark.color);
    return make('span', {class: 'mark'}, box, mark.description);
  });
  return make(
      'div', {class: 'heat-legend'},
      make('div', {class: 'ramp-box'}, make('div', {}, title), ramp, make('div', {class: 'ramp-labels'}, ...labels)),
      make('div', {class: 'legend'}, ...entries));
}

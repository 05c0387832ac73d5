import {make} from './page.js';

const rgb = ([r, g, b]) => `rgb(${r} ${g} ${b})`;

/** What the colours of an error map mean. */
export function heatLegend({stops, marks}) {
  const ramp = make('div', {class: 'ramp'});
  ramp.style.background = `linear-gradient(to right, ${stops.map((stop) => rgb(stop.color)).join(', ')})`;
  const label = (e_xy) => (e_xy < 1 ? `1/${Math.round(1 / e_xy)}` : String(e_xy));
  const labels = stops.filter((_, index) => index % 2 === 0).map((stop) => make('span', {}, label(stop.e_xy)));
  const entries = marks.map((mark) => {
    const box = make('span', {class: 'color-box'});
    box.style.background = rgb(mark.color);
    return make('span', {class: 'mark'}, box, mark.description);
  });
  return make(
      'div', {class: 'heat-legend'},
      make(
          'div', {class: 'ramp-box'}, make('div', {}, 'e_xy of a pixel (texels, same scale in every picture)'), ramp,
          make('div', {class: 'ramp-labels'}, ...labels)),
      make('div', {class: 'legend'}, ...entries));
}

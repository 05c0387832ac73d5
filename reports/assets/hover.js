// What stands beside a dot that is pointed at: a picture of the setting, what it is, what it costs.

import {choice} from './choice.js';
import {constraintsOf, isWithin} from './decide.js';
import {pictureOf} from './images.js';
import {byId, data, formatInterval, formatTime, make} from './page.js';
import {columnMetrics, comparison, errorOf, settingElement, shortLabel} from './points.js';

const kEdge = 8;  // px, to the plot's edges

/** x, y: place in the chart, px */
export function showHover(index, x, y, chart) {
  const box = byId('hover');
  const point = data.points[index];
  const uri = pictureOf(point, 'frame');
  const metrics = [choice.metric, ...columnMetrics.filter((metric) => metric !== choice.metric)];
  const breaks = constraintsOf(point.group).filter((budget) => !isWithin(point, budget));
  box.replaceChildren(
      ...[uri ? make('img', {src: uri, alt: '', width: 132, height: 132}) : null,
          make(
              'div', {}, make('p', {}, settingElement(point)), make('p', {class: 'muted'}, shortLabel(point.group)),
              make(
                  'p', {}, make('strong', {}, formatTime(point.time_ns[0])),
                  make('span', {class: 'muted'}, ` ${formatInterval(point.time_ns)}, ${point.coverage}`)),
              ...metrics.map((metric) => make('p', {}, `${data.metrics[metric].id} ${errorOf(point, metric)}`)),
              ...breaks.map((budget) => make('p', {class: 'open'}, `breaks ${comparison(budget.text)}`)))]
          .filter(Boolean));
  box.hidden = false;
  const {width, height} = chart;
  const left = x + 16 + box.offsetWidth > width ? x - 16 - box.offsetWidth : x + 16;
  const top = Math.min(y - 20, height - box.offsetHeight - kEdge);
  box.style.left = `${Math.max(0, Math.min(width - box.offsetWidth, left))}px`;
  box.style.top = `${Math.max(kEdge, top)}px`;
  byId('hover-said').textContent = box.textContent;
}

export const hideHover = () => (byId('hover').hidden = true);

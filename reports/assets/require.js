// What a scene requires: the answer, each feature without and with it beside the reference, all sets.

import {byId, data, dataTable, factsTable, formatInterval, formatNumber, formatTime, make, numberCell} from './page.js';
import {whenColorsChange} from './redraw.js';
import {nameElement} from './setting_name.js';

const metric = data.visible.split(/[<>]/)[0].trim();
const listed = (words) => (words.length ? words.join(', ') : 'plain normal mapping alone');
const signed = (ns) => (ns < 0 ? '\u2212' : '+') + formatTime(Math.abs(ns));

function answerText() {
  const {features, value, worst_view: view} = data.answer;
  const seen = `${metric} ${formatNumber(value)} in ${view}, the worst view; ${data.visible} is not seen`;
  return data.is_met ? `Required: ${listed(features)}. Nobody would miss the rest (${seen}).` :
                       `No set of features is drawn unseen; the nearest is ${listed(features)} (${seen}).`;
}

function priceText(price) {
  if (!price) return 'throttled';
  const {median, ci_low: low, ci_high: high} = price;
  return `${signed(median)} [${signed(low)}, ${signed(high)}]`;
}

function frameText({frame_time_ns: time}) {
  if (!time) return `throttled: ${data.held_back.times}`;
  const {median, ci_low: low, ci_high: high} = time;
  return `${formatTime(median)} (${formatInterval([median, low, high])}), the mean over ${data.views.length} views`;
}

const settingName = ({name, key}) => nameElement(name, key);

const featureRow = (feature) =>
    [feature.feature, feature.choice, feature.is_needed ? 'yes' : 'no', numberCell(formatNumber(feature.without.value)),
     numberCell(formatNumber(feature.with.value)), numberCell(priceText(feature.price_ns))];

function pictureFigures({feature, choice, without, with: set, pictures}) {
  if (!pictures?.without) return [];
  const figure = (kind, words) =>
      make('figure', {}, make('img', {src: pictures[kind], alt: `${feature}: ${kind}`}), make('figcaption', {}, words));
  return [
    make('h3', {}, `${feature} (${choice}), ${without.worst_view}`),
    make(
        'div', {class: 'pictures'}, figure('without', `without: ${listed(without.features)}`),
        figure('with', `with: ${listed(set.features)}`), figure('reference', 'the full reference'))
  ];
}

byId('title').textContent = `What ${data.scene} requires`;
byId('subtitle').textContent = data.about;
byId('answer').textContent = answerText();
byId('setting').append(factsTable([
  ['setting', settingName(data.answer)],
  ['frame', frameText(data.answer)],
  ...(data.held_back?.ties ? [['ties', `which is the fastest is not known, throttled: ${data.held_back.ties}`]] : []),
  ...(data.failed ?? [])
      .map((failed) => ['can\'t be drawn', make('span', {}, settingName(failed), `: ${failed.reason}`)]),
  ['device', `${data.device.backend}, ${data.device.name}${data.device.software ? ', a software rasteriser' : ''}`],
]));
byId('features')
    .append(dataTable(
        ['feature', 'by', 'required', `${metric} without`, `${metric} with`, 'price'], data.features.map(featureRow)));
byId('pictures').append(...data.features.flatMap(pictureFigures));
byId('sets').append(dataTable(
    ['features', metric, 'worst view'],
    data.sets.map((set) => [listed(set.features), numberCell(formatNumber(set.value)), set.worst_view])));
whenColorsChange(() => {});  // printed, it has the colours of paper
document.body.dataset.rendered = 'true';

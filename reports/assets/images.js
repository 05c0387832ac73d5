// The pictures of the settings. They stand after the page's scripts, so that nothing waits for them.

import {data} from './page.js';

let uris = null;
const uriOf = (index) => {
  const element = document.getElementById('images');
  uris ??= element && JSON.parse(element.textContent);
  return uris?.[index] || null;
};

const byPlaceAndSetting = new Map();
for (const point of data.points)
  if (point.pictures) byPlaceAndSetting.set(`${point.scene} ${point.setting}`, point);

/** The point whose pictures show a setting in its scene: those of the first device that has them; or null. */
const picturedPoint = (point) => byPlaceAndSetting.get(`${point.scene} ${point.setting}`) ?? null;
export const hasPictures = (point) => picturedPoint(point) !== null;

/** kind: frame, reference, error or taps. A data URI, or null. */
export function pictureOf(point, kind) {
  const index = picturedPoint(point)?.pictures[kind];
  return index === null || index === undefined ? null : uriOf(index);
}

const decoded = new Map();

/** The pixels of a picture, once it is decoded. */
function pixelsOf(uri) {
  if (!decoded.has(uri)) {
    const image = new Image();
    const entry = {pixels: null};
    decoded.set(uri, entry);
    image.onload = () => {
      const canvas = document.createElement('canvas');
      [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
      const context = canvas.getContext('2d', {willReadFrequently: true});
      context.drawImage(image, 0, 0);
      entry.pixels = context.getImageData(0, 0, canvas.width, canvas.height);
    };
    image.src = uri;
  }
  return decoded.get(uri).pixels;
}

/** {r, g, b, x, y, width, height} of a picture at a place from 0 to 1; null until it is decoded. */
export function colorAt(uri, u, v) {
  const pixels = uri && pixelsOf(uri);
  if (!pixels) return null;
  const x = Math.min(pixels.width - 1, Math.max(0, Math.floor(u * pixels.width)));
  const y = Math.min(pixels.height - 1, Math.max(0, Math.floor(v * pixels.height)));
  const [r, g, b] = pixels.data.slice(4 * (y * pixels.width + x));
  return {r, g, b, x, y, width: pixels.width, height: pixels.height};
}

/** What a colour of an error or taps map says: a mark's text, or the value of the nearest colour of its ramp. */
export function valueOfColor({stops, marks}, {r, g, b}) {
  const distance = (color) => Math.abs(color[0] - r) + Math.abs(color[1] - g) + Math.abs(color[2] - b);
  const mark = marks.find(({color}) => distance(color) === 0);
  if (mark) return {mark: mark.description};
  let best = {distance: Infinity, value: 0};
  for (let i = 1; i < stops.length; ++i) {
    for (let part = 0; part <= 16; ++part) {
      const t = part / 16;
      const color = stops[i].color.map((end, c) => stops[i - 1].color[c] * (1 - t) + end * t);
      const found = {distance: distance(color), value: stops[i - 1].value * (stops[i].value / stops[i - 1].value) ** t};
      if (found.distance < best.distance) best = found;
    }
  }
  const isEnd = best.value <= stops[0].value      ? 'at most ' :
      best.value >= stops[stops.length - 1].value ? 'at least ' :
                                                    '';
  return {value: best.value, isEnd};
}

// Zoom that is linked between all pictures on the stage: the wheel and + and - zoom, dragging pans, 0 resets.

const kMost = 32;
export const zoom = {
  scale: 1,
  x: 0,
  y: 0
};  // x, y: what part of the picture stands at the left and top, 0 to 1

function clampView() {
  zoom.scale = Math.max(1, Math.min(kMost, zoom.scale));
  const most = 1 - 1 / zoom.scale;
  zoom.x = Math.max(0, Math.min(most, zoom.x));
  zoom.y = Math.max(0, Math.min(most, zoom.y));
}

/** Gives all pictures of the stage their place. */
export function applyZoom(stage) {
  for (const image of stage.querySelectorAll('.pane img')) {
    image.style.transform = `scale(${zoom.scale}) translate(${- 100 * zoom.x}%, ${- 100 * zoom.y}%)`;
    image.classList.toggle('pixels', zoom.scale > 2);
  }
  stage.dataset.zoom = zoom.scale.toFixed(2);
}

/** u, v: the place on the pane that stays where it is, 0 to 1 */
export function zoomBy(stage, factor, u = 0.5, v = 0.5) {
  const before = zoom.scale;
  zoom.scale = Math.max(1, Math.min(kMost, zoom.scale * factor));
  zoom.x += u / before - u / zoom.scale;
  zoom.y += v / before - v / zoom.scale;
  clampView();
  applyZoom(stage);
}

export function panBy(stage, u, v) {
  zoom.x -= u / zoom.scale;
  zoom.y -= v / zoom.scale;
  clampView();
  applyZoom(stage);
}

export function resetZoom(stage) {
  Object.assign(zoom, {scale: 1, x: 0, y: 0});
  applyZoom(stage);
}

/** The place in the picture under a place on the screen, 0 to 1; null: outside. */
export function pictureAt(pane, clientX, clientY) {
  const box = pane.getBoundingClientRect();
  const [u, v] = [(clientX - box.left) / box.width, (clientY - box.top) / box.height];
  if (!(u >= 0 && u < 1 && v >= 0 && v < 1)) return null;
  return {u: zoom.x + u / zoom.scale, v: zoom.y + v / zoom.scale, paneU: u, paneV: v};
}

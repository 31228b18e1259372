// The visible region of the photo: screen = photo · scale + [x, y].

import { by } from "./elements.js";
import { clamp } from "./geometry.js";
import { changed, state } from "./store.js";

const MIN_SCALE = 0.05;
const MAX_SCALE = 40;
/** Margin around a photo that is shown whole, so that marks at its border can be grabbed. */
const MARGIN_PX = 24;
/** From this scale on, pixels are shown as squares. */
const CRISP_FROM = 4;

const stage = by("stage");
const photo = by("photo");

/** Width and height of what is shown. */
let shown = [1, 1];

export const toScreen = ([x, y]) => [x * state.view.scale + state.view.x, y * state.view.scale + state.view.y];
export const toPhoto = ([x, y]) => [(x - state.view.x) / state.view.scale, (y - state.view.y) / state.view.scale];

/** The middle of the view, in photo coordinates. */
export function middle() {
  const [x, y] = toPhoto([stage.clientWidth / 2, stage.clientHeight / 2]);
  return [clamp(x, 0, shown[0]), clamp(y, 0, shown[1])];
}

/** Shows another picture, whole. */
export function show(url, size, alt) {
  shown = size;
  replacePicture(url);
  photo.alt = alt;
  [photo.width, photo.height] = size;
  fit();
}

/** Shows the next picture of the same size and keeps the view. The picture before is hidden until then, because the marks are not its own; live pictures, from the memory, are decoded already. */
export function replacePicture(url) {
  if (photo.getAttribute("src") === url) return;
  if (!url.startsWith("blob")) photo.style.visibility = "hidden";
  photo.src = url;
}
for (const kind of ["load", "error"]) photo.addEventListener(kind, () => (photo.style.visibility = ""));

/** The scale at which the whole photo is shown. */
function wholeScale() {
  const { clientWidth, clientHeight } = stage;
  const room = Math.min(MARGIN_PX, clientWidth / 20);
  return Math.min((clientWidth - 2 * room) / shown[0], (clientHeight - 2 * room) / shown[1]);
}

export function fit() {
  const { clientWidth, clientHeight } = stage;
  const scale = wholeScale();
  const [x, y] = [(clientWidth - shown[0] * scale) / 2, (clientHeight - shown[1] * scale) / 2];
  // A hidden stage has no size: the photo is fitted as soon as the stage has one.
  state.view = scale > 0 ? { scale, x, y, fitted: true } : { ...state.view, fitted: true };
  changed();
}

/** Shows a box of the photo so that it fills half of the view, or 80 % of it if the box fills much of the photo. The scale is at least `least`, unless the box would then fill more than 80 % of the view. */
export function showBox(box, least = state.view.scale) {
  const [x1, y1, x2, y2] = box;
  const { clientWidth, clientHeight } = stage;
  const scaleFor = (share) => Math.min((share * clientWidth) / (x2 - x1), (share * clientHeight) / (y2 - y1));
  const [wide, narrow, whole] = [scaleFor(0.5), scaleFor(0.8), wholeScale()];
  const scale = clamp(Math.max(wide < 1.25 * whole ? narrow : wide, Math.min(least, narrow)), MIN_SCALE, MAX_SCALE);
  if (scale <= whole) return fit();
  // The box is in the middle of the view, unless more than a margin beside the photo would then be visible.
  const offset = (side, extent, middle) => {
    const hidden = side - extent * scale;
    return hidden > 0 ? hidden / 2 : clamp(side / 2 - middle * scale, hidden - MARGIN_PX, MARGIN_PX);
  };
  move(scale, offset(clientWidth, shown[0], (x1 + x2) / 2), offset(clientHeight, shown[1], (y1 + y2) / 2));
  state.view.box = box;
}

/** Zooms by `factor` and keeps the point under `at` (on the screen) fixed. */
export function zoom(factor, at = [stage.clientWidth / 2, stage.clientHeight / 2]) {
  const [px, py] = toPhoto(at);
  const scale = clamp(state.view.scale * factor, MIN_SCALE, MAX_SCALE);
  move(scale, at[0] - px * scale, at[1] - py * scale);
}

/** Pixel for pixel. */
export const actualSize = () => zoom(1 / state.view.scale);

export const pan = ([dx, dy]) => move(state.view.scale, state.view.x + dx, state.view.y + dy);

/** Some of the photo always stays in view. */
function move(scale, x, y) {
  const kept = 40;
  state.view = {
    scale,
    x: clamp(x, kept - shown[0] * scale, stage.clientWidth - kept),
    y: clamp(y, kept - shown[1] * scale, stage.clientHeight - kept),
    fitted: false,
  };
  changed();
}

export function renderView() {
  const { scale, x, y } = state.view;
  photo.style.transform = `translate(${x}px, ${y}px) scale(${scale})`;
  photo.classList.toggle("crisp", scale >= CRISP_FROM);
  by("zoom-tools").hidden = photo.hidden;
  by("zoom").textContent = `${Math.round(scale * 100)} %`;
}

/** The stage's last size. */
let [lastWidth, lastHeight] = [0, 0];

/** After a change of the stage's size: the photo, or the box shown before, is fitted again; otherwise the middle stays in the middle. */
new ResizeObserver(() => {
  const { clientWidth, clientHeight } = stage;
  // In the step without a photo the stage has no size.
  if (!clientWidth) return;
  const { scale, x, y, fitted, box } = state.view;
  if (fitted) fit();
  else if (box) showBox(box, 0);
  else move(scale, x + (clientWidth - lastWidth) / 2, y + (clientHeight - lastHeight) / 2);
  [lastWidth, lastHeight] = [clientWidth, clientHeight];
}).observe(stage);

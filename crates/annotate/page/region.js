// The searched region of the pictures: shown as a frame, set by dragging on the picture or by four numbers.

import { api } from "./api.js";
import { by, offBecause } from "./elements.js";
import { clamp } from "./geometry.js";
import { changed, isLive, isRunning, searchAgain, state, trialPicture } from "./store.js";
import { toast } from "./toast.js";
import { toPhoto, toScreen } from "./view.js";

const SIDES = ["x", "y", "width", "height"];
/** A region with a shorter side was drawn by mistake. */
const MIN_SIDE_PX = 8;

/** Whether the next drag on the picture draws the region, which is then in the draft as [x, y, width, height]. */
let isDrawing = false;

export const isChoosingRegion = () => isDrawing && state.tab === "try";

/** Width and height of the picture on the stage; null without a picture. */
function pictureSize() {
  if (isLive()) return state.live.size;
  const shown = trialPicture();
  return shown ? [shown.width, shown.height] : null;
}

/** Asks the server to search only this region (null: the whole picture), and searches all pictures again. */
async function setRegion(region) {
  by("region-error").hidden = true;
  try {
    state.region = (await api.setRegion(region)).region;
    searchAgain({ compares: false });
    toast(region ? "Only this part of the picture is searched now." : "All of the picture is searched now.");
  } catch (error) {
    by("region-error").hidden = false;
    by("region-error").textContent = error.message;
  }
  changed();
}

const ofNumbers = ([x, y, width, height]) => setRegion({ x, y, width, height, picture: pictureSize() });

/** The action of a drag on the picture while a region is drawn. */
export function drawingRegion(from) {
  return {
    move(at) {
      const limits = pictureSize();
      const ends = [from, toPhoto(at)].map((point) => point.map((v, axis) => Math.round(clamp(v, 0, limits[axis]))));
      const [low, high] = [Math.min, Math.max].map((pick) => ends[0].map((v, axis) => pick(v, ends[1][axis])));
      state.draft = { region: [...low, high[0] - low[0], high[1] - low[1]] };
      changed();
    },
    end(clicked) {
      const region = state.draft?.region;
      state.draft = null;
      if (!clicked && region && Math.min(region[2], region[3]) >= MIN_SIDE_PX) {
        isDrawing = false;
        ofNumbers(region);
      }
      changed();
    },
  };
}

/** The next drag draws no region. */
export function abandonRegion() {
  isDrawing = false;
  changed();
}

by("region-draw").addEventListener("click", () => {
  isDrawing = !isDrawing;
  changed();
});
by("region-all").addEventListener("click", () => setRegion(null));
by("region-form").addEventListener("submit", (event) => {
  event.preventDefault();
  ofNumbers(SIDES.map((side) => by(`region-${side}`).valueAsNumber));
});

/** The frame, with the rest of the picture darkened. It is below all other drawings. */
function renderFrame() {
  const overlay = by("overlay");
  let frame = by("region-frame");
  const size = pictureSize();
  const region = state.draft?.region ?? (state.region && SIDES.map((side) => state.region[side]));
  if (state.tab !== "try" || !region || !size) return frame?.remove();
  if (!frame) {
    frame = document.createElementNS("http://www.w3.org/2000/svg", "g");
    frame.id = "region-frame";
    frame.innerHTML = '<path class="beside" fill-rule="evenodd"/><path class="rim"/><path class="line"/>';
  }
  if (overlay.firstChild !== frame) overlay.prepend(frame);
  const box = ([x, y, width, height]) => {
    const [[x1, y1], [x2, y2]] = [[x, y], [x + width, y + height]].map(toScreen);
    return `M${x1} ${y1}H${x2}V${y2}H${x1}Z`;
  };
  const [beside, ...lines] = frame.children;
  beside.setAttribute("d", box([0, 0, ...size]) + box(region));
  for (const line of lines) line.setAttribute("d", box(region));
}

let shown = "";
export function renderRegion() {
  renderFrame();
  by("stage").classList.toggle("choosing", isChoosingRegion());
  if (state.tab !== "try") return;
  const { region } = state;
  const size = pictureSize();
  by("region").hidden = !size;
  if (!size) return;
  by("region-title").textContent = region ? "Where to look: in a part of the picture" : "Where to look: everywhere";
  by("region-draw").setAttribute("aria-pressed", String(isDrawing));
  by("region-all").hidden = !region;
  const isOther = region?.picture && String(region.picture) !== String(size);
  const off = isRunning() && "A model is being taught: the region can be changed afterwards.";
  by("region-text").textContent = off || (isDrawing
    ? "Drag over the region of the picture to be searched."
    : isOther
      ? `It is for pictures of ${region.picture.join(" × ")} pixels; this one has ${size.join(" × ")}.`
      : region
        ? "Parts are found if their grasp and at least half of the part are in the frame. Models taught later search there, too."
        : "The whole picture is searched. A smaller region is faster, but parts outside it are not found.");
  for (const control of by("region-form").elements) offBecause(control, off);
  const now = JSON.stringify([region, size]);
  if (now === shown) return;
  if (region) by("region-fold").open = true;
  shown = now;
  const values = region ? SIDES.map((side) => region[side]) : [0, 0, ...size];
  SIDES.forEach((side, i) => {
    const input = by(`region-${side}`);
    input.value = values[i];
    input.max = size[i % 2];
  });
}

// Shortcuts. In fields, keys are for text.

import { adjustGripper, boxDrawn, closeOutline, deleteSelected, nudge, placeGripper, proposeOutline, redo, setBox, setTool, strokeOutline, undo } from "./editing.js";
import { by } from "./elements.js";
import { boundsOf, boxPolygon } from "./geometry.js";
import { holdSpace, isDragging, letGo } from "./gestures.js";
import { keepPicture, takePhoto, toggleCamera, toggleLive } from "./live.js";
import { openNext } from "./strip.js";
import { isLive, isMarking, region, size, state, trialPicture } from "./store.js";
import { actualSize, fit, middle, showBox, zoom } from "./view.js";

const DEGREE = Math.PI / 180;
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
const overlay = by("overlay");

/** Creates the chosen mark without a pointer, in the middle of the view or of the part; it can be moved from there. */
function putInTheMiddle() {
  if (state.tool === "outline") {
    if (state.draft) closeOutline(state.draft.points);
    else proposeOutline();
  } else if (state.tool === "box") {
    const [x, y] = middle();
    const [w, h] = size().map((side) => side / 6);
    setBox([x - w, y - h, x + w, y + h]);
    boxDrawn();
    setTool("select");
    state.selected = "box";
  } else if (state.tool === "grasp") {
    const part = region();
    if (!part) return placeGripper(middle());
    const [x1, y1, x2, y2] = boundsOf(part);
    placeGripper([(x1 + x2) / 2, (y1 + y2) / 2]);
  } else if (state.tool === "in" || state.tool === "out") {
    strokeOutline([middle()], state.tool === "in");
  } else return false;
  return true;
}

/** Shows the whole photo or, if that is shown already, the part. */
export function fitOrPart() {
  const best = !isLive() && state.tab === "try" ? trialPicture()?.detections?.[0]?.marks : null;
  const part = best ? best.outline ?? boxPolygon(best.box) : state.tab === "try" || isLive() ? null : region();
  if (state.view.fitted && part) showBox(boundsOf(part));
  else fit();
}

/** A mark chosen by key is made by keys: the photo gets the focus, so that Enter does not press a button. */
function choose(tool) {
  setTool(tool);
  if (!document.activeElement?.closest("#stage")) overlay.focus({ preventScroll: true });
}

const MARKING = {
  v: () => choose("select"),
  b: () => choose("box"),
  g: () => choose("grasp"),
  o: () => choose("outline"),
  p: () => proposeOutline(),
  i: () => choose("in"),
  u: () => choose("out"),
  "[": () => adjustGripper({ turn: -DEGREE }),
  "]": () => adjustGripper({ turn: DEGREE }),
  "{": () => adjustGripper({ turn: -15 * DEGREE }),
  "}": () => adjustGripper({ turn: 15 * DEGREE }),
  ",": () => adjustGripper({ open: -1 }),
  ".": () => adjustGripper({ open: 1 }),
  "<": () => adjustGripper({ open: -10 }),
  ">": () => adjustGripper({ open: 10 }),
  delete: deleteSelected,
  backspace: deleteSelected,
};

const LOOKING = {
  "+": () => zoom(1.25),
  "=": () => zoom(1.25),
  "-": () => zoom(0.8),
  f: fitOrPart,
  0: fit,
  1: actualSize,
  n: () => openNext(1),
  m: () => openNext(-1),
  c: toggleCamera,
  t: takePhoto,
  l: toggleLive,
  k: keepPicture,
  "?": () => by("help").showModal(),
  escape: letGo,
};

/** The handle in focus, for the arrow keys. */
function focused() {
  const data = document.activeElement?.dataset;
  if (!data?.kind) return null;
  const vertex = data.vertex === undefined ? undefined : Number(data.vertex);
  return { kind: data.kind, edge: data.edge, end: data.end, jaw: data.jaw !== undefined, vertex };
}

// The focus on the photo is shown only after a key press. Browsers do not do this by themselves for elements of SVG.
document.addEventListener("keydown", () => document.documentElement.toggleAttribute("data-keys", true), true);
document.addEventListener("pointerdown", () => document.documentElement.removeAttribute("data-keys"), true);

document.addEventListener("keydown", (event) => {
  const writing = event.target.matches("input:not([type=radio]):not([type=file]), select, textarea");
  if (document.querySelector("dialog[open]") || event.altKey) return;
  const key = event.key.toLowerCase();
  // Until a drag has ended, keys change neither the photo nor its marks.
  if (isDragging() && key !== "escape") return event.preventDefault();
  if (event.ctrlKey || event.metaKey) {
    const action = { z: event.shiftKey ? redo : undo, y: redo }[key];
    if (key === "s") event.preventDefault();
    if (!action || writing || !isMarking()) return;
    event.preventDefault();
    return action();
  }
  if (writing) return;
  const onPhoto = event.target === document.body || event.target.closest("#stage");
  const marking = isMarking();
  if (key === " " && onPhoto) {
    event.preventDefault();
    return holdSpace(true);
  }
  if (marking && ARROWS[event.key] && onPhoto) {
    const [x, y] = ARROWS[event.key];
    const step = event.shiftKey ? 10 : 1;
    if (nudge([x * step, y * step], focused())) event.preventDefault();
    return;
  }
  if (marking && key === "enter" && onPhoto && putInTheMiddle()) return event.preventDefault();
  const action = (marking && (MARKING[event.key] ?? MARKING[key])) || LOOKING[event.key] || LOOKING[key];
  if (!action) return;
  event.preventDefault();
  action();
});

document.addEventListener("keyup", (event) => {
  if (event.key === " ") holdSpace(false);
});

// Gestures of mouse, pen and fingers on the photo.

import { by } from "./elements.js";
import { add, direction, distanceTo, dot, fittedWidth, footOn, gripperOf, norm, quarter, sub, times } from "./geometry.js";
import { boxDrawn, closeOutline, commit, inPhoto, moveEdges, placeGripper, setBox, setGripper, setTool, strokeOutline } from "./editing.js";
import { changed, image, isMarking, marks, region, size, state } from "./store.js";
import { KNOB_PX, REACH_PX } from "./overlay.js";
import { abandonRegion, drawingRegion, isChoosingRegion } from "./region.js";
import { pan, toPhoto, zoom } from "./view.js";

const stage = by("stage");
const overlay = by("overlay");
/** A pointer that moves less than this has clicked. */
const CLICK_PX = 5;
/** The jaws' length changes only if an end's knob is dragged by at least this much outwards or inwards, so that turning alone does not change it. */
const LENGTH_SLACK_PX = 12;
/** A second click within this time closes the outline. */
const DOUBLE_MS = 400;
const SNAP_RAD = Math.PI / 12;
/** Distance between the points of a stroke, and their maximum number; the server accepts a thousand. */
const STROKE_STEP_PX = 4;
const MAX_STROKE_POINTS = 500;

/** Position on the stage of each pressed pointer, by id. */
const pointers = new Map();
/** Action of the first pressed pointer: `move(point, event)`, `end(clicked)`; and the photo and the step of its begin. */
let gesture = null;
export const isDragging = () => Boolean(gesture);
const isElsewhere = () => gesture.target !== image() || gesture.tab !== state.tab;
let spaceHeld = false;
/** Position and time of the outline's last point. */
let lastPoint = null;

const place = (event) => {
  const { left, top } = stage.getBoundingClientRect();
  return [event.clientX - left, event.clientY - top];
};

function panning() {
  let last = null;
  stage.classList.add("panning");
  return {
    move(at) {
      if (last) pan(sub(at, last));
      last = at;
    },
    end: () => stage.classList.remove("panning"),
  };
}

function drawingBox(from) {
  return {
    move(at) {
      const to = toPhoto(at);
      state.draft = { kind: "box", box: [from[0], from[1], to[0], to[1]] };
      changed();
    },
    end(clicked) {
      const { draft } = state;
      state.draft = null;
      if (clicked || !draft) return changed();
      setBox(draft.box);
      const [x1, y1, x2, y2] = marks().box;
      if (x2 - x1 < 2 || y2 - y1 < 2) marks().box = JSON.parse(image().committed).box;
      else boxDrawn();
      changed();
    },
  };
}

function drawingGrasp(from) {
  return {
    move(at) {
      state.draft = { kind: "grasp", from, to: toPhoto(at) };
      changed();
    },
    end(clicked) {
      const { draft } = state;
      state.draft = null;
      if (clicked || !draft) return placeGripper(from);
      const gripper = gripperOf({ start: draft.from, end: draft.to, jaw_width: 1 });
      setGripper({ ...gripper, width: fittedWidth(gripper, region()) });
      Object.assign(state, { selected: "grasp", tool: "select" });
      commit();
    },
  };
}

function addingPoint() {
  return {
    move() {},
    end(clicked, at) {
      if (!clicked) return;
      state.draft ??= { kind: "outline", points: [] };
      const { points } = state.draft;
      const again = lastPoint && performance.now() - lastPoint.time < DOUBLE_MS && norm(sub(at, lastPoint.at)) < CLICK_PX;
      lastPoint = { at, time: performance.now() };
      if (again) return closeOutline(points);
      points.push(inPhoto(toPhoto(at)));
      changed();
    },
  };
}

/** A stroke or click over an area that belongs to the part or does not. */
function stroking(isInside, from) {
  const points = [from];
  return {
    move(at) {
      const to = toPhoto(at);
      // Closer points add no information.
      if (norm(sub(to, points.at(-1))) * state.view.scale < STROKE_STEP_PX || points.length >= MAX_STROKE_POINTS) return;
      points.push(to);
      state.draft = { kind: "stroke", points, isInside };
      changed();
    },
    end() {
      state.draft = null;
      const [w, h] = size();
      const inside = points.filter(([x, y]) => x >= 0 && y >= 0 && x < w && y < h);
      if (inside.length) strokeOutline(inside, isInside);
      else changed();
    },
  };
}

/** Changes marks while the pointer moves; the final state is one undoable step. */
function correcting(change) {
  return {
    move(at, event) {
      change(toPhoto(at), event);
      changed();
    },
    end: () => commit(),
  };
}

function draggingBox(edge, from) {
  const { box } = marks();
  return correcting((to) => moveEdges(box, edge, sub(to, from)));
}

function draggingVertex(vertex) {
  state.vertex = vertex;
  return correcting((to) => {
    marks().outline[vertex] = inPhoto(to);
  });
}

/** A new point on the outline's line where this is dragged; a click adds none. */
function draggingLine(from) {
  const { outline } = marks();
  const feet = outline.map((to, i) => footOn(from, outline.at(i - 1), to));
  const distances = feet.map((foot) => norm(sub(from, foot)));
  const nearest = distances.indexOf(Math.min(...distances));
  return correcting((to) => {
    if (state.vertex === null) outline.splice((state.vertex = nearest), 0, from);
    outline[nearest] = inPhoto(add(feet[nearest], sub(to, from)));
  });
}

function draggingGripper(data, from) {
  const gripper = gripperOf(marks().grasp);
  const along = direction(gripper.angle);
  if ("jaw" in data) {
    const side = data.jaw === "0" ? -1 : 1;
    return correcting((to) => {
      const opened = 2 * side * dot(sub(to, from), quarter(along));
      setGripper({ ...gripper, width: Math.max(gripper.width + opened, 1) });
    });
  }
  if ("end" in data) {
    const side = data.end === "start" ? -1 : 1;
    return correcting((to, event) => {
      const arm = times(sub(to, gripper.center), side);
      let angle = Math.atan2(arm[1], arm[0]);
      if (event.shiftKey) angle = Math.round(angle / SNAP_RAD) * SNAP_RAD;
      const stretched = norm(arm) - KNOB_PX / state.view.scale - gripper.length / 2;
      const slack = LENGTH_SLACK_PX / state.view.scale;
      const grown = Math.sign(stretched) * Math.max(Math.abs(stretched) - slack, 0);
      setGripper({ ...gripper, angle, length: Math.max(gripper.length + 2 * grown, 4) });
    });
  }
  return correcting((to) => setGripper({ ...gripper, center: add(gripper.center, sub(to, from)) }));
}

/** The handle of the outline's nearest point: where points are close, their handles overlap. */
function nearestVertex(place) {
  const distances = marks().outline.map((point) => norm(sub(point, place)));
  return overlay.querySelector(`.vertex[data-vertex="${distances.indexOf(Math.min(...distances))}"]`);
}

/** The mark that is dragged from a place. The outline's clickable area can cover the gripper of a thin part: between the jaws, the gripper is dragged if its line is closer than the outline. At its middle and ends, the gripper is dragged unless a point of the outline is there. */
function takenAt(target, from) {
  const taken = target.closest?.("[data-kind]");
  const { grasp, outline } = marks();
  if (taken?.dataset.kind !== "outline" || !grasp) return taken;
  const gripper = gripperOf(grasp);
  const along = direction(gripper.angle);
  const arm = sub(from, gripper.center);
  const [t, s] = [along, quarter(along)].map((axis) => dot(arm, axis));
  const isBetween = Math.abs(t) <= gripper.length / 2 && Math.abs(s) <= gripper.width / 2;
  const { scale } = state.view;
  const isNear = (place) => "line" in taken.dataset && Math.hypot(t - place, s) * scale <= REACH_PX;
  const end = gripper.length / 2 + KNOB_PX / scale;
  const isBody = isNear(0) || (isBetween && Math.abs(s) < distanceTo(outline, from));
  const handles = [["body", isBody], ["end=start", isNear(-end)], ["end=end", isNear(end)]];
  const name = handles.find(([, isTaken]) => isTaken)?.[0];
  return name ? overlay.querySelector(`[data-kind=grasp][data-${name}]`) : taken;
}

/** The action begun by a pressed pointer. */
function begin(event, at) {
  const from = toPhoto(at);
  const taken = isMarking() && state.tool === "select" ? takenAt(event.target, from) : event.target.closest?.("[data-kind]");
  if (event.button === 1 || spaceHeld) return panning();
  if (isChoosingRegion()) return drawingRegion(from);
  if (!isMarking()) return panning();
  if (taken?.dataset.kind === "draft" && taken.dataset.vertex === "0") {
    return { move() {}, end: () => closeOutline(state.draft.points) };
  }
  if (taken && state.tool === "select") {
    const handle = taken.dataset.vertex === undefined ? taken : nearestVertex(from);
    const { dataset } = handle;
    state.selected = dataset.kind;
    state.vertex = null;
    if (handle.tabIndex >= 0) handle.focus({ preventScroll: true });
    if (dataset.kind === "box") return draggingBox(dataset.edge, from);
    if (dataset.kind === "grasp") return draggingGripper(dataset, from);
    return "line" in dataset ? draggingLine(from) : draggingVertex(Number(dataset.vertex));
  }
  if (state.tool === "box") return drawingBox(from);
  if (state.tool === "grasp") return drawingGrasp(from);
  if (state.tool === "outline") return addingPoint();
  if (state.tool === "in" || state.tool === "out") return stroking(state.tool === "in", from);
  Object.assign(state, { selected: null, vertex: null });
  changed();
  return panning();
}

// Dragging a selection or a picture would take the pointer away.
stage.addEventListener("dragstart", (event) => event.preventDefault());

overlay.addEventListener("pointerdown", (event) => {
  if (event.button > 1) return;
  const at = place(event);
  pointers.set(event.pointerId, at);
  overlay.setPointerCapture(event.pointerId);
  if (pointers.size > 1) {
    // Two fingers move the view; the first finger's action is cancelled.
    if (gesture) abandon();
    return;
  }
  gesture = { ...begin(event, at), from: at, target: image(), tab: state.tab };
});

overlay.addEventListener("pointermove", (event) => {
  const at = place(event);
  const known = pointers.get(event.pointerId);
  if (!known) {
    if (state.draft?.kind === "outline" && event.pointerType !== "touch") {
      state.draft.pointer = toPhoto(at);
      changed();
    }
    return;
  }
  if (pointers.size === 2) {
    const [other] = [...pointers].filter(([id]) => id !== event.pointerId).map(([, p]) => p);
    const before = norm(sub(known, other));
    if (before > 0) zoom(norm(sub(at, other)) / before, times(add(known, other), 0.5));
    pan(times(sub(add(at, other), add(known, other)), 0.5));
  } else if (gesture) {
    if (isElsewhere()) return abandon();
    gesture.moved ||= norm(sub(at, gesture.from)) > CLICK_PX;
    if (gesture.moved) gesture.move(at, event);
  }
  pointers.set(event.pointerId, at);
});

function up(event) {
  if (!pointers.delete(event.pointerId) || !gesture) return;
  if (event.type === "pointercancel" || isElsewhere()) return abandon();
  const ended = gesture;
  gesture = null;
  ended.end(!ended.moved, place(event));
}
overlay.addEventListener("pointerup", up);
overlay.addEventListener("pointercancel", up);

/** Restores the marks from before the gesture; an unclosed outline keeps its points. */
function abandon() {
  const target = gesture?.target;
  gesture = null;
  stage.classList.remove("panning");
  if (target) target.marks = JSON.parse(target.committed);
  if (state.draft?.kind !== "outline") state.draft = null;
  changed();
}

overlay.addEventListener("wheel", (event) => {
  event.preventDefault();
  const notch = event.deltaMode === 1 ? 33 : 1;
  zoom(Math.exp(-event.deltaY * notch * (event.ctrlKey ? 0.01 : 0.0015)), place(event));
}, { passive: false });

/** A handle focused by keyboard becomes the selection. */
overlay.addEventListener("focusin", (event) => {
  const { kind, vertex } = event.target.dataset;
  if (!kind || gesture) return;
  state.selected = kind;
  state.vertex = vertex === undefined ? null : Number(vertex);
  changed();
});

export function holdSpace(held) {
  spaceHeld = held;
}

/** Cancels the current drawing; otherwise clears the selection. */
export function letGo() {
  abandonRegion();
  if (gesture || state.draft) {
    state.draft = null;
    return abandon();
  }
  Object.assign(state, { selected: null, vertex: null });
  setTool("select");
  overlay.focus({ preventScroll: true });
}

// The marks drawn over the photo. Elements are kept between frames, so that a focused handle keeps the focus.

import { by } from "./elements.js";
import { add, boundsOf, boxPolygon, direction, gripperOf, quarter, sub, times } from "./geometry.js";
import { strokesOf } from "./editing.js";
import { image, isAccepted, isFound, isLive, isMarking, marks, state, touchedBy, trialPicture } from "./store.js";
import { toScreen } from "./view.js";

const SVG = "http://www.w3.org/2000/svg";
const overlay = by("overlay");
/** Radius around a handle in which a pointer grabs it: larger for fingers. */
export const REACH_PX = matchMedia("(pointer: coarse)").matches ? 20 : 11;
/** Distance between the end of the line and its knob, so that knob and jaws stay apart however small the gripper is. */
export const KNOB_PX = 20;
/** Like `KNOB_PX`, for the dots of a detection, which are not dragged. */
const DETECTED_OUT_PX = 8;
const JAW_PX = 12;
/** If nothing is accepted, the best refused detection is shown if its score is at least this. */
export const MIN_SHOWN = 0.002;

const CORNERS = { nw: [0, 1], n: [0.5, 1], ne: [2, 1], e: [2, 1.5], se: [2, 3], s: [0.5, 3], sw: [0, 3], w: [0, 1.5] };
const SIDES = { nw: "top left", n: "top", ne: "top right", e: "right", se: "bottom right", s: "bottom", sw: "bottom left", w: "left" };

let drawn = new Map();
let next = new Map();

/** An element by its key, created if new; elements not requested in a frame are removed after it. */
function element(key, name, attributes, parent = overlay) {
  let found = drawn.get(key);
  if (!found) {
    found = document.createElementNS(SVG, name);
    drawn.set(key, found);
  }
  if (found.parentNode !== parent) parent.append(found);
  for (const [attribute, value] of Object.entries(attributes)) {
    if (found.getAttribute(attribute) !== String(value)) found.setAttribute(attribute, value);
  }
  next.set(key, found);
  return found;
}

const path = (points, closed = true) => `M${points.map((p) => p.map((v) => v.toFixed(1)).join(" ")).join("L")}${closed ? "Z" : ""}`;
const group = (key, classes) => element(key, "g", { class: classes });

/** A line with its rim. */
function line(key, parent, d) {
  element(`${key}/rim`, "path", { class: "rim", d }, parent);
  element(`${key}/line`, "path", { class: "line", d }, parent);
}

/** A handle for mouse, finger and keyboard; `data` states what the handle moves. */
function handle(key, parent, data, label, classes = "") {
  const attributes = { class: `handle ${classes}`, tabindex: 0, role: "button", "aria-label": label };
  for (const [name, value] of Object.entries(data)) attributes[`data-${name}`] = value;
  return element(key, "g", attributes, parent);
}

function knob(key, parent, [x, y], r = 5) {
  element(`${key}/reach`, "circle", { class: "reach", cx: x, cy: y, r: REACH_PX }, parent);
  element(`${key}/knob`, "circle", { class: "knob", cx: x, cy: y, r }, parent);
}

function drawBox(box, correcting) {
  const parent = group("box", "box");
  const corners = boxPolygon(box).map(toScreen);
  line("box", parent, path(corners));
  if (!correcting) return;
  const [x1, y1, x2, y2] = [...corners[0], ...corners[2]];
  for (const edge of Object.keys(CORNERS)) {
    const x = edge.includes("w") ? x1 : edge.includes("e") ? x2 : (x1 + x2) / 2;
    const y = edge.includes("n") ? y1 : edge.includes("s") ? y2 : (y1 + y2) / 2;
    const part = handle(`box/${edge}`, parent, { kind: "box", edge }, `Box, ${SIDES[edge]}`, "box");
    element(`box/${edge}/reach`, "circle", { class: "reach", cx: x, cy: y, r: REACH_PX }, part);
    const half = edge.length === 2 ? 5 : 4;
    element(`box/${edge}/knob`, "rect", { class: "knob", x: x - half, y: y - half, width: 2 * half, height: 2 * half, rx: 1 }, part);
  }
}

function drawOutline(outline, correcting) {
  const parent = group("outline", "outline");
  const points = outline.map(toScreen);
  const d = path(points);
  element("outline/area", "path", { class: "area", d }, parent);
  line("outline", parent, d);
  if (!correcting) return;
  element("outline/grab", "path", { class: "grab", d, "data-kind": "outline", "data-line": "" }, parent);
  points.forEach((point, i) => {
    const chosen = state.selected === "outline" && state.vertex === i;
    const label = `Outline, point ${i + 1} of ${points.length}`;
    const part = handle(`outline/${i}`, parent, { kind: "outline", vertex: i }, label, `vertex${chosen ? " selected" : ""}`);
    knob(`outline/${i}`, part, point, chosen ? 6 : state.selected === "outline" ? 4 : 2.5);
  });
}

/** A gripper's line with the dots at its ends, `out` beyond its jaws: white at the start, filled at the end. While correcting, handles take the place of the dots. */
function drawLine(key, parent, { start, end, along }, out, isWithDots) {
  const beyond = times(along, out);
  const ends = [sub(start, beyond), add(end, beyond)];
  element(`${key}/along`, "path", { class: "along", d: path(ends, false) }, parent);
  ends.forEach(([cx, cy], i) => {
    if (isWithDots) element(`${key}/dot${i}`, "circle", { class: i ? "dot to" : "dot", cx, cy, r: i ? 5 : 4 }, parent);
  });
  return ends;
}

/** The shapes of a gripper on the screen. */
function gripperShapes(grasp) {
  const { center, angle, length, width } = gripperOf(grasp);
  const along = direction(angle);
  const across = quarter(along);
  const scale = state.view.scale;
  const middle = toScreen(center);
  const reach = times(along, Math.max((length / 2) * scale, 5));
  const jaw = (side) => {
    const face = add(middle, times(across, (side * width * scale) / 2));
    const back = add(face, times(across, side * JAW_PX));
    const barb = (turn, out) => add(add(back, times(across, side * out)), times(along, turn));
    return {
      face,
      pad: [sub(face, reach), add(face, reach), add(back, reach), sub(back, reach)],
      arrow: [barb(0, 2), barb(6, 10), barb(2, 10), barb(2, 20), barb(-2, 20), barb(-2, 10), barb(-6, 10)],
    };
  };
  const jaws = [jaw(-1), jaw(1)];
  const between = [sub(jaws[0].face, reach), add(jaws[0].face, reach), add(jaws[1].face, reach), sub(jaws[1].face, reach)];
  const [start, end] = [sub(middle, reach), add(middle, reach)];
  return { middle, along, jaws, between, start, end };
}

function drawGrasp(grasp, correcting) {
  const parent = group("grasp", "grasp");
  const shapes = gripperShapes(grasp);
  const { jaws, between, start, end } = shapes;
  const body = correcting
    ? handle("grasp/body", parent, { kind: "grasp", body: "" }, "Gripper: move it with the arrow keys", "body")
    : group("grasp/body", "grasp");
  if (!correcting) parent.append(body);
  element("grasp/between", "path", { class: "between", d: path(between) }, body);
  element("grasp/along/rim", "path", { class: "rim", d: path([start, end], false) }, parent);
  const ends = drawLine("grasp", parent, shapes, KNOB_PX, !correcting);
  jaws.forEach(({ pad, arrow }, i) => {
    const holder = correcting ? handle(`grasp/jaw${i}`, parent, { kind: "grasp", jaw: i }, `Jaw ${i + 1}: open and close`) : parent;
    if (correcting) element(`grasp/jaw${i}/reach`, "path", { class: "reach", d: path(arrow.concat(pad)) }, holder);
    element(`grasp/jaw${i}/pad`, "path", { class: "jaw", d: path(pad) }, holder);
    element(`grasp/jaw${i}/arrow`, "path", { class: "arrow", d: path(arrow) }, holder);
  });
  if (!correcting) return;
  const from = handle("grasp/start", parent, { kind: "grasp", end: "start" }, "Gripper, start of its line: turn", "end");
  knob("grasp/start", from, ends[0], 6);
  const to = handle("grasp/end", parent, { kind: "grasp", end: "end" }, "Gripper, end of its line: turn", "end to");
  knob("grasp/end", to, ends[1], 7);
}

function drawDraft(draft) {
  if (draft.kind === "box") line("draft", group("draft", "box draft"), path(boxPolygon(draft.box).map(toScreen)));
  if (draft.kind === "grasp") line("draft", group("draft", "grasp draft"), path([draft.from, draft.to].map(toScreen), false));
  if (draft.kind !== "outline" || !draft.points.length) return;
  const parent = group("draft", "outline draft");
  const points = draft.points.map(toScreen);
  line("draft", parent, path(draft.pointer ? [...points, toScreen(draft.pointer)] : points, false));
  points.forEach((point, i) => {
    const part = element(`draft/${i}`, "g", { class: "handle vertex", "data-kind": "draft", "data-vertex": i }, parent);
    knob(`draft/${i}`, part, point, i === 0 ? 6 : 4);
  });
}

/** Strokes for the part and its surroundings, and clicks as dots. */
function drawStrokes(strokes) {
  const parent = group("strokes", "strokes");
  strokes.forEach(({ points, isInside }, i) => {
    const d = points.length > 1 ? path(points.map(toScreen), false) : `${path([toScreen(points[0])], false)}h.01`;
    for (const under of ["under", ""]) element(`strokes/${i}${under}`, "path", { class: `${isInside ? "inside" : "outside"} ${under}`, d }, parent);
  });
}

/** Differences between picture and photo below a refused detection: edges red, surface blue. */
function drawDifferences(refusal, i) {
  const parent = group(`differs${i}`, "differs");
  for (const kind of ["surface", "edges"]) {
    const d = refusal[kind].map((place) => { const [x, y] = toScreen(place); return `M${x.toFixed(1)} ${y.toFixed(1)}h.01`; }).join("");
    if (d) element(`differs${i}/${kind}`, "path", { class: kind, d }, parent);
  }
}

/** Text about one of several grasps, with its number in the picture and in the list. */
export const numbered = (text, i, count) => (count > 1 ? `${i + 1}: ${text}` : text);

/** A detected grasp: drawn like a marked one, but not draggable. Returns its tag: key, text, the part's bounds on the screen, and its group. */
function drawDetection(detection, i, count, detections) {
  const touches = isAccepted(detection) && touchedBy(detection, detections).length;
  const parent = group(`found${i}`, isAccepted(detection) ? (touches ? "touching" : "") : "refused");
  const { outline, grasp, box } = detection.marks;
  if (outline) {
    const within = element(`found${i}/outline`, "g", { class: "outline" }, parent);
    line(`found${i}/outline`, within, path(outline.map(toScreen)));
  }
  const shapes = gripperShapes(grasp);
  const gripper = element(`found${i}/grasp`, "g", { class: "grasp" }, parent);
  drawLine(`found${i}`, gripper, shapes, DETECTED_OUT_PX, true);
  shapes.jaws.forEach(({ pad, arrow }, j) => {
    element(`found${i}/pad${j}`, "path", { class: "jaw", d: path(pad) }, gripper);
    element(`found${i}/arrow${j}`, "path", { class: "arrow", d: path(arrow) }, gripper);
  });
  return [`found${i}/tag`, numbered(detection.score.toFixed(2), i, count), boundsOf((outline ?? boxPolygon(box)).map(toScreen)), parent];
}

const TAG_HEIGHT_PX = 18;
const TAG_GAP_PX = 6;

/** Draws the tags of detections, the best first: each beside its part, at the first place without another tag. */
function drawTags(tags) {
  const taken = [];
  for (const [key, text, [x1, y1, x2, y2], parent] of tags) {
    const tag = element(key, "text", { class: "tag" }, parent);
    tag.textContent = text;
    const width = tag.getComputedTextLength() + TAG_GAP_PX;
    const middle = (y1 + y2 + TAG_HEIGHT_PX) / 2;
    const places = [[x1, y1 - TAG_GAP_PX], [x2 - width, y1 - TAG_GAP_PX], [x1, y2 + TAG_HEIGHT_PX], [x2 - width, y2 + TAG_HEIGHT_PX], [x2 + TAG_GAP_PX, middle], [x1 - width, middle], [(x1 + x2 - width) / 2, middle]];
    // Where parts lie closely on top of each other, tags are stacked.
    for (let row = 1; row <= tags.length; row += 1) places.push([x1, y1 - TAG_GAP_PX - row * TAG_HEIGHT_PX]);
    const isFree = ([x, y]) => taken.every(([left, bottom, other]) => x + width <= left || left + other <= x || Math.abs(bottom - y) >= TAG_HEIGHT_PX);
    const [x, y] = places.find(isFree) ?? places[0];
    taken.push([x, y, width]);
    tag.setAttribute("x", x.toFixed(1));
    tag.setAttribute("y", y.toFixed(1));
  }
}

export function renderOverlay() {
  next = new Map();
  if (state.tab === "try") {
    // Detections in an old picture are not valid now.
    const inLive = state.live.isUsable ? state.live.detections : null;
    const detections = isLive() ? inLive : trialPicture()?.detections;
    const shown = detections?.filter((d, i) => isFound(d) || state.showRefused || (!isLive() && i === 0 && d.score >= MIN_SHOWN)) ?? [];
    // Worst first, so that the best is on top.
    const tags = shown.map((d, i) => [d, i]).reverse().map(([d, i]) => {
      if (d.refusal && !isAccepted(d) && state.showDifferences) drawDifferences(d.refusal, i);
      return drawDetection(d, i, shown.length, detections);
    });
    drawTags(tags.reverse());
  } else if (image() && !isLive()) {
    const correcting = state.tool === "select" && isMarking();
    const { box, outline, grasp } = marks();
    if (outline) drawOutline(outline, correcting);
    if (box) drawBox(box, correcting);
    if (grasp) drawGrasp(grasp, correcting);
    const { draft } = state;
    if (state.tool === "in" || state.tool === "out") drawStrokes([...strokesOf(image()), ...(draft?.kind === "stroke" ? [draft] : [])]);
    if (state.draft) drawDraft(state.draft);
  }
  for (const [key, found] of drawn) if (!next.has(key)) found.remove();
  drawn = next;
  // The selection is on top, so that nothing covers it. Moving it would take its focus: the other groups are moved.
  const order = ["grasp", "outline", "box"].filter((key) => key !== state.selected);
  const groups = [...order, state.selected, "draft"].map((key) => drawn.get(key)).filter(Boolean);
  for (let i = groups.length - 2; i >= 0; i -= 1) {
    if (groups[i].nextSibling !== groups[i + 1]) overlay.insertBefore(groups[i], groups[i + 1]);
  }
}

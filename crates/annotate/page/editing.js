// Changes of marks: undoable, saved at once.

import { api, isLost, present } from "./api.js";
import { wait } from "./elements.js";
import { areaOf, boundsOf, clamp, graspOf, gripperOf, isWithin, nearestWithin, norm, placedAt, sub } from "./geometry.js";
import { changed, image, marks, region, size, state } from "./store.js";
import { toast } from "./toast.js";
import { showBox } from "./view.js";

/** Coordinates are rounded to a hundredth of a pixel. */
const round = (_, value) => (typeof value === "number" ? Math.round(value * 100) / 100 : value);
/** The page's own fields for marks of the server. `committed`, `sent`: marks as JSON, rounded; `past`, `future`: committed marks, each with `found`, the way in which the outline was found; `waiting`: strokes not yet answered. */
function fieldsOf(marks) {
  const sent = JSON.stringify(marks, round);
  return { marks: JSON.parse(sent), sent, committed: sent, future: [], found: null, waiting: [] };
}

/** Adds the page's own fields to the server's view of a photo. */
export const adopt = (view) => ({ ...view, ...fieldsOf(view.marks), past: [], revision: 0 });

const isBeingChanged = (target) => JSON.stringify(target.marks) !== target.committed;

/** Replaces marks by those of another page or program, as an undoable step; a note says why if the user's were not saved. */
function replace(target, { marks, advice, saved, note }, why) {
  if (why) toast(`${target.name}: ${why}. “Undo” restores it.`);
  target.past.push([target.committed, target.found]);
  Object.assign(target, { advice, saved, note, ...fieldsOf(marks), revision: target.revision + 1 });
  if (target === image()) Object.assign(state, { draft: null, vertex: null });
}

/** Adopts marks that another page or program has changed. Marks that are being changed here stay, and those that this server (which may be a restarted one) did not take, unless it has other ones than before. */
export function adoptChange(target, view, isRestarted) {
  const { advice, saved, note } = view;
  const isRefused = target.saved.state === "refused";
  const known = isRestarted || "lost" in target.saved ? [target.sent, target.committed] : [target.committed];
  if (!known.some((json) => textOf(JSON.parse(json)) === textOf(view.marks))) {
    if (!isBeingChanged(target)) replace(target, view, isRefused && "these marks were changed elsewhere");
  } else if (!isRefused) Object.assign(target, { advice, saved, note });
}

/** Makes the current marks an undoable step, and saves them. `found`: how a new outline was found; a stroke is a step even if it changes nothing. */
export function commit(found = null) {
  const target = image();
  const now = JSON.stringify(target.marks, round);
  target.marks = JSON.parse(now);
  if (now !== target.committed || found?.strokes.length) {
    target.past.push([target.committed, target.found]);
    target.future = [];
    target.committed = now;
    save(target);
  }
  if (found) target.found = { ...found, outline: keyOf(target) };
  changed();
}

function travel(from, to) {
  const target = image();
  if (!target[from].length) return;
  target[to].push([target.committed, target.found]);
  [target.committed, target.found] = target[from].pop();
  target.marks = JSON.parse(target.committed);
  target.waiting = [];
  Object.assign(state, { draft: null, vertex: null });
  save(target);
  changed();
}

export const undo = () => travel("past", "future");
export const redo = () => travel("future", "past");

/** Sends the marks; one request at a time for each photo, followed by later changes. */
export async function save(target) {
  target.revision += 1;
  if (target.saving) return;
  target.saving = true;
  let sent = 0;
  // A photo that is missing on a restarted server has no number under which its marks could be saved.
  while (sent !== target.revision && !target.isGone) {
    if (isLost()) {
      target.saved = { state: "refused", why: "sdg annotate does not answer; the marks are kept in this browser", lost: true };
      changed();
      await present();
      // The marks may have been replaced by those of the restarted server.
      if (target.saved.state !== "refused") sent = target.revision;
      continue;
    }
    sent = target.revision;
    try {
      const sending = JSON.stringify(target.marks);
      const { saved, advice } = await api.saveMarks(target.id, target.marks);
      Object.assign(target, { saved, advice, sent: saved.state === "refused" ? target.sent : sending });
    } catch (error) {
      if (error.image) {
        while (isBeingChanged(target)) await wait(50);
        replace(target, error.image, error.message);
        sent = target.revision;
      } else {
        // Marks that the server did not take are kept and sent again, as those that it could not write to disk.
        target.saved = { state: "refused", why: error.message, lost: error.lost, by_disk: error.isPassing };
        if (error.lost) sent = -1;
      }
    }
    changed();
  }
  target.saving = false;
  changed();
}

/** The tool for the next missing mark. */
export function nextTool() {
  const { box, outline, grasp } = marks();
  return !box && !outline ? "box" : !grasp ? "grasp" : "select";
}

export function setTool(tool) {
  Object.assign(state, { tool, draft: null, vertex: null });
  if (tool !== "select") state.selected = tool === "in" || tool === "out" ? "outline" : tool;
  changed();
}

/** The nearest place of the photo. */
export const inPhoto = (point) => point.map((v, axis) => clamp(v, 0, size()[axis]));

const corners = (box) => [box.slice(0, 2), box.slice(2)];

export function setBox(box) {
  marks().box = boundsOf(corners(box).map(inPhoto));
}

/** Moves the edges of a box that are named by directions: `nw` moves the left and the upper one. */
export function moveEdges([x1, y1, x2, y2], edge, [dx, dy]) {
  const by = (side, way) => (edge.includes(side) ? way : 0);
  setBox([x1 + by("w", dx), y1 + by("n", dy), x2 + by("e", dx), y2 + by("s", dy)]);
}

export function setGripper(gripper) {
  marks().grasp = graspOf(gripper, size());
}

/** After a box was drawn: its outline is detected unless there is one, and the gripper is next. */
export function boxDrawn() {
  state.selected = "box";
  commit();
  // Strokes are now applied within this box.
  image().found = null;
  state.tool = nextTool();
  showBox(marks().box);
  if (!marks().outline) proposeOutline({ quietly: true });
}

export function placeGripper(point) {
  const part = region();
  // Without a box, the size of the part is not known.
  const width = Math.max(...size()) / 9;
  setGripper(part ? placedAt(point, part) : { center: point, angle: 0, length: width, width });
  image().placed = { point, grasp: JSON.stringify(marks().grasp, round) };
  Object.assign(state, { selected: "grasp", tool: "select" });
  commit();
}

export function closeOutline(points) {
  Object.assign(state, { draft: null, selected: "outline", tool: "select" });
  if (points.length < 3) return changed();
  marks().outline = points;
  if (!marks().box) setBox(boundsOf(points));
  commit();
  state.tool = nextTool();
}

const boxOf = ({ marks: { box, outline } }) => box ?? (outline && boundsOf(outline));
const keyOf = ({ marks: { outline } }) => JSON.stringify(outline);
/** Marks as a text for comparisons, the same after they were written to a file and read again: the file has a box for every outline, no grasp without them, and other last digits. */
export function textOf(marks) {
  const box = boxOf({ marks });
  return box && JSON.stringify([box, marks.outline, marks.grasp], round);
}

/** How a photo's outline was found: the outline that strokes corrected (null: detected in the box), the strokes, and the box within which they apply. An outline that was drawn, changed by hand or loaded is itself the one to correct. */
const howFound = (target) => (target.found?.outline === keyOf(target) ? target.found : { base: target.marks.outline, strokes: [], box: null });

/** The strokes of the shown outline and those waiting for an answer. */
export const strokesOf = (target) => [...howFound(target).strokes, ...target.waiting];

/** States that the area under a stroke belongs to the part or does not; the outline is corrected by all of its strokes. */
export function strokeOutline(points, isInside) {
  image().waiting.push({ points, isInside });
  return proposeOutline({ isStroke: true });
}

/** Maximum margin of a person's box around the outline, as a share of the box's longer side; a looser box is fitted to a corrected outline. */
const LOOSE = 0.06;

/** If a stroke leaves less of the outline than this share, a note is shown. */
const MUCH_LEFT = 0.65;

/** Fits a loose box to the corrected outline, with a margin. */
function snapBox(marks) {
  const [x1, y1, x2, y2] = boundsOf(marks.outline);
  const room = Math.max(2, 0.02 * Math.hypot(x2 - x1, y2 - y1));
  const [bx1, by1, bx2, by2] = marks.box;
  const most = LOOSE * Math.max(bx2 - bx1, by2 - by1);
  if (Math.max(x1 - bx1, y1 - by1, bx2 - x2, by2 - y2) > most) setBox([x1 - room, y1 - room, x2 + room, y2 + room]);
}

/** The last detection of an outline: the next one begins after it. */
let lastProposal = Promise.resolve();

/** Places the gripper again after a stroke changed the outline. A gripper that a person has drawn or changed stays if its middle is still on the part. Returns whether the middle was beside the part. */
function followOutline(target) {
  const { grasp, outline } = target.marks;
  if (!grasp) return false;
  const { placed } = target;
  const isPlaced = placed?.grasp === JSON.stringify(grasp, round);
  const { center, length, angle } = gripperOf(grasp);
  const point = isPlaced ? placed.point : center;
  const isBeside = !isWithin(center, outline);
  if (!isPlaced && !isBeside) return false;
  const nearest = isWithin(point, outline) ? point : nearestWithin(outline, point, length);
  const kept = isPlaced ? placed.length : length;
  setGripper(placedAt(nearest, outline, { length: kept, before: angle }));
  target.placed = { point: nearest, grasp: JSON.stringify(target.marks.grasp, round), length: kept };
  return isBeside;
}

/** Asks the server for the outline of the object in the box, or for its correction by the waiting strokes. `quietly`: without notes, if the user did not ask for it. */
export function proposeOutline(options = {}) {
  const target = image();
  const propose = () => (target === image() ? detectOutline(target, options) : (target.waiting = []));
  return (lastProposal = lastProposal.then(propose, propose));
}

async function detectOutline(target, { quietly = false, isStroke = false }) {
  const { base, strokes: earlier, box: drawn } = isStroke ? howFound(target) : { base: null, strokes: [], box: null };
  let added = isStroke ? [...target.waiting] : [];
  // No stroke waits any more: all were answered together, or taken back. Or the user did not ask for an outline, and has made one or removed the box.
  if (isStroke ? !added.length : quietly && (target.marks.outline || !target.marks.box)) return;
  const own = boxOf(target);
  if (!own) {
    target.waiting = [];
    setTool("box");
    return toast("Draw a box around the part first: the outline is detected inside it.");
  }
  const strokes = [...earlier, ...added];
  // Areas of the part outside the box enlarge the box, together with the outline.
  const grown = boundsOf([...corners(own), ...added.flatMap(({ points, isInside }) => (isInside ? points : []))]);
  // Strokes are applied within the box that was drawn, even after the box was fitted to the outline.
  const box = boundsOf([drawn ?? grown, grown].flatMap(corners));
  const about = () => JSON.stringify([boxOf(target), target.marks.outline], round);
  const asked = about();
  state.proposing = true;
  changed();
  try {
    const said = strokes.map(({ points, isInside }) => ({ points, is_inside: isInside }));
    const { outline } = await api.proposeOutline(target.id, box, said, base);
    // Strokes taken back do not count. After another change of the box or the outline, the answer is asked for again.
    const isWanted = target === image() && added.every((stroke) => target.waiting.includes(stroke));
    const waited = isWanted && about() === asked;
    if (waited && !outline) {
      if (!quietly) toast("Nothing in the box differs from its surroundings. Draw the outline by hand.");
    } else if (waited) {
      const before = target.marks.outline;
      target.marks.outline = outline;
      if (!target.marks.grasp) state.selected = "outline";
      if (String(grown) !== String(own)) setBox(grown);
      if (isStroke && target.marks.box) snapBox(target.marks);
      const hasMoved = isStroke && followOutline(target);
      commit({ base, strokes, box: isStroke ? box : null });
      const { committed } = target;
      const back = { text: "Undo", run: () => image() === target && target.committed === committed && undo() };
      const last = strokes.at(-1);
      const middle = last?.points[Math.floor(last.points.length / 2)];
      if (!isStroke) toast("Outline found. If wrong, draw “In” or “Out”.");
      else if (!last.isInside && isWithin(middle, outline)) {
        toast("This place is inside the part. An outline is a single line without holes; a hole does no harm.");
      } else if (last.isInside && !isWithin(middle, outline)) {
        toast("This place is not connected with the part. Draw from there to the part as well, or draw the outline by hand.");
      } else if (hasMoved) {
        toast("The gripper was not on the part any more: it was moved there.", back);
      } else if (!last.isInside && before && areaOf(outline) < MUCH_LEFT * areaOf(before)) {
        toast("“Out” removed much of the outline.", back);
      }
    } else if (isWanted && boxOf(target)) {
      added = [];
      proposeOutline({ quietly, isStroke });
    }
  } catch (error) {
    if (!quietly) toast(error.message);
  }
  target.waiting = target.waiting.filter((stroke) => !added.includes(stroke));
  state.proposing = false;
  changed();
}

/** Removes one kind of mark. */
export function clear(kind) {
  marks()[kind] = null;
  if (kind !== "grasp") image().waiting = [];
  Object.assign(state, { vertex: null, draft: null, selected: null });
  commit();
  state.tool = nextTool();
  changed();
}

/** Deletes the last point of a drawing, the selected point, or the selected mark. */
export function deleteSelected() {
  const { outline } = marks();
  if (state.draft?.points?.length) {
    state.draft.points.pop();
    return changed();
  }
  if (state.selected === "outline" && state.vertex !== null && outline) {
    if (outline.length <= 3) return clear("outline");
    outline.splice(state.vertex, 1);
    state.vertex = Math.min(state.vertex, outline.length - 1);
    return commit();
  }
  if (state.selected && marks()[state.selected]) clear(state.selected);
}

/** Moves the selection, or only the given `handle` of it, by this many pixels. */
export function nudge(by, handle = null) {
  const m = marks();
  const kind = handle?.kind ?? state.selected;
  const moved = ([x, y]) => [x + by[0], y + by[1]];
  if (kind === "box" && m.box) {
    const b = m.box;
    const edge = handle?.edge ?? "nwse";
    const [w, h] = size();
    // A moved box keeps its size.
    const dx = edge === "nwse" ? clamp(by[0], -b[0], w - b[2]) : by[0];
    const dy = edge === "nwse" ? clamp(by[1], -b[1], h - b[3]) : by[1];
    moveEdges(b, edge, [dx, dy]);
  } else if (kind === "grasp" && m.grasp) {
    const gripper = gripperOf(m.grasp);
    if (handle?.end) {
      const ends = { start: m.grasp.start, end: m.grasp.end };
      ends[handle.end] = moved(ends[handle.end]);
      setGripper(gripperOf({ ...ends, jaw_width: gripper.width }));
    } else if (handle?.jaw) {
      setGripper({ ...gripper, width: gripper.width + 2 * (by[0] + by[1] > 0 ? 1 : -1) * Math.hypot(...by) * 0.5 });
    } else setGripper({ ...gripper, center: moved(gripper.center) });
  } else if (kind === "outline" && m.outline) {
    const at = handle?.vertex ?? state.vertex;
    m.outline = m.outline.map((p, i) => (at === null || at === i ? inPhoto(moved(p)) : p));
  } else return false;
  commit();
  return true;
}

/** Rotates and opens the gripper by these amounts. */
export function adjustGripper({ turn = 0, open = 0 }) {
  if (!marks().grasp) return;
  const gripper = gripperOf(marks().grasp);
  setGripper({ ...gripper, angle: gripper.angle + turn, width: gripper.width + open });
  commit();
}

/** Smaller changes do not count; in radians and pixels. */
const MIN_TURN = Math.PI / 360;
const MIN_MOVE_PX = 0.5;

/** Turns the gripper to the smallest opening over the part, by at most a quarter turn, centres it on the part across the line, and sets the opening. */
export function turnToFit() {
  const { grasp } = marks();
  const part = region();
  if (!grasp || !part) return;
  const gripper = gripperOf(grasp);
  const fitted = placedAt(gripper.center, part, { length: gripper.length, before: gripper.angle });
  const moved = Math.max(norm(sub(fitted.center, gripper.center)), Math.abs(fitted.width - gripper.width));
  if (Math.abs(Math.sin(fitted.angle - gripper.angle)) < MIN_TURN && moved < MIN_MOVE_PX) return toast("The gripper already fits.");
  setGripper(fitted);
  image().placed = { point: fitted.center, grasp: JSON.stringify(marks().grasp, round), length: gripper.length };
  commit();
}

export function swapEnds() {
  const { grasp } = marks();
  if (!grasp) return;
  [grasp.start, grasp.end] = [grasp.end, grasp.start];
  commit();
}

// Changes of marks: committed with a way back, saved at once.

import { api, isLost, present } from "./api.js";
import { boundsOf, boxPolygon, clamp, graspOf, gripperOf, isWithin, placedAt } from "./geometry.js";
import { changed, image, marks, region, size, state } from "./store.js";
import { toast } from "./toast.js";
import { showBox } from "./view.js";

/** Pixels are told to a hundredth. */
const round = (_, value) => (typeof value === "number" ? Math.round(value * 100) / 100 : value);
/** Gives what the server tells of a photo the page's own fields; `clicksOf`: the clicks that each proposed outline was found with. */
export function adopt(view) {
  const committed = JSON.stringify(view.marks);
  return { ...view, committed, sent: committed, past: [], future: [], revision: 0, clicks: null, clicksOf: new Map() };
}

/** Makes the marks as they are now a step that can be undone, and saves them. */
export function commit() {
  const target = image();
  const now = JSON.stringify(target.marks, round);
  target.marks = JSON.parse(now);
  if (now !== target.committed) {
    target.past.push(target.committed);
    target.future = [];
    target.committed = now;
    save(target);
  }
  changed();
}

function travel(from, to) {
  const target = image();
  if (!from(target).length) return;
  to(target).push(target.committed);
  target.committed = from(target).pop();
  target.marks = JSON.parse(target.committed);
  // A click that is undone counts no more for the next one.
  target.clicks = target.clicksOf.get(target.committed) ?? null;
  Object.assign(state, { draft: null, vertex: null });
  save(target);
  changed();
}

export const undo = () => travel((t) => t.past, (t) => t.future);
export const redo = () => travel((t) => t.future, (t) => t.past);

/** Sends the marks; one request at a time for each photo, and after it what has changed meanwhile. */
export async function save(target) {
  target.revision += 1;
  if (target.saving) return;
  target.saving = true;
  let sent = 0;
  // A photo that the server has no more, after it was started anew, has no number to be saved under.
  while (sent !== target.revision && !target.isGone) {
    if (isLost()) {
      target.saved = { state: "refused", why: "sdg annotate does not answer; the marks are kept in this browser", lost: true };
      changed();
      await present();
      continue;
    }
    sent = target.revision;
    try {
      const sending = JSON.stringify(target.marks);
      const view = await api.saveMarks(target.id, target.marks);
      Object.assign(target, { saved: view.saved, advice: view.advice, sent: sending });
    } catch (error) {
      target.saved = { state: "refused", why: error.message, lost: error.lost };
      if (error.lost) sent = -1;
    }
    changed();
  }
  target.saving = false;
  changed();
}

/** The tool that is wanted next: what is not marked yet. */
export function nextTool() {
  const { box, outline, grasp } = marks();
  return !box && !outline ? "box" : !grasp ? "grasp" : "select";
}

export function setTool(tool) {
  Object.assign(state, { tool, draft: null, vertex: null });
  if (tool !== "select") state.selected = tool === "in" || tool === "out" ? "outline" : tool;
  changed();
}

export function setBox([x1, y1, x2, y2]) {
  const [width, height] = size();
  const xs = [x1, x2].map((x) => clamp(x, 0, width)).sort((a, b) => a - b);
  const ys = [y1, y2].map((y) => clamp(y, 0, height)).sort((a, b) => a - b);
  marks().box = [xs[0], ys[0], xs[1], ys[1]];
}

export function setGripper(gripper) {
  marks().grasp = graspOf(gripper, size());
}

/** A box was drawn: the outline is looked for in it, unless there is one, and the gripper is next. */
export function boxDrawn() {
  state.selected = "box";
  commit();
  state.tool = nextTool();
  showBox(marks().box);
  if (!marks().outline) proposeOutline({ quietly: true });
}

export function placeGripper(point) {
  const part = region() ?? boxPolygon([0, 0, ...size()]);
  setGripper(placedAt(point, part));
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

/** Says that a place belongs to the part or does not; the outline is found anew with all that was said. */
export function clickOutline(point, isInside) {
  const target = image();
  const box = target.marks.box ?? (target.marks.outline && boundsOf(target.marks.outline));
  if (!box) return toast("Draw a box around the part first: the outline is looked for in it.");
  target.clicks = [...(target.clicks ?? []), { at: point, is_inside: isInside }];
  // A place outside the box that belongs to the part makes the box larger.
  if (isInside && (point[0] < box[0] || point[1] < box[1] || point[0] > box[2] || point[1] > box[3])) {
    setBox(boundsOf([box.slice(0, 2), box.slice(2), point]));
  }
  return proposeOutline({ clicks: target.clicks });
}

/** Asks the server for the outline of what is in the box. `quietly` when nobody asked for it by name. */
export async function proposeOutline({ quietly = false, clicks = null } = {}) {
  const target = image();
  const box = target.marks.box ?? (target.marks.outline && boundsOf(target.marks.outline));
  if (!box) {
    setTool("box");
    return toast("Draw a box around the part first: the outline is looked for in it.");
  }
  if (!clicks) target.clicks = null;
  state.proposing = true;
  changed();
  try {
    const { outline } = await api.proposeOutline(target.id, box, clicks ?? []);
    // Whoever has drawn on meanwhile is not overruled.
    const waited = target === image() && !(quietly && target.marks.outline);
    if (waited && !outline) {
      if (!quietly) toast("Nothing in the box stands out from what is around it. Draw the outline by hand.");
    } else if (waited) {
      target.marks.outline = outline;
      if (!target.marks.grasp) state.selected = "outline";
      commit();
      target.clicksOf.set(target.committed, clicks);
      const last = clicks?.at(-1);
      if (!clicks) toast("Found an outline. Click “In” or “Out” where it is wrong, or drag it.");
      else if (!last.is_inside && isWithin(last.at, outline)) {
        toast("That place has the part all around it. An outline is one line around the part and has no holes; a hole does no harm.");
      } else if (last.is_inside && !isWithin(last.at, outline)) {
        toast("That place does not hang together with the part. Click between it and the part, too, or draw the outline by hand.");
      }
    }
  } catch (error) {
    if (!quietly) toast(error.message);
  }
  state.proposing = false;
  changed();
}

/** Removes one kind of mark. */
export function clear(kind) {
  marks()[kind] = null;
  Object.assign(state, { vertex: null, draft: null, selected: null });
  commit();
  state.tool = nextTool();
  changed();
}

/** Deletes the selected point, or the selected mark. */
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

/** What is selected, moved by so many pixels; `handle` where only a part of it is. */
export function nudge(by, handle = null) {
  const m = marks();
  const kind = handle?.kind ?? state.selected;
  const moved = ([x, y]) => [x + by[0], y + by[1]];
  if (kind === "box" && m.box) {
    const b = m.box;
    const edge = handle?.edge ?? "nwse";
    const [w, h] = size();
    // A whole box stays as large as it is.
    const dx = edge === "nwse" ? clamp(by[0], -b[0], w - b[2]) : by[0];
    const dy = edge === "nwse" ? clamp(by[1], -b[1], h - b[3]) : by[1];
    setBox([b[0] + (edge.includes("w") ? dx : 0), b[1] + (edge.includes("n") ? dy : 0),
      b[2] + (edge.includes("e") ? dx : 0), b[3] + (edge.includes("s") ? dy : 0)]);
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
    const [w, h] = size();
    const inside = ([x, y]) => [clamp(x, 0, w), clamp(y, 0, h)];
    const at = handle?.vertex ?? state.vertex;
    m.outline = m.outline.map((p, i) => (at === null || at === i ? inside(moved(p)) : p));
  } else return false;
  commit();
  return true;
}

/** Turns and opens the gripper by so much. */
export function adjustGripper({ turn = 0, open = 0 }) {
  if (!marks().grasp) return;
  const gripper = gripperOf(marks().grasp);
  setGripper({ ...gripper, angle: gripper.angle + turn, width: gripper.width + open });
  commit();
}

/** Turns the gripper about its middle to where it closes over the least of the part, and opens it so far. */
export function turnToFit() {
  const { grasp } = marks();
  const part = region();
  if (!grasp || !part) return;
  const gripper = gripperOf(grasp);
  const { angle, width } = placedAt(gripper.center, part, gripper.length);
  setGripper({ ...gripper, angle, width });
  commit();
}

export function swapEnds() {
  const { grasp } = marks();
  if (!grasp) return;
  [grasp.start, grasp.end] = [grasp.end, grasp.start];
  commit();
}

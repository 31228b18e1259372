// The first step's panel: the next mark, its numbers, problems, and the models that the marks suffice for.

import { api } from "./api.js";
import { clear, commit, deleteSelected, proposeOutline, redo, setGripper, setTool, swapEnds, turnToFit, undo } from "./editing.js";
import { button, by, element, offBecause, setText, shows } from "./elements.js";
import { gripperOf } from "./geometry.js";
import { changed, image, isComplete, isMarking, marks, state } from "./store.js";
import { adoptFrom } from "./server_end.js";
import { removePhoto } from "./strip.js";
import { toast } from "./toast.js";

const label = by("label");
const inputs = { angle: by("grasp-angle"), width: by("grasp-width"), length: by("grasp-length") };

const DOES = {
  C: "keypoints",
  A: "box and crop",
  B: "box and keypoints",
  D: "mask",
  S: "shape",
};
const ORDER = ["C", "A", "B", "D", "S"];

for (const button of document.querySelectorAll("button[data-tool]")) {
  button.addEventListener("click", () => setTool(button.dataset.tool));
}
for (const button of document.querySelectorAll("[data-draw]")) {
  button.addEventListener("click", () => {
    setTool(button.dataset.draw);
    by("stage").scrollIntoView({ block: "nearest" });
  });
}
for (const button of document.querySelectorAll("[data-clear]")) {
  button.addEventListener("click", () => {
    clear(button.dataset.clear);
    // The button disappears with the mark; otherwise the focus would stay on it until the next frame and receive Enter.
    by("overlay").focus({ preventScroll: true });
  });
}
for (const kind of ["box", "grasp", "outline"]) {
  // Selects a mark that is under another one.
  by(`do-${kind}`).addEventListener("click", (event) => {
    if (event.target.closest("button, input") || !marks()[kind] || state.draft) return;
    Object.assign(state, { selected: kind, vertex: null, tool: "select" });
    changed();
  });
}
by("propose").addEventListener("click", () => proposeOutline());
by("turn-around").addEventListener("click", swapEnds);
by("turn-to-fit").addEventListener("click", turnToFit);
by("remove-photo").addEventListener("click", () => removePhoto(image()));
by("undo").addEventListener("click", undo);
by("redo").addEventListener("click", redo);
by("delete").addEventListener("click", deleteSelected);

async function rename() {
  try {
    await adoptFrom(api.rename(label.value));
  } catch (error) {
    toast(error.message);
  }
  label.value = state.label;
}
label.addEventListener("change", rename);
by("keep-name").addEventListener("click", rename);

for (const [what, input] of Object.entries(inputs)) {
  input.addEventListener("change", () => {
    const value = input.valueAsNumber;
    if (Number.isFinite(value) && marks().grasp) {
      setGripper({ ...gripperOf(marks().grasp), [what]: what === "angle" ? (value * Math.PI) / 180 : value });
      commit();
    }
    changed();
  });
}

function renderSaved({ saved }) {
  const line = by("saved");
  const text = {
    written: () => (image().saving ? "Saving…" : `Saved in ${saved.file}`),
    nothing: () => (marks().grasp ? "Kept here; saved as soon as there is a box" : "Nothing marked yet"),
    refused: () => `Not saved: ${saved.why}`,
  }[saved.state]();
  setText(line, text);
  line.className = `saved ${saved.state}`;
}

function renderTodo() {
  const { box, grasp, outline } = marks();
  const done = { box: box || outline, grasp, outline };
  const next = ["box", "grasp", "outline"].find((kind) => !done[kind]);
  for (const kind of ["box", "grasp", "outline"]) {
    const item = by(`do-${kind}`);
    item.classList.toggle("done", Boolean(done[kind]));
    item.classList.toggle("next", kind === next);
    item.classList.toggle("selected", kind === state.selected);
    item.querySelector(`[data-clear]`).hidden = !marks()[kind];
    const draw = item.querySelector(`[data-draw]`);
    if (kind !== "outline") draw.textContent = marks()[kind] ? "Draw again" : kind === "box" ? "Draw" : "Place";
  }
  by("turn-around").hidden = by("turn-to-fit").hidden = !grasp;
  by("remove-photo").hidden = state.images.length < 2;
  const noBox = !box && !outline && "Draw a box around the part first";
  for (const tool of ["in", "out"]) offBecause(document.querySelector(`button[data-tool=${tool}]`), noBox);
  offBecause(by("turn-to-fit"), noBox);
  const onward = document.querySelector("#panel-mark [data-next=samples]");
  offBecause(onward, noBox);
  // Without the grasp, going on is possible but is not the next step.
  onward.classList.toggle("primary", isComplete(image()));
  by("grasp-numbers").hidden = !grasp;
  offBecause(by("propose"), state.proposing ? "The outline is being detected" : noBox);
  by("propose").lastChild.textContent = state.proposing ? "Looking…" : outline ? "Find it again" : "Find it";
  if (!grasp) return;
  const { angle, width, length } = gripperOf(grasp);
  const numbers = { angle: (angle * 180) / Math.PI, width, length };
  for (const [what, input] of Object.entries(inputs)) {
    if (document.activeElement !== input) input.value = Math.round(numbers[what] * 10) / 10;
  }
}

function fix(remedy) {
  if (remedy.jaw_width !== undefined) setGripper({ ...gripperOf(marks().grasp), width: remedy.jaw_width });
  if (remedy.box) marks().box = remedy.box;
  commit();
}

function renderAdvice({ advice }) {
  const list = by("remarks");
  if (!shows(list, advice.remarks)) {
    list.replaceChildren(...advice.remarks.map((remark) => {
      const item = element("li");
      item.dataset.code = remark.code;
      item.append(remark.text);
      if (["gripper_along", "grasp_one_sided"].includes(remark.code)) {
        item.append(button("Turn to fit", turnToFit));
      }
      if (remark.fix) {
        item.append(button(remark.fix.box ? "Fit the box" : "Fit the jaws", () => fix(remark.fix)));
      }
      return item;
    }));
  }
  const enough = by("enough");
  const models = ORDER.map((letter) => advice.models.find((m) => m.model === letter));
  if (shows(enough, models)) return;
  const title = element("h3");
  const ready = models.filter((m) => !m.lacks.length).length;
  title.textContent = ready === models.length ? "Enough for every model" : ready ? "Enough for these models" : `Still needed: ${models[0].lacks.join(" and ")}`;
  if (!ready || ready === models.length) return enough.replaceChildren(title);
  const items = element("ul");
  for (const { model, lacks } of models) {
    items.append(element("li", {
      className: lacks.length ? "" : "ready",
      textContent: lacks.length ? `${model} needs ${lacks.join(" and ")}` : `${model}, ${DOES[model]}`,
    }));
  }
  enough.replaceChildren(title, items);
}

function hint() {
  const { box, grasp, outline } = marks();
  if (state.proposing) return "Detecting the outline…";
  if (state.tool === "box") return "Drag a box around the whole part";
  if (state.tool === "grasp") return "Click where the gripper should hold the part";
  if (state.tool === "outline") {
    const count = state.draft?.points?.length ?? 0;
    return count > 2 ? "Click the first point, or press Enter, to close" : "Click around the part, point by point";
  }
  if (state.tool === "in") return "Click or draw over missing areas of the part";
  if (state.tool === "out") return "Click or draw over areas outside the part: a shadow, the table";
  if (state.selected === "grasp" && grasp) return "Drag between the jaws to move, a jaw to open, an end to turn";
  if (state.selected === "outline" && outline) return "Drag a point, or the line to add one; Del deletes";
  return box || grasp || outline ? "" : "Choose Box to begin";
}

export function renderMarkPanel() {
  renderTools();
  const target = image();
  if (!target) return;
  renderSaved(target);
  renderTodo();
  renderAdvice(target);
  const note = by("note");
  note.hidden = !target.note;
  note.textContent = target.note ?? "";
  if (document.activeElement !== label) label.value = state.label;
  by("naming").hidden = state.isNamed;
}

function renderTools() {
  const marking = isMarking();
  for (const button of document.querySelectorAll("button[data-tool]")) {
    button.setAttribute("aria-pressed", String(button.dataset.tool === state.tool));
  }
  offBecause(by("undo"), !image()?.past.length && "There is nothing to undo");
  offBecause(by("redo"), !image()?.future.length && "There is nothing to redo");
  offBecause(by("delete"), !(state.draft || (state.selected && image()?.marks[state.selected])) && "Select a mark first");
  by("mark-tools").hidden = by("edit-tools").hidden = by("in-out").hidden = !marking;
  by("stage").dataset.tool = marking ? state.tool : "select";
  setText(by("hint"), marking ? hint() : "");
}

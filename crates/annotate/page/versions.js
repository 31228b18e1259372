// The models taught so far: the quality of each, the one in use, and comparisons.

import { api } from "./api.js";
import { button } from "./buttons.js";
import { changed, state } from "./store.js";
import { toast } from "./toast.js";

const by = (id) => document.getElementById(id);
const list = by("version-list");
const percent = (share) => `${Math.round(share * 100)}\u00a0%`;
/** Selected for comparison. */
let chosen = [];

/** The same without intervals and errors, for a list of models. */
function briefFigures({ figures }) {
  if (!figures) return "";
  const { found, wrong, false_alarms: alarms } = figures;
  return `${found[0]} of ${found[1]} found, ${wrong} wrong, ${alarms[0]} of ${alarms[1]} false alarms`;
}

/** The finished model's results on held-back samples, in words. */
export function figuresText({ figures, negatives }) {
  if (!figures) return "";
  const { found, found_interval: [low, high], wrong, false_alarms: alarms, error, error_degrees: degrees, others_in_photo: others } = figures;
  const off = error ? `, off by ${error[0].toFixed(1)}\u00a0${error[1]} and ${degrees.toFixed(1)}° (median)` : "";
  const more = others ? ` ${others} further instances found in the photo were removed from the samples.` : "";
  const said = negatives ? ` It refuses ${negatives.refused} of your ${negatives.pictures} picture${negatives.pictures === 1 ? "" : "s"} without the part.` : "";
  return `On new samples it finds ${found[0]} of ${found[1]} parts (95\u00a0% interval: ${Math.round(100 * low)} to ${percent(high)})${off}; ${wrong} wrong, false alarms in ${alarms[0]} of ${alarms[1]}.${more}${said}`;
}

/** Grade of the result: good, doubtful, or poor. Thresholds chosen by hand: nine of ten, and seven of ten. */
export function gradeOf({ figures }) {
  if (!figures) return "good";
  const found = figures.found[0] / Math.max(figures.found[1], 1);
  const alarms = (figures.false_alarms[0] + figures.wrong) / Math.max(figures.false_alarms[1] + figures.found[1], 1);
  if (found < 0.7 || alarms > 0.2) return "poor";
  return found < 0.9 || alarms > 0.05 ? "doubtful" : "good";
}

async function use(id) {
  try {
    const session = await api.useModel(id);
    Object.assign(state, { models: session.models, region: session.region, hasModel: true });
    for (const trial of [...state.trialPictures, state.live]) trial.detections = null;
    toast("This version is now in use, under the model’s name.");
  } catch (error) {
    toast(error.message);
  }
  changed();
}

async function compare() {
  const [one, other] = chosen;
  const out = by("compared");
  out.textContent = "Looking at all pictures with both…";
  try {
    const rows = await api.compareModels(one, other);
    out.replaceChildren(rows.length ? table(rows) : "There is no picture to try yet: add some in the last step.");
  } catch (error) {
    out.textContent = error.message;
  }
}

function table(rows) {
  const made = document.createElement("table");
  const line = (cells, tag) => {
    const row = made.insertRow();
    for (const cell of cells) row.append(Object.assign(document.createElement(tag), { textContent: cell }));
  };
  const number = (id) => `Model ${id + 1}`;
  line(["Picture", ...chosen.map(number)], "th");
  const words = ([count, best], there) => {
    const right = there === null ? "" : (count > 0) === there ? " ✓" : " ✗";
    return `${count ? `${count} found` : "nothing"}, ${best.toFixed(2)}${right}`;
  };
  for (const row of rows) line([row.name, ...row.found.map((found) => words(found, row.is_there))], "td");
  return made;
}

export function renderVersions() {
  const { models } = state;
  // For the only version, just taught, the result above is enough.
  by("versions").hidden = !models.length || (models.length === 1 && state.teaching.status === "done");
  const wanted = JSON.stringify([models, chosen]);
  if (list.dataset.shown === wanted) return;
  list.dataset.shown = wanted;
  list.replaceChildren(...models.map((model) => {
    const item = document.createElement("li");
    item.className = gradeOf(model.summary);
    const when = new Date(model.taught_secs * 1000).toLocaleString();
    const title = Object.assign(document.createElement("b"), { textContent: `${model.id + 1}: ${model.summary.model}, ${when}` });
    const notes = [];
    if (model.is_current) notes.push(Object.assign(document.createElement("span"), { className: "used", textContent: "in use" }));
    if (model.is_stale) notes.push(Object.assign(document.createElement("span"), { className: "stale", textContent: "stale: photos, marks or pictures without the part have changed since" }));
    const of = `${model.photos} photo${model.photos === 1 ? "" : "s"}${model.negatives ? `, ${model.negatives} without the part` : ""}. `;
    const figures = Object.assign(document.createElement("small"), { textContent: of + briefFigures(model.summary) });
    const row = Object.assign(document.createElement("div"), { className: "row" });
    if (!model.is_current) row.append(button("Use this one", () => use(model.id)));
    if (models.length > 1) {
      const label = Object.assign(document.createElement("label"), { className: "check" });
      const box = Object.assign(document.createElement("input"), { type: "checkbox", checked: chosen.includes(model.id) });
      box.addEventListener("change", () => {
        chosen = box.checked ? [...chosen, model.id].slice(-2) : chosen.filter((id) => id !== model.id);
        changed();
      });
      label.append(box, "Compare");
      row.append(label);
      if (chosen.length === 2 && chosen[1] === model.id) row.append(button("Compare the two", compare));
    }
    item.append(title, ...notes, figures, row);
    return item;
  }));
}

// The models taught so far: the quality of each, the one in use, and comparisons.

import { api } from "./api.js";
import { changeOf, changesText } from "./changes.js";
import { button, by, element, shows } from "./elements.js";
import { isOld, OLD } from "./part_settings.js";
import { adoptModels, changed, isRunning, state } from "./store.js";
import { toast } from "./toast.js";
import { percent, pictures } from "./words.js";

const list = by("version-list");
/** A model whose found share is lower by this or more is worse. */
const MIN_DROP = 0.1;
const GRADES = { doubtful: "doubtful on new samples", poor: "poor on new samples" };
const DIFFERS = { turned: ", ≠ hand turned", moved: ", ≠ hand elsewhere" };
/** The versions selected for comparison, and those of a comparison under way. */
let chosen = [];
let compared = null;

/** The results without intervals and errors, for a list of models. */
function briefFigures({ figures }) {
  if (!figures) return "";
  const { found, wrong, false_alarms: alarms } = figures;
  return `${found[0]} of ${found[1]} found, ${wrong} wrong, ${alarms[0]} of ${alarms[1]} false alarms`;
}

/** The finished model's results on held-out samples, in words. */
export function figuresText({ figures, negatives }) {
  if (!figures) return "";
  const { found, found_interval: [low, high], wrong, false_alarms: alarms, error, error_degrees: degrees, others_in_photo: others } = figures;
  const off = error ? `, off by ${error[0].toFixed(1)}\u00a0${error[1]} and ${degrees.toFixed(1)}° (median)` : "";
  const more = others ? ` ${others} further parts in the photo were removed from the samples.` : "";
  const said = negatives ? ` It refuses ${negatives.refused} of your ${pictures(negatives.pictures)} without the part.` : "";
  return `On new samples it finds ${found[0]} of ${found[1]} parts (95\u00a0% interval: ${Math.round(100 * low)} to ${percent(high)})${off}; ${wrong} wrong, false alarms in ${alarms[0]} of ${alarms[1]}.${more}${said}`;
}

/** Grade of the result: good, doubtful, or poor. The thresholds were chosen by hand. */
export function gradeOf({ figures }) {
  if (!figures) return "good";
  const found = figures.found[0] / Math.max(figures.found[1], 1);
  const alarms = (figures.false_alarms[0] + figures.wrong) / Math.max(figures.false_alarms[1] + figures.found[1], 1);
  if (found < 0.7 || alarms > 0.2) return "poor";
  return found < 0.9 || alarms > 0.05 ? "doubtful" : "good";
}

/** Whether a model's results are clearly worse than another's. */
function isWorse({ figures: now }, { figures: before }) {
  if (!now || !before) return false;
  const share = ({ found: [count, of] }) => count / Math.max(of, 1);
  const isNew = (count) => count(now) > 0 && count(before) === 0;
  return share(before) - share(now) > MIN_DROP - 1e-9 || isNew(({ wrong }) => wrong) || isNew(({ false_alarms: [count] }) => count);
}

/** A warning of marked photos whose grasp points in another direction than that of the first one. */
function turnedText({ figures }) {
  const turned = figures?.turned_photos ?? [];
  if (!turned.length) return "";
  const photos = turned.length === 1 ? `marked photo ${turned[0]}` : `marked photos ${turned.join(", ")}`;
  return `The grasp in ${photos} points in another direction than that in photo 1, so the model turns the hand at random. “Swap ends” turns a grasp; a part that looks the same in both directions needs its symmetry. `;
}

/** Warnings, in both steps that show a new model: it is worse than the one that was in use before it, or its photos contradict each other. */
function renderWorse() {
  const now = state.models.at(-1);
  const before = state.replaced ?? state.models.at(-2);
  const isShown = Boolean(now) && now.is_current && !isRunning();
  const isLess = isShown && Boolean(before) && isWorse(now.summary, before.summary);
  const worse = isLess ? `${number(now.id)} is worse on new samples than ${number(before.id)}: ${briefFigures(now.summary)}, before: ${briefFigures(before.summary)}. ` : "";
  const text = isShown ? turnedText(now.summary) + worse : "";
  for (const place of document.querySelectorAll(".worse")) {
    place.hidden = !text;
    if (shows(place, text)) continue;
    place.replaceChildren(text, ...(isLess ? [button(`Use ${number(before.id)} again`, () => use(before.id))] : []));
  }
}

const number = (id) => `Model ${id + 1}`;

async function use(id) {
  try {
    adoptModels(await api.useModel(id));
    toast("This version is now in use.");
  } catch (error) {
    toast(error.message);
  }
  changed();
}

async function compare() {
  // Asked for again while it is under way.
  if (String(compared) === String(chosen)) return;
  const pair = (compared = chosen);
  const out = by("compared");
  out.textContent = "Looking at all pictures with both…";
  try {
    const rows = await api.compareModels(...pair);
    // Another comparison has begun in the meantime.
    if (pair !== compared) return;
    if (!rows.length) out.textContent = "There is no picture to try yet: add some in the last step.";
    else {
      const turns = state.models[Math.max(...pair)].symmetry ?? 1;
      const known = rows.filter(({ found }) => found);
      for (const row of known) row.change = changeOf(...row.found.map(({ accepted }) => accepted), turns, row.is_there === false);
      const failed = rows.length - known.length;
      const text = known.length ? changesText(known) + (failed ? ` ${pictures(failed)} could not be compared.` : "") : "";
      out.replaceChildren(element("p", { textContent: text }), table(rows, pair));
    }
  } catch (error) {
    if (pair === compared) out.textContent = error.message;
  }
  if (pair === compared) compared = null;
}

function table(rows, pair) {
  const made = element("table");
  const line = (cells, tag) => {
    const row = made.insertRow();
    for (const cell of cells) row.append(element(tag, { textContent: cell }));
  };
  line(["Picture", ...pair.map(number)], "th");
  const words = ({ accepted: { length }, best }, there) => {
    const right = there === null ? "" : length > 0 === there ? " ✓" : " ✗";
    return `${length ? `${length} found` : "nothing"}, ${best.toFixed(2)}${right}`;
  };
  for (const { name, found, failed, change, is_there: isThere } of rows) {
    if (!found) {
      line([name, `not comparable: ${failed}`], "td");
      continue;
    }
    // It is not known which of two different grasps is right.
    const differs = DIFFERS[change] ?? "";
    const [one, other] = found.map((each) => words(each, differs ? null : isThere));
    line([name, one, other + differs], "td");
  }
  return made;
}

export function renderVersions() {
  const { models } = state;
  renderWorse();
  // For the only version, just taught, the result above is enough.
  by("versions").hidden = !models.length || (models.length === 1 && state.teaching.status === "done");
  if (shows(list, [models, chosen, models.map(isOld)])) return;
  list.replaceChildren(...models.map((model) => {
    const item = element("li");
    const grade = gradeOf(model.summary);
    item.className = grade;
    const when = new Date(model.taught_secs * 1000).toLocaleString();
    const title = element("b", { textContent: `${model.id + 1}: ${model.summary.model}, ${when}` });
    const notes = [];
    if (model.is_current) notes.push(element("span", { className: "used", textContent: "in use" }));
    const warning = (textContent) => notes.push(element("span", { className: "stale", textContent }));
    if (GRADES[grade]) warning(GRADES[grade]);
    if (isOld(model)) warning(`stale: ${OLD}`);
    const of = `${model.photos} photo${model.photos === 1 ? "" : "s"}${model.negatives ? `, ${model.negatives} without the part` : ""}. `;
    const figures = element("small", { textContent: of + briefFigures(model.summary) });
    const row = element("div", { className: "row" });
    if (!model.is_current) row.append(button("Use this one", () => use(model.id)));
    if (models.length > 1) {
      const label = element("label", { className: "check" });
      const box = element("input", { type: "checkbox", checked: chosen.includes(model.id) });
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

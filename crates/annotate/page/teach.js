// The third step: teaching, and its progress.

import { api } from "./api.js";
import { by, element, offBecause, setText, wait } from "./elements.js";
import { isOld, OLD, partSettings } from "./part_settings.js";
import { adoptModels, changed, currentModel, image, isComplete, isRunning, state } from "./store.js";
import { turnsOf } from "./symmetry.js";
import { toast } from "./toast.js";
import { figuresText, gradeOf } from "./versions.js";
import { listText, percent, seconds } from "./words.js";

const POLL_MS = 400;
const MODELS = [
  ["C", "Keypoints (recommended)", "The best all-round. Half a minute to four minutes."],
  ["S", "Shape", "Ready in seconds; weaker when partly hidden."],
  ["A", "Crop", "Turn from a crop. Longer than C."],
  ["B", "Box", "As C, at the box’s middle."],
  ["D", "Mask", "Needs the outline. Longer than C."],
];

/** Number of turns in which a part looks the same, each with an example. */
const SHAPES = [
  ["1", "No", '<path d="M3 8h11l5 4-5 4H3z"/>'],
  ["2", "Half a turn: bar", '<path d="M2 8.5h20v7H2z"/>'],
  ["3", "A third", '<path d="m12 3 9 16H3z"/>'],
  ["4", "A quarter: square", '<path d="M4 4h16v16H4z"/>'],
  ["6", "A sixth: bolt head", '<path d="M7.5 4h9L21 12l-4.5 8h-9L3 12z"/>'],
  ["0", "Any turn: washer", '<path d="M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18m0 5a4 4 0 1 1 0 8 4 4 0 0 1 0-8" fill-rule="evenodd"/>'],
];
for (const [value, name, shape] of SHAPES) {
  const item = element("label");
  item.innerHTML = `<input type="radio" name="symmetry" value="${value}"><svg viewBox="0 0 24 24" aria-hidden="true">${shape}</svg><span></span>`;
  item.lastChild.textContent = name;
  item.firstChild.checked = value === "1";
  by("symmetry-choice").append(item);
}

for (const [letter, name, says] of MODELS) {
  const item = element("label", { className: "model" });
  item.innerHTML = `<input type="radio" name="model" value="${letter}"><span><b>${letter}</b> ${name}</span><small></small>`;
  item.lastChild.textContent = says;
  item.firstChild.checked = letter === "C";
  if (letter === "C") by("models").insertBefore(item, by("other-models"));
  else by("other-models").append(item);
}

/** Whether the model in use is taught in seconds: it then learns at once from confirmed detections. */
export const isQuick = () => currentModel()?.summary.model === "S" && !isRunning();

by("teach-form").addEventListener("submit", (event) => {
  event.preventDefault();
  teach();
});

/** The settings in the form. */
export function teachRequest() {
  preselect();
  preselected = true;
  const number = (id) => (by(id).value === "" ? null : by(id).valueAsNumber);
  const minutes = number("budget");
  return {
    // Without the marks that it needs, the model stays chosen and the server refuses.
    model: chosen("model").value,
    time_budget_secs: minutes === null ? null : minutes * 60,
    steps: number("steps"),
    ...partSettings(),
    seed: number("seed") ?? 1,
  };
}

/** Teaches as the form says, except for the settings in `own`. */
export async function teach(own = {}) {
  if (isRunning()) return;
  const request = { ...teachRequest(), ...own };
  by("teach-error").hidden = true;
  try {
    state.teaching = await api.teach(request);
    document.querySelector(".panel").scrollTop = 0;
    watch();
  } catch (error) {
    state.teaching = { ...state.teaching, status: "failed", error: error.message };
    if (state.tab !== "teach") toast(error.message);
  }
  changed();
}

by("teach-stop").addEventListener("click", async () => {
  state.teaching = await api.stopTeaching().catch(() => state.teaching);
  changed();
});

/** Requests progress until the teaching has ended. */
export async function watch() {
  while (isRunning()) {
    await wait(POLL_MS);
    try {
      const news = await api.teaching();
      // Nothing is shown between the end of the teaching and its model: results of the model before would be taken for the new one's.
      const session = news.status === "done" ? await api.session().catch(() => state) : state;
      if (news.status === "failed" && isRunning() && state.tab !== "teach") toast(news.error);
      state.teaching = news;
      adoptModels(session);
    } catch (error) {
      if (!error.lost) toast(error.message);
    }
    changed();
  }
}

/** Follows a teaching that another page has started, or adopts its end. */
export function follow(news) {
  if (isRunning() || news.elapsed_secs === state.teaching.elapsed_secs || !/running|done/.test(news.status)) return;
  state.teaching = { ...news, status: "running" };
  watch();
}

/** What a model is or was taught from, in words. */
function materialText(photos, negatives) {
  const without = negatives ? ` and ${negatives === 1 ? "a picture" : `${negatives} pictures`} without it` : "";
  return `From ${photos === 1 ? "the marked photo" : `${photos} marked photos`}${without}.`;
}

/** The progress of the teaching, in words. */
export function progressText() {
  const { planned, done, elapsed_secs: gone, left_secs: left } = state.teaching;
  if (!planned) return isRunning() ? "Getting ready…" : "";
  return `Step ${done} of ${planned}, ${seconds(gone)} gone${left === null || !isRunning() ? "" : `, about ${seconds(left)} left`}`;
}

function renderCurve(losses) {
  const curve = by("curve");
  by("curve-figure").hidden = losses.length < 2;
  if (losses.length < 2) return;
  const logs = losses.map(([step, loss]) => [step, Math.log(Math.max(loss, 1e-6))]);
  const [least, most] = [Math.min(...logs.map((p) => p[1])), Math.max(...logs.map((p) => p[1]))];
  const last = Math.max(state.teaching.planned, logs.at(-1)[0]);
  const at = ([step, log]) => `${((step / last) * 340).toFixed(1)},${(8 + ((most - log) / (most - least || 1)) * 104).toFixed(1)}`;
  curve.innerHTML = `<polyline points="${logs.map(at).join(" ")}"/>`;
}

function renderProgress(news) {
  by("progress").hidden = news.status === "idle" || news.model === "S" && !isRunning();
  by("progress-title").textContent = {
    running: `Teaching ${news.of || `model ${news.model}`}`,
    stopping: "Stopping; the result so far is kept…",
    done: `Taught model ${news.model}`,
    failed: "Not taught",
  }[news.status] ?? "";
  by("progress-bar").value = news.planned ? news.done / news.planned : 0;
  by("progress-bar").hidden = !isRunning();
  by("progress-text").textContent = progressText();
  by("teach-form").hidden = isRunning();
  by("teach-stop").hidden = !isRunning();
  // Before the first usable result there is nothing to keep.
  const keeps = news.validations.some(([, share]) => share >= 0.5);
  by("teach-stop").textContent = keeps ? "Stop and keep the result so far" : "Stop; nothing is kept yet";
  by("teach-stop").disabled = news.status === "stopping";
  renderCurve(news.losses);
  by("validations").replaceChildren(...news.validations.map(([step, share]) => element("li", {
    textContent: `After ${step} steps the network alone finds ${percent(share)} of new samples`,
  })));
}

function renderOutcome(news) {
  const { summary } = news;
  const outcome = by("teach-outcome");
  const grade = news.status === "done" ? gradeOf(summary) : "";
  for (const name of ["good", "doubtful", "poor"]) outcome.classList.toggle(name, name === grade);
  let text = "";
  if (news.status === "done" && summary) {
    const better = grade === "good" ? "" : " Your own pictures teach it better.";
    text = `Taught “${summary.object}” in ${seconds(summary.seconds)}. ${figuresText(summary)}${better} Written to ${news.written_to}`;
  }
  setText(outcome, text);
  by("teach-error").hidden = news.status !== "failed";
  by("teach-error").textContent = news.error ?? "";
  const hasChanged = news.status === "done" && isOld(state.models.at(-1));
  outcome.classList.toggle("outdated", hasChanged);
  by("teach-old").hidden = !hasChanged;
  setText(by("teach-old"), hasChanged ? `This result is old: ${OLD}. Teach again.` : "");
  by("go-try").hidden = news.status !== "done";
  by("go-try").classList.toggle("primary", !hasChanged);
  by("teach-start").classList.toggle("primary", news.status !== "done" || hasChanged);
}

const chosen = (name) => document.querySelector(`[name=${name}]:checked`);

/** A closed section shows its content in its title; the symmetry question is opened if the outline looks symmetric. */
let [measured, turns, asked] = [null, 1, 1];
function renderFolds() {
  const model = MODELS.find(([letter]) => letter === chosen("model").value);
  const other = model[0] === "C" ? "Other models" : `Other models: ${model[0]} ${model[1]} is chosen`;
  const [, shape] = SHAPES.find(([value]) => value === chosen("symmetry").value);
  by("other-models").firstElementChild.textContent = other;
  by("symmetry").firstElementChild.textContent = `Looks the same when turned? ${shape}`;
  by("fixed-height-choice").hidden = state.isCalibrated;
  const outline = image()?.marks.outline ?? null;
  if (outline !== measured) [measured, turns] = [outline, turnsOf(outline)];
  if (turns === asked) return;
  asked = turns;
  const words = SHAPES.find(([value]) => value === String(turns))[1];
  by("symmetry-why").hidden = turns === 1;
  by("symmetry-why").textContent = turns === 1 ? "" : `The outline looks like “${words}”. If the whole part does, choose it.`;
  by("symmetry").open = turns !== 1;
}
by("teach-form").addEventListener("change", changed);

/** Whether the model in use and its settings of the part were selected in the form. */
let preselected = false;
function preselect() {
  const last = currentModel() ?? state.models.at(-1);
  if (preselected || !last) return;
  preselected = true;
  for (const [name, value] of [["model", last.summary.model], ["symmetry", last.symmetry]]) {
    const input = document.querySelector(`[name=${name}][value="${value}"]`);
    if (input) input.checked = true;
  }
  by("fixed-height").checked = Boolean(last.fixed_height);
}

export function renderTeach() {
  preselect();
  const news = state.teaching;
  const marked = state.images.filter(isComplete);
  const negatives = state.trialPictures.filter((trial) => trial.is_absent).length;
  by("teach-from").textContent = isRunning()
    ? news.photos ? materialText(news.photos, news.negatives) : ""
    : marked.length ? materialText(marked.length, negatives) : `${state.images.length ? "Mark the part on a photo first" : "Take a photo of the part first and mark it"}: box and grasp.`;
  for (const input of document.querySelectorAll("[name=model]")) {
    const lacks = image()?.advice.models.find((m) => m.model === input.value).lacks ?? [];
    const needsOutline = input.value === "D" && marked.some((i) => !i.marks.outline);
    const reason = needsOutline ? "Needs the outline on every marked photo" : !marked.length && lacks.length && `Needs ${listText(lacks)}`;
    offBecause(input, reason);
    input.closest("label").title = reason || "";
  }
  const start = by("teach-start");
  offBecause(start, !marked.length && "Mark box and grasp on a photo first");
  start.textContent = news.status === "done" ? "Teach again" : "Teach";
  renderFolds();
  renderProgress(news);
  renderOutcome(news);
}

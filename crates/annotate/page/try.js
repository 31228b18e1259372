// The fourth step: the taught model on other pictures. Confirmed or corrected detections become demonstrations.

import { api, present } from "./api.js";
import { button, by, element, setText, shows } from "./elements.js";
import { uploadPhoto } from "./folder.js";
import { textOf } from "./editing.js";
import { changeOf, changesText } from "./changes.js";
import { boundsOf } from "./geometry.js";
import { renderHelps } from "./helps.js";
import { foundTitle, placeText, touchText } from "./live.js";
import { MIN_SHOWN, numbered } from "./overlay.js";
import { exportPictures } from "./export.js";
import { isOld, OLD } from "./part_settings.js";
import { adoptPhoto, adoptTrial, openImage, openTrialPicture, removeTrialPicture } from "./strip.js";
import { adoptModels, changed, currentModel, isAccepted, isFound, isLive, isRunning, isWaiting, MODEL_LIMIT, state, trialPicture } from "./store.js";
import { openTab } from "./tabs.js";
import { isQuick, progressText, teach } from "./teach.js";
import { toast } from "./toast.js";
import { showBox } from "./view.js";
import { byName, listText, PICTURE } from "./words.js";

const stage = by("stage");
/** With fewer pictures the order does not matter. */
const MIN_SORTED = 5;
const isTaught = () => Boolean(state.hasModel);

by("add-pictures").addEventListener("click", () => by("picture-input").click());
by("add-folder").addEventListener("click", () => by("folder-input").click());
for (const id of ["picture-input", "folder-input"]) {
  by(id).addEventListener("change", () => {
    // The list is copied, because it is cleared with the field. A cleared field accepts the same files again.
    const files = [...by(id).files];
    by(id).value = "";
    addPictures(files);
  });
}

for (const kind of ["dragover", "dragleave", "drop"]) {
  stage.addEventListener(kind, (event) => {
    event.preventDefault();
    stage.classList.toggle("dropping", kind === "dragover");
    if (kind !== "drop") return;
    const files = [...event.dataTransfer.files];
    if (files.length && state.tab === "mark" && !state.images.length && !state.camera) uploadPhoto(files[0]);
    else if (files.length) {
      openTab("try");
      addPictures(files);
    }
  });
}

by("least-score").addEventListener("input", () => {
  state.minScore = by("least-score").valueAsNumber;
  changed();
});
by("least-score-back").textContent = `Back to ${MODEL_LIMIT.toFixed(2)}`;
by("least-score-back").addEventListener("click", () => {
  state.minScore = by("least-score").valueAsNumber = MODEL_LIMIT;
  // The button disappears.
  by("least-score").focus();
  changed();
});
by("sort-pictures").addEventListener("change", () => {
  state.sortedBy = by("sort-pictures").value;
  changed();
});
by("show-differences").addEventListener("change", () => {
  state.showDifferences = by("show-differences").checked;
  changed();
});

async function addPictures(files) {
  const pictures = files.filter((file) => PICTURE.test(file.name)).sort(byName);
  const problem = by("try-error");
  problem.hidden = true;
  if (!pictures.length) {
    problem.hidden = false;
    problem.textContent = "There was no picture among them that can be read: PNG, JPEG, WebP, BMP or TIFF.";
    return;
  }
  if (pictures.length < files.length) toast(`${files.length - pictures.length} files are left out: no pictures that can be read.`);
  const first = state.trialPictures.length;
  const errors = [];
  for (const file of pictures) {
    try {
      adoptTrial(await api.addTrialPicture(file));
      changed();
    } catch (error) {
      errors.push(error.message);
      if (error.lost) break;
    }
  }
  problem.hidden = !errors.length;
  problem.textContent = listText(errors, 3);
  if (state.trialPictures.length > first) openTrialPicture(first);
}

/** Searches every picture that was not searched yet, the shown one first. */
let looking = false;
async function lookAtAll() {
  if (looking || !isTaught()) return;
  looking = true;
  for (;;) {
    const next = [trialPicture(), ...state.trialPictures].find((trial) => trial && isWaiting(trial));
    if (!next || state.tab !== "try") break;
    const { generation } = state;
    next.detecting = true;
    changed();
    const answer = await api.detect(next.id).catch((error) => (error.lost ? {} : { failed: error.message }));
    // After a change of the model or the region in the meantime, or without a server, this picture is searched again.
    if (generation === state.generation) Object.assign(next, answer);
    next.detecting = false;
    changed();
    await present();
  }
  looking = false;
}

async function accept(marks, { correct }) {
  const target = trialPicture();
  try {
    const view = await api.accept(target.id, marks);
    const index = adoptPhoto(view);
    target.became = view.id;
    // The picture may have kept other marks than those shown; they are not taught unseen.
    const isOther = textOf(view.marks) !== textOf(marks);
    if (correct || isOther) {
      openTab("mark");
      openImage(index);
      toast((isOther && view.note) || "Correct the marks; they are saved as you go.");
    } else if (isQuick()) teach({ model: "S" });
    else toast(view.note ?? "Now a demonstration. Teach again to learn from it.");
  } catch (error) {
    toast(error.message);
  }
  changed();
}

/** The effect of the last teaching on the pictures that were tried before it. */
function renderLearnt() {
  const known = isRunning() ? [] : state.trialPictures.filter(({ before, failed }) => before && !failed);
  const again = known.filter(({ detections }) => detections);
  let [text, isGood] = ["", true];
  if (again.length < known.length) text = `The new model looks at the pictures again: ${again.length} of ${known.length}…`;
  else if (known.length) {
    const turns = currentModel()?.symmetry ?? 1;
    const marksOf = (detections) => detections.filter(isFound).map(({ marks }) => marks);
    const changes = known.map((trial) => ({ name: trial.name, change: changeOf(marksOf(trial.before), marksOf(trial.detections), turns, trial.is_absent) }));
    const there = known.filter((trial) => !trial.is_absent);
    const [was, is] = ["before", "detections"].map((which) => there.filter((trial) => trial[which].some(isFound)).length);
    if (there.length) text = `The new model finds the part in ${is} of ${there.length} pictures; the one before: in ${was}. `;
    text += changesText(changes);
    isGood = changes.every(({ change }) => /null|more|calm/.test(change));
  }
  by("learnt").hidden = !text;
  by("learnt").className = isGood ? "learnt" : "warning";
  setText(by("learnt"), text);
}

by("save-csv").addEventListener("click", () => exportPictures("csv"));
by("save-json").addEventListener("click", () => exportPictures("json"));

/** A button that teaches with the same settings and the new pictures, and shows the progress. */
function teachButton() {
  return button(isRunning() ? "Show the teaching" : "Teach again", () => {
    openTab("teach");
    by("tab-teach").focus();
    teach();
  }, isRunning() ? "" : "primary");
}

/** States that the part is not in this picture, or revokes the statement. */
async function setAbsent(target, absent) {
  try {
    Object.assign(target, await api.setAbsent(target.id, absent));
    adoptModels(await api.session());
    toast(absent ? "Kept as a picture without the part. Teach again to learn from it." : "No longer used as a picture without the part.");
  } catch (error) {
    toast(error.message);
  }
  changed();
}

function text(tag, content, classes = "") {
  return element(tag, { textContent: content, className: classes });
}

function card(detection, i, listed, shown) {
  const count = listed.length;
  const item = element("section", { className: "found" });
  item.setAttribute("aria-label", `Grasp ${i + 1}`);
  const isSure = isAccepted(detection);
  const isWrong = shown.is_absent && isFound(detection);
  const title = text("h3", numbered(isWrong ? "Wrongly found" : foundTitle(detection), i, count));
  title.append(text("span", `score ${detection.score.toFixed(2)}`, "score"));
  const row = text("div", "", "row");
  const isOpen = shown.became === null && !shown.is_absent;
  if (isOpen) {
    const words = isSure ? "Right: learn from it" : "Right after all: learn from it";
    row.append(button(words, () => accept(detection.marks, { correct: false })));
    row.append(button("Correct it…", () => accept(detection.marks, { correct: true }), "plain"));
  }
  item.append(title);
  const refusal = isSure ? null : detection.refusal;
  item.append(text("p", placeText(detection), "pose"));
  const touching = touchText(detection, shown.detections, listed);
  if (touching) item.append(text("p", touching, "warning"));
  if (!isFound(detection) && !refusal) item.append(text("p", "Why: its score is below the minimum.", "why"));
  if (refusal) {
    item.append(text("p", `Why: ${refusal.reason}.`, "why"));
    if (refusal.remedy && isOpen) item.append(text("p", `What would help: ${refusal.remedy}.`));
    if (state.showDifferences && (refusal.edges.length || refusal.surface.length)) {
      const legend = text("p", "On the picture: ", "legend");
      if (refusal.edges.length) legend.append(text("span", "edges differ", "edges"), " ");
      if (refusal.surface.length) legend.append(text("span", "surface differs", "surface"));
      item.append(legend);
    }
  }
  if (isOpen && detection.cut) item.append(text("p", detection.cut, "warning"));
  const { outline, box } = detection.marks;
  row.append(button("Zoom to it", () => {
    showBox(outline ? boundsOf(outline) : box);
    stage.scrollIntoView({ block: "nearest" });
  }, "plain"));
  item.append(row);
  return item;
}

function renderFound() {
  const found = by("found");
  const shown = isLive() ? null : trialPicture();
  const wanted = [shown?.id, shown?.detections, shown?.detecting, shown?.failed, shown?.became, shown?.is_absent, state.showRefused, state.minScore, state.showDifferences, isTaught(), isRunning()];
  if (shows(found, wanted)) return;
  found.replaceChildren();
  if (!shown) return;
  const remove = button("Remove this picture", () => removeTrialPicture(shown), "plain");
  if (!isTaught()) return found.append(remove);
  if (!shown.detections) return found.append(text("p", shown.failed ?? "Looking…", shown.failed ? "error" : ""), remove);
  const accepted = shown.detections.filter(isAccepted);
  const refused = shown.detections.length - accepted.length;
  const time = `Search took ${Math.max(1, Math.round(shown.seconds * 1000))} ms. `;
  found.append(text("p", time + (accepted.length ? "" : "Nothing is accepted.")));
  if (shown.is_absent) {
    found.append(text("p", "You said that the part is not here: the next teaching uses this picture.", "note"),
      button("The part is here after all", () => setAbsent(shown, false), "plain"));
  }
  const listed = shown.detections.filter((d) => isFound(d) || isShown(d, shown));
  listed.forEach((detection, i) => found.append(card(detection, i, listed, shown)));
  if (shown.became !== null) {
    const index = state.images.findIndex((image) => image.id === shown.became);
    found.append(text("p", `Now a demonstration: ${state.images[index]?.name}.`), button("Look at its marks", () => {
      openTab("mark");
      openImage(index);
    }), teachButton());
  } else if (!shown.is_absent) {
    found.append(button("The part is not here", () => setAbsent(shown, true), accepted.length ? "" : "plain"));
  }
  if (shown.became === null && !shown.is_absent && !accepted.length) {
    const nothing = { box: null, grasp: null, outline: null };
    found.append(text("p", "If the part is there, mark it: it then learns from this picture, too."), button("Mark it by hand…", () => accept(nothing, { correct: true })));
  }
  if (shown.is_absent) found.append(teachButton());
  found.append(remove);
  const more = shown.detections.filter((d) => !isFound(d) && (state.showRefused || !isShown(d, shown))).length;
  if (refused && (more || state.showRefused)) {
    const words = state.showRefused ? "Hide refused parts" : `Show refused parts (${more})`;
    found.append(button(words, () => {
      state.showRefused = !state.showRefused;
      changed();
    }, "plain"));
  }
}

/** Whether a refused detection is shown: by default only the best one, if nothing is accepted and its score is high enough. */
export function isShown(detection, { detections }) {
  if (state.showRefused) return true;
  return detection === detections[0] && detection.score >= MIN_SHOWN;
}

/** The minimum score, and the resulting counts. */
function renderJudge() {
  const looked = state.trialPictures.filter((trial) => trial.detections);
  by("judge").hidden = !isTaught() || !(looked.length || state.camera);
  const least = state.minScore.toFixed(2);
  by("least-score-value").textContent = least;
  const places = looked.flatMap((trial) => trial.detections);
  const [above, sure] = [isFound, isAccepted].map((which) => places.filter(which).length);
  const isLow = state.minScore < MODEL_LIMIT;
  const inPictures = looked.filter((trial) => trial.detections.some(isFound)).length;
  // In live pictures, tracked parts are judged by their track: --min-score then requires --every-frame.
  const ofLive = state.camera ? `; with --from also --every-frame` : "";
  by("least-score-back").hidden = state.minScore === MODEL_LIMIT;
  const beyond = state.minScore === MODEL_LIMIT ? "" : ` For “sdg detect”: --min-score ${least}${ofLive}.`;
  const all = state.trialPictures.length;
  const counted = `${isLow ? `Above ${least}:` : "Found"} ${above} of ${places.length} candidates${isLow ? "" : ` at ${least}`}, in ${inPictures} of ${looked.length} pictures`;
  const left = state.trialPictures.filter(isWaiting).length;
  const waiting = left ? ` (${left} are still looked at)` : "";
  const low = isLow ? ` ${sure} of them reach${sure === 1 ? "es" : ""} the model’s limit of ${MODEL_LIMIT.toFixed(2)}; those below it are often wrong.` : "";
  by("least-score-count").classList.toggle("warning", isLow);
  setText(by("least-score-count"), looked.length ? `${counted}${waiting}.${low}${beyond}` : beyond.trim());
  by("looked").hidden = !left || all < 2;
  Object.assign(by("looked"), { max: Math.max(all, 1), value: all - left });
  by("export").hidden = !looked.length;
  by("sort-choice").hidden = all < MIN_SORTED;
  const differs = ({ refusal }) => refusal && (refusal.edges.length || refusal.surface.length);
  by("differences-choice").hidden = isLive() || !trialPicture()?.detections?.some((d) => !isAccepted(d) && differs(d));
}

function introText() {
  if (isRunning()) return `A model is being taught (${progressText()}). ${isTaught() ? "Until then, the one before is used." : "Pictures can be added already."}`;
  if (!isTaught()) return "Nothing is taught yet. Teach a model first; pictures can be added already.";
  if (!state.trialPictures.length) return "Add pictures that were taken as the first one was, with the part lying in other ways.";
  return isOld(currentModel()) ? `This model is old: ${OLD}. Teach again to use them.` : "";
}

export function renderTry() {
  if (state.teaching.status === "done") state.hasModel = true;
  if (state.tab !== "try") return;
  by("try-intro").textContent = introText();
  by("try-intro").hidden = !by("try-intro").textContent;
  renderJudge();
  renderLearnt();
  renderHelps();
  renderFound();
  lookAtAll();
}


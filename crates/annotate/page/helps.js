// After the first refusals: which of the refused pictures would help most in the other pictures, if the model learnt from it.
//
// For each of the few best candidates a trial model is taught, and the other pictures are searched with it. This is
// done with model S only, which is taught in a second. Only the user knows whether the part is where it was refused.

import { api } from "./api.js";
import { button, by, shows } from "./elements.js";
import { currentModel, isFound, isLive, isWaiting, state, trialPicture } from "./store.js";
import { openTrialPicture } from "./strip.js";
import { isQuick, teachRequest } from "./teach.js";

/** Below this score nothing resembles the part. Equal to MIN_ADVISED_SCORE in crates/cell/src/words.rs. */
const MIN_LIKE = 0.03;
const MAX_CANDIDATES = 3;
const MAX_OTHERS = 8;
/** After this time no further candidate is begun. */
const MAX_MS = 6000;

const best = ({ detections }) => detections[0]?.score ?? 0;

/** The candidates and other pictures; null if there are none, or if not all pictures are searched yet. */
function question() {
  if (state.tab !== "try" || isLive() || !isQuick()) return null;
  const { trialPictures } = state;
  if (trialPictures.some(isWaiting)) return null;
  const refused = trialPictures.filter((t) => t.detections && t.became === null && !t.is_absent && !t.detections.some(isFound));
  const candidates = refused.filter((t) => best(t) >= MIN_LIKE).sort((a, b) => best(b) - best(a)).slice(0, MAX_CANDIDATES);
  if (!candidates.length || refused.length < 2) return null;
  const key = JSON.stringify([currentModel().id, candidates.map(({ id }) => id), refused.map(({ id }) => id)]);
  return { key, candidates, refused };
}

/** The query that is or was answered; for each candidate the best score in each of the other pictures. */
let [asked, answers, isDone, isAsking] = ["", [], true, false];

async function ask({ key, candidates, refused }) {
  [asked, answers, isDone, isAsking] = [key, [], false, true];
  const start = performance.now();
  for (const candidate of candidates) {
    const others = refused.filter((trial) => trial !== candidate).slice(0, MAX_OTHERS).map(({ id }) => id);
    try {
      const scores = await api.wouldHelp(candidate.id, { teaching: { ...teachRequest(), model: "S" }, marks: candidate.detections[0].marks, others });
      if (!scores) break;
      answers.push({ candidate, scores: scores.map(([, score]) => score) });
    } catch {
      // Marks unsuitable for teaching: this candidate is skipped.
    }
    if (performance.now() - start > MAX_MS || question()?.key !== key) break;
  }
  [isDone, isAsking] = [true, false];
  renderHelps();
}

/** The text, and the picture that it is about. */
function answer() {
  if (!isDone) return { text: "Trying which of the refused pictures would help most…" };
  const counted = answers.map(({ candidate, scores }) => ({ candidate, count: scores.filter((score) => score >= state.minScore).length, of: scores.length }));
  const most = counted.reduce((a, b) => (b.count > (a?.count ?? -1) ? b : a), null);
  if (!most) return { text: "" };
  const { candidate, count, of } = most;
  const others = of === 1 ? "the other picture in which it is refused" : `${count} of ${of < MAX_OTHERS ? "the " : ""}${of} other pictures in which it is refused`;
  if (!count) return { text: "Learning from one of the refused pictures alone would not help in the others." };
  const text = `${candidate.name} would help most: if the part is where it was refused there, and the model learns from it, the part is found in ${others}.`;
  return { text, candidate };
}

/** Sends each query once, and shows its result. */
export function renderHelps() {
  const now = question();
  if (now && now.key !== asked && !isAsking) ask(now);
  const { text, candidate } = now && now.key === asked ? answer() : { text: "" };
  const helps = by("helps");
  helps.hidden = !text;
  const isElsewhere = Boolean(candidate) && candidate !== trialPicture();
  if (shows(helps, [text, isElsewhere])) return;
  helps.replaceChildren(text);
  if (isElsewhere) helps.append(" ", button("Look at it", () => openTrialPicture(state.trialPictures.indexOf(candidate)), "plain"));
}

// The server's end: a banner says so, the picture stays, and marks wait in the browser until the server is back.

import { api, onLoss } from "./api.js";
import { adopt, save } from "./editing.js";
import { changed, state } from "./store.js";
import { toast } from "./toast.js";

const banner = document.getElementById("lost");
/** Between questions whether the server is there: while it answers, and while it does not. */
const BEAT_MS = 3000;
const RETRY_MS = 1500;
const KEPT = "kept-marks";

/** Marks that the server has not got, by the photo's name. */
function keep() {
  const kept = {};
  for (const target of state.images) {
    if (target.saving || target.saved.lost) kept[target.name] = { was: target.sent, marks: target.marks };
  }
  if (Object.keys(kept).length) localStorage.setItem(KEPT, JSON.stringify({ project: state.project, kept }));
}

onLoss((lost) => {
  banner.hidden = !lost;
  banner.textContent = lost === "key"
    ? "sdg annotate was started again with another key. Open the address that it printed; the marks made since are kept in this browser. (--token-file FILE with --port keeps the key.)"
    : "sdg annotate has ended, or does not answer. The photo stays and you can go on marking: marks are kept in this browser and sent when it is back.";
  document.documentElement.toggleAttribute("data-lost", Boolean(lost));
  if (lost) keep();
  else if (state.images.length) meetAgain();
});

/** A server that was started anew has numbered its pictures anew. */
async function meetAgain() {
  try {
    const session = await api.session();
    for (const view of session.images) {
      const known = state.images.find((image) => image.name === view.name);
      if (known) Object.assign(known, { id: view.id, advice: view.advice });
      else state.images.push(adopt(view));
    }
    for (const trial of state.trialPictures) {
      const view = session.trial_pictures.find((other) => other.name === trial.name);
      if (view) Object.assign(trial, view);
    }
    state.models = session.models;
    toast("sdg annotate answers again.");
  } catch {
    // The next beat asks again.
  }
  changed();
}

/** Marks that were kept when the page was closed or loaded again without a server. */
export function sendKept(project) {
  const text = localStorage.getItem(KEPT);
  localStorage.removeItem(KEPT);
  if (!text) return;
  const { project: of, kept } = JSON.parse(text);
  if (of !== project) return;
  let count = 0;
  for (const [name, { was, marks }] of Object.entries(kept)) {
    const target = state.images.find((image) => image.name === name);
    // What was changed elsewhere since is not overwritten.
    if (!target || target.committed !== was || JSON.stringify(marks) === was) continue;
    target.past.push(target.committed);
    Object.assign(target, { marks, committed: JSON.stringify(marks) });
    save(target);
    count += 1;
  }
  if (count) toast(`Marks on ${count === 1 ? "a photo" : `${count} photos`} that were kept in this browser are saved now.`);
}

window.addEventListener("pagehide", () => document.documentElement.hasAttribute("data-lost") && keep());

export async function beat() {
  for (;;) {
    const lost = document.documentElement.hasAttribute("data-lost");
    await new Promise((resolve) => setTimeout(resolve, lost ? RETRY_MS : BEAT_MS));
    if (!document.hidden || lost) await api.teaching().catch(() => null);
    if (lost && document.documentElement.hasAttribute("data-lost")) keep();
  }
}

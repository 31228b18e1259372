// Loss of the server: a banner reports it, the picture stays, and marks are kept in the browser until the server is
// back.

import { api, belongTo, isLost, onLoss, setLost } from "./api.js";
import { adoptChange, save, textOf } from "./editing.js";
import { by, stored, wait } from "./elements.js";
import { changed, image, state, trialPicture } from "./store.js";
import { adoptSession, drop, openImage, showCurrent } from "./strip.js";
import { follow } from "./teach.js";
import { toast } from "./toast.js";
import { listText } from "./words.js";

const banner = by("lost");
/** Intervals of checking the server: while it answers, and while it does not. */
const BEAT_MS = 3000;
const RETRY_MS = 1500;
/** The key of this project's waiting marks in the browser's storage. */
const keptKey = () => `kept-marks:${state.project}`;

const isUnsaved = ({ saving, saved }) => saving || saved.state === "refused";

/** The waiting marks of all tabs by the photos' keys, and the keys of those that this tab has stored. */
const kept = () => JSON.parse(stored(keptKey()) ?? "{}");
let own = [];

/** The photos with their keys: the name, and a number if an earlier photo has the same name. */
function keyed() {
  const counts = {};
  return state.images.map((target) => {
    const { name } = target;
    counts[name] = (counts[name] ?? 0) + 1;
    return [counts[name] > 1 ? `${name}/${counts[name]}` : name, target];
  });
}

/** Stores marks that the server has not received, in place of those that this tab has stored before. While the server answers, marks of other tabs that it has are removed. */
function keep() {
  const all = kept();
  const photos = keyed();
  // Marks of another tab that have arrived are not waiting: sent again later, they would revoke an undo.
  for (const [key, { sent }] of isLost() ? [] : photos) if (all[key] && textOf(all[key].marks) === textOf(JSON.parse(sent))) delete all[key];
  for (const key of own) delete all[key];
  const unsaved = photos.filter(([, target]) => isUnsaved(target));
  own = unsaved.map(([key]) => key);
  for (const [key, { sent, marks }] of unsaved) all[key] = { was: sent, marks };
  stored(keptKey(), Object.keys(all).length ? JSON.stringify(all) : null);
}

onLoss((lost) => {
  banner.hidden = !lost;
  banner.textContent = lost === "key"
    ? "sdg annotate was started again with another key. Open the address that it printed; the marks made since are kept in this browser. (--token-file FILE with --port keeps the key.)"
    : `sdg annotate has ended, or does not answer. The photo stays and you can go on marking: marks are kept in this browser, and sent when it answers again. Start it with --port ${location.port}.`;
  document.documentElement.toggleAttribute("data-lost", Boolean(lost));
  if (lost) {
    keep();
    meetAgain();
  } else toast("sdg annotate answers again.");
});

/** Makes a change of the lists of pictures. The pictures on the stage stay there unless they are removed. */
function keepStage(change) {
  const [shown, tried] = [image(), trialPicture()];
  change();
  state.current = Math.max(state.images.indexOf(shown), 0);
  state.trial = Math.max(state.trialPictures.indexOf(tried), 0);
  if (image() !== shown) openImage(state.current);
  if ((shown && !image()) || trialPicture() !== tried) showCurrent();
  changed();
}

/** Adopts the numbers of a restarted server, if there is one; then waiting marks are sent. */
async function meetAgain() {
  let session;
  try {
    session = await api.session({ ofAnySession: true });
  } catch {
    // The next check tries again.
    return;
  }
  // The server was started without this project: waiting marks are kept and sent when it is opened again. After a start with another camera, the page is loaded anew.
  if (session.project !== state.project || session.camera !== state.camera || session.is_calibrated !== state.isCalibrated) return location.reload();
  // Another call of this function was faster.
  if (!isLost()) return;
  const gone = [];
  // The entries that are in `views`, by name; equal names are paired in order.
  const renumbered = (entries, [...views], take) => entries.filter((entry) => {
    const at = views.findIndex(({ name }) => name === entry.name);
    if (at < 0) gone.push(Object.assign(entry, { isGone: true }).name);
    else take(entry, views.splice(at, 1)[0]);
    return at >= 0;
  });
  keepStage(() => {
    state.images = renumbered(state.images, session.images, (known, view) => {
      known.id = view.id;
      adoptChange(known, view, true);
    });
    state.trialPictures = renumbered(state.trialPictures, session.trial_pictures, Object.assign);
    adoptSession(session);
    belongTo(session);
  });
  setLost(false);
  // The server knows none of the marks that were refused.
  state.images.filter(isUnsaved).forEach(save);
  sendKept();
  api.teaching().then((teaching) => Object.assign(state, { teaching }), () => null).then(changed);
  if (gone.length) toast(`No longer there: ${gone.join(", ")}.`);
}

/** Sends this project's marks that were stored when the page, here or in another tab, was closed or reloaded without a server. */
export async function sendKept() {
  const all = kept();
  stored(keptKey(), null);
  own = [];
  const sent = [];
  for (const [key, target] of keyed()) {
    if (!all[key]) continue;
    const { was, marks } = all[key];
    // Marks changed elsewhere since then are not overwritten.
    if (textOf(target.marks) !== textOf(JSON.parse(was)) || JSON.stringify(marks) === was) continue;
    target.past.push([target.committed, null]);
    Object.assign(target, { marks, committed: JSON.stringify(marks) });
    sent.push(save(target).then(() => target.saved.state === "written" && target.marks === marks));
  }
  const count = (await Promise.all(sent)).filter(Boolean).length;
  if (count) toast(`Marks on ${count === 1 ? "a photo" : `${count} photos`} that were kept in this browser are saved now.`);
}

window.addEventListener("pagehide", keep);

/** Adopts a session that was asked for: marks that another page or program has changed (the next change here would write over them), further pictures, removed photos, the name, the offered pictures, and the choice of model and region. */
export async function adoptFrom(asked) {
  const before = state.images.map((target) => [target, target.revision]);
  const tried = [...state.trialPictures];
  const session = await asked;
  keepStage(() => {
    for (const target of tried) if (!session.trial_pictures.some(({ id }) => id === target.id)) drop(state.trialPictures, target);
    for (const [target, revision] of before) {
      const view = session.images.find(({ id }) => id === target.id);
      if (!view) {
        if (isUnsaved(target)) toast(`${target.name} was removed in another window, without the last change here.`);
        // Its number may be another photo's on another server.
        target.isGone = true;
        drop(state.images, target);
      } else if (revision === target.revision && !target.saving) adoptChange(target, view);
    }
    adoptSession(session);
  });
}

async function adoptChanges() {
  // Before a project is chosen, there is nothing to adopt. If the server is gone, a banner says so.
  if (isLost() || document.hidden || state.project === undefined) return;
  await adoptFrom(api.session()).then(keep, () => null);
}
for (const kind of ["focus", "visibilitychange"]) window.addEventListener(kind, adoptChanges);

/** A banner shown as long as marks could not be written. */
export function renderUnsaved() {
  const unsaved = state.images.filter(({ saved }) => saved.by_disk);
  const [first] = unsaved;
  const names = listText(unsaved.map(({ name }) => name), 3);
  const text = first ? `Not saved: the marks on ${names} (${first.saved.why}). They stay on this page; saving is tried again until it succeeds.` : "";
  const line = by("unsaved");
  line.hidden = !first;
  if (line.textContent === text) return;
  if (!first && !isLost() && !state.images.some(isUnsaved)) toast("All marks are saved now.");
  line.textContent = text;
}

/** Checks repeatedly whether the server answers. */
export async function beat() {
  for (;;) {
    await wait(isLost() ? RETRY_MS : BEAT_MS);
    keep();
    if (isLost()) await meetAgain();
    else {
      state.images.filter(({ saved }) => saved.by_disk).forEach(save);
      if (!document.hidden) await api.teaching().then(follow, () => null);
    }
  }
}

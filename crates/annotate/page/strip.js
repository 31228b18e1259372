// The photos of the part, or the pictures to try, in a row.

import { api } from "./api.js";
import { adopt, nextTool } from "./editing.js";
import { by, element } from "./elements.js";
import { toast } from "./toast.js";
import { adoptModels, changed, image, isAccepted, isComplete, isFound, isLive, state, trialPicture } from "./store.js";
import { replacePicture, show } from "./view.js";

const strip = by("strip");
const empty = by("empty");
const photo = by("photo");

/** Opens another photo of the part for marking. */
export function openImage(index) {
  if (index < 0 || index >= state.images.length) return;
  Object.assign(state, { current: index, shooting: false, selected: null, vertex: null, draft: null });
  state.tool = nextTool();
  showCurrent();
}

/** Opens another picture to try. */
export function openTrialPicture(index) {
  if (index < 0 || index >= state.trialPictures.length) return;
  Object.assign(state, { trial: index, tryingLive: false });
  showCurrent();
}

/** Opens the next picture of the row, or the previous one (-1); from the camera, the picture shown before. */
export function openNext(step) {
  const trying = state.tab === "try";
  const row = order(trying ? state.trialPictures : state.images, trying);
  const next = row[row.indexOf(trying ? state.trial : state.current) + (trying && isLive() ? 0 : step)];
  if (next !== undefined) (trying ? openTrialPicture : openImage)(next);
}

const indexOf = (entries, { id }) => entries.findIndex((entry) => entry.id === id);

/** Adds a photo unless it is known, and returns its index. */
export function adoptPhoto(view) {
  const at = indexOf(state.images, view);
  return at < 0 ? state.images.push(adopt(view)) - 1 : at;
}

/** Adopts the server's view of a picture to try, which may be new. */
export function adoptTrial(view) {
  const known = state.trialPictures[indexOf(state.trialPictures, view)];
  if (known) Object.assign(known, view);
  else state.trialPictures.push({ detections: null, ...view });
}

/** Adopts the names, the pictures and the models of a session, which another page may have changed. */
export function adoptSession(session) {
  const { label, is_named: isNamed, project, others } = session;
  Object.assign(state, { label, isNamed, project, others });
  session.images.forEach(adoptPhoto);
  session.trial_pictures.forEach(adoptTrial);
  adoptModels(session);
}

/** Removes an entry, if it is there. */
export function drop(entries, target) {
  if (entries.includes(target)) entries.splice(entries.indexOf(target), 1);
}

/** Removes a photo or a picture to try from the session; its file is kept, and it can be restored. */
async function remove(entries, target, { takeOut, putBack, open }) {
  const index = entries.indexOf(target);
  try {
    const session = await takeOut(target.id);
    drop(entries, target);
    adoptSession(session);
    const back = async () => {
      try {
        const session = await putBack(target.id);
        // It may have been added again in another way.
        if (indexOf(entries, target) < 0) entries.splice(index, 0, target);
        adoptSession(session);
        open(indexOf(entries, target));
      } catch (error) {
        toast(error.message);
      }
    };
    const stays = entries === state.images ? " and its marks stay" : " stays";
    toast(`${target.name} is removed. Its file${stays} in the folder.`, { text: "Put it back", run: back });
  } catch (error) {
    toast(error.message);
  }
  state.current = Math.min(state.current, Math.max(state.images.length - 1, 0));
  state.trial = Math.min(state.trial, Math.max(state.trialPictures.length - 1, 0));
  showCurrent();
}

export const removePhoto = (target) =>
  remove(state.images, target, { takeOut: api.removeImage, putBack: api.putBackImage, open: openImage });
export const removeTrialPicture = (target) =>
  remove(state.trialPictures, target, { takeOut: api.removeTrialPicture, putBack: api.putBackTrialPicture, open: openTrialPicture });

/** The content of the stage: address, size and text; null if there is none. */
function onStage() {
  if (isLive()) return state.live.url && [state.live.url, state.live.size, `Live picture of ${state.camera}`];
  const trying = state.tab === "try";
  const shown = trying ? trialPicture() : image();
  if (!shown) return null;
  return [trying ? api.trialPictureUrl(shown.id) : api.imageUrl(shown.id), [shown.width, shown.height], `Photo ${shown.name}`];
}

/** The size of the picture to try on the stage; empty if something else is shown. */
let triedSize = "";

/** Shows the content of the current step. Between two pictures to try of the same size, the view is kept. */
export function showCurrent() {
  const shown = onStage();
  photo.hidden = !shown;
  empty.hidden = Boolean(shown);
  const size = shown && state.tab === "try" && !isLive() ? String(shown[1]) : "";
  const isKept = size && size === triedSize;
  triedSize = size;
  if (isKept) {
    replacePicture(shown[0]);
    photo.alt = shown[2];
  } else if (shown) show(...shown);
  else empty.textContent = isLive() ? "Waiting for the camera’s first picture…" : state.tab === "try" ? "Drop pictures of the table here, or press “Add pictures…”." : "Drop a photo of the part here, or press “Choose it…”.";
  changed();
}

function words(entry, trying) {
  if (!trying) return isComplete(entry) ? "✓ marked" : Object.values(entry.marks).some(Boolean) ? "half marked" : "not marked";
  if (entry.became !== null) return "✓ added";
  if (entry.is_absent) return "✓ not here";
  if (entry.detecting) return "looking…";
  if (!entry.detections) return entry.failed ? "search failed" : "not tried";
  const found = entry.detections.filter(isFound);
  const count = found.length;
  if (!found.every(isAccepted)) return `${count} above ${state.minScore.toFixed(2)}`;
  return count ? `${count} found` : "nothing found";
}

/** The indices of the pictures in the order of the row; by score or state, those not yet searched come last. */
function order(entries, trying) {
  const numbers = entries.map((_, i) => i);
  if (!trying || state.sortedBy === "added") return numbers;
  const best = ({ detections }) => (detections ? detections[0]?.score ?? 0 : 2);
  const rank = ({ detections }) => (!detections ? 2 : detections.some(isFound) ? 1 : 0);
  const key = state.sortedBy === "score" ? best : rank;
  return numbers.sort((a, b) => key(entries[a]) - key(entries[b]) || a - b);
}

/** Scrolls the row to the current picture, once after each change of it. */
let scrolledTo = "";
function scrollTo(item, key) {
  if (key === scrolledTo) return;
  scrolledTo = key;
  const [at, frame] = [item, strip].map((element) => element.getBoundingClientRect());
  if (at.left < frame.left) strip.scrollLeft += at.left - frame.left;
  else if (at.right > frame.right) strip.scrollLeft += at.right - frame.right;
}

export function renderStrip() {
  const trying = state.tab === "try";
  const entries = trying ? state.trialPictures : state.images;
  strip.setAttribute("aria-label", trying ? "Pictures to try" : "Photos of the part");
  strip.hidden = state.tab === "samples" ? state.images.length < 2 : trying || isLive() ? !entries.length : entries.length < 2;
  const current = trying ? state.trial : state.current;
  while (strip.children.length > entries.length) strip.lastChild.remove();
  order(entries, trying).forEach((i, place) => {
    const entry = entries[i];
    let item = strip.children[place];
    if (!item) {
      item = element("li");
      item.innerHTML = '<button><img alt="" loading="lazy"><span></span><span></span></button>';
      item.firstChild.addEventListener("click", () => {
        const index = Number(item.dataset.index);
        if (state.tab === "try") openTrialPicture(index);
        else openImage(index);
      });
      strip.append(item);
    }
    item.dataset.index = i;
    const [picture, name, word] = item.firstChild.children;
    const url = trying ? api.trialPictureUrl(entry.id) : api.imageUrl(entry.id);
    if (picture.getAttribute("src") !== url) picture.src = url;
    name.textContent = entry.name;
    word.textContent = words(entry, trying);
    item.firstChild.setAttribute("aria-current", String(i === current && !isLive()));
    if (i === current && !strip.hidden) scrollTo(item, JSON.stringify([trying, entry.id, state.sortedBy]));
  });
}

/** The title of the window. */
export const shownName = () => (isLive() ? "Live" : (state.tab === "try" ? trialPicture() : image())?.name) ?? "";
export const isMarked = () => Boolean(image() && isComplete(image()));

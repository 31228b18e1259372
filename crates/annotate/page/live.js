// The camera: its newest picture on the stage, photos taken from it, and the taught model applied to it continuously.

import { api } from "./api.js";
import { by, element, offBecause, setText, shows, wait } from "./elements.js";
import { gripperOf } from "./geometry.js";
import { numbered } from "./overlay.js";
import { adoptPhoto, adoptTrial, openImage, showCurrent } from "./strip.js";
import { changed, isAccepted, isFound, isLive, isRunning, MODEL_LIMIT, state, touchedBy } from "./store.js";
import { toast } from "./toast.js";
import { replacePicture } from "./view.js";
import { listText } from "./words.js";

/** Interval between requests, short enough for smooth motion. */
const PAUSE_MS = 60;
/** Interval while the model is tried and waits for the camera's next frame; after a frame the next one is requested at once. */
const TRYING_PAUSE_MS = 15;
/** Interval after a failed request, or while the page is hidden. */
const RETRY_MS = 500;
/** Maximum number of grasps of a frame described in words; all are drawn. */
const MAX_TOLD = 3;
const FAULTS = {
  other_size: "Another size",
  stale: "No new picture",
  frozen: "Frozen picture",
  torn: "Broken pictures",
  gone: "Camera gone",
  black: "Black picture",
  ended: "The end",
  failed: "Camera failed",
  lost: "No answer",
};

const isPaused = () => state.tab === "try" && state.live.paused;

/** Requests the newest frame as long as the live picture is shown. */
let running = false;
async function run() {
  if (running) return;
  running = true;
  while (isLive() && !isPaused()) {
    let pause = PAUSE_MS;
    if (document.hidden) pause = RETRY_MS;
    else {
      try {
        const isNew = await look();
        if (state.tab === "try" && state.hasModel) pause = isNew ? 0 : TRYING_PAUSE_MS;
      } catch (error) {
        Object.assign(state.live, { fault: { kind: "lost", text: error.message }, isUsable: false });
        pause = RETRY_MS;
      }
      changed();
    }
    await wait(pause);
  }
  running = false;
}

/** Shows the newest frame, with its detections while the model is tried; returns whether the frame was new. */
async function look() {
  const { live } = state;
  const now = await api.live();
  if (live.fault && !live.isUsable && now.is_usable) toast("The camera is back.");
  Object.assign(live, { fault: now.fault, isUsable: now.is_usable, nextPhoto: now.next_photo });
  if (!now.frame) return false;
  const { number, width, height } = now.frame;
  const isTrying = state.tab === "try" && state.hasModel && now.is_usable;
  if (number === live.number && (!isTrying || live.detections)) return false;
  const [url, found] = await Promise.all([pictureOf(number), isTrying ? graspsIn(number) : { detections: null }]);
  // After a pause or a change of the view in the meantime, the stage is kept.
  if (!isLive() || isPaused()) {
    URL.revokeObjectURL(url);
    return false;
  }
  const size = [width, height];
  const isOther = live.url === null || String(size) !== String(live.size);
  const old = live.url;
  Object.assign(live, { number, size, url, failed: null, paused: false, ...found });
  if (isOther) showCurrent();
  else replacePicture(url);
  if (old) URL.revokeObjectURL(old);
  return true;
}

/** The picture as an address that the browser has already decoded, so that changing pictures does not flicker. */
async function pictureOf(number) {
  const url = URL.createObjectURL(await api.livePicture(number));
  const decoded = new Image();
  decoded.src = url;
  await decoded.decode();
  return url;
}

async function graspsIn(number) {
  const { generation } = state;
  try {
    const { detections, seconds } = await api.detectLive(number);
    // Detections of another model, or in another region, are not shown for this one.
    return { detections: generation === state.generation ? detections : null, seconds };
  } catch (error) {
    if (error.lost) throw error;
    return { detections: [], failed: error.message };
  }
}

/** Shows the live picture for a photo, or goes back to the photos. */
export function toggleCamera() {
  if (!state.camera || state.tab !== "mark" || !state.images.length) return;
  Object.assign(state, { shooting: !state.shooting, draft: null });
  showCurrent();
}

/** Makes the frame on the stage a photo of the part. */
export async function takePhoto() {
  const { live } = state;
  if (state.tab !== "mark" || !isLive() || !live.isUsable || live.taking) return;
  live.taking = true;
  changed();
  try {
    const view = await api.takePhoto(live.number);
    openImage(adoptPhoto(view));
    // The button disappears with the live picture.
    by("overlay").focus({ preventScroll: true });
    toast(`Photo taken: ${view.name}`);
    // The first photo determines the project.
    state.project ??= (await api.session()).project;
  } catch (error) {
    toast(error.message);
  }
  live.taking = false;
  changed();
}

/** Pauses and continues; from another picture, returns to the camera. */
export function toggleLive() {
  if (!state.camera || state.tab !== "try") return;
  if (state.tryingLive) {
    state.live.paused = !state.live.paused;
    // Otherwise another page's frames displace it; after a failure it can still be kept for a moment.
    if (state.live.paused && state.live.number !== null) api.hold(state.live.number).catch(() => {});
  } else {
    Object.assign(state, { tryingLive: true });
    state.live.paused = false;
    showCurrent();
  }
  changed();
}

/** Makes the frame on the stage a picture to try. */
export async function keepPicture() {
  const { live } = state;
  if (state.tab !== "try" || !isLive() || live.number === null) return;
  const { number, detections, failed, seconds } = live;
  try {
    const trial = await api.keepFrame(number);
    // After a failed search, the kept picture is searched again.
    adoptTrial({ ...trial, detections: failed ? null : detections, seconds });
    toast(`Kept as ${trial.name}`);
  } catch (error) {
    toast(error.message);
  }
  changed();
}

by("take").addEventListener("click", takePhoto);
by("back-to-photos").addEventListener("click", toggleCamera);
by("camera-button").addEventListener("click", toggleCamera);
by("live-toggle").addEventListener("click", toggleLive);
by("live-keep").addEventListener("click", keepPicture);

/** A grasp's position in words: in pixels of the picture, and over the table if the camera is calibrated. */
export function placeText({ marks, pose }) {
  const { center, angle, width } = gripperOf(marks.grasp);
  const [x, y] = center.map((v) => v.toFixed(1));
  const inPicture = `x ${x}, y ${y} px, ${((angle * 180) / Math.PI).toFixed(1)}°, jaws ${width.toFixed(1)} px apart`;
  return pose ? `${inPicture}\n${poseText(pose)}` : inPicture;
}

/** A detection's state in words. */
export function foundTitle(detection) {
  if (isAccepted(detection)) return "Found the part";
  return isFound(detection) ? `Above the slider, below the model’s limit of ${MODEL_LIMIT.toFixed(2)}` : "Refused";
}

/** The parts that a detection's jaws touch, by their numbers in the list; empty if there are none. */
export function touchText(detection, detections, listed) {
  const touched = isAccepted(detection) ? touchedBy(detection, detections) : [];
  if (!touched.length) return "";
  const numbers = touched.map((other) => listed.indexOf(other) + 1).sort((a, b) => a - b).map((n) => (n ? `${n}` : "another"));
  return `Warning: the jaws would touch part${numbers.length > 1 ? "s" : ""} ${listText(numbers)}.`;
}

/** A grasp over the table, in words. */
function poseText({ frame, position_mm, yaw_deg, opening_mm, sigma_mm, sigma_deg }) {
  const [x, y, z] = position_mm.map((v) => v.toFixed(1));
  return `x ${x}, y ${y}, z ${z} mm (±\u00a0${sigma_mm.toFixed(1)}), turned ${yaw_deg.toFixed(1)}° (±\u00a0${sigma_deg.toFixed(1)}), jaws ${opening_mm.toFixed(1)} mm apart; frame: ${frame}`;
}

function renderState() {
  const { live } = state;
  by("live-state").hidden = !isLive();
  by("stage").classList.toggle("unusable", isLive() && live.url !== null && !live.isUsable);
  if (!isLive()) return;
  const kind = isPaused() ? "paused" : live.fault ? live.fault.kind : live.url ? "live" : "waiting";
  by("live-state").dataset.kind = live.fault && !isPaused() ? (live.isUsable ? "ended" : "fault") : kind;
  setText(by("live-word"), { paused: "Paused", live: "Live", waiting: "Waiting" }[kind] ?? FAULTS[kind]);
  const why = { paused: "", live: state.camera, waiting: state.camera, gone: `${live.fault?.text}. Connecting is retried.` }[kind];
  setText(by("live-why"), why ?? live.fault.text);
}

function renderShooting() {
  const { live } = state;
  const isShooting = isLive() && state.tab === "mark";
  by("shoot").hidden = !isShooting;
  by("camera-button").hidden = !state.camera;
  by("back-to-photos").hidden = !state.images.length;
  offBecause(by("take"), live.taking ? "The photo is being taken" : !live.isUsable && "The camera shows no usable picture");
  setText(by("shoot-where"), live.nextPhoto ? `It is written to ${live.nextPhoto}.` : "");
}

function cards(detections) {
  const accepted = detections.filter(isFound);
  if (!accepted.length) {
    const best = detections[0];
    return [["There is nothing to grasp.", best ? `best ${best.score.toFixed(2)}` : "", ""]];
  }
  const told = accepted.slice(0, MAX_TOLD).map((d, i) => [numbered(foundTitle(d), i, accepted.length), `score ${d.score.toFixed(2)}`, placeText(d), touchText(d, detections, accepted)]);
  if (accepted.length > MAX_TOLD) told.push([`And ${accepted.length - MAX_TOLD} more`, "", ""]);
  return told;
}

function renderTrying() {
  const { live } = state;
  by("live").hidden = !state.camera;
  if (!state.camera) return;
  by("live-toggle").textContent = !state.tryingLive ? "Back to the live picture" : live.paused ? "Go on" : "Pause";
  by("live-keep").hidden = !state.tryingLive;
  offBecause(by("live-keep"), live.number === null && "The camera has shown no picture yet");
  const isAnswered = state.tryingLive && live.isUsable && live.detections && !live.failed;
  by("live-error").hidden = !state.tryingLive || !live.failed;
  setText(by("live-error"), live.failed ?? "");
  const time = isAnswered ? `Search took ${Math.max(1, Math.round(live.seconds * 1000))} ms.` : state.hasModel ? (live.paused ? "Not searched yet: press “Go on”." : "Looking…") : `${isRunning() ? "A model is being taught" : "Teach a model first"}: it then looks for the part here.`;
  setText(by("live-time"), live.failed || !state.tryingLive || (live.fault && !live.isUsable) ? "" : time);
  const told = isAnswered ? cards(live.detections) : [];
  if (shows(by("live-found"), told)) return;
  by("live-found").replaceChildren(...told.map(([title, score, pose, touching]) => {
    const item = element("div", { className: "found" });
    item.innerHTML = '<h3><span></span><span class="score"></span></h3><p class="pose"></p><p class="warning"></p>';
    item.querySelector("span").textContent = title;
    item.querySelector(".score").textContent = score;
    item.querySelector(".pose").textContent = pose;
    item.querySelector(".pose").hidden = !pose;
    item.querySelector(".warning").textContent = touching;
    item.querySelector(".warning").hidden = !touching;
    return item;
  }));
  // Announced to screen readers only if the number changes; the figures change with every frame.
  const count = live.detections?.filter(isFound).length ?? 0;
  setText(by("live-status"), isAnswered ? `${count} found` : "");
}

export function renderLive() {
  renderState();
  renderShooting();
  if (state.tab === "try") renderTrying();
  if (isLive() && !isPaused()) run();
}

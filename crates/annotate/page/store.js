// The page's state. Code that changes it calls `changed`; everything that shows it is then redrawn, once per frame.

import { boxPolygon } from "./geometry.js";

export const state = {
  label: "",
  /** Whether the user or existing marks gave that name; otherwise it is a proposal. */
  isNamed: true,
  /** The absolute path of the project's folder, or of the file of a photo's project (null for a camera before its first photo); other pictures of the folder; versions of the model, oldest first. */
  project: undefined,
  others: [],
  models: [],
  /** The version that was in use when the last one was taught, if that was while the page was open. */
  replaced: null,
  /** Whether the camera of the photos is calibrated: the size of the part is then known. */
  isCalibrated: false,
  /** Photos of the part: the server's view of each, and `past`, `future` of its marks as JSON. */
  images: [],
  current: 0,
  /** Pictures to try, each with its `detections` once searched, and in `before` those of the previous model. */
  trialPictures: [],
  trial: 0,
  tab: "mark",
  tool: "select",
  /** The mark being corrected: box, grasp, outline; and the outline's selected point. */
  selected: null,
  vertex: null,
  /** The current drawing: a box, a gripper's line, an unclosed outline, a stroke. */
  draft: null,
  proposing: false,
  /** The camera's address; null without one. */
  camera: null,
  /** Whether the first step shows the camera for a further photo, and whether the last step shows the camera in place of a picture. */
  shooting: false,
  tryingLive: true,
  /** The frame on the stage, with its `detections` while the model is tried, and the camera's fault. */
  live: { number: null, url: null, size: null, detections: null, failed: null, fault: null, isUsable: false, paused: false },
  /** Number of calls of `searchAgain`: answers to earlier requests for detections are discarded. */
  generation: 0,
  /** Minimum score of accepted detections. */
  minScore: 0.5,
  /** Order of the pictures to try in their row: as added, by score, by state. */
  sortedBy: "added",
  showDifferences: true,
  /** The searched region of the pictures, and the picture size that it applies to; null for the whole picture. */
  region: null,
  teaching: { status: "idle", losses: [], validations: [] },
  /** The part of the photo in view: screen = photo · scale + [x, y]. */
  view: { scale: 1, x: 0, y: 0, fitted: true },
};

const listeners = [];
let queued = false;

/** Calls `listener` after every change. */
export const onChange = (listener) => listeners.push(listener);

/** Announces a change of `state`. */
export function changed() {
  if (queued) return;
  queued = true;
  requestAnimationFrame(() => {
    queued = false;
    for (const listener of listeners) listener(state);
  });
}

export const image = () => state.images[state.current];
export const marks = () => image().marks;
export const trialPicture = () => state.trialPictures[state.trial];
/** Whether a photo has all the marks that a teaching needs. */
export const isComplete = ({ marks: { box, outline, grasp } }) => Boolean((box || outline) && grasp);
export const isAnyMarked = () => state.images.some(isComplete);
/** Whether a picture to try was not searched yet. */
export const isWaiting = (trial) => !trial.detections && !trial.failed;
/** From this score on the model itself accepts a detection. */
export const MODEL_LIMIT = 0.5;
/** Whether a detection reaches the chosen minimum score. */
export const isFound = (detection) => detection.score >= state.minScore;
/** Whether a detection reaches both the minimum score and the model's limit. */
export const isAccepted = (detection) => isFound(detection) && detection.score >= MODEL_LIMIT;
/** The accepted detections whose parts are touched by the jaws of `detection`. */
export const touchedBy = (detection, detections) => detection.touches.map((i) => detections[i]).filter((other) => other && isAccepted(other));
/** Whether a model is being taught. */
export const isRunning = () => ["running", "stopping"].includes(state.teaching.status);

/** Discards all detections, so that the pictures are searched again; if `compares`, `before` keeps them for a comparison with another model. */
export function searchAgain({ compares }) {
  state.generation += 1;
  for (const target of [...state.trialPictures, state.live]) {
    Object.assign(target, { before: compares ? target.detections : null, detections: null, failed: null });
  }
}

/** The model in use: the page's, or that of a session. */
export const currentModel = ({ models } = state) => models.find((model) => model.is_current);

/** Adopts the models and the region of a session. If those in use are others, the pictures are searched again; after a teaching, the detections are compared. */
export function adoptModels({ models, region }) {
  const used = (from) => JSON.stringify([currentModel(from)?.file, from.region]);
  const isOther = used({ models, region }) !== used(state);
  const isNew = models.length > state.models.length;
  if (isNew) state.replaced = currentModel();
  Object.assign(state, { models, region, hasModel: Boolean(currentModel({ models })) });
  if (isOther) searchAgain({ compares: isNew });
}

export const size = () => [image().width, image().height];

/** Whether the stage shows the camera: for the first photo, for a further one, or to try the model. */
export function isLive() {
  if (!state.camera || state.tab === "samples") return false;
  if (state.tab === "try") return state.tryingLive;
  return !state.images.length || (state.shooting && state.tab === "mark");
}

/** Whether the stage shows a photo that can be marked. */
export const isMarking = () => state.tab === "mark" && !isLive() && Boolean(image());

/** The part's marked region: its outline, or its box. */
export function region() {
  if (!image()) return null;
  const { outline, box } = marks();
  if (outline) return outline;
  return box ? boxPolygon(box) : null;
}

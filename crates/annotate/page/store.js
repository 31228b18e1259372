// What the page knows. Whoever changes it calls `changed`; everything that shows it then shows it anew, once a frame.

export const state = {
  label: "",
  /** Whether somebody gave that name; it is a proposal otherwise. */
  isNamed: true,
  modelPath: "",
  /** The project's folder, or the file of a photo's; its folder's other pictures; versions of the model, oldest first. */
  project: undefined,
  others: [],
  models: [],
  /** Whether the camera of the photos is calibrated: the size of the part in them is known then. */
  isCalibrated: false,
  /** Photos of the part: what the server tells of each, and `past`, `future` of its marks as JSON. */
  images: [],
  current: 0,
  /** Pictures to try, each with its `detections` once looked at. */
  trialPictures: [],
  trial: 0,
  tab: "mark",
  tool: "select",
  /** Which mark is being corrected: box, grasp, outline; and which of the outline's points. */
  selected: null,
  vertex: null,
  /** What is being drawn just now: a box, a line, an unclosed outline. */
  draft: null,
  proposing: false,
  /** The camera's address; null without one. */
  camera: null,
  /** Whether the first step shows the camera for a further photo, and the last one the camera instead of a picture. */
  shooting: false,
  tryingLive: true,
  /** The frame on the stage, with its `detections` where the model is tried, and what is wrong with the camera. */
  live: { number: null, url: null, size: null, detections: null, failed: null, fault: null, isUsable: false, paused: false },
  /** What scores so much is found. */
  minScore: 0.5,
  /** The order of the pictures to try in their row: as they were added, by score, by state. */
  sortedBy: "added",
  showDifferences: true,
  /** The part of the pictures that is searched, and for pictures of which size; null for all of them. */
  region: null,
  teaching: { status: "idle", losses: [], validations: [] },
  /** The part of the photo in view: screen = photo · scale + [x, y]. */
  view: { scale: 1, x: 0, y: 0, fitted: true },
};

const listeners = [];
let queued = false;

/** Calls `listener` after every change. */
export const onChange = (listener) => listeners.push(listener);

/** Says that `state` is not what it was. */
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
/** Whether a detection counts as found at the least score that is chosen. */
export const isFound = (detection) => detection.score >= state.minScore;
/** The found ones among a picture's detections whose parts the jaws of one of them touch. */
export const touchedBy = (detection, detections) => detection.touches.map((i) => detections[i]).filter((other) => other && isFound(other));
export const size = () => [image().width, image().height];

/** Whether the stage shows the camera: for the first photo, for a further one, or to try the model. */
export function isLive() {
  if (!state.camera || state.tab === "samples") return false;
  if (state.tab === "try") return state.tryingLive;
  return !state.images.length || (state.shooting && state.tab === "mark");
}

/** Whether the stage shows a photo on which marks can be made. */
export const isMarking = () => state.tab === "mark" && !isLive() && Boolean(image());

/** Where the part is, as far as it is marked: its outline, or its box. */
export function region() {
  if (!image()) return null;
  const { outline, box } = marks();
  if (outline) return outline;
  return box ? [[box[0], box[1]], [box[2], box[1]], [box[2], box[3]], [box[0], box[3]]] : null;
}

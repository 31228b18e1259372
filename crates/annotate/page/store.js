// What the page knows. Whoever changes it calls `changed`; everything that shows it then shows it anew, once a frame.

export const state = {
  label: "",
  modelPath: "",
  /** Photos of the part: what the server tells of each, and `past`, `future` of its marks as JSON. */
  images: [],
  current: 0,
  /** Pictures to try, each with its `detections` once looked at. */
  scenes: [],
  scene: 0,
  tab: "mark",
  tool: "select",
  /** Which mark is being corrected: box, grasp, outline; and which of the outline's points. */
  selected: null,
  vertex: null,
  /** What is being drawn just now: a box, a line, an unclosed outline. */
  draft: null,
  proposing: false,
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
export const scene = () => state.scenes[state.scene];
export const size = () => [image().width, image().height];

/** Where the part is, as far as it is marked: its outline, or its box. */
export function region() {
  const { outline, box } = marks();
  if (outline) return outline;
  return box ? [[box[0], box[1]], [box[2], box[1]], [box[2], box[3]], [box[0], box[3]]] : null;
}

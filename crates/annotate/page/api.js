// Requests to the server. Errors are one line of text for the user.

/** A failed request; `message` can be shown to the user. `lost`: the server does not answer, or was restarted. `isPassing`: the same request may succeed later. `image`: the server's view of a photo whose marks another program has changed. */
export class RequestError extends Error {
  constructor(message, lost = false) {
    super(message);
    this.lost = lost;
  }
}

/**
 * Whether the server is gone: false, true, or "key" if it was restarted with another token. A response alone does not
 * reset this: a restarted server has renumbered its pictures, and marks are not sent before the numbers are known.
 */
let lost = false;
const lossListeners = [];
/** Requests waiting for the server. */
let waiting = [];
export const onLoss = (listener) => lossListeners.push(listener);
export const isLost = () => lost;
export function setLost(now) {
  if (lost === now) return;
  lost = now;
  if (!lost) waiting.splice(0).forEach((resolve) => resolve());
  for (const listener of lossListeners) listener(now);
}
/** Waits until the server is back and its picture numbers are known. */
export const present = () => new Promise((resolve) => (lost ? waiting.push(resolve) : resolve()));

/** The session of the picture numbers; the server rejects numbers of another session. */
let sessionId = null;
export function belongTo(session) {
  sessionId = session.id;
}

async function send(method, path, body, options = {}) {
  let response;
  try {
    const headers = sessionId && !options.ofAnySession ? { "Sdg-Session": sessionId } : {};
    response = await fetch(path, { method, body, headers, keepalive: options.keepalive });
  } catch {
    setLost(true);
    throw new RequestError("No answer from sdg annotate. Is it still running in the terminal?", true);
  }
  // Another token: the server was restarted without --token-file.
  if (response.status === 401) {
    setLost("key");
    throw new RequestError("sdg annotate was started again with another key: open the address that it printed.", true);
  }
  if (response.status === 412) {
    setLost(true);
    throw new RequestError("sdg annotate was started again.", true);
  }
  if (response.ok) return options.isPicture ? response.blob() : response.json();
  if (response.status === 413) throw new RequestError(`${body?.name ?? "That"} is too large.`);
  const text = await response.text();
  let message = text.trim() || `The server answered ${response.status}.`;
  let image;
  try {
    ({ error: message = message, image } = JSON.parse(text));
  } catch {
    // Refusals by the guard are plain text.
  }
  throw Object.assign(new RequestError(message), { image, isPassing: /409|5../.test(response.status) });
}

/** One detection at a time: each uses all cores. A comparison, which can take minutes, does not delay the live picture. */
let lastDetection = Promise.resolve();
const inTurn = (work) => (lastDetection = lastDetection.then(work, work));

/** The address of a picture. In another session its number is that of another picture, which the browser must not take from its memory. */
const pictureUrl = (kind, id) => `/api/${kind}/${id}/picture?${sessionId}`;

/** Sends a picture's file, whose name ends the address. It is read first: a request with an unreadable file fails as without a server. */
async function upload(path, file) {
  await file.slice(0, 1).arrayBuffer().catch(() => {
    throw new RequestError(`${file.name}: the browser cannot read this file.`);
  });
  return send("POST", `/api/${path}=${encodeURIComponent(file.name)}`, file);
}

const json = (method, path, value, options) => send(method, path, JSON.stringify(value), options);

/** Browsers do not keep larger requests alive after the page is closed. */
const MAX_KEEPALIVE_CHARS = 20000;

export const api = {
  session: (options) => send("GET", "/api/session", undefined, options),
  createProject: (name, photo) => upload(`projects?name=${encodeURIComponent(name)}&photo`, photo),
  openProject: (id) => send("POST", `/api/projects/${id}/open`),
  closeProject: () => send("DELETE", "/api/projects"),
  addPhoto: (id) => send("POST", `/api/others/${id}/photo`),
  addOtherTrial: (id) => send("POST", `/api/others/${id}/try`),
  otherUrl: (id) => pictureUrl("others", id),
  uploadPhoto: (file) => upload("images?name", file),
  rename: (label) => json("PUT", "/api/label", { label }),
  setRegion: (region) => inTurn(() => json("PUT", "/api/region", region)),
  // `keepalive`: marks made just before closing the page are saved too.
  saveMarks: (id, marks) => json("PUT", `/api/images/${id}/marks`, marks, { keepalive: JSON.stringify(marks).length < MAX_KEEPALIVE_CHARS }),
  // `outline`: the one that the strokes correct; null to detect it in the box.
  proposeOutline: (id, box, strokes, outline) => json("POST", `/api/images/${id}/outline`, { box, strokes, outline }),
  removeImage: (id) => send("DELETE", `/api/images/${id}`),
  putBackImage: (id) => send("POST", `/api/images/${id}/put-back`),
  removeTrialPicture: (id) => send("DELETE", `/api/trial-pictures/${id}`),
  putBackTrialPicture: (id) => send("POST", `/api/trial-pictures/${id}/put-back`),
  setAbsent: (id, absent) => json("PUT", `/api/trial-pictures/${id}/absent`, { absent }),
  useModel: (id) => send("PUT", `/api/models/${id}/current`),
  compareModels: (one, other) => send("POST", `/api/models/${one}/compare/${other}`),
  imageUrl: (id) => pictureUrl("images", id),
  sampleUrl: (id, index, seed, revision) => `/api/images/${id}/samples/${index}?seed=${seed}&revision=${revision}&${sessionId}`,
  teach: (request) => json("POST", "/api/teaching", request),
  teaching: () => send("GET", "/api/teaching"),
  stopTeaching: () => send("DELETE", "/api/teaching"),
  addTrialPicture: (file) => upload("trial-pictures?name", file),
  trialPictureUrl: (id) => pictureUrl("trial-pictures", id),
  detect: (id) => inTurn(() => send("POST", `/api/trial-pictures/${id}/detect`)),
  wouldHelp: (id, question) => inTurn(() => json("POST", `/api/trial-pictures/${id}/would-help`, question)),
  live: () => send("GET", "/api/live"),
  livePicture: (number) => send("GET", `/api/live/${number}/picture`, undefined, { isPicture: true }),
  detectLive: (number) => inTurn(() => send("POST", `/api/live/${number}/detect`)),
  hold: (number) => send("POST", `/api/live/${number}/hold`),
  takePhoto: (number) => send("POST", `/api/live/${number}/photo`),
  keepFrame: (number) => send("POST", `/api/live/${number}/keep`),
  accept: (id, marks) => json("POST", `/api/trial-pictures/${id}/accept`, marks),
};

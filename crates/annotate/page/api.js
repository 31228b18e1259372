// Requests to the server, whose errors come as one line for people.

/** A failed request; `message` is fit to be shown. `lost` when the server did not answer at all. */
export class RequestError extends Error {
  constructor(message, lost = false) {
    super(message);
    this.lost = lost;
  }
}

/** Whether the server is gone: false, true, or "key" where it came back with another key. */
let lost = false;
const lossListeners = [];
export const onLoss = (listener) => lossListeners.push(listener);
export const isLost = () => lost;
function setLost(now) {
  if (lost === now) return;
  lost = now;
  for (const listener of lossListeners) listener(now);
}

async function send(method, path, body, options = {}) {
  let response;
  try {
    response = await fetch(path, { method, body, ...options });
  } catch {
    setLost(true);
    throw new RequestError("No answer from sdg annotate. Is it still running in the terminal?", true);
  }
  // Another key: it was started anew without --token-file.
  if (response.status === 401) {
    setLost("key");
    throw new RequestError("sdg annotate was started again with another key: open the address that it printed.", true);
  }
  setLost(false);
  if (response.ok) return options.isPicture ? response.blob() : response.json();
  if (response.status === 413) throw new RequestError("That is too large to be taken.");
  const text = await response.text();
  let message = text.trim() || `The server answered ${response.status}.`;
  try {
    message = JSON.parse(text).error ?? message;
  } catch {
    // Refusals by the guard are plain text.
  }
  throw new RequestError(message);
}

/** Never two detections at once: each uses every core. */
let lastDetection = Promise.resolve();
const inTurn = (work) => (lastDetection = lastDetection.then(work, work));

const json = (method, path, value, options) => send(method, path, JSON.stringify(value), options);

export const api = {
  session: () => send("GET", "/api/session"),
  rename: (label) => json("PUT", "/api/label", { label }),
  // `keepalive`: marks made just before the page is closed are saved, too.
  saveMarks: (id, marks) => json("PUT", `/api/images/${id}/marks`, marks, { keepalive: true }),
  proposeOutline: (id, box, clicks) => json("POST", `/api/images/${id}/outline`, { box, ...clicks }),
  removeImage: (id) => send("DELETE", `/api/images/${id}`),
  removeTrialPicture: (id) => send("DELETE", `/api/trial-pictures/${id}`),
  setAbsent: (id, absent) => json("PUT", `/api/trial-pictures/${id}/absent`, { absent }),
  useModel: (id) => send("PUT", `/api/models/${id}/current`),
  compareModels: (one, other) => inTurn(() => send("POST", `/api/models/${one}/compare/${other}`)),
  imageUrl: (id) => `/api/images/${id}/picture`,
  sampleUrl: (id, index, seed, revision) => `/api/images/${id}/samples/${index}?seed=${seed}&revision=${revision}`,
  teach: (request) => json("POST", "/api/teaching", request),
  teaching: () => send("GET", "/api/teaching"),
  stopTeaching: () => send("DELETE", "/api/teaching"),
  addTrialPicture: (file) => send("POST", `/api/trial-pictures?name=${encodeURIComponent(file.name)}`, file),
  trialPictureUrl: (id) => `/api/trial-pictures/${id}/picture`,
  detect: (id) => inTurn(() => send("POST", `/api/trial-pictures/${id}/detect`)),
  live: () => send("GET", "/api/live"),
  livePicture: (number) => send("GET", `/api/live/${number}/picture`, undefined, { isPicture: true }),
  detectLive: (number) => inTurn(() => send("POST", `/api/live/${number}/detect`)),
  takePhoto: (number) => send("POST", `/api/live/${number}/photo`),
  keepFrame: (number) => send("POST", `/api/live/${number}/keep`),
  accept: (id, marks) => json("POST", `/api/trial-pictures/${id}/accept`, marks),
};

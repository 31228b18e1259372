// The page: dropped or chosen files go to the worker, its results are drawn and listed.

import { Camera } from "./camera.js";
import { Detector } from "./detector.js";
import { show } from "./stage.js";
import { missingSupport } from "./wasm_support.js";

const element = (id) => document.getElementById(id);
const ACCEPTED = 0.5;
/** Size limit of thumbnails and the stage; the model gets every pixel. */
const WIDEST_SHOWN = 2048;

const camera = new Camera();
const pictures = []; // {file, bitmap, result: {record, milliseconds, decoded}, error, button, small}
let detector = null; // On the device chosen last; outcomes of another one are ignored.
let opening = null; // The model file chosen last, until it is open or refused.
let modelFile = null; // The file that was opened last.
let modelOpen = false; // Whether it is open in `detector`.
let current = null; // A picture of the list, or the camera's last frame, which has no file.
let generation = 0; // Increases when model or settings change, which makes earlier requests invalid.

const missing = missingSupport();
if (missing) {
  complain(missing);
  document.querySelectorAll("input, button").forEach((control) => (control.disabled = true));
  document.querySelectorAll(".button").forEach((label) => label.setAttribute("aria-disabled", "true"));
} else {
  detector = new Detector();
  wire();
}

function wire() {
  element("model-file").onchange = ({ target }) => {
    complain(null);
    openModel(target.files[0]);
    target.value = "";
  };
  element("image-files").onchange = ({ target }) => {
    complain(null);
    addPictures([...target.files]);
    target.value = "";
  };
  element("camera").onclick = toggleCamera;
  element("verify").onchange = detectInAllAgain;
  element("refused").onchange = showCurrent;
  element("download").onclick = download;
  element("webgpu").onchange = () => {
    complain(null);
    changeDevice();
  };
  element("webgpu-choice").hidden = !navigator.gpu; // Browsers offer WebGPU only to pages served by https or from this machine.
  watchWidth(element("stage"), showCurrent);

  // Dropped anywhere: models and pictures are distinguished by name.
  let depth = 0;
  const dropping = (change) => element("stage").classList.toggle("dropping", (depth += change) > 0);
  addEventListener("dragenter", () => dropping(1));
  addEventListener("dragleave", () => dropping(-1));
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", async (event) => {
    event.preventDefault();
    dropping(-depth);
    complain(null);
    const files = [...event.dataTransfer.files];
    const isModel = (file) => /\.(sdg|safetensors)$/i.test(file.name);
    const model = files.find(isModel);
    if (model) {
      await openModel(model);
    }
    addPictures(files.filter((file) => !isModel(file)));
  });
}

/** Redraws when the width changes; the height follows the picture and must not trigger a redraw. */
function watchWidth(watched, redraw) {
  let width = watched.clientWidth;
  addEventListener("resize", () => {
    if (width !== watched.clientWidth) {
      width = watched.clientWidth;
      redraw();
    }
  });
}

const chosenDevice = () => (element("webgpu").checked ? "webgpu" : "processor");

/**
 * Opens the model chosen last on the device chosen last; if that model is refused, the one before. If the graphics card
 * opens none, switches back with the model `notOnCard`.
 */
async function changeDevice(notOnCard = null) {
  const card = element("webgpu");
  if (card.checked && !(await navigator.gpu.requestAdapter().catch(() => null))) {
    card.checked = false;
    complain("This browser provides no graphics card to the page; the processor is used.");
  }
  // Another choice may have been made meanwhile.
  if (chosenDevice() === detector.device) {
    return;
  }
  stopCamera();
  detector.close();
  const mine = (detector = new Detector(chosenDevice()));
  modelOpen = false;
  detectInAllAgain();
  const files = [...new Set([opening, notOnCard, modelFile])].filter(Boolean);
  for (const file of files) {
    if (mine === detector && !modelOpen) {
      await openModel(file);
    }
  }
  if (files.length > 0 && mine === detector && !modelOpen && card.checked) {
    const complaint = element("alert").textContent;
    card.checked = false;
    await changeDevice(files[0]);
    if (modelOpen) {
      complain(`The graphics card cannot be used, the processor is. ${complaint}`);
    }
  }
}

/** Opens a model and searches every picture with it; if it is refused, the model before stays open. */
async function openModel(file) {
  if (!file) {
    return;
  }
  const mine = detector;
  opening = file;
  say(`Opening ${file.name}…`);
  let summary = null;
  let refused = null;
  try {
    summary = await mine.open(file);
  } catch (error) {
    refused = `${file.name}: ${error.message}`;
  }
  if (mine !== detector) {
    return; // `changeDevice` opens it on the other device.
  }
  if (opening === file) {
    opening = null;
  }
  if (refused) {
    complain(refused);
    showCurrent();
    return;
  }
  modelOpen = true;
  modelFile = file;
  showModel(file.name, summary);
  detectInAllAgain();
}

function showModel(name, { model, preset, object, teaching }) {
  const facts = [
    ["file", name],
    ["part", object],
    ["model", model === "S" ? "S (no network)" : `${model}, ${preset}`],
    ["taught in", `${teaching.seconds.toFixed(1)} s`],
  ];
  if (teaching.validation_hit_rate !== undefined) {
    const share = Math.round(100 * teaching.validation_hit_rate);
    const { validation_error_px: px, validation_error_degrees: degrees } = teaching;
    facts.push(["held back", `${share} % found, ${px.toFixed(1)} px, ${degrees.toFixed(1)}°`]);
  }
  const list = document.createElement("dl");
  for (const [term, fact] of facts) {
    list.append(make("dt", term), make("dd", fact));
  }
  element("model-facts").replaceChildren(list);
}

const waitingText = () => (modelOpen ? "waiting" : "waiting for a model");

function addPictures(files) {
  const added = files.map((file) => {
    const picture = { file, bitmap: null, result: null, error: null };
    picture.button = document.createElement("button");
    picture.button.type = "button";
    picture.image = document.createElement("img");
    picture.image.alt = "";
    picture.small = make("small", waitingText());
    const text = make("span", file.name);
    text.append(picture.small);
    picture.button.append(picture.image, text);
    picture.button.onclick = () => choose(picture);
    const item = document.createElement("li");
    item.append(picture.button);
    element("pictures").append(item);
    pictures.push(picture);
    return picture;
  });
  if (added.length) {
    choose(added[0]);
    detectInAll(added);
  }
}

async function detectInAll(some) {
  const mine = generation;
  for (const picture of some) {
    if (mine !== generation) {
      return;
    }
    await detectInPicture(picture, mine);
  }
}

function detectInAllAgain() {
  generation += 1;
  const all = current && !current.file ? [current, ...pictures] : [...pictures];
  // Results of another model or setting are neither shown nor saved.
  for (const picture of all) {
    Object.assign(picture, { result: null, error: null });
    picture.small.textContent = waitingText();
  }
  showCurrent();
  detectInAll(all);
}

async function detectInPicture(picture, mine) {
  if (modelOpen) {
    const outcome = { result: null, error: null };
    try {
      const image = picture.file ?? (await createImageBitmap(picture.bitmap));
      outcome.result = await detector.look(image, element("verify").checked);
    } catch (error) {
      outcome.error = error.message;
    }
    if (mine !== generation) {
      return;
    }
    Object.assign(picture, outcome);
    picture.small.textContent = outcome.error ?? inAWord(outcome.result);
  }
  // Decoded for display only after the search, because the search rejects files that are no pictures or are too large.
  if (!picture.bitmap && !picture.error) {
    picture.bitmap = await shownBitmap(picture.file).catch(() => null);
    if (picture.bitmap) {
      drawThumbnail(picture);
    }
  }
  if (picture === current) {
    showCurrent();
  }
}

/** The picture as shown: upright, as in a viewer and for the model. */
async function shownBitmap(file) {
  const whole = await createImageBitmap(file);
  if (whole.width <= WIDEST_SHOWN) {
    return whole;
  }
  const resized = await createImageBitmap(whole, { resizeWidth: WIDEST_SHOWN, resizeQuality: "medium" });
  whole.close();
  return resized;
}

function drawThumbnail({ bitmap, image }) {
  const canvas = document.createElement("canvas");
  canvas.width = 112;
  canvas.height = 84;
  const scale = Math.max(112 / bitmap.width, 84 / bitmap.height);
  const [width, height] = [bitmap.width * scale, bitmap.height * scale];
  canvas.getContext("2d").drawImage(bitmap, (112 - width) / 2, (84 - height) / 2, width, height);
  image.src = canvas.toDataURL("image/jpeg", 0.8);
}

function choose(picture) {
  stopCamera();
  current = picture;
  for (const { button } of pictures) {
    button.setAttribute("aria-current", String(button === picture.button));
  }
  showCurrent();
}

/** Starts the camera, or stops it, also while it starts. */
async function toggleCamera() {
  if (camera.running) {
    stopCamera();
    return;
  }
  complain(null);
  if (!modelOpen) {
    complain("Open a grasp model first: the camera's frames are then searched.");
    return;
  }
  try {
    element("camera").setAttribute("aria-pressed", "true");
    await camera.start(detectInFrame);
  } catch (error) {
    stopCamera();
    complain(error.message);
  }
}

function stopCamera() {
  camera.stop();
  element("camera").setAttribute("aria-pressed", "false");
}

async function detectInFrame(bitmap) {
  const mine = generation;
  const shown = await createImageBitmap(bitmap);
  const result = await detector.look(bitmap, element("verify").checked);
  if (mine !== generation || !camera.running) {
    return;
  }
  if (current && !current.file) {
    current.bitmap.close();
  }
  current = { file: null, bitmap: shown, result, error: null, small: make("small", "") };
  showCurrent();
}

function showCurrent() {
  const canvas = element("picture");
  const { bitmap, result, error } = current ?? {};
  const isDrawn = Boolean(bitmap) && !error;
  element("empty").hidden = isDrawn;
  canvas.hidden = !isDrawn;
  element("grasps").hidden = true;
  element("download").hidden = !pictures.some((picture) => picture.result);
  if (!current || error) {
    say("");
  } else if (result) {
    const frames = (1000 / result.milliseconds).toFixed(1);
    say(`${inAWord(result)} · ${result.milliseconds.toFixed(0)} ms a frame (${frames} a second)`);
    listGrasps(result.record.detections);
  } else {
    say(modelOpen ? "Looking…" : "Waiting for a model.");
  }
  if (isDrawn) {
    draw(canvas, bitmap, result);
  } else if (current) {
    element("empty").textContent = error ?? (result ? "This browser cannot show this picture." : "");
  }
}

function draw(canvas, bitmap, result) {
  const record = result?.record ?? { width: bitmap.width, detections: [] };
  // The picture is shown reduced, but positions are in pixels of the original image.
  const shrink = bitmap.width / record.width;
  show(canvas, bitmap, shrink === 1 ? record.detections : record.detections.map(shrunk(shrink)), {
    refused: element("refused").checked,
  });
  canvas.setAttribute("aria-label", result ? inAWord(result) : "Not searched yet");
}

function shrunk(factor) {
  const point = ([x, y, ...more]) => [x * factor, y * factor, ...more];
  return (detection) => ({
    ...detection,
    box: detection.box.map((value) => value * factor),
    keypoints: detection.keypoints.map(point),
    polygon: detection.polygon?.map(point),
    grasp: {
      ...detection.grasp,
      x: detection.grasp.x * factor,
      y: detection.grasp.y * factor,
      width_px: detection.grasp.width_px * factor,
    },
  });
}

function listGrasps(detections) {
  const listed = detections.filter(({ score }) => element("refused").checked || score >= ACCEPTED);
  const rows = listed.map(({ score, network_score: network, agreement, grasp }) => {
    const cells = [
      score.toFixed(2),
      grasp.x.toFixed(1),
      grasp.y.toFixed(1),
      `${grasp.angle_deg.toFixed(1)}°`,
      grasp.width_px.toFixed(1),
      network === null ? "–" : network.toFixed(2),
      agreement === null ? "–" : agreement.toFixed(2),
    ];
    const row = document.createElement("tr");
    row.append(...cells.map((cell) => make("td", cell)));
    return row;
  });
  element("grasps").tBodies[0].replaceChildren(...rows);
  element("grasps").hidden = rows.length === 0;
}

function inAWord({ record }) {
  const count = record.detections.filter(({ score }) => score >= ACCEPTED).length;
  return count === 0 ? "Nothing to grasp" : count === 1 ? "One grasp" : `${count} grasps`;
}

/** One line per picture, as printed by `sdg detect --json`. */
function download() {
  const lines = pictures
    .filter(({ result }) => result)
    .map(({ file, result: { record, milliseconds } }) => {
      const detections = record.detections.filter(({ score }) => score >= ACCEPTED);
      const { width, height } = record;
      return JSON.stringify({ image: file.name, width, height, seconds: milliseconds / 1000, detections });
    });
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([lines.join("\n") + "\n"], { type: "application/jsonl" }));
  link.download = "grasps.jsonl";
  link.click();
  URL.revokeObjectURL(link.href);
}

function say(text) {
  element("status").textContent = text;
}

function complain(text) {
  element("alert").hidden = !text;
  element("alert").textContent = text ?? "";
}

function make(tag, text) {
  const made = document.createElement(tag);
  made.textContent = text;
  return made;
}

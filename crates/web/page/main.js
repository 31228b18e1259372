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
let detector = null;
let modelFile = null; // The file that is open.
let modelOpen = false;
let current = null; // A picture of the list, or the camera's last frame.
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
  element("model-file").onchange = ({ target }) => openModel(target.files[0]).finally(() => (target.value = ""));
  element("image-files").onchange = ({ target }) => {
    addPictures([...target.files]);
    target.value = "";
  };
  element("camera").onclick = toggleCamera;
  element("verify").onchange = detectInAllAgain;
  element("refused").onchange = showCurrent;
  element("download").onclick = download;
  element("webgpu").onchange = () => changeDevice();
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

/** Uses the open model on the other device; if that fails, switches back. */
async function changeDevice(opened = modelOpen ? modelFile : null) {
  stopCamera();
  if (element("webgpu").checked && !(await navigator.gpu.requestAdapter().catch(() => null))) {
    element("webgpu").checked = false;
    complain("This browser provides no graphics card to the page; the processor is used.");
    return;
  }
  generation += 1; // Results of the old worker are ignored.
  pictures.forEach(({ small }) => (small.textContent = waitingText()));
  modelOpen = false;
  detector.close();
  detector = new Detector(element("webgpu").checked ? "webgpu" : "processor");
  if (opened && !(await openModel(opened)) && element("webgpu").checked) {
    const complaint = element("alert").textContent;
    element("webgpu").checked = false;
    await changeDevice(opened);
    complain(`The graphics card cannot be used, the processor is. ${complaint}`);
  }
}

/** Opens a model and searches every picture with it; returns whether it could be opened. */
async function openModel(file) {
  if (!file) {
    return false;
  }
  complain(null);
  say(`Opening ${file.name}…`);
  try {
    const summary = await detector.open(await file.arrayBuffer());
    modelOpen = true;
    modelFile = file;
    showModel(file.name, summary);
    say("");
    detectInAllAgain();
    return true;
  } catch (error) {
    say("");
    complain(`${file.name}: ${error.message}`);
    return false;
  }
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
  if (files.length) {
    complain(null);
    stopCamera();
  }
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
  // Results of another model or setting are neither shown nor saved.
  for (const picture of pictures) {
    Object.assign(picture, { result: null, error: null });
    picture.small.textContent = waitingText();
  }
  showCurrent();
  detectInAll([...pictures]);
}

async function detectInPicture(picture, mine) {
  if (modelOpen) {
    try {
      const result = await detector.look(picture.file, element("verify").checked);
      if (mine !== generation) {
        return;
      }
      picture.result = result;
      picture.error = null;
      picture.small.textContent = inAWord(result);
    } catch (error) {
      if (mine !== generation) {
        return;
      }
      picture.result = null;
      picture.error = error.message;
      picture.small.textContent = error.message;
    }
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
  const shown = await createImageBitmap(bitmap);
  try {
    const result = await detector.look(bitmap, element("verify").checked);
    if (camera.running) {
      current?.frame?.close();
      current = { frame: shown, bitmap: shown, result };
      showCurrent();
    }
  } catch (error) {
    // The model was closed on purpose.
    if (!camera.running) {
      return;
    }
    complain(error.message);
    stopCamera();
  }
}

function showCurrent() {
  const canvas = element("picture");
  const { bitmap, result, error } = current ?? {};
  element("empty").hidden = Boolean(bitmap);
  canvas.hidden = !bitmap;
  element("grasps").hidden = true;
  element("download").hidden = !pictures.some((picture) => picture.result);
  if (error) {
    say("");
    element("empty").textContent = error;
    return;
  }
  if (!bitmap) {
    return;
  }
  const record = result?.record ?? { width: bitmap.width, detections: [] };
  // The picture is shown reduced, but positions are in pixels of the original image.
  const shrink = bitmap.width / record.width;
  show(canvas, bitmap, shrink === 1 ? record.detections : record.detections.map(shrunk(shrink)), {
    refused: element("refused").checked,
  });
  canvas.setAttribute("aria-label", result ? inAWord(result) : "Not searched yet");
  if (result) {
    const frames = (1000 / result.milliseconds).toFixed(1);
    say(`${inAWord(result)} · ${result.milliseconds.toFixed(0)} ms a frame (${frames} a second)`);
    listGrasps(record.detections);
  } else {
    say(modelOpen ? "Looking…" : "Waiting for a model.");
  }
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

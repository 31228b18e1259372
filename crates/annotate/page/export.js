// All detections as a file: CSV with one line per grasp, or JSON similar to that of "sdg detect --json".

import { element } from "./elements.js";
import { gripperOf } from "./geometry.js";
import { isFound, state, touchedBy } from "./store.js";

const POSE = ["frame", "x_mm", "y_mm", "z_mm", "yaw_deg", "opening_mm"];
const COLUMNS = ["image", "number", "found", "score", "x_px", "y_px", "angle_deg", "width_px", ...POSE, "jaws_touch"];
const rounded = (value) => Math.round(value * 1000) / 1000;

function graspOf({ marks }) {
  const { center, angle, width } = gripperOf(marks.grasp);
  return { x: rounded(center[0]), y: rounded(center[1]), angle_deg: rounded((angle * 180) / Math.PI), width_px: rounded(width) };
}

/** A field that spreadsheets read literally: quoted, and not a formula. */
function field(value) {
  const text = String(value ?? "");
  const plain = typeof value === "string" && /^[=+@-]/.test(text) ? `'${text}` : text;
  return /[",\n']/.test(plain) ? `"${plain.replaceAll('"', '""')}"` : plain;
}

/** The numbers of the detections that the jaws of `detection` touch. */
const touched = (detection, { detections }) => touchedBy(detection, detections).map((other) => detections.indexOf(other) + 1);

function rows(trial) {
  const found = trial.detections.map((detection, i) => {
    const { x, y, angle_deg: angle, width_px: width } = graspOf(detection);
    const { frame, position_mm: [px, py, pz] = [], yaw_deg: yaw, opening_mm: opening } = detection.pose ?? {};
    return [trial.name, i + 1, isFound(detection), rounded(detection.score), x, y, angle, width, frame, px, py, pz, yaw, opening, touched(detection, trial).join(" ")];
  });
  // A picture without detections has a line too.
  return found.length ? found : [[trial.name, 0, false]];
}

const record = ({ name, width, height, seconds, detections }) => ({
  image: name,
  width,
  height,
  seconds,
  detections: detections.map((detection) => ({
    score: detection.score, found: isFound(detection), box: detection.marks.box, polygon: detection.marks.outline ?? undefined,
    grasp: graspOf(detection), pose: detection.pose ?? undefined, refused: detection.refusal?.reason, jaws_touch: touched(detection, { detections }).map((n) => n - 1),
  })),
});

export function exportPictures(kind) {
  const looked = state.trialPictures.filter((trial) => trial.detections);
  const text = kind === "csv"
    ? [COLUMNS, ...looked.flatMap(rows)].map((row) => COLUMNS.map((_, i) => field(row[i])).join(",")).join("\r\n")
    : looked.map((trial) => JSON.stringify(record(trial))).join("\n");
  const url = URL.createObjectURL(new Blob([`${text}\n`], { type: kind === "csv" ? "text/csv" : "application/json" }));
  const link = element("a", { href: url, download: `${state.label}-found.${kind}` });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}

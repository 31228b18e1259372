// The picture with its detections, drawn at the resolution of the screen.

const ACCEPTED = 0.5;
/** Maximum height of a picture as a share of the window's height. */
const HIGHEST = 0.8;

const COLORS = {
  box: "#2f9e6e",
  unchecked: "#4c8dd6",
  refused: "#c24545",
  outline: "#ffd23f",
  jaw: "#ff4f7b",
  halo: "rgb(0 0 0 / 55%)",
  keypoint: "#ffffff",
};

/** Draws `bitmap` into `canvas` with its detections; refused ones only on request. */
export function show(canvas, bitmap, detections, { refused }) {
  // As wide as the space allows, and not higher than the window.
  const room = canvas.parentElement.clientWidth;
  const width = Math.min(room, (HIGHEST * window.innerHeight * bitmap.width) / bitmap.height);
  canvas.style.width = `${width}px`;
  const density = window.devicePixelRatio || 1;
  const scale = (width * density) / bitmap.width;
  canvas.width = Math.max(1, Math.round(bitmap.width * scale));
  canvas.height = Math.max(1, Math.round(bitmap.height * scale));
  const context = canvas.getContext("2d");
  context.drawImage(bitmap, 0, 0, canvas.width, canvas.height);
  // Positions are in pixels of the image, strokes in pixels of the screen.
  const brush = { context, scale, unit: 2 * density * Math.min(1, Math.max(0.5, width / 720)) };
  const shown = detections.filter((detection) => refused || detection.score >= ACCEPTED);
  for (const detection of shown.reverse()) {
    drawDetection(brush, detection); // Worst first, so that the best is on top.
  }
}

function drawDetection(brush, detection) {
  const { context, unit } = brush;
  const accepted = detection.score >= ACCEPTED;
  const color = !accepted ? COLORS.refused : detection.agreement === null ? COLORS.unchecked : COLORS.box;
  if (detection.polygon) {
    stroke(brush, [...detection.polygon, detection.polygon[0]], COLORS.outline, 0.75 * unit);
  }
  const [left, top, right, bottom] = detection.box;
  context.setLineDash(accepted ? [] : [4 * unit, 3 * unit]);
  stroke(brush, [[left, top], [right, top], [right, bottom], [left, bottom], [left, top]], color, unit);
  context.setLineDash([]);
  for (const [x, y] of detection.keypoints) {
    dot(brush, [x, y], 1.1 * unit, COLORS.keypoint);
  }
  if (accepted) {
    drawJaws(brush, detection.grasp); // The robot does not grasp refused detections.
  }
  drawLabel(brush, detection, color);
}

/** Draws the two jaws at the grasp's width; they close across the taught line. */
function drawJaws(brush, { x, y, angle_deg: degrees, width_px: width }) {
  const angle = (degrees * Math.PI) / 180;
  const along = [Math.cos(angle), Math.sin(angle)];
  const across = [-along[1], along[0]];
  const at = (l, a) => [x + l * along[0] + a * across[0], y + l * along[1] + a * across[1]];
  const half = width / 2;
  const length = Math.max(0.45 * width, (9 * brush.unit) / brush.scale);
  const back = (5 * brush.unit) / brush.scale;
  for (const side of [-1, 1]) {
    stroke(brush, [at(-length, side * half), at(length, side * half)], COLORS.jaw, 2.2 * brush.unit);
    stroke(brush, [at(0, side * half), at(0, side * (half + back))], COLORS.jaw, 2.2 * brush.unit);
  }
  stroke(brush, [at(0, -half), at(0, half)], COLORS.jaw, 0.6 * brush.unit);
  dot(brush, [x, y], 1.6 * brush.unit, COLORS.jaw);
}

function drawLabel({ context, scale, unit }, detection, color) {
  const text = detection.score.toFixed(2);
  const [left, top] = detection.box.map((value) => value * scale);
  context.font = `600 ${6.5 * unit}px system-ui, sans-serif`;
  context.textBaseline = "bottom";
  const width = context.measureText(text).width + 4 * unit;
  const height = 9 * unit;
  const x = Math.max(0, Math.min(left, context.canvas.width - width));
  const y = Math.max(height, top - unit);
  context.fillStyle = color;
  context.fillRect(x, y - height, width, height);
  context.fillStyle = "#fff";
  context.fillText(text, x + 2 * unit, y - unit);
}

function stroke({ context, scale }, points, color, width) {
  context.beginPath();
  points.forEach(([x, y], i) => (i ? context.lineTo(x * scale, y * scale) : context.moveTo(x * scale, y * scale)));
  context.lineJoin = context.lineCap = "round";
  // A dark halo makes a line visible on every picture.
  for (const [style, line] of [[COLORS.halo, 1.8 * width], [color, width]]) {
    context.strokeStyle = style;
    context.lineWidth = line;
    context.stroke();
  }
}

function dot({ context, scale }, [x, y], radius, color) {
  context.beginPath();
  context.arc(x * scale, y * scale, radius, 0, 2 * Math.PI);
  context.fillStyle = color;
  context.fill();
  context.strokeStyle = COLORS.halo;
  context.lineWidth = radius / 3;
  context.stroke();
}

// Plane geometry in pixels of the photo: x right, y down. Points are [x, y].

export const add = ([ax, ay], [bx, by]) => [ax + bx, ay + by];
export const sub = ([ax, ay], [bx, by]) => [ax - bx, ay - by];
export const times = ([x, y], k) => [x * k, y * k];
export const dot = ([ax, ay], [bx, by]) => ax * bx + ay * by;
export const norm = ([x, y]) => Math.hypot(x, y);
export const direction = (radians) => [Math.cos(radians), Math.sin(radians)];
/** Rotates by a quarter turn, clockwise as seen: from along the jaws to across them. */
export const quarter = ([x, y]) => [-y, x];
export const clamp = (value, least, most) => Math.min(Math.max(value, least), most);

/** The gripper described by marks: middle, angle in radians, length of the jaws and distance between them. */
export function gripperOf({ start, end, jaw_width }) {
  const line = sub(end, start);
  return { center: times(add(start, end), 0.5), angle: Math.atan2(line[1], line[0]), length: norm(line), width: jaw_width };
}

/** The marks of a gripper, with its ends kept inside a photo of `size`; the jaws are shortened if necessary. */
export function graspOf({ center, angle, length, width }, size) {
  const middle = [clamp(center[0], 1, size[0] - 1), clamp(center[1], 1, size[1] - 1)];
  const along = direction(angle);
  const inside = ([x, y]) => x >= 0 && y >= 0 && x <= size[0] && y <= size[1];
  let half = Math.max(length, 2) / 2;
  while (half > 1 && !(inside(add(middle, times(along, half))) && inside(sub(middle, times(along, half))))) half *= 0.97;
  const most = Math.hypot(...size);
  return { start: sub(middle, times(along, half)), end: add(middle, times(along, half)), jaw_width: clamp(width, 1, most) };
}

export const boxPolygon = ([x1, y1, x2, y2]) => [[x1, y1], [x2, y1], [x2, y2], [x1, y2]];

export function boundsOf(points) {
  const xs = points.map((p) => p[0]);
  const ys = points.map((p) => p[1]);
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
}

export const areaOf = (polygon) => Math.abs(polygon.reduce((sum, [x, y], i) => sum + polygon.at(i - 1)[0] * y - x * polygon.at(i - 1)[1], 0)) / 2;

/** The point of the edge from `a` to `b` that is nearest to a point. */
export function footOn(point, a, b) {
  const along = sub(b, a);
  return add(a, times(along, clamp(dot(sub(point, a), along) / (dot(along, along) || 1), 0, 1)));
}

/** Distance from a point to a polygon's outline. */
export const distanceTo = (polygon, point) => Math.min(...polygon.map((to, i) => norm(sub(point, footOn(point, polygon.at(i - 1), to)))));

/** Whether a point is inside a polygon: a ray to the right crosses the polygon's edges an odd number of times. */
export function isWithin([x, y], polygon) {
  return polygon.filter(([bx, by], i) => {
    const [ax, ay] = polygon.at(i - 1);
    return ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax);
  }).length % 2 === 1;
}

/** A point inside a polygon close to a point beside it: from the nearest point of the outline inwards, half as far as the polygon extends there, at most half of `depth`. */
export function nearestWithin(polygon, point, depth) {
  const foot = polygon.map((to, i) => footOn(point, polygon.at(i - 1), to)).reduce((best, p) => (norm(sub(p, point)) < norm(sub(best, point)) ? p : best));
  const way = sub(foot, point);
  const inwards = times(way, 1 / (norm(way) || 1));
  let inside = 0;
  while (inside < depth && isWithin(add(foot, times(inwards, inside + 1)), polygon)) inside += 1;
  return add(foot, times(inwards, inside / 2));
}

/** Clips a polygon at the line `dot(p, normal) = bound` and keeps the part below it. */
function cut(polygon, normal, bound) {
  const kept = [];
  polygon.forEach((to, i) => {
    const from = polygon.at(i - 1);
    const [a, b] = [dot(from, normal) - bound, dot(to, normal) - bound];
    if (a <= 0 !== b <= 0) kept.push(add(from, times(sub(to, from), a / (a - b))));
    if (b <= 0) kept.push(to);
  });
  return kept;
}

/** Extent of the part to both sides of the line within the strip swept by jaws of `length`; null if the strip misses the part. */
export function reach({ center, angle, length }, part) {
  const along = direction(angle);
  const across = quarter(along);
  const at = dot(center, along);
  const swept = cut(cut(part, along, at + length / 2), times(along, -1), length / 2 - at);
  if (!swept.length) return null;
  const offsets = swept.map((p) => dot(sub(p, center), across));
  return { least: Math.min(...offsets), most: Math.max(...offsets) };
}

/** Angles tried when a gripper is placed: five degrees apart; then those around the best one, half a degree apart. */
const TURNS = Array.from({ length: 36 }, (_, i) => (i * Math.PI) / 36 - Math.PI / 2);
const FINE_TURNS = Array.from({ length: 21 }, (_, i) => ((i - 10) * Math.PI) / 360);
/** Clearance of a placed gripper: that of both jaws together as a share of the part's width, and the minimum of each jaw in pixels. */
const ROOM = 0.08;
const MIN_ROOM_PX = 2;

export const withRoom = (width) => width + Math.max(2 * MIN_ROOM_PX, width * ROOM);

/** Lengths along the part, in its widths, over which its sides are examined; the largest over which they are straight counts. */
const SIDE_LENGTHS = [4, 2.5, 1.5, 1];
/** Maximum root mean square deviation of a straight side's points from a line, as a share of the part's width, and its minimum in pixels. */
const STRAIGHT = 0.03;
const MIN_STRAIGHT_PX = 0.7;
/** Edges at a larger angle to the jaws' direction are ends of the part, not sides. */
const MAX_ACROSS = Math.tan((35 * Math.PI) / 180);
/** Maximum angle of a correction. */
const MAX_CORRECTION = (20 * Math.PI) / 180;

/** The points of the part's outline on both sides of the jaws within `half` along them: [along, across], a pixel apart. */
function sidePoints({ center, angle, width }, part, half) {
  const along = direction(angle);
  const across = quarter(along);
  const sides = [[], []];
  part.forEach((to, i) => {
    const [a, b] = [part.at(i - 1), to].map((p) => [dot(sub(p, center), along), dot(sub(p, center), across)]);
    const [dt, ds] = sub(b, a);
    if (Math.abs(ds) > MAX_ACROSS * Math.abs(dt)) return;
    const count = Math.ceil(Math.hypot(dt, ds));
    for (let k = 0; k < count; k += 1) {
      const [t, s] = add(a, times([dt, ds], (k + 0.5) / count));
      if (Math.abs(t) <= half && Math.abs(s) < width) sides[s < 0 ? 0 : 1].push([t, s]);
    }
  });
  return sides;
}

/** The common slope of both sides, and the distance of their points from lines of that slope; null if a side has too few points. */
function commonSlope(sides, half) {
  if (sides.some((side) => side.length < Math.max(half, 3))) return null;
  const mean = (points, axis) => points.reduce((sum, p) => sum + p[axis], 0) / points.length;
  const centred = sides.flatMap((side) => {
    const middle = [mean(side, 0), mean(side, 1)];
    return side.map((p) => sub(p, middle));
  });
  const slope = centred.reduce((sum, [t, s]) => sum + t * s, 0) / centred.reduce((sum, [t]) => sum + t * t, 0);
  const off = Math.sqrt(centred.reduce((sum, [t, s]) => sum + (s - slope * t) ** 2, 0) / centred.length);
  return { slope, off };
}

/** The gripper's angle aligned with the straight sides of the part between its jaws; its own angle if they are not straight. */
export function alongSides(gripper, part) {
  const { width } = gripper;
  for (const lengths of SIDE_LENGTHS) {
    let { angle } = gripper;
    let fit = null;
    // After the rotation, the jaws cover more of the sides.
    for (let round = 0; round < 3; round += 1) {
      fit = commonSlope(sidePoints({ ...gripper, angle }, part, (lengths * width) / 2), (lengths * width) / 2);
      if (!fit) break;
      angle += Math.atan(fit.slope);
    }
    const isStraight = fit && fit.off <= Math.max(STRAIGHT * width, MIN_STRAIGHT_PX);
    if (isStraight && Math.abs(angle - gripper.angle) <= MAX_CORRECTION) return angle;
  }
  return gripper.angle;
}

/** The gripper at `point`, rotated to the smallest width of the part and centred between its sides. Of the two angles half a turn apart, the one nearer to `before` is used, if given. */
export function placedAt(point, part, { length: jawLength = null, before = null } = {}) {
  const [x1, y1, x2, y2] = boundsOf(part);
  const length = jawLength ?? Math.max(Math.hypot(x2 - x1, y2 - y1) / 6, 12);
  let best = null;
  const tryAngle = (angle) => {
    const sides = reach({ center: point, angle, length }, part);
    if (!sides || sides.least > 0 || sides.most < 0) return;
    const width = sides.most - sides.least;
    if (!best || width < best.width - 1e-9) best = { angle, width, middle: (sides.least + sides.most) / 2 };
  };
  TURNS.forEach(tryAngle);
  if (!best) return { center: point, angle: before ?? 0, length, width: length };
  const middled = (angle, middle) => add(point, times(quarter(direction(angle)), middle));
  const coarse = best.angle;
  let along = alongSides({ center: middled(coarse, best.middle), angle: coarse, width: best.width }, part);
  if (along === coarse) {
    // Without straight sides, the angle of the smallest width.
    FINE_TURNS.forEach((turn) => tryAngle(coarse + turn));
    along = best.angle;
  }
  const angle = before !== null && Math.cos(along - before) < 0 ? along + Math.PI : along;
  const { least, most } = reach({ center: point, angle, length }, part) ?? { least: -best.width / 2, most: best.width / 2 };
  return { center: middled(angle, (least + most) / 2), angle, length, width: withRoom(most - least) };
}

/** Opening at which the part just fits between the jaws, for a gripper that was drawn as a line. */
export function fittedWidth(gripper, part) {
  const sides = part && reach(gripper, part);
  return sides ? withRoom(2 * Math.max(-sides.least, sides.most, 1)) : gripper.length * 0.7;
}

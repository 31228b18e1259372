// Whether an outline looks the same when turned. Only then does the page ask; a print on the part may break the
// symmetry.

import { sub } from "./geometry.js";

/** Directions in which the outline is measured: a multiple of all the turns. */
const DIRECTIONS = 120;
/** Maximum mean difference of the measured radii, relative to their mean, for which a turned outline is the same. Chosen by hand. */
const MAX_DIFFERENCE = 0.05;

/** The area's centroid. */
function centroid(polygon) {
  let [sum, x, y] = [0, 0, 0];
  polygon.forEach(([bx, by], i) => {
    const [ax, ay] = polygon.at(i - 1);
    const cross = ax * by - bx * ay;
    [sum, x, y] = [sum + cross, x + (ax + bx) * cross, y + (ay + by) * cross];
  });
  return [x / (3 * sum), y / (3 * sum)];
}

/** Radius of the outline around its centroid in each direction; 0 if there is none. */
function radii(polygon) {
  const center = centroid(polygon);
  const points = polygon.map((point) => sub(point, center));
  return Array.from({ length: DIRECTIONS }, (_, i) => {
    const angle = (2 * Math.PI * i) / DIRECTIONS;
    const [dx, dy] = [Math.cos(angle), Math.sin(angle)];
    let most = 0;
    points.forEach((b, j) => {
      const a = points.at(j - 1);
      const edge = sub(b, a);
      const across = dx * edge[1] - dy * edge[0];
      if (Math.abs(across) < 1e-9) return;
      const along = (a[0] * edge[1] - a[1] * edge[0]) / across;
      const share = (a[0] * dy - a[1] * dx) / across;
      if (share >= 0 && share <= 1) most = Math.max(most, along);
    });
    return most;
  });
}

/** Number of turns, in a full rotation, in which an outline looks the same: 0 for any turn, 1 for none. */
export function turnsOf(polygon) {
  if (!polygon || polygon.length < 3) return 1;
  const reach = radii(polygon);
  const mean = reach.reduce((sum, r) => sum + r, 0) / DIRECTIONS;
  if (!(mean > 0)) return 1;
  const differs = (of) => reach.reduce((sum, r, i) => sum + Math.abs(r - of(i)), 0) / DIRECTIONS / mean;
  if (differs(() => mean) < MAX_DIFFERENCE / 2) return 0;
  return [6, 4, 3, 2].find((turns) => differs((i) => reach[(i + DIRECTIONS / turns) % DIRECTIONS]) < MAX_DIFFERENCE) ?? 1;
}

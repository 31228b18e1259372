//! Bodies at positions on the table, and their intersections with lines of sight.

use std::sync::Arc;

use nalgebra::Point3;

use crate::Part;
use crate::relief::{BLOCK_CELLS, Level, Texel};
use crate::tiles::floor;

use super::view::{Sight, SightRow, View};

/// Depth below the upper side from which a contact counts as on a wall, in millimetres.
const MIN_WALL_MM: f32 = 0.4;

/// Maximum number of steps along a line of sight.
const MAX_STEPS: usize = 64;

/// A part at a position.
#[derive(Debug, Clone)]
pub(crate) struct Placement {
    pub part: Arc<Part>,
    /// Position of the part's origin on the table, in millimetres.
    pub at: [f32; 2],
    /// Rotation from x to y, in radians.
    pub turn: f32,
    /// Height of the part's underside above the table, in millimetres.
    pub base: f32,
    sin_cos: [f32; 2],
    /// Index of the relief's grid that this placement uses.
    level: usize,
}

/// The intersection of a line of sight with a body.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Contact {
    /// Height above the table, in millimetres.
    pub z: f32,
    /// The grid's texel at the contact.
    pub texel: Texel,
    /// Horizontal outward normal in the table's frame if the contact is on a wall, else zero.
    pub wall: [f32; 2],
}

impl Contact {
    /// Whether the contact is on a wall.
    #[inline(always)]
    pub fn is_on_wall(&self) -> bool {
        self.wall != [0.0; 2]
    }
}

impl Placement {
    /// Places a part; `mm_per_px` determines the grid that is used.
    pub fn new(part: Arc<Part>, at: [f32; 2], turn: f32, base: f32, mm_per_px: f32) -> Self {
        let cell = 0.75 * mm_per_px;
        let level = part.relief.levels.iter().rposition(|level| level.cell <= cell).unwrap_or(0);
        let (sin, cos) = turn.sin_cos();
        Self { part, at, turn, base, sin_cos: [sin, cos], level }
    }

    fn level(&self) -> &Level {
        &self.part.relief.levels[self.level]
    }

    /// Converts a point from the part's frame to the table.
    #[inline(always)]
    pub fn to_table(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let [sin, cos] = self.sin_cos;
        [self.at[0] + cos * x - sin * y, self.at[1] + sin * x + cos * y]
    }

    /// The marks in metres, y up as in [`View::camera`](super::view::View::camera)'s frame.
    pub fn marks_m(&self) -> [Point3<f64>; 2] {
        let z = self.base + self.part.grasp.height_mm;
        [self.part.grasp.start, self.part.grasp.end].map(|mark| {
            let [x, y] = self.to_table(mark);
            Point3::new(f64::from(x), f64::from(-y), f64::from(z)) * 1e-3
        })
    }

    /// Converts a direction from the part's frame to the table's.
    #[inline(always)]
    pub fn direction_to_table(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let [sin, cos] = self.sin_cos;
        [cos * x - sin * y, sin * x + cos * y]
    }

    /// Converts a direction from the table's frame to the part's.
    #[inline(always)]
    pub fn direction_to_part(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let [sin, cos] = self.sin_cos;
        [cos * x + sin * y, cos * y - sin * x]
    }

    /// Positions in the picture of the corners of the part's bounding box.
    fn picture_corners(&self, view: &View) -> Vec<[f32; 2]> {
        let level = self.level();
        let min = self.part.relief.min;
        let max = [min[0] + level.width as f32 * level.cell, min[1] + level.height as f32 * level.cell];
        [[min[0], min[1]], [max[0], min[1]], [min[0], max[1]], [max[0], max[1]]]
            .into_iter()
            .flat_map(|corner| {
                let [x, y] = self.to_table(corner);
                [self.base, self.base + self.part.relief.top_mm]
                    .into_iter()
                    .filter_map(move |z| view.project([x, y, z]))
            })
            .collect()
    }

    /// A box of whole pixels [x0, y0, x1, y1] in the picture that contains the part; it extends at most a picture's
    /// size beyond the picture.
    pub fn picture_box(&self, view: &View) -> [i32; 4] {
        let b = self.picture_corners(view).into_iter().fold([f32::MAX, f32::MAX, f32::MIN, f32::MIN], |b, [x, y]| {
            [b[0].min(x), b[1].min(y), b[2].max(x), b[3].max(y)]
        });
        let (w, h) = (view.width as f32, view.height as f32);
        let (x0, x1) = (b[0].floor().clamp(-w, 2.0 * w), b[2].ceil().clamp(-w, 2.0 * w));
        let (y0, y1) = (b[1].floor().clamp(-h, 2.0 * h), b[3].ceil().clamp(-h, 2.0 * h));
        [x0 as i32, y0 as i32, (x1 as i32).max(x0 as i32), (y1 as i32).max(y0 as i32)]
    }

    /// For each row of a box of pixels, the columns [first, end) that contain the part: those between the corners of
    /// its bounding box.
    pub fn row_spans(&self, view: &View, bounds: [i32; 4]) -> Vec<[i32; 2]> {
        let corners = self.picture_corners(view);
        (bounds[1]..bounds[3])
            .map(|row| {
                let (upper, lower) = (row as f32 - 0.5, row as f32 + 1.5);
                let mut span = [f32::MAX, f32::MIN];
                for (k, a) in corners.iter().enumerate() {
                    for b in &corners[k..] {
                        let (high, low) = if a[1] < b[1] { (a, b) } else { (b, a) };
                        if high[1] > lower || low[1] < upper {
                            continue;
                        }
                        // The segment of the line within the row.
                        let fall = (low[1] - high[1]).max(1e-6);
                        for y in [high[1].max(upper), low[1].min(lower)] {
                            let x = high[0] + (low[0] - high[0]) * ((y - high[1]) / fall).clamp(0.0, 1.0);
                            span = [span[0].min(x), span[1].max(x)];
                        }
                    }
                }
                let first = (span[0].floor().max(-1e6) as i32 - 1).clamp(bounds[0], bounds[2]);
                [first, (span[1].ceil().min(1e6) as i32 + 1).clamp(first, bounds[2])]
            })
            .collect()
    }

    /// The lines of sight of a row of the picture in the part's grid: positions in cells, heights in millimetres from
    /// the part's underside.
    #[inline]
    pub fn grid_row(&self, row: &SightRow) -> SightRow {
        let (min, inverse) = (self.part.relief.min, 1.0 / self.level().cell);
        let turned = |v: [f32; 2]| self.direction_to_part(v).map(|c| c * inverse);
        row.in_frame(turned, self.at, min.map(|v| v * inverse), self.base)
    }

    /// Maximum number of cells of the part's grid between neighbouring pixels of a row, within a box of pixels.
    pub fn cells_per_px(&self, view: &View, [x0, y0, x1, y1]: [i32; 4]) -> f32 {
        // The extreme distances to the camera are at the corners of the box.
        let apart = |x: i32, y: i32| {
            let row = self.grid_row(&view.row(y as f32));
            let ([ax, ay], [bx, by]) = (row.at(x as f32).foot, row.at(x as f32 + 1.0).foot);
            (bx - ax).hypot(by - ay)
        };
        [apart(x0, y0), apart(x1, y0), apart(x0, y1), apart(x1, y1)].into_iter().fold(0.0, f32::max)
    }

    /// Whether all lines of sight within `reach` cells of the given one miss the part; false if that is not certain.
    #[inline]
    pub fn is_clear_around(&self, sight: &Sight, reach: f32) -> bool {
        let (level, top_mm) = (self.level(), self.part.relief.top_mm);
        let [dx, dy] = sight.drift.map(|d| d * top_mm);
        let [x, y] = sight.at(0.5 * top_mm);
        let reach = reach + 0.5 * (dx * dx + dy * dy).sqrt();
        let (width, height) = (level.width as f32, level.height as f32);
        if x < -reach || y < -reach || x > width + reach || y > height + reach {
            return true;
        }
        let on_grid = x >= 0.0 && y >= 0.0 && x < width && y < height;
        on_grid && reach < BLOCK_CELLS as f32 && level.top_around(x, y) == 0
    }

    /// The first intersection of a line of sight in the part's grid with the part.
    #[inline]
    pub fn meet(&self, sight: &Sight) -> Option<Contact> {
        let relief = &self.part.relief;
        let level = self.level();
        let Sight { foot: start, drift } = *sight;
        // The heights between which the line of sight is above the grid.
        let (mut high, mut low) = (relief.top_mm, 0.0f32);
        for (s, d, size) in [(start[0], drift[0], level.width as f32), (start[1], drift[1], level.height as f32)] {
            let upper = s + d * relief.top_mm;
            let (near, far) = (s.min(upper), s.max(upper));
            if near >= 0.0 && far < size {
                continue;
            }
            if far < 0.0 || near >= size {
                return None;
            }
            let (a, b) = ((0.0 - s) / d, (size - s) / d);
            high = high.min(a.max(b));
            low = low.max(a.min(b));
        }
        if high < low {
            return None;
        }
        let slant = (drift[0] * drift[0] + drift[1] * drift[1]).sqrt();
        if slant * (high - low) < 2.0 * BLOCK_CELLS as f32 {
            // The whole segment is within `BLOCK_CELLS` of its middle.
            let middle = 0.5 * (high + low);
            let (gx, gy) = (start[0] + drift[0] * middle, start[1] + drift[1] * middle);
            high = high.min(level.top_around(gx, gy) as f32 * relief.step);
            if high <= 0.0 || high < low {
                return None;
            }
        }
        let steps = (floor(slant * (high - low)) as usize + 1).clamp(1, MAX_STEPS);
        let step = (high - low) / steps as f32;
        let mut above = high + step;
        for k in 0..=steps {
            let z = high - step * k as f32;
            let (gx, gy) = (start[0] + drift[0] * z, start[1] + drift[1] * z);
            let (column, row) = (floor(gx), floor(gy));
            let texel = level.get(column, row);
            let top = texel.top as f32 * relief.step;
            if texel.top > 0 && z <= top + 0.01 && above >= texel.bottom as f32 * relief.step {
                if top > above + MIN_WALL_MM {
                    let z = 0.5 * (z + above).min(2.0 * top);
                    let wall = self.wall_normal(level, column, row, drift);
                    return Some(Contact { z: z + self.base, texel, wall });
                }
                // The intersection with the upper side.
                let exact = level.get(floor(start[0] + drift[0] * top), floor(start[1] + drift[1] * top));
                let texel = if exact.top > 0 && exact.top.abs_diff(texel.top) < 100 { exact } else { texel };
                return Some(Contact { z: top + self.base, texel, wall: [0.0; 2] });
            }
            above = z;
        }
        None
    }

    /// The horizontal direction in which heights fall, in the table's frame.
    fn wall_normal(&self, level: &Level, gx: i32, gy: i32, drift: [f32; 2]) -> [f32; 2] {
        let top = |dx: i32, dy: i32| f32::from(level.get(gx + dx, gy + dy).top);
        let mut fall = [0.0f32; 2];
        for reach in [1, 2, 3] {
            fall[0] += top(-reach, 0) - top(reach, 0);
            fall[1] += top(0, -reach) - top(0, reach);
        }
        if fall == [0.0; 2] {
            fall = [drift[0], drift[1] + 1e-6];
        }
        let norm = (fall[0] * fall[0] + fall[1] * fall[1]).sqrt();
        self.direction_to_table([fall[0] / norm, fall[1] / norm])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether one of many small steps along a line of sight in the grid ends inside the part.
    fn is_met_in_small_steps(body: &Placement, sight: &Sight) -> bool {
        let (relief, level) = (&body.part.relief, body.level());
        (0..=400).any(|k| {
            let z = relief.top_mm * k as f32 / 400.0;
            let [x, y] = sight.at(z);
            let texel = level.get(x.floor() as i32, y.floor() as i32);
            texel.top > 0 && z <= texel.top as f32 * relief.step && z >= texel.bottom as f32 * relief.step
        })
    }

    #[test]
    fn what_is_passed_over_is_clear() {
        let (mut clear, mut met) = (0, 0);
        for (seed, tilt) in [(1, 0.0), (2, 0.3), (3, 0.3), (4, 0.1)] {
            let view = View::new(320, 240, 275.0, 400.0, tilt, 1.1);
            let body = Placement::new(Arc::new(Part::generate(seed)), [20.0, -10.0], 0.7, 0.0, view.mm_per_px());
            let bounds = body.picture_box(&view);
            let reach = 1.5 * body.cells_per_px(&view, bounds);
            for y in bounds[1]..bounds[3] {
                let row = body.grid_row(&view.row(y as f32 + 0.5));
                for x in (bounds[0]..bounds[2]).step_by(4) {
                    let is_clear = body.is_clear_around(&row.at((x + 2) as f32), reach);
                    for sight in (x..x + 4).map(|x| row.at(x as f32 + 0.5)) {
                        let is_met = is_met_in_small_steps(&body, &sight);
                        assert!(!(is_clear && is_met), "part {seed}, row {y}, group at {x}");
                        clear += usize::from(is_clear);
                        met += usize::from(is_met);
                    }
                }
            }
        }
        assert!(clear > 1000 && met > 1000, "{clear} clear, {met} met");
    }
}

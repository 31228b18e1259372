//! Bodies at places on the table, and what a line of sight meets of them.

use std::sync::Arc;

use crate::Part;
use crate::relief::{Level, Texel};

use super::view::{Sight, View};

/// A wall is what a sight meets this far below the upper side, in millimetres.
const MIN_WALL_MM: f32 = 0.4;

/// The most steps along a line of sight.
const MAX_STEPS: usize = 64;

/// A part at a place.
#[derive(Debug, Clone)]
pub(crate) struct Placement {
    pub part: Arc<Part>,
    /// Where the part's origin lies on the table, in millimetres.
    pub at: [f32; 2],
    /// Turn from x to y, in radians.
    pub turn: f32,
    /// Height of the part's underside above the table.
    pub base: f32,
    sin_cos: [f32; 2],
    /// Which of the relief's grids is read.
    level: usize,
}

/// What a line of sight meets.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contact {
    /// Height above the table.
    pub z: f32,
    /// The grid's texel there.
    pub texel: Texel,
    /// Horizontal outward normal in the table's frame, where the contact is on a wall.
    pub wall: Option<[f32; 2]>,
}

impl Placement {
    /// Places a part; `mm_per_px` chooses how finely it is read.
    pub fn new(part: Arc<Part>, at: [f32; 2], turn: f32, base: f32, mm_per_px: f32) -> Self {
        let cell = 0.75 * mm_per_px;
        let level = part.relief.levels.iter().rposition(|level| level.cell <= cell).unwrap_or(0);
        let (sin, cos) = turn.sin_cos();
        Self { part, at, turn, base, sin_cos: [sin, cos], level }
    }

    fn level(&self) -> &Level {
        &self.part.relief.levels[self.level]
    }

    /// A place in the part's frame, on the table.
    #[inline(always)]
    pub fn to_table(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let [sin, cos] = self.sin_cos;
        [self.at[0] + cos * x - sin * y, self.at[1] + sin * x + cos * y]
    }

    /// A direction in the part's frame, in the table's.
    #[inline(always)]
    pub fn direction_to_table(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let [sin, cos] = self.sin_cos;
        [cos * x - sin * y, sin * x + cos * y]
    }

    /// A direction in the table's frame, in the part's.
    #[inline(always)]
    pub fn direction_to_part(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        let [sin, cos] = self.sin_cos;
        [cos * x + sin * y, cos * y - sin * x]
    }

    /// The box in the picture that the part cannot leave: whole pixels [x0, y0, x1, y1], not clipped.
    pub fn picture_box(&self, view: &View) -> [i32; 4] {
        let level = self.level();
        let min = self.part.relief.min;
        let max = [min[0] + level.width as f32 * level.cell, min[1] + level.height as f32 * level.cell];
        let mut b = [f32::MAX, f32::MAX, f32::MIN, f32::MIN];
        for corner in [[min[0], min[1]], [max[0], min[1]], [min[0], max[1]], [max[0], max[1]]] {
            let [x, y] = self.to_table(corner);
            for z in [self.base, self.base + self.part.relief.top_mm] {
                if let Some([px, py]) = view.project([x, y, z]) {
                    b = [b[0].min(px), b[1].min(py), b[2].max(px), b[3].max(py)];
                }
            }
        }
        [b[0].floor() as i32, b[1].floor() as i32, b[2].ceil() as i32, b[3].ceil() as i32]
    }

    /// The first point of the part along a line of sight.
    #[inline]
    pub fn meet(&self, sight: &Sight) -> Option<Contact> {
        let relief = &self.part.relief;
        let level = self.level();
        let inverse = 1.0 / level.cell;
        // Grid coordinates at the part's underside, and their change for a millimetre of height.
        let foot = sight.at(self.base);
        let local = self.direction_to_part([foot[0] - self.at[0], foot[1] - self.at[1]]);
        let start = [(local[0] - relief.min[0]) * inverse, (local[1] - relief.min[1]) * inverse];
        let drift = self.direction_to_part(sight.drift).map(|d| d * inverse);
        // The heights between which the sight is above the grid.
        let (mut high, mut low) = (relief.top_mm, 0.0f32);
        for (s, d, size) in [(start[0], drift[0], level.width as f32), (start[1], drift[1], level.height as f32)] {
            if d.abs() < 1e-6 {
                if s < 0.0 || s >= size {
                    return None;
                }
                continue;
            }
            let (a, b) = ((0.0 - s) / d, (size - s) / d);
            high = high.min(a.max(b));
            low = low.max(a.min(b));
        }
        if high < low {
            return None;
        }
        let sideways = drift[0].hypot(drift[1]) * (high - low);
        let steps = (sideways.ceil() as usize + 1).min(MAX_STEPS);
        let step = (high - low) / steps as f32;
        let mut above = high + step;
        for k in 0..=steps {
            let z = high - step * k as f32;
            let (gx, gy) = (start[0] + drift[0] * z, start[1] + drift[1] * z);
            let texel = level.get(gx as i32, gy as i32);
            let top = texel.top as f32 * relief.step;
            if texel.top > 0 && z <= top + 0.01 && above >= texel.bottom as f32 * relief.step {
                if top > above + MIN_WALL_MM {
                    let z = 0.5 * (z + above).min(2.0 * top);
                    let wall = self.wall_normal(level, gx as i32, gy as i32, drift);
                    return Some(Contact { z: z + self.base, texel, wall: Some(wall) });
                }
                // Where the sight passes the upper side.
                let exact = level.get((start[0] + drift[0] * top) as i32, (start[1] + drift[1] * top) as i32);
                let texel = if exact.top > 0 && exact.top.abs_diff(texel.top) < 100 { exact } else { texel };
                return Some(Contact { z: top + self.base, texel, wall: None });
            }
            above = z;
        }
        None
    }

    /// The direction in which heights fall, horizontal, in the table's frame.
    fn wall_normal(&self, level: &Level, gx: i32, gy: i32, drift: [f32; 2]) -> [f32; 2] {
        let top = |dx: i32, dy: i32| f32::from(level.get(gx + dx, gy + dy).top);
        let mut fall = [0.0f32; 2];
        for reach in [1, 2, 3] {
            fall[0] += top(-reach, 0) - top(reach, 0);
            fall[1] += top(0, -reach) - top(0, reach);
        }
        if fall[0].hypot(fall[1]) < 1.0 {
            fall = drift;
        }
        let norm = fall[0].hypot(fall[1]).max(1e-6);
        self.direction_to_table([fall[0] / norm, fall[1] / norm])
    }
}

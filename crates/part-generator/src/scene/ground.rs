//! The heights of all bodies on the table as a grid; shadows and contact darkening computed from it.

use super::color_grid::bilinear;
use super::placement::Placement;
use crate::tiles::floor;

/// Heights above the table, seen from straight above.
pub(crate) struct Ground {
    min: [f32; 2],
    cell: f32,
    inverse_cell: f32,
    width: usize,
    height: usize,
    tops: Vec<f32>,
    /// Heights blurred over some millimetres: the amount of material around a position.
    blurred: Vec<f32>,
    /// Light on the table: red, green, blue, and a factor for reflections.
    table_light: Vec<[f32; 4]>,
}

/// Height below which a position is in shadow, for several directions of one lamp.
pub(crate) struct Shadow {
    /// For each cell, the heights for the lamp's directions.
    heights: Vec<[f32; SWEEPS]>,
    inverse_softness: f32,
}

/// Directions that sample a lamp's width: fractions of its radius sideways and upwards.
const LAMP_DIRECTIONS: [[f32; 2]; SWEEPS] = [[0.7, 0.5], [-0.7, 0.5], [0.0, -0.9], [0.0, 0.0]];

/// Number of sweeps.
const SWEEPS: usize = 4;

impl Ground {
    /// An empty grid over a box of the table.
    pub fn new(bounds: [f32; 4], cell: f32) -> Self {
        let min = [bounds[0] - 8.0 * cell, bounds[1] - 8.0 * cell];
        let count = |low: f32, high: f32| ((high - low) / cell).ceil().clamp(1.0, 1024.0) as usize + 16;
        let (width, height) = (count(bounds[0], bounds[2]), count(bounds[1], bounds[3]));
        Self {
            min,
            cell,
            inverse_cell: 1.0 / cell,
            width,
            height,
            tops: vec![0.0; width * height],
            blurred: Vec::new(),
            table_light: Vec::new(),
        }
    }

    /// The cell of a position; `None` outside.
    #[inline(always)]
    pub fn index(&self, [x, y]: [f32; 2]) -> Option<usize> {
        let (gx, gy) = ((x - self.min[0]) * self.inverse_cell, (y - self.min[1]) * self.inverse_cell);
        let inside = gx >= 0.0 && gy >= 0.0 && gx < self.width as f32 && gy < self.height as f32;
        inside.then(|| floor(gy).max(0) as usize * self.width + floor(gx).max(0) as usize)
    }

    /// Calls `visit` with the index of each cell covered by a body, and the top of the body in that cell.
    fn cells(&self, body: &Placement, cell: f32, mut visit: impl FnMut(usize, f32)) {
        let relief = &body.part.relief;
        let level = relief.level_for(cell);
        for y in 0..level.height {
            for x in 0..level.width {
                let texel = level.texels[y * level.width + x];
                if texel.top > 0
                    && let Some(idx) = self.index(body.to_table(relief.place(level, x, y)))
                {
                    visit(idx, texel.top as f32 * relief.step);
                }
            }
        }
    }

    /// Adds a body to the grid.
    pub fn put(&mut self, body: &Placement) {
        let mut tops = std::mem::take(&mut self.tops);
        let base = body.base;
        self.cells(body, 0.75 * self.cell, |idx, top| tops[idx] = tops[idx].max(base + top));
        self.tops = tops;
    }

    /// The highest point under a body, and the fraction of its cells above other bodies.
    pub fn under(&self, body: &Placement) -> (f32, f32) {
        let (mut highest, mut shared, mut count) = (0.0f32, 0usize, 0usize);
        self.cells(body, 2.0 * self.cell, |idx, _| {
            count += 1;
            shared += usize::from(self.tops[idx] > 0.0);
            highest = highest.max(self.tops[idx]);
        });
        (highest, shared as f32 / count.max(1) as f32)
    }

    /// Prepares contact darkening: mean heights over `radius` millimetres.
    pub fn blur(&mut self, radius: f32) {
        let reach = ((radius / self.cell).round() as usize).clamp(1, 24);
        let (width, height) = (self.width, self.height);
        let norm = 1.0 / (2 * reach + 1) as f32;
        let mut rows = vec![0.0f32; width * height];
        for (source, target) in self.tops.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
            let mut sum: f32 = source[..reach.min(width)].iter().sum();
            for x in 0..width {
                sum += if x + reach < width { source[x + reach] } else { 0.0 };
                sum -= if x > reach { source[x - reach - 1] } else { 0.0 };
                target[x] = sum * norm;
            }
        }
        let mut blurred = vec![0.0f32; width * height];
        let mut sums = vec![0.0f32; width];
        for y in 0..reach.min(height) {
            sums.iter_mut().zip(&rows[y * width..]).for_each(|(sum, v)| *sum += v);
        }
        for y in 0..height {
            if y + reach < height {
                sums.iter_mut().zip(&rows[(y + reach) * width..]).for_each(|(sum, v)| *sum += v);
            }
            if y > reach {
                sums.iter_mut().zip(&rows[(y - reach - 1) * width..]).for_each(|(sum, v)| *sum -= v);
            }
            blurred[y * width..(y + 1) * width].iter_mut().zip(&sums).for_each(|(b, sum)| *b = sum * norm);
        }
        self.blurred = blurred;
    }

    /// Fraction of the ambient light that reaches height `z` above a cell; it is smaller beside and between bodies.
    #[inline(always)]
    pub fn openness(&self, cell: Option<usize>, z: f32, radius: f32) -> f32 {
        open_share(cell.map_or(0.0, |idx| self.blurred[idx]), z, radius)
    }

    /// The shadows of a lamp with an angular radius of `radius` radians in a direction (x, y, z up, a unit vector).
    pub fn shadow(&self, direction: [f32; 3], radius: f32) -> Shadow {
        let level = direction[0].hypot(direction[1]);
        let azimuth = direction[1].atan2(direction[0]);
        let elevation = direction[2].atan2(level);
        let mut heights = vec![[0.0; SWEEPS]; self.tops.len()];
        for (k, [aside, up]) in LAMP_DIRECTIONS.into_iter().enumerate() {
            let raised = (elevation + up * radius).clamp(0.15, 1.55);
            self.sweep(azimuth + aside * radius / elevation.cos().max(0.2), raised.tan(), k, &mut heights);
        }
        Shadow { heights, inverse_softness: self.inverse_cell / elevation.tan().min(4.0) }
    }

    /// Propagates heights away from the light, falling by `slope` per millimetre, into component `k` of `shade`.
    fn sweep(&self, azimuth: f32, slope: f32, k: usize, shade: &mut [[f32; SWEEPS]]) {
        let (sin, cos) = azimuth.sin_cos();
        let along_x = cos.abs() >= sin.abs();
        let (major, minor) = if along_x { (cos, sin) } else { (sin, cos) };
        let (count, across) = if along_x { (self.width, self.height) } else { (self.height, self.width) };
        let (stride, stride_across) = if along_x { (1, self.width) } else { (self.width, 1) };
        let lean = minor / major.abs();
        let fall = self.cell / major.abs() * slope;
        // A line of cells across the direction of propagation: the maximum of the cell's height and of the shadow. It
        // has two extra cells at both ends, because a lean of -1 to 1 reads beyond the ends.
        let (mut before, mut line) = (vec![0.0f32; across + 4], vec![0.0f32; across]);
        let shift = lean.floor();
        let share = lean - shift;
        let first = (2 + shift as i32) as usize;
        // From the lit side to the opposite side.
        for step in 0..count {
            let at = if major > 0.0 { count - 1 - step } else { step };
            for ((carried, a), b) in line.iter_mut().zip(&before[first..]).zip(&before[first + 1..]) {
                *carried = (a + (b - a) * share - fall).max(0.0);
            }
            let start = at * stride;
            if stride_across == 1 {
                let tops = &self.tops[start..start + across];
                let cells = shade[start..start + across].iter_mut();
                for (((carried, top), cell), next) in line.iter().zip(tops).zip(cells).zip(&mut before[2..]) {
                    cell[k] = *carried;
                    *next = carried.max(*top);
                }
            } else {
                let tops = self.tops[start..].iter().step_by(stride_across);
                let cells = shade[start..].iter_mut().step_by(stride_across);
                for (((carried, top), cell), next) in line.iter().zip(tops).zip(cells).zip(&mut before[2..]) {
                    cell[k] = *carried;
                    *next = carried.max(*top);
                }
            }
        }
    }

    /// Fraction of a lamp's light that reaches height `z` above a cell.
    #[inline(always)]
    pub fn light(&self, shadow: &Shadow, cell: Option<usize>, z: f32) -> f32 {
        cell.map_or(1.0, |idx| shadow.light_at(idx, z))
    }

    /// Prepares the light on the table: `light` gets a position and the fractions of the ambient light and of each
    /// lamp, and returns red, green, blue and a factor for reflections.
    pub fn light_table(&mut self, radius: f32, shadows: &[Shadow], light: impl Fn([f32; 2], f32, &[f32]) -> [f32; 4]) {
        let mut reached = vec![1.0; shadows.len()];
        let mut made = Vec::with_capacity(self.tops.len());
        for y in 0..self.height {
            for x in 0..self.width {
                let idx = y * self.width + x;
                let place = [self.min[0] + (x as f32 + 0.5) * self.cell, self.min[1] + (y as f32 + 0.5) * self.cell];
                reached.iter_mut().zip(shadows).for_each(|(share, shadow)| *share = shadow.light_at(idx, 0.0));
                made.push(light(place, open_share(self.blurred[idx], 0.0, radius), &reached));
            }
        }
        self.table_light = made;
    }

    /// The values prepared by [`light_table`](Self::light_table), interpolated between cells.
    #[inline(always)]
    pub fn on_table(&self, [x, y]: [f32; 2]) -> [f32; 4] {
        let x = (x - self.min[0]) * self.inverse_cell - 0.5;
        let y = (y - self.min[1]) * self.inverse_cell - 0.5;
        bilinear(&self.table_light, [self.width, self.height], x, y)
    }
}

/// Fraction of the ambient light that reaches height `z` if the surroundings have the height `around`.
#[inline(always)]
fn open_share(around: f32, z: f32, radius: f32) -> f32 {
    1.0 - 0.55 * ((around - z) / (0.7 * radius)).clamp(0.0, 1.0)
}

impl Shadow {
    #[inline(always)]
    fn light_at(&self, idx: usize, z: f32) -> f32 {
        let lit = self.heights[idx].map(|height| (1.0 - (height - z - 0.15) * self.inverse_softness).clamp(0.0, 1.0));
        0.25 * (lit[0] + lit[1] + lit[2] + lit[3])
    }
}

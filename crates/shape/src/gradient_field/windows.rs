//! A level of a large picture, computed only where it is read.
//!
//! ```text
//! ┌────────────────────────┐
//! │    ┌────────┐          │   a cell, and the window about it: all points within `margin` of any
//! │    │ ┌────┐ │          │   point of the cell can be read in the window
//! │    │ │cell│ │          │
//! │    │ └────┘ │          │
//! │    └────────┘          │
//! └────────────────────────┘
//! ```
//! A search follows few places to the finest level; for a picture of twelve megapixels with a small part, the windows
//! around them contain a tenth of the pixels.

use std::sync::OnceLock;

use super::level::{GradientLevel, floor_of, quiet_energy};
use super::tensors::{Planes, structure_tensors, tensors_of_part};
use crate::config::GradientConfig;
use crate::parallel;

/// Side of a cell, in level pixels. Chosen by hand to save time.
const CELL: usize = 128;
/// Margins of windows in level pixels; the smallest that covers the read area is used. Chosen by hand to save time.
const MARGINS: [usize; 5] = [96, 160, 256, 384, 512];
/// Added to the requested area, for interpolation between pixels.
const LEEWAY: f64 = 2.0;
/// Number of rows from whose pixels the noise is estimated. Chosen by hand to save time.
const QUIET_ROWS: usize = 32;
/// Number of pixels from which the noise is estimated, in all rows together. Chosen by hand to save time.
const QUIET_PIXELS: usize = 4096;

/// The level, and the windows computed so far.
#[derive(Debug, Clone)]
pub(super) struct Windows {
    planes: Planes,
    floor: f32,
    whole: OnceLock<GradientLevel>,
    /// By margin, and by cell from left to right in rows.
    windows: [Vec<OnceLock<GradientLevel>>; MARGINS.len()],
}

impl Windows {
    pub(super) fn new(planes: Planes, config: &GradientConfig) -> Self {
        let rows: Vec<usize> = (0..QUIET_ROWS).map(|k| (2 * k + 1) * planes.height / (2 * QUIET_ROWS)).collect();
        let step = (QUIET_ROWS * planes.width / QUIET_PIXELS).max(1);
        let of_row = |&row: &usize| -> Vec<[f32; 4]> {
            tensors_of_part(&planes, [0, row], [planes.width, 1]).into_iter().step_by(step).collect()
        };
        let floor = floor_of(quiet_energy(&parallel::map(&rows, of_row).concat()), config);
        let num_cells = planes.width.div_ceil(CELL) * planes.height.div_ceil(CELL);
        Self { planes, floor, whole: OnceLock::new(), windows: MARGINS.map(|_| vec![OnceLock::new(); num_cells]) }
    }

    pub(super) fn size(&self) -> [usize; 2] {
        [self.planes.width, self.planes.height]
    }

    /// The whole level, for the sweep and for a reach beyond the largest margin. Computed before the lock is taken: a
    /// thread that waits for others must not hold a lock.
    pub(super) fn whole(&self) -> &GradientLevel {
        match self.whole.get() {
            Some(whole) => whole,
            None => {
                let whole = GradientLevel::of(&self.planes, structure_tensors(&self.planes), self.floor);
                self.whole.get_or_init(|| whole)
            }
        }
    }

    /// The samples that can be read within `reach` of a place, in level pixels.
    pub(super) fn about(&self, center: [f64; 2], reach: f64) -> &GradientLevel {
        let size = self.size();
        let fits = MARGINS.iter().position(|&margin| reach + LEEWAY <= margin as f64);
        let Some((idx, &margin)) = fits.map(|idx| (idx, &MARGINS[idx])) else { return self.whole() };
        // A place outside the picture is read at the border, which is in the nearest cell's window.
        let cell = [0, 1].map(|k| (center[k].max(0.0) as usize / CELL).min((size[k] - 1) / CELL));
        self.windows[idx][cell[1] * size[0].div_ceil(CELL) + cell[0]].get_or_init(|| {
            let corner = cell.map(|at| (at * CELL).saturating_sub(margin));
            let end = [0, 1].map(|k| ((cell[k] + 1) * CELL + margin).min(size[k]));
            GradientLevel::window(&self.planes, corner, [end[0] - corner[0], end[1] - corner[1]], self.floor)
        })
    }
}

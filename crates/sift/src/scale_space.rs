//! The scale space: the image at increasing blur, with an octave for each halving.
//!
//! ```text
//! octave o, S intervals:   level 0 ─ 1 ─ … ─ S ─ S+1 ─ S+2      σ = base · 2^(level / S), in the octave's own pixels
//!                                            └─ every second pixel ─► level 0 of octave o + 1
//! ```
//!
//! Differences of neighbouring levels are computed when they are read: storing them would take more time than
//! computing them twice.

use crate::blur::{GaussianKernel, blur, double, halve};
use crate::{Plane, SiftConfig};

/// Minimum distance of extrema from the border, in pixels of the octave. Nearer to the border, the mirrored image
/// affects their derivatives most.
pub(crate) const BORDER: usize = 5;

/// The levels of one octave.
pub(crate) struct Octave {
    /// S + 3 planes of one size, with increasing blur.
    pub levels: Vec<Plane>,
    /// Pixels of the image per pixel of the octave.
    pub pixel_size: f64,
    /// Position in the image of the centre of pixel 0; that of pixel `i` is `i * pixel_size + center`.
    pub center: f64,
}

impl Octave {
    /// The position in the image of a point of the octave, given as a pixel index with a fraction.
    pub(crate) fn to_image(&self, index: f64) -> f64 {
        index * self.pixel_size + self.center
    }

    pub(crate) fn width(&self) -> usize {
        self.levels[0].width()
    }

    pub(crate) fn height(&self) -> usize {
        self.levels[0].height()
    }

    /// Level `s` + 1 minus level `s`.
    #[inline(always)]
    pub(crate) fn difference(&self, s: usize, x: usize, y: usize) -> f32 {
        self.levels[s + 1].at(x, y) - self.levels[s].at(x, y)
    }
}

/// Memory of finished scale spaces.
#[derive(Default)]
pub(crate) struct PlanePool(Vec<Vec<f32>>);

impl PlanePool {
    fn plane(&mut self, width: usize, height: usize) -> Plane {
        // The pool is filled in reverse order, so its last plane is usually of the wanted size.
        Plane::recycled(width, height, self.0.pop().unwrap_or_default())
    }

    /// Takes back the memory of a scale space.
    pub(crate) fn recycle(&mut self, octaves: Vec<Octave>) {
        self.0.clear();
        for octave in octaves.into_iter().rev() {
            self.0.extend(octave.levels.into_iter().rev().map(Plane::into_data));
        }
    }
}

/// Builds all octaves of an image that are large enough for extrema.
pub(crate) fn build(image: &Plane, config: &SiftConfig, pool: &mut PlanePool) -> Vec<Octave> {
    let num_levels = config.intervals + 3;
    // One kernel per level, the same in each octave: the blur from the previous level to this one.
    let step = |level: usize| {
        let (to, from) = (config.sigma_of_level(level as f64), config.sigma_of_level(level as f64 - 1.0));
        GaussianKernel::new((to * to - from * from).sqrt())
    };
    let steps: Vec<GaussianKernel> = (1..num_levels).map(step).collect();

    let mut octaves: Vec<Octave> = Vec::new();
    loop {
        let mut levels = Vec::with_capacity(num_levels);
        let (pixel_size, center) = match octaves.last() {
            None if config.double_first_octave => (0.5, 0.25),
            None => (1.0, 0.5),
            Some(above) => (2.0 * above.pixel_size, above.center),
        };
        match octaves.last() {
            None => levels.push(first_level(image, config, pool)),
            Some(above) => {
                let mut level = pool.plane(above.width().div_ceil(2), above.height().div_ceil(2));
                halve(&above.levels[config.intervals], &mut level);
                levels.push(level);
            }
        }
        if levels[0].width().min(levels[0].height()) <= 2 * BORDER {
            return octaves;
        }
        for (i, kernel) in steps.iter().enumerate() {
            let mut level = pool.plane(levels[0].width(), levels[0].height());
            blur(&levels[i], &mut level, kernel);
            levels.push(level);
        }
        octaves.push(Octave { levels, pixel_size, center });
    }
}

/// The image, doubled if so configured, with its blur increased from the camera's blur to `base_sigma`.
fn first_level(image: &Plane, config: &SiftConfig, pool: &mut PlanePool) -> Plane {
    let factor = if config.double_first_octave { 2 } else { 1 };
    let (width, height) = (factor * image.width(), factor * image.height());
    let mut level = pool.plane(width, height);
    let has_sigma = factor as f64 * config.input_sigma;
    let missing = config.base_sigma.powi(2) - has_sigma.powi(2);
    // An image with more blur than the base is not changed.
    let kernel = GaussianKernel::new(missing.max(0.0).sqrt());
    if config.double_first_octave {
        let mut doubled = pool.plane(width, height);
        double(image, &mut doubled);
        blur(&doubled, &mut level, &kernel);
        // The next level has the same size and reuses this memory.
        pool.0.push(doubled.into_data());
    } else {
        blur(image, &mut level, &kernel);
    }
    level
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_blob_stays_in_its_place_through_the_octaves() {
        let (x, y) = (70.3, 41.8);
        let image = Plane::from_fn(160, 120, |col, row| {
            let (dx, dy) = (f64::from(col) + 0.5 - x, f64::from(row) + 0.5 - y);
            (-(dx * dx + dy * dy) / 50.0).exp() as f32
        });
        for double_first_octave in [false, true] {
            let config = SiftConfig { double_first_octave, ..SiftConfig::default() };
            let octaves = build(&image, &config, &mut PlanePool::default());
            assert_eq!(octaves.len(), if double_first_octave { 5 } else { 4 });
            for octave in &octaves[..3] {
                // The centre of gravity of the first level, in pixels of the image.
                let (mut sum, mut sum_x, mut sum_y) = (0.0, 0.0, 0.0);
                for row in 0..octave.height() {
                    for col in 0..octave.width() {
                        let weight = f64::from(octave.levels[0].at(col, row));
                        sum += weight;
                        sum_x += weight * octave.to_image(col as f64);
                        sum_y += weight * octave.to_image(row as f64);
                    }
                }
                assert!((sum_x / sum - x).abs() < 0.01 && (sum_y / sum - y).abs() < 0.01);
            }
        }
    }

    #[test]
    fn recycled_memory_changes_nothing() {
        let image = Plane::from_fn(50, 40, |x, y| ((x * 7 + y * 13) % 11) as f32 / 11.0);
        let config = SiftConfig::default();
        let mut pool = PlanePool::default();
        let other = Plane::from_fn(64, 64, |x, _| x as f32);
        pool.recycle(build(&other, &config, &mut PlanePool::default()));
        let (used, fresh) = (build(&image, &config, &mut pool), build(&image, &config, &mut PlanePool::default()));
        for (a, b) in used.iter().zip(&fresh) {
            assert_eq!(a.levels, b.levels);
        }
    }
}

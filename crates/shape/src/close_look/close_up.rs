//! A photo prepared for close looks, and the measurements of a picture against it.

use image::RgbImage;
use sdg_geometry::{PlanarSimilarity, Polygon};

use super::gradients::{CELL, Expected, Gradients, cell_of, num_cells};
use super::look::CloseLook;
use super::table::{TableColors, lab, squared};
use crate::frame::Frame;

/// Length of the part's longer side in the frame, in pixels.
const PART_SIDE: f64 = 96.0;
/// Side of the frame, in pixels; the pixels around the part show its surroundings.
pub(super) const SIDE: usize = 120;
/// Minimum depth of a cell (a square of [`CELL`] × [`CELL`] pixels) that shows the part. The depth is the distance from
/// the outline, in pixels of the frame, and is negative outside.
const INSIDE: f32 = 2.5;
/// Depths of the cells that show the part's surroundings.
const AROUND: std::ops::Range<f32> = -12.0..-3.0;
/// A cell shows the table if its colour lies within this many spreads (standard deviations) of one of the table's
/// colours.
const TABLE_SPREADS: f32 = 2.0;
/// A cell of the part's surroundings counts for one of the picture's frequent colours if the cell's colour lies within
/// this many spreads of it.
const AROUND_SPREADS: f32 = 2.5;
/// A colour of the picture is the table's if at least this share of the part's surroundings has it.
const TABLE_SHARE: f32 = 0.12;
/// A cell does not show the part if picture and expected colour differ by more than this: root mean square over the
/// channels, in units of [`lab`].
const OTHER_COLOR: f32 = 10.0;
/// A window (3 × 3 cells) counts if the energy of the photo's edges in it exceeds this share of the strongest window's;
/// that energy is its weight.
pub(super) const MIN_EDGES: f32 = 0.02;
/// Minimum depth of a window that still shows the outline's edge.
const NEAR: f32 = -6.0;

/// A demonstration prepared for close looks.
#[derive(Debug, Clone)]
pub(crate) struct CloseUp {
    pub(super) frame: Frame,
    pub(super) image: RgbImage,
    /// How far each pixel lies inside the outline, in pixels of the frame; below 0 outside.
    pub(super) depth: Vec<f32>,
    pub(super) gradients: Gradients,
    pub(super) expected: Expected,
    /// The depth and the photo's colour of each cell.
    cell_depth: Vec<f32>,
    cell_colors: Vec<Option<[f32; 3]>>,
    /// Cells that show the part and differ in colour from the photo's own table.
    is_part: Vec<bool>,
}

/// The colours of the photo and of the picture.
type Pair = ([f32; 3], [f32; 3]);

/// A picture sampled into the frame at a pose.
pub(crate) struct Seen {
    colors: Vec<Option<[f32; 3]>>,
    pub(super) gradients: Gradients,
    /// The correlation of each of the photo's windows with the picture.
    pub(super) fits: Vec<f32>,
}

impl CloseUp {
    /// Reads the part from its cut-out; `outline` is in pixels of the cut-out.
    pub(crate) fn new(cutout: &RgbImage, outline: &Polygon) -> Self {
        let frame = Frame::about(&outline.bounds(), PART_SIDE, SIDE);
        let colors = frame.sampled_sparsely(cutout, &PlanarSimilarity::IDENTITY);
        let depth: Vec<f32> = frame
            .pixels()
            .map(|at| {
                let at = frame.place(at);
                let distance = (outline.distance_to_edge(&at) / frame.step()) as f32;
                if outline.contains(&at) { distance } else { -distance }
            })
            .collect();
        let gradients = Gradients::new(&colors, SIDE, |i| depth[i] > -3.0);
        let expected = Expected::new(&gradients, &depth);
        let cell_depth = cell_means(&depth.iter().map(|depth| Some([*depth; 3])).collect::<Vec<_>>())
            .into_iter()
            .map(|mean| mean.map_or(f32::MIN, |mean| mean[0]))
            .collect::<Vec<_>>();
        let cell_colors = cell_labs(&colors);
        let around: Vec<[f32; 3]> = cells_where(&cell_colors, |i| AROUND.contains(&cell_depth[i])).collect();
        let table = TableColors::of(&around);
        let is_part = (0..cell_depth.len())
            .map(|i| {
                cell_depth[i] > INSIDE && cell_colors[i].is_some_and(|color| table.distance(&color) > TABLE_SPREADS)
            })
            .collect();
        Self { frame, image: cutout.clone(), depth, gradients, expected, cell_depth, cell_colors, is_part }
    }

    pub(crate) fn seen(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> Seen {
        let colors = self.frame.sampled_sparsely(image, image_from_cutout);
        let gradients = Gradients::new(&colors, SIDE, |i| colors[i].is_some());
        let fits = self.expected.fit(&gradients);
        Seen { colors, gradients, fits }
    }

    /// The close look without likeness, details and mirror image.
    pub(crate) fn look(&self, seen: &Seen, table: &TableColors) -> CloseLook {
        let is_seen = cell_means(&seen.colors);
        let fits = &seen.fits;
        let strongest = self.expected.energy.iter().fold(0.0f32, |a, b| a.max(*b));
        let (mut fit, mut edges) = (0.0, 0.0);
        for (i, energy) in
            self.expected.energy.iter().enumerate().filter(|(_, energy)| **energy > MIN_EDGES * strongest)
        {
            if self.cell_depth[i] > NEAR && is_seen[i].is_some() {
                fit += energy * fits[i];
                edges += energy;
            }
        }
        CloseLook {
            likeness: 0.0,
            details: None,
            bare: self.bare(seen, table),
            fit: f64::from(fit / edges.max(f32::MIN_POSITIVE)),
            no_rim: self.share_without_rim(fits, &is_seen),
            added: self.added(seen),
            mirrored: None,
        }
    }

    /// The share of the outline's windows with hardly any correlation.
    fn share_without_rim(&self, fits: &[f32], is_seen: &[Option<[f32; 3]>]) -> f64 {
        /// Half a cell on both sides of the outline.
        const AT_OUTLINE: f32 = 1.5;
        /// A window with a smaller correlation has hardly any.
        const HARDLY: f32 = 0.25;
        let at_outline = |i: &usize| self.cell_depth[*i].abs() < AT_OUTLINE && is_seen[*i].is_some();
        let (mut without, mut all) = (0, 0);
        for i in (0..fits.len()).filter(at_outline) {
            all += 1;
            without += usize::from(fits[i] < HARDLY);
        }
        f64::from(without as u32) / f64::from(all.max(1) as u32)
    }

    /// Mean of max(0, energy of the picture − 2 · energy of the photo − noise) over the cells inside the outline.
    fn added(&self, seen: &Seen) -> f64 {
        const DEEP: f32 = 3.0;
        const NOISE: f32 = 0.1;
        let is_deep = |i: usize| self.depth[i] > DEEP;
        let of_photo = self.gradients.energy_in_windows(is_deep);
        let of_picture = seen.gradients.energy_in_windows(is_deep);
        let cells: Vec<usize> = (0..of_photo.len()).filter(|&i| self.cell_depth[i] > DEEP).collect();
        let beyond = |i: &usize| (of_picture[*i] - 2.0 * of_photo[*i] - NOISE).max(0.0);
        f64::from(cells.iter().map(beyond).sum::<f32>()) / (cells.len() as f64).max(1.0)
    }

    /// The share of the cells inside the outline where the picture shows its table and the photo shows the part.
    fn bare(&self, seen: &Seen, table: &TableColors) -> f64 {
        let colors = cell_labs(&seen.colors);
        let around: Vec<[f32; 3]> = cells_where(&colors, |i| AROUND.contains(&self.cell_depth[i])).collect();
        let table = table.among(&around, TABLE_SHARE, AROUND_SPREADS);
        let expected = self.expected_colors(&colors);
        let across = SIDE / CELL;
        let is_bare: Vec<bool> = (0..colors.len())
            .map(|i| {
                let Some(color) = colors[i].filter(|color| self.is_part[i] && table.distance(color) < TABLE_SPREADS)
                else {
                    return false;
                };
                // A shift of one cell is allowed, because parallax displaces the walls and holes of a part that is not
                // flat.
                let near = [-1, 0, 1].into_iter().flat_map(|dy| [-1, 0, 1].map(|dx| (dx, dy)));
                near.filter_map(|(dx, dy)| expected[(i as isize + dy * across as isize + dx) as usize])
                    .all(|expected| squared(&color, &expected) > 3.0 * OTHER_COLOR * OTHER_COLOR)
            })
            .collect();
        // Single cells and rows of cells are caused by misplaced edges; only blocks of two by two cells count.
        let square = |i: usize| [i, i + 1, i + across, i + across + 1];
        let mut is_area = vec![false; is_bare.len()];
        for i in (0..is_bare.len() - across - 1).filter(|i| square(*i).iter().all(|j| is_bare[*j])) {
            square(i).iter().for_each(|j| is_area[*j] = true);
        }
        let inside = self.cell_depth.iter().filter(|depth| **depth > INSIDE).count();
        is_area.iter().filter(|is| **is).count() as f64 / (inside as f64).max(1.0)
    }

    /// The photo's colours in this picture's light: each channel is scaled and shifted to fit the picture; large
    /// differences have little weight.
    fn expected_colors(&self, seen: &[Option<[f32; 3]>]) -> Vec<Option<[f32; 3]>> {
        const ROUNDS: usize = 5;
        /// A difference of this size has half the weight of a small one, in units of [`lab`].
        const LARGE: f32 = 8.0;
        /// Pulls the factor on the contrast of a plain part towards 1.
        const PLAIN: f32 = 50.0;
        /// Limits of the factor on a channel's contrast.
        const CONTRASTS: (f32, f32) = (0.3, 2.5);
        let pairs: Vec<Pair> = (0..seen.len())
            .filter(|&i| self.cell_depth[i] > INSIDE)
            .filter_map(|i| self.cell_colors[i].zip(seen[i]))
            .collect();
        let fitted: [(f32, f32, f32); 3] = std::array::from_fn(|c| {
            let mut weights = vec![1.0; pairs.len()];
            let mut fitted = (0.0, 0.0, 1.0);
            for _ in 0..ROUNDS {
                let sum = |of: &dyn Fn(&Pair) -> f32| {
                    pairs.iter().zip(&weights).map(|(pair, weight)| weight * of(pair)).sum::<f32>()
                };
                let all = weights.iter().sum::<f32>().max(f32::MIN_POSITIVE);
                let (photo, picture) = (sum(&|pair| pair.0[c]) / all, sum(&|pair| pair.1[c]) / all);
                let products = sum(&|pair| (pair.0[c] - photo) * (pair.1[c] - picture));
                let squares = sum(&|pair| (pair.0[c] - photo) * (pair.0[c] - photo));
                let contrast = ((products + PLAIN) / (squares + PLAIN)).clamp(CONTRASTS.0, CONTRASTS.1);
                fitted = (photo, picture, contrast);
                for (weight, pair) in weights.iter_mut().zip(&pairs) {
                    let off = (pair.1[c] - picture - contrast * (pair.0[c] - photo)) / LARGE;
                    *weight = 1.0 / (1.0 + off * off);
                }
            }
            fitted
        });
        let in_this_light = |color: [f32; 3]| {
            std::array::from_fn(|c| {
                let (photo, picture, contrast) = fitted[c];
                picture + contrast * (color[c] - photo)
            })
        };
        self.cell_colors.iter().map(|color| color.map(in_this_light)).collect()
    }
}

/// Means over cells; `None` for a cell in which less than half of the pixels have a colour.
fn cell_means(pixels: &[Option<[f32; 3]>]) -> Vec<Option<[f32; 3]>> {
    let mut sums = vec![([0.0f32; 3], 0usize); num_cells(SIDE)];
    for (i, color) in pixels.iter().enumerate() {
        if let Some(color) = color {
            let (sum, count) = &mut sums[cell_of(i, SIDE)];
            (0..3).for_each(|c| sum[c] += color[c]);
            *count += 1;
        }
    }
    let mean =
        |(sum, count): ([f32; 3], usize)| (2 * count >= CELL * CELL).then(|| sum.map(|value| value / count as f32));
    sums.into_iter().map(mean).collect()
}

fn cell_labs(pixels: &[Option<[f32; 3]>]) -> Vec<Option<[f32; 3]>> {
    cell_means(pixels).into_iter().map(|color| color.map(|color| lab(&color))).collect()
}

fn cells_where<'a>(
    colors: &'a [Option<[f32; 3]>],
    counts: impl Fn(usize) -> bool + 'a,
) -> impl Iterator<Item = [f32; 3]> + 'a {
    colors.iter().enumerate().filter(move |(i, _)| counts(*i)).filter_map(|(_, color)| *color)
}

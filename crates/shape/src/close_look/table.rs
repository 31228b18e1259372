//! The frequent colours of a picture's table.

use image::RgbImage;

/// Maximum number of colours that describe a picture.
const NUM_COLORS: usize = 8;
/// Maximum length of the longer side of the reduced picture from which the colours are read, in pixels.
const SIDE: u32 = 60;
/// Rounds of the clustering; it converges earlier.
const ROUNDS: usize = 8;
/// Each further colour starts at the pixel whose distance to the nearest earlier colour is this quantile of all pixels'
/// distances; the farthest pixel would be a highlight.
const START_QUANTILE: f64 = 0.97;
/// Minimum spread of a colour, in units of [`lab`]: noise and shading alone cause this much.
const MIN_SPREAD: f32 = 3.0;
/// Minimum share of the pixels that have a colour.
const MIN_SHARE: f32 = 0.03;

/// The frequent colours of one picture, shared by all poses in it. Deterministic.
#[derive(Debug, Clone, Default)]
pub struct TableColors {
    /// Each colour and its spread, the root mean square deviation per channel.
    colors: Vec<([f32; 3], f32)>,
}

impl TableColors {
    /// Reads the colours of a picture; empty for an empty picture.
    pub fn new(image: &RgbImage) -> Self {
        Self::of(&shrunk(image))
    }

    /// Reads colours as [`lab`] returns them.
    pub(super) fn of(pixels: &[[f32; 3]]) -> Self {
        if pixels.is_empty() {
            return Self { colors: Vec::new() };
        }
        let mut by_lightness: Vec<usize> = (0..pixels.len()).collect();
        by_lightness.sort_by(|a, b| pixels[*a][0].total_cmp(&pixels[*b][0]));
        let mut centers = vec![pixels[by_lightness[pixels.len() / 2]]];
        let mut distances: Vec<f32> = pixels.iter().map(|pixel| squared(pixel, &centers[0])).collect();
        while centers.len() < NUM_COLORS {
            let mut order: Vec<usize> = (0..pixels.len()).collect();
            let nth = (START_QUANTILE * (pixels.len() - 1) as f64) as usize;
            let (_, next, _) = order.select_nth_unstable_by(nth, |a, b| distances[*a].total_cmp(&distances[*b]));
            let next = pixels[*next];
            for (distance, pixel) in distances.iter_mut().zip(pixels) {
                *distance = distance.min(squared(pixel, &next));
            }
            centers.push(next);
        }
        let mut members = vec![Vec::new(); centers.len()];
        for _ in 0..ROUNDS {
            members.iter_mut().for_each(Vec::clear);
            for (i, pixel) in pixels.iter().enumerate() {
                members[nearest(pixel, &centers)].push(i);
            }
            for (center, members) in centers.iter_mut().zip(&members).filter(|(_, members)| !members.is_empty()) {
                let mean = |c: usize| members.iter().map(|i| pixels[*i][c]).sum::<f32>() / members.len() as f32;
                *center = std::array::from_fn(mean);
            }
        }
        let frequent = |members: &[usize]| members.len() as f32 >= MIN_SHARE * pixels.len() as f32;
        let spread = |center: &[f32; 3], members: &[usize]| {
            let squares: f32 = members.iter().map(|i| squared(&pixels[*i], center)).sum();
            (squares / (3.0 * members.len() as f32)).sqrt().max(MIN_SPREAD)
        };
        let colors = centers.iter().zip(&members).filter(|(_, members)| frequent(members));
        Self { colors: colors.map(|(center, members)| (*center, spread(center, members))).collect() }
    }

    /// The colours that cover at least `share` of the part's surroundings, within `near` spreads.
    pub(super) fn among(&self, around: &[[f32; 3]], share: f32, near: f32) -> Self {
        let mut counts = vec![0; self.colors.len()];
        for pixel in around {
            let nearest = (0..counts.len()).min_by(|a, b| self.spreads(pixel, *a).total_cmp(&self.spreads(pixel, *b)));
            if let Some(nearest) = nearest.filter(|nearest| self.spreads(pixel, *nearest) < near) {
                counts[nearest] += 1;
            }
        }
        let is_there = |count: &usize| *count as f32 >= share * around.len() as f32;
        let colors = self.colors.iter().zip(&counts).filter(|(_, count)| is_there(count));
        Self { colors: colors.map(|(color, _)| *color).collect() }
    }

    /// Distance to the nearest colour, in spreads of that colour.
    pub(super) fn distance(&self, pixel: &[f32; 3]) -> f32 {
        (0..self.colors.len()).map(|k| self.spreads(pixel, k)).fold(f32::INFINITY, f32::min)
    }

    fn spreads(&self, pixel: &[f32; 3], k: usize) -> f32 {
        let (color, spread) = &self.colors[k];
        (squared(pixel, color) / 3.0).sqrt() / spread
    }
}

fn nearest(pixel: &[f32; 3], centers: &[[f32; 3]]) -> usize {
    let mut best = 0;
    for k in 1..centers.len() {
        if squared(pixel, &centers[k]) < squared(pixel, &centers[best]) {
            best = k;
        }
    }
    best
}

pub(super) fn squared(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    (0..3).map(|c| (a[c] - b[c]) * (a[c] - b[c])).sum()
}

/// Mean colours of blocks, row by row.
fn shrunk(image: &RgbImage) -> Vec<[f32; 3]> {
    let (width, height) = image.dimensions();
    if width.min(height) == 0 {
        return Vec::new();
    }
    let block = width.max(height).div_ceil(SIDE).max(1) as usize;
    let (columns, rows) = ((width as usize / block).max(1), (height as usize / block).max(1));
    let mut sums = vec![[0u32; 3]; columns * rows];
    for (y, row) in image.as_raw().chunks_exact(3 * width as usize).enumerate().take(rows * block) {
        let blocks = row.chunks(3 * block).take(columns);
        for (sum, pixels) in sums[y / block * columns..][..columns].iter_mut().zip(blocks) {
            for pixel in pixels.chunks_exact(3) {
                (0..3).for_each(|c| sum[c] += u32::from(pixel[c]));
            }
        }
    }
    // A picture narrower than a block has one block of its own width.
    let count = (block.min(width as usize) * block.min(height as usize)) as f32;
    sums.into_iter().map(|sum| lab(&sum.map(|value| value as f32 / (255.0 * count)))).collect()
}

/// CIE L*a*b* of an sRGB colour from 0 to 1, under D65, L* scaled to 255; distances correspond roughly to perceived
/// differences.
pub(super) fn lab(color: &[f32; 3]) -> [f32; 3] {
    let [r, g, b] =
        color.map(|value| if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) });
    let x = (0.4125 * r + 0.3576 * g + 0.1804 * b) / 0.9505;
    let y = 0.2127 * r + 0.7152 * g + 0.0722 * b;
    let z = (0.0193 * r + 0.1192 * g + 0.9503 * b) / 1.089;
    let [x, y, z] = [x, y, z].map(|t: f32| if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 });
    [2.55 * (116.0 * y - 16.0), 500.0 * (x - y), 200.0 * (y - z)]
}

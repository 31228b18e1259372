//! Similarity warps of 8-bit pictures in fixed point: fast enough for a picture of full resolution in every sample.
//!
//! A pixel is one 64-bit word of four 16-bit lanes (red, green, blue, nothing), so that bilinear interpolation of all
//! channels is four loads and four multiplications of plain integers. Positions along a row differ by a constant
//! step, and a run of columns that lies inside the picture is read by a loop without conditions.
//!
//! ```text
//! row ── place, step ── run: columns inside ── blocks of words, 8.8 bits a lane ── gain ── bytes
//! ```

use std::ops::Range;

use image::RgbImage;
use sdg_geometry::PlanarSimilarity;

/// Fractional bits of a position.
const FRACTION_BITS: u32 = 32;
/// Fractional bits used for weights. Weights then sum to 256, and 255 · 256 still fits a lane.
const WEIGHT_BITS: u32 = 8;
/// Fractional bits of a gain. Gains must be below 16.
const GAIN_BITS: u32 = 12;
/// Pixels passed from interpolation to gain at a time; they stay in the nearest cache.
const BLOCK: usize = 64;

/// A picture with its border repeated once around it.
#[derive(Debug, Clone)]
pub(crate) struct LanePicture {
    words: Vec<u64>,
    /// Words per row.
    stride: usize,
    width: usize,
    height: usize,
}

impl LanePicture {
    pub fn from_image(image: &RgbImage) -> Self {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let stride = width + 2;
        let mut words = Vec::with_capacity(stride * (height + 2));
        let rows: Vec<&[u8]> = image.as_raw().chunks_exact(3 * width).collect();
        for row in rows.first().into_iter().chain(&rows).chain(rows.last()) {
            let pixels = row.chunks_exact(3).map(|p| lanes(p[0], p[1], p[2]));
            let first = words.len();
            words.push(0);
            words.extend(pixels);
            words[first] = words[first + 1];
            words.push(words[first + width]);
        }
        Self { words, stride, width, height }
    }

    /// Bilinear at a position: every lane is a grey value times 256.
    #[inline(always)]
    fn bilinear(&self, place: Place) -> u64 {
        let (column, row) = ((place.u >> FRACTION_BITS) as usize, (place.v >> FRACTION_BITS) as usize);
        let fraction = |along: i64| u64::from(along as u32 >> (FRACTION_BITS - WEIGHT_BITS));
        let (fx, fy) = (fraction(place.u), fraction(place.v));
        let both = (fx * fy + 128) >> WEIGHT_BITS;
        let upper = row * self.stride + column;
        let (upper, lower) = (&self.words[upper..][..2], &self.words[upper + self.stride..][..2]);
        let (a, b, c, d) = (upper[0], upper[1], lower[0], lower[1]);
        // Differences may borrow from the next lane, but the sum is correct: it is a·(256 - fx - fy + both)
        // + b·(fx - both) + c·(fy - both) + d·both, whose weights are never negative and sum to 256.
        (a << WEIGHT_BITS)
            .wrapping_add(b.wrapping_sub(a).wrapping_mul(fx))
            .wrapping_add(c.wrapping_sub(a).wrapping_mul(fy))
            .wrapping_add(a.wrapping_sub(b).wrapping_sub(c).wrapping_add(d).wrapping_mul(both))
    }

    fn holds(&self, place: Place) -> bool {
        let within = |along: i64, side: usize| (0..(side as i64 + 1) << FRACTION_BITS).contains(&along);
        within(place.u, self.width) && within(place.v, self.height)
    }

    fn confined(&self, place: Place) -> Place {
        let confine = |along: i64, side: usize| along.clamp(0, ((side as i64 + 1) << FRACTION_BITS) - 1);
        Place { u: confine(place.u, self.width), v: confine(place.v, self.height) }
    }

    /// Reads the columns of one row of the target, multiplied by the gains, into `out`: three bytes per column.
    /// Beyond the picture, the pixels of its border are repeated.
    pub fn read(&self, row: &RowLine, columns: Range<usize>, gains: &Gains, out: &mut [u8]) {
        assert_eq!(out.len(), 3 * columns.len(), "three bytes per column");
        if columns.is_empty() {
            return;
        }
        let row = row.fixed();
        let (mut place, end) = (row.at(columns.start), row.at(columns.end - 1));
        // On a line, all points between two inside points are inside.
        let inside = self.holds(place) && self.holds(end);
        let mut block = [[0u16; 4]; BLOCK];
        for out in out.chunks_mut(3 * BLOCK) {
            let block = &mut block[..out.len() / 3];
            if inside {
                block.iter_mut().for_each(|pixel| *pixel = split(self.bilinear(place.pass(row.step))));
            } else {
                block.iter_mut().for_each(|pixel| *pixel = split(self.bilinear(self.confined(place.pass(row.step)))));
            }
            gains.apply(block, out);
        }
    }
}

#[inline(always)]
fn split(word: u64) -> [u16; 4] {
    std::array::from_fn(|k| (word >> (16 * k)) as u16)
}

#[inline(always)]
fn lanes(r: u8, g: u8, b: u8) -> u64 {
    u64::from(r) | (u64::from(g) << 16) | (u64::from(b) << 32)
}

/// A position in the bordered picture, or a step, with [`FRACTION_BITS`].
#[derive(Debug, Clone, Copy)]
struct Place {
    u: i64,
    v: i64,
}

impl Place {
    /// Returns the position and advances it by a step.
    #[inline(always)]
    fn pass(&mut self, step: Self) -> Self {
        let here = *self;
        *self = Self { u: here.u + step.u, v: here.v + step.v };
        here
    }
}

/// The source positions of one row of the target: that of the first pixel's centre, and the step to the next.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowLine {
    start: [f64; 2],
    step: [f64; 2],
}

impl RowLine {
    /// The columns in `columns` whose source positions lie in `[0, size]`.
    pub fn inside(&self, size: [f64; 2], columns: Range<usize>) -> Range<usize> {
        let nothing = columns.start..columns.start;
        let (mut low, mut high) = (columns.start as f64, columns.end as f64 - 1.0);
        for ((start, step), side) in self.start.into_iter().zip(self.step).zip(size) {
            if step == 0.0 {
                if !(0.0..=side).contains(&start) {
                    return nothing;
                }
                continue;
            }
            let (one, other) = (-start / step, (side - start) / step);
            low = low.max(one.min(other));
            high = high.min(one.max(other));
        }
        let (low, high) = (low.ceil(), high.floor() + 1.0);
        if low < high { low as usize..high as usize } else { nothing }
    }

    fn fixed(&self) -> FixedLine {
        let one = 2f64.powi(FRACTION_BITS as i32);
        let place = |[u, v]: [f64; 2]| Place { u: (u * one).round() as i64, v: (v * one).round() as i64 };
        // Minus half a pixel for the upper left of the four pixels, plus one for the border, plus half a weight for
        // rounding.
        let origin = 0.5 + 0.5 / f64::from(1 << WEIGHT_BITS);
        FixedLine { start: place(self.start.map(|along| along + origin)), step: place(self.step) }
    }
}

struct FixedLine {
    start: Place,
    step: Place,
}

impl FixedLine {
    fn at(&self, column: usize) -> Place {
        let column = column as i64;
        Place { u: self.start.u + self.step.u * column, v: self.start.v + self.step.v * column }
    }
}

/// A similarity between two pictures, `source_from_target`, prepared for reading row by row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RowMap {
    /// First column of the matrix; the second is the first, rotated by 90°.
    step: [f64; 2],
    shift: [f64; 2],
}

impl RowMap {
    pub fn new(source_from_target: &PlanarSimilarity) -> Self {
        let PlanarSimilarity { scale, angle, tx, ty } = *source_from_target;
        let (sin, cos) = angle.radians().sin_cos();
        Self { step: [scale * cos, scale * sin], shift: [tx, ty] }
    }

    /// Row `y` of the target.
    pub fn row(&self, y: usize) -> RowLine {
        let ([c, s], [tx, ty]) = (self.step, self.shift);
        let (x, y) = (0.5, y as f64 + 0.5);
        RowLine { start: [c * x - s * y + tx, s * x + c * y + ty], step: self.step }
    }
}

/// The factor of each channel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gains {
    /// For two pixels, so that eight lanes are multiplied at once.
    factors: [u16; 8],
}

impl Gains {
    /// Gains in `[0, 16)`.
    pub fn new(gains: [f32; 3]) -> Self {
        let fixed = |gain: f32| (gain * f32::from(1u16 << GAIN_BITS) + 0.5) as u16;
        let [r, g, b] = gains.map(fixed);
        Self { factors: [r, g, b, 0, r, g, b, 0] }
    }

    /// Multiplies, rounds, and clamps to bytes.
    #[inline]
    fn apply(&self, block: &[[u16; 4]], out: &mut [u8]) {
        const LEFT_BITS: u32 = WEIGHT_BITS + GAIN_BITS - 16;
        let mut bytes = [[0u8; 4]; BLOCK];
        let bytes = &mut bytes[..block.len()];
        let whole = block.len() / 2 * 2;
        for (pair, bytes) in
            block.as_flattened()[..4 * whole].chunks_exact(8).zip(bytes.as_flattened_mut().chunks_exact_mut(8))
        {
            for k in 0..8 {
                bytes[k] = scaled(pair[k], self.factors[k], LEFT_BITS);
            }
        }
        if let (Some(pixel), Some(bytes)) = (block.get(whole), bytes.get_mut(whole)) {
            for k in 0..4 {
                bytes[k] = scaled(pixel[k], self.factors[k], LEFT_BITS);
            }
        }
        pack(bytes, out);
    }
}

/// The upper half of the product, rounded to a byte.
#[inline(always)]
fn scaled(lane: u16, factor: u16, left_bits: u32) -> u8 {
    let product = ((u32::from(lane) * u32::from(factor)) >> 16) as u16;
    ((product + (1 << (left_bits - 1))) >> left_bits).min(255) as u8
}

/// Drops every fourth byte.
#[inline]
fn pack(pixels: &[[u8; 4]], out: &mut [u8]) {
    let (fours, rest) = pixels.as_chunks::<4>();
    let (packed, left) = out.split_at_mut(12 * fours.len());
    // Four pixels are three whole words.
    for (four, out) in fours.iter().zip(packed.chunks_exact_mut(12)) {
        let [a, b, c, d] = four.map(u32::from_le_bytes);
        out[..4].copy_from_slice(&((a & 0xff_ffff) | (b << 24)).to_le_bytes());
        out[4..8].copy_from_slice(&(((b >> 8) & 0xffff) | (c << 16)).to_le_bytes());
        out[8..].copy_from_slice(&(((c >> 16) & 0xff) | (d << 8)).to_le_bytes());
    }
    for ([r, g, b, _], out) in rest.iter().zip(left.chunks_exact_mut(3)) {
        out.copy_from_slice(&[*r, *g, *b]);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;
    use sdg_geometry::Angle;

    use super::*;

    /// Weights in steps of 1/256 on each axis, with an error of at most half a step, and the rounding of a byte.
    const TOLERANCE: f64 = 2.0;

    fn similarity(scale: f64, degrees: f64, tx: f64, ty: f64) -> PlanarSimilarity {
        PlanarSimilarity { scale, angle: Angle::from_degrees(degrees), tx, ty }
    }

    /// The most difficult picture for interpolation: unrelated neighbours.
    fn speckle(width: u32, height: u32) -> RgbImage {
        RgbImage::from_fn(width, height, |x, y| {
            let at = |k: u64| super::super::random::scramble((u64::from(x) << 40) | (u64::from(y) << 8) | k) as u8;
            image::Rgb([at(1), at(2) / 128 * 255, at(3)])
        })
    }

    /// Plain double-precision bilinear look-up, borders repeated.
    fn reference(image: &RgbImage, x: f64, y: f64, k: usize) -> f64 {
        let confine = |v: f64, side: u32| v.clamp(0.0, f64::from(side - 1));
        let (u, v) = (confine(x - 0.5, image.width()), confine(y - 0.5, image.height()));
        let at = |x: f64, y: f64| {
            let (x, y) = (confine(x, image.width()), confine(y, image.height()));
            f64::from(image.get_pixel(x as u32, y as u32)[k])
        };
        let (left, top) = (u.floor(), v.floor());
        let (fx, fy) = (u - left, v - top);
        let upper = at(left, top) * (1.0 - fx) + at(left + 1.0, top) * fx;
        let lower = at(left, top + 1.0) * (1.0 - fx) + at(left + 1.0, top + 1.0) * fx;
        upper * (1.0 - fy) + lower * fy
    }

    #[test]
    fn agrees_with_a_plain_look_up_at_any_turn_and_size_and_beyond_the_border() {
        let image = speckle(83, 61);
        let picture = LanePicture::from_image(&image);
        let gains = [0.4, 1.0, 1.5];
        let mut worst = 0.0f64;
        for (turn, scale) in [(0.0, 1.0), (90.0, 1.0), (33.0, 0.8), (-121.0, 1.31), (180.0, 1.0), (7.0, 3.0)] {
            let map = similarity(scale, turn, 30.3, 21.7);
            for y in 0..70 {
                let mut out = vec![0; 3 * 101];
                picture.read(&RowMap::new(&map).row(y), 0..101, &Gains::new(gains), &mut out);
                for (x, pixel) in out.chunks_exact(3).enumerate() {
                    let p = map.apply(&Point2::new(x as f64 + 0.5, y as f64 + 0.5));
                    for k in 0..3 {
                        let exact = (reference(&image, p.x, p.y, k) * f64::from(gains[k])).min(255.0);
                        // A gain above one magnifies the error before it.
                        let off = (f64::from(pixel[k]) - exact).abs() / f64::from(gains[k]).max(1.0);
                        worst = worst.max(off);
                    }
                }
            }
        }
        assert!(worst < TOLERANCE, "off by {worst} of 255");
    }

    #[test]
    fn a_picture_that_stays_in_place_stays_as_it_is() {
        let image = speckle(70, 3);
        let picture = LanePicture::from_image(&image);
        for y in 0..3 {
            let mut out = vec![0; 3 * 70];
            let row = RowMap::new(&similarity(1.0, 0.0, 0.0, 0.0)).row(y);
            picture.read(&row, 0..70, &Gains::new([1.0; 3]), &mut out);
            assert_eq!(out, image.as_raw()[3 * 70 * y..][..3 * 70]);
        }
    }

    #[test]
    fn the_centre_of_a_disc_moves_as_its_point_does() {
        // Both over- and undersampled, at positions off the pixel grid.
        const TOLERANCE_PX: f64 = 0.02;
        let center = Point2::new(100.37, 80.81);
        let disc = |x: f64, y: f64| (20.5 - (x - center.x).hypot(y - center.y)).clamp(0.0, 1.0);
        let image = RgbImage::from_fn(200, 160, |x, y| {
            image::Rgb([(255.0 * disc(f64::from(x) + 0.5, f64::from(y) + 0.5)).round() as u8; 3])
        });
        let picture = LanePicture::from_image(&image);
        for (turn, scale) in [(13.0, 0.77), (-100.0, 1.0), (171.0, 1.29)] {
            let target_from_source = PlanarSimilarity::about(center, center, Angle::from_degrees(turn), scale);
            let source_from_target = target_from_source.inverse();
            let mut sum = [0.0; 3];
            for y in 0..160 {
                let mut out = vec![0; 3 * 200];
                picture.read(&RowMap::new(&source_from_target).row(y), 0..200, &Gains::new([0.9; 3]), &mut out);
                for (x, pixel) in out.chunks_exact(3).enumerate() {
                    let weight = f64::from(pixel[0]);
                    sum[0] += weight;
                    sum[1] += weight * (x as f64 + 0.5);
                    sum[2] += weight * (y as f64 + 0.5);
                }
            }
            let found = Point2::new(sum[1] / sum[0], sum[2] / sum[0]);
            assert!((found - center).norm() < TOLERANCE_PX, "{turn}°, ×{scale}: {found}, not {center}");
        }
    }

    #[test]
    fn columns_inside_are_those_that_a_point_by_point_check_finds() {
        let size = [64.0, 48.0];
        for (turn, scale, tx) in
            [(0.0, 1.0, -10.0), (90.0, 1.0, 40.0), (45.0, 0.9, 20.0), (-13.0, 2.0, 3.0), (0.0, 1.0, 500.0)]
        {
            let map = similarity(scale, turn, tx, 5.0);
            for y in 0..80 {
                let found = RowMap::new(&map).row(y).inside(size, 3..90);
                for x in 0..100 {
                    let p = map.apply(&Point2::new(x as f64 + 0.5, y as f64 + 0.5));
                    let margin = [p.x, size[0] - p.x, p.y, size[1] - p.y].into_iter().fold(f64::MAX, f64::min);
                    if margin.abs() > 1e-9 {
                        let inside = margin > 0.0 && (3..90).contains(&x);
                        assert_eq!(found.contains(&x), inside, "{turn}°, column {x} of row {y}: {found:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn gains_saturate_and_never_wrap() {
        let white = RgbImage::from_pixel(9, 9, image::Rgb([255; 3]));
        let mut out = [0; 27];
        let row = RowMap::new(&similarity(1.0, 0.0, 0.3, 0.3)).row(4);
        LanePicture::from_image(&white).read(&row, 0..9, &Gains::new([10.0, 1.0, 0.0]), &mut out);
        assert!(out.chunks_exact(3).all(|pixel| pixel == [255, 255, 0]), "{out:?}");
    }
}

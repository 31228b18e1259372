//! Two resizing methods, each with the same or nearly the same results as a reference implementation.

use image::RgbImage;
use sdg_kernels::for_each_stretch;

/// Fraction bits of Pillow's fixed-point filter coefficients.
const PRECISION_BITS: u32 = 22;
/// Rows that one thread takes at a time.
const BAND: usize = 16;

/// One output position of a separable filter: its first input, and the weights from this input on.
struct Taps {
    first: usize,
    weights: Vec<i32>,
}

/// Triangle filter over `input` positions for each of `output` positions.
///
/// Shrinking widens the filter to the distance between two outputs, so that every input counts.
fn triangle_taps(input: usize, output: usize) -> Vec<Taps> {
    let scale = input as f64 / output as f64;
    let filter_scale = scale.max(1.0);
    (0..output)
        .map(|position| {
            let center = (position as f64 + 0.5) * scale;
            let first = (center - filter_scale + 0.5).max(0.0) as usize;
            let end = ((center + filter_scale + 0.5) as usize).min(input);
            let exact: Vec<f64> =
                (first..end).map(|i| (1.0 - ((i as f64 - center + 0.5) / filter_scale).abs()).max(0.0)).collect();
            let sum: f64 = exact.iter().sum();
            let weights = exact.iter().map(|w| (w / sum * f64::from(1 << PRECISION_BITS) + 0.5) as i32).collect();
            Taps { first, weights }
        })
        .collect()
}

fn round_to_byte(sum: i32) -> u8 {
    ((sum + (1 << (PRECISION_BITS - 1))) >> PRECISION_BITS).clamp(0, 255) as u8
}

/// Resizes as Pillow's `BILINEAR`: along x, rounded to bytes, then along y.
///
/// Returns interleaved RGB, `[height, width, 3]`.
///
/// # Source
/// Pillow's documented resampling: triangle filter, 22-bit coefficients, 8-bit intermediate.
pub fn antialiased_bytes(image: &RgbImage, width: usize, height: usize) -> Vec<u8> {
    let (in_width, in_height) = (image.width() as usize, image.height() as usize);
    let source = image.as_raw();
    let mut rows = vec![0u8; in_height * width * 3];
    if width == in_width {
        rows.copy_from_slice(source);
    } else {
        let taps = triangle_taps(in_width, width);
        for_each_stretch(&mut rows, BAND * width * 3, |band, rows| {
            let sources = source[band * BAND * in_width * 3..].chunks_exact(in_width * 3);
            for (out, row) in rows.chunks_exact_mut(width * 3).zip(sources) {
                for (pixel, tap) in out.chunks_exact_mut(3).zip(&taps) {
                    let mut sums = [0i32; 3];
                    for (rgb, weight) in row[tap.first * 3..].chunks_exact(3).zip(&tap.weights) {
                        for (sum, value) in sums.iter_mut().zip(rgb) {
                            *sum += i32::from(*value) * weight;
                        }
                    }
                    pixel.copy_from_slice(&sums.map(round_to_byte));
                }
            }
        });
    }
    if height == in_height {
        return rows;
    }
    let mut resized = vec![0u8; height * width * 3];
    let taps = triangle_taps(in_height, height);
    for_each_stretch(&mut resized, BAND * width * 3, |band, out| {
        let mut sums = vec![0i32; width * 3];
        for (out, tap) in out.chunks_exact_mut(width * 3).zip(&taps[band * BAND..]) {
            sums.fill(0);
            for (row, weight) in rows[tap.first * width * 3..].chunks_exact(width * 3).zip(&tap.weights) {
                for (sum, value) in sums.iter_mut().zip(row) {
                    *sum += i32::from(*value) * weight;
                }
            }
            for (value, sum) in out.iter_mut().zip(&sums) {
                *value = round_to_byte(*sum);
            }
        }
    });
    resized
}

/// Resizes by interpolation between the two by two nearest pixels, not rounded, from 0 to 255.
///
/// Returns interleaved RGB, `[height, width, 3]`.
///
/// # Source
/// `torch.nn.functional.interpolate(mode="bilinear", align_corners=False)`.
pub fn bilinear(image: &RgbImage, width: usize, height: usize) -> Vec<f32> {
    let (in_width, in_height) = (image.width() as usize, image.height() as usize);
    let taps = |input: usize, output: usize| -> Vec<(usize, usize, f32)> {
        // Single precision, as in torch: at pixel 600 the weights differ from exact ones in the fifth digit.
        let scale = input as f32 / output as f32;
        (0..output)
            .map(|i| {
                let at = ((i as f32 + 0.5) * scale - 0.5).max(0.0);
                let first = (at as usize).min(input - 1);
                (first, (first + 1).min(input - 1), at - first as f32)
            })
            .collect()
    };
    let (columns, lines) = (taps(in_width, width), taps(in_height, height));
    let source = image.as_raw();
    let at = |x: usize, y: usize, c: usize| f32::from(source[(y * in_width + x) * 3 + c]);
    let mut resized = Vec::with_capacity(height * width * 3);
    for (y0, y1, fy) in &lines {
        for (x0, x1, fx) in &columns {
            for c in 0..3 {
                let upper = at(*x0, *y0, c) * (1.0 - fx) + at(*x1, *y0, c) * fx;
                let lower = at(*x0, *y1, c) * (1.0 - fx) + at(*x1, *y1, c) * fx;
                resized.push(upper * (1.0 - fy) + lower * fy);
            }
        }
    }
    resized
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    fn ramp() -> RgbImage {
        RgbImage::from_fn(4, 2, |x, y| Rgb([(x * 40) as u8, (y * 100) as u8, 7]))
    }

    #[test]
    fn halving_averages_with_triangle_weights() {
        // Filter half-width 2 around 1.0: weights 3/4, 3/4, 1/4 on the first three pixels (distances 0.5, 0.5, 1.5 of
        // 2), normalised by 7/4: (0·3 + 40·3 + 80·1) / 7 = 28.57.
        let resized = antialiased_bytes(&ramp(), 2, 2);
        assert_eq!(resized[0], 29);
        assert_eq!(resized[2], 7);
    }

    #[test]
    fn same_size_is_identity() {
        assert_eq!(antialiased_bytes(&ramp(), 4, 2), *ramp().as_raw());
        let same: Vec<f32> = ramp().as_raw().iter().map(|v| f32::from(*v)).collect();
        assert_eq!(bilinear(&ramp(), 4, 2), same);
    }

    #[test]
    fn bilinear_halving_takes_the_mean_of_two() {
        let resized = bilinear(&ramp(), 2, 2);
        assert_eq!(resized[0], 20.0);
        assert_eq!(resized[3], 100.0);
    }
}

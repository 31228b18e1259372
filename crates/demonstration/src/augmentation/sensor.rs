//! Effects of lens, sensor and compression on a picture.

use std::io::Cursor;

use image::codecs::jpeg::JpegEncoder;
use image::{ImageFormat, RgbImage};
use rand::Rng;

use super::config::SceneStyle;
use super::noise::NormalTable;
use super::random::{SampleRng, chance, direction, scramble, uniform};
use crate::raster::Raster;

/// Sometimes blurs the picture, by defocus or motion.
pub(crate) fn blur(canvas: &mut Raster, style: &SceneStyle, rng: &mut SampleRng) {
    if !chance(rng, style.blur_probability) {
        return;
    }
    let px = canvas.frame_width as f32 / 320.0;
    if chance(rng, 0.65) {
        gaussian(canvas, uniform(rng, 0.4, 1.4) * px);
    } else {
        let length = uniform(rng, 1.5, 6.0) * px;
        let [dx, dy] = direction(rng);
        motion(canvas, dx * length, dy * length);
    }
}

/// A Gaussian blur, one axis after the other.
fn gaussian(canvas: &mut Raster, sigma: f32) {
    let radius = ((2.5 * sigma).ceil() as usize).max(1);
    let weights: Vec<f32> = (0..=radius).map(|d| (-0.5 * (d as f32 / sigma).powi(2)).exp()).collect();
    let total = weights[0] + 2.0 * weights[1..].iter().sum::<f32>();
    let weights: Vec<f32> = weights.iter().map(|w| w / total).collect();
    let (width, height) = (canvas.width, canvas.height);

    let mut padded = vec![[0.0; 4]; width + 2 * radius];
    for row in canvas.pixels.chunks_exact_mut(width) {
        padded[radius..radius + width].copy_from_slice(row);
        padded[..radius].fill(row[0]);
        padded[radius + width..].fill(row[width - 1]);
        for (x, pixel) in row.iter_mut().enumerate() {
            let mut sum = padded[x + radius].map(|v| v * weights[0]);
            for (d, weight) in weights.iter().enumerate().skip(1) {
                let (left, right) = (&padded[x + radius - d], &padded[x + radius + d]);
                for k in 0..4 {
                    sum[k] += (left[k] + right[k]) * weight;
                }
            }
            *pixel = sum;
        }
    }
    let source = canvas.pixels.clone();
    for y in 0..height {
        let row = |v: isize| {
            let v = v.clamp(0, height as isize - 1) as usize;
            &source[v * width..(v + 1) * width]
        };
        let out = &mut canvas.pixels[y * width..(y + 1) * width];
        for (pixel, center) in out.iter_mut().zip(row(y as isize)) {
            *pixel = center.map(|v| v * weights[0]);
        }
        for (d, weight) in weights.iter().enumerate().skip(1) {
            let (above, below) = (row(y as isize - d as isize), row(y as isize + d as isize));
            for ((pixel, a), b) in out.iter_mut().zip(above).zip(below) {
                for k in 0..4 {
                    pixel[k] += (a[k] + b[k]) * weight;
                }
            }
        }
    }
}

/// The mean along the vector (dx, dy), in pixels.
fn motion(canvas: &mut Raster, dx: f32, dy: f32) {
    let taps = (dx.hypot(dy).ceil() as usize + 1).max(2);
    let (width, height) = (canvas.width as isize, canvas.height as isize);
    let source = canvas.pixels.clone();
    let share = 1.0 / taps as f32;
    let offsets: Vec<(isize, isize)> = (0..taps)
        .map(|tap| {
            let t = tap as f32 / (taps - 1) as f32 - 0.5;
            ((dx * t).round() as isize, (dy * t).round() as isize)
        })
        .collect();
    for (y, out) in canvas.pixels.chunks_exact_mut(canvas.width).enumerate() {
        out.fill([0.0; 4]);
        for &(ox, oy) in &offsets {
            let v = (y as isize + oy).clamp(0, height - 1);
            let row = &source[(v * width) as usize..((v + 1) * width) as usize];
            // Columns at the row's beginning, in its interior, and at its end.
            let left = (-ox).clamp(0, width);
            let right = (width - ox).clamp(left, width);
            let (beginning, rest) = out.split_at_mut(left as usize);
            let (inside, end) = rest.split_at_mut((right - left) as usize);
            beginning.iter_mut().for_each(|sum| add(sum, &row[0]));
            if !inside.is_empty() {
                let seen = &row[(left + ox) as usize..(right + ox) as usize];
                inside.iter_mut().zip(seen).for_each(|(sum, pixel)| add(sum, pixel));
            }
            end.iter_mut().for_each(|sum| add(sum, &row[row.len() - 1]));
        }
        out.iter_mut().for_each(|sum| *sum = sum.map(|v| v * share));
    }
}

#[inline(always)]
fn add(sum: &mut [f32; 4], pixel: &[f32; 4]) {
    for k in 0..4 {
        sum[k] += pixel[k];
    }
}

/// Rounds to 8 bits, with noise that grows with brightness, and sometimes compresses like a camera.
pub(crate) fn expose(canvas: &Raster, normal: &NormalTable, style: &SceneStyle, rng: &mut SampleRng) -> RgbImage {
    let sigma = uniform(rng, 0.0, style.max_noise) * uniform(rng, 0.2, 1.0);
    let address: u64 = rng.random();
    let mut bytes = vec![0u8; canvas.width * canvas.height * 3];
    // Runs of the table start at random positions and overlap from row to row, which is not visible.
    for (y, (row, out)) in
        canvas.pixels.chunks_exact(canvas.width).zip(bytes.chunks_exact_mut(3 * canvas.width)).enumerate()
    {
        let noise = normal.run(scramble(address.wrapping_add(y as u64)), 3 * canvas.width);
        for ((pixel, out), noise) in row.iter().zip(out.chunks_exact_mut(3)).zip(noise.chunks_exact(3)) {
            for k in 0..3 {
                let value = pixel[k];
                out[k] = (value * 255.0 + noise[k] * sigma * (0.5 + value) + 0.5) as u8;
            }
        }
    }
    let image = RgbImage::from_raw(canvas.width as u32, canvas.height as u32, bytes)
        .expect("three bytes were made for each pixel");
    if !chance(rng, style.jpeg_probability) {
        return image;
    }
    let quality = uniform(rng, 35.0, 92.0) as u8;
    compressed(&image, quality).unwrap_or(image)
}

/// The picture after JPEG encoding and decoding; `None` if the codec refuses its size.
fn compressed(image: &RgbImage, quality: u8) -> Option<RgbImage> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, quality)).ok()?;
    let decoded = image::load_from_memory_with_format(bytes.get_ref(), ImageFormat::Jpeg).ok()?;
    Some(decoded.into_rgb8())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dot(width: usize, height: usize) -> Raster {
        let mut raster = Raster::filled(width, height, [0.0; 4]);
        raster.pixels[(height / 2) * width + width / 2] = [1.0; 4];
        raster
    }

    fn moments(raster: &Raster) -> [f32; 3] {
        let mut moments = [0.0; 3];
        for (at, pixel) in raster.pixels.iter().enumerate() {
            let x = (at % raster.width) as f32 - (raster.width / 2) as f32;
            let y = (at / raster.width) as f32 - (raster.height / 2) as f32;
            moments[0] += pixel[0];
            moments[1] += pixel[0] * x * x;
            moments[2] += pixel[0] * y * y;
        }
        moments
    }

    #[test]
    fn a_normal_blur_has_its_variance_and_loses_no_light() {
        let mut raster = dot(41, 31);
        gaussian(&mut raster, 2.0);
        let [sum, xx, yy] = moments(&raster);
        // The tails beyond 2.5 sigma are cut off, which reduces the variance slightly.
        assert!((sum - 1.0).abs() < 1e-4 && (3.4..4.0).contains(&xx) && (xx - yy).abs() < 1e-3, "{sum} {xx} {yy}");
    }

    #[test]
    fn motion_spreads_along_its_line_only() {
        let mut raster = dot(41, 31);
        motion(&mut raster, 6.0, 0.0);
        let [sum, xx, yy] = moments(&raster);
        assert!((sum - 1.0).abs() < 1e-5 && xx > 3.0 && yy == 0.0);
    }

    #[test]
    fn motion_repeats_the_border_even_where_the_line_is_longer_than_the_picture() {
        for (dx, dy) in [(4.0, 3.0), (-50.0, 0.0), (50.0, 20.0), (3.0, -50.0)] {
            let mut raster = Raster::filled(9, 7, [0.25, 0.5, 0.75, 1.0]);
            motion(&mut raster, dx, dy);
            let off = |pixel: &[f32; 4]| (pixel[0] - 0.25).abs() + (pixel[2] - 0.75).abs();
            assert!(raster.pixels.iter().all(|pixel| off(pixel) < 1e-5), "({dx}, {dy})");
        }
    }
}

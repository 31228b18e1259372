//! Lens, exposure, sensor and compression: linear light to 8 bits.

use image::RgbImage;
use rand::Rng;
use rand_pcg::Pcg64Mcg;

use crate::random::{Draw, scramble};
use crate::tiles::Tiles;

/// Entries of the tone curve.
const CURVE: usize = 4096;

/// What the camera does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sensor {
    /// Factor of the light, before automatic exposure.
    pub exposure: f32,
    /// Factors of red, green, blue.
    pub white_balance: [f32; 3],
    /// Standard deviation of noise at middle grey, as a share of full scale.
    pub noise: f32,
    /// Radius of blur in pixels.
    pub blur: f32,
    /// Way of the camera during the exposure, in pixels.
    pub motion: [f32; 2],
    /// Loss of light in the corners, as a share.
    pub vignetting: f32,
    /// Light that the lens scatters over the whole picture, as a share of full scale.
    pub veil: f32,
    /// Contrast: exponent of the tone curve, 1 for sRGB's.
    pub contrast: f32,
    /// Colours: 0 is grey, 1 as they are.
    pub saturation: f32,
    /// Quality of a JPEG file that the picture goes through, if any.
    pub jpeg: Option<u8>,
}

/// Takes the picture.
pub(crate) fn take(light: &mut Vec<[f32; 3]>, width: usize, sensor: &Sensor, rng: &mut Pcg64Mcg) -> RgbImage {
    let height = light.len() / width;
    // Automatic exposure brings the mean half-way to middle grey.
    let mean = light.iter().step_by(7).map(|p| p[1].min(1.5)).sum::<f32>() / light.len().div_ceil(7) as f32;
    let automatic = (0.33 / mean.max(0.01)).powf(0.55).clamp(0.5, 2.4);
    let gain = sensor.white_balance.map(|w| w * automatic * sensor.exposure);
    for (y, row) in light.chunks_exact_mut(width).enumerate() {
        let v = (y as f32 + 0.5) / height as f32 * 2.0 - 1.0;
        for (x, pixel) in row.iter_mut().enumerate() {
            let u = (x as f32 + 0.5) / width as f32 * 2.0 - 1.0;
            let loss = 1.0 - sensor.vignetting * 0.5 * (u * u + v * v);
            let lit = [0, 1, 2].map(|k| pixel[k] * gain[k] * loss);
            let grey = 0.3 * lit[0] + 0.59 * lit[1] + 0.11 * lit[2];
            // Clipped before blurring, not by much: highlights bloom a little.
            *pixel = lit.map(|c| (grey + (c - grey) * sensor.saturation + sensor.veil).clamp(0.0, 2.5));
        }
    }
    if sensor.motion[0].hypot(sensor.motion[1]) > 0.7 {
        motion(light, width, sensor.motion);
    }
    if sensor.blur > 0.2 {
        blur(light, width, sensor.blur);
    }
    let image = expose(light, width, sensor, rng);
    match sensor.jpeg {
        Some(quality) => compressed(&image, quality).unwrap_or(image),
        None => image,
    }
}

/// A normal blur, one axis after the other.
fn blur(light: &mut Vec<[f32; 3]>, width: usize, sigma: f32) {
    let height = light.len() / width;
    let reach = ((2.3 * sigma).ceil() as usize).clamp(1, 12);
    let weights: Vec<f32> = (0..=reach).map(|d| (-0.5 * (d as f32 / sigma).powi(2)).exp()).collect();
    let total = weights[0] + 2.0 * weights[1..].iter().sum::<f32>();
    let weights: Vec<f32> = weights.iter().map(|w| w / total).collect();
    let mut padded = vec![[0.0f32; 3]; width + 2 * reach];
    for row in light.chunks_exact_mut(width) {
        padded[reach..reach + width].copy_from_slice(row);
        padded[..reach].fill(row[0]);
        padded[reach + width..].fill(row[width - 1]);
        row.iter_mut().zip(&padded[reach..]).for_each(|(out, center)| *out = center.map(|c| c * weights[0]));
        for (d, &weight) in weights.iter().enumerate().skip(1) {
            let (left, right) = (&padded[reach - d..], &padded[reach + d..]);
            for ((out, a), b) in row.iter_mut().zip(left).zip(right) {
                for k in 0..3 {
                    out[k] += (a[k] + b[k]) * weight;
                }
            }
        }
    }
    let source = light.clone();
    let row = |y: isize| {
        let y = y.clamp(0, height as isize - 1) as usize;
        &source[y * width..(y + 1) * width]
    };
    for (y, out) in light.chunks_exact_mut(width).enumerate() {
        out.iter_mut().for_each(|pixel| *pixel = pixel.map(|c| c * weights[0]));
        for (d, &weight) in weights.iter().enumerate().skip(1) {
            let (above, below) = (row(y as isize - d as isize), row(y as isize + d as isize));
            for ((out, a), b) in out.iter_mut().zip(above).zip(below) {
                for k in 0..3 {
                    out[k] += (a[k] + b[k]) * weight;
                }
            }
        }
    }
}

/// The mean along the camera's way.
fn motion(light: &mut [[f32; 3]], width: usize, way: [f32; 2]) {
    let height = light.len() / width;
    let taps = (way[0].hypot(way[1]).ceil() as usize + 1).clamp(2, 24);
    let source = light.to_vec();
    let share = 1.0 / taps as f32;
    let offsets: Vec<[isize; 2]> = (0..taps)
        .map(|tap| tap as f32 / (taps - 1) as f32 - 0.5)
        .map(|t| [(way[0] * t).round() as isize, (way[1] * t).round() as isize])
        .collect();
    for (y, out) in light.chunks_exact_mut(width).enumerate() {
        out.fill([0.0; 3]);
        for &[dx, dy] in &offsets {
            let v = (y as isize + dy).clamp(0, height as isize - 1) as usize;
            let row = &source[v * width..(v + 1) * width];
            for (x, pixel) in out.iter_mut().enumerate() {
                let u = (x as isize + dx).clamp(0, width as isize - 1) as usize;
                for k in 0..3 {
                    pixel[k] += row[u][k] * share;
                }
            }
        }
    }
}

/// The tone curve, noise, and rounding to 8 bits.
fn expose(light: &[[f32; 3]], width: usize, sensor: &Sensor, rng: &mut Pcg64Mcg) -> RgbImage {
    let curve: Vec<f32> = (0..CURVE)
        .map(|k| {
            let v = k as f32 / (CURVE - 1) as f32;
            let encoded = if v < 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
            255.0 * encoded.powf(sensor.contrast)
        })
        .collect();
    let tiles = Tiles::get();
    let address: u64 = rng.random();
    let sigma = 255.0 * sensor.noise;
    let mut bytes = vec![0u8; 3 * light.len()];
    for (y, (row, out)) in light.chunks_exact(width).zip(bytes.chunks_exact_mut(3 * width)).enumerate() {
        let noise = tiles.normals(scramble(address.wrapping_add(y as u64)), 3 * width + 3);
        for (x, (pixel, out)) in row.iter().zip(out.chunks_exact_mut(3)).enumerate() {
            // Part of the noise is shared by the channels.
            let shared = noise[3 * x + 3];
            for k in 0..3 {
                let value = curve[(pixel[k].min(1.0) * (CURVE - 1) as f32) as usize];
                let strength = sigma * (0.45 + 0.55 * (value * (1.0 / 128.0)).min(1.3));
                out[k] = (value + strength * (0.75 * noise[3 * x + k] + 0.6 * shared) + 0.5) as u8;
            }
        }
    }
    RgbImage::from_raw(width as u32, (light.len() / width) as u32, bytes).expect("three bytes were made for each pixel")
}

/// The picture after a round through a JPEG file; none where the codec refuses its size.
fn compressed(image: &RgbImage, quality: u8) -> Option<RgbImage> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_with_encoder(image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, quality)).ok()?;
    let decoded = image::load_from_memory_with_format(bytes.get_ref(), image::ImageFormat::Jpeg).ok()?;
    Some(decoded.into_rgb8())
}

impl Sensor {
    /// A good camera in good light.
    pub fn clean(rng: &mut Pcg64Mcg) -> Self {
        Self {
            exposure: rng.log_uniform(0.85, 1.15),
            white_balance: [1.0; 3],
            noise: rng.uniform(0.003, 0.012),
            blur: rng.uniform(0.3, 0.6),
            motion: [0.0; 2],
            vignetting: rng.uniform(0.0, 0.15),
            veil: rng.uniform(0.0, 0.01),
            contrast: rng.uniform(0.95, 1.1),
            saturation: rng.uniform(0.85, 1.05),
            jpeg: None,
        }
    }
}

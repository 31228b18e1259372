//! Lens, exposure, sensor and compression: linear light to 8 bits.

use image::RgbImage;
use rand::Rng;
use rand_pcg::Pcg64Mcg;

use super::blur::{blur, pad_row};
use super::render::Canvas;
use crate::random::{Draw, scramble};
use crate::tiles::{Tiles, floor};

/// Entries of the tone curve; a power of two.
const CURVE: usize = 1024;

/// The properties of the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sensor {
    /// Exposure factor, in addition to the automatic exposure.
    pub exposure: f32,
    /// Gains of red, green, blue.
    pub white_balance: [f32; 3],
    /// Standard deviation of noise at middle grey, as a fraction of full scale.
    pub noise: f32,
    /// Standard deviation of the blur, in pixels.
    pub blur: f32,
    /// Camera motion during the exposure, in pixels.
    pub motion: [f32; 2],
    /// Relative loss of light in the corners.
    pub vignetting: f32,
    /// Light that the lens scatters over the whole picture, as a fraction of full scale.
    pub veil: f32,
    /// Contrast: exponent of the tone curve; 1 gives sRGB's curve.
    pub contrast: f32,
    /// Saturation: 0 is grey, 1 is unchanged.
    pub saturation: f32,
    /// Quality of the JPEG compression, if any.
    pub jpeg: Option<u8>,
}

/// Develops the light on the canvas into a picture.
pub(crate) fn take(canvas: &mut Canvas, width: usize, sensor: &Sensor, rng: &mut Pcg64Mcg) -> RgbImage {
    let Canvas { light, spare, .. } = canvas;
    let height = light.len() / width;
    // Automatic exposure brings the mean halfway to middle grey.
    let mean = light.iter().step_by(7).map(|p| p[1].min(1.5)).sum::<f32>() / light.len().div_ceil(7) as f32;
    let automatic = (0.33 / mean.max(0.01)).powf(0.55).clamp(0.5, 2.4);
    let gain = sensor.white_balance.map(|w| w * automatic * sensor.exposure);
    // Squared distance from the centre, from 0 to 1, times the loss.
    let loss_at = |k: usize, count: usize| {
        let v = (k as f32 + 0.5) / count as f32 * 2.0 - 1.0;
        sensor.vignetting * 0.5 * v * v
    };
    let losses: Vec<f32> = (0..width).map(|x| loss_at(x, width)).collect();
    for (y, row) in light.chunks_exact_mut(width).enumerate() {
        let kept = 1.0 - loss_at(y, height);
        for (pixel, loss) in row.iter_mut().zip(&losses) {
            let lit = [0, 1, 2].map(|k| pixel[k] * gain[k] * (kept - loss));
            let grey = 0.3 * lit[0] + 0.59 * lit[1] + 0.11 * lit[2];
            // Clipped before blurring, with a margin: highlights bloom a little.
            *pixel = lit.map(|c| (grey + (c - grey) * sensor.saturation + sensor.veil).clamp(0.0, 2.5));
        }
    }
    if sensor.motion[0].hypot(sensor.motion[1]) > 0.7 {
        spare.clone_from(light);
        motion(spare, light, width, sensor.motion);
    }
    if sensor.blur > 0.2 {
        spare.resize(light.len(), [0.0; 3]);
        blur(light, spare, width, sensor.blur);
    }
    let image = expose(light, width, sensor, rng);
    match sensor.jpeg {
        Some(quality) => compressed(&image, quality).unwrap_or(image),
        None => image,
    }
}

/// Averages the light along the camera's motion.
fn motion(source: &[[f32; 3]], light: &mut [[f32; 3]], width: usize, way: [f32; 2]) {
    let height = light.len() / width;
    let taps = (way[0].hypot(way[1]).ceil() as usize + 1).clamp(2, 24);
    let share = 1.0 / taps as f32;
    let offsets: Vec<[isize; 2]> = (0..taps)
        .map(|tap| tap as f32 / (taps - 1) as f32 - 0.5)
        .map(|t| [(way[0] * t).round() as isize, (way[1] * t).round() as isize])
        .collect();
    let reach = offsets.iter().map(|[dx, _]| dx.unsigned_abs()).max().unwrap_or(0);
    let row_len = 3 * width;
    let (source, mut padded) = (source.as_flattened(), vec![0.0f32; row_len + 6 * reach]);
    let start = 3 * reach;
    for (y, out) in light.as_flattened_mut().chunks_exact_mut(row_len).enumerate() {
        out.fill(0.0);
        for &[dx, dy] in &offsets {
            let v = (y as isize + dy).clamp(0, height as isize - 1) as usize;
            let row = &source[v * row_len..][..row_len];
            pad_row(row, reach, &mut padded);
            let shifted = &padded[start.wrapping_add_signed(3 * dx)..][..row_len];
            out.iter_mut().zip(shifted).for_each(|(out, value)| *out += value * share);
        }
    }
}

/// Applies the tone curve and noise, and rounds to 8 bits.
fn expose(light: &[[f32; 3]], width: usize, sensor: &Sensor, rng: &mut Pcg64Mcg) -> RgbImage {
    // As a function of the square root of light, because the curve is steep near black.
    let curve: [f32; CURVE] = std::array::from_fn(|k| {
        let root = k as f32 / (CURVE - 1) as f32;
        let v = root * root;
        let encoded = if v < 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
        255.0 * encoded.powf(sensor.contrast)
    });
    let tiles = Tiles::get();
    let address: u64 = rng.random();
    let sigma = 255.0 * sensor.noise;
    let row_len = 3 * width;
    let mut bytes = vec![0u8; 3 * light.len()];
    let mut values = vec![0.0f32; row_len];
    for (y, (row, out)) in light.as_flattened().chunks_exact(row_len).zip(bytes.chunks_exact_mut(row_len)).enumerate() {
        let noise = tiles.normals(scramble(address.wrapping_add(y as u64)), row_len + 3);
        for (value, light) in values.iter_mut().zip(row) {
            *value = light.min(1.0).sqrt() * (CURVE - 1) as f32 + 0.5;
        }
        for value in &mut values {
            // From 0 to CURVE - 1; the mask avoids a bounds check.
            *value = curve[floor(*value) as usize & (CURVE - 1)];
        }
        let pixels = values.chunks_exact(3).zip(noise.chunks_exact(3)).zip(noise[3..].iter().step_by(3));
        for (((value, noise), shared), out) in pixels.zip(out.chunks_exact_mut(3)) {
            // Part of the noise is common to all channels.
            for k in 0..3 {
                let strength = sigma * (0.45 + 0.55 * (value[k] * (1.0 / 128.0)).min(1.3));
                let noisy = value[k] + strength * (0.75 * noise[k] + 0.6 * shared);
                out[k] = floor(noisy.clamp(0.0, 255.0) + 0.5) as u8;
            }
        }
    }
    RgbImage::from_raw(width as u32, (light.len() / width) as u32, bytes).expect("three bytes were made for each pixel")
}

/// The picture after JPEG compression; `None` if the codec rejects its size.
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

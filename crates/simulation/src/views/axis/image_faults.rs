//! Effects of light, lens and sensor on a rendered picture: darkness with noise, blur, a colour cast.
//!
//! All effects apply to light, not to pixel values: a picture is converted to linear light, changed, and converted back
//! with sRGB's curve.

use std::f64::consts::PI;

use image::RgbImage;
use rand::Rng;
use rand_pcg::Pcg64Mcg;

use super::request::{AxisParameter, Request};
use crate::normal::Normal;

/// Largest and smallest exposure as a fraction of the usual one; between them, the logarithm is uniformly distributed.
const EXPOSURES: [f64; 2] = [0.25, 0.02];
/// Number of electrons of white at the usual exposure, as in a pixel of a small camera.
const ELECTRONS_AT_WHITE: f64 = 6000.0;
/// Standard deviation of the read noise of a pixel, in electrons.
const READ_NOISE_ELECTRONS: f64 = 5.0;
/// Level to which the camera's gain amplifies white, up to [`MAX_GAIN`].
const WHITE_AIMED_AT: f64 = 1.0 / 3.0;
/// Largest gain of the camera.
const MAX_GAIN: f64 = 4.0;

/// Range of the length of motion blur, in pixels.
const MOTION_PX: std::ops::Range<f64> = 3.0..12.0;
/// Range of the diameter of the disc of defocus, in pixels.
const DEFOCUS_PX: std::ops::Range<f64> = 2.5..8.0;
/// Number of points of a blur's kernel, so large that single points are invisible at the longest blur.
const BLUR_POINTS: usize = 64;

/// Range of the logarithm of the ratio by which a colour cast changes red relative to blue.
const CAST_LOG_RATIOS: std::ops::Range<f64> = 0.15..0.9;
/// Largest logarithm of the factor for green, as a fraction of the logarithm of the ratio of red to blue.
const GREEN_SHARE: f64 = 0.35;

/// Linear light of a picture, row by row, three channels per pixel.
struct Light {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

impl Light {
    fn of(image: &RgbImage) -> Self {
        let table: Vec<f32> = (0..=255u8)
            .map(|value| {
                let v = f64::from(value) / 255.0;
                (if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }) as f32
            })
            .collect();
        let values = image.as_raw().iter().map(|&value| table[usize::from(value)]).collect();
        Self { width: image.width() as usize, height: image.height() as usize, values }
    }

    fn write_to(&self, image: &mut RgbImage) {
        for (pixel, &value) in image.iter_mut().zip(&self.values) {
            let v = f64::from(value.clamp(0.0, 1.0));
            let encoded = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
            *pixel = (encoded * 255.0).round() as u8;
        }
    }
}

/// Reduces the light: fewer electrons with shot noise, read noise, and the camera's limited gain.
pub(super) fn darken(image: &mut RgbImage, request: &mut Request<'_>) -> AxisParameter {
    let [most, least] = EXPOSURES.map(f64::ln);
    let exposure = (most + request.level * (least - most)).exp();
    let gain = (WHITE_AIMED_AT / exposure).clamp(1.0, MAX_GAIN);
    let mut light = Light::of(image);
    let mut normal = Normal::default();
    for value in &mut light.values {
        let mean = f64::from(*value) * ELECTRONS_AT_WHITE * exposure;
        let counted =
            poisson(mean, &mut request.rng, &mut normal) + READ_NOISE_ELECTRONS * normal.sample(&mut request.rng);
        *value = (counted.max(0.0) * gain / ELECTRONS_AT_WHITE) as f32;
    }
    light.write_to(image);
    AxisParameter {
        value: exposure,
        unit: "of the usual exposure",
        description: format!("{:.1} % of the usual light, amplified {gain:.1} times", exposure * 100.0),
    }
}

/// Blurs the picture: motion in a random direction in pictures with an even number, defocus in the others.
pub(super) fn blur(image: &mut RgbImage, request: &mut Request<'_>) -> AxisParameter {
    let (points, value, description): (Vec<(f64, f64)>, f64, String) = if request.number.is_multiple_of(2) {
        let length = request.between(MOTION_PX);
        let direction: f64 = request.rng.random_range(0.0..PI);
        let points = (0..BLUR_POINTS).map(|step| {
            let along = length * ((step as f64 + 0.5) / BLUR_POINTS as f64 - 0.5);
            (along * direction.cos(), along * direction.sin())
        });
        (points.collect(), length, format!("motion blur over {length:.1} px at {:.0} degrees", direction.to_degrees()))
    } else {
        let diameter = request.between(DEFOCUS_PX);
        // Points in a sunflower pattern fill the disc evenly.
        let points = (0..BLUR_POINTS).map(|step| {
            let radius = 0.5 * diameter * ((step as f64 + 0.5) / BLUR_POINTS as f64).sqrt();
            let angle = step as f64 * PI * (3.0 - 5f64.sqrt());
            (radius * angle.cos(), radius * angle.sin())
        });
        (points.collect(), diameter, format!("out of focus, points become discs of {diameter:.1} px"))
    };
    let mut light = Light::of(image);
    light.values = convolved(&light, &kernel(&points));
    light.write_to(image);
    AxisParameter { value, unit: "px", description }
}

/// Weights of whole pixels around the centre: each point is distributed over the four pixels around it.
fn kernel(points: &[(f64, f64)]) -> Vec<(i64, i64, f32)> {
    let mut weights = std::collections::BTreeMap::new();
    for &(x, y) in points {
        let (left, top) = (x.floor(), y.floor());
        let (u, v) = (x - left, y - top);
        for (dx, dy, share) in
            [(0, 0, (1.0 - u) * (1.0 - v)), (1, 0, u * (1.0 - v)), (0, 1, (1.0 - u) * v), (1, 1, u * v)]
        {
            *weights.entry((left as i64 + dx, top as i64 + dy)).or_insert(0.0) += share / points.len() as f64;
        }
    }
    weights.into_iter().filter(|(_, weight)| *weight > 0.0).map(|((x, y), weight)| (x, y, weight as f32)).collect()
}

/// The light, convolved with a kernel; beyond the border the last row or column is repeated.
fn convolved(light: &Light, kernel: &[(i64, i64, f32)]) -> Vec<f32> {
    let Light { width, height, values } = light;
    let row_len = 3 * width;
    let mut spread = vec![0.0f32; values.len()];
    for (y, out) in spread.chunks_exact_mut(row_len).enumerate() {
        for &(dx, dy, weight) in kernel {
            let from = (y as i64 + dy).clamp(0, *height as i64 - 1) as usize;
            let row = &values[from * row_len..(from + 1) * row_len];
            // The inner part of the row is computed in one loop, the border pixel by pixel.
            let start = (-dx).clamp(0, *width as i64) as usize;
            let end = (*width as i64 - dx).clamp(start as i64, *width as i64) as usize;
            let shifted = &row[3 * (start as i64 + dx) as usize..3 * (end as i64 + dx) as usize];
            for (sum, &value) in out[3 * start..3 * end].iter_mut().zip(shifted) {
                *sum += weight * value;
            }
            for x in (0..start).chain(end..*width) {
                let nearest = (x as i64 + dx).clamp(0, *width as i64 - 1) as usize;
                for channel in 0..3 {
                    out[3 * x + channel] += weight * row[3 * nearest + channel];
                }
            }
        }
    }
    spread
}

/// Changes the colour of the light, which then differs from the camera's white balance: each channel has its own gain.
pub(super) fn tint(image: &mut RgbImage, request: &mut Request<'_>) -> AxisParameter {
    let strength = request.between(CAST_LOG_RATIOS);
    let rng = &mut request.rng;
    let warm = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let green = GREEN_SHARE * strength * rng.random_range(-1.0..1.0);
    let logs = [0.5 * warm * strength, green, -0.5 * warm * strength];
    // The camera's exposure keeps the brightness of grey.
    let [r, g, b] = logs.map(f64::exp);
    let brightness = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let gains = [r, g, b].map(|gain| gain / brightness);
    let mut light = Light::of(image);
    for pixel in light.values.chunks_exact_mut(3) {
        for (value, gain) in pixel.iter_mut().zip(gains) {
            *value *= gain as f32;
        }
    }
    light.write_to(image);
    AxisParameter {
        value: strength.exp(),
        unit: "between red and blue",
        description: format!("light times {:.2} red, {:.2} green, {:.2} blue", gains[0], gains[1], gains[2]),
    }
}

/// A sample of the Poisson distribution with a mean: by Knuth's product of uniform numbers for small means, by the
/// normal distribution for large ones.
fn poisson(mean: f64, rng: &mut Pcg64Mcg, normal: &mut Normal) -> f64 {
    if mean > 12.0 {
        return (mean + mean.sqrt() * normal.sample(rng)).round().max(0.0);
    }
    let limit = (-mean).exp();
    let mut product: f64 = rng.random();
    let mut count = 0.0;
    while product > limit {
        product *= rng.random::<f64>();
        count += 1.0;
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn counts_have_their_mean_and_its_variance() {
        let (mut rng, mut normal) = (Pcg64Mcg::seed_from_u64(3), Normal::default());
        for mean in [0.5, 6.0, 40.0] {
            let counts: Vec<f64> = (0..40_000).map(|_| poisson(mean, &mut rng, &mut normal)).collect();
            let found = counts.iter().sum::<f64>() / counts.len() as f64;
            let variance = counts.iter().map(|count| (count - found).powi(2)).sum::<f64>() / counts.len() as f64;
            // The tolerances are four standard errors: sqrt(mean / n) for the mean, sqrt(mean * (1 + 2 * mean) / n) for
            // the variance.
            assert!((found - mean).abs() < 4.0 * (mean / 4e4).sqrt(), "{mean}: {found}");
            assert!((variance - mean).abs() < 4.0 * (mean * (1.0 + 2.0 * mean) / 4e4).sqrt(), "{mean}: {variance}");
        }
    }

    #[test]
    fn a_blur_keeps_the_light_and_spreads_it_as_far_as_it_says() {
        let points: Vec<(f64, f64)> =
            (0..64).map(|step| (10.0 * ((f64::from(step) + 0.5) / 64.0 - 0.5), 0.0)).collect();
        let kernel = kernel(&points);
        assert!((kernel.iter().map(|(_, _, weight)| weight).sum::<f32>() - 1.0).abs() < 1e-5);
        let mut light = Light { width: 31, height: 5, values: vec![0.0; 3 * 31 * 5] };
        light.values[3 * (2 * 31 + 15)] = 1.0;
        let spread = convolved(&light, &kernel);
        let lit = (0..31).filter(|x| spread[3 * (2 * 31 + x)] > 0.05).count();
        assert_eq!(lit, 9 + 2 * usize::from(spread[3 * (2 * 31 + 10)] > 0.05));
        assert!((spread.iter().sum::<f32>() - 1.0).abs() < 1e-4);
        let even = Light { width: 31, height: 5, values: vec![0.25; 3 * 31 * 5] };
        assert!(convolved(&even, &kernel).iter().all(|value| (value - 0.25).abs() < 1e-5));
    }

    #[test]
    fn light_and_pixels_are_each_others_inverse() {
        let image = RgbImage::from_fn(16, 16, |x, y| image::Rgb([(16 * y + x) as u8; 3]));
        let mut back = RgbImage::new(16, 16);
        Light::of(&image).write_to(&mut back);
        assert_eq!(image, back);
    }
}

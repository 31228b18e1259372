//! Changes the light of a picture and the camera's colours.

use super::random::{SampleRng, chance, direction, uniform};
use crate::raster::{Raster, smoothstep};

/// Steps of a tone curve; fine enough that a step is below half a grey value.
const CURVE_STEPS: usize = 1024;
/// Brightest value that a curve distinguishes.
const CURVE_TOP: f32 = 2.0;

/// Multiplies the canvas by a lighting gradient, sometimes with the edge of a large shadow, then maps every channel
/// through a tone curve of gain, gamma, contrast and cast.
pub(crate) fn relight(canvas: &mut Raster, rng: &mut SampleRng) {
    let (width, height) = (canvas.width as f32, canvas.height as f32);
    let slope = direction(rng);
    let strength = uniform(rng, 0.0, 0.35) / (0.5 * width.hypot(height));
    let shaded = chance(rng, 0.2).then(|| {
        let edge = [uniform(rng, 0.1, 0.9) * width, uniform(rng, 0.1, 0.9) * height];
        (edge, direction(rng), uniform(rng, 2.0, 0.15 * width), uniform(rng, 0.15, 0.5))
    });
    let curves = draw_curves(rng);

    for (y, row) in canvas.pixels.chunks_exact_mut(canvas.width).enumerate() {
        let dy = y as f32 - 0.5 * height;
        for (x, pixel) in row.iter_mut().enumerate() {
            let x = x as i32 as f32;
            let dx = x - 0.5 * width;
            let mut light = 1.0 + strength * (dx * slope[0] + dy * slope[1]);
            if let Some((edge, normal, soft, dark)) = shaded {
                let along = (x - edge[0]) * normal[0] + (y as f32 - edge[1]) * normal[1];
                light *= 1.0 - dark * smoothstep(-soft, soft, along);
            }
            let scale = light * (CURVE_STEPS as f32 / CURVE_TOP);
            for k in 0..3 {
                // Through i32, which a processor converts in one step.
                let step = (pixel[k] * scale).max(0.0) as i32 as usize;
                pixel[k] = curves[k][step.min(CURVE_STEPS - 1)];
            }
        }
    }
}

fn draw_curves(rng: &mut SampleRng) -> [[f32; CURVE_STEPS]; 3] {
    let gain = uniform(rng, -0.55, 0.35).exp();
    let gamma = uniform(rng, -0.3, 0.3).exp();
    let contrast = uniform(rng, 0.75, 1.25);
    // Change of the black level, mostly raised.
    let lift = uniform(rng, -0.03, 0.08);
    std::array::from_fn(|_| {
        let cast = uniform(rng, -0.12, 0.12).exp();
        std::array::from_fn(|step| {
            let value = (step as f32 + 0.5) * CURVE_TOP / CURVE_STEPS as f32;
            let toned = (value * gain * cast).powf(gamma);
            shoulder((toned - 0.5) * contrast + 0.5 + lift)
        })
    })
}

/// Compresses highlights softly, as cameras do: a part clipped to white has no surface left to learn.
fn shoulder(value: f32) -> f32 {
    const BEND: f32 = 0.82;
    if value <= BEND {
        return value.max(0.0);
    }
    BEND + (1.0 - BEND) * (1.0 - (-(value - BEND) / (1.0 - BEND)).exp())
}

#[cfg(test)]
mod tests {
    use super::super::random::{Stream, sample_rng};
    use super::*;

    #[test]
    fn curves_rise_and_stay_in_range() {
        for index in 0..50 {
            for curve in draw_curves(&mut sample_rng(2, Stream::Preparation, index)) {
                assert!(curve.windows(2).all(|pair| pair[0] <= pair[1]), "falls: {curve:?}");
                assert!(curve.iter().all(|v| (0.0..=1.0).contains(v)));
                assert!(curve[CURVE_STEPS / 2] > 0.4, "white has become {}", curve[CURVE_STEPS / 2]);
            }
        }
    }

    #[test]
    fn highlights_meet_the_straight_part_smoothly() {
        assert_eq!(shoulder(0.5), 0.5);
        assert!((shoulder(0.8201) - 0.8201).abs() < 1e-6 && shoulder(5.0) <= 1.0);
    }
}

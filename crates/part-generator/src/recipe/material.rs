//! Materials of parts: colours in linear light, gloss, grain.

use rand_pcg::Pcg64Mcg;

use crate::random::Draw;

/// A colour in linear light, each channel from 0 to 1.
pub(crate) type Color = [f32; 3];

/// Fine parallel scratches that spread reflections across them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Brushing {
    /// Along a direction in the part's frame, in radians.
    Along(f32),
    /// Around the part's origin, as on a lathe.
    Around,
}

/// The appearance of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Material {
    /// Diffuse reflectance of each channel.
    pub albedo: Color,
    /// Specular reflectance at normal incidence.
    pub reflectance: Color,
    /// 0 is a mirror, 1 is without gloss.
    pub roughness: f32,
    /// Scratches, if any.
    pub brushing: Option<Brushing>,
    /// Slope of the grain: 0 is smooth.
    pub grain: f32,
    /// Size of the grain in millimetres.
    pub grain_mm: f32,
    /// Relative variation of the colour: stains, dust.
    pub mottle: f32,
}

impl Material {
    /// Samples a material of a part.
    pub fn draw(rng: &mut Pcg64Mcg) -> Self {
        match rng.whole(0, 9) {
            0..=2 => Self::metal(rng),
            3 => Self::brushed(rng),
            4 => Self::polished(rng),
            5 => Self::painted(rng),
            6 => Self::plastic(rng),
            7 | 8 => Self::black(rng),
            _ => Self::coated(rng),
        }
    }

    /// Mirrors the direction of scratches across the y axis.
    pub fn mirror(&mut self) {
        if let Some(Brushing::Along(angle)) = &mut self.brushing {
            *angle = std::f32::consts::PI - *angle;
        }
    }

    /// Bare metal with mill finish.
    pub fn metal(rng: &mut Pcg64Mcg) -> Self {
        let reflectance = metal_color(rng);
        let roughness = rng.uniform(0.25, 0.6);
        Self {
            albedo: reflectance.map(|c| c * 0.35 * roughness),
            reflectance,
            roughness,
            brushing: None,
            grain: rng.uniform(0.01, 0.08),
            grain_mm: rng.log_uniform(0.5, 3.0),
            mottle: rng.uniform(0.02, 0.12),
        }
    }

    /// Ground or brushed metal: scratches in one direction.
    pub fn brushed(rng: &mut Pcg64Mcg) -> Self {
        let angle = rng.angle();
        Self { brushing: Some(Brushing::Along(angle)), roughness: rng.uniform(0.2, 0.4), ..Self::metal(rng) }
    }

    /// Turned metal: scratches around the axis.
    pub fn turned(rng: &mut Pcg64Mcg) -> Self {
        Self { brushing: Some(Brushing::Around), roughness: rng.uniform(0.15, 0.4), ..Self::metal(rng) }
    }

    /// Chromed or polished metal.
    pub fn polished(rng: &mut Pcg64Mcg) -> Self {
        let reflectance = metal_color(rng);
        Self {
            albedo: reflectance.map(|c| c * 0.03),
            reflectance,
            roughness: rng.uniform(0.04, 0.2),
            brushing: None,
            grain: rng.uniform(0.0, 0.02),
            grain_mm: rng.uniform(2.0, 8.0),
            mottle: rng.uniform(0.0, 0.04),
        }
    }

    /// As-cast metal.
    pub fn cast(rng: &mut Pcg64Mcg) -> Self {
        let level = rng.log_uniform(0.12, 0.55);
        let warm = rng.uniform(-0.06, 0.08);
        let albedo = [level * (1.0 + warm), level, level * (1.0 - warm)];
        Self {
            albedo: albedo.map(|c| c * 0.7),
            reflectance: albedo.map(|c| c * 0.5),
            roughness: rng.uniform(0.5, 0.8),
            brushing: None,
            grain: rng.uniform(0.08, 0.22),
            grain_mm: rng.log_uniform(0.5, 1.6),
            mottle: rng.uniform(0.05, 0.2),
        }
    }

    /// Gloss paint or powder coat.
    pub fn painted(rng: &mut Pcg64Mcg) -> Self {
        Self {
            albedo: paint_color(rng),
            reflectance: [0.045; 3],
            roughness: rng.uniform(0.12, 0.5),
            brushing: None,
            grain: rng.uniform(0.0, 0.05),
            grain_mm: rng.uniform(0.8, 3.0),
            mottle: rng.uniform(0.0, 0.06),
        }
    }

    /// Moulded plastic or rubber.
    pub fn plastic(rng: &mut Pcg64Mcg) -> Self {
        Self {
            albedo: paint_color(rng),
            reflectance: [0.04; 3],
            roughness: rng.uniform(0.35, 0.9),
            brushing: None,
            grain: rng.uniform(0.0, 0.08),
            grain_mm: rng.uniform(0.4, 1.5),
            mottle: rng.uniform(0.0, 0.06),
        }
    }

    /// Black: plastic, rubber, burnished steel.
    pub fn black(rng: &mut Pcg64Mcg) -> Self {
        let level = rng.log_uniform(0.012, 0.06);
        let tint = rng.uniform(-0.15, 0.15);
        Self {
            albedo: [level * (1.0 + tint), level, level * (1.0 - tint)],
            reflectance: [rng.uniform(0.035, 0.09); 3],
            roughness: rng.uniform(0.2, 0.85),
            brushing: None,
            grain: rng.uniform(0.0, 0.1),
            grain_mm: rng.uniform(0.4, 2.0),
            mottle: rng.uniform(0.0, 0.2),
        }
    }

    /// Zinc, yellow chromate, anodised colours.
    pub fn coated(rng: &mut Pcg64Mcg) -> Self {
        let hue = paint_color(rng);
        let strength = rng.uniform(0.2, 0.6);
        let reflectance = hue.map(|c| 0.15 + 0.55 * (c * strength + 0.55 * (1.0 - strength)));
        let roughness = rng.uniform(0.25, 0.55);
        Self {
            albedo: reflectance.map(|c| c * 0.3),
            reflectance,
            roughness,
            brushing: None,
            grain: rng.uniform(0.0, 0.06),
            grain_mm: rng.uniform(0.5, 2.0),
            mottle: rng.uniform(0.03, 0.15),
        }
    }

    /// Printing ink or a paper label.
    pub fn print(rng: &mut Pcg64Mcg) -> Self {
        let albedo = match rng.whole(0, 4) {
            0 | 1 => [rng.uniform(0.6, 0.85); 3],
            2 => [rng.uniform(0.01, 0.05); 3],
            _ => paint_color(rng),
        };
        Self {
            albedo,
            reflectance: [0.04; 3],
            roughness: rng.uniform(0.4, 0.9),
            brushing: None,
            grain: 0.01,
            grain_mm: 1.0,
            mottle: 0.03,
        }
    }
}

/// The reflection colours of common metals, with the spread of alloys and tarnish.
fn metal_color(rng: &mut Pcg64Mcg) -> Color {
    let color = match rng.whole(0, 9) {
        0..=3 => [0.56, 0.55, 0.53],
        4..=6 => [0.72, 0.73, 0.74],
        7 => [0.66, 0.52, 0.28],
        8 => [0.64, 0.42, 0.32],
        _ => [0.40, 0.40, 0.41],
    };
    let shade = rng.uniform(0.75, 1.15);
    color.map(|c: f32| (c * shade * rng.uniform(0.97, 1.03)).min(0.95))
}

/// Colours of painted and moulded parts: more greys, whites and dull colours than bright ones.
pub(crate) fn paint_color(rng: &mut Pcg64Mcg) -> Color {
    let (saturation, value) = match rng.whole(0, 9) {
        0..=3 => (rng.uniform(0.0, 0.12), rng.log_uniform(0.06, 0.75)),
        4..=6 => (rng.uniform(0.15, 0.6), rng.log_uniform(0.06, 0.5)),
        _ => (rng.uniform(0.6, 0.92), rng.log_uniform(0.12, 0.6)),
    };
    // Mostly blue, red, yellow, orange or green; sometimes any hue.
    let hue = match rng.whole(0, 7) {
        0 | 1 => rng.uniform(0.56, 0.66),
        2 => rng.uniform(-0.03, 0.02),
        3 => rng.uniform(0.10, 0.16),
        4 => rng.uniform(0.04, 0.09),
        5 => rng.uniform(0.28, 0.45),
        _ => rng.uniform(0.0, 1.0),
    };
    [0.0f32, 2.0 / 3.0, 1.0 / 3.0].map(|offset| {
        let ramp = (6.0 * (hue + offset).rem_euclid(1.0) - 3.0).abs() - 1.0;
        value * (1.0 - saturation + saturation * ramp.clamp(0.0, 1.0))
    })
}

//! Lamps, ambient light, and reflections in shiny parts.

use rand_pcg::Pcg64Mcg;

use super::color_grid::bilinear;
use crate::random::Draw;
use crate::recipe::Material;

/// Side of the map of reflections, in texels.
const SIDE: usize = 32;

/// Blur of the maps, in texels, from a mirror to a matt surface.
const BLURS: [f32; 4] = [0.0, 1.0, 2.7, 6.0];

/// A lamp at infinite distance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lamp {
    /// Unit vector towards the lamp, z up.
    pub direction: [f32; 3],
    /// Light scattered by a white surface that faces the lamp.
    pub color: [f32; 3],
    /// Angular radius of the lamp, in radians.
    pub radius: f32,
    /// Strength of the lamp's reflection in glossy surfaces.
    pub glare: f32,
}

/// All light of a scene.
pub(crate) struct Lighting {
    pub lamps: Vec<Lamp>,
    /// Ambient light.
    pub ambient: [f32; 3],
    /// Relative change of the light across the picture, per picture width, in x and in y.
    pub gradient: [f32; 2],
    /// Reflected light by direction, for each roughness; the fourth channel is unused.
    maps: Vec<Vec<[f32; 4]>>,
}

/// The style of lighting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LightStyle {
    /// Even light, as in the demonstration's photo.
    pub even: bool,
    /// Strong narrow lamps with highlights.
    pub glare: bool,
    /// Hard shadows.
    pub hard: bool,
}

impl Lighting {
    /// Samples lamps and surroundings.
    pub fn draw(style: LightStyle, rng: &mut Pcg64Mcg) -> Self {
        let hall = tint(rng, 0.05);
        let share_ambient = if style.even {
            rng.uniform(0.6, 0.8)
        } else if style.hard {
            rng.uniform(0.2, 0.4)
        } else {
            rng.uniform(0.25, 0.65)
        };
        let num_lamps = if style.even {
            rng.whole(1, 2)
        } else if rng.chance(0.2) {
            3
        } else {
            rng.whole(1, 2)
        };
        let shares: Vec<f32> = (0..num_lamps).map(|_| rng.uniform(0.3, 1.0)).collect();
        let total: f32 = shares.iter().sum();
        let lamps: Vec<Lamp> = shares
            .iter()
            .map(|share| {
                let azimuth = rng.angle();
                let elevation: f32 = if style.even { rng.uniform(1.0, 1.4) } else { rng.uniform(0.55, 1.4) };
                let strength = (1.0 - share_ambient) * share / total / elevation.sin();
                let (sin, cos) = azimuth.sin_cos();
                Lamp {
                    direction: [cos * elevation.cos(), sin * elevation.cos(), elevation.sin()],
                    color: tint(rng, 0.08).map(|c| c * strength),
                    radius: if style.even {
                        rng.uniform(0.15, 0.3)
                    } else if style.hard {
                        rng.uniform(0.01, 0.05)
                    } else {
                        rng.log_uniform(0.02, 0.3)
                    },
                    glare: if style.glare { rng.uniform(1.0, 2.2) } else { rng.uniform(0.2, 0.8) },
                }
            })
            .collect();
        let slope = if style.even { 0.1 } else { 0.8 };
        let gradient = [rng.uniform(-slope, slope), rng.uniform(-slope, slope)];
        let ambient = hall.map(|c| c * share_ambient);
        let maps = reflections(&lamps, ambient, style, rng);
        Self { lamps, ambient, gradient, maps }
    }

    /// Light reflected from a direction by a surface with the reflection map `level`: the mean over the surface's lobe.
    #[inline(always)]
    pub fn reflected(&self, direction: [f32; 3], level: usize) -> [f32; 4] {
        let half = 0.5 * SIDE as f32;
        let [x, y] = [direction[0], direction[1]].map(|along| along * half + (half - 0.5));
        bilinear(&self.maps[level], [SIDE; 2], x, y)
    }

    /// Index of the map for a material.
    pub fn level_of(material: &Material) -> usize {
        match material.roughness {
            r if r < 0.13 => 0,
            r if r < 0.3 => 1,
            r if r < 0.55 => 2,
            _ => 3,
        }
    }
}

/// White made warmer or colder by a random fraction of at most `share`.
fn tint(rng: &mut Pcg64Mcg, share: f32) -> [f32; 3] {
    let warmth = rng.uniform(-1.0, 1.0) * share;
    [1.0 + warmth, 1.0, 1.0 - 1.2 * warmth]
}

/// The upper hemisphere of the surroundings as a horizontal mirror reflects it: walls, ceiling, windows, the dark
/// camera above.
fn reflections(lamps: &[Lamp], ambient: [f32; 3], style: LightStyle, rng: &mut Pcg64Mcg) -> Vec<Vec<[f32; 4]>> {
    let (ceiling, wall) = (rng.uniform(0.7, 1.5), rng.uniform(0.25, 1.0));
    let lean = [rng.uniform(-0.6, 0.6), rng.uniform(-0.6, 0.6)];
    // Windows and soft boxes: centre, half size, rotation, brightness.
    let panels: Vec<([f32; 2], [f32; 2], f32, f32)> = (0..rng.whole(1, 4))
        .map(|_| {
            let (angle, reach) = (rng.angle(), rng.uniform(0.1, 0.85));
            let brightness = if style.even { rng.uniform(1.2, 2.0) } else { rng.log_uniform(1.2, 5.0) };
            let half = [rng.uniform(0.08, 0.4), rng.uniform(0.05, 0.25)];
            ([reach * angle.cos(), reach * angle.sin()], half, rng.angle(), brightness)
        })
        .collect();
    let camera = rng.uniform(0.08, 0.22);
    let dark = rng.uniform(0.25, 0.9);
    let mut map = vec![[0.0f32; 3]; SIDE * SIDE];
    for (idx, texel) in map.iter_mut().enumerate() {
        let x = (idx % SIDE) as f32 / SIDE as f32 * 2.0 - 1.0 + 1.0 / SIDE as f32;
        let y = (idx / SIDE) as f32 / SIDE as f32 * 2.0 - 1.0 + 1.0 / SIDE as f32;
        let r = x.hypot(y);
        let up = (1.0 - r * r).max(0.0).sqrt();
        let mut light = wall + (ceiling - wall) * up;
        light *= 1.0 + lean[0] * x + lean[1] * y;
        for (center, half, turn, brightness) in &panels {
            let (sin, cos) = turn.sin_cos();
            let (dx, dy) = (x - center[0], y - center[1]);
            let (a, b) = ((cos * dx + sin * dy).abs() - half[0], (cos * dy - sin * dx).abs() - half[1]);
            if a < 0.0 && b < 0.0 {
                light = *brightness;
            }
        }
        if r < camera {
            light *= dark;
        }
        *texel = ambient.map(|c| c * light.max(0.02) * 1.25);
    }
    let mut spare = map.clone();
    BLURS
        .iter()
        .map(|&blur| {
            let mut blurred = map.clone();
            if blur > 0.0 {
                super::blur::blur(&mut blurred, &mut spare, SIDE, blur);
            }
            for lamp in lamps {
                add_lamp(&mut blurred, lamp, blur);
            }
            blurred.into_iter().map(|[red, green, blue]| [red, green, blue, 0.0]).collect()
        })
        .collect()
}

/// A highlight: as wide as lamp and blur together, with a brightness that conserves energy.
fn add_lamp(map: &mut [[f32; 3]], lamp: &Lamp, blur: f32) {
    // A half-vector lobe: the reflected direction spreads twice as far as the normal.
    let texels = 0.5 * SIDE as f32;
    let width = (lamp.radius * texels).hypot(1.1 * blur).max(0.7);
    let energy = 6.2 * lamp.glare * (1.0 + (lamp.radius * texels).powi(2) * 0.3);
    let peak = (energy / (width * width)).min(30.0);
    let (cx, cy) = ((lamp.direction[0] + 1.0) * texels - 0.5, (lamp.direction[1] + 1.0) * texels - 0.5);
    for (idx, texel) in map.iter_mut().enumerate() {
        let (dx, dy) = ((idx % SIDE) as f32 - cx, (idx / SIDE) as f32 - cy);
        let exponent = 0.5 * (dx * dx + dy * dy) / (width * width);
        if exponent < 8.0 {
            let strength = peak * (-exponent).exp();
            texel.iter_mut().zip(lamp.color).for_each(|(light, color)| *light += color * strength);
        }
    }
}

//! The table, with one of several surfaces. Its top is the plane z = 0 of the base frame, except in drawings of plans.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::fragment::MjcfFragment;
use crate::shapes::texture::{Color, Noise, Texture};

/// Metres of table per repeat of the texture.
const METRES_PER_REPEAT: f64 = 0.5;

/// Texels along one side of the texture: about one per pixel of the wrist camera.
const TEXELS: u32 = 512;

/// The material of the top.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableSurface {
    /// Smooth laminate of one colour.
    Plain,
    /// Laminate with speckles.
    Speckled,
    /// Boards with grain.
    Wood,
    /// Brushed sheet metal.
    BrushedMetal,
    /// A cutting mat with a grid of one and five centimetres.
    CuttingMat,
    /// Two colours in squares.
    Chequered,
    /// Corrugated board.
    Cardboard,
    /// Oiled, spotted workshop steel.
    Stained,
}

impl TableSurface {
    /// All kinds.
    pub const ALL: [TableSurface; 8] = [
        TableSurface::Plain,
        TableSurface::Speckled,
        TableSurface::Wood,
        TableSurface::BrushedMetal,
        TableSurface::CuttingMat,
        TableSurface::Chequered,
        TableSurface::Cardboard,
        TableSurface::Stained,
    ];
}

/// A table top.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Table {
    /// Material of the top.
    pub surface: TableSurface,
    /// Main colour.
    pub base: Color,
    /// Colour of grain, lines or speckles.
    pub accent: Color,
    /// Seed of the pattern.
    pub seed: u64,
}

impl Table {
    /// The light grey laminate of demonstrations.
    pub fn nominal() -> Self {
        Self { surface: TableSurface::Plain, base: [0.66, 0.66, 0.64], accent: [0.6, 0.6, 0.58], seed: 1 }
    }

    /// Samples a surface with a plausible colour.
    pub fn sample(rng: &mut Pcg64Mcg) -> Self {
        let surface = TableSurface::ALL[rng.random_range(0..TableSurface::ALL.len())];
        let grey = |rng: &mut Pcg64Mcg, low: f64, high: f64| {
            let level = rng.random_range(low..high);
            [level * rng.random_range(0.95..1.05), level, level * rng.random_range(0.92..1.08)]
        };
        let colored = |rng: &mut Pcg64Mcg| {
            let level = rng.random_range(0.25..0.8);
            [0; 3].map(|_: i32| level * rng.random_range(0.65..1.2))
        };
        let (base, accent) = match surface {
            TableSurface::Plain => (colored(rng), [0.5; 3]),
            TableSurface::Speckled => (grey(rng, 0.3, 0.85), grey(rng, 0.1, 0.9)),
            TableSurface::Wood => {
                let level = rng.random_range(0.45..0.9);
                ([level, level * 0.76, level * 0.52], [level * 0.62, level * 0.42, level * 0.26])
            }
            TableSurface::BrushedMetal => (grey(rng, 0.45, 0.75), [0.5; 3]),
            TableSurface::CuttingMat => {
                let mats = [[0.13, 0.36, 0.28], [0.14, 0.22, 0.38], [0.20, 0.20, 0.21], [0.55, 0.57, 0.58]];
                (mats[rng.random_range(0..mats.len())], [0.85, 0.85, 0.75])
            }
            TableSurface::Chequered => (grey(rng, 0.45, 0.85), grey(rng, 0.25, 0.6)),
            TableSurface::Cardboard => ([0.70, 0.55, 0.38].map(|c| c * rng.random_range(0.9..1.1)), [0.5; 3]),
            TableSurface::Stained => (grey(rng, 0.3, 0.55), [0.25, 0.20, 0.16]),
        };
        Self { surface, base, accent, seed: rng.random() }
    }

    /// Paints one repeat of the surface.
    pub fn texture(&self) -> Texture {
        let seed = self.seed;
        let base = self.base;
        let mix = |a: Color, b: Color, t: f64| {
            let t = t.clamp(0.0, 1.0);
            [0, 1, 2].map(|channel| a[channel] * (1.0 - t) + b[channel] * t)
        };
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let noise = Noise::new(12, seed);
        match self.surface {
            TableSurface::Plain => Texture::grained(TEXELS, base, 0.025, seed),
            TableSurface::BrushedMetal => Texture::brushed(TEXELS, base, 0.11, seed),
            TableSurface::Speckled => {
                let speckles = Noise::new(150, seed);
                Texture::paint(TEXELS, |u, v| {
                    let strength = (speckles.at(u, v) - 0.45) * 4.0;
                    mix(base, self.accent, strength).map(|c| c * (1.0 + 0.03 * noise.at(u, v)))
                })
            }
            TableSurface::Wood => {
                let (warp, fibres) = (Noise::new_stretched(2, 6, seed), Noise::new_stretched(6, 220, seed ^ 1));
                let boards = Noise::new_stretched(1, 5, seed ^ 2);
                Texture::paint(TEXELS, |u, v| {
                    let board = (v * 5.0).floor() / 5.0;
                    let gap = if (v * 5.0).fract() < 0.02 { 0.55 } else { 1.0 };
                    let rings =
                        (std::f64::consts::TAU * (9.0 * v + 1.3 * warp.at(u, v) + 3.0 * boards.at(0.0, board))).sin();
                    let grain = 0.35 + 0.25 * rings + 0.3 * fibres.at(u, v);
                    mix(base, self.accent, grain).map(|c| c * gap * (1.0 + 0.12 * boards.at(0.0, board + 0.01)))
                })
            }
            TableSurface::CuttingMat => Texture::paint(TEXELS, |u, v| {
                let line = |t: f64, lines: f64, width: f64| (t * lines).fract() < width;
                // A repeat is 50 cm: thin lines every centimetre, thick lines every 5 cm.
                let strength = if line(u, 10.0, 0.04) || line(v, 10.0, 0.04) {
                    0.65
                } else if line(u, 50.0, 0.1) || line(v, 50.0, 0.1) {
                    0.28
                } else {
                    0.0
                };
                mix(base, self.accent, strength).map(|c| c * (1.0 + 0.05 * noise.fractal(u, v, 3)))
            }),
            TableSurface::Chequered => Texture::paint(TEXELS, |u, v| {
                let dark = ((u * 12.0) as i64 + (v * 12.0) as i64) % 2 == 0;
                let color = if dark { self.accent } else { base };
                color.map(|c| c * (1.0 + 0.05 * noise.fractal(u, v, 3)))
            }),
            TableSurface::Cardboard => Texture::paint(TEXELS, |u, v| {
                let flute = 0.02 * (std::f64::consts::TAU * 60.0 * v).sin();
                let shade = 1.0 + flute + 0.05 * noise.fractal(u, v, 4) + 0.03 * rng.random_range(-1.0..1.0);
                base.map(|c| c * shade)
            }),
            TableSurface::Stained => {
                let spots = Noise::new(7, seed ^ 1);
                let streaks = Noise::new_stretched(5, 160, seed ^ 2);
                Texture::paint(TEXELS, |u, v| {
                    let stain = (spots.fractal(u, v, 4) - 0.12) * 2.2;
                    mix(base, self.accent, stain)
                        .map(|c| c * (1.0 + 0.08 * streaks.at(u, v) + 0.05 * noise.fractal(u, v, 3)))
                })
            }
        }
    }

    /// The table with its top at a height (m), and a pedestal below the robot if the robot is higher.
    pub(super) fn fragment(&self, height_m: f64) -> MjcfFragment {
        let mut fragment = MjcfFragment::default();
        fragment.add_texture("table_top", &self.texture());
        let (specular, shininess) = match self.surface {
            TableSurface::BrushedMetal | TableSurface::Stained => (0.25, 0.3),
            TableSurface::Plain | TableSurface::Speckled => (0.12, 0.3),
            _ => (0.05, 0.1),
        };
        fragment.write(format_args!(
            "<asset><material name=\"table_top\" texture=\"table_top\" texuniform=\"true\" texrepeat=\"{r} {r}\" \
             specular=\"{specular}\" shininess=\"{shininess}\"/></asset>\n\
             <worldbody><geom name=\"table\" type=\"plane\" pos=\"0.4 0 {height_m}\" size=\"0.8 0.9 0.01\" \
             material=\"table_top\" friction=\"0.6 0.005 0.0002\"/></worldbody>",
            r = 1.0 / METRES_PER_REPEAT
        ));
        if height_m < 0.0 {
            let middle_m = 0.5 * height_m;
            fragment.write(format_args!(
                "<worldbody><geom name=\"pedestal\" type=\"box\" pos=\"-0.04 0 {middle_m}\" size=\"0.12 0.1 {half_m}\" \
                 rgba=\"0.3 0.31 0.32 1\" contype=\"0\" conaffinity=\"0\" group=\"1\"/></worldbody>",
                half_m = -middle_m
            ));
        }
        fragment
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_surface_is_repeatable_and_neither_black_nor_burnt_out() {
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        let mut seen = Vec::new();
        for _ in 0..40 {
            let table = Table::sample(&mut rng);
            if seen.contains(&table.surface) {
                continue;
            }
            seen.push(table.surface);
            let texture = table.texture();
            assert_eq!(texture, table.texture());
            let mean = texture.image.iter().map(|&value| f64::from(value)).sum::<f64>() / texture.image.len() as f64;
            assert!((25.0..245.0).contains(&mean), "{:?}: {mean}", table.surface);
        }
        assert_eq!(seen.len(), TableSurface::ALL.len());
    }
}

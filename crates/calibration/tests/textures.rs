//! Pictures without a board, from seeds: wood, cloth, tiles, gravel, grains.

use crate::rendering::Random;
use image::{GrayImage, Luma};

/// The kind of texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Texture {
    /// Planks with grain, knots and dark joints.
    Planks,
    /// A weave of threads of varying brightness.
    Cloth,
    /// Tiles or bricks of varying brightness, with joints.
    Tiles,
    /// Spots of any size.
    Gravel,
    /// Grains in nearly regular rows, as in cork and carbon fibre.
    Grains,
}

pub const TEXTURES: [Texture; 5] = [Texture::Planks, Texture::Cloth, Texture::Tiles, Texture::Gravel, Texture::Grains];

const SIDE: u32 = 320;

/// Smooth noise: random values at whole positions, interpolated.
struct Noise(u64);

impl Noise {
    /// Value at a cell, within ±1.
    fn cell(&self, x: f64, y: f64) -> f64 {
        let key = (x as i64 as u64).wrapping_mul(0x1F1F_1F1F_2F2F).wrapping_add(y as i64 as u64);
        Random(self.0 ^ key.wrapping_mul(0x9E37_79B9)).within(-1.0, 1.0)
    }

    fn at(&self, x: f64, y: f64) -> f64 {
        let ease = |t: f64| t * t * (3.0 - 2.0 * t);
        let (left, top) = (x.floor(), y.floor());
        let (u, v) = (ease(x - left), ease(y - top));
        let row = |y: f64| self.cell(left, y) * (1.0 - u) + self.cell(left + 1.0, y) * u;
        row(top) * (1.0 - v) + row(top + 1.0) * v
    }
}

/// One picture of a texture, from a random view.
pub fn picture(texture: Texture, seed: u64) -> GrayImage {
    let mut random = Random(seed.wrapping_mul(7919) + 11);
    let (coarse, fine) = (Noise(seed + 1), Noise(seed + 1_000_003));
    let angle = random.within(-0.6, 0.6);
    let (scale, contrast) = (random.within(6.0, 30.0), random.within(15.0, 60.0));
    let shear = random.within(-0.2, 0.2);
    let noise = random.within(0.5, 4.0);
    let mut sensor = Random(seed + 5);
    GrayImage::from_fn(SIDE, SIDE, |column, row| {
        let (x, y) = (f64::from(column), f64::from(row));
        let (u, v) = ((x + angle * y) / scale, (y - angle * x + shear * x) / scale);
        let value = match texture {
            Texture::Planks => {
                let plank = (v / 4.0).floor();
                let along = u + 7.0 * coarse.cell(plank, 3.0);
                let ring = (3.0 * coarse.at(0.12 * along, 0.5 * v) + v).sin();
                let is_joint = (v / 4.0).fract().abs() < 0.03 || (along / 14.0).fract().abs() < 0.01;
                let grain = fine.at(0.6 * along, 1.2 * v) + 0.3 * ring + 0.4 * coarse.cell(plank, 8.0);
                if is_joint { -1.5 } else { grain }
            }
            Texture::Cloth => {
                let threads = (std::f64::consts::PI * u).sin() * (std::f64::consts::PI * v).sin();
                threads + 0.7 * fine.at(0.7 * u, 0.7 * v) + 0.3 * fine.at(3.0 * u, 3.0 * v)
            }
            Texture::Tiles => {
                let line = (v / 1.1).floor();
                let along = u / 1.6 + 0.5 * line;
                let is_joint = along.fract().abs() < 0.08 || (v / 1.1).fract().abs() < 0.1;
                let own = coarse.cell(along.floor(), line);
                if is_joint { -0.9 } else { own + 0.3 * fine.at(2.0 * u, 2.0 * v) }
            }
            Texture::Gravel => 1.3 * coarse.at(u, v) + 0.6 * fine.at(2.3 * u, 2.3 * v),
            Texture::Grains => coarse.cell((u + 0.2 * fine.at(u, v)).floor(), (v + 0.2 * coarse.at(v, u)).floor()),
        };
        Luma([(120.0 + contrast * value + noise * sensor.normal()).clamp(0.0, 255.0) as u8])
    })
}

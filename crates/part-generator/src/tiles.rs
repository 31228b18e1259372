//! Tiles of noise shared by all pictures, computed once from a fixed seed and read at any position, rotation and scale.

use std::sync::OnceLock;

use rand_pcg::Pcg64Mcg;

use crate::random::{Draw, Stream, generator};

/// Side of a tile; a power of two, so that wrapping is a mask.
const SIDE: usize = 256;

/// Number of normally distributed numbers in the table.
const NORMALS: usize = 1 << 15;

/// Values mostly in [-1, 1], with a seamless period of 256 texels.
pub(crate) struct Tile {
    /// An array, whose length the compiler knows: a masked index needs no bounds check.
    values: Box<[f32; SIDE * SIDE]>,
}

/// The largest integer that is at most `value`; for some integer values the integer below. The magnitude of `value`
/// must be below four million. The function has no call and no comparison, so compilers vectorise it.
#[inline(always)]
pub(crate) fn floor(value: f32) -> i32 {
    // 1.5 * 2^23: the low bits of its sum with a number are the rounded number.
    const WHOLE: f32 = 12_582_912.0;
    (value - 0.5 + WHOLE).to_bits() as i32 - WHOLE.to_bits() as i32
}

/// The shared tables.
pub(crate) struct Tiles {
    /// Smooth clouds of several sizes.
    pub cloud: Tile,
    /// Fine grain: values that change within two texels.
    pub grain: Tile,
    /// Streaks along x.
    pub streak: Tile,
    /// Growth rings of wood, cut along the trunk: lines along x.
    pub wood: Tile,
    /// Sparse spots: 0, or up to 1 within a spot.
    pub spots: Tile,
    /// Normally distributed numbers.
    normals: Box<[f32]>,
}

impl Tile {
    fn new(values: Vec<f32>) -> Self {
        let values = values.into_boxed_slice().try_into().unwrap_or_else(|_| Box::new([0.0; SIDE * SIDE]));
        Self { values }
    }

    fn from_fn(mut value: impl FnMut(usize, usize) -> f32) -> Self {
        Self::new((0..SIDE * SIDE).map(|k| value(k % SIDE, k / SIDE)).collect())
    }

    /// Sums octaves of smooth noise with this number of cells per side, and scales the standard deviation to 0.5.
    fn fractal(cells: [usize; 2], octaves: u32, fall: f32, rng: &mut Pcg64Mcg) -> Self {
        let mut values = vec![0.0f32; SIDE * SIDE];
        let mut strength = 1.0;
        for octave in 0..octaves {
            let [nx, ny] = cells.map(|count| (count << octave).min(SIDE));
            let lattice: Vec<f32> = (0..nx * ny).map(|_| rng.uniform(-1.0, 1.0)).collect();
            for y in 0..SIDE {
                let (v, fy) = split(y, ny);
                for x in 0..SIDE {
                    let (u, fx) = split(x, nx);
                    let at = |u: usize, v: usize| lattice[(v % ny) * nx + u % nx];
                    let upper = at(u, v) + (at(u + 1, v) - at(u, v)) * fx;
                    let lower = at(u, v + 1) + (at(u + 1, v + 1) - at(u, v + 1)) * fx;
                    values[y * SIDE + x] += strength * (upper + (lower - upper) * fy);
                }
            }
            strength *= fall;
        }
        let n = values.len() as f32;
        let mean = values.iter().sum::<f32>() / n;
        let deviation = (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / n).sqrt();
        values.iter_mut().for_each(|v| *v = 0.5 * (*v - mean) / deviation);
        Self::new(values)
    }

    /// The nearest value.
    #[inline(always)]
    pub fn nearest(&self, x: f32, y: f32) -> f32 {
        self.texel(floor(x), floor(y))
    }

    /// Value at a point, by bilinear interpolation.
    #[inline(always)]
    pub fn at(&self, x: f32, y: f32) -> f32 {
        let (u, v) = (floor(x), floor(y));
        let (fx, fy) = (x - u as f32, y - v as f32);
        let upper = self.texel(u, v) + (self.texel(u + 1, v) - self.texel(u, v)) * fx;
        let lower = self.texel(u, v + 1) + (self.texel(u + 1, v + 1) - self.texel(u, v + 1)) * fx;
        upper + (lower - upper) * fy
    }

    #[inline(always)]
    fn texel(&self, u: i32, v: i32) -> f32 {
        let mask = SIDE as i32 - 1;
        self.values[((v & mask) as usize) * SIDE + (u & mask) as usize]
    }
}

/// The lattice cell (of `count`) of texel `k`, and the eased position in it.
fn split(k: usize, count: usize) -> (usize, f32) {
    let place = (k as f32 + 0.5) * count as f32 / SIDE as f32;
    let t = place.fract();
    (place as usize, t * t * (3.0 - 2.0 * t))
}

impl Tiles {
    /// The tiles, computed at the first call.
    pub fn get() -> &'static Self {
        static TILES: OnceLock<Tiles> = OnceLock::new();
        TILES.get_or_init(Self::draw)
    }

    fn draw() -> Self {
        let mut rng = generator(0x7469_6c65, Stream::Tiles, 0);
        let cloud = Tile::fractal([4, 4], 6, 0.55, &mut rng);
        let grain = Tile::fractal([128, 128], 2, 0.8, &mut rng);
        let streak = Tile::fractal([4, 128], 2, 0.8, &mut rng);
        let warp = Tile::fractal([2, 4], 4, 0.5, &mut rng);
        let fibre = Tile::fractal([8, 128], 2, 0.7, &mut rng);
        let wood = Tile::from_fn(|x, y| {
            let rings = (y as f32 / SIDE as f32) * 16.0 + 2.2 * warp.texel(x as i32, y as i32);
            0.55 * (std::f32::consts::TAU * rings).sin() + 0.45 * fibre.texel(x as i32, y as i32)
        });
        let mut dots = vec![0.0f32; SIDE * SIDE];
        for _ in 0..420 {
            let (cx, cy) = (rng.uniform(0.0, SIDE as f32), rng.uniform(0.0, SIDE as f32));
            let (radius, strength) = (rng.log_uniform(0.6, 3.5), rng.uniform(0.3, 1.0));
            let reach = radius.ceil() as i32 + 1;
            for dy in -reach..=reach {
                for dx in -reach..=reach {
                    let distance = (dx as f32 - cx.fract()).hypot(dy as f32 - cy.fract());
                    let inside = (radius + 0.5 - distance).clamp(0.0, 1.0) * strength;
                    let mask = SIDE as i32 - 1;
                    let (u, v) = ((cx as i32 + dx) & mask, (cy as i32 + dy) & mask);
                    let dot = &mut dots[v as usize * SIDE + u as usize];
                    *dot = dot.max(inside);
                }
            }
        }
        // Box and Muller's transform.
        let normals = (0..NORMALS).map(|_| (-2.0 * rng.uniform(1e-7, 1.0).ln()).sqrt() * rng.angle().cos()).collect();
        Self { cloud, grain, streak, wood, spots: Tile::new(dots), normals }
    }

    /// `len` normally distributed numbers from a position of the table selected by `address`; `len` is at most half of
    /// the table.
    pub fn normals(&self, address: u64, len: usize) -> &[f32] {
        assert!(len <= NORMALS / 2, "rows of at most {} numbers", NORMALS / 2);
        let first = (address % (NORMALS - len) as u64) as usize;
        &self.normals[first..first + len]
    }
}

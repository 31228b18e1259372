//! Compares two parts under rotations: the measure for symmetry and look-alikes.

use sdg_geometry::RotationalSymmetry;

use crate::recipe::Material;
use crate::relief::{Level, Relief};

/// Maximum fraction of differing cells between two parts that look the same, due to rounding to cells.
const MAX_SAME_SHARE: f32 = 0.0015;

/// Maximum order of rotational symmetry that is detected.
const MAX_FOLD: u32 = 40;

/// Minimum visible difference of heights, in millimetres, plus a fraction of the part's height.
const HEIGHT_TOLERANCE_MM: f32 = 0.3;
const HEIGHT_TOLERANCE_SHARE: f32 = 0.03;

/// Minimum visible difference of colours: the sum over channels of the differences between square roots of linear
/// values.
const COLOR_TOLERANCE: f32 = 0.12;

/// The centroid of a part's area, in its own frame.
pub(crate) fn centroid(relief: &Relief) -> [f32; 2] {
    let level = &relief.levels[1];
    let (mut sum, mut count) = ([0.0f64; 2], 0usize);
    for y in 0..level.height {
        for x in 0..level.width {
            if level.texels[y * level.width + x].top > 0 {
                let place = relief.place(level, x, y);
                sum = [sum[0] + f64::from(place[0]), sum[1] + f64::from(place[1])];
                count += 1;
            }
        }
    }
    sum.map(|s| (s / count.max(1) as f64) as f32)
}

/// Two parts, each with the centre of the rotation.
pub(crate) struct PartPair<'a> {
    a: (&'a Relief, [f32; 2]),
    b: (&'a Relief, [f32; 2]),
    height_tolerance_mm: f32,
    same_material: Vec<bool>,
}

impl<'a> PartPair<'a> {
    /// Compares `a` with `b`, with their centres aligned.
    pub fn new(a: &'a Relief, center_a: [f32; 2], b: &'a Relief, center_b: [f32; 2]) -> Self {
        let same_material = a
            .materials
            .iter()
            .flat_map(|one| b.materials.iter().map(move |other| look_distance(one, other) < COLOR_TOLERANCE))
            .collect();
        let height_tolerance_mm = HEIGHT_TOLERANCE_MM + HEIGHT_TOLERANCE_SHARE * a.top_mm.max(b.top_mm);
        Self { a: (a, center_a), b: (b, center_b), height_tolerance_mm, same_material }
    }

    /// Fraction of the cells without a counterpart within one cell when `a` is rotated by `turn` radians; counting
    /// stops above `enough`.
    pub fn difference(&self, turn: f32, enough: f32) -> f32 {
        let covered = self.a.0.levels[1].texels.iter().filter(|texel| texel.top > 0).count().max(1);
        let limit = (enough * covered as f32).ceil() as usize + 4;
        let there = self.unmatched(false, turn, limit);
        if there > limit {
            return there as f32 / covered as f32;
        }
        (there + self.unmatched(true, -turn, limit)) as f32 / covered as f32
    }

    /// Whether the two look the same when `a` is rotated by `turn`.
    pub fn is_same(&self, turn: f32) -> bool {
        self.difference(turn, MAX_SAME_SHARE) <= MAX_SAME_SHARE
    }

    /// Whether the two look the same at some angle.
    pub fn is_same_at_some_turn(&self) -> bool {
        (0..360).any(|degree| self.is_same((degree as f32).to_radians()))
    }

    fn unmatched(&self, backwards: bool, turn: f32, limit: usize) -> usize {
        let ((from, from_center), (to, to_center)) = if backwards { (self.b, self.a) } else { (self.a, self.b) };
        let (level, target) = (&from.levels[1], &to.levels[1]);
        let (sin, cos) = turn.sin_cos();
        let mut count = 0;
        // Every third row first: most differences are found early.
        for first in [1, 0, 2] {
            for y in (first..level.height).step_by(3) {
                for x in 0..level.width {
                    let texel = level.texels[y * level.width + x];
                    if texel.top == 0 {
                        continue;
                    }
                    let [px, py] = from.place(level, x, y);
                    let (px, py) = (px - from_center[0], py - from_center[1]);
                    let q = [cos * px - sin * py + to_center[0], sin * px + cos * py + to_center[1]];
                    let top = texel.top as f32 * from.step;
                    if !self.has_match(to, target, q, top, texel.material, backwards) {
                        count += 1;
                        if count > limit {
                            return count;
                        }
                    }
                }
            }
        }
        count
    }

    fn has_match(&self, to: &Relief, level: &Level, at: [f32; 2], top: f32, material: u8, backwards: bool) -> bool {
        let gx = ((at[0] - to.min[0]) / level.cell).floor() as i32;
        let gy = ((at[1] - to.min[1]) / level.cell).floor() as i32;
        (-1..=1).any(|dy| {
            (-1..=1).any(|dx| {
                let other = level.get(gx + dx, gy + dy);
                let (a, b) = if backwards { (other.material, material) } else { (material, other.material) };
                other.top > 0
                    && (other.top as f32 * to.step - top).abs() < self.height_tolerance_mm
                    && self.same_material[a as usize * self.b.0.materials.len() + b as usize]
            })
        })
    }
}

/// The difference in appearance of two materials under even light.
fn look_distance(one: &Material, other: &Material) -> f32 {
    (0..3)
        .map(|k| {
            let look = |m: &Material| (m.albedo[k] + 0.7 * m.reflectance[k]).sqrt();
            (look(one) - look(other)).abs()
        })
        .sum()
}

/// The rotations about its centre after which a part looks the same.
pub(crate) fn symmetry(relief: &Relief, center: [f32; 2]) -> RotationalSymmetry {
    let comparison = PartPair::new(relief, center, relief, center);
    // Angles that belong to no rotational symmetry of order 2 to 40.
    if [7.0f32, 17.0, 31.0, 53.0, 101.0, 149.0].iter().all(|degrees| comparison.is_same(degrees.to_radians())) {
        return RotationalSymmetry::Full;
    }
    (2..=MAX_FOLD)
        .rev()
        .find(|&fold| comparison.is_same(std::f32::consts::TAU / fold as f32))
        .map_or(RotationalSymmetry::None, RotationalSymmetry::Fold)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recipe::{Edge, Feature, Material, Operation, Recipe, Shape};

    /// A disc of radius 20 mm with holes at angles in degrees, 12 mm from its centre.
    fn disc(holes: &[f32], metal: Material) -> Relief {
        let feature = |shape, center, operation| Feature { shape, center, turn: 0.0, operation, material: 0, group: 0 };
        let body = Operation::Add { bottom: 0.0, top: 5.0, edge: Edge::SHARP };
        let mut features = vec![feature(Shape::Disc { radius: 20.0 }, [0.0; 2], body)];
        for angle in holes {
            let (sin, cos) = angle.to_radians().sin_cos();
            let cut = Operation::Cut { floor: 0.0, chamfer: 0.0, machined: false };
            features.push(feature(Shape::Disc { radius: 3.0 }, [12.0 * cos, 12.0 * sin], cut));
        }
        Relief::draw(&Recipe { materials: vec![metal], features, grain_seed: 1 })
    }

    fn metal() -> Material {
        Material::metal(&mut crate::random::generator(1, crate::random::Stream::Recipe, 0))
    }

    #[test]
    fn symmetry_of_known_recipes() {
        let of = |holes: &[f32]| {
            let relief = disc(holes, metal());
            symmetry(&relief, centroid(&relief))
        };
        assert_eq!(of(&[]), RotationalSymmetry::Full);
        assert_eq!(of(&[0.0, 120.0, 240.0]), RotationalSymmetry::Fold(3));
        assert_eq!(of(&[0.0, 72.0, 144.0, 216.0, 288.0]), RotationalSymmetry::Fold(5));
        assert_eq!(of(&[10.0, 190.0]), RotationalSymmetry::Fold(2));
        assert_eq!(of(&[0.0, 120.0, 200.0]), RotationalSymmetry::None);
    }

    #[test]
    fn a_mirror_image_is_the_same_only_where_it_is() {
        let same = |holes: &[f32]| {
            let mirrored: Vec<f32> = holes.iter().map(|angle| 180.0 - angle).collect();
            let (one, other) = (disc(holes, metal()), disc(&mirrored, metal()));
            PartPair::new(&one, centroid(&one), &other, centroid(&other)).is_same_at_some_turn()
        };
        assert!(same(&[0.0, 100.0]));
        assert!(!same(&[0.0, 60.0, 200.0]));
    }
}

//! Parts that resemble a part: its mirror image, a copy with a moved feature, another size.

use std::sync::Arc;

use nalgebra::Point2;
use sdg_geometry::Polygon;

use crate::Part;
use crate::grasp::MAX_JAW_WIDTH_MM;
use crate::part_pair::PartPair;
use crate::random::{Draw, Stream, generator};
use crate::recipe::{Operation, Recipe, Shape};

/// Range of a feature's displacement, as fractions of the part's diagonal.
const MOVE_SHARES: [f32; 2] = [0.05, 0.10];

/// Minimum fraction of the cells that a moved feature must change.
const MIN_CHANGED_SHARE: f32 = 0.006;

/// Number of displacements tried before a part counts as having no movable feature.
const MAX_MOVES: usize = 24;

/// Difference between a look-alike and its part.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum LookAlike {
    /// The mirror image.
    Mirrored,
    /// One feature moved by 5 to 10 % of the part's diagonal.
    FeatureMoved,
    /// A copy of another size: the factor, usually 0.8 to 1.25.
    Scaled(f64),
}

impl Part {
    /// A part that resembles this one but is different.
    ///
    /// `None` if there is no such part: the mirror image equals the part at some angle, no feature can be moved
    /// visibly, the factor is 1 or not positive and finite, or the look-alike cannot be grasped.
    pub fn look_alike(&self, kind: LookAlike, seed: u64) -> Option<Part> {
        match kind {
            LookAlike::Mirrored => self.mirrored(),
            LookAlike::FeatureMoved => self.with_feature_moved(seed),
            LookAlike::Scaled(factor) => self.scaled(factor),
        }
    }

    fn mirrored(&self) -> Option<Part> {
        let made = Part::from_recipe(self.kind, self.recipe.mirrored())?;
        let comparison = PartPair::new(&self.relief, self.center, &made.relief, made.center);
        (!comparison.is_same_at_some_turn()).then_some(made)
    }

    fn with_feature_moved(&self, seed: u64) -> Option<Part> {
        let mut rng = generator(seed, Stream::LookAlike, 0);
        let diagonal = self.diagonal_mm() as f32;
        (0..MAX_MOVES).find_map(|_| {
            let shift = diagonal * rng.uniform(MOVE_SHARES[0], MOVE_SHARES[1]);
            let recipe = moved(&self.recipe, shift, rng.angle(), rng.random_group(&self.recipe))?;
            let made = Part::from_recipe(self.kind, recipe)?;
            // In the same position, a visible fraction must differ. At every angle, the two parts must look different.
            let in_place = PartPair::new(&self.relief, self.center, &made.relief, self.center);
            let turned = PartPair::new(&self.relief, self.center, &made.relief, made.center);
            let differs = in_place.difference(0.0, MIN_CHANGED_SHARE) > MIN_CHANGED_SHARE;
            (differs && !turned.is_same_at_some_turn()).then_some(made)
        })
    }

    fn scaled(&self, factor: f64) -> Option<Part> {
        if !(factor.is_finite() && factor > 0.0) || factor == 1.0 {
            return None;
        }
        let f = factor as f32;
        let mut made = self.clone();
        made.relief = Arc::new(self.relief.scaled(f));
        made.center = self.center.map(|v| v * f);
        made.grasp.start = self.grasp.start.map(|v| v * f);
        made.grasp.end = self.grasp.end.map(|v| v * f);
        made.grasp.jaw_width_mm *= f;
        made.grasp.height_mm *= f;
        made.outline = Polygon {
            vertices: self.outline.vertices.iter().map(|v| Point2::new(v.x * factor, v.y * factor)).collect(),
        };
        (made.grasp.jaw_width_mm <= 1.25 * MAX_JAW_WIDTH_MM).then_some(made)
    }
}

/// Selects a group of features that may be moved.
trait DrawGroup {
    fn random_group(&mut self, recipe: &Recipe) -> u16;
}

impl<R: Draw> DrawGroup for R {
    fn random_group(&mut self, recipe: &Recipe) -> u16 {
        let last = recipe.features.iter().map(|feature| feature.group).max().unwrap_or(0);
        // Group 0 is the body; it is selected only if there is no other group.
        self.whole(usize::from(last > 0), last as usize) as u16
    }
}

/// The recipe with one group moved by `shift` in a direction. If the group is the body, a corner, bend or end of it is
/// moved, or a rectangle is lengthened.
fn moved(recipe: &Recipe, shift: f32, direction: f32, group: u16) -> Option<Recipe> {
    let mut made = recipe.clone();
    let (sin, cos) = direction.sin_cos();
    if group > 0 {
        let mut any = false;
        for feature in made.features.iter_mut().filter(|feature| feature.group == group) {
            any = true;
            if let Operation::Turned { profile, ripples, .. } = &mut feature.operation {
                // Only along the axis.
                let along = shift * cos.signum();
                profile.iter_mut().for_each(|point| point[0] += along);
                ripples.iter_mut().for_each(|ripple| {
                    ripple.from += along;
                    ripple.to += along;
                });
            } else {
                feature.center[0] += shift * cos;
                feature.center[1] += shift * sin;
            }
        }
        return any.then_some(made);
    }
    // The direction also selects the moved point.
    let choose = |count: usize| (direction * 1000.0) as usize % count;
    let body = made.features.iter_mut().find(|feature| feature.group == 0)?;
    match (&mut body.shape, &mut body.operation) {
        (_, Operation::Turned { profile, .. }) => {
            let last = profile.len() - 1;
            let along = shift * cos.signum();
            let point = if cos > 0.0 { &mut profile[last] } else { &mut profile[0] };
            point[0] += along;
        }
        (Shape::Polygon { vertices, .. }, _) => {
            let k = choose(vertices.len());
            vertices[k] = [vertices[k][0] + shift * cos, vertices[k][1] + shift * sin];
        }
        (Shape::Path { points, .. }, _) => {
            // Everything after a bend moves.
            let k = 1 + choose(points.len() - 1);
            for point in &mut points[k..] {
                point[0] += shift * cos;
                point[1] += shift * sin;
            }
        }
        (Shape::Rectangle { half, .. }, _) => half[0] += 0.5 * shift,
        _ => return None,
    }
    Some(made)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Number of compared angles in a full rotation: twice as many as in choosing look-alikes.
    const NUM_TURNS: usize = 720;

    fn is_same_at_some_turn(one: &Part, other: &Part) -> bool {
        let comparison = PartPair::new(&one.relief, one.center, &other.relief, other.center);
        (0..NUM_TURNS).any(|k| comparison.is_same(std::f32::consts::TAU * k as f32 / NUM_TURNS as f32))
    }

    #[test]
    fn moved_and_mirrored_parts_differ_from_every_turn_of_the_part() {
        let mut compared = [0, 0];
        for seed in 0..10 {
            let part = Part::generate(seed);
            if let Some(mirrored) = part.look_alike(LookAlike::Mirrored, 0) {
                assert!(!is_same_at_some_turn(&part, &mirrored), "mirror image of part {seed}");
                // The mirror image of the mirror image is the part; this tests that the comparison can find equality.
                let twice = Part::from_recipe(part.kind, mirrored.recipe.mirrored()).unwrap();
                assert!(is_same_at_some_turn(&part, &twice), "part {seed} mirrored twice");
                compared[0] += 1;
            }
            for draw in 0..2 {
                if let Some(moved) = part.look_alike(LookAlike::FeatureMoved, draw) {
                    assert!(!is_same_at_some_turn(&part, &moved), "part {seed} with a feature moved, {draw}");
                    compared[1] += 1;
                }
            }
        }
        assert!(compared[0] >= 4 && compared[1] >= 10, "{compared:?} mirrored and moved");
    }
}

//! Adds errors to the marks of a demonstration.

use std::f64::consts::TAU;

use nalgebra::{Point2, Vector2};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_demonstration::{Annotation, Demonstration};
use sdg_geometry::{BoundingBox, GraspLine};

/// Displacement of the marks, in pixels of the photo.
pub const MARKS_JITTER_PX: f64 = 3.0;

/// Number of directions tried for a vertex of the outline before it is left in place.
const MAX_VERTEX_TRIES: usize = 40;

/// The demonstration with moved points: both grasp marks, two opposite corners of the box and every vertex of the
/// outline. Each moves by `distance_px` in its own random direction, but not out of the picture. If a move would make
/// the outline cross itself, other directions are tried; if all fail, the vertex stays in place. The outline thus
/// remains valid on the annotation page. The jaw width is unchanged.
pub fn with_jittered_marks(demonstration: &Demonstration, distance_px: f64, seed: u64) -> Demonstration {
    const MARKS: u64 = 0x4d41_524b_5300_0000;
    let mut rng = Pcg64Mcg::seed_from_u64(seed ^ MARKS);
    let (width, height) = (f64::from(demonstration.image.width()), f64::from(demonstration.image.height()));
    let mut moved = |point: Point2<f64>| {
        let (sin, cos) = rng.random_range(0.0..TAU).sin_cos();
        let there = point + distance_px * Vector2::new(cos, sin);
        Point2::new(there.x.clamp(0.0, width), there.y.clamp(0.0, height))
    };
    let Annotation { label, bbox, grasp, jaw_width, outline } = &demonstration.annotation;
    let grasp = grasp.map(|line| GraspLine::new(moved(line.start), moved(line.end)));
    let [low, high] = [Point2::new(bbox.x1, bbox.y1), Point2::new(bbox.x2, bbox.y2)].map(&mut moved);
    let bbox =
        BoundingBox { x1: low.x.min(high.x), y1: low.y.min(high.y), x2: low.x.max(high.x), y2: low.y.max(high.y) };
    let outline = outline.as_ref().map(|outline| {
        let mut jittered = outline.clone();
        for i in 0..jittered.vertices.len() {
            let place = jittered.vertices[i];
            let found = (0..MAX_VERTEX_TRIES).any(|_| {
                jittered.vertices[i] = moved(place);
                !jittered.crosses_itself()
            });
            if !found {
                jittered.vertices[i] = place;
            }
        }
        jittered
    });
    let annotation = Annotation { label: label.clone(), bbox, grasp, jaw_width: *jaw_width, outline };
    Demonstration { image: demonstration.image.clone(), annotation }
}

/// Number of vertices of an outline that were moved.
#[cfg(test)]
fn num_moved(before: &sdg_geometry::Polygon, after: &sdg_geometry::Polygon) -> usize {
    before.vertices.iter().zip(&after.vertices).filter(|(before, after)| before != after).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shipped;
    use sdg_simulation::objects::ObjectSpec;

    #[test]
    fn every_mark_of_every_shipped_demonstration_moves_and_the_annotation_stays_valid() {
        for name in ObjectSpec::names() {
            let shipped = shipped::demonstration(name).unwrap();
            let jittered = with_jittered_marks(&shipped, MARKS_JITTER_PX, 5);
            jittered.check().unwrap();
            let (before, after) = (shipped.annotation.grasp.unwrap(), jittered.annotation.grasp.unwrap());
            for (before, after) in [(before.start, after.start), (before.end, after.end)] {
                assert!(((after - before).norm() - MARKS_JITTER_PX).abs() < 1e-9, "{name}");
            }
            let (before, after) = (shipped.annotation.outline.unwrap(), jittered.annotation.outline.unwrap());
            let (moved, of) = (num_moved(&before, &after), before.vertices.len());
            // If vertices are only a pixel or two apart, a few cannot be moved.
            assert!(10 * moved >= 9 * of, "{name}: {moved} of {of} moved");
        }
    }

    #[test]
    fn the_seed_decides() {
        let shipped = shipped::demonstration("pendulum").unwrap();
        let jittered = |seed| with_jittered_marks(&shipped, MARKS_JITTER_PX, seed).annotation;
        assert_eq!(jittered(1), jittered(1));
        assert_ne!(jittered(1), jittered(2));
        assert_eq!(with_jittered_marks(&shipped, 0.0, 1).annotation, shipped.annotation);
    }
}

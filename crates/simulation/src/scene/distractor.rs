//! Distractors: their position on the table and their MJCF.

use nalgebra::{Isometry2, Isometry3, Point2, Point3, Translation3, UnitQuaternion, Vector3};
use sdg_geometry::convex_hull;

use super::distractor_kind::DistractorKind;
use super::distractor_pieces::scaled_pieces;
use crate::fragment::{MjcfFragment, pose_attributes};
use crate::shapes::footprint::placed;

/// A distractor with its size, finish and pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Distractor {
    /// Kind of the distractor.
    pub kind: DistractorKind,
    /// Pose of the distractor, at rest on the table, in the base frame.
    pub base_from_distractor: Isometry3<f64>,
    /// The distractor's convex outline from above, in the base frame, counter-clockwise.
    pub footprint: Vec<Point2<f64>>,
    seed: u64,
    scale: f64,
}

impl Distractor {
    /// Creates a distractor; `seed` determines its size and finish.
    pub fn new(kind: DistractorKind, table_from_distractor: &Isometry2<f64>, seed: u64) -> Self {
        Self::scaled(kind, table_from_distractor, seed, 1.0)
    }

    /// As [`Distractor::new`], with all lengths multiplied by `scale`.
    pub fn scaled(kind: DistractorKind, table_from_distractor: &Isometry2<f64>, seed: u64, scale: f64) -> Self {
        let pieces = scaled_pieces(kind, seed, scale);
        let lowest = pieces.iter().map(|piece| piece.mesh.bounds().0.z).fold(f64::INFINITY, f64::min);
        let outline =
            convex_hull(pieces.iter().flat_map(|piece| piece.mesh.vertices.iter().map(|vertex| vertex.position.xy())));
        let place = table_from_distractor.translation.vector;
        Self {
            kind,
            base_from_distractor: Isometry3::from_parts(
                Translation3::new(place.x, place.y, -lowest),
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), table_from_distractor.rotation.angle()),
            ),
            footprint: placed(&outline, table_from_distractor),
            seed,
            scale,
        }
    }

    /// The same distractor at another pose on the table.
    pub fn moved_to(&self, table_from_distractor: &Isometry2<f64>) -> Self {
        Self::scaled(self.kind, table_from_distractor, self.seed, self.scale)
    }

    /// The distractor's triangles in its own frame.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = [Point3<f64>; 3]> {
        scaled_pieces(self.kind, self.seed, self.scale)
            .into_iter()
            .flat_map(|piece| piece.mesh.faces.iter().map(|&face| piece.mesh.corners(face)).collect::<Vec<_>>())
    }

    /// The MJCF of the distractor under the name `distractor_{index}`.
    pub(super) fn fragment(&self, index: usize) -> MjcfFragment {
        let mut fragment = MjcfFragment::default();
        let mut geoms = String::new();
        for (piece_idx, piece) in scaled_pieces(self.kind, self.seed, self.scale).into_iter().enumerate() {
            let name = format!("distractor_{index}_{piece_idx}");
            let metal = piece.finish.is_metal();
            fragment.add_mesh(&name, &piece.mesh);
            fragment.add_texture(&name, &piece.finish.texture(self.seed.wrapping_add(piece_idx as u64)));
            fragment.write(format_args!(
                "<asset><material name=\"{name}\" texture=\"{name}\" specular=\"{}\" shininess=\"{}\"/></asset>",
                if metal { 0.5 } else { 0.2 },
                if metal { 0.5 } else { 0.3 }
            ));
            geoms.push_str(&format!(
                "<geom name=\"{name}\" type=\"mesh\" mesh=\"{name}\" material=\"{name}\" density=\"{}\" \
                 friction=\"0.5 0.005 0.001\" condim=\"6\"/>",
                piece.finish.density
            ));
        }
        fragment.write(format_args!(
            "<worldbody><body name=\"distractor_{index}\" {}>\
             <joint name=\"distractor_{index}_joint\" type=\"free\" damping=\"0.0005\"/>{geoms}</body></worldbody>",
            pose_attributes(&self.base_from_distractor)
        ));
        fragment
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;

    #[test]
    fn every_kind_is_a_closed_solid_that_rests_on_the_table() {
        for kind in DistractorKind::ALL {
            for seed in 0..6 {
                for piece in scaled_pieces(kind, seed, 1.0) {
                    let volume = piece.mesh.mass_properties().volume;
                    assert!(volume > 1e-8 && volume < 2e-4, "{kind:?} {seed}: {volume} m³");
                }
                let distractor = Distractor::new(kind, &Isometry2::new(Vector2::new(0.5, 0.1), 0.3), seed);
                let lowest = scaled_pieces(kind, seed, 1.0)
                    .iter()
                    .flat_map(|piece| {
                        piece.mesh.vertices.iter().map(|v| (distractor.base_from_distractor * v.position).z)
                    })
                    .fold(f64::INFINITY, f64::min);
                assert!(lowest.abs() < 1e-9, "{kind:?} {seed}: lowest point at {lowest} m");
                assert!(distractor.footprint.len() >= 3);
            }
        }
    }

    #[test]
    fn the_same_seed_makes_the_same_part() {
        let at = Isometry2::identity();
        for kind in DistractorKind::ALL {
            let fragment = |seed| Distractor::new(kind, &at, seed).fragment(0);
            assert_eq!(fragment(4), fragment(4));
            assert_ne!(fragment(4).files, fragment(5).files, "{kind:?}");
        }
    }
}

//! Parts that resemble a given part: mirrored, with one feature changed, or with another size.
//!
//! ```text
//! ObjectSpec ─> meshes, marks, collision shapes, inertia changed together ─> ObjectSpec with another name
//! ```

use std::f64::consts::TAU;
use std::fmt;

use nalgebra::{Isometry2, Point2, Point3, Vector2};

use super::ObjectSpec;
use super::mjcf_tags::{Tag, map_tags};
use super::obj_mesh::ObjMesh;
use crate::error::Result;

/// The difference between a look-alike and the part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum LookAlikeKind {
    /// The mirror image in a vertical plane.
    Mirrored,
    /// The part with one feature moved or, if no feature can be moved, with a region stretched or a narrower bore.
    FeatureMoved,
    /// The whole part in another size.
    Scaled {
        /// The size in percent of the part's size.
        percent: u32,
    },
}

impl LookAlikeKind {
    /// All kinds.
    pub const ALL: [Self; 6] = [
        Self::Mirrored,
        Self::FeatureMoved,
        Self::Scaled { percent: 80 },
        Self::Scaled { percent: 90 },
        Self::Scaled { percent: 110 },
        Self::Scaled { percent: 125 },
    ];
}

impl fmt::Display for LookAlikeKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mirrored => f.write_str("mirrored"),
            Self::FeatureMoved => f.write_str("feature moved"),
            Self::Scaled { percent } => write!(f, "size {:.2}", f64::from(*percent) / 100.0),
        }
    }
}

/// A part that resembles another one.
#[derive(Debug, Clone, PartialEq)]
pub struct LookAlike {
    /// The difference from the part.
    pub kind: LookAlikeKind,
    /// The look-alike as a part of its own.
    pub spec: ObjectSpec,
    /// The difference in words.
    pub description: String,
}

/// Side of a cell of the views from above, in metres.
const CELL_M: f64 = 0.001;
/// Smallest height difference that is visible from above, in metres.
const SAME_HEIGHT_M: f64 = 0.001;
/// Minimum difference between a part and its mirror image, at the angle of greatest similarity, for a mirrored
/// look-alike. Of the shipped parts that differ from their mirror image, the pliers (1.3 %) and the housing (2.0 %) are
/// below it; the key (3.4 %, because of its cuts) and the others (20 % and more) are above it.
const MIN_MIRROR_DIFFERENCE: f64 = 0.03;

impl ObjectSpec {
    /// The kinds of look-alikes of this part: all kinds, except the mirror image if it hardly differs from the part.
    ///
    /// # Errors
    /// As for [`ObjectSpec::look_alike`].
    pub fn look_alike_kinds(&self) -> Result<Vec<LookAlikeKind>> {
        let is_chiral = self.mirror_difference()? >= MIN_MIRROR_DIFFERENCE;
        Ok(LookAlikeKind::ALL.into_iter().filter(|kind| *kind != LookAlikeKind::Mirrored || is_chiral).collect())
    }

    /// A look-alike of this part; `seed` determines the change of a feature.
    ///
    /// # Errors
    /// [`crate::SimulationError::File`] for a part whose shapes are not given as OBJ meshes.
    pub fn look_alike(&self, kind: LookAlikeKind, seed: u64) -> Result<LookAlike> {
        let (spec, description) = match kind {
            LookAlikeKind::Mirrored => (self.mirrored()?, "the mirror image".to_owned()),
            LookAlikeKind::FeatureMoved => self.with_feature_moved(seed)?,
            LookAlikeKind::Scaled { percent } => {
                (self.scaled(f64::from(percent) / 100.0)?, format!("{percent} % of the size"))
            }
        };
        Ok(LookAlike { kind, spec, description })
    }

    /// Fraction of the cells visible from above that differ between the part and its mirror image, at the angle of
    /// greatest similarity.
    ///
    /// # Errors
    /// As for [`ObjectSpec::look_alike`].
    pub fn mirror_difference(&self) -> Result<f64> {
        let (own, mirror) = (self.height_map(CELL_M)?, self.mirrored()?.height_map(CELL_M)?);
        let difference = |turn: f64, shift: Vector2<f64>| {
            let onto = Isometry2::new(own.centre().coords + shift, turn) * Isometry2::new(-mirror.centre().coords, 0.0);
            mirror.difference(&own, &onto, SAME_HEIGHT_M)
        };
        let best_of = |turns: &mut dyn Iterator<Item = f64>| {
            turns.map(|turn| (difference(turn, Vector2::zeros()), turn)).min_by(|a, b| a.0.total_cmp(&b.0))
        };
        let Some((_, coarse)) = best_of(&mut (0..120).map(|step| TAU * f64::from(step) / 120.0)) else {
            return Ok(0.0);
        };
        let Some((least, turn)) = best_of(&mut (-6..=6).map(|step| coarse + f64::from(step) * 0.005)) else {
            return Ok(0.0);
        };
        let shifts = (-1..=1).flat_map(|x| (-1..=1).map(move |y| Vector2::new(f64::from(x), f64::from(y)) * CELL_M));
        Ok(shifts.map(|shift| difference(turn, shift)).fold(least, f64::min))
    }

    fn mirrored(&self) -> Result<Self> {
        let mut spec = self.renamed("mirrored", "mirrored");
        spec.map_meshes(|_, mesh| mesh.mirrored())?;
        let flip = |p: Point3<f64>| Point3::new(p.x, -p.y, p.z);
        spec.grasp_start = flip(spec.grasp_start);
        spec.grasp_end = flip(spec.grasp_end);
        spec.footprint = spec.footprint.iter().rev().map(|p| Point2::new(p.x, -p.y)).collect();
        spec.mjcf = map_tags(&spec.mjcf, |tag| {
            if !has_shape(tag) {
                return false;
            }
            let negate = |indices: &'static [usize]| {
                move |values: &mut Vec<f64>| {
                    for &idx in indices {
                        if let Some(value) = values.get_mut(idx) {
                            *value = -*value;
                        }
                    }
                }
            };
            tag.map_numbers("pos", negate(&[1]));
            tag.map_numbers("fromto", negate(&[1, 4]));
            // A mirrored rotation has the opposite angles about x and z.
            tag.map_numbers("quat", negate(&[1, 3]));
            tag.map_numbers("euler", negate(&[0, 2]));
            tag.map_numbers("axisangle", negate(&[0, 2]));
            // Ixx Iyy Izz Ixy Ixz Iyz
            tag.map_numbers("fullinertia", negate(&[3, 5]));
            true
        });
        Ok(spec)
    }

    fn scaled(&self, factor: f64) -> Result<Self> {
        let percent = (factor * 100.0).round();
        let mut spec = self.renamed(&format!("size_{percent}"), &format!("{percent} % of the size"));
        spec.map_meshes(|_, mesh| mesh.mapped(|_, p| p * factor))?;
        let scaled = |value: f64| rounded(value * factor);
        spec.mass_kg = rounded(spec.mass_kg * factor.powi(3));
        spec.grasp_start = spec.grasp_start.map(scaled);
        spec.grasp_end = spec.grasp_end.map(scaled);
        for length in [
            &mut spec.jaw_width_m,
            &mut spec.grasp_height_m,
            &mut spec.mark_height_m,
            &mut spec.seen_height_m,
            &mut spec.rest_height_m,
        ] {
            *length = scaled(*length);
        }
        for corner in &mut spec.footprint {
            *corner = corner.map(scaled);
        }
        spec.mjcf = map_tags(&spec.mjcf, |tag| {
            if !has_shape(tag) {
                return false;
            }
            for (key, power) in
                [("pos", 1), ("fromto", 1), ("size", 1), ("mass", 3), ("fullinertia", 5), ("diaginertia", 5)]
            {
                tag.map_numbers(key, |values| values.iter_mut().for_each(|value| *value *= factor.powi(power)));
            }
            true
        });
        Ok(spec)
    }

    pub(super) fn renamed(&self, suffix: &str, words: &str) -> Self {
        Self {
            name: format!("{}_{suffix}", self.name),
            title: format!("{}, {words}", self.title),
            description: format!("Look-alike of the {}: {words}", self.title.to_lowercase()),
            ..self.clone()
        }
    }

    /// Replaces the visible meshes; `map` gets the index of the mesh.
    pub(super) fn map_meshes(&mut self, map: impl Fn(usize, ObjMesh) -> ObjMesh) -> Result<()> {
        let meshes = self.visual_meshes()?;
        for (idx, visual) in meshes.into_iter().enumerate() {
            let bytes = map(idx, visual.mesh).to_obj().into_bytes();
            if let Some(asset) = self.files.iter_mut().find(|asset| asset.name == visual.file) {
                asset.bytes = bytes;
            }
        }
        Ok(())
    }
}

/// Rounds to a nanometre or a microgram, so that numbers have few digits and are read back unchanged.
pub(super) fn rounded(value: f64) -> f64 {
    (value * 1e9).round() / 1e9
}

/// Whether a tag contains a position or a mass of the part.
fn has_shape(tag: &Tag) -> bool {
    matches!(tag.name.as_str(), "geom" | "inertial" | "site")
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::data::Data;
    use crate::model::{Body, Model};
    use crate::scene::SceneVariation;

    #[test]
    fn mirror_images_are_look_alikes_only_where_they_differ() {
        for (name, is_chiral) in [
            ("pendulum", false),
            ("ball_bearing", false),
            ("cranfield_face", false),
            ("fuel_line", true),
            ("common_line", true),
        ] {
            let kinds = ObjectSpec::by_name(name).unwrap().look_alike_kinds().unwrap();
            assert_eq!(kinds.contains(&LookAlikeKind::Mirrored), is_chiral, "{name}");
        }
    }

    #[test]
    fn a_mirror_image_of_the_mirror_image_is_the_part() {
        let spec = ObjectSpec::by_name("fuel_line").unwrap();
        let twice = spec.mirrored().unwrap().mirrored().unwrap();
        assert_eq!((twice.grasp_start, twice.grasp_end), (spec.grasp_start, spec.grasp_end));
        assert_eq!(twice.footprint, spec.footprint);
        assert_eq!(twice.height_map(CELL_M).unwrap(), spec.height_map(CELL_M).unwrap());
    }

    #[test]
    fn every_look_alike_differs_is_read_from_its_folder_and_lies_still() {
        let folder = std::env::temp_dir().join(format!("sdg-look-alikes-{}", std::process::id()));
        for name in ObjectSpec::names() {
            let part = ObjectSpec::by_name(name).unwrap();
            let own = part.height_map(CELL_M).unwrap();
            for kind in part.look_alike_kinds().unwrap() {
                let spec = part.look_alike(kind, 1).unwrap().spec;
                let difference =
                    spec.height_map(CELL_M).unwrap().difference(&own, &Isometry2::identity(), SAME_HEIGHT_M);
                assert!(difference > 0.01, "{name} {kind}: {difference}");
                spec.write_folder(&folder.join(&spec.name)).unwrap();
                assert_eq!(ObjectSpec::from_folder(&folder.join(&spec.name)).unwrap(), spec, "{name} {kind}");

                let placed = spec.base_from_object(0.5, 0.1, 0.7);
                let fragment = SceneVariation::nominal(Some((&spec, placed))).fragment();
                let model = Arc::new(Model::from_xml(&fragment.to_standalone_mjcf(), &fragment.files).unwrap());
                let body = model.id::<Body>("object").unwrap();
                assert!((model.mass_kg(body) / spec.mass_kg - 1.0).abs() < 1e-3, "{name} {kind}");
                let mut data = Data::new(model).unwrap();
                while data.time_secs() < 1.0 {
                    data.step().unwrap();
                }
                let drift = placed.inverse() * data.world_from_body(body);
                // A look-alike may settle by less than a millimetre, because its rest height is not exact.
                assert!(drift.translation.vector.norm() < 1e-3, "{name} {kind} moved by {}", drift.translation);
                assert!(drift.rotation.angle() < 0.015, "{name} {kind} turned by {} rad", drift.rotation.angle());
            }
        }
        std::fs::remove_dir_all(folder).unwrap();
    }
}

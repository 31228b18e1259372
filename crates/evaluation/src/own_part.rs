//! The taught part as a body for the simulator: its outline in the photo, extruded to its height.

use anyhow::{Context, Result};
use sdg_geometry::RotationalSymmetry;
use sdg_grasp::{GraspModel, Lengths};
use sdg_simulation::objects::{Extrusion, ObjectSpec};
use thiserror::Error;

/// Density of a part whose mass is not given, in kg/m³: between plastic and aluminium.
const ASSUMED_DENSITY: f64 = 1500.0;
/// Maximum resolution of the model's photo, in pixels per metre: approximately that of the wrist camera on the table. A
/// finer photo is reduced to it.
const MAX_PIXELS_PER_M: f64 = 1000.0;
/// Maximum difference between a given height and the model's, in mm: lengths are told to a tenth of a millimetre.
const SAME_HEIGHT_MM: f64 = 0.05;
/// Maximum assumed mass of a body, in kg: the maximum load of the arm.
const MAX_ASSUMED_KG: f64 = 3.0;

/// A simulated part made from a grasp model, and the model with the lengths that the simulated camera needs.
pub struct OwnPart {
    pub object: ObjectSpec,
    pub model: GraspModel,
    /// Given and assumed properties of the part, for display.
    pub facts: String,
}

/// Properties of a part that the photo does not show; `None` for the ones that are not given.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OwnPartSizes {
    /// Height above the table, in mm.
    pub height_mm: Option<f64>,
    /// Length of the longer side of the part's box, in mm.
    pub length_mm: Option<f64>,
    pub mass_g: Option<f64>,
    /// Coefficient of friction of the part's surface, also between the fingers.
    pub friction: Option<f64>,
}

/// An assumption about a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Assumption {
    /// The mass: the density is between plastic and aluminium.
    Mass,
    Friction,
    UprightWalls,
    /// A photo taken vertically from above.
    PhotoFromAbove,
    /// The box as its outline, because no outline was marked.
    BoxAsOutline,
}

/// Given sizes that are inconsistent with the model.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum OwnPartError {
    /// The length is neither given nor known.
    #[error("expected the longer side of the part's box, which a model taught without a camera does not know")]
    NeedsLength,
    /// The height is neither given nor known.
    #[error("expected the part's height above the table, which a model taught without a camera does not know")]
    NeedsHeight,
    /// The length is both given and known.
    #[error("expected a model taught without a camera, found one whose part is {known_mm:.1} mm long")]
    LengthIsKnown { known_mm: f64 },
    /// The given height is not the known one.
    #[error("expected a model taught without a camera, found one whose marks are {known_mm:.1} mm above the table")]
    HeightIsKnown { known_mm: f64 },
}

impl OwnPart {
    /// Makes the part. `model_file` names the model in errors, and `in_words` describes the assumptions.
    ///
    /// # Errors
    /// [`OwnPartError`]; or the simulated hand cannot grasp the part.
    pub fn make(
        model: GraspModel,
        model_file: &str,
        sizes: &OwnPartSizes,
        in_words: &dyn Fn(Assumption) -> &'static str,
    ) -> Result<Self> {
        let known = model.facts().lengths.as_ref();
        let demonstration = model.demonstrations()[0].clone();
        let marks = &demonstration.marks;
        let region = marks.region();
        let bounds = region.bounds();
        let (long, short) = (bounds.width().max(bounds.height()), bounds.width().min(bounds.height()));
        let metres_per_pixel = match (sizes.length_mm, known) {
            (Some(length_mm), None) => 1e-3 * length_mm / long,
            (None, Some(lengths)) => 1.0 / lengths.pixels_per_m,
            (None, None) => return Err(OwnPartError::NeedsLength.into()),
            (Some(_), Some(lengths)) => {
                return Err(OwnPartError::LengthIsKnown { known_mm: 1e3 * long / lengths.pixels_per_m }.into());
            }
        };
        let height_m = match (sizes.height_mm, known) {
            // The arm uses the model's height, except for marks so low or so high that there is no such body.
            (Some(height_mm), Some(lengths)) if is_body(lengths) && !is_same(height_mm, lengths) => {
                return Err(OwnPartError::HeightIsKnown { known_mm: 1e3 * lengths.mark_height_m }.into());
            }
            (Some(height_mm), _) => 1e-3 * height_mm,
            (None, Some(lengths)) => lengths.mark_height_m,
            (None, None) => return Err(OwnPartError::NeedsHeight.into()),
        };
        let mut extrusion = Extrusion {
            name: &marks.label,
            photo: &demonstration.cutout,
            outline: &region,
            grasp: marks.grasp,
            jaw_width_px: marks.width_px,
            metres_per_pixel,
            height_m,
            mass_kg: 0.0,
            friction: sizes.friction,
            symmetry: model.facts().symmetry,
        };
        if extrusion.symmetry == RotationalSymmetry::Fold(1) {
            extrusion.symmetry = RotationalSymmetry::None;
        }
        extrusion.mass_kg = match sizes.mass_g {
            Some(grams) => 1e-3 * grams,
            None => (ASSUMED_DENSITY * extrusion.volume_m3()).min(MAX_ASSUMED_KG),
        };
        let mut object = ObjectSpec::extruded(&extrusion).with_context(|| model_file.to_owned())?;
        let assumed = [
            sizes.mass_g.is_none().then_some(Assumption::Mass),
            sizes.friction.is_none().then_some(Assumption::Friction),
            Some(Assumption::UprightWalls),
            known.is_none().then_some(Assumption::PhotoFromAbove),
            marks.outline.is_none().then_some(Assumption::BoxAsOutline),
        ];
        let facts = format!(
            "{}: {:.1} x {:.1} x {:.1} mm, {:.0} g, friction {}, closed on {:.1} mm; assumed: {}",
            marks.label,
            1e3 * long * metres_per_pixel,
            1e3 * short * metres_per_pixel,
            1e3 * height_m,
            1e3 * extrusion.mass_kg,
            object.friction,
            1e3 * object.jaw_width_m,
            assumed.into_iter().flatten().map(in_words).collect::<Vec<_>>().join(", ")
        );
        object.description.clone_from(&facts);
        let model = match known {
            // The simulated part is an extrusion, whose edges lie in the plane of the marks.
            Some(_) => model.without_edge_height(),
            None => {
                let (mark, grasp) = (object.mark_height_m, object.grasp_height_m);
                let lengths = Lengths::of_level_photos(1.0 / metres_per_pixel, mark, grasp);
                model.with_lengths(lengths, MAX_PIXELS_PER_M).with_context(|| model_file.to_owned())?
            }
        };
        Ok(OwnPart { object, model, facts })
    }
}

/// Whether a body can have the height of the model's marks.
fn is_body(lengths: &Lengths) -> bool {
    let [min_m, max_m] = Extrusion::HEIGHTS_M;
    (min_m..=max_m).contains(&lengths.mark_height_m)
}

fn is_same(height_mm: f64, lengths: &Lengths) -> bool {
    (height_mm - 1e3 * lengths.mark_height_m).abs() <= SAME_HEIGHT_MM
}

//! The part that a model was taught from, as a body for the simulator: its outline in the photo, drawn up to its height.

use anyhow::{Context, Result};
use sdg_geometry::RotationalSymmetry;
use sdg_grasp::{GraspModel, Lengths};
use sdg_simulation::objects::{Extrusion, ObjectSpec};
use thiserror::Error;

/// Between plastic and aluminium, in kg/m³: the density of a part without a given mass.
const ASSUMED_DENSITY: f64 = 1500.0;
/// That of most shipped parts.
const ASSUMED_FRICTION: f64 = 0.6;
/// The wrist camera has about so many pixels for a metre of the table; a finer photo would be compared with blurred pictures.
const MAX_PIXELS_PER_M: f64 = 1000.0;
/// The heaviest body, in kilograms, that may be assumed: the arm's load.
const MAX_ASSUMED_KG: f64 = 3.0;

/// A part made of a model, and the model for the simulated camera.
pub struct OwnPart {
    pub object: ObjectSpec,
    pub model: GraspModel,
    /// What it is made from, given and assumed, for people.
    pub facts: String,
}

/// What the photo does not show of a part; `None` where it is not given.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OwnPartSizes {
    /// Its height over the table.
    pub height_mm: Option<f64>,
    /// The longer side of its box.
    pub length_mm: Option<f64>,
    pub mass_g: Option<f64>,
    /// Coefficient of friction of its surface.
    pub friction: Option<f64>,
}

/// What was assumed of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Assumption {
    /// The mass, of plastic's and aluminium's density.
    Mass,
    Friction,
    UprightWalls,
    /// A photo from straight above.
    PhotoFromAbove,
    /// The box as its outline, since none was marked.
    BoxAsOutline,
}

/// Sizes that do not go with a model.
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum OwnPartError {
    /// Neither given nor known.
    #[error("expected the longer side of the part's box, which a model taught without a camera does not know")]
    NeedsLength,
    /// Neither given nor known.
    #[error("expected the part's height over the table, which a model taught without a camera does not know")]
    NeedsHeight,
    /// Given and known.
    #[error("expected a model taught without a camera, found one that knows that its part is {known_mm:.1} mm long")]
    LengthIsKnown { known_mm: f64 },
}

impl OwnPart {
    /// Makes the part; `model_file` names the model in errors, and `in_words` says what was assumed.
    ///
    /// # Errors
    /// [`OwnPartError`]; a part that no simulated hand can take.
    pub fn make(
        model: GraspModel,
        model_file: &str,
        sizes: &OwnPartSizes,
        in_words: &dyn Fn(Assumption) -> &'static str,
    ) -> Result<Self> {
        let known = model.facts().lengths;
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
            friction: sizes.friction.unwrap_or(ASSUMED_FRICTION),
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
            extrusion.friction,
            1e3 * object.jaw_width_m,
            assumed.into_iter().flatten().map(in_words).collect::<Vec<_>>().join(", ")
        );
        object.description.clone_from(&facts);
        let model = match known {
            Some(_) => model,
            None => {
                let lengths = Lengths {
                    pixels_per_m: 1.0 / metres_per_pixel,
                    mark_height_m: object.mark_height_m,
                    grasp_height_m: object.grasp_height_m,
                    slant: [0.0; 2],
                };
                model.with_lengths(lengths, MAX_PIXELS_PER_M).with_context(|| model_file.to_owned())?
            }
        };
        Ok(OwnPart { object, model, facts })
    }
}

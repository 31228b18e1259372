//! The part that a model was taught from, as a body for the simulator: its outline in the photo, drawn up to its height.

use anyhow::{Context, Result};
use sdg_geometry::RotationalSymmetry;
use sdg_grasp::{GraspModel, Lengths};
use sdg_simulation::objects::{Extrusion, ObjectSpec};

use crate::exit::Usage;
use crate::shared_args::OwnPartArgs;

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

impl OwnPartArgs {
    /// Makes the part; `model_file` names the model in errors.
    ///
    /// # Errors
    /// [`Usage`] where height or length are neither given nor known; a part that no simulated hand can take.
    pub fn make(&self, model: GraspModel, model_file: &str) -> Result<OwnPart> {
        let known = model.facts().lengths;
        let demonstration = model.demonstrations()[0].clone();
        let marks = &demonstration.marks;
        let region = marks.region();
        let bounds = region.bounds();
        let (long, short) = (bounds.width().max(bounds.height()), bounds.width().min(bounds.height()));
        let needed = |option: &str, what: &str| {
            Usage(format!(
                "expected --object NAME for a shipped part, or {option} for the part of {model_file}: {what}, which a model \
                 taught without --camera does not know"
            ))
        };
        let metres_per_pixel = match (self.length_mm, known) {
            (Some(length_mm), None) => 1e-3 * length_mm / long,
            (None, Some(lengths)) => 1.0 / lengths.pixels_per_m,
            (None, None) => return Err(needed("--length-mm MM", "the longer side of its box").into()),
            (Some(_), Some(lengths)) => {
                return Err(Usage(format!(
                    "--length-mm: expected a model taught without --camera, found {model_file}, which knows that its part is \
                     {:.1} mm long",
                    1e3 * long / lengths.pixels_per_m
                ))
                .into());
            }
        };
        let height_m = match (self.height_mm, known) {
            (Some(height_mm), _) => 1e-3 * height_mm,
            (None, Some(lengths)) => lengths.mark_height_m,
            (None, None) => return Err(needed("--height-mm MM", "its height over the table").into()),
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
            friction: self.friction.unwrap_or(ASSUMED_FRICTION),
            symmetry: model.facts().symmetry,
        };
        if extrusion.symmetry == RotationalSymmetry::Fold(1) {
            extrusion.symmetry = RotationalSymmetry::None;
        }
        extrusion.mass_kg = match self.mass_g {
            Some(grams) => 1e-3 * grams,
            None => (ASSUMED_DENSITY * extrusion.volume_m3()).min(MAX_ASSUMED_KG),
        };
        let mut object = ObjectSpec::extruded(&extrusion).with_context(|| model_file.to_owned())?;
        let assumed = [
            self.mass_g.is_none().then_some("the mass, of 1.5 g/cm³ (--mass-g)"),
            self.friction.is_none().then_some("the friction (--friction)"),
            Some("upright walls"),
            known.is_none().then_some("a photo from straight above"),
            marks.outline.is_none().then_some("the box as its outline, since none was marked"),
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
            assumed.into_iter().flatten().collect::<Vec<_>>().join(", ")
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

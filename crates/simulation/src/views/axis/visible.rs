//! The visible fraction of each instance of the part in a picture.

use nalgebra::{Isometry3, Translation3};
use sdg_geometry::PosedCamera;

use crate::error::Result;
use crate::model::{Body, Id, Joint};
use crate::render::Segmentation;
use crate::scene::{PlacedObject, SceneVariation};
use crate::views::GraspTruth;
use crate::workcell::Workcell;

/// One of the part's instances in a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct InstanceTruth {
    /// Pose and grasp of the instance.
    pub grasp: GraspTruth,
    /// Number of the instance's pixels in the picture, as a fraction of their number with all distractors hidden.
    pub visible_share: f64,
}

/// z of hidden objects, below the floor, in metres.
const OUT_OF_SIGHT_M: f64 = -10.0;

/// The ground truth of each instance, with its visible fraction.
pub(super) fn instance_truths(
    cell: &mut Workcell,
    scene: &SceneVariation,
    camera: &PosedCamera,
) -> Result<Vec<InstanceTruth>> {
    let instances: Vec<PlacedObject> = scene.object.iter().chain(&scene.instances).cloned().collect();
    let bodies = instance_bodies(cell, instances.len())?;
    let shown = cell.wrist_segmentation()?;
    for index in 0..scene.distractors.len() {
        hide_distractor(cell, index)?;
    }
    let alone = cell.wrist_segmentation()?;
    Ok(instances
        .iter()
        .zip(bodies)
        .filter_map(|(instance, body)| {
            let pixels = |segmentation: &Segmentation| num_pixels(cell, segmentation, body) as f64;
            let visible_share = pixels(&shown) / pixels(&alone).max(1.0);
            GraspTruth::new(instance, camera).map(|grasp| InstanceTruth { grasp, visible_share })
        })
        .collect())
}

/// The bodies of the part's instances in the scene's order.
pub(super) fn instance_bodies(cell: &Workcell, count: usize) -> Result<Vec<Id<Body>>> {
    let model = cell.data().model();
    (0..count)
        .map(|idx| match idx {
            0 => model.id("object"),
            _ => model.id(&format!("instance_{}", idx - 1)),
        })
        .collect()
}

/// Number of pixels that show a body.
pub(super) fn num_pixels(cell: &Workcell, segmentation: &Segmentation, body: Id<Body>) -> usize {
    let model = cell.data().model();
    segmentation.pixels_where(|geom| model.body_of(geom) == body).count()
}

/// Removes a distractor from the picture, for measuring the rest.
pub(super) fn hide_distractor(cell: &mut Workcell, index: usize) -> Result<()> {
    let below = Isometry3::from_parts(Translation3::new(index as f64, 0.0, OUT_OF_SIGHT_M), Default::default());
    place_distractor(cell, index, &below)
}

/// Moves a distractor.
pub(super) fn place_distractor(cell: &mut Workcell, index: usize, base_from_distractor: &Isometry3<f64>) -> Result<()> {
    let joint = cell.data().model().id::<Joint>(&format!("distractor_{index}_joint"))?;
    cell.data.place(joint, base_from_distractor);
    cell.data.forward()
}

//! Pictures that are harder than an ordinary scene in one property: the axes along which models are evaluated.
//!
//! ```text
//! (part, axis, number, seed) ─> ordinary random scene ─> changed along the axis ─> picture, truth, amount of change
//!                               SceneVariation::sample    camera, things, image
//! ```
//!
//! The range of the axis's parameter is divided into [`PICTURES_PER_AXIS`] equal parts, the **strata**, and each
//! picture has a random value of its stratum ([`axis_stratum`]), so that the pictures cover the range evenly. The same
//! part, axis, number, stratum and seed give the same picture, bit for bit. All pictures are taken by the wrist camera
//! on the arm, as in an attempt.

mod axis_name;
mod camera_pose;
mod clutter;
mod cover;
mod image_faults;
mod instances;
mod request;
mod visible;

use rand::Rng;

pub use axis_name::Axis;
pub use request::{AxisParameter, PICTURES_PER_AXIS, axis_stratum};
use request::{Drawn, Request};
pub use visible::InstanceTruth;

use super::base_from_look_camera;
use crate::camera::CameraView;
use crate::error::Result;
use crate::objects::{LookAlikeKind, ObjectSpec};
use crate::scene::{SceneVariation, VariationConfig};
use crate::workcell::{Workcell, WorkcellConfig};

/// A picture of an axis with its ground truth.
#[derive(Debug, Clone)]
pub struct AxisView {
    /// The axis along which the picture is harder.
    pub axis: Axis,
    /// Index among the pictures of the axis.
    pub number: u64,
    /// The rendered scene.
    pub scene: SceneVariation,
    /// The picture and its camera.
    pub view: CameraView,
    /// Ground truth of all instances of the part; none for look-alikes.
    pub truths: Vec<InstanceTruth>,
    /// The amount of change along the axis.
    pub parameter: AxisParameter,
    /// The kind of look-alike on the table; `None` on other axes.
    pub look_alike: Option<LookAlikeKind>,
}

/// Renders picture `number` (of `of`) of an axis.
///
/// # Errors
/// As for [`Workcell::new`]; [`Configuration`](crate::SimulationError::Configuration) if no pose of the camera, the
/// cover or the instances gives the picture that the axis requires.
pub fn axis_view(spec: &ObjectSpec, axis: Axis, (number, of): (u64, u64), seed: u64) -> Result<AxisView> {
    let mut request = Request::new(spec, axis, (number, of), seed);
    if axis == Axis::LookAlikes {
        return look_alike_view(&mut request);
    }
    let Drawn { mut cell, scene, view, parameter } = match axis {
        Axis::Height => camera_pose::draw_from_another_height(&mut request)?,
        Axis::Tilt => camera_pose::draw_tilted(&mut request, camera_pose::TILTS_DEG)?,
        Axis::Slant => camera_pose::draw_tilted(&mut request, camera_pose::SLANTS_DEG)?,
        Axis::Covered => cover::draw_covered(&mut request)?,
        Axis::Clutter => clutter::draw_cluttered(&mut request)?,
        Axis::Instances => instances::draw_three(&mut request)?,
        Axis::Dark | Axis::Blur | Axis::Tint | Axis::LookAlikes => {
            let scene = request.ordinary_scene();
            let mut cell = Workcell::new(&WorkcellConfig::new(scene.clone()))?;
            let mut view = cell.view_from(&base_from_look_camera())?;
            let parameter = match axis {
                Axis::Dark => image_faults::darken(&mut view.image, &mut request),
                Axis::Blur => image_faults::blur(&mut view.image, &mut request),
                _ => image_faults::tint(&mut view.image, &mut request),
            };
            Drawn { cell, scene, view, parameter }
        }
    };
    let truths = visible::instance_truths(&mut cell, &scene, &view.camera)?;
    Ok(AxisView { axis, number, scene, view, truths, parameter, look_alike: None })
}

/// An ordinary picture with a look-alike instead of the part; the kinds alternate.
fn look_alike_view(request: &mut Request<'_>) -> Result<AxisView> {
    let kinds = request.spec.look_alike_kinds()?;
    let kind = kinds[(request.number % kinds.len() as u64) as usize];
    let look_alike = request.spec.look_alike(kind, request.rng.random())?;
    let scene = SceneVariation::sample(Some(&look_alike.spec), &VariationConfig::default(), request.scene_seed);
    let mut cell = Workcell::new(&WorkcellConfig::new(scene))?;
    let view = cell.view_from(&base_from_look_camera())?;
    Ok(AxisView {
        axis: Axis::LookAlikes,
        number: request.number,
        scene: cell.config().scene.clone(),
        view,
        truths: Vec::new(),
        parameter: AxisParameter { value: 1.0, unit: "look-alike", description: look_alike.description },
        look_alike: Some(kind),
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point2, Point3, Vector2};

    use super::visible::instance_bodies;
    use super::*;
    use crate::scene::PlacedObject;
    use crate::shapes::footprint;

    /// Largest distance in pixels between the centres of the rendered part and of its projected top. A wall of 12 mm,
    /// seen from 20 degrees off the vertical, covers 4 px on one side and moves the centre by 2 px. The rest of the
    /// tolerance allows for the raster of a millimetre.
    const MIDDLE_TOLERANCE_PX: f64 = 3.0;

    #[test]
    fn names_are_read_as_they_are_written() {
        for axis in Axis::ALL {
            assert_eq!(axis.name().parse::<Axis>().unwrap(), axis);
        }
        let message = "tilted".parse::<Axis>().unwrap_err().to_string();
        assert!(message.contains("axis") && message.contains("tilted") && message.contains("look-alikes"), "{message}");
    }

    #[test]
    fn strata_divide_the_range() {
        let spec = ObjectSpec::by_name("rod_end").unwrap();
        for number in 0..PICTURES_PER_AXIS {
            let level = Request::new(&spec, Axis::Height, (number, PICTURES_PER_AXIS), 3).level;
            assert_eq!((level * PICTURES_PER_AXIS as f64) as u64, number);
        }
        let level = |axis, seed| Request::new(&spec, axis, (4, PICTURES_PER_AXIS), seed).level;
        assert_eq!(level(Axis::Height, 3), level(Axis::Height, 3));
        assert_ne!(level(Axis::Height, 3), level(Axis::Height, 4));
        assert_ne!(level(Axis::Height, 3), level(Axis::Tilt, 3));
    }

    #[test]
    fn the_last_pictures_are_spread_over_the_strata() {
        let strata = |of: u64| (0..of).map(|number| axis_stratum(number, of)).collect::<Vec<_>>();
        assert_eq!(strata(1), [10]);
        assert_eq!(strata(5), [2, 6, 10, 14, 18]);
        assert_eq!(strata(40)[20..], strata(20));
        assert_eq!((&strata(23)[..20], &strata(23)[20..]), (&strata(20)[..], &[3, 10, 16][..]));
        assert_eq!(strata(19).last(), Some(&19));
        // As in `strata_divide_the_range`, but in the fourth picture of five.
        let spec = ObjectSpec::by_name("rod_end").unwrap();
        assert_eq!((Request::new(&spec, Axis::Height, (3, 5), 3).level * PICTURES_PER_AXIS as f64) as u64, 14);
    }

    #[test]
    fn the_truth_lies_on_the_drawn_part_from_any_camera_pose() {
        for (name, axis, number) in [
            ("cranfield_face", Axis::Tilt, 19),
            ("fuel_line", Axis::Tilt, 10),
            ("fuel_line", Axis::Height, 0),
            ("cranfield_face", Axis::Height, 19),
        ] {
            let spec = ObjectSpec::by_name(name).unwrap();
            let mut request = Request::new(&spec, axis, (number, PICTURES_PER_AXIS), 5);
            let mut drawn = match axis {
                Axis::Tilt => camera_pose::draw_tilted(&mut request, camera_pose::TILTS_DEG).unwrap(),
                _ => camera_pose::draw_from_another_height(&mut request).unwrap(),
            };
            let truth = &visible::instance_truths(&mut drawn.cell, &drawn.scene, &drawn.view.camera).unwrap()[0];
            let projected: Vec<Point2<f64>> = spec
                .height_map(0.001)
                .unwrap()
                .filled()
                .map(|(at, z, _)| truth.grasp.base_from_object * Point3::new(at.x, at.y, z))
                .map(|p| drawn.view.camera.project(&p).unwrap())
                .collect();
            let body = instance_bodies(&drawn.cell, 1).unwrap()[0];
            let segmentation = drawn.cell.wrist_segmentation().unwrap();
            let model = drawn.cell.data().model();
            let shown: Vec<Point2<f64>> = segmentation
                .pixels_where(|geom| model.body_of(geom) == body)
                .map(|(x, y)| Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5))
                .collect();
            let middle =
                |points: &[Point2<f64>]| points.iter().map(|p| p.coords).sum::<Vector2<f64>>() / points.len() as f64;
            let apart = (middle(&projected) - middle(&shown)).norm();
            assert!(apart < MIDDLE_TOLERANCE_PX, "{name} {axis} {number}: {apart} px");
            let line = truth.grasp.line;
            // The marks are near the centre of the rendered part.
            assert!((line.center().coords - middle(&shown)).norm() < 60.0, "{name} {axis}: {:?}", line.center());
            let range = if axis == Axis::Tilt { 5.0..20.0 } else { 0.75..1.3 };
            assert!(range.contains(&drawn.parameter.value), "{}", drawn.parameter.description);
        }
    }

    #[test]
    fn covers_hide_what_their_stratum_says() {
        for (name, number) in [("fuel_line", 0), ("housing", 19)] {
            let spec = ObjectSpec::by_name(name).unwrap();
            let shown = axis_view(&spec, Axis::Covered, (number, PICTURES_PER_AXIS), 8).unwrap();
            let stratum = |number: u64| 0.10 + 0.30 * number as f64 / PICTURES_PER_AXIS as f64;
            let covered = 1.0 - shown.truths[0].visible_share;
            // The covered fraction is within two percentage points of the wanted one.
            assert!(
                (stratum(number) - 0.02..stratum(number + 1) + 0.02).contains(&covered),
                "{name} {number}: {covered}"
            );
            assert!((covered - shown.parameter.value).abs() < 1e-9, "{covered} and {}", shown.parameter.value);
        }
    }

    #[test]
    fn instances_keep_apart_and_things_in_clutter_do_not_cover() {
        let spec = ObjectSpec::by_name("rod_end").unwrap();
        let shown = axis_view(&spec, Axis::Instances, (3, PICTURES_PER_AXIS), 8).unwrap();
        assert_eq!(shown.truths.len(), 3);
        let outlines: Vec<_> =
            shown.scene.object.iter().chain(&shown.scene.instances).map(PlacedObject::footprint).collect();
        for (idx, one) in outlines.iter().enumerate() {
            assert!(shown.truths[idx].visible_share > 0.9, "{}", shown.truths[idx].visible_share);
            for other in &outlines[..idx] {
                assert!(footprint::separation(one, other) > 0.0);
            }
        }
        let cluttered = axis_view(&spec, Axis::Clutter, (12, PICTURES_PER_AXIS), 8).unwrap();
        assert!((10..=15).contains(&cluttered.scene.distractors.len()));
        // Tall objects beside the part hide a small fraction of it from a camera that is not vertically above.
        assert!(cluttered.truths[0].visible_share > 0.85, "{}", cluttered.truths[0].visible_share);
    }

    #[test]
    fn a_picture_is_the_same_to_the_bit_and_look_alikes_have_no_truth() {
        let spec = ObjectSpec::by_name("fuel_line").unwrap();
        let [one, again] = [0; 2].map(|_| axis_view(&spec, Axis::Dark, (7, PICTURES_PER_AXIS), 2).unwrap());
        assert_eq!(one.view, again.view);
        let shown = axis_view(&spec, Axis::LookAlikes, (0, PICTURES_PER_AXIS), 2).unwrap();
        assert_eq!(shown.look_alike, Some(LookAlikeKind::Mirrored));
        assert!(shown.truths.is_empty() && shown.scene.object.unwrap().spec.name == "fuel_line_mirrored");
    }
}

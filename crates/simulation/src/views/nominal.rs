//! Pictures of the wrist camera with ground truth: test images and demonstrations.
//!
//! Both are taken by the same code and from the same pose as the first picture of a grasp attempt.

use nalgebra::{Isometry3, Point2, Point3};
use sdg_geometry::{GraspLine, Mask, PlanarGrasp, Polygon, PosedCamera, outer_outline};
use sdg_robot::{LOOK_AT_M, LOOK_HEIGHT_M, camera_looking_down};

use crate::camera::CameraView;
use crate::error::{Result, SimulationError};
use crate::model::Body;
use crate::objects::ObjectSpec;
use crate::scene::{PlacedObject, SceneVariation, VariationConfig};
use crate::workcell::{Workcell, WorkcellConfig};

/// Pose of the parts in demonstrations: x, y in metres and yaw in radians, in the base frame.
///
/// Attempts sample poses from continuous ranges and do not repeat this one.
pub const DEMONSTRATION_PLACE: (f64, f64, f64) = (0.5, 0.0, 0.9);

/// The wrist camera's first pose in an attempt: it points vertically down at the centre of the reachable table area.
pub fn base_from_look_camera() -> Isometry3<f64> {
    let [x, y] = LOOK_AT_M;
    camera_looking_down(x, y, LOOK_HEIGHT_M, 0.0)
}

/// The true pose of a part, and its grasp in a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct GraspTruth {
    /// Pose of the object frame in the base frame.
    pub base_from_object: Isometry3<f64>,
    /// The tool centre point, in the base frame.
    pub tcp: Point3<f64>,
    /// Direction of the marked line in the base frame, in radians about z from x.
    pub direction_rad: f64,
    /// The marked line in pixels.
    pub line: GraspLine,
    /// The grasp as a planar grasp in pixels; its width is the part's width between the jaws.
    pub planar: PlanarGrasp,
}

impl GraspTruth {
    /// Projects a part's marks; `None` if they are behind the camera.
    pub fn new(object: &PlacedObject, camera: &PosedCamera) -> Option<Self> {
        let [start, end] = object.spec.marks_in_base(&object.base_from_object);
        let line = GraspLine::new(camera.project(&start)?, camera.project(&end)?);
        let middle_px = line.center();
        let metres_per_pixel = camera.metres_per_pixel(&middle_px, nalgebra::center(&start, &end).z)?;
        let (tcp, direction_rad) = object.spec.grasp_in_base(&object.base_from_object);
        Some(Self {
            base_from_object: object.base_from_object,
            tcp,
            direction_rad,
            line,
            planar: PlanarGrasp::from_line(&line, object.spec.jaw_width_m / metres_per_pixel),
        })
    }
}

/// A picture with its scene and, if the part is on the table, its ground truth.
#[derive(Debug, Clone)]
pub struct TestView {
    /// The rendered scene.
    pub scene: SceneVariation,
    /// The picture and its camera.
    pub view: CameraView,
    /// Ground truth of the part; `None` for a scene without it.
    pub truth: Option<GraspTruth>,
}

/// The picture of one scene from the first pose of an attempt.
///
/// # Errors
/// As for [`Workcell::new`] and [`Workcell::view_from`].
pub fn test_view(scene: SceneVariation) -> Result<TestView> {
    test_view_drawn(WorkcellConfig::new(scene))
}

fn test_view_drawn(config: WorkcellConfig) -> Result<TestView> {
    let mut workcell = Workcell::new(&config)?;
    let scene = config.scene;
    let view = workcell.view_from(&base_from_look_camera())?;
    let truth = scene.object.as_ref().and_then(|object| GraspTruth::new(object, &view.camera));
    Ok(TestView { scene, view, truth })
}

/// Pictures at new poses with changed light, other tables and distractors, one for each seed from `seed` on.
///
/// If `present` is false, the scene has no part and at least one distractor.
pub fn test_views(
    spec: &ObjectSpec,
    present: bool,
    count: usize,
    seed: u64,
) -> impl Iterator<Item = Result<TestView>> + '_ {
    let mut config = VariationConfig::default();
    if !present {
        config.distractors = 1..=*config.distractors.end();
    }
    (0..count as u64).map(move |offset| {
        test_view(SceneVariation::sample(present.then_some(spec), &config, seed.wrapping_add(offset)))
    })
}

/// A demonstration of a part: one picture in even light, with the true marks and an outline as a careful person would
/// mark it.
#[derive(Debug, Clone)]
pub struct DemonstrationView {
    /// The picture and its camera.
    pub view: CameraView,
    /// The marked line and the part's true pose.
    pub truth: GraspTruth,
    /// The pixels that show the part.
    pub mask: Mask,
    /// The outer outline, with as few vertices as a person would click.
    pub outline: Polygon,
}

/// Takes the demonstration picture of a part.
///
/// # Errors
/// As for [`Workcell::new`]; [`SimulationError::Configuration`] if the part is not in the camera's view.
pub fn demonstration_view(spec: &ObjectSpec) -> Result<DemonstrationView> {
    demonstration_view_at(spec, DEMONSTRATION_PLACE)
}

/// As [`demonstration_view`], with the part at another place.
///
/// # Errors
/// As for [`demonstration_view`].
pub fn demonstration_view_at(spec: &ObjectSpec, place: (f64, f64, f64)) -> Result<DemonstrationView> {
    demonstration_view_drawn(&WorkcellConfig::new(demonstration_scene(spec, place)))
}

fn demonstration_scene(spec: &ObjectSpec, (x, y, yaw_rad): (f64, f64, f64)) -> SceneVariation {
    SceneVariation::nominal(Some((spec, spec.base_from_object(x, y, yaw_rad))))
}

fn demonstration_view_drawn(config: &WorkcellConfig) -> Result<DemonstrationView> {
    let scene = &config.scene;
    let mut workcell = Workcell::new(config)?;
    let view = workcell.view_from(&base_from_look_camera())?;
    let segmentation = workcell.wrist_segmentation()?;
    let model = workcell.data().model();
    let body = model.id::<Body>("object")?;
    let (width, height) = segmentation.dimensions();
    let mask =
        Mask::from_fn(width, height, |x, y| segmentation.geom_at(x, y).is_some_and(|geom| model.body_of(geom) == body));
    let unseen = || SimulationError::Configuration {
        field: "DEMONSTRATION_PLACE",
        expected: "a place that the wrist camera sees".to_owned(),
        found: format!("{DEMONSTRATION_PLACE:?}"),
    };
    let outline = outer_outline(&mask).ok_or_else(unseen)?;
    let truth = scene.object.as_ref().and_then(|object| GraspTruth::new(object, &view.camera)).ok_or_else(unseen)?;
    Ok(DemonstrationView { view, truth, mask, outline })
}

/// Whether a point is in the picture, at least `margin_px` from its border.
pub fn in_picture(camera: &PosedCamera, point: &Point2<f64>, margin_px: f64) -> bool {
    let (width, height) = (f64::from(camera.intrinsics.width), f64::from(camera.intrinsics.height));
    (margin_px..=width - margin_px).contains(&point.x) && (margin_px..=height - margin_px).contains(&point.y)
}

/// Minimum distance of a completely visible part from the picture's border, in pixels.
const RIM_PX: f64 = 8.0;

/// Whether a part's outline, on the table and at the height of its marks, is in the picture.
pub(crate) fn shows_whole(camera: &PosedCamera, part: &PlacedObject) -> bool {
    part.footprint().iter().all(|corner| {
        [0.0, part.spec.mark_height_m].into_iter().all(|z| {
            camera.project(&Point3::new(corner.x, corner.y, z)).is_some_and(|pixel| in_picture(camera, &pixel, RIM_PX))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::RenderConfig;

    /// Largest distance in pixels between the centre of the marks and the axis of the rendered part.
    const MARK_TOLERANCE_PX: f64 = 1.5;

    /// Largest mean distance between a careful person's outline and the true one, in pixels.
    const MEAN_OUTLINE_OFFSET_PX: f64 = 0.4;

    /// A configuration without shadows and antialiasing, because these tests check only positions.
    fn drawn_fast(scene: SceneVariation) -> WorkcellConfig {
        let wrist_render = RenderConfig { shadow_size: 0, samples: 0, ..RenderConfig::default() };
        WorkcellConfig { wrist_render, ..WorkcellConfig::new(scene) }
    }

    #[test]
    fn demonstration_marks_lie_along_the_middle_of_the_drawn_part() {
        for name in ObjectSpec::names() {
            let spec = ObjectSpec::by_name(name).unwrap();
            let shown = demonstration_view_drawn(&drawn_fast(demonstration_scene(&spec, DEMONSTRATION_PLACE))).unwrap();
            let line = shown.truth.line;
            let across = nalgebra::Vector2::new(-(line.end - line.start).y, (line.end - line.start).x).normalize();
            // The distance from the grasp's centre to the part's outer edge on each side is searched in steps of 0.1
            // px; the centre itself may be open, as in a bearing.
            let reach = |side: f64| {
                (0..400)
                    .rev()
                    .map(|step| f64::from(step) * 0.1)
                    .find(|distance| {
                        let at = line.center() + across * (side * distance);
                        shown.mask.get(at.x as u32, at.y as u32)
                    })
                    .unwrap()
            };
            let (left, right) = (reach(-1.0), reach(1.0));
            assert!((left - right).abs() < 2.0 * MARK_TOLERANCE_PX, "{name}: {left} and {right} px");
            let width = shown.truth.planar.width;
            assert!((left + right - width).abs() < 2.5, "{name}: {} px drawn, {width} px expected", left + right);
            let bounds = shown.outline.bounds();
            let length = (bounds.x2 - bounds.x1).hypot(bounds.y2 - bounds.y1);
            assert!((60.0..230.0).contains(&length), "{name}: {length} px");
            // The area between the clicked and the true outline, divided by the outline's length, is its mean error.
            let (clicked, shown_filled) = (shown.outline.rasterize(640, 480), filled(&shown.mask));
            let differing = (0..480u32)
                .flat_map(|y| (0..640u32).map(move |x| (x, y)))
                .filter(|&(x, y)| clicked.get(x, y) != shown_filled.get(x, y))
                .count();
            let length: f64 = shown.outline.edges().map(|(a, b)| (b - a).norm()).sum();
            let mean_offset_px = differing as f64 / length;
            assert!(mean_offset_px < MEAN_OUTLINE_OFFSET_PX, "{name}: outline off by {mean_offset_px} px");
            assert!((20..=60).contains(&shown.outline.vertices.len()));
        }
    }

    /// The mask with its holes filled: all pixels that no path outside the mask connects to the picture's corner.
    fn filled(mask: &Mask) -> Mask {
        let mut outside = Mask::empty(mask.width(), mask.height());
        let mut open = vec![(0u32, 0u32)];
        while let Some((x, y)) = open.pop() {
            if x >= mask.width() || y >= mask.height() || outside.get(x, y) || mask.get(x, y) {
                continue;
            }
            outside.set(x, y, true);
            open.extend([(x + 1, y), (x.wrapping_sub(1), y), (x, y + 1), (x, y.wrapping_sub(1))]);
        }
        Mask::from_fn(mask.width(), mask.height(), |x, y| !outside.get(x, y))
    }

    #[test]
    fn test_views_show_the_whole_part_or_none() {
        let spec = ObjectSpec::by_name("fuel_line").unwrap();
        for seed in [40, 41, 42] {
            let scene = SceneVariation::sample(Some(&spec), &VariationConfig::default(), seed);
            let seen = test_view_drawn(drawn_fast(scene)).unwrap();
            let object = seen.scene.object.unwrap();
            for corner in object.footprint() {
                let pixel = seen.view.camera.project(&Point3::new(corner.x, corner.y, 0.01)).unwrap();
                assert!(in_picture(&seen.view.camera, &pixel, 1.0), "{pixel}");
            }
            let truth = seen.truth.unwrap();
            let back = seen.view.camera.at_height(&truth.line.center(), spec.mark_height_m).unwrap();
            assert!((back.xy() - truth.tcp.xy()).norm() < 1e-6, "{back} and {}", truth.tcp);
        }
        let absent = test_views(&spec, false, 1, 40).next().unwrap().unwrap();
        assert!(absent.truth.is_none() && !absent.scene.distractors.is_empty());
    }
}

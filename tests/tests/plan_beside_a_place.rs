//! Plans of a grasp while a part lies at a place for finished parts: the other one is chosen, and its outline is drawn.

use image::{RgbImage, imageops};
use nalgebra::Point2;
use sdg_cell::{CameraPose, ModelFinder, MountedCamera, Pictures, SeenOutline, TakenPicture, UNKNOWN_HEIGHTS_M};
use sdg_evaluation::shipped;
use sdg_robot::{Arm, ArmGeometry, GraspTarget, PartFinder, Place, PlaceKind, PlannedArm};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::views::demonstration_view;

use crate::calibrated_camera::taught;

/// Maximum distance of an outline's centre from the grasp in it; the parts are 0.26 m apart.
const IN_PART_M: f64 = 0.1;

/// A camera that sees the same picture for ever.
#[derive(Debug)]
struct Still(RgbImage);

impl<A: Arm> Pictures<A> for Still {
    fn take(&mut self, _arm: &mut A) -> sdg_robot::Result<TakenPicture> {
        Ok(TakenPicture { picture: self.0.clone(), taken: None })
    }
}

fn distance_m(outline: &SeenOutline, target: &GraspTarget) -> f64 {
    let corners = &outline.outline_in_base;
    let sum = corners.iter().fold(Point2::origin(), |sum: Point2<f64>, corner| sum + corner.coords);
    (sum / corners.len() as f64 - Point2::from(target.base_from_tcp.translation.vector.xy())).norm()
}

#[test]
fn a_part_at_a_place_is_not_planned_for_and_not_drawn() {
    let part = ObjectSpec::by_name("pendulum").unwrap();
    let model = taught(&part, &[]);
    let grasp_height_m = model.facts().lengths.as_ref().unwrap().grasp_height_m;
    let camera = demonstration_view(&part).unwrap().view.camera;
    let mounted = MountedCamera {
        intrinsics: camera.intrinsics,
        pose: CameraPose::InBase(camera.world_from_camera),
        table_height_m: 0.0,
    };
    // The part of the photo, and a copy of it.
    let mut picture = shipped::demonstration("pendulum").unwrap().image;
    let copy = imageops::crop_imm(&picture, 240, 150, 160, 150).to_image();
    imageops::replace(&mut picture, &copy, 20, 20);
    let panda = ArmGeometry::panda();
    let mut arm = PlannedArm::new(panda.clone(), panda.ready, 0.08);
    for is_searched_at_all_heights in [false, true] {
        let finder = ModelFinder::new(model.clone(), mounted, Still(picture.clone()));
        let mut finder = if is_searched_at_all_heights { finder.with_heights(UNKNOWN_HEIGHTS_M) } else { finder };
        let best: GraspTarget = finder.find(&mut arm).unwrap().unwrap();
        assert!(distance_m(finder.seen().unwrap(), &best) < IN_PART_M, "{:?}", finder.seen());
        let p = best.base_from_tcp.translation;
        let kind = PlaceKind::Pose;
        finder.places = vec![Place { name: "done".to_owned(), at_m: [p.x, p.y], yaw_rad: 0.0, surface_m: 0.0, kind }];
        let other: GraspTarget = finder.find(&mut arm).unwrap().unwrap();
        assert!((other.base_from_tcp.translation.vector - p.vector).norm() > 0.2, "{other:?}");
        let seen = finder.seen().unwrap();
        assert!(distance_m(seen, &other) < IN_PART_M, "{seen:?}");
        assert!((seen.z_m[0] + grasp_height_m - other.base_from_tcp.translation.z).abs() < 1e-9, "{seen:?}");
        // Also near the place, where a detection from afar may be wrong; the part in the place is another part.
        let mut beside = best.base_from_tcp;
        beside.translation.x += 0.04;
        let nearest: GraspTarget = finder.find_nearest(&mut arm, &beside).unwrap().unwrap();
        assert!((nearest.base_from_tcp.translation.vector - p.vector).norm() > 0.2, "{nearest:?}");
        let near_place = |part: &GraspTarget| (part.base_from_tcp.translation.vector - p.vector).norm() < 0.02;
        assert!(PartFinder::<PlannedArm>::others(&finder).iter().any(near_place));
        // A part that was put down is searched in its place.
        let placed: GraspTarget = finder.find_nearest(&mut arm, &best.base_from_tcp).unwrap().unwrap();
        assert!(near_place(&placed), "{placed:?}");
    }
}

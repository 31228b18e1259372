//! Searches with a camera on the hand for a part that lies higher than the table: that of a dry run, and that after
//! placing.

use std::cell::Cell;

use sdg_cell::{CameraPose, ModelFinder, MountedCamera, Pictures, TakenPicture, UNKNOWN_HEIGHTS_M};
use sdg_evaluation::SimulatedPictures;
use sdg_geometry::PinholeCamera;
use sdg_grasp::GraspModel;
use sdg_robot::height::GivenHeight;
use sdg_robot::{Arm, GraspConfig, GraspTarget, PartFinder};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::scene::{SceneVariation, VariationConfig};
use sdg_simulation::{Workcell, WorkcellConfig, marked_grasp};

use crate::calibrated_camera::taught;

/// Height of the part above the table, in metres.
const RAISED_M: f64 = 0.060;

/// The simulated pictures, counted.
#[derive(Debug)]
struct Counted<'a>(&'a Cell<u32>);

impl Pictures<Workcell> for Counted<'_> {
    fn take(&mut self, cell: &mut Workcell) -> sdg_robot::Result<TakenPicture> {
        self.0.set(self.0.get() + 1);
        SimulatedPictures.take(cell)
    }
}

/// A model of the pendulum, a pendulum in the air below the wrist camera, and this camera.
fn raised() -> (GraspModel, Workcell, MountedCamera) {
    let part = ObjectSpec::by_name("pendulum").unwrap();
    let mut scene = SceneVariation::sample(Some(&part), &VariationConfig::default(), 7300);
    scene.distractors.clear();
    // The arm does not move, so that the part stays in the air.
    scene.object.as_mut().unwrap().base_from_object.translation.z += RAISED_M;
    let mut cell = Workcell::new(&WorkcellConfig::new(scene)).unwrap();
    let mount = cell.wrist_camera();
    let q = GraspConfig::default().look_outs[0].configuration(cell.geometry(), &mount, 0.0).unwrap();
    cell.reset(&q).unwrap();
    // A picture computes the positions.
    cell.wrist_view().unwrap();
    let camera = MountedCamera {
        intrinsics: PinholeCamera::WRIST,
        pose: CameraPose::OnFlange(cell.told_flange_from_camera()),
        table_height_m: 0.0,
    };
    (taught(&part, &[]), cell, camera)
}

#[test]
fn a_given_height_of_the_marks_is_where_a_dry_run_searches_first() {
    let part = ObjectSpec::by_name("pendulum").unwrap();
    let (model, mut cell, camera) = raised();
    let told = GivenHeight { height_m: RAISED_M + part.mark_height_m, sigma_m: 0.002 };
    let mut planned = |told: Option<&GivenHeight>, is_searched_at_all_heights: bool| {
        let taken = Cell::new(0);
        let finder = ModelFinder::new(model.clone(), camera, Counted(&taken));
        let mut finder = if is_searched_at_all_heights { finder.with_heights(UNKNOWN_HEIGHTS_M) } else { finder };
        let target: Option<GraspTarget> = finder.find_for_plan(&mut cell, told).unwrap();
        (target.map(|target| target.base_from_tcp.translation.z), taken.get())
    };
    let expected_m = RAISED_M + part.grasp_height_m;
    for is_searched_at_all_heights in [false, true] {
        let (z_m, taken) = planned(Some(&told), is_searched_at_all_heights);
        assert!((z_m.unwrap() - expected_m).abs() < 1e-9, "{z_m:?}");
        assert_eq!(taken, 1);
    }
    // On the table, a part of this size is another part; its size gives the height.
    assert_eq!(planned(None, false), (None, 1));
    let (z_m, taken) = planned(None, true);
    assert!((z_m.unwrap() - expected_m).abs() < 0.010, "{z_m:?}");
    assert_eq!(taken, 2);
}

#[test]
fn a_part_that_was_put_down_is_searched_at_the_height_of_its_place() {
    let part = ObjectSpec::by_name("pendulum").unwrap();
    let (model, mut cell, camera) = raised();
    // The marked grasp is that of a part on the table.
    let mut expected = marked_grasp(&part, &cell.base_from_object().unwrap()).base_from_tcp;
    expected.translation.z += RAISED_M;
    let taken = Cell::new(0);
    let mut finder = ModelFinder::new(model, camera, Counted(&taken));
    let found = finder.find_nearest(&mut cell, &expected).unwrap().unwrap();
    let apart = found.base_from_tcp.translation.vector - expected.translation.vector;
    assert!(apart.xy().norm() < 0.005 && apart.z.abs() < 1e-6, "{apart}");
    assert!(finder.last().is_none(), "no picture for a grasp was taken");
}

//! Places parts in cells of a tray, by contact, with 1 Nm of friction in every joint.
//!
//! `make placing` (examples/placing.rs) fills the whole tray.

use crate::placing::{Where, beside, cell, config, place, tray};
use nalgebra::Isometry3;
use sdg_robot::{PlacingConfig, PlacingOutcome};
use sdg_simulation::objects::ObjectSpec;

/// Largest offset of a part from its cell.
const MAX_BESIDE_M: f64 = 0.003;
const MAX_TURNED_DEG: f64 = 3.0;
/// Largest movement of a part that is already placed: it may settle, although nothing touches it.
const MAX_MOVED_M: f64 = 0.5e-3;
/// Largest static force that does not damage part or table.
const MAX_STATIC_N: f64 = 10.0;
const MAX_PEAK_N: f64 = 25.0;
/// Largest deviation of the tcp from its reference with the part in free air.
const MAX_FREE_AIR_M: f64 = 1.5e-3;
const MAX_FREE_AIR_DEG: f64 = 0.5;

/// Places parts in cells one after the other; placed parts stay in the scene.
fn fill(at: Where, cells: &[u32]) {
    let spec = ObjectSpec::by_name("spring_clip").unwrap();
    let mut lying: Vec<Isometry3<f64>> = Vec::new();
    let placing = PlacingConfig { symmetry: spec.symmetry, ..PlacingConfig::default() };
    for &number in cells {
        let goal = tray().goal(number).unwrap();
        let placed = place(cell(&spec, u64::from(number), &lying), at, &goal, &config(&spec), &placing);
        let report = placed.report.unwrap();
        assert_eq!(report.outcome, PlacingOutcome::Placed, "{number}: {report:?}");
        let (distance_m, angle_rad) = beside(&spec, &placed.base_from_object, &goal);
        println!("{number}: {:.2} mm, {:.2}°, {:?}", distance_m * 1e3, angle_rad.to_degrees(), report.touched);
        assert!(distance_m <= MAX_BESIDE_M && angle_rad.to_degrees() <= MAX_TURNED_DEG, "{number}: {report:?}");
        assert!(placed.moved_m < MAX_MOVED_M, "{number}: a part that lay already moved by {} m", placed.moved_m);
        for touched in &report.touched {
            assert!(touched.force_n < MAX_STATIC_N && touched.peak_n < MAX_PEAK_N, "{number}: {touched:?}");
            let [beside_reference_m, turned_rad] = touched.free_air_error;
            assert!(beside_reference_m < MAX_FREE_AIR_M, "{number}: {touched:?}");
            assert!(turned_rad.to_degrees() < MAX_FREE_AIR_DEG, "{number}: {touched:?}");
        }
        lying.push(placed.base_from_object);
    }
}

#[test]
fn two_parts_are_placed_in_one_process() {
    fill(Where::Process, &[6, 7]);
}

#[test]
fn a_part_is_placed_over_the_network_in_lockstep() {
    fill(Where::Lockstep, &[6]);
}

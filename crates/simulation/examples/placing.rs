//! Places parts in a tray, and grasps parts on a table that is higher than the given height, with true poses instead of
//! pictures and 1 Nm of friction per joint.
//!
//! ```text
//! placing tray process|lockstep [PART [CELLS [X Y]]]      spring_clip 20 100 55: a part into each cell, at a pitch of X by Y mm;
//!                                                         placed parts stay in the scene
//! placing heights process|lockstep [ATTEMPTS [SEED [PART]…]]   10 101: grasps each part compliantly and in joint positions; the table is 5 mm higher
//! ```
//! Ends with an error if a part is dropped, lies more than 3 mm or 3° from its cell's pose, or moves another part. Also
//! ends with an error if fewer than 8 of 10 compliant grasps hold the part, or if their force exceeds 10 N at rest or
//! 25 N at its peak.

use std::error::Error;

use nalgebra::Isometry3;
use sdg_robot::{GraspConfig, PlacingConfig, TouchDown};
use sdg_simulation::objects::ObjectSpec;

#[path = "../tests/network/mod.rs"]
mod network;
#[path = "../tests/placing/mod.rs"]
mod placing;

use placing::{Where, beside, cell, config, grasp_on_other_table, place, tray, tray_of};

/// Height of the table above the height given to the robot, in metres.
const HIGHER_M: f64 = 0.005;
const MAX_BESIDE_M: f64 = 0.003;
const MAX_TURNED_DEG: f64 = 3.0;
const MAX_MOVED_M: f64 = 0.5e-3;
const MAX_OVER_REST_M: f64 = 0.005;
const MAX_STATIC_N: f64 = 10.0;
const MAX_PEAK_N: f64 = 25.0;
/// The parts that are grasped if none are given.
const PARTS: [&str; 4] = ["pendulum", "fuel_line", "rod_end", "common_line"];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (what, at, rest) = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [what, "process", ref rest @ ..] => (what.to_owned(), Where::Process, rest.to_vec()),
        [what, "lockstep", ref rest @ ..] => (what.to_owned(), Where::Lockstep, rest.to_vec()),
        _ => return Err("expected tray|heights process|lockstep".into()),
    };
    match what.as_str() {
        "tray" => fill_tray(at, &rest),
        "heights" => other_heights(at, &rest),
        other => Err(format!("expected tray or heights, found {other}").into()),
    }
}

fn fill_tray(at: Where, rest: &[&str]) -> Result<(), Box<dyn Error>> {
    let spec = ObjectSpec::by_name(rest.first().unwrap_or(&"spring_clip"))?;
    let tray = match rest.get(2..4) {
        Some(&[x_mm, y_mm]) => tray_of([1e-3 * x_mm.parse::<f64>()?, 1e-3 * y_mm.parse::<f64>()?]),
        _ => tray(),
    };
    let num_cells: u32 = rest.get(1).map_or(Ok(tray.num_cells()), |text| text.parse())?;
    let placing = PlacingConfig { symmetry: spec.symmetry, ..PlacingConfig::default() };
    let mut lying: Vec<Isometry3<f64>> = Vec::new();
    let (mut num_right, mut worst, mut num_again) = (0, (0.0_f64, 0.0_f64), 0);
    for number in 1..=num_cells {
        let goal = tray.goal(number)?;
        let placed = place(cell(&spec, 100 + u64::from(number), &lying), at, &goal, &config(&spec), &placing);
        let (distance_m, angle_rad) = beside(&spec, &placed.base_from_object, &goal);
        let (distance_mm, angle_deg, moved_mm) = (distance_m * 1e3, angle_rad.to_degrees(), placed.moved_m * 1e3);
        let (why, peak_n, looks) = match &placed.report {
            Ok(report) => {
                let peak_n = report.touched.iter().map(|touched| touched.peak_n).fold(0.0, f64::max);
                (format!("{:?}", report.outcome), peak_n, report.errors.len())
            }
            Err(error) => return Err(format!("cell {number}: {error}").into()),
        };
        let is_placed = placed.report.as_ref().is_ok_and(|report| report.outcome.is_placed());
        let is_right =
            is_placed && distance_m <= MAX_BESIDE_M && angle_deg <= MAX_TURNED_DEG && placed.moved_m <= MAX_MOVED_M;
        println!(
            "cell {number}: {distance_mm:.2} mm, {angle_deg:.2}°, others moved {moved_mm:.2} mm, peak {peak_n:.1} N, {looks} looks, {why}"
        );
        num_right += u32::from(is_right);
        num_again += looks.saturating_sub(1);
        worst = (worst.0.max(distance_mm), worst.1.max(angle_deg));
        // A part that stayed in the hand is not an obstacle on the table.
        if placed.base_from_object.translation.z < spec.rest_height_m + MAX_OVER_REST_M {
            lying.push(placed.base_from_object);
        }
    }
    println!(
        "{}: {num_right} of {num_cells} right, at most {:.2} mm and {:.2}° beside, {num_again} taken again",
        spec.name, worst.0, worst.1
    );
    if num_right == num_cells { Ok(()) } else { Err("not every part is right".into()) }
}

fn other_heights(at: Where, rest: &[&str]) -> Result<(), Box<dyn Error>> {
    let num_attempts: u64 = rest.first().map_or(Ok(10), |text| text.parse())?;
    let first_seed: u64 = rest.get(1).map_or(Ok(101), |text| text.parse())?;
    let parts: Vec<&str> = if rest.len() > 2 { rest[2..].to_vec() } else { PARTS.to_vec() };
    let mut is_as_asked = true;
    for name in parts {
        let spec = ObjectSpec::by_name(name)?;
        for soft_approach in [Some(TouchDown::default()), None] {
            let config = GraspConfig { soft_approach, ..config(&spec) };
            let (mut num_held, mut static_n, mut peak_n, mut felt_n) = (0, 0.0_f64, 0.0_f64, 0.0_f64);
            for seed in first_seed..first_seed + num_attempts {
                let (report, is_lifted, felt) = grasp_on_other_table(cell(&spec, seed, &[]), at, HIGHER_M, &config);
                let is_held = report.as_ref().is_ok_and(|report| report.outcome.is_held()) && is_lifted;
                num_held += u64::from(is_held);
                felt_n = felt_n.max(felt);
                match &report {
                    Ok(report) => {
                        for touched in &report.touched {
                            (static_n, peak_n) = (static_n.max(touched.force_n), peak_n.max(touched.peak_n));
                        }
                        if !is_held {
                            println!("  {name} seed {seed}: {:?}, lifted {is_lifted}", report.outcome);
                        }
                    }
                    Err(error) => println!("  {name} seed {seed}: {error}"),
                }
            }
            let how = if soft_approach.is_some() { "softly" } else { "in joint positions" };
            let forces = match soft_approach {
                Some(_) => format!(", at rest at most {static_n:.1} N, peak {peak_n:.1} N"),
                None => String::new(),
            };
            println!(
                "{name} {how}: {num_held} of {num_attempts} held{forces}; the hand felt at most {felt_n:.1} N until it had closed"
            );
            if soft_approach.is_some() {
                is_as_asked &= num_held * 10 >= num_attempts * 8 && static_n < MAX_STATIC_N && peak_n < MAX_PEAK_N;
            }
        }
    }
    if is_as_asked { Ok(()) } else { Err("not as asked for".into()) }
}

//! Checks whether a hand follows its commands and reports its state correctly: `hand_checks HOST[:PORT] [WIDTH_MM]`.
//! With WIDTH_MM, an object of that width must be between the fingers.
//!
//! Prints a line for each check and ends with an error if any check fails.

use sdg_fci::client::{Hand, HandConfig};

/// Tolerance of the fingers' commanded position, m.
const TOLERANCE_M: f64 = 1.5e-3;
/// Speed of the fingers relative to each other, m/s.
const SPEED_M_S: f64 = 0.1;
const FORCE_N: f64 = 20.0;
/// Tolerance of a grasp below and above the commanded width, m.
const EPSILON_M: f64 = 0.005;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let host = arguments.next().ok_or("usage: hand_checks HOST[:PORT] [WIDTH_MM]")?;
    let width_mm: Option<f64> = arguments.next().map(|text| text.parse()).transpose()?;
    let mut hand = Hand::connect(&host, &HandConfig::default())?;
    let mut num_wrong = 0;
    let mut check = |is_right: bool, what: &str, found: String| {
        num_wrong += u32::from(!is_right);
        println!("{} hand: {what}: {found}", if is_right { "ok  " } else { "FAIL" });
    };

    let homed = hand.homing()?;
    let max_width_m = hand.read_state()?.max_width;
    check(homed && (max_width_m - 0.08).abs() < TOLERANCE_M, "homing finds 80 mm", format!("{max_width_m:.4} m"));
    hand.move_to(max_width_m, SPEED_M_S)?;
    let is_empty = width_mm.is_none();
    let told_m = if is_empty { 0.03 } else { 0.07 };
    let moved = hand.move_to(told_m, SPEED_M_S)?;
    let width_m = hand.read_state()?.width;
    let is_there = moved && (width_m - told_m).abs() < TOLERANCE_M;
    check(is_there, &format!("moves to {:.0} mm", told_m * 1e3), format!("{width_m:.4} m"));

    hand.move_to(max_width_m, SPEED_M_S)?;
    // With an object between the fingers, a grasp of its width succeeds, and a grasp of another width fails.
    let told_m = width_mm.map_or(0.03, |width_mm| width_mm * 1e-3);
    let grasped = hand.grasp(told_m, SPEED_M_S, FORCE_N, EPSILON_M, EPSILON_M)?;
    let state = hand.read_state()?;
    let found = format!("{grasped}, {:.4} m, is_grasped {}", state.width, state.is_grasped);
    let is_right = grasped != is_empty && state.is_grasped != is_empty;
    check(is_right, &format!("grasp of {:.0} mm", told_m * 1e3), found);
    hand.move_to(max_width_m, SPEED_M_S)?;
    let other_m = if told_m > 0.04 { told_m - 0.02 } else { told_m + 0.02 };
    let grasped = hand.grasp(other_m, SPEED_M_S, FORCE_N, EPSILON_M, EPSILON_M)?;
    check(!grasped, &format!("grasp of {:.0} mm without such an object", other_m * 1e3), grasped.to_string());

    let stopped = hand.stop()?;
    check(stopped, "stop", stopped.to_string());
    let opened = hand.move_to(max_width_m, SPEED_M_S)? && !hand.read_state()?.is_grasped;
    check(opened, "opens, and holds nothing", opened.to_string());
    if num_wrong > 0 {
        return Err(format!("{num_wrong} checks failed").into());
    }
    Ok(())
}

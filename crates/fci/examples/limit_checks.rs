//! Does a robot stop for every limit, and for nothing else? `limit_checks HOST panda|fr3 [TRIES]`.
//!
//! Runs one motion just inside and one just outside of every limit and prints a line for each; ends with an error where a
//! motion inside was stopped, or one outside was not, or for another reason. Against a robot in real time, each motion has
//! TRIES (1): a lost command may look like a broken limit.

#[path = "../tests/limit_cases/mod.rs"]
mod limit_cases;

use sdg_fci::client::{Robot, RobotConfig};
use sdg_fci::{Limits, RateLimits};

/// The FR3's limits, as franka-sim 1.1.7 checks them; its joint velocity limits shrink near the ends of the ranges.
const FR3: Limits = Limits {
    q_min: [-2.7501, -1.7918, -2.9065, -3.0481, -2.8101, 0.54092, -3.0196],
    q_max: [2.7501, 1.7918, 2.9065, -0.1458, 2.8101, 4.5205, 3.0196],
    velocity: [2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26],
    acceleration: [10.0; 7],
    jerk: [5000.0; 7],
    torque: [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0],
    torque_rate: 1000.0,
    translation: RateLimits { velocity: 3.0, acceleration: 9.0, jerk: 4500.0 },
    rotation: RateLimits { velocity: 2.5, acceleration: 17.0, jerk: 8500.0 },
    elbow: RateLimits { velocity: 1.5, acceleration: 10.0, jerk: 5000.0 },
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let usage = "usage: limit_checks HOST panda|fr3 [TRIES]";
    let host = arguments.next().ok_or(usage)?;
    let limits = match arguments.next().as_deref() {
        Some("panda") => Limits::PANDA,
        Some("fr3") => FR3,
        _ => return Err(usage.into()),
    };
    let num_tries: u32 = arguments.next().as_deref().unwrap_or("1").parse()?;
    let mut robot = Robot::connect(&host, &RobotConfig::default())?;
    let home = robot.read_state()?.q_desired;
    let mut num_wrong = 0;
    for case in limit_cases::all(&limits) {
        for is_inside in [true, false] {
            let mut tries = 0;
            let (found, is_right) = loop {
                let found = case.run(&mut robot, &home, is_inside)?;
                tries += 1;
                let is_right = case.is_expected(is_inside, &found);
                if is_right || tries >= num_tries {
                    break (found, is_right);
                }
            };
            num_wrong += u32::from(!is_right);
            let verdict = if is_right { "ok  " } else { "FAIL" };
            let side = if is_inside { "inside" } else { "outside" };
            println!("{verdict} {}, {side}: {found} (try {tries})", case.name);
        }
    }
    if num_wrong > 0 {
        return Err(format!("{num_wrong} motions were judged wrongly").into());
    }
    Ok(())
}

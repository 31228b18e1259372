//! Checks that a robot stops motions beyond its limits and no others: `limit_checks HOST panda|fr3 [TRIES [joints]]`.
//!
//! Runs one motion just inside and one just outside of each tested limit and prints a line for each. It ends with an
//! error if a motion inside was stopped, or if a motion outside was not stopped or was stopped for another reason. For
//! a robot in real time, TRIES (default 1) is the maximum number of attempts at each motion, because a lost command may
//! look like a violated limit. `joints` is for a robot that applies its joint limits to Cartesian motions: only those
//! limits are tested, and the arm is folded until it would touch itself.

#[path = "../tests/limit_cases/mod.rs"]
mod limit_cases;

use limit_cases::Found;
use sdg_fci::client::{Robot, RobotConfig};
use sdg_fci::{FciError, Limits, RobotError};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let usage = "usage: limit_checks HOST panda|fr3 [TRIES [joints]]";
    let host = arguments.next().ok_or(usage)?;
    let limits = match arguments.next().as_deref() {
        Some("panda") => Limits::PANDA,
        Some("fr3") => Limits::FR3,
        _ => return Err(usage.into()),
    };
    let num_tries: u32 = arguments.next().as_deref().unwrap_or("1").parse()?;
    let only_joints = match arguments.next().as_deref() {
        None => false,
        Some("joints") => true,
        Some(_) => return Err(usage.into()),
    };
    let mut robot = Robot::connect(&host, &RobotConfig::default())?;
    let home = if only_joints { limit_cases::READY } else { robot.read_state()?.q_desired };
    let mut num_wrong = 0;
    let mut tell = |is_right: bool, name: &str, is_inside: bool, found: &Found, num_tries: u32| {
        num_wrong += u32::from(!is_right);
        let verdict = if is_right { "ok  " } else { "FAIL" };
        let side = if is_inside { "inside" } else { "outside" };
        println!("{verdict} {name}, {side}: {found} (try {num_tries})");
    };
    if only_joints {
        let [inside, outside] = limit_cases::fold(&mut robot, &home)?;
        let touches = RobotError::SelfCollisionAvoidanceViolation;
        let is_stopped = matches!(&outside, Found::Stopped(errors) if errors.contains(touches));
        tell(inside == Found::Done, "self-collision", true, &inside, 1);
        tell(is_stopped, "self-collision", false, &outside, 1);
    }
    let cases = if only_joints { limit_cases::joints_of_cartesian_motions(&limits) } else { limit_cases::all(&limits) };
    for case in cases {
        for is_inside in [true, false] {
            let mut tries = 0;
            let (found, is_right) = loop {
                tries += 1;
                let found = match case.run(&mut robot, &home, is_inside) {
                    // The robot stopped on the path to the start of the motion.
                    Err(FciError::Motion { errors, .. }) if tries < num_tries => {
                        println!("     on the path to {}: {errors}", case.name);
                        robot.automatic_error_recovery()?;
                        continue;
                    }
                    ended => ended?,
                };
                let is_right = case.is_expected(is_inside, &found);
                if is_right || tries >= num_tries {
                    break (found, is_right);
                }
            };
            tell(is_right, case.name, is_inside, &found, tries);
        }
    }
    if num_wrong > 0 {
        return Err(format!("{num_wrong} motions did not end as expected").into());
    }
    Ok(())
}

//! Measures the timing of a client: `loop_times HOST [SECONDS]` swings a joint by 0.1 rad and prints, as one JSON
//! object, the client's answer times and the robot's rate of commands received in time.

use std::ops::ControlFlow;

use sdg_fci::client::{InternalController, Robot, RobotConfig};

/// Duration of one swing in both directions, s.
const SWING_SECS: f64 = 5.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let host = arguments.next().ok_or("usage: loop_times HOST [SECONDS]")?;
    let duration: f64 = arguments.next().as_deref().unwrap_or("60").parse()?;
    // Ends with a whole swing, at rest.
    let duration = (duration / SWING_SECS).ceil() * SWING_SECS;

    let mut robot = Robot::connect(&host, &RobotConfig::default())?;
    let start = robot.read_state()?.q_desired;
    let (mut secs, mut lowest_rate, mut sum_rates, mut num_rates) = (0.0, 1.0_f64, 0.0, 0);
    let result = robot.control_joint_positions(InternalController::JointImpedance, |state, step| {
        secs += step.as_secs_f64();
        // The success rate covers the last 100 cycles, at the start fewer.
        if secs > 0.1 {
            lowest_rate = lowest_rate.min(state.control_command_success_rate);
            sum_rates += state.control_command_success_rate;
            num_rates += 1;
        }
        let mut q = start;
        q[0] += 0.05 * (1.0 - (std::f64::consts::TAU * secs / SWING_SECS).cos());
        if secs < duration { ControlFlow::Continue(q) } else { ControlFlow::Break(start) }
    });
    let error = result.err().map_or("null".to_owned(), |error| format!("{:?}", error.to_string()));
    let statistics = robot.statistics();
    let micros = |share: f64| statistics.answer_time(share).as_micros();
    println!(
        "{{\"version\": {}, \"robot_secs\": {secs:.3}, \"answers\": {}, \"skipped\": {}, \"mean_rate\": {:.4}, \"lowest_rate\": {:.2}, \
         \"answer_us\": {{\"median\": {}, \"p99.9\": {}, \"max\": {}}}, \"max_gap_ms\": {:.1}, \"stalls_over_20_ms\": {}, \"error\": {error}}}",
        robot.version().number(),
        statistics.num_answers,
        statistics.num_skipped,
        sum_rates / f64::from(num_rates.max(1)),
        lowest_rate,
        micros(0.5),
        micros(0.999),
        micros(1.0),
        statistics.max_gap.as_secs_f64() * 1e3,
        statistics.num_stalls,
    );
    Ok(())
}

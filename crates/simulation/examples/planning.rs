//! Measures planning on random problems: `planning rate`, `planning proof [COUNT] [FIRST_SEED]`, `planning checks
//! [COUNT] [FIRST_SEED]`, `planning length [COUNT] [FIRST_SEED] [SECONDS]`, `planning serve`.
//!
//! - `rate`: configurations that the collision model checks per second on one core.
//! - `proof`: plans COUNT problems, computes the motion along each path at Franka's full limits, and checks the motion
//!   for collisions in MuJoCo at steps of 1 ms. It prints the largest fraction of each limit of the joints (velocity,
//!   acceleration, jerk, torque by MuJoCo's inverse dynamics) and of the tcp (velocity, acceleration, jerk). For plans
//!   that are not straight, it also compares the duration with others, such as the duration with a stop at every
//!   waypoint and the duration without a jerk limit.
//!
//! - `checks`: number of configurations that the search checks until it reaches one given goal configuration. Checks
//!   for shortening the path are not counted. Other planners are measured in the same way
//!   (benches/peers/ompl_planning.py).
//! - `length`: the duration of a plan compared with the best duration found in SECONDS (60) of processor time: the same
//!   planner is repeated with other seeds, with 8 instead of 12 searches, and with fifty times as many attempts to
//!   shorten the path. It uses COUNT (50) problems whose goal cannot be reached by a straight motion.
//!
//! `rate` and `proof` measure the time by the clock and the thread's processor time. The processor time, as Linux
//! reports it, does not depend on other programs on the machine.
//! - `serve`: answers collision checks on standard input, for other planners (benches/peers/ompl_planning.py). The
//!   input is a problem's seed as u64 (u64::MAX ends the program), which is answered by the start and goal
//!   configurations (14 f64). Any number of configurations (7 f64) follow, each answered by a byte (1 is free), until a
//!   configuration of seven NaN. All numbers are little-endian.

use std::error::Error;
use std::io::{Read, Write};
use std::time::Instant;

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_kinematics::collision::Checker;
use sdg_kinematics::dynamics::ArmDynamics;
use sdg_kinematics::planning::{Plan, PlanOptions};
use sdg_kinematics::{
    ArmGeometry, CartesianLimits, HAND_OPENING_MAX_M, JointLimits, JointVector, RoundedPath, Trajectory,
};
use sdg_simulation::{CollisionWorld, InverseDynamics, PlanningProblem};

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |place: usize, default: u64| args.get(place).map_or(Ok(default), |text| text.parse());
    match args.first().map(String::as_str) {
        Some("rate") => rate(),
        Some("proof") => proof(number(1, 1000)?, number(2, 0)?),
        Some("checks") => checks(number(1, 300)?, number(2, 0)?),
        Some("length") => length(number(1, 50)?, number(2, 0)?, number(3, 60)?),
        Some("serve") => serve(),
        _ => Err("expected rate, proof [COUNT] [FIRST_SEED], checks [COUNT] [FIRST_SEED], length [COUNT] [FIRST_SEED] [SECONDS] or serve".into()),
    }
}

/// Measures time by the clock and by this thread's processor time.
struct Stopwatch {
    started: Instant,
    processor_ms: f64,
}

impl Stopwatch {
    fn start() -> Self {
        Self { started: Instant::now(), processor_ms: processor_ms() }
    }

    /// Time by the clock and by the processor, ms.
    fn elapsed_ms(&self) -> [f64; 2] {
        [self.started.elapsed().as_secs_f64() * 1e3, processor_ms() - self.processor_ms]
    }
}

/// Processor time of this thread, ms; NaN if Linux does not report it.
fn processor_ms() -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok())
        .map_or(f64::NAN, |nanoseconds| nanoseconds * 1e-6)
}

/// Measures the rate of collision checks of random configurations among eight obstacles.
fn rate() -> Result<(), Box<dyn Error>> {
    const COUNT: usize = 200_000;
    let problem =
        (0..).map(PlanningProblem::random).find(|problem| problem.obstacles.len() == 8).ok_or("no problem")?;
    let limits = JointLimits::panda();
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let configurations: Vec<JointVector> = (0..COUNT)
        .map(|_| JointVector::from_fn(|i, _| rng.random_range(limits.position_min[i]..limits.position_max[i])))
        .collect();
    let watch = Stopwatch::start();
    let distances = Checker::new(&problem.model, 0.003).distances_m(&configurations);
    let [clock, processor] = watch.elapsed_ms().map(|ms| COUNT as f64 / ms * 1e3);
    let num_free = distances.iter().filter(|distance| **distance > 0.0).count();
    println!(
        "configurations a second among 8 obstacles on one core: {processor:.0} by the processor's time, {clock:.0} by the clock \
         ({num_free} of {COUNT} free)"
    );
    Ok(())
}

/// The largest fraction of each limit over all milliseconds of a motion.
#[derive(Debug, Default)]
struct Shares {
    largest: [f64; 7],
}

impl Shares {
    const NAMES: [&str; 7] =
        ["velocity", "acceleration", "jerk", "torque", "tcp velocity", "tcp acceleration", "tcp jerk"];

    /// Checks every millisecond of a motion.
    fn look_at(&mut self, motion: &Trajectory, mujoco: &mut InverseDynamics) -> Result<(), Box<dyn Error>> {
        let (panda, joints, tcp) = (ArmGeometry::panda(), JointLimits::panda(), CartesianLimits::panda());
        let share = |values: &JointVector, limits: &JointVector| values.abs().component_div(limits).max();
        let (mut ddq_before, mut twists) = (JointVector::zeros(), Vec::new());
        for step in 0..=(motion.duration_secs() * 1e3).ceil() as usize {
            let (q, dq, ddq) = motion.sample(step as f64 * 1e-3);
            let jerk = (ddq - ddq_before) * 1e3;
            ddq_before = ddq;
            twists.push(panda.jacobian(&q) * dq);
            let difference = |order: usize| -> (f64, f64) {
                let Some(last) = twists.len().checked_sub(order + 1) else { return (0.0, 0.0) };
                let value = match order {
                    0 => twists[last],
                    1 => (twists[last + 1] - twists[last]) * 1e3,
                    _ => (twists[last + 2] - twists[last + 1] * 2.0 + twists[last]) * 1e6,
                };
                (value.fixed_rows::<3>(0).norm(), value.fixed_rows::<3>(3).norm())
            };
            let [speed, acceleration, tcp_jerk] = [difference(0), difference(1), difference(2)];
            let found = [
                share(&dq, &joints.velocity_max),
                share(&ddq, &joints.acceleration_max),
                share(&jerk, &joints.jerk_max),
                share(&mujoco.torques_nm(&q, &dq, &ddq)?, &joints.torque_max),
                (speed.0 / tcp.velocity_m_s).max(speed.1 / tcp.angular_velocity_rad_s),
                (acceleration.0 / tcp.acceleration_m_s2).max(acceleration.1 / tcp.angular_acceleration_rad_s2),
                (tcp_jerk.0 / tcp.jerk_m_s3).max(tcp_jerk.1 / tcp.angular_jerk_rad_s3),
            ];
            for (largest, found) in self.largest.iter_mut().zip(found) {
                *largest = largest.max(found);
            }
        }
        Ok(())
    }
}

/// Durations of the plans that are not straight.
#[derive(Debug, Default)]
struct Bent {
    num_corners: usize,
    num_stops: usize,
    secs: Vec<f64>,
    /// Duration of the motion divided by the duration with a stop at every waypoint.
    over_stopping: Vec<f64>,
    /// Duration divided by the duration without a jerk limit.
    over_jerkless: Vec<f64>,
    /// Duration divided by the duration with the largest corners that fit on the straight parts, even if they collide.
    over_largest_corners: Vec<f64>,
    /// Duration divided by the duration with a stop at every waypoint and only the joints' velocity, acceleration and
    /// jerk limits.
    over_point_to_point: Vec<f64>,
}

impl Bent {
    fn look_at(&mut self, plan: &Plan, motions: &[Trajectory], dynamics: &ArmDynamics) -> Result<(), Box<dyn Error>> {
        let (joints, tcp) = (JointLimits::panda(), CartesianLimits::panda());
        let secs: f64 = motions.iter().map(Trajectory::duration_secs).sum();
        let jerkless: f64 = motions.iter().filter_map(Trajectory::without_jerk_limit_secs).sum();
        let lengths: Vec<f64> =
            plan.waypoints.windows(2).map(|pair| RoundedPath::new(pair, &[]).length_secs()).collect();
        let last = lengths.len() - 1;
        let room = |index: usize| lengths[index] * if index == 0 || index == last { 1.0 } else { 0.5 };
        let rooms: Vec<f64> = (0..last).map(|index| room(index).min(room(index + 1))).collect();
        let largest = RoundedPath::new(&plan.waypoints, &rooms);
        let largest = Trajectory::along_rounded_path(largest, &joints, &tcp, dynamics)?;
        self.over_largest_corners.push(secs / largest.duration_secs());
        let mut point_to_point = 0.0;
        for pair in plan.waypoints.windows(2) {
            point_to_point += Trajectory::point_to_point(&pair[0], &pair[1], &joints)?.duration_secs();
        }
        self.num_corners += plan.waypoints.len() - 2;
        self.num_stops += motions.len() - 1;
        self.secs.push(secs);
        self.over_stopping.push(secs / plan.stopping_secs(&joints, &tcp, dynamics)?);
        self.over_jerkless.push(secs / jerkless);
        self.over_point_to_point.push(secs / point_to_point);
        Ok(())
    }

    fn print(&mut self) {
        println!(
            "{} plans are not straight: {} inner waypoints, {} of them stops",
            self.secs.len(),
            self.num_corners,
            self.num_stops
        );
        print_spread("their time, s", &mut self.secs, 3);
        print_spread("their time over that with stops, same limits", &mut self.over_stopping, 4);
        print_spread("their time over that with the largest corners, free or not", &mut self.over_largest_corners, 4);
        print_spread(
            "their time over that with stops, joints' limits without torques alone",
            &mut self.over_point_to_point,
            4,
        );
        print_spread("their time over that without a limit of the jerk", &mut self.over_jerkless, 4);
    }
}

fn print_spread(name: &str, values: &mut [f64], digits: usize) {
    values.sort_by(f64::total_cmp);
    let at =
        |share: f64| values.get(((values.len() as f64 - 1.0) * share).round() as usize).copied().unwrap_or(f64::NAN);
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let [least, median, p99, most] = [0.0, 0.5, 0.99, 1.0].map(at);
    println!(
        "{name}: least {least:.digits$}, median {median:.digits$}, mean {mean:.digits$}, 99 % {p99:.digits$}, most {most:.digits$}"
    );
}

fn proof(count: u64, first_seed: u64) -> Result<(), Box<dyn Error>> {
    let (panda, limits) = (ArmGeometry::panda(), JointLimits::panda());
    let dynamics = ArmDynamics::new(&ArmGeometry::panda(), HAND_OPENING_MAX_M);
    let mut mujoco = InverseDynamics::new(HAND_OPENING_MAX_M)?;
    let (mut millis, mut timing_millis) = (Vec::new(), Vec::new());
    let (mut search_checks, mut all_checks) = (Vec::new(), Vec::new());
    let (mut num_colliding, mut num_steps, mut num_at_torque) = (0, 0, 0);
    let mut timing_processor_ms = 0.0;
    let (mut shares, mut bent) = (Shares::default(), Bent::default());
    for seed in first_seed..first_seed + count {
        let problem = PlanningProblem::obstructed(seed);
        let options = PlanOptions::default();
        let watch = Stopwatch::start();
        let planned = panda.plan(&problem.model, &problem.start, &[problem.base_from_goal], None, &options);
        let [_, processor_ms] = watch.elapsed_ms();
        let plan = match planned {
            Ok(plan) => plan,
            Err(error) => {
                println!("problem {seed}: {error} ({processor_ms:.0} ms)");
                continue;
            }
        };
        millis.push(processor_ms);
        search_checks.push(plan.num_search_checks as f64);
        all_checks.push(plan.num_checks as f64);
        let watch = Stopwatch::start();
        let motions = plan.trajectories(&limits, &CartesianLimits::panda(), &dynamics)?;
        // Linux may count processor time in steps longer than one timing; the sum is still correct.
        let [clock_ms, processor_ms] = watch.elapsed_ms();
        timing_millis.push(clock_ms);
        timing_processor_ms += processor_ms;
        if plan.waypoints.len() > 2 {
            bent.look_at(&plan, &motions, &dynamics)?;
        }
        let mut world = CollisionWorld::new(&problem.obstacles, HAND_OPENING_MAX_M)?;
        let mut deepest = None;
        for motion in &motions {
            let mut here = Shares::default();
            here.look_at(motion, &mut mujoco)?;
            num_at_torque += usize::from(here.largest[3] > 0.99);
            for (index, share) in here.largest.into_iter().enumerate() {
                shares.largest[index] = shares.largest[index].max(share);
                if share > 1.0 + MAX_EXCESS {
                    println!("problem {seed}: {share:.4} of the limit of {}", Shares::NAMES[index]);
                }
            }
            for step in 0..=(motion.duration_secs() * 1e3).ceil() as usize {
                num_steps += 1;
                if let Some(overlap) = world.deepest(&motion.sample(step as f64 * 1e-3).0)? {
                    deepest = Some(overlap);
                }
            }
        }
        if let Some(overlap) = deepest {
            num_colliding += 1;
            println!("problem {seed}: MuJoCo finds {overlap:?}");
        }
    }
    println!(
        "{} of {count} found; {num_colliding} motions collide in MuJoCo at {num_steps} steps of 1 ms",
        millis.len()
    );
    print_spread("processor's ms of planning", &mut millis, 1);
    print_spread("ms of timing by the clock", &mut timing_millis, 2);
    println!("processor's ms of timing: mean {:.2}", timing_processor_ms / millis.len() as f64);
    print_spread("checks before shortening", &mut search_checks, 0);
    print_spread("checks in all", &mut all_checks, 0);
    for (name, share) in Shares::NAMES.iter().zip(shares.largest) {
        println!("most of the limit of {name}: {share:.4}");
    }
    println!("motions with more than 0.99 of a torque limit: {num_at_torque}");
    bent.print();
    Ok(())
}

fn checks(count: u64, first_seed: u64) -> Result<(), Box<dyn Error>> {
    let panda = ArmGeometry::panda();
    // Only one search: further searches look for shorter paths and are not counted.
    let mut options = PlanOptions::default();
    options.num_searches = 1;
    let mut checks = Vec::new();
    for seed in first_seed..first_seed + count {
        let problem = PlanningProblem::obstructed(seed);
        match panda.plan_to(&problem.model, &problem.start, &[problem.goal], &options) {
            Ok(plan) => checks.push(plan.num_search_checks),
            Err(error) => println!("problem {seed}: {error}"),
        }
    }
    checks.sort_unstable();
    let at = |share: f64| checks.get(((checks.len() as f64 - 1.0) * share).round() as usize).copied().unwrap_or(0);
    println!(
        "{} of {count} found; checks before shortening, one configuration of the goal: median {}, mean {:.0}, 90 % {}, 99 % {}, most {}",
        checks.len(),
        at(0.5),
        checks.iter().sum::<usize>() as f64 / checks.len() as f64,
        at(0.9),
        at(0.99),
        at(1.0)
    );
    Ok(())
}

/// Largest excess over a limit that is not reported, as a fraction of the limit.
const MAX_EXCESS: f64 = 1e-3;

fn length(count: u64, first_seed: u64, seconds: u64) -> Result<(), Box<dyn Error>> {
    const MAX_RATIO: f64 = 1.3;
    let panda = ArmGeometry::panda();
    let mut ratios = Vec::new();
    for seed in first_seed.. {
        if ratios.len() as u64 == count {
            break;
        }
        let problem = PlanningProblem::obstructed(seed);
        let plan = |options: &PlanOptions| {
            panda.plan(&problem.model, &problem.start, &[problem.base_from_goal], None, options)
        };
        let Ok(first) = plan(&PlanOptions::default()) else { continue };
        if first.waypoints.len() == 2 {
            continue;
        }
        let mut best_secs = first.cost_secs[1];
        let watch = Stopwatch::start();
        let mut num_plans = 0;
        while watch.elapsed_ms()[1] < seconds as f64 * 1e3 {
            num_plans += 1;
            let mut options = PlanOptions::default();
            (options.seed, options.num_searches, options.num_shortcuts) = (num_plans, 8, 6000);
            if let Ok(plan) = plan(&options) {
                best_secs = best_secs.min(plan.cost_secs[1]);
            }
        }
        let ratio = first.cost_secs[1] / best_secs;
        println!(
            "problem {seed}: {:.2} s, best of {num_plans} plans {best_secs:.2} s, ratio {ratio:.3}",
            first.cost_secs[1]
        );
        ratios.push(ratio);
    }
    ratios.sort_by(f64::total_cmp);
    let within = ratios.iter().filter(|ratio| **ratio <= MAX_RATIO).count();
    let [median, max] = [ratios[ratios.len() / 2], ratios[ratios.len() - 1]];
    println!("at most {MAX_RATIO} times the best in {within} of {}; median {median:.3}, most {max:.3}", ratios.len());
    Ok(())
}

fn serve() -> Result<(), Box<dyn Error>> {
    let (mut input, mut output) = (std::io::stdin().lock(), std::io::stdout().lock());
    loop {
        let mut seed = [0; 8];
        input.read_exact(&mut seed)?;
        let seed = u64::from_le_bytes(seed);
        if seed == u64::MAX {
            return Ok(());
        }
        let problem = PlanningProblem::obstructed(seed);
        for number in problem.start.iter().chain(problem.goal.iter()) {
            output.write_all(&number.to_le_bytes())?;
        }
        output.flush()?;
        let mut checker = Checker::new(&problem.model, PlanOptions::default().margin_m);
        loop {
            let mut bytes = [0; 56];
            input.read_exact(&mut bytes)?;
            let q = JointVector::from_fn(|i, _| {
                f64::from_le_bytes(bytes[8 * i..8 * i + 8].try_into().expect("eight bytes a number"))
            });
            if q.iter().all(|x| x.is_nan()) {
                break;
            }
            output.write_all(&[u8::from(checker.is_free(&q))])?;
            output.flush()?;
        }
    }
}

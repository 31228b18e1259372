//! Grasps over the network with wrong perception, lost packets, late pictures and a wrong table height. The robot's
//! limits are checked in every step of MuJoCo.
//!
//! `cargo run --release -p sdg-simulation --example endured_attempts [ATTEMPTS] [FIRST_SEED] [MAX_SECS]`
//!
//! ```text
//! sequence ─ FrankaArm ─ relay that loses ─ server in lockstep ─ Probed: limits, at every step ─ PandaPlant (MuJoCo)
//! ```
//!
//! Ends with an error if a limit is violated, or if an attempt ends without a reason in one line.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, SMatrix, Translation3, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_fci::server::{Jacobian, JointVector, Observation, Pace, Plant, Server, ServerConfig};
use sdg_kinematics::{ArmGeometry, JointLimits};
use sdg_robot::{
    FrankaArm, GraspConfig, GraspOutcome, GraspTarget, PartFinder, Robot, SafetyLimits, Watch, WorkspaceBox, grasp,
};
use sdg_simulation::objects::ObjectSpec;
use sdg_simulation::{PandaPlant, Workcell};

#[path = "../tests/network/mod.rs"]
mod network;

type Failure = Box<dyn std::error::Error>;

/// Number of steps over which velocities are differentiated to accelerations and jerks, because MuJoCo's contact forces
/// change from step to step.
const WINDOW: usize = 10;
/// External torque up to which the arm counts as untouched, N·m.
const UNTOUCHED_NM: f64 = 1.0;
/// Tolerance of velocities, accelerations, jerks, torques and contact times, as a fraction of the limit: a joint
/// controlled by torques does not follow its reference exactly.
const TOLERANCE: f64 = 0.05;
/// Tolerance of joint positions and of the workspace, as a fraction of half of the range: at most 29 mrad or 5.5 mm.
const RANGE_TOLERANCE: f64 = 0.01;
/// External torques at which a Franka stops in motions that may touch the table, N·m.
const CONTACT_TORQUE_NM: [f64; 7] = [40.0, 40.0, 36.0, 36.0, 32.0, 28.0, 24.0];
const MAX_CONTACT_SECS: f64 = 0.3;
/// The allowed workspace of the hand; the paths to some of the given poses lead out of it.
const WORKSPACE: WorkspaceBox =
    WorkspaceBox { min_m: Vector3::new(0.05, -0.55, -0.05), max_m: Vector3::new(0.68, 0.55, 0.95) };

/// The largest measured fraction of each limit, and its time.
type Shares = BTreeMap<&'static str, Largest>;

#[derive(Debug, Clone, Copy, Default)]
struct Largest {
    share: f64,
    /// Time since the start of the simulation, s.
    time_secs: f64,
    /// Time since the last external torque above `UNTOUCHED_NM`, s.
    untouched_secs: f64,
}

/// The simulated robot, with measurements of its motion relative to its limits.
struct Probed {
    plant: PandaPlant,
    limits: JointLimits,
    panda: ArmGeometry,
    /// The joint velocities of the last [`WINDOW`] steps.
    velocities: Vec<JointVector>,
    accelerations: Vec<JointVector>,
    contact_secs: f64,
    time_secs: f64,
    untouched_secs: f64,
    shares: Arc<Mutex<Shares>>,
}

impl Probed {
    fn new(plant: PandaPlant, shares: Arc<Mutex<Shares>>) -> Self {
        let panda = ArmGeometry::panda();
        let (velocities, accelerations) = (Vec::new(), Vec::new());
        let limits = panda.limits.clone();
        let (contact_secs, time_secs, untouched_secs) = (0.0, 0.0, f64::INFINITY);
        Self { plant, limits, panda, velocities, accelerations, contact_secs, time_secs, untouched_secs, shares }
    }

    fn look(&mut self, torque: &JointVector) {
        let Observation { q, dq, contact_torque, .. } = self.plant.observe();
        self.time_secs += 1e-3;
        let is_touched = contact_torque.amax() > UNTOUCHED_NM;
        self.untouched_secs = if is_touched { 0.0 } else { self.untouched_secs + 1e-3 };
        let (time_secs, untouched_secs) = (self.time_secs, self.untouched_secs);
        let mut shares = self.shares.lock().unwrap_or_else(PoisonError::into_inner);
        let mut most = |what: &'static str, share: f64| {
            let found = shares.entry(what).or_default();
            // A NaN counts as a violated limit, and is kept.
            if share > found.share || share.is_nan() {
                *found = Largest { share, time_secs, untouched_secs };
            }
        };
        let share = |values: &JointVector, limits: &JointVector| values.component_div(limits).amax();
        let limits = &self.limits;
        // The distance from the centre of a range, as a fraction of half of the range.
        let [middle, half] = [limits.position_max + limits.position_min, limits.position_max - limits.position_min];
        most("position of joints", share(&(q - middle / 2.0), &(half / 2.0)));
        most("velocity of joints", share(&dq, &limits.velocity_max));
        most("torque of joints", share(torque, &limits.torque_max));
        let pushed = (0..7).map(|joint| contact_torque[joint].abs() / CONTACT_TORQUE_NM[joint]).fold(0.0, f64::max);
        self.contact_secs = if pushed > 1.0 { self.contact_secs + 1e-3 } else { 0.0 };
        most("time of a contact above its force", self.contact_secs / MAX_CONTACT_SECS);
        let tcp = self.panda.forward(&q).translation.vector;
        let [middle, half] = [WORKSPACE.max_m + WORKSPACE.min_m, WORKSPACE.max_m - WORKSPACE.min_m];
        most("workspace", (tcp - middle / 2.0).component_div(&(half / 2.0)).amax());

        if is_touched {
            self.velocities.clear();
            self.accelerations.clear();
        }
        let window_secs = WINDOW as f64 * 1e-3;
        self.velocities.push(dq);
        if self.velocities.len() > WINDOW {
            let acceleration = (dq - self.velocities.remove(0)) / window_secs;
            most("acceleration of joints", share(&acceleration, &limits.acceleration_max));
            self.accelerations.push(acceleration);
            if self.accelerations.len() > WINDOW {
                let jerk = (acceleration - self.accelerations.remove(0)) / window_secs;
                most("jerk of joints", share(&jerk, &limits.jerk_max));
            }
        }
    }
}

impl Plant for Probed {
    fn observe(&mut self) -> Observation {
        self.plant.observe()
    }

    fn flange(&self, q: &JointVector) -> (Isometry3<f64>, Jacobian) {
        self.plant.flange(q)
    }

    fn step(&mut self, torque: &SMatrix<f64, 7, 1>) -> Result<(), String> {
        self.plant.step(torque)?;
        self.look(torque);
        Ok(())
    }

    fn move_hand(&mut self, width_m: f64, speed_m_s: f64, force_n: f64) {
        self.plant.move_hand(width_m, speed_m_s, force_n);
    }

    fn hand_width(&self) -> (f64, f64) {
        self.plant.hand_width()
    }
}

/// The errors of an attempt.
#[derive(Debug, Clone, Copy)]
struct Errors {
    /// Offset of the given pose from the true pose, m, and its rotation about the vertical, rad.
    beside_m: Vector3<f64>,
    turned_rad: f64,
    /// Difference of the given width of the part from the true one, m.
    wider_m: f64,
    picture_age_secs: f64,
    table_m: f64,
    /// Probability for each state and for each command that losses begin: [`Self::lost_in_a_row`] states or commands in
    /// a row are then lost.
    lost: f64,
    lost_in_a_row: u64,
}

impl Errors {
    /// The errors of a seed: one of five kinds, or all of them together.
    fn of(seed: u64) -> (&'static str, Self) {
        let random = &mut Pcg64Mcg::seed_from_u64(seed ^ 0x454e_4455_5245);
        let mut between = |low: f64, high: f64| random.random_range(low..high);
        let all = Self {
            beside_m: Vector3::new(between(-0.06, 0.06), between(-0.06, 0.06), between(-0.03, 0.03)),
            turned_rad: between(-1.5, 1.5),
            wider_m: between(-0.01, 0.04),
            picture_age_secs: between(0.0, 2.0),
            table_m: between(-0.02, 0.02),
            lost: between(0.0, 0.0005),
            lost_in_a_row: between(1.0, 23.0) as u64,
        };
        let none = Self {
            beside_m: Vector3::zeros(),
            turned_rad: 0.0,
            wider_m: 0.0,
            picture_age_secs: 0.0,
            table_m: 0.0,
            lost: 0.0,
            lost_in_a_row: 1,
        };
        match seed % 6 {
            0 => ("a wrong place", Self { beside_m: all.beside_m, turned_rad: all.turned_rad, ..none }),
            1 => ("a wrong width", Self { wider_m: all.wider_m, ..none }),
            2 => ("late pictures", Self { picture_age_secs: all.picture_age_secs, ..none }),
            3 => ("a wrong table", Self { table_m: all.table_m, ..none }),
            4 => ("lost packets", Self { lost: all.lost, lost_in_a_row: all.lost_in_a_row, ..none }),
            _ => ("all of it", all),
        }
    }

    /// Returns a function that is called for each datagram in order, and decides whether the datagram is lost.
    fn loses(self, seed: u64) -> impl FnMut() -> bool + Send + 'static {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut left = 0_u64;
        move || {
            if left == 0 && random.random_bool(self.lost) {
                left = self.lost_in_a_row;
            }
            let is_lost = left > 0;
            left = left.saturating_sub(1);
            is_lost
        }
    }
}

/// Perception that returns the true pose with the errors of an attempt.
struct Wrong(network::Twin, Errors);

impl PartFinder<FrankaArm> for Wrong {
    fn find(&mut self, arm: &mut FrankaArm) -> sdg_robot::Result<Option<GraspTarget>> {
        let Self(twin, errors) = self;
        let target = twin.find(arm)?;
        Ok(target.map(|target| GraspTarget {
            base_from_tcp: Translation3::from(errors.beside_m)
                * target.base_from_tcp
                * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), errors.turned_rad),
            jaw_width_m: (target.jaw_width_m + errors.wider_m).max(0.002),
            ..target
        }))
    }

    fn picture_time(&self) -> Option<Instant> {
        Instant::now().checked_sub(Duration::from_secs_f64(self.1.picture_age_secs))
    }
}

/// The outcome of an attempt: `held`, or the failed step or the error, with the reason.
fn attempt(seed: u64, errors: Errors, shares: &Arc<Mutex<Shares>>) -> Result<String, Failure> {
    let parts: Vec<&str> = ObjectSpec::names().collect();
    let cell = network::cell(parts[seed as usize / 6 % parts.len()], seed);
    let plant = PandaPlant::with_positions(cell.config(), cell.data().qpos())?;
    let positions = plant.positions();
    // The server waits so long for a command that a command delayed by a busy machine does not count as lost.
    let pace = if errors.lost > 0.0 { Pace::Lockstep { max_wait: Duration::from_millis(200) } } else { Pace::LOCKSTEP };
    let config = ServerConfig { robot_port: 0, hand_port: 0, pace, ..ServerConfig::default() };
    let server = Server::start(Probed::new(plant, shares.clone()), &config)?;
    let (mut loses_state, mut loses_command) = (errors.loses(seed), errors.loses(!seed));
    let change = move |_, state: &_| if loses_state() { Vec::new() } else { vec![network::relay::unchanged(state)] };
    let mut arm = network::relay::connect(&server, Box::new(change), Box::new(move |_| !loses_command()))?;
    let mount = cell.wrist_camera();
    let limits =
        SafetyLimits { workspace: Some(WORKSPACE), table_height_m: errors.table_m, ..Workcell::safety_limits() };
    let mut robot = Robot::new(&mut arm, limits, Watch::default());
    let mut finder = Wrong(network::Twin { cell, positions }, errors);
    let ended = match grasp(&mut robot, &mut finder, &mut (), mount, &GraspConfig::default()) {
        Ok(report) => match report.outcome {
            GraspOutcome::Held => "held".to_owned(),
            GraspOutcome::Failed { step, why } => format!("{step}: {why}"),
        },
        Err(error) => format!("stopped: {error}"),
    };
    drop(arm);
    server.stop()?;
    Ok(ended)
}

fn main() -> Result<(), Failure> {
    let mut arguments = std::env::args().skip(1);
    let num_attempts: u64 = arguments.next().map_or(Ok(1000), |n| n.parse())?;
    let first_seed: u64 = arguments.next().map_or(Ok(0), |n| n.parse())?;
    let max_secs: u64 = arguments.next().map_or(Ok(u64::MAX), |n| n.parse())?;
    let (begun, mut shares) = (Instant::now(), BTreeMap::new());
    // For each kind of error: number of attempts, held, failed at a step, stopped.
    let mut counts: BTreeMap<&str, [u32; 4]> = BTreeMap::new();
    let mut faults = Vec::new();
    for seed in first_seed..first_seed + num_attempts {
        if begun.elapsed().as_secs() >= max_secs {
            println!("ended after {max_secs} s, before seed {seed}");
            break;
        }
        let (kind, errors) = Errors::of(seed);
        let of_attempt = Arc::new(Mutex::new(Shares::new()));
        let ended = attempt(seed, errors, &of_attempt)?;
        println!("{seed}: {kind}: {ended}");
        for (what, largest) in of_attempt.lock().unwrap_or_else(PoisonError::into_inner).iter() {
            let Largest { share, time_secs, untouched_secs } = largest;
            let most: &mut f64 = shares.entry(*what).or_default();
            *most = most.max(*share);
            let tolerance =
                if ["position of joints", "workspace"].contains(what) { RANGE_TOLERANCE } else { TOLERANCE };
            if share.is_nan() || *share > 1.0 + tolerance {
                let fault = format!(
                    "{seed}: {kind}: {ended}: the limit of the {what} is broken: {share:.3} at {time_secs:.3} s, \
                     {untouched_secs:.3} s after the last contact"
                );
                println!("  {fault}");
                faults.push(fault);
            }
        }
        let count = counts.entry(kind).or_default();
        count[0] += 1;
        count[if ended == "held" {
            1
        } else if ended.starts_with("stopped") {
            3
        } else {
            2
        }] += 1;
        // The robot reports a command that violates a limit. It also reports too many lost packets, which are
        // expected here.
        let is_broken = ended.replace("communication_constraints_violation", "");
        if ended.trim().is_empty()
            || ended.contains('\n')
            || is_broken.contains("violation")
            || is_broken.contains("discontinuity")
        {
            faults.push(format!("{seed}: {kind}: {ended}"));
        }
    }
    println!("\n| what is wrong | attempts | held | failed at a step | stopped |\n|---|--:|--:|--:|--:|");
    for (kind, [all, held, failed, stopped]) in counts {
        println!("| {kind} | {all} | {held} | {failed} | {stopped} |");
    }
    println!("\n| limit | largest share in MuJoCo |\n|---|--:|");
    for (what, share) in &shares {
        println!("| {what} | {:.1} % |", share * 100.0);
    }
    if faults.is_empty() { Ok(()) } else { Err(faults.join("\n").into()) }
}

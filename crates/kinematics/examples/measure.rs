//! Prints results and computation times of this crate: `cargo run --release -p sdg-kinematics --example measure`.

use std::f64::consts::PI;
use std::time::Instant;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_kinematics::{
    Approach, ArmGeometry, CartesianLimits, GraspSymmetry, IkOptions, JointLimits, JointVector, LineOptions,
    Trajectory, ready_pose,
};

const NUM: usize = 2000;

fn main() {
    let panda = ArmGeometry::panda();
    let limits = JointLimits::panda();
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    let mut random_configuration =
        || JointVector::from_fn(|i, _| rng.random_range(limits.position_min[i]..limits.position_max[i]));

    let poses: Vec<_> = (0..NUM).map(|_| panda.forward(&random_configuration())).collect();
    measure_inverse("poses of random configurations", &panda, &poses);

    let mut rng = Pcg64Mcg::seed_from_u64(2);
    let grasps: Vec<_> = (0..NUM)
        .map(|_| {
            let place = [rng.random_range(0.3..0.7), rng.random_range(-0.35..0.35), rng.random_range(0.0..0.6)];
            top_grasp(place, rng.random_range(-PI..PI))
        })
        .collect();
    measure_inverse("top grasps, x .3-.7, y ±.35, z 0-.6", &panda, &grasps);

    let started = Instant::now();
    let mut sum = 0.0;
    for _ in 0..NUM {
        let (pose, jacobian) = panda.forward_and_jacobian(&random_configuration());
        sum += pose.translation.x + jacobian[(0, 0)];
    }
    println!("forward and Jacobian: {:?} each (checksum {sum:.3})", started.elapsed() / NUM as u32);

    measure_approaches(&panda, &grasps);

    let started = Instant::now();
    let mut seconds = 0.0;
    for _ in 0..NUM {
        let (start, end) = (random_configuration(), random_configuration());
        match Trajectory::point_to_point(&start, &end, &limits) {
            Ok(trajectory) => seconds += trajectory.duration_secs(),
            Err(error) => println!("point to point: {error}"),
        }
    }
    println!(
        "point to point: {:?} to compute, {:.3} s long on average",
        started.elapsed() / NUM as u32,
        seconds / NUM as f64
    );
}

fn top_grasp([x, y, z]: [f64; 3], yaw_rad: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::new(x, y, z),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_rad)
            * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI),
    )
}

fn measure_inverse(name: &str, panda: &ArmGeometry, poses: &[Isometry3<f64>]) {
    let options = IkOptions::default();
    let started = Instant::now();
    let solutions: Vec<_> = poses.iter().map(|pose| panda.inverse(pose, &ready_pose(), &options)).collect();
    let elapsed = started.elapsed() / poses.len() as u32;
    let num_reached = solutions.iter().flatten().count();
    let worst_m = solutions.iter().flatten().map(|s| s.position_residual_m).fold(0.0, f64::max);
    let worst_rad = solutions.iter().flatten().map(|s| s.angle_residual_rad).fold(0.0, f64::max);
    println!(
        "{name}: {num_reached} of {} reached, {elapsed:?} each, worst residual {worst_m:.1e} m {worst_rad:.1e} rad",
        poses.len()
    );
}

fn measure_approaches(panda: &ArmGeometry, grasps: &[Isometry3<f64>]) {
    let mut paths = Vec::new();
    let started = Instant::now();
    let mut num_possible = 0;
    for grasp in grasps {
        let mut pregrasp = *grasp;
        pregrasp.translation.z += 0.15;
        let options = IkOptions::default();
        let ends_reachable = [grasp, &pregrasp].iter().all(|pose| panda.inverse(pose, &ready_pose(), &options).is_ok());
        if !ends_reachable {
            continue;
        }
        num_possible += 1;
        let approach =
            panda.approach(&pregrasp, grasp, GraspSymmetry::HalfTurn, &ready_pose(), &options, &LineOptions::default());
        if let Ok(Approach { path, .. }) = approach {
            paths.push(path);
        }
    }
    println!(
        "approaches of 15 cm from above: {} of {num_possible} with both ends in reach, {:?} each",
        paths.len(),
        started.elapsed() / num_possible
    );

    let started = Instant::now();
    let num = paths.len();
    let mut seconds = 0.0;
    for path in paths {
        match Trajectory::along_path(path, &panda.limits, &CartesianLimits::panda()) {
            Ok(trajectory) => seconds += trajectory.duration_secs(),
            Err(error) => println!("along path: {error}"),
        }
    }
    println!(
        "their timing: {:?} to compute, {:.3} s long on average",
        started.elapsed() / num as u32,
        seconds / num as f64
    );
}

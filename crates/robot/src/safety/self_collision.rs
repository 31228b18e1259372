//! Minimum distance between the arm's own bodies.
//!
//! The capsules of a link contain all its shapes: two links can touch only if their capsules do. The capsules are fewer
//! and wider than those of [`sdg_kinematics::collision`].

use std::fmt;

use nalgebra::Isometry3;
use sdg_kinematics::collision::Capsule;
use sdg_kinematics::{ArmGeometry, Frames};

/// Number of bodies: base, links 1 to 7, hand with fingers and camera.
const NUM_BODIES: usize = 9;
/// Names in messages, base first.
const NAMES: [&str; NUM_BODIES] =
    ["base", "link 1", "link 2", "link 3", "link 4", "link 5", "link 6", "link 7", "hand"];

/// Two bodies that are too close to each other.
#[derive(Debug, Clone, PartialEq)]
pub struct SelfCollision {
    /// The bodies' names.
    pub bodies: [&'static str; 2],
    /// Distance between the capsules of the two bodies, m; negative if they overlap.
    pub distance_m: f64,
    /// The smallest allowed distance, m.
    pub min_m: f64,
}

impl fmt::Display for SelfCollision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [one, other] = self.bodies;
        let (found_mm, min_mm) = (self.distance_m * 1e3, self.min_m * 1e3);
        write!(f, "{one} and {other} of the arm are {found_mm:.0} mm apart, at least {min_mm:.0} mm are required")
    }
}

/// The closest two bodies, by the wide capsules of the arm, if their distance is below `min_m`.
pub(super) fn self_collision(arm: &ArmGeometry, frames: &Frames, min_m: f64) -> Option<SelfCollision> {
    let placed: [Vec<Capsule>; NUM_BODIES] = std::array::from_fn(|body| {
        let (capsules, base_from_body) = match body {
            0 => (&arm.wide_capsules[0], Isometry3::identity()),
            8 => (&arm.hand.wide_capsules, frames.base_from_hand),
            link => (&arm.wide_capsules[link], frames.base_from_link[link - 1]),
        };
        capsules.iter().map(|capsule| capsule.moved(&base_from_body)).collect()
    });
    let mut nearest: Option<SelfCollision> = None;
    for &(one, other) in arm.self_pairs.iter().filter(|&&(_, other)| other < NUM_BODIES) {
        for a in &placed[one] {
            for b in &placed[other] {
                let distance_m = a.distance_m(b);
                if distance_m < nearest.as_ref().map_or(min_m, |nearest| nearest.distance_m) {
                    let bodies = [NAMES[one], NAMES[other]];
                    nearest = Some(SelfCollision { bodies, distance_m, min_m });
                }
            }
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use sdg_kinematics::{JointVector, ready_pose};

    const MIN_M: f64 = 0.010;

    #[test]
    fn the_ready_pose_is_free_and_a_folded_arm_is_not() {
        let panda = ArmGeometry::panda();
        assert_eq!(self_collision(&panda, &panda.frames(&ready_pose()), MIN_M), None);
        // The upper arm leans back, the forearm is folded onto it, and the hand points at the base.
        let folded = JointVector::from([0.0, -1.7, 0.0, -3.0, 0.0, 0.5, 0.0]);
        let found = self_collision(&panda, &panda.frames(&folded), MIN_M).unwrap();
        assert!(found.distance_m < MIN_M, "{found}");
        let near = SelfCollision { bodies: ["link 2", "hand"], distance_m: 0.0064, min_m: MIN_M };
        assert_eq!(near.to_string(), "link 2 and hand of the arm are 6 mm apart, at least 10 mm are required");
    }

    /// Fewer than 30 % of the configurations in the joints' ranges are refused, and fewer than 17.5 % because of any
    /// one pair of bodies.
    #[test]
    fn no_pair_is_always_refused() {
        let panda = ArmGeometry::panda();
        let limits = &panda.limits;
        let mut rng = Pcg64Mcg::seed_from_u64(11);
        let mut refused = std::collections::BTreeMap::new();
        for _ in 0..20_000 {
            let q = JointVector::from_fn(|i, _| rng.random_range(limits.position_min[i]..limits.position_max[i]));
            if let Some(found) = self_collision(&panda, &panda.frames(&q), MIN_M) {
                *refused.entry(found.bodies).or_insert(0) += 1;
            }
        }
        println!("{refused:?}");
        assert!(refused.values().sum::<i32>() < 6000, "{refused:?}");
        assert!(refused.values().all(|&count| count < 3500), "{refused:?}");
    }
}

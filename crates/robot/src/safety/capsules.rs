//! The arm's shape as capsules, and whether it comes near itself.
//!
//! Each capsule holds a whole shape of its link with some room, so that links whose capsules are apart are apart. They are fewer
//! and wider than those of [`sdg_kinematics::collision`], which holds what both share: capsules, their distance, and the pairs of
//! bodies that can meet.

use std::fmt;

use nalgebra::Isometry3;
use sdg_kinematics::Frames;
use sdg_kinematics::collision::{Body, Capsule};

/// Number of bodies: base, links 1 to 7, hand with fingers and camera.
const NUM_BODIES: usize = 9;
/// Names in messages, base first.
const NAMES: [&str; NUM_BODIES] =
    ["base", "link 1", "link 2", "link 3", "link 4", "link 5", "link 6", "link 7", "hand"];
/// The capsules of every body of an arm.
#[derive(Debug, Clone)]
pub struct LinkCapsules {
    bodies: [Vec<Capsule>; NUM_BODIES],
    /// The least distance between two bodies, m.
    pub min_distance_m: f64,
}

/// Two bodies that come too near to each other.
#[derive(Debug, Clone, PartialEq)]
pub struct SelfCollision {
    /// The bodies' names.
    pub bodies: [&'static str; 2],
    /// Distance of their capsules, m; negative where these overlap.
    pub distance_m: f64,
    /// The smallest distance that is allowed, m.
    pub min_m: f64,
}

impl fmt::Display for SelfCollision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [one, other] = self.bodies;
        let (found_mm, min_mm) = (self.distance_m * 1e3, self.min_m * 1e3);
        write!(f, "{one} and {other} of the arm are {found_mm:.0} mm apart, at least {min_mm:.0} mm are asked for")
    }
}

impl LinkCapsules {
    /// The Panda with its hand and a small camera on it, fingers at any opening.
    ///
    /// Of each link in its frame by Denavit and Hartenberg, of the base in the base frame, of hand, fingers and camera in the
    /// hand's. A test in `simulation` compares them with the shapes of the simulated arm.
    pub fn panda() -> Self {
        let c = Capsule::new;
        Self {
            bodies: [
                vec![c([-0.09, 0.0, 0.05], [0.02, 0.0, 0.05], 0.120)],
                vec![c([0.0, 0.0, -0.18], [0.0, 0.0, 0.0], 0.062), c([0.0, -0.07, 0.0], [0.0, 0.0, 0.0], 0.076)],
                vec![c([0.0, 0.0, 0.0], [0.0, 0.0, 0.07], 0.076), c([0.0, 0.0, 0.0], [0.0, -0.18, 0.0], 0.062)],
                vec![
                    c([0.0, 0.0, -0.115], [0.012, 0.0, -0.05], 0.066),
                    c([0.012, 0.0, -0.055], [0.0825, 0.0, 0.0], 0.058),
                    c([0.0825, 0.0, 0.0], [0.0825, 0.04, 0.0], 0.070),
                ],
                vec![
                    c([0.0, 0.0, 0.0], [0.0, 0.0, 0.04], 0.070),
                    c([0.0, 0.0, 0.0], [-0.07, 0.055, 0.0], 0.058),
                    c([-0.07, 0.05, 0.0], [-0.0825, 0.115, 0.0], 0.066),
                ],
                vec![
                    c([0.0, 0.0, -0.25], [0.0, 0.012, -0.18], 0.066),
                    c([0.0, 0.016, -0.185], [0.0, 0.045, -0.095], 0.052),
                    c([0.0, 0.040, -0.12], [0.0, 0.062, -0.02], 0.046),
                    c([0.0, 0.040, 0.0], [0.0, 0.060, 0.0], 0.062),
                ],
                vec![
                    c([0.0, 0.0, -0.02], [0.0, 0.0, 0.015], 0.050),
                    c([0.0, 0.0, 0.005], [0.088, 0.004, 0.002], 0.049),
                    c([0.088, -0.02, 0.0], [0.088, 0.015, 0.0], 0.058),
                ],
                vec![c([0.0, 0.0, 0.06], [0.0, 0.0, 0.09], 0.050), c([0.02, 0.0, 0.078], [0.05, 0.0, 0.08], 0.037)],
                vec![
                    c([0.0, -0.07, 0.038], [0.0, 0.07, 0.038], 0.053),
                    c([0.055, -0.03, 0.036], [0.055, 0.03, 0.036], 0.036),
                    c([0.0, -0.045, 0.083], [0.0, 0.045, 0.083], 0.036),
                ],
            ],
            min_distance_m: 0.010,
        }
    }

    /// The capsules of a body in its own frame: 0 the base, 1 to 7 the links, 8 the hand.
    pub fn of_body(&self, body: usize) -> &[Capsule] {
        &self.bodies[body]
    }

    /// The two bodies that are nearest to each other, where they are nearer than [`Self::min_distance_m`].
    pub fn collision(&self, frames: &Frames) -> Option<SelfCollision> {
        let base_from_body = |body: usize| match body {
            0 => Isometry3::identity(),
            8 => frames.base_from_hand,
            link => frames.base_from_link[link - 1],
        };
        let placed: [Vec<Capsule>; NUM_BODIES] = std::array::from_fn(|body| {
            let base_from_body = base_from_body(body);
            self.bodies[body].iter().map(|capsule| capsule.moved(&base_from_body)).collect()
        });
        let mut nearest: Option<SelfCollision> = None;
        let pairs = Body::pairs_that_can_meet().map(|(one, other)| (one.index(), other.index()));
        for (one, other) in pairs.filter(|&(_, other)| other < NUM_BODIES) {
            for a in &placed[one] {
                for b in &placed[other] {
                    let distance_m = a.distance_m(b);
                    if distance_m < nearest.as_ref().map_or(self.min_distance_m, |nearest| nearest.distance_m) {
                        let bodies = [NAMES[one], NAMES[other]];
                        nearest = Some(SelfCollision { bodies, distance_m, min_m: self.min_distance_m });
                    }
                }
            }
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use sdg_kinematics::{JointLimits, JointVector, Panda, ready_pose};

    #[test]
    fn the_ready_pose_is_free_and_a_folded_arm_is_not() {
        let (panda, capsules) = (Panda::new(), LinkCapsules::panda());
        assert_eq!(capsules.collision(&panda.frames(&ready_pose())), None);
        // The upper arm leans back, the forearm is folded onto it, and the hand points at the base.
        let folded = JointVector::from([0.0, -1.7, 0.0, -3.0, 0.0, 0.5, 0.0]);
        let found = capsules.collision(&panda.frames(&folded)).unwrap();
        assert!(found.to_string().contains("of the arm are"), "{found}");
        println!("{found}");
    }

    /// Few configurations of the whole joint range are refused, and no pair always: the capsules are not so large that they forbid
    /// what the arm can do.
    #[test]
    fn no_pair_is_always_refused() {
        let (panda, capsules, limits) = (Panda::new(), LinkCapsules::panda(), JointLimits::franka());
        let mut rng = Pcg64Mcg::seed_from_u64(11);
        let mut refused = std::collections::BTreeMap::new();
        for _ in 0..20_000 {
            let q = JointVector::from_fn(|i, _| rng.random_range(limits.position_min[i]..limits.position_max[i]));
            if let Some(found) = capsules.collision(&panda.frames(&q)) {
                *refused.entry(found.bodies).or_insert(0) += 1;
            }
        }
        println!("{refused:?}");
        assert!(refused.values().sum::<i32>() < 6000, "{refused:?}");
        assert!(refused.values().all(|&count| count < 3500), "{refused:?}");
    }
}

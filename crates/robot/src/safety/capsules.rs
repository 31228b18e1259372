//! The arm's shape as capsules, and whether it comes near itself.
//!
//! A capsule is all points within a radius of a segment. Each holds a whole shape of its link with some room, so that links
//! whose capsules are apart are apart.

use std::fmt;

use nalgebra::{Isometry3, Point3};
use sdg_kinematics::Frames;

/// All points within `radius_m` of the segment from `from` to `to`, in the frame of a link, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    /// One end of the segment.
    pub from: Point3<f64>,
    /// The other end.
    pub to: Point3<f64>,
    /// Radius.
    pub radius_m: f64,
}

impl Capsule {
    const fn new(from: [f64; 3], to: [f64; 3], radius_m: f64) -> Self {
        Self { from: Point3::new(from[0], from[1], from[2]), to: Point3::new(to[0], to[1], to[2]), radius_m }
    }

    /// The same capsule in another frame.
    fn moved(&self, frame_from_link: &Isometry3<f64>) -> Self {
        Self { from: frame_from_link * self.from, to: frame_from_link * self.to, radius_m: self.radius_m }
    }

    /// Distance between the surfaces of two capsules in the same frame, m; negative where they overlap.
    pub fn distance_m(&self, other: &Self) -> f64 {
        segment_distance(&self.from, &self.to, &other.from, &other.to) - self.radius_m - other.radius_m
    }
}

/// Number of bodies: base, links 1 to 7, hand with fingers and camera.
const NUM_BODIES: usize = 9;
/// Names in messages, base first.
const NAMES: [&str; NUM_BODIES] =
    ["base", "link 1", "link 2", "link 3", "link 4", "link 5", "link 6", "link 7", "hand"];
/// Pairs of bodies that can meet. Neighbours touch by construction; the others that are missing are kept apart by the joints'
/// ranges.
const PAIRS: [(usize, usize); 17] = [
    (0, 5),
    (0, 6),
    (0, 7),
    (0, 8),
    (1, 5),
    (1, 6),
    (1, 7),
    (1, 8),
    (2, 5),
    (2, 6),
    (2, 7),
    (2, 8),
    (3, 7),
    (3, 8),
    (4, 7),
    (4, 8),
    (5, 8),
];

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
    /// Their names.
    pub bodies: [&'static str; 2],
    /// Distance of their capsules, m; negative where these overlap.
    pub distance_m: f64,
    /// The least allowed.
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
        for (one, other) in PAIRS {
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

/// Distance between two segments.
///
/// The squared distance is a convex quadratic of the two parameters in the unit square: its minimum is inside, or at an edge,
/// where one end is held and the nearest point of the other segment is taken.
fn segment_distance(a0: &Point3<f64>, a1: &Point3<f64>, b0: &Point3<f64>, b1: &Point3<f64>) -> f64 {
    let (u, v, w) = (a1 - a0, b1 - b0, a0 - b0);
    let (uu, uv, vv) = (u.dot(&u), u.dot(&v), v.dot(&v));
    let determinant = uu * vv - uv * uv;
    let mut least = f64::INFINITY;
    if determinant > 1e-12 * uu * vv {
        let s = (uv * v.dot(&w) - vv * u.dot(&w)) / determinant;
        let t = (uu * v.dot(&w) - uv * u.dot(&w)) / determinant;
        if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
            least = (w + u * s - v * t).norm();
        }
    }
    for (point, from, along, squared) in [(a0, b0, &v, vv), (a1, b0, &v, vv), (b0, a0, &u, uu), (b1, a0, &u, uu)] {
        let t = if squared > 0.0 { ((point - from).dot(along) / squared).clamp(0.0, 1.0) } else { 0.0 };
        least = least.min((point - (from + along * t)).norm());
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;
    use sdg_kinematics::{JointLimits, JointVector, Panda, ready_pose};

    #[test]
    fn distances_that_can_be_seen() {
        let along_x = Capsule::new([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 0.1);
        // Crossing above, beside the end, parallel, and touching.
        for (other, expected) in [
            (Capsule::new([0.5, -1.0, 0.5], [0.5, 1.0, 0.5], 0.2), 0.2),
            (Capsule::new([1.3, 0.4, 0.0], [2.0, 0.4, 0.0], 0.1), 0.3),
            (Capsule::new([0.2, 0.0, 0.7], [0.8, 0.0, 0.7], 0.1), 0.5),
            (Capsule::new([0.5, 0.0, 0.0], [0.5, 0.0, 1.0], 0.1), -0.2),
            (Capsule::new([0.0, 3.0, 4.0], [0.0, 3.0, 4.0], 0.5), 4.4),
        ] {
            assert!((along_x.distance_m(&other) - expected).abs() < 1e-12, "{other:?}");
            assert!((other.distance_m(&along_x) - expected).abs() < 1e-12, "{other:?}");
        }
    }

    #[test]
    fn distances_agree_with_points_on_the_segments() {
        let mut rng = Pcg64Mcg::seed_from_u64(7);
        let mut point = || Point3::from(Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0)));
        for _ in 0..200 {
            let [a0, a1, b0, b1] = [point(), point(), point(), point()];
            let mut sampled = f64::INFINITY;
            for i in 0..=200 {
                for k in 0..=200 {
                    let (s, t) = (f64::from(i) / 200.0, f64::from(k) / 200.0);
                    sampled = sampled.min(((a0 + (a1 - a0) * s) - (b0 + (b1 - b0) * t)).norm());
                }
            }
            let found = segment_distance(&a0, &a1, &b0, &b1);
            // Samples are at most 2 * sqrt(3) / 400 from the nearest point on each segment.
            assert!(found <= sampled + 1e-12 && found > sampled - 0.018, "{found} {sampled}");
        }
    }

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

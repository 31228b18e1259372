//! Collision checks of several configurations in parallel, and of whole motions.
//!
//! An edge is the straight motion in joint space between two configurations. It is checked by *conservative
//! advancement*: at a configuration, each pair of bodies has a distance d and an upper bound v of its approach speed
//! along the edge. The bound follows from the angles that the joints cover and from the bodies' reach. Over the next d
//! / v of the edge, the pair cannot touch. Steps are therefore long in free space and short near obstacles, and the
//! edge is also proven free between two checked configurations. The edge is checked at several configurations in
//! parallel, one for each SIMD lane: the lanes start at evenly distributed points of the edge, and each advances to the
//! next lane's start. Curves are proven free in the same way, with the largest rate of each joint along them.
#![allow(clippy::needless_range_loop, reason = "one index for the lanes of several arrays")]

use super::lanes::{Lane, NUM_LANES};
use super::model::CollisionModel;
use super::pair_search::{Found, Placed, Weights, evaluate};
use crate::joints::{JointVector, NUM_JOINTS};

/// Checks configurations and motions against a [`CollisionModel`], and counts the checks.
#[derive(Debug, Clone)]
pub struct Checker<'a> {
    model: &'a CollisionModel,
    margin_m: f64,
    arch: pulp::Arch,
    placed: Placed,
    num_checked: usize,
}

/// The lanes that have not reached their end.
#[derive(Debug, Clone, Copy)]
struct Lanes {
    lanes: [usize; NUM_LANES],
    len: usize,
}

impl Lanes {
    fn all() -> Self {
        Self { lanes: std::array::from_fn(|lane| lane), len: NUM_LANES }
    }

    fn retain(&mut self, is_kept: impl Fn(usize) -> bool) {
        let before = *self;
        self.len = 0;
        for &lane in before.lanes[..before.len].iter().filter(|&&lane| is_kept(lane)) {
            self.lanes[self.len] = lane;
            self.len += 1;
        }
    }
}

impl<'a> Checker<'a> {
    /// Creates a checker that requires `margin_m` between bodies at every checked configuration, and no contact between
    /// these configurations.
    ///
    /// A larger margin allows longer steps near obstacles.
    pub fn new(model: &'a CollisionModel, margin_m: f64) -> Self {
        assert!(margin_m > 0.0 && margin_m.is_finite(), "a margin is positive, found {margin_m} m");
        Self { model, margin_m, arch: pulp::Arch::new(), placed: Placed::new(model), num_checked: 0 }
    }

    /// The model of the checks.
    pub fn model(&self) -> &'a CollisionModel {
        self.model
    }

    /// The minimum distance at checked configurations, m.
    pub fn margin_m(&self) -> f64 {
        self.margin_m
    }

    /// Number of configurations checked so far, without those of idle lanes.
    pub fn num_checked(&self) -> usize {
        self.num_checked
    }

    /// The smallest distance between two bodies at each configuration, m, negative if they overlap.
    ///
    /// Distances to obstacles are too large by at most 2⁻¹³ of a capsule's length (0.03 mm).
    pub fn distances_m(&mut self, configurations: &[JointVector]) -> Vec<f64> {
        let mut distances = Vec::with_capacity(configurations.len());
        for chunk in configurations.chunks(NUM_LANES) {
            let q = std::array::from_fn(|lane| chunk[lane.min(chunk.len() - 1)]);
            let found = self.evaluate(&q, &Weights::DISTANCES, false);
            distances.extend_from_slice(&found.least[..chunk.len()]);
            self.num_checked += chunk.len();
        }
        distances
    }

    /// Whether the margin is kept at a configuration.
    pub fn is_free(&mut self, q: &JointVector) -> bool {
        self.num_checked += 1;
        !self.evaluate(&[*q; NUM_LANES], &Weights::DISTANCES, true).is_blocked[0]
    }

    /// Whether the straight motion in joint space from one configuration to another is free, both ends included.
    pub fn is_edge_free(&mut self, from: &JointVector, to: &JointVector) -> bool {
        self.blocked_share(from, to).is_none()
    }

    /// The first point found on the straight motion that violates the margin, as a fraction of its length; not always
    /// the one nearest to the start.
    pub fn blocked_share(&mut self, from: &JointVector, to: &JointVector) -> Option<f64> {
        let delta = to - from;
        self.blocked_share_of_curve(|share| from + delta * share, &delta.abs())
    }

    /// Like [`Checker::blocked_share`], for any curve, given by its configuration at a fraction of its length.
    /// `max_turns` bounds the angle that each joint covers along the curve: its largest rate times the length, rad.
    pub(crate) fn blocked_share_of_curve(
        &mut self,
        at: impl Fn(f64) -> JointVector,
        max_turns: &JointVector,
    ) -> Option<f64> {
        let weights = self.edge_weights(max_turns);
        // Lane i starts at the fraction i / (L - 1) of the length, and ends at the start of the next lane. The last
        // lane is at the end.
        let start = |lane: usize| lane as f64 / (NUM_LANES - 1) as f64;
        let mut share: Lane = std::array::from_fn(start);
        let mut active: Lanes = Lanes::all();
        while active.len > 0 {
            let places: Lane = std::array::from_fn(|place| share[active.lanes[place.min(active.len - 1)]]);
            let q = places.map(&at);
            let found = self.evaluate(&q, &weights, true);
            self.num_checked += active.len;
            if let Some(place) = (0..active.len).find(|&place| found.is_blocked[place]) {
                return Some(places[place]);
            }
            for place in 0..active.len {
                share[active.lanes[place]] += found.least[place];
            }
            active.retain(|lane| lane + 1 < NUM_LANES && share[lane] < start(lane + 1));
        }
        None
    }

    /// The fraction of an edge that each pair allows per metre of distance.
    fn edge_weights(&self, max_turns: &JointVector) -> Weights {
        let reach_m = &self.model.arm.reach_m;
        let speed_m = |body: usize, since_joint: usize| -> f64 {
            (since_joint..NUM_JOINTS).map(|joint_idx| reach_m[body][joint_idx] * max_turns[joint_idx]).sum()
        };
        // A pair without relative motion gets infinity: any distance is sufficient for the whole edge.
        let per_metre = |speed_m: f64| if speed_m > 0.0 { 1.0 / speed_m } else { f64::INFINITY };
        Weights {
            // The joints up to the first body's own joint do not change the distance, because they move both bodies
            // together.
            self_pairs: std::array::from_fn(|one| std::array::from_fn(|other| per_metre(speed_m(other, one)))),
            bodies: std::array::from_fn(|body| per_metre(speed_m(body, 0))),
            offset_m: self.margin_m,
        }
    }

    /// Compares all pairs. With `until_blocked`, it ends as soon as a lane is blocked.
    fn evaluate(&mut self, q: &[JointVector; NUM_LANES], weights: &Weights, until_blocked: bool) -> Found {
        let Self { model, margin_m, arch, placed, .. } = self;
        arch.dispatch(
            #[inline(always)]
            || evaluate(model, *margin_m, placed, q, weights, until_blocked),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::arm_shape::Body;
    use super::super::model::Obstacle;
    use super::super::shape::Shape;
    use super::*;
    use crate::capsule::Capsule;
    use crate::geometry::ArmGeometry;
    use crate::ik::IkOptions;
    use crate::joints::ready_pose;
    use crate::test_poses::random_configuration;
    use nalgebra::{Isometry3, UnitQuaternion, Vector3};
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// One obstacle of each shape around the arm, and a bar in its hand.
    fn crowded(rng: &mut Pcg64Mcg) -> CollisionModel {
        let shapes = [
            Shape::Plane,
            Shape::Box { half_m: [0.1, 0.05, 0.2] },
            Shape::Cylinder { radius_m: 0.08, half_length_m: 0.3 },
            Shape::Capsule { radius_m: 0.05, half_length_m: 0.1 },
        ];
        let obstacles = shapes.iter().enumerate().map(|(index, &shape)| {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| rng.random_range(-2.0..2.0)));
            let (turn, at) = match shape {
                Shape::Plane => (UnitQuaternion::identity(), Vector3::new(0.0, 0.0, -0.05)),
                _ => (turn, Vector3::from_fn(|_, _| rng.random_range(-0.8..0.8))),
            };
            Obstacle { name: index.to_string(), shape, base_from_obstacle: Isometry3::from_parts(at.into(), turn) }
        });
        let mut model = CollisionModel::new(&ArmGeometry::panda(), obstacles.collect(), 0.04).unwrap();
        model.hold(&[Capsule::new([-0.1, 0.0, 0.02], [0.1, 0.0, 0.02], 0.015)]).unwrap();
        model
    }

    #[test]
    fn lanes_agree_with_pair_by_pair() {
        // 2⁻¹³ of the longest capsule's axis, 0.25 m.
        const TOLERANCE_M: f64 = 3e-5;
        let mut rng = Pcg64Mcg::seed_from_u64(21);
        let mut num_inside = 0;
        for _ in 0..40 {
            let mut model = crowded(&mut rng);
            model.allow_overlaps_at(Body::HELD_PART, &ready_pose(), 0.3);
            let mut checker = Checker::new(&model, 0.01);
            let configurations: Vec<JointVector> = (0..11).map(|_| random_configuration(&mut rng)).collect();
            let distances = checker.distances_m(&configurations);
            for (q, found) in configurations.iter().zip(distances) {
                let expected = model.nearest(q);
                let error = found - expected.distance_m;
                assert!((-1e-9..TOLERANCE_M).contains(&error), "{found} is not {expected:?}");
                assert_eq!(checker.is_free(q), found >= 0.01);
                num_inside += usize::from(found < 0.0);
            }
        }
        assert!((40..400).contains(&num_inside), "{num_inside} of 440 collide");
    }

    #[test]
    fn gradients_agree_with_finite_differences() {
        const STEP_RAD: f64 = 1e-6;
        let mut rng = Pcg64Mcg::seed_from_u64(22);
        let (mut num_compared, mut num_kinks) = (0, 0);
        for _ in 0..300 {
            let model = crowded(&mut rng);
            let q = random_configuration(&mut rng);
            let found = model.nearest(&q);
            // If a capsule's axis is inside an obstacle, the closest face may change.
            if found.distance_m < -0.01 {
                continue;
            }
            for joint_idx in 0..NUM_JOINTS {
                let mut step = JointVector::zeros();
                step[joint_idx] = STEP_RAD;
                let [before, after] = [-1.0, 1.0].map(|sign| model.nearest(&(q + step * sign)).distance_m);
                let numeric = (after - before) / (2.0 * STEP_RAD);
                // If two pairs are equally close, or a segment lies along a face, the distance has no derivative.
                let is_kink = (after + before - 2.0 * found.distance_m).abs() > 1e-9;
                if is_kink {
                    num_kinks += 1;
                } else {
                    num_compared += 1;
                    let error = (numeric - found.gradient[joint_idx]).abs();
                    assert!(error < 2e-4, "joint {}: {numeric}, {found:?}", joint_idx + 1);
                }
            }
        }
        assert!(num_compared > 1000 && num_kinks < 50, "{num_compared} compared, {num_kinks} kinks");
    }

    #[test]
    fn nothing_between_the_checked_configurations_touches() {
        let mut rng = Pcg64Mcg::seed_from_u64(23);
        let (mut num_free, mut num_blocked) = (0, 0);
        for _ in 0..150 {
            let model = crowded(&mut rng);
            let mut checker = Checker::new(&model, 0.003);
            let from = random_configuration(&mut rng);
            let to = from + (random_configuration(&mut rng) - from) * rng.random_range(0.05..0.5);
            let between: Vec<JointVector> = (0..=500).map(|i| from + (to - from) * (f64::from(i) / 500.0)).collect();
            let least = checker.distances_m(&between).into_iter().fold(f64::INFINITY, f64::min);
            match checker.blocked_share(&from, &to) {
                None => {
                    num_free += 1;
                    assert!(least >= -1e-4, "{least}");
                }
                Some(share) => {
                    num_blocked += 1;
                    let there = checker.distances_m(&[from + (to - from) * share])[0];
                    assert!(there < 0.003, "{there} at {share}");
                }
            }
        }
        assert!(num_free > 20 && num_blocked > 20, "{num_free} free, {num_blocked} blocked");
    }

    #[test]
    fn an_allowed_pair_may_touch_and_others_may_not() {
        // A plate that only the fingertips reach: they are at 0.4869 m in the ready pose.
        let table = Obstacle {
            name: "table".to_owned(),
            shape: Shape::Box { half_m: [0.1, 0.1, 0.005] },
            base_from_obstacle: Isometry3::translation(0.307, 0.0, 0.485),
        };
        let mut model = CollisionModel::new(&ArmGeometry::panda(), vec![table], 0.08).unwrap();
        let found = model.nearest(&ready_pose());
        assert_eq!((found.body, found.other.as_str()), (Body::HAND, "table"));
        assert!(found.distance_m < 0.0 && found.to_string().contains("mm inside table"), "{found}");
        assert!(!Checker::new(&model, 0.001).is_free(&ready_pose()));
        model.allow(Body::HAND, "table").unwrap();
        assert!(Checker::new(&model, 0.001).is_free(&ready_pose()), "{}", model.nearest(&ready_pose()));
        assert!(model.allow(Body::HAND, "tray").unwrap_err().to_string().contains("the obstacles are: table"));
    }

    #[test]
    fn only_the_obstacles_that_are_near_at_a_configuration_may_be_overlapped_as_deeply_as_there() {
        // A ball of 60 mm around the tcp; the shelf is 40 mm below the tcp, the post 70 mm beside it.
        let panda = ArmGeometry::panda();
        let base_from_tcp = panda.forward(&ready_pose());
        let at = base_from_tcp.translation;
        let obstacle = |name: &str, half_m: [f64; 3], [x, y, z]: [f64; 3]| Obstacle {
            name: name.to_owned(),
            shape: Shape::Box { half_m },
            base_from_obstacle: Isometry3::translation(at.x + x, at.y + y, at.z + z),
        };
        let shelf = obstacle("shelf", [0.1, 0.1, 0.005], [0.0, 0.0, -0.045]);
        let post = obstacle("post", [0.02; 3], [0.0, 0.09, -0.01]);
        let mut model = CollisionModel::new(&panda, vec![shelf, post], 0.0).unwrap();
        model.hold(&[Capsule::new([0.0; 3], [0.0; 3], 0.06)]).unwrap();
        assert!((model.nearest(&ready_pose()).distance_m + 0.02).abs() < 1e-9);
        model.allow_overlaps_at(Body::HELD_PART, &ready_pose(), 0.005);
        assert!(Checker::new(&model, 0.004).is_free(&ready_pose()), "{}", model.nearest(&ready_pose()));
        for (offset, other, distance_m) in [([0.0, 0.0, -0.01], "shelf", -0.005), ([0.0, 0.02, 0.01], "post", -0.01)] {
            let mut pose = base_from_tcp;
            pose.translation.vector += Vector3::from(offset);
            let q = panda.inverse(&pose, &ready_pose(), &IkOptions::default()).unwrap().q;
            let found = model.nearest(&q);
            assert_eq!((found.body, found.other.as_str()), (Body::HELD_PART, other), "{found}");
            assert!((found.distance_m - distance_m).abs() < 1e-4, "{found}");
            assert!(!Checker::new(&model, 0.004).is_free(&q));
        }
    }
}

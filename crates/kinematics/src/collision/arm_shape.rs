//! The arm's shape: capsules that hold every link of the Panda, its hand and a small camera on it.

use nalgebra::{Isometry3, Point3, Translation3, Vector3};

use super::capsule::Capsule;
use crate::joints::NUM_JOINTS;
use crate::panda::{DH_A_M, DH_D_M, FLANGE_OFFSET_M, Frames, HAND_OPENING_MAX_M, HAND_TURN_RAD, TCP_OFFSET_M};

/// Bodies of the arm: base, links 1 to 7, hand with fingers and camera, and what the hand holds.
pub(super) const NUM_BODIES: usize = 10;
/// The first body that moves.
pub(super) const FIRST_MOVING: usize = 1;
const HAND: usize = 8;
/// What the hand holds.
pub(super) const HELD: usize = 9;

/// A rigid part of the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Body(usize);

impl Body {
    /// The base, which stands still.
    pub const BASE: Self = Self(0);
    /// The hand with its fingers and the camera.
    pub const HAND: Self = Self(HAND);
    /// The part that the hand holds.
    pub const HELD_PART: Self = Self(HELD);

    /// A link by its number, 1 to 7.
    pub fn link(number: usize) -> Self {
        assert!((1..=NUM_JOINTS).contains(&number), "links are numbered 1 to 7, found {number}");
        Self(number)
    }

    pub(super) const fn of_index(index: usize) -> Self {
        Self(index)
    }

    /// Pairs of bodies that can meet, the one nearer to the base first.
    pub fn pairs_that_can_meet() -> impl Iterator<Item = (Self, Self)> {
        SELF_PAIRS.into_iter().map(|(one, other)| (Self(one), Self(other)))
    }

    /// The place in the chain: 0 the base, 8 the hand, 9 the held part.
    pub fn index(self) -> usize {
        self.0
    }
}

impl std::fmt::Display for Body {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.0 {
            0 => f.write_str("the base"),
            HAND => f.write_str("the hand"),
            HELD => f.write_str("the held part"),
            link => write!(f, "link {link}"),
        }
    }
}

/// Pairs of bodies that can meet. Neighbours touch by construction; the others that are missing are kept apart by the joints'
/// ranges, which a test in `simulation` compares with MuJoCo.
pub(super) const SELF_PAIRS: [(usize, usize); 23] = [
    (0, 5),
    (0, 6),
    (0, 7),
    (0, HAND),
    (1, 5),
    (1, 6),
    (1, 7),
    (1, HAND),
    (2, 5),
    (2, 6),
    (2, 7),
    (2, HAND),
    (3, 7),
    (3, HAND),
    (4, 7),
    (4, HAND),
    (5, HAND),
    (0, HELD),
    (1, HELD),
    (2, HELD),
    (3, HELD),
    (4, HELD),
    (5, HELD),
];

/// The capsules of every body.
#[derive(Debug, Clone)]
pub(super) struct ArmShape {
    /// Of each body in its frame: the base frame, the links' by Denavit and Hartenberg, and link 7's for hand and held part.
    pub(super) capsules: [Vec<Capsule>; NUM_BODIES],
    /// A ball around each body's capsules: centre in the body's frame, radius.
    pub(super) bounds: [(Point3<f64>, f64); NUM_BODIES],
    /// `reach_m[body][joint]`: no point of the body is ever farther from the joint's axis, m; 0 for joints that do not move it.
    pub(super) reach_m: [[f64; NUM_JOINTS]; NUM_BODIES],
}

/// Half of a finger's thickness along its motion at the root, its middle's distance from the pad's face, m.
const FINGER_MIDDLE_M: f64 = 0.013;

impl ArmShape {
    /// The Panda with its fingers at an opening (m), holding nothing.
    pub(super) fn panda(opening_m: f64) -> Self {
        let mut shape = Self {
            capsules: panda_capsules(opening_m),
            bounds: [(Point3::origin(), 0.0); NUM_BODIES],
            reach_m: [[0.0; NUM_JOINTS]; NUM_BODIES],
        };
        shape.update();
        shape
    }

    /// Puts capsules, in the tcp's frame, into the hand.
    pub(super) fn hold(&mut self, in_tcp: &[Capsule]) {
        let link_from_tcp = link7_from_hand() * Translation3::new(0.0, 0.0, TCP_OFFSET_M);
        self.capsules[HELD] = in_tcp.iter().map(|capsule| capsule.moved(&link_from_tcp)).collect();
        self.update();
    }

    fn update(&mut self) {
        for body in 0..NUM_BODIES {
            self.bounds[body] = bounding_ball(&self.capsules[body]);
            if !self.capsules[body].is_empty() {
                self.reach_m[body] = reach_m(body, &self.capsules[body]);
            }
        }
    }
}

/// The pose of a body's frame in the base frame.
pub(super) fn base_from_body(frames: &Frames, body: usize) -> Isometry3<f64> {
    match body {
        0 => Isometry3::identity(),
        moving => frames.base_from_link[moving.min(NUM_JOINTS) - 1],
    }
}

fn link7_from_hand() -> Isometry3<f64> {
    let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), HAND_TURN_RAD);
    Isometry3::from_parts(Translation3::new(0.0, 0.0, FLANGE_OFFSET_M), turn)
}

/// Each capsule was placed by hand around shapes of crates/simulation/assets/panda.xml; crates/simulation/tests/collision_model.rs
/// measures how far they stand out and that nothing of the arm stands out of them.
fn panda_capsules(opening_m: f64) -> [Vec<Capsule>; NUM_BODIES] {
    let c = Capsule::new;
    let finger_y = 0.5 * opening_m.clamp(0.0, HAND_OPENING_MAX_M) + FINGER_MIDDLE_M;
    let tip_y = finger_y - 0.007;
    let hand = [
        // Body: four bars along y.
        c([0.016, -0.0925, 0.0165], [0.016, 0.0925, 0.0165], 0.0245),
        c([-0.016, -0.0925, 0.0165], [-0.016, 0.0925, 0.0165], 0.0245),
        c([0.016, -0.0925, 0.0495], [0.016, 0.0925, 0.0495], 0.0245),
        c([-0.016, -0.0925, 0.0495], [-0.016, 0.0925, 0.0495], 0.0245),
        // Camera and its arm.
        c([0.072, -0.035, 0.0365], [0.072, 0.035, 0.0365], 0.0175),
        c([0.030, 0.0, 0.030], [0.062, 0.0, 0.030], 0.0155),
        // Fingers: root and tip of each.
        c([0.0, finger_y, 0.060], [0.0, finger_y, 0.078], 0.018),
        c([0.0, -finger_y, 0.060], [0.0, -finger_y, 0.078], 0.018),
        c([0.0, tip_y, 0.075], [0.0, tip_y, 0.0985], 0.0145),
        c([0.0, -tip_y, 0.075], [0.0, -tip_y, 0.0985], 0.0145),
    ];
    [
        vec![
            // Column, then the foot: low at both sides, front and back, and higher up.
            c([0.0, 0.0, 0.06], [0.0, 0.0, 0.12], 0.062),
            c([-0.115, 0.055, 0.012], [0.036, 0.055, 0.012], 0.050),
            c([-0.115, -0.055, 0.012], [0.036, -0.055, 0.012], 0.050),
            c([0.036, -0.03, 0.012], [0.036, 0.03, 0.012], 0.050),
            c([-0.118, -0.03, 0.03], [-0.118, 0.03, 0.03], 0.050),
            c([-0.115, 0.03, 0.064], [0.015, 0.03, 0.064], 0.056),
            c([-0.115, -0.03, 0.064], [0.015, -0.03, 0.064], 0.056),
        ],
        vec![c([0.0, 0.0, -0.25], [0.0, 0.0, 0.0], 0.0605), c([0.0, -0.0865, 0.0], [0.0, -0.02, 0.0], 0.061)],
        vec![c([0.0, 0.0, 0.02], [0.0, 0.0, 0.0865], 0.061), c([0.0, 0.0, 0.0], [0.0, -0.172, 0.0], 0.0615)],
        vec![
            c([0.0, 0.0, -0.145], [0.0, 0.0, -0.07], 0.0605),
            c([0.0, 0.0, -0.085], [0.012, 0.0, -0.055], 0.0575),
            c([0.012, 0.0, -0.055], [0.0825, 0.0, 0.0], 0.0575),
            c([0.0825, 0.0, 0.0], [0.0825, 0.060, 0.0], 0.061),
        ],
        vec![
            c([0.0, 0.0, 0.0], [0.0, 0.0, 0.060], 0.061),
            c([0.0, 0.0, 0.0], [-0.07, 0.055, 0.0], 0.0575),
            c([-0.07, 0.055, 0.0], [-0.0825, 0.085, 0.0], 0.0585),
            c([-0.0825, 0.085, 0.0], [-0.0825, 0.107, 0.0], 0.0605),
        ],
        vec![
            c([0.0, 0.0, -0.31], [0.0, 0.0, -0.21], 0.0605),
            c([0.0, 0.0, -0.205], [0.0, 0.012, -0.18], 0.0575),
            c([0.0, 0.016, -0.185], [0.0, 0.045, -0.095], 0.051),
            c([0.0, 0.040, -0.12], [0.0, 0.062, -0.02], 0.0455),
            c([0.0, 0.050, -0.20], [0.0, 0.060, -0.05], 0.0455),
            c([0.0, 0.028, 0.0], [0.0, 0.070, 0.0], 0.054),
        ],
        vec![
            c([0.0, 0.0, -0.02], [0.0, 0.0, 0.012], 0.0505),
            c([0.0, 0.0, 0.005], [0.088, 0.004, 0.002], 0.048),
            c([0.088, -0.026, 0.0], [0.088, 0.018, 0.0], 0.052),
        ],
        vec![
            c([0.0, 0.0, -0.06], [0.0, 0.0, 0.06], 0.0405),
            c([0.0, 0.0, 0.06], [0.0, 0.0, 0.085], 0.0475),
            c([0.02, 0.0, 0.076], [0.055, 0.0, 0.077], 0.030),
        ],
        hand.iter().map(|capsule| capsule.moved(&link7_from_hand())).collect(),
        Vec::new(),
    ]
}

/// A ball that holds capsules: its centre is the middle of the box around them.
fn bounding_ball(capsules: &[Capsule]) -> (Point3<f64>, f64) {
    let ends =
        || capsules.iter().flat_map(|capsule| [(capsule.from, capsule.radius_m), (capsule.to, capsule.radius_m)]);
    let Some((first, _)) = ends().next() else { return (Point3::origin(), 0.0) };
    let (mut low, mut high) = (first, first);
    for (end, radius_m) in ends() {
        low = low.inf(&(end - Vector3::repeat(radius_m)));
        high = high.sup(&(end + Vector3::repeat(radius_m)));
    }
    let centre = nalgebra::center(&low, &high);
    let radius_m = ends().map(|(end, radius_m)| (end - centre).norm() + radius_m).fold(0.0, f64::max);
    (centre, radius_m)
}

/// Bounds of the distances between a body's points and the joints' axes, see [`ArmShape::reach_m`].
fn reach_m(body: usize, capsules: &[Capsule]) -> [f64; NUM_JOINTS] {
    let last_joint = body.min(NUM_JOINTS);
    let over_ends = |distance: fn(&Point3<f64>) -> f64| {
        capsules
            .iter()
            .map(|capsule| distance(&capsule.from).max(distance(&capsule.to)) + capsule.radius_m)
            .fold(0.0, f64::max)
    };
    // A joint turns about the z axis of its own link.
    let from_own_axis = over_ends(|p| p.x.hypot(p.y));
    let from_origin = over_ends(|p| p.coords.norm());
    std::array::from_fn(|joint_idx| {
        let joint = joint_idx + 1;
        if joint > last_joint {
            0.0
        } else if joint == last_joint {
            from_own_axis
        } else {
            origin_distance_m(joint, last_joint) + from_origin
        }
    })
}

/// A bound of the distance between the origins of two links, the first before the second, m.
fn origin_distance_m(first: usize, second: usize) -> f64 {
    let step = |link: usize| DH_A_M[link - 1].hypot(DH_D_M[link - 1]);
    let mut distance_m = 0.0;
    let mut at = first;
    while at < second {
        // Link 2's origin lies on joint 3's axis, so the distance to link 4's is the same whatever joint 3 does.
        if at == 2 && second >= 4 {
            distance_m += step(3).hypot(step(4));
            at = 4;
        } else {
            at += 1;
            distance_m += step(at);
        }
    }
    distance_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panda::Panda;
    use crate::test_poses::random_configuration;
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn no_point_is_farther_from_a_joint_than_its_reach() {
        let (panda, shape) = (Panda::new(), ArmShape::panda(0.08));
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        let mut largest_share: f64 = 0.0;
        for _ in 0..2000 {
            let frames = panda.frames(&random_configuration(&mut rng));
            for body in FIRST_MOVING..HELD {
                let pose = base_from_body(&frames, body);
                for joint_idx in 0..body.min(NUM_JOINTS) {
                    let joint = frames.base_from_link[joint_idx];
                    for capsule in &shape.capsules[body] {
                        for end in [capsule.from, capsule.to] {
                            let in_joint = joint.inverse() * (pose * end);
                            let found = in_joint.x.hypot(in_joint.y) + capsule.radius_m;
                            let bound = shape.reach_m[body][joint_idx];
                            assert!(found <= bound + 1e-9, "body {body}, joint {}: {found} > {bound}", joint_idx + 1);
                            largest_share = largest_share.max(found / bound);
                        }
                    }
                }
            }
        }
        assert!(largest_share > 0.99, "{largest_share}");
    }

    #[test]
    fn the_balls_hold_the_capsules() {
        let shape = ArmShape::panda(0.0);
        for body in 0..HELD {
            let (centre, radius_m) = shape.bounds[body];
            for capsule in &shape.capsules[body] {
                for end in [capsule.from, capsule.to] {
                    assert!((end - centre).norm() + capsule.radius_m <= radius_m + 1e-12);
                }
            }
        }
    }
}

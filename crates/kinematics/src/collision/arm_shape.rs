//! The arm's shape: capsules that contain every link, the hand and the held part.

use nalgebra::{Isometry3, Point3, Translation3, Vector3};

use crate::capsule::Capsule;
use crate::geometry::{ArmGeometry, DhJoint, Frames};
use crate::joints::NUM_JOINTS;

/// Bodies of the arm: base, links 1 to 7, hand with fingers and camera, and the held part.
pub(super) const NUM_BODIES: usize = 10;
/// The first body that moves.
pub(super) const FIRST_MOVING: usize = 1;
const HAND: usize = 8;
/// The held part.
pub(super) const HELD: usize = 9;

/// A rigid part of the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Body(usize);

impl Body {
    /// The fixed base.
    pub const BASE: Self = Self(0);
    /// The hand with its fingers and the camera.
    pub const HAND: Self = Self(HAND);
    /// The part that the hand holds.
    pub const HELD_PART: Self = Self(HELD);

    /// A link by its number, from 1 to 7.
    pub fn link(number: usize) -> Self {
        assert!((1..=NUM_JOINTS).contains(&number), "links are numbered 1 to 7, found {number}");
        Self(number)
    }

    pub(super) const fn of_index(index: usize) -> Self {
        Self(index)
    }

    /// The index in the chain: 0 is the base, 8 the hand, 9 the held part.
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

/// The capsules of every body.
#[derive(Debug, Clone)]
pub(super) struct ArmShape {
    joints: [DhJoint; NUM_JOINTS],
    link7_from_tcp: Isometry3<f64>,
    /// The capsules of each body in the body's frame: the base frame, the link's frame (Denavit and Hartenberg), and
    /// link 7's frame for hand and held part.
    pub(super) capsules: [Vec<Capsule>; NUM_BODIES],
    /// A sphere around the capsules of each body: centre in the body's frame, radius.
    pub(super) bounds: [(Point3<f64>, f64); NUM_BODIES],
    /// `reach_m[body][joint]`: upper bound of the distance of the body's points from the joint's axis, m; 0 for joints
    /// that do not move the body.
    pub(super) reach_m: [[f64; NUM_JOINTS]; NUM_BODIES],
}

impl ArmShape {
    /// The shape of an arm with its fingers at an opening (m), without a held part.
    pub(super) fn new(arm: &ArmGeometry, opening_m: f64) -> Self {
        let link7_from_hand = arm.link7_from_hand();
        let mut capsules: [Vec<Capsule>; NUM_BODIES] = Default::default();
        capsules[..HAND].clone_from_slice(&arm.capsules);
        capsules[HAND] = hand_capsules(arm, opening_m).map(|capsule| capsule.moved(&link7_from_hand)).collect();
        let mut shape = Self {
            joints: arm.joints,
            link7_from_tcp: link7_from_hand * Translation3::new(0.0, 0.0, arm.hand.tcp_offset_m),
            capsules,
            bounds: [(Point3::origin(), 0.0); NUM_BODIES],
            reach_m: [[0.0; NUM_JOINTS]; NUM_BODIES],
        };
        shape.update();
        shape
    }

    /// Sets the capsules of the held part, given in the tcp's frame.
    pub(super) fn hold(&mut self, in_tcp: &[Capsule]) {
        self.capsules[HELD] = in_tcp.iter().map(|capsule| capsule.moved(&self.link7_from_tcp)).collect();
        self.update();
    }

    fn update(&mut self) {
        for body in 0..NUM_BODIES {
            self.bounds[body] = bounding_ball(&self.capsules[body]);
            if !self.capsules[body].is_empty() {
                self.reach_m[body] = reach_m(&self.joints, body, &self.capsules[body]);
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

/// The body of the hand and both fingers, in the hand's frame.
fn hand_capsules(arm: &ArmGeometry, opening_m: f64) -> impl Iterator<Item = Capsule> {
    let finger = &arm.hand.finger;
    let finger_y = 0.5 * opening_m.clamp(0.0, arm.hand.opening_max_m) + finger.middle_m;
    let fingers = finger.capsules.iter().flat_map(move |capsule| {
        let y = finger_y - capsule.inward_m;
        let [from_z, to_z] = capsule.z_m;
        [y, -y].map(|y| Capsule::new([0.0, y, from_z], [0.0, y, to_z], capsule.radius_m))
    });
    arm.hand.capsules.iter().copied().chain(fingers)
}

/// A sphere that contains capsules, about the centre of the box around them.
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

/// Upper bounds of the distances between a body's points and the joints' axes, see [`ArmShape::reach_m`].
fn reach_m(joints: &[DhJoint; NUM_JOINTS], body: usize, capsules: &[Capsule]) -> [f64; NUM_JOINTS] {
    let last_joint = body.min(NUM_JOINTS);
    let over_ends = |distance: fn(&Point3<f64>) -> f64| {
        capsules
            .iter()
            .map(|capsule| distance(&capsule.from).max(distance(&capsule.to)) + capsule.radius_m)
            .fold(0.0, f64::max)
    };
    // A joint rotates about the z axis of its own link.
    let from_own_axis = over_ends(|p| p.x.hypot(p.y));
    let from_origin = over_ends(|p| p.coords.norm());
    std::array::from_fn(|joint_idx| {
        let joint = joint_idx + 1;
        if joint > last_joint {
            0.0
        } else if joint == last_joint {
            from_own_axis
        } else {
            origin_distance_m(joints, joint, last_joint) + from_origin
        }
    })
}

/// An upper bound of the distance between the origins of two links, m; `first` is nearer to the base.
fn origin_distance_m(joints: &[DhJoint; NUM_JOINTS], first: usize, second: usize) -> f64 {
    let step = |link: usize| joints[link - 1].a_m.hypot(joints[link - 1].d_m);
    let mut distance_m = 0.0;
    let mut at = first;
    while at < second {
        // Two links together: if the first one is offset only along its joint's axis (a = 0) and the second one only
        // perpendicular to this axis (d = 0), the two offsets are at right angles for every angle of the joint.
        if at + 2 <= second && joints[at].a_m == 0.0 && joints[at + 1].d_m == 0.0 {
            distance_m += step(at + 1).hypot(step(at + 2));
            at += 2;
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

    use crate::test_poses::random_configuration;
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn no_point_is_farther_from_a_joint_than_its_reach() {
        let panda = ArmGeometry::panda();
        let shape = ArmShape::new(&panda, 0.08);
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
        let shape = ArmShape::new(&ArmGeometry::panda(), 0.0);
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

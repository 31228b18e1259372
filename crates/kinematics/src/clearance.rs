//! Height of hand, wrist and elbow above the table.

use nalgebra::{Isometry3, Point3};

use crate::geometry::{ArmGeometry, ArmPart};
use crate::joints::JointVector;
use crate::trajectory::Trajectory;

/// The closest point of an arm to a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clearance {
    /// Height of the lowest point above the table, m; negative below.
    pub lowest_m: f64,
    /// The lowest part of the arm.
    pub part: ArmPart,
    /// Time, s; 0 for a single configuration.
    pub time_secs: f64,
}

/// Time between two checks, s: the hand moves at most 5 mm at 2 m/s.
const LOOK_SECS: f64 = 0.0025;

impl ArmGeometry {
    /// The lowest point of hand, wrist and elbow above a level table at `table_height_m` in the base frame.
    ///
    /// The hand is modelled as a box with open fingers, wrist and elbow as spheres that are slightly larger than the
    /// links.
    pub fn clearance(&self, q: &JointVector, table_height_m: f64) -> Clearance {
        self.clearance_beyond(q, table_height_m, 0.0)
    }

    /// As [`ArmGeometry::clearance`], with finger tips that are lower than the ends of the modelled fingers by their
    /// extent beyond the tcp, m, at any tilt of the hand.
    pub fn clearance_beyond(&self, q: &JointVector, table_height_m: f64, fingertip_beyond_tcp_m: f64) -> Clearance {
        let frames = self.frames(q);
        let mut lowest = Clearance { lowest_m: f64::INFINITY, part: ArmPart::FingerTips, time_secs: 0.0 };
        let mut consider = |part, height: f64| {
            let lowest_m = height - table_height_m;
            if lowest_m < lowest.lowest_m {
                lowest = Clearance { lowest_m, part, time_secs: 0.0 };
            }
        };
        let hand = &self.hand;
        let finger_reach = hand.opening_max_m * 0.5 + hand.finger.thickness_m;
        for height in box_heights(&frames.base_from_tcp, hand.finger.half_width_m, finger_reach, 0.0, 0.0) {
            consider(ArmPart::FingerTips, height - fingertip_beyond_tcp_m);
        }
        for height in box_heights(&frames.base_from_hand, hand.half_depth_m, hand.half_width_m, 0.0, hand.length_m) {
            consider(ArmPart::Hand, height);
        }
        for &(part, number, radius_m) in &self.balls {
            consider(part, frames.base_from_link[number - 1].translation.z - radius_m);
        }
        lowest
    }
}

impl Trajectory {
    /// The closest point of the motion to a level table at `table_height_m` in the base frame; see
    /// [`ArmGeometry::clearance`].
    pub fn clearance(&self, arm: &ArmGeometry, table_height_m: f64) -> Clearance {
        let num_looks = (self.duration_secs() / LOOK_SECS).ceil().max(1.0) as usize;
        (0..=num_looks)
            .map(|i| {
                let time_secs = self.duration_secs() * i as f64 / num_looks as f64;
                let (q, _, _) = self.sample(time_secs);
                Clearance { time_secs, ..arm.clearance(&q, table_height_m) }
            })
            .min_by(|a, b| a.lowest_m.total_cmp(&b.lowest_m))
            .expect("at least two times are checked")
    }
}

/// Heights of the corners of a box in a frame, from `z_from` to `z_to` along its z.
fn box_heights(
    base_from_frame: &Isometry3<f64>,
    half_x: f64,
    half_y: f64,
    z_from: f64,
    z_to: f64,
) -> impl Iterator<Item = f64> {
    [-half_x, half_x].into_iter().flat_map(move |x| {
        [-half_y, half_y]
            .into_iter()
            .flat_map(move |y| [z_from, z_to].into_iter().map(move |z| (base_from_frame * Point3::new(x, y, z)).z))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joints::ready_pose;
    use crate::limits::JointLimits;

    #[test]
    fn in_the_ready_pose_the_finger_tips_are_lowest() {
        // The tcp is at a height of 0.4869 m and the hand is level, as computed by forward kinematics.
        let clearance = ArmGeometry::panda().clearance(&ready_pose(), 0.1);
        assert_eq!(clearance.part, ArmPart::FingerTips);
        assert!((clearance.lowest_m - 0.3869).abs() < 1e-4);
    }

    #[test]
    fn a_hand_lying_on_its_side_touches_with_its_body() {
        // With joint 6 at 0, the hand points back horizontally at a height of 0.697 m - 0.088 m, as computed by forward
        // kinematics. With joint 7 at 90° from the ready pose, the hand's width of 0.204 m is vertical.
        let mut q = ready_pose();
        q[5] = 0.0;
        q[6] += std::f64::consts::FRAC_PI_2;
        let clearance = ArmGeometry::panda().clearance(&q, 0.0);
        assert_eq!(clearance.part, ArmPart::Hand);
        assert!((clearance.lowest_m - (0.6973 - 0.088 - 0.102)).abs() < 1e-4);
    }

    #[test]
    fn a_motion_through_the_table_is_seen_in_the_middle() {
        // Joint 6 moves the hand from back to front about the wrist centre at 0.6973 m. The lowest point is an edge of
        // the fingertips, 0.088 m + 0.011 m across and 0.107 m + 0.1034 m along from the wrist centre, when the edge is
        // vertically below the wrist centre.
        let panda = ArmGeometry::panda();
        let (mut start, mut end) = (ready_pose(), ready_pose());
        start[5] = 0.3;
        end[5] = 2.9;
        let trajectory = Trajectory::point_to_point(&start, &end, &JointLimits::panda()).unwrap();
        let clearance = trajectory.clearance(&panda, 0.4);
        assert_eq!(clearance.part, ArmPart::FingerTips);
        assert!((clearance.lowest_m - (0.6973 - 0.099f64.hypot(0.2104) - 0.4)).abs() < 1e-4);
        assert!(clearance.time_secs > 0.0 && clearance.time_secs < trajectory.duration_secs());
        let at_ends = [start, end].map(|q| panda.clearance(&q, 0.4).lowest_m);
        assert!(at_ends[0] > clearance.lowest_m + 0.05 && at_ends[1] > clearance.lowest_m + 0.05);
    }
}

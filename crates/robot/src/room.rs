//! Whether a part and the fingers that release it have room in a cell of a tray, with parts in the neighbouring cells.
//!
//! ```text
//!        ┌──────┐  part in the next cell along y
//!        └──────┘
//!    room   ┌─┐    finger, open for the release, with the part's place between it and the other
//!        ┌──┴─┴─┐
//!        │ part │  rotated by an angle of the part's symmetry, the hand may have room elsewhere
//!        └──┬─┬─┘
//!           └─┘
//! ```
//! All neighbouring cells count as filled. For a hand with a fixed orientation, the order in which the cells are filled
//! makes no difference: the fingers open equally to both sides, and of two neighbouring parts the second is always
//! placed beside the first.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3};
use sdg_geometry::{Polygon, RotationalSymmetry};
use sdg_kinematics::{FINGER_HALF_WIDTH_M, HandGeometry, finger_thickness_m};

use crate::error::{Result, RobotError};
use crate::part_shape::PartShape;
use crate::place::PlaceGoal;

/// Minimum distance between fingers and a part in a neighbouring cell, m: that part may lie 2 mm off its cell's centre
/// before it is grasped again.
const FINGER_ROOM_M: f64 = 0.002;
/// Minimum distance between two parts, m: both may be off by [`FINGER_ROOM_M`].
const PART_ROOM_M: f64 = 2.0 * FINGER_ROOM_M;
/// Minimum room for the fingers if they compensate the sliding of a part, m: such fingers are off the centre of the
/// cell.
pub(crate) const MIN_FINGER_ROOM_M: f64 = 0.5 * FINGER_ROOM_M;
/// Number of angles that are tried for a part with full rotational symmetry: every 15°, which includes both axes of a
/// tray and its diagonals.
const NUM_TURNS: u32 = 24;
/// Maximum number of angles that are tried for a part with another symmetry.
const MAX_TURNS: u32 = 36;
/// Allowance for the rounding of lengths, m.
const ROUNDING_M: f64 = 1e-9;

/// Angles by which the part can be rotated without visible change, rad; at most [`MAX_TURNS`], over the whole circle.
pub(crate) fn same_turns_rad(symmetry: RotationalSymmetry) -> Vec<f64> {
    let count = match symmetry {
        RotationalSymmetry::Fold(count) => u64::from(count.max(1)),
        RotationalSymmetry::Full => u64::from(NUM_TURNS),
        _ => 1,
    };
    let num = count.min(u64::from(MAX_TURNS));
    // Of many equivalent angles some are left out. All others are multiples of the same period.
    (0..num).map(|turn| TAU * (turn * count / num) as f64 / count as f64).collect()
}

/// Opening of the hand that releases a part, m.
pub(crate) fn release_opening_m(width_m: f64, release_margin_m: f64, hand: &HandGeometry) -> f64 {
    (width_m + release_margin_m).min(hand.opening_max_m)
}

impl PlaceGoal {
    /// Checks that the parts in the neighbouring cells leave room for this part and, at one or more angles of its
    /// symmetry, for the fingers of `hand`. When they release the part, the fingers open `release_margin_m` (m) wider
    /// than the part.
    ///
    /// # Errors
    /// [`RobotError::Configuration`] without that room; the error contains the reason and, if one was found, a
    /// sufficient pitch.
    pub fn check_room(
        &self,
        part: &PartShape,
        symmetry: RotationalSymmetry,
        release_margin_m: f64,
        hand: &HandGeometry,
    ) -> Result<()> {
        let opening_m = release_opening_m(part.jaw_width_m(), release_margin_m, hand);
        let turns_rad = same_turns_rad(symmetry);
        let Some(why) = self.lacks_room(part, &turns_rad, opening_m) else { return Ok(()) };
        let pitch_m = self.tray.as_ref().map_or([0.0; 2], |tray| tray.pitch_m);
        let does = |goal: &Self| goal.lacks_room(part, &turns_rad, opening_m).is_none();
        let longer = |along: &[[bool; 2]]| -> Vec<String> {
            along.iter().filter_map(|&along| self.sufficient_pitch(along, does)).map(told).collect()
        };
        let mut would_suffice = longer(&[[true, false], [false, true]]);
        if would_suffice.is_empty() {
            would_suffice = longer(&[[true, true]]);
        }
        let expected = match would_suffice.join(" or ") {
            none if none.is_empty() => "a wider pitch".to_owned(),
            pitches => format!("a pitch of {pitches}"),
        };
        let found = format!("{}: {why}", told(pitch_m));
        Err(RobotError::Configuration { what: format!("\"{}\"", self.name), expected, found })
    }

    /// The reason why there is not enough room; `None` if there is enough.
    fn lacks_room(&self, part: &PartShape, turns_rad: &[f64], opening_m: f64) -> Option<String> {
        let base_from_part = self.base_from_part(0.0, 0.0);
        let own = part.outline_in_base(&base_from_part);
        let near = self.neighbours(part).map(|neighbour| gap_m(&own, &neighbour)).fold(f64::INFINITY, f64::min);
        if near < PART_ROOM_M - ROUNDING_M {
            let what = match near < -ROUNDING_M {
                true => format!("parts in neighbouring cells would overlap by {:.1} mm", -near * 1e3),
                false => format!("parts in neighbouring cells are {:.1} mm apart", near * 1e3),
            };
            return Some(format!("{what}, at least {:.0} mm are required", PART_ROOM_M * 1e3));
        }
        let near =
            turns_rad.iter().map(|&turn_rad| self.finger_gap_m(part, &self.base_from_part(0.0, turn_rad), opening_m));
        let near = near.fold(f64::NEG_INFINITY, f64::max);
        if near >= FINGER_ROOM_M - ROUNDING_M {
            return None;
        }
        let turned = if turns_rad.len() > 1 { " at every angle of the hand" } else { "" };
        let comes = match near < -ROUNDING_M {
            true => format!("would reach {:.1} mm into", -near * 1e3),
            false => format!("come within {:.1} mm of", near * 1e3),
        };
        Some(format!(
            "the part is {:.0} mm wide between the fingers; the fingers are {:.0} mm thick and, open to {:.0} mm to \
             release it, {comes} a part in a neighbouring cell{turned}; at least {:.0} mm are required",
            part.jaw_width_m() * 1e3,
            thickness_m(part) * 1e3,
            opening_m * 1e3,
            FINGER_ROOM_M * 1e3
        ))
    }

    /// Selects the poses of the hand with room for the fingers at this opening (m). Three minimum distances between
    /// fingers and surrounding parts are tried, the largest first. The first distance that any pose keeps decides: all
    /// poses that keep it are returned. Empty if no pose keeps any of the distances.
    pub(crate) fn with_room_for_fingers<T>(
        &self,
        part: &PartShape,
        opening_m: f64,
        poses: Vec<T>,
        base_from_tcp: impl Fn(&T) -> Isometry3<f64>,
    ) -> Vec<T> {
        let gaps_m: Vec<f64> =
            poses.iter().map(|pose| self.finger_gap_m(part, &base_from_tcp(pose), opening_m)).collect();
        let largest_m = gaps_m.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let rooms_m = [PART_ROOM_M, FINGER_ROOM_M, MIN_FINGER_ROOM_M];
        let least_m = rooms_m.into_iter().find(|room_m| largest_m >= room_m - ROUNDING_M).unwrap_or(f64::INFINITY);
        let has_room = |gap_m: f64| gap_m >= least_m - ROUNDING_M;
        poses.into_iter().zip(gaps_m).filter_map(|(pose, gap_m)| has_room(gap_m).then_some(pose)).collect()
    }

    /// Smallest distance of the fingers to the surrounding parts, m; infinite without any.
    fn finger_gap_m(&self, part: &PartShape, base_from_tcp: &Isometry3<f64>, opening_m: f64) -> f64 {
        let fingers = fingers_in_base(base_from_tcp, part.jaw_width_m().min(opening_m), opening_m, thickness_m(part));
        self.neighbours(part)
            .flat_map(|neighbour| fingers.each_ref().map(|finger| gap_m(finger, &neighbour)))
            .fold(f64::INFINITY, f64::min)
    }

    /// Outlines of the surrounding parts, base frame, m.
    fn neighbours(&self, part: &PartShape) -> impl Iterator<Item = Polygon> {
        self.neighbours_in_base(0.0).map(|base_from_part| part.outline_in_base(&base_from_part))
    }

    /// The smallest sufficient pitch, increased along the tray's x, y, or both, in whole millimetres.
    fn sufficient_pitch(&self, along: [bool; 2], does: impl Fn(&Self) -> bool) -> Option<[f64; 2]> {
        const MAX_STEPS: u32 = 300;
        let before_m = self.tray.as_ref()?.pitch_m;
        let does = |steps: [u32; 2]| {
            let mut goal = self.clone();
            let pitch_m = [0, 1].map(|axis| longer_m(before_m[axis], steps[axis]));
            goal.tray.as_mut()?.pitch_m = pitch_m;
            does(&goal).then_some(pitch_m)
        };
        let both = |step: u32| along.map(|is_longer| if is_longer { step } else { 0 });
        let (num, mut pitch_m) = (1..=MAX_STEPS).find_map(|step| Some((step, does(both(step))?)))?;
        if along == [true, true] {
            // Along one of the axes a smaller increase may be sufficient.
            let fewer = (0..num).find_map(|step| does([step, num]).or_else(|| does([num, step])));
            pitch_m = fewer.unwrap_or(pitch_m);
        }
        Some(pitch_m)
    }
}

/// A length, unchanged for 0 `steps`, otherwise rounded down to whole millimetres and increased by `steps` millimetres.
fn longer_m(before_m: f64, steps: u32) -> f64 {
    const STEP_M: f64 = 1e-3;
    if steps == 0 { before_m } else { ((before_m / STEP_M + ROUNDING_M).floor() + f64::from(steps)) * STEP_M }
}

fn told([along_m, across_m]: [f64; 2]) -> String {
    format!("{:.0} x {:.0} mm", along_m * 1e3, across_m * 1e3)
}

/// Largest thickness of a finger along its motion, between its tip and the height of the part's top, m.
fn thickness_m(part: &PartShape) -> f64 {
    finger_thickness_m(part.top_m() - part.grasp_height_m())
}

/// The areas that the two fingers cover on the table from the closed to the open position, base frame, m.
fn fingers_in_base(base_from_tcp: &Isometry3<f64>, closed_m: f64, opening_m: f64, thickness_m: f64) -> [Polygon; 2] {
    let (x, inner, outer) = (FINGER_HALF_WIDTH_M, 0.5 * closed_m, 0.5 * opening_m + thickness_m);
    [1.0, -1.0].map(|side: f64| {
        let corners = [[-x, inner], [x, inner], [x, outer], [-x, outer]];
        let in_base = corners.map(|[x, y]| (base_from_tcp * Point3::new(x, side * y, 0.0)).xy());
        Polygon { vertices: in_base.to_vec() }
    })
}

/// Distance between two convex polygons, m; if they overlap, minus the length of the shortest displacement that
/// separates them.
pub(crate) fn gap_m(one: &Polygon, other: &Polygon) -> f64 {
    let edges = one.edges().chain(other.edges());
    let separation_m = edges.filter_map(|(from, to)| {
        let along = (to - from).try_normalize(0.0)?;
        let across = |polygon: &Polygon| {
            let heights = polygon.vertices.iter().map(|p| along.perp(&(p - from)));
            heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), height| (low.min(height), high.max(height)))
        };
        let ((low, high), (other_low, other_high)) = (across(one), across(other));
        Some((other_low - high).max(low - other_high))
    });
    let separation_m = separation_m.fold(f64::NEG_INFINITY, f64::max);
    if separation_m <= 0.0 {
        return separation_m;
    }
    let from_corners = |corners: &Polygon, polygon: &Polygon| {
        corners.vertices.iter().map(|p| polygon.distance_to_edge(p)).fold(f64::INFINITY, f64::min)
    };
    from_corners(one, other).min(from_corners(other, one))
}

#[cfg(test)]
mod tests;

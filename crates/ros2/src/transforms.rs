//! tf: the transforms between frames over the last seconds.
//!
//! ```text
//! /tf, /tf_static ─ TfMessage ─ Transforms: each frame's parent, and its poses in the parent over time ─ target_from_source at a time
//! ```

use std::collections::{HashMap, VecDeque};

use nalgebra::Isometry3;

use crate::error::RosError;
use crate::messages::{TfMessage, Time};

/// Length of the stored history of a frame, s.
const HISTORY_SECS: f64 = 10.0;
/// Maximum number of stored poses of a frame: 10 s at 400 Hz.
const MAX_POSES: usize = 4000;
/// Maximum number of frames, as a limit for data from the network; no cell has as many.
const MAX_FRAMES: usize = 2000;
/// Maximum length of a chain of frames; a longer chain counts as a loop.
const MAX_DEPTH: usize = 100;

/// The known transforms between frames.
#[derive(Debug, Clone)]
pub struct Transforms {
    frames: HashMap<String, Placed>,
    max_age_secs: f64,
}

#[derive(Debug, Clone)]
struct Placed {
    parent: String,
    motion: Motion,
}

#[derive(Debug, Clone)]
enum Motion {
    Static(Isometry3<f64>),
    /// Time in seconds and `parent_from_child`, the oldest first.
    Moving(VecDeque<(f64, Isometry3<f64>)>),
}

/// A frame's name without the slash that tf 1 wrote before names.
fn frame(name: &str) -> &str {
    name.strip_prefix('/').unwrap_or(name)
}

impl Transforms {
    /// Starts without transforms. A pose of a moving frame is interpolated between two known ones, and outside the
    /// stored history it is the nearest one. The time of the nearest one differs by at most `max_age_secs`.
    pub fn new(max_age_secs: f64) -> Self {
        Self { frames: HashMap::new(), max_age_secs }
    }

    /// Adds the transforms of a message; returns the number of unusable ones.
    pub fn add(&mut self, message: &TfMessage, is_static: bool) -> usize {
        message.transforms.iter().filter(|transform| !self.add_one(transform, is_static)).count()
    }

    fn add_one(&mut self, transform: &crate::messages::TransformStamped, is_static: bool) -> bool {
        let [parent, child] =
            [&transform.header.frame_id, &transform.child_frame_id].map(|name| frame(name).to_owned());
        let Some(parent_from_child) = transform.transform.isometry() else { return false };
        let is_full = self.frames.len() >= MAX_FRAMES && !self.frames.contains_key(&child);
        if parent.is_empty() || child.is_empty() || parent == child || is_full {
            return false;
        }
        if is_static {
            self.frames.insert(child, Placed { parent, motion: Motion::Static(parent_from_child) });
            return true;
        }
        let secs = transform.header.stamp.secs();
        let placed = self
            .frames
            .entry(child)
            .or_insert_with(|| Placed { parent: parent.clone(), motion: Motion::Moving(VecDeque::new()) });
        if placed.parent != parent || matches!(placed.motion, Motion::Static(_)) {
            *placed = Placed { parent, motion: Motion::Moving(VecDeque::new()) };
        }
        if let Motion::Moving(poses) = &mut placed.motion {
            // If the clock was set back by more than the history's length, the history starts again.
            if poses.back().is_some_and(|(newest, _)| secs < newest - HISTORY_SECS) {
                poses.clear();
            }
            let at = poses.partition_point(|(known, _)| *known < secs);
            poses.insert(at, (secs, parent_from_child));
            let newest = poses.back().map_or(secs, |(newest, _)| *newest);
            while poses.len() > MAX_POSES || poses.front().is_some_and(|(oldest, _)| *oldest < newest - HISTORY_SECS) {
                poses.pop_front();
            }
        }
        true
    }

    /// `target_from_source` at a time.
    ///
    /// # Errors
    /// [`RosError::Transform`] for frames without a connection, and for a pose that is too old or too new for the time.
    pub fn lookup(&self, target: &str, source: &str, time: Time) -> Result<Isometry3<f64>, RosError> {
        let (target, source) = (frame(target), frame(source));
        let refused =
            |why: String| RosError::Transform { target_frame: target.into(), source_frame: source.into(), why };
        let of_target = self.ancestors(target);
        let of_source = self.ancestors(source);
        let common = of_source.iter().find(|frame| of_target.contains(frame));
        let Some(common) = common else {
            let is_known = |frame: &str| {
                self.frames.contains_key(frame) || self.frames.values().any(|placed| placed.parent == frame)
            };
            let unknown = [source, target].into_iter().find(|frame| !is_known(frame));
            return Err(refused(match unknown {
                Some(frame) => format!("no transform of \"{frame}\" was received on /tf and /tf_static"),
                None => "the frames are not connected".to_owned(),
            }));
        };
        let common_from = |frames: &[String]| {
            let below = frames.iter().take_while(|frame| *frame != common);
            below.map(|frame| self.in_parent(frame, time.secs())).try_fold(Isometry3::identity(), |inner, outer| {
                outer.map(|parent_from_child| parent_from_child * inner)
            })
        };
        let common_from_source = common_from(&of_source).map_err(refused)?;
        let common_from_target = common_from(&of_target).map_err(refused)?;
        Ok(common_from_target.inverse() * common_from_source)
    }

    /// A frame and all its ancestors.
    fn ancestors(&self, frame: &str) -> Vec<String> {
        let mut frames = vec![frame.to_owned()];
        while let Some(placed) = frames.last().and_then(|frame| self.frames.get(frame))
            && frames.len() < MAX_DEPTH
        {
            frames.push(placed.parent.clone());
        }
        frames
    }

    fn in_parent(&self, frame: &str, secs: f64) -> Result<Isometry3<f64>, String> {
        let Some(placed) = self.frames.get(frame) else { return Err(format!("\"{frame}\" has no parent")) };
        let poses = match &placed.motion {
            Motion::Static(pose) => return Ok(*pose),
            Motion::Moving(poses) => poses,
        };
        let after = poses.partition_point(|(known, _)| *known < secs);
        let stale = |known: f64| {
            let (apart, side) = if known < secs { (secs - known, "before") } else { (known - secs, "after") };
            let limit = self.max_age_secs;
            (apart > limit).then(|| {
                format!("stale: \"{frame}\" was last received {apart:.2} s {side} the picture, at most {limit:.2} s are allowed")
            })
        };
        match (after.checked_sub(1).and_then(|before| poses.get(before)), poses.get(after)) {
            (Some((from, pose)), Some((to, next))) => {
                let share = (secs - from) / (to - from);
                if let Some(why) = stale(if share < 0.5 { *from } else { *to }) {
                    return Err(why);
                }
                let between = pose.try_lerp_slerp(next, share, 1e-9);
                Ok(between.unwrap_or(if share < 0.5 { *pose } else { *next }))
            }
            (Some((known, pose)), None) | (None, Some((known, pose))) => stale(*known).map_or(Ok(*pose), Err),
            (None, None) => Err(format!("no pose of \"{frame}\" is known")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{Header, TransformStamped};
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    fn transform(parent: &str, child: &str, secs: f64, pose: Isometry3<f64>) -> TfMessage {
        let stamp = Time { sec: secs as i32, nanosec: (secs.fract() * 1e9).round() as u32 };
        let header = Header { stamp, frame_id: parent.to_owned() };
        TfMessage {
            transforms: vec![TransformStamped { header, child_frame_id: child.to_owned(), transform: pose.into() }],
        }
    }

    fn along(x: f64, yaw: f64) -> Isometry3<f64> {
        Isometry3::from_parts(Translation3::new(x, 0.0, 0.0), UnitQuaternion::from_euler_angles(0.0, 0.0, yaw))
    }

    fn at(secs: f64) -> Time {
        Time { sec: secs as i32, nanosec: (secs.fract() * 1e9).round() as u32 }
    }

    fn known() -> Transforms {
        let mut transforms = Transforms::new(0.5);
        transforms.add(&transform("base", "hand", 10.0, along(1.0, 0.0)), false);
        transforms.add(&transform("base", "hand", 11.0, along(3.0, 1.0)), false);
        transforms.add(&transform("hand", "camera", 0.0, along(0.1, 0.0)), true);
        transforms.add(&transform("base", "table", 0.0, along(-1.0, 0.0)), true);
        transforms
    }

    #[test]
    fn chains_are_followed_up_and_down_and_motions_interpolated() {
        let transforms = known();
        let halfway = transforms.lookup("base", "hand", at(10.5)).unwrap();
        assert!((halfway.translation.x - 2.0).abs() < 1e-6 && (halfway.rotation.angle() - 0.5).abs() < 1e-6);
        let camera = transforms.lookup("base", "camera", at(10.0)).unwrap();
        assert!((camera.translation.vector - Vector3::new(1.1, 0.0, 0.0)).norm() < 1e-9);
        let from_table = transforms.lookup("table", "camera", at(10.0)).unwrap();
        assert!((from_table.translation.x - 2.1).abs() < 1e-9);
        let back = transforms.lookup("camera", "table", at(10.0)).unwrap();
        assert!((back * from_table).translation.vector.norm() < 1e-9);
        assert_eq!(transforms.lookup("hand", "hand", at(10.0)).unwrap(), Isometry3::identity());
        assert_eq!(transforms.lookup("/base", "/camera", at(10.0)).unwrap(), camera);
    }

    #[test]
    fn old_poses_and_unknown_frames_are_refused() {
        let transforms = known();
        assert!(transforms.lookup("base", "camera", at(11.4)).is_ok());
        let error = transforms.lookup("base", "camera", at(12.0)).unwrap_err().to_string();
        assert_eq!(
            error,
            "no transform from \"camera\" to \"base\": stale: \"hand\" was last received 1.00 s before the picture, at most \
             0.50 s are allowed"
        );
        assert!(transforms.lookup("base", "camera", at(9.0)).unwrap_err().to_string().contains("after the picture"));
        let error = transforms.lookup("base", "lidar", at(10.0)).unwrap_err().to_string();
        assert!(error.contains("no transform of \"lidar\" was received"), "{error}");
        // Between two poses, the nearer one counts.
        let mut gap = Transforms::new(0.5);
        gap.add(&transform("base", "hand", 0.0, along(1.0, 0.0)), false);
        gap.add(&transform("base", "hand", 9.0, along(3.0, 0.0)), false);
        assert!(gap.lookup("base", "hand", at(0.4)).is_ok() && gap.lookup("base", "hand", at(8.6)).is_ok());
        let error = gap.lookup("base", "hand", at(4.5)).unwrap_err().to_string();
        assert!(error.contains("4.50 s after the picture, at most 0.50 s are allowed"), "{error}");
        let mut apart = known();
        apart.add(&transform("map", "odom", 0.0, along(0.0, 0.0)), true);
        assert!(apart.lookup("odom", "hand", at(10.0)).unwrap_err().to_string().contains("frames are not connected"));
    }

    #[test]
    fn what_is_no_transform_is_counted_and_left_out() {
        let mut transforms = known();
        let mut bad = transform("base", "hand", 12.0, along(f64::NAN, 0.0));
        assert_eq!(transforms.add(&bad, false), 1);
        bad.transforms[0].transform = Default::default();
        assert_eq!(transforms.add(&bad, false), 1, "a quaternion of zeros");
        assert_eq!(transforms.add(&transform("a", "a", 0.0, along(0.0, 0.0)), true), 1);
        // The search ends in spite of the loop.
        transforms.add(&transform("hand", "base", 10.0, along(0.0, 0.0)), false);
        assert!(transforms.lookup("base", "lidar", at(10.0)).is_err());
        for frame in 0..3000 {
            transforms.add(&transform("base", &format!("f{frame}"), 0.0, along(0.0, 0.0)), true);
        }
        assert!(transforms.frames.len() <= MAX_FRAMES);
    }

    #[test]
    fn of_many_poses_the_newest_are_kept() {
        let mut transforms = Transforms::new(0.5);
        for tick in 0..MAX_POSES + 100 {
            transforms.add(&transform("base", "hand", tick as f64 * 1e-3, along(0.0, 0.0)), false);
        }
        let Motion::Moving(poses) = &transforms.frames["hand"].motion else { panic!() };
        assert_eq!(poses.len(), MAX_POSES);
        assert!((poses.front().unwrap().0 - 0.1).abs() < 1e-9);
    }

    #[test]
    fn ten_seconds_are_kept() {
        let mut transforms = Transforms::new(0.5);
        for tick in 0..3000 {
            transforms.add(&transform("base", "hand", f64::from(tick) * 0.01, along(0.0, 0.0)), false);
        }
        let Motion::Moving(poses) = &transforms.frames["hand"].motion else { panic!() };
        assert!((1000..=1002).contains(&poses.len()), "{}", poses.len());
        assert!(transforms.lookup("base", "hand", at(12.0)).unwrap_err().to_string().contains("stale"));
    }
}

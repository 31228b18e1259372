//! Perception as an arm's sequence asks for it.
//!
//! ```text
//! Pictures ─ picture, when it was taken ─ Perception over the table ─ poses in the robot's base ─ GraspTarget
//! Arm ─ state ─ place of a camera on the hand ──────┘
//! ```

use std::time::{Duration, Instant, SystemTime};

use image::RgbImage;
use nalgebra::{Isometry3, Point2};
use sdg_camera::LatestFrame;
use sdg_grasp::{CameraOverTable, GraspModel, Verification};
use sdg_kinematics::Panda;
use sdg_robot::{Arm, GraspTarget, PartFinder, Place, RobotError};

use crate::perception::{Found, Perception};
use crate::placed_camera::PlacedCamera;

/// How long a picture that was taken after the arm stopped is waited for.
const MAX_WAIT: Duration = Duration::from_secs(5);

/// A picture, and when it was taken where time passes by a clock.
#[derive(Debug, Clone)]
pub struct TakenPicture {
    /// The picture.
    pub picture: RgbImage,
    /// When it was taken.
    pub taken: Option<Instant>,
}

/// Source of pictures while a grasp runs.
pub trait Pictures<A: Arm> {
    /// Takes a picture after the arm has stopped, which is before this call.
    ///
    /// # Errors
    /// No such picture in time; the camera's own errors.
    fn take(&mut self, arm: &mut A) -> sdg_robot::Result<TakenPicture>;
}

/// A live camera.
pub struct LivePictures(pub LatestFrame);

impl<A: Arm> Pictures<A> for LivePictures {
    fn take(&mut self, _arm: &mut A) -> sdg_robot::Result<TakenPicture> {
        let (now, called) = (SystemTime::now(), Instant::now());
        let failed = |why: String| RobotError::Perception(why);
        loop {
            let left = MAX_WAIT.saturating_sub(called.elapsed());
            let frame = match self.0.take(left) {
                Ok(Some(frame)) => frame,
                Ok(None) if self.0.has_ended() => return Err(failed("the camera has no more pictures".to_owned())),
                Ok(None) => {
                    let secs = MAX_WAIT.as_secs();
                    return Err(failed(format!("no picture for {secs} s that was taken after the arm stopped")));
                }
                Err(error) if error.is_passing() && called.elapsed() < MAX_WAIT => continue,
                Err(error) => return Err(failed(error.to_string())),
            };
            if frame.captured < now {
                continue;
            }
            if let Some(fault) = frame.faults.first() {
                return Err(failed(format!("{}: {fault}", frame.camera)));
            }
            let age = SystemTime::now().duration_since(frame.captured).unwrap_or_default();
            return Ok(TakenPicture { picture: frame.picture, taken: Instant::now().checked_sub(age) });
        }
    }
}

/// Where a part lies: its outline, m in the base frame, and the z of the table and of the outline.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenOutline {
    /// Corners, in metres.
    pub outline_in_base: Vec<Point2<f64>>,
    /// Heights of the table and of the outline, in metres.
    pub z_m: [f64; 2],
}

/// A model behind a calibrated camera on or beside an arm.
#[derive(Debug)]
pub struct ModelFinder<P> {
    pictures: P,
    camera: PlacedCamera,
    perception: Perception,
    taken: Option<Instant>,
    /// Whether detections are checked against the demonstration.
    verification: Verification,
    /// The last picture, and its detections, best first.
    last: Option<(RgbImage, Vec<Found>)>,
    /// The best part of the last picture.
    seen: Option<SeenOutline>,
    /// The other sure parts of the last picture.
    others: Vec<GraspTarget>,
    /// Where parts are put down: those that lie there are not to be taken.
    pub places: Vec<Place>,
}

impl<P> ModelFinder<P> {
    /// Looks for the model's part through the camera.
    pub fn new(model: GraspModel, camera: PlacedCamera, pictures: P) -> Self {
        let perception = Perception::of_any_camera(model);
        Self {
            pictures,
            camera,
            perception,
            taken: None,
            verification: Verification::ByShape,
            last: None,
            seen: None,
            others: Vec::new(),
            places: Vec::new(),
        }
    }

    /// The same, with detections checked or not.
    pub fn with_verification(self, verification: Verification) -> Self {
        Self { verification, ..self }
    }

    /// The last picture, and its detections, best first.
    pub fn last(&self) -> Option<(&RgbImage, &[Found])> {
        self.last.as_ref().map(|(picture, found)| (picture, found.as_slice()))
    }

    /// Where the best part of the last picture lies.
    pub fn seen(&self) -> Option<&SeenOutline> {
        self.seen.as_ref()
    }

    /// All parts in a picture, the best first.
    fn find_all<A: Arm>(&mut self, arm: &mut A) -> sdg_robot::Result<Vec<GraspTarget>>
    where
        P: Pictures<A>,
    {
        let state = arm.state()?;
        let TakenPicture { picture, taken } = self.pictures.take(arm)?;
        self.taken = taken;
        let place = self.camera.over_table(&Panda::new().base_from_flange(&state.q));
        self.perception.move_to(&place)?;
        let found = self.perception.detect(&picture, self.verification)?;
        self.seen = found.first().and_then(|best| self.outline_of(best, &place));
        let targets = found.iter().filter_map(target).collect();
        self.last = Some((picture, found));
        Ok(targets)
    }

    fn outline_of(&self, found: &Found, place: &CameraOverTable) -> Option<SeenOutline> {
        let table_m = place.table_height_m;
        let mark_m = self.perception.model().facts().lengths.map_or(table_m, |lengths| table_m + lengths.mark_height_m);
        let on_plane = |pixel| place.camera.at_height(pixel, mark_m).map(|p_in_base| p_in_base.xy());
        let corners = &found.detection.outline.as_ref()?.vertices;
        let outline_in_base = corners.iter().map(on_plane).collect::<Option<Vec<_>>>()?;
        Some(SeenOutline { outline_in_base, z_m: [table_m, mark_m] })
    }

    fn keep_others(&mut self, found: Vec<GraspTarget>, chosen: Option<&GraspTarget>) {
        self.others = found;
        self.others.retain(|other| other.score >= sdg_robot::SURE && chosen.is_none_or(|chosen| other != chosen));
    }
}

/// A detection as the sequence takes it.
fn target(found: &Found) -> Option<GraspTarget> {
    let pose = found.pose?;
    Some(GraspTarget {
        base_from_tcp: pose.frame_from_tcp(),
        jaw_width_m: pose.opening_m,
        score: found.detection.score,
    })
}

impl<A: Arm, P: Pictures<A>> PartFinder<A> for ModelFinder<P> {
    fn find(&mut self, arm: &mut A) -> sdg_robot::Result<Option<GraspTarget>> {
        let found = self.find_all(arm)?;
        let is_placed = |target: &GraspTarget| {
            let p = target.base_from_tcp.translation;
            self.places.iter().any(|place| place.covers([p.x, p.y]))
        };
        let best = found.iter().copied().find(|target| !is_placed(target));
        self.keep_others(found, best.as_ref());
        Ok(best)
    }

    fn find_nearest(&mut self, arm: &mut A, base_from_tcp: &Isometry3<f64>) -> sdg_robot::Result<Option<GraspTarget>> {
        let apart_m = |target: &GraspTarget| {
            (target.base_from_tcp.translation.vector - base_from_tcp.translation.vector).xy().norm()
        };
        let found = self.find_all(arm)?;
        let sure = found.iter().copied().filter(|target| target.score >= sdg_robot::SURE);
        let nearest = sure.min_by(|a, b| apart_m(a).total_cmp(&apart_m(b)));
        self.keep_others(found, nearest.as_ref());
        Ok(nearest)
    }

    fn others(&self) -> Vec<GraspTarget> {
        self.others.clone()
    }

    fn picture_time(&self) -> Option<Instant> {
        self.taken
    }
}

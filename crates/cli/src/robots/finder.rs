//! A grasp model as an arm's perception.
//!
//! ```text
//! Pictures ─ picture, when it was taken ─ PlanDetector over the table ─ best pose in the base frame ─ GraspTarget
//! Arm ─ state ─ where a camera on the hand is ──────┘
//! ```

use std::time::{Duration, Instant, SystemTime};

use anyhow::{Result, bail};
use image::RgbImage;
use nalgebra::Isometry3;
use sdg_calibration::{CalibratedCamera, Frame};
use sdg_camera::LatestFrame;
use sdg_geometry::PosedCamera;
use sdg_grasp::{CameraOverTable, GraspModel, PlanDetector, Verification};
use sdg_kinematics::Panda;
use sdg_robot::workcell::Mounting;
use sdg_robot::{Arm, CameraMount, GraspTarget, PartFinder, Place, RobotError};

/// How long a picture that was taken after the arm stopped is waited for.
const MAX_WAIT: Duration = Duration::from_secs(5);

/// A calibrated camera and where it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlacedCamera {
    intrinsics: sdg_geometry::PinholeCamera,
    place: CameraPose,
    table_height_m: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum CameraPose {
    OnFlange(Isometry3<f64>),
    InBase(Isometry3<f64>),
}

impl PlacedCamera {
    /// The camera of a file, mounted as the workcell says.
    ///
    /// # Errors
    /// A file without what the mounting needs: `hand_eye:`, or `table:` in the robot's base.
    pub(crate) fn new(camera: &CalibratedCamera, mounting: Mounting, table_height_m: f64) -> Result<Self> {
        let place = match (mounting, camera.flange_from_camera, &camera.table) {
            (Mounting::Hand, Some(flange_from_camera), _) => CameraPose::OnFlange(flange_from_camera),
            (Mounting::Hand, None, _) => bail!(
                "expected hand_eye: flange_from_camera, since the workcell mounts the camera on the hand; \
                 sdg camera hand-eye --mount hand measures it"
            ),
            (Mounting::Base, _, Some(table)) if table.frame == Frame::Base => {
                CameraPose::InBase(table.frame_from_camera)
            }
            (Mounting::Base, ..) => bail!(
                "expected table: with frame: base, since the workcell mounts the camera beside the robot; \
                 sdg camera hand-eye --mount base or sdg camera table --sheet-in-base-mm measures it"
            ),
        };
        Ok(Self { intrinsics: camera.intrinsics, place, table_height_m })
    }

    /// Width and height of its pictures.
    pub(crate) fn size_px(&self) -> [u32; 2] {
        [self.intrinsics.width, self.intrinsics.height]
    }

    /// The camera's mount, as the grasp sequence takes it.
    pub(crate) fn mount(&self) -> CameraMount {
        match self.place {
            CameraPose::OnFlange(flange_from_camera) => {
                CameraMount::Hand { tcp_from_camera: Panda::new().flange_from_tcp().inverse() * flange_from_camera }
            }
            CameraPose::InBase(_) => CameraMount::Base,
        }
    }

    /// Intrinsics and mount, as the simulator takes them.
    #[cfg(feature = "simulation")]
    pub(crate) fn simulated(&self) -> (sdg_geometry::PinholeCamera, sdg_simulation::CameraPlace) {
        let place = match self.place {
            CameraPose::OnFlange(flange_from_camera) => sdg_simulation::CameraPlace::OnFlange(flange_from_camera),
            CameraPose::InBase(base_from_camera) => sdg_simulation::CameraPlace::InBase(base_from_camera),
        };
        (self.intrinsics, place)
    }

    fn over_table(&self, base_from_flange: &Isometry3<f64>) -> CameraOverTable {
        let world_from_camera = match self.place {
            CameraPose::OnFlange(flange_from_camera) => base_from_flange * flange_from_camera,
            CameraPose::InBase(base_from_camera) => base_from_camera,
        };
        let camera = PosedCamera { intrinsics: self.intrinsics, world_from_camera };
        CameraOverTable { camera, table_height_m: self.table_height_m, workspace: None }
    }
}

/// A picture, and when it was taken where time passes by a clock.
pub(crate) struct TakenPicture {
    pub(crate) picture: RgbImage,
    pub(crate) taken: Option<Instant>,
}

/// Source of pictures while a grasp runs.
pub(crate) trait Pictures<A: Arm> {
    /// A picture that was taken after the arm came to rest, which is before this call.
    fn take(&mut self, arm: &mut A) -> sdg_robot::Result<TakenPicture>;
}

/// A live camera.
pub(crate) struct LivePictures(pub(crate) LatestFrame);

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

/// The camera of the simulated workcell.
#[cfg(feature = "simulation")]
pub(crate) struct SimulatedPictures;

#[cfg(feature = "simulation")]
impl Pictures<sdg_simulation::Workcell> for SimulatedPictures {
    fn take(&mut self, cell: &mut sdg_simulation::Workcell) -> sdg_robot::Result<TakenPicture> {
        Ok(TakenPicture { picture: cell.wrist_view()?.image, taken: None })
    }
}

/// Where a part lies: its outline, m in the base frame, and the z of the table and of the outline.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SeenOutline {
    pub(crate) outline_in_base: Vec<nalgebra::Point2<f64>>,
    pub(crate) z_m: [f64; 2],
}

/// A model behind a calibrated camera on or beside an arm.
pub(crate) struct ModelFinder<P> {
    pub(crate) pictures: P,
    pub(crate) camera: PlacedCamera,
    model: GraspModel,
    detector: Option<PlanDetector>,
    taken: Option<Instant>,
    /// The last picture with what was found in it.
    pub(crate) last: Option<RgbImage>,
    /// The best part of the last picture.
    pub(crate) seen: Option<SeenOutline>,
    /// What else it shows for sure.
    others: Vec<GraspTarget>,
    /// Parts that lie there are not to be taken: where parts are put down.
    pub(crate) places: Vec<Place>,
}

impl<P> ModelFinder<P> {
    pub(crate) fn new(model: GraspModel, camera: PlacedCamera, pictures: P) -> Self {
        Self {
            pictures,
            camera,
            model,
            detector: None,
            taken: None,
            last: None,
            seen: None,
            others: Vec::new(),
            places: Vec::new(),
        }
    }
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

impl<P> ModelFinder<P> {
    fn keep_others(&mut self, found: Vec<GraspTarget>, chosen: Option<&GraspTarget>) {
        self.others = found;
        self.others.retain(|other| other.score >= sdg_robot::SURE && chosen.is_none_or(|chosen| other != chosen));
    }

    /// All that is found in a picture, the best first.
    fn find_all<A: Arm>(&mut self, arm: &mut A) -> sdg_robot::Result<Vec<GraspTarget>>
    where
        P: Pictures<A>,
    {
        let state = arm.state()?;
        let TakenPicture { picture, taken } = self.pictures.take(arm)?;
        self.taken = taken;
        let over_table = self.camera.over_table(&Panda::new().base_from_flange(&state.q));
        let (width, height) = picture.dimensions();
        let expected = (over_table.camera.intrinsics.width, over_table.camera.intrinsics.height);
        if (width, height) != expected {
            let (w, h) = expected;
            return Err(RobotError::Perception(format!("expected pictures of {w}x{h} pixels, found {width}x{height}")));
        }
        let failed = |error: sdg_grasp::GraspError| RobotError::Perception(error.to_string());
        let detector = match self.detector.take() {
            Some(detector) => detector.moved_to(&over_table),
            None => PlanDetector::new(self.model.clone(), &over_table),
        }
        .map_err(failed)?;
        let detector = self.detector.insert(detector);
        let found = detector.detect(&picture, Verification::ByShape).map_err(failed)?;
        let detections: Vec<_> = found.iter().map(|found| found.detection.clone()).collect();
        self.last = Some(crate::pictures::with_detections(&picture, &detections));
        let table_m = self.camera.table_height_m;
        let mark_m = self.model.facts().lengths.map_or(table_m, |lengths| table_m + lengths.mark_height_m);
        self.seen = found.first().and_then(|best| best.detection.outline.as_ref()).and_then(|outline| {
            let on_plane = |pixel| over_table.camera.at_height(pixel, mark_m).map(|p_in_base| p_in_base.xy());
            let outline_in_base = outline.vertices.iter().map(on_plane).collect::<Option<Vec<_>>>()?;
            Some(SeenOutline { outline_in_base, z_m: [table_m, mark_m] })
        });
        let targets = found.iter().map(|found| GraspTarget {
            base_from_tcp: found.pose.frame_from_tcp(),
            jaw_width_m: found.pose.opening_m,
            score: found.detection.score,
        });
        Ok(targets.collect())
    }
}

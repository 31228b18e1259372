//! Perception as the sequence of an arm uses it.
//!
//! ```text
//! Pictures ─ picture and its time ──────────── Perception ─ poses in the robot's base ─ GraspTarget
//! Arm ─ state ─ pose of a camera on the hand ──────┘
//! ```

use std::ops::RangeInclusive;
use std::time::{Duration, Instant, SystemTime};

use image::RgbImage;
use nalgebra::{Isometry3, Point2, Point3};
use sdg_camera::LatestFrame;
use sdg_geometry::Polygon;
use sdg_grasp::{CameraOverTable, Circumstances, ErrorLength, GraspModel, Lengths, Verification};
use sdg_robot::height::{GivenHeight, MeasuredHeight, Sighting};
use sdg_robot::{Arm, CameraPose, GraspTarget, PartFinder, Place, RobotError};

use crate::mounted_camera::MountedCamera;
use crate::perception::{Found, Perception};
use crate::surface::{PartOnSurface, PosedPicture, surface_height};

/// Maximum wait for a picture taken after the arm stopped.
const MAX_WAIT: Duration = Duration::from_secs(5);

/// A picture, and its capture time unless time is simulated.
#[derive(Debug, Clone)]
pub struct TakenPicture {
    /// The picture.
    pub picture: RgbImage,
    /// The capture time.
    pub taken: Option<Instant>,
}

/// A source of pictures during a grasp.
pub trait Pictures<A: Arm> {
    /// Takes a picture that was captured after this call. The arm is at rest.
    ///
    /// # Errors
    /// No picture arrives in time, or the camera fails.
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
                    return Err(failed(format!("no picture taken after the arm stopped arrived within {secs} s")));
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

/// The position of a part in the base frame: its outline, and the heights of the surface under the part and of the
/// outline.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenOutline {
    /// Corners of the outline (x, y), in metres.
    pub outline_in_base: Vec<Point2<f64>>,
    /// z of the surface under the part and of the outline, in metres.
    pub z_m: [f64; 2],
}

/// Finds the model's part with a calibrated camera on the arm's hand or beside the arm.
#[derive(Debug)]
pub struct ModelFinder<P> {
    pictures: P,
    camera: MountedCamera,
    perception: Perception,
    taken: Option<Instant>,
    /// Whether detections are checked against the demonstration.
    verification: Verification,
    /// The last picture for a grasp and its detections, best first.
    last: Option<(RgbImage, Vec<Found>)>,
    /// The part that the last search chose.
    seen: Option<SeenOutline>,
    /// The other accepted parts of the last picture.
    others: Vec<GraspTarget>,
    /// Range of heights above the table at which parts may lie, in metres; `None` if parts lie on the table.
    heights_m: Option<RangeInclusive<f64>>,
    /// The pictures used for measuring heights, with their detections.
    sights: Vec<Sights>,
    /// Places where parts are put down. Parts that lie in them are not grasped.
    pub places: Vec<Place>,
}

/// A picture and its parts, each with its outline (base frame, in metres) in the plane at the height of
/// [`Sighting::middle_m`].
#[derive(Debug)]
struct Sights {
    picture: PosedPicture,
    parts: Vec<(Sighting, Polygon)>,
}

/// Range of heights above the table at which parts may lie, in metres, if no height is given.
pub const UNKNOWN_HEIGHTS_M: RangeInclusive<f64> = -0.010..=0.080;
/// Relative margin of the searched sizes at both ends of their range, for errors of poses.
const SIZE_LEEWAY: f64 = 0.03;
/// Standard deviation of a height that was derived from the part's apparent size, in metres.
const HEIGHT_BY_SIZE_SIGMA_M: f64 = 0.015;
/// In a picture for measuring a height: maximum horizontal distance of the part from its expected position, in metres.
const SAME_PART_M: f64 = 0.040;
/// Margin added to the height of the part's top, in metres.
const TOP_LEEWAY_M: f64 = 0.002;
/// The surface is searched within this number of standard deviations of the expected height.
const SURFACE_SIGMAS: f64 = 3.5;
/// Smallest and largest half width of the range in which the surface is searched, in metres.
const SURFACE_WITHIN_M: [f64; 2] = [0.004, 0.009];
/// Ratio of the radius that contains 68 % of position errors to their standard deviation along x or y.
const SIGMAS_OF_RADIUS: f64 = 1.51;

impl<P> ModelFinder<P> {
    /// Creates a finder of the model's part with this camera.
    pub fn new(model: GraspModel, camera: MountedCamera, pictures: P) -> Self {
        // A camera on the hand measures the height of the edges at each grasp, and positions in their plane are right.
        let model = match camera.pose {
            CameraPose::OnFlange(_) => model.without_edge_height(),
            CameraPose::InBase(_) => model,
        };
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
            heights_m: None,
            sights: Vec::new(),
            places: Vec::new(),
        }
    }

    /// Sets whether detections are checked against the demonstration.
    pub fn with_verification(self, verification: Verification) -> Self {
        Self { verification, ..self }
    }

    /// Sets the heights above the table at which parts may lie, in metres. The apparent size of a part then gives its
    /// height.
    pub fn with_heights(self, heights_m: RangeInclusive<f64>) -> Self {
        Self { heights_m: Some(heights_m), ..self }
    }

    /// The last picture for a grasp and its detections, best first; not one of [`PartFinder::find_nearest`], which may
    /// show a part that was put down.
    pub fn last(&self) -> Option<(&RgbImage, &[Found])> {
        self.last.as_ref().map(|(picture, found)| (picture, found.as_slice()))
    }

    /// The position of the part that the last search returned; `None` if its outline is unknown.
    pub fn seen(&self) -> Option<&SeenOutline> {
        self.seen.as_ref()
    }

    /// Finds the part for a plan, without measuring the part's height. Searches first for parts whose marks are at the
    /// height `told`, or without it on a surface at [`MountedCamera::table_height_m`]. If no detection there is sure
    /// and [`Self::with_heights`] has set a range, takes a second picture and searches the whole range.
    ///
    /// # Errors
    /// As for [`PartFinder::find`].
    pub fn find_for_plan<A: Arm>(
        &mut self,
        arm: &mut A,
        told: Option<&GivenHeight>,
    ) -> sdg_robot::Result<Option<GraspTarget>>
    where
        P: Pictures<A>,
    {
        let is_sure = |target: &GraspTarget| target.score >= sdg_robot::SURE;
        let higher_m = told.map_or(0.0, |told| told.height_m - self.marks_z_m(self.camera.table_height_m));
        let heights_m = self.heights_m.take();
        let found = self.find_best(arm, higher_m).map(|found| found.filter(is_sure));
        self.heights_m = heights_m;
        match found? {
            None if self.heights_m.is_some() => Ok(self.find(arm)?.filter(is_sure)),
            found => Ok(found),
        }
    }

    /// Assumes that parts lie `higher_m` above the table, and returns the best one outside the places.
    fn find_best<A: Arm>(&mut self, arm: &mut A, higher_m: f64) -> sdg_robot::Result<Option<GraspTarget>>
    where
        P: Pictures<A>,
    {
        let heights_m = self.heights_m.clone();
        let found = self.find_all(arm, higher_m, heights_m.as_ref())?;
        let best = found.iter().position(|(target, _)| !self.is_placed(&target.base_from_tcp));
        Ok(self.choose(found, best))
    }

    /// Whether a part with this grasp lies in one of the places.
    fn is_placed(&self, base_from_tcp: &Isometry3<f64>) -> bool {
        let p = base_from_tcp.translation;
        self.places.iter().any(|place| place.covers([p.x, p.y]))
    }

    /// Keeps the outline of the chosen part, and the other accepted parts. Returns the chosen one.
    fn choose(
        &mut self,
        mut found: Vec<(GraspTarget, Option<SeenOutline>)>,
        chosen: Option<usize>,
    ) -> Option<GraspTarget> {
        let (target, seen) = chosen.map(|idx| found.remove(idx)).unzip();
        self.seen = seen.flatten();
        self.others = found.into_iter().map(|(other, _)| other).collect();
        self.others.retain(|other| other.score >= sdg_robot::SURE);
        target
    }

    /// All parts in a picture with their outlines, best first. Assumes that they lie `higher_m` above the table, or at
    /// one of `heights_m` above the table if these are given.
    fn find_all<A: Arm>(
        &mut self,
        arm: &mut A,
        higher_m: f64,
        heights_m: Option<&RangeInclusive<f64>>,
    ) -> sdg_robot::Result<Vec<(GraspTarget, Option<SeenOutline>)>>
    where
        P: Pictures<A>,
    {
        self.sights.clear();
        let seen = self.look(arm, higher_m, heights_m)?;
        if heights_m.is_none() {
            return Ok(seen.into_iter().map(|(sighting, outline)| (sighting.target, outline)).collect());
        }
        let at_its_height = |(sighting, mut outline): (Sighting, Option<SeenOutline>)| {
            let height_m = sighting.height_by_size_m().unwrap_or(sighting.middle_m.z);
            let target = sighting.at_height(height_m).target;
            if let Some(outline) = &mut outline {
                let higher_m = target.base_from_tcp.translation.z - sighting.target.base_from_tcp.translation.z;
                let share = 1.0 - higher_m / sighting.distance_m();
                let foot = sighting.camera_m.xy();
                outline.outline_in_base.iter_mut().for_each(|corner| *corner = foot + (*corner - foot) * share);
                outline.z_m.iter_mut().for_each(|z_m| *z_m += higher_m);
            }
            (target, outline)
        };
        Ok(seen.into_iter().map(at_its_height).collect())
    }

    /// Takes a picture and finds all parts in it with their outlines, best first. Assumes that they lie `higher_m` above
    /// the table; if `heights_m` is given, also finds parts at these heights above the table.
    fn look<A: Arm>(
        &mut self,
        arm: &mut A,
        higher_m: f64,
        heights_m: Option<&RangeInclusive<f64>>,
    ) -> sdg_robot::Result<Vec<(Sighting, Option<SeenOutline>)>>
    where
        P: Pictures<A>,
    {
        let state = arm.state()?;
        let TakenPicture { picture, taken } = self.pictures.take(arm)?;
        self.taken = taken;
        let mut camera_over_table = self.camera.over_table(&arm.geometry().base_from_flange(&state.q));
        camera_over_table.table_height_m += higher_m;
        self.perception.move_to(&camera_over_table)?;
        let distance_m =
            camera_over_table.camera.world_from_camera.translation.z - self.marks_z_m(camera_over_table.table_height_m);
        self.perception.set_sizes(heights_m.map(|heights_m| {
            // A higher part is nearer to the camera and appears larger.
            let size =
                |height_m: f64| (distance_m / (distance_m + higher_m - height_m).max(0.5 * distance_m)).max(0.51);
            let [low, high] = [size(*heights_m.start()), size(*heights_m.end())];
            (low * (1.0 - SIZE_LEEWAY)).clamp(0.5, 1.0)..=(high * (1.0 + SIZE_LEEWAY)).clamp(1.0, 2.0)
        }))?;
        let found = self.perception.detect(&picture, self.verification)?;
        let outlined = |found: &Found| {
            Some((self.sighting(found, &camera_over_table)?, self.outline_of(found, &camera_over_table)))
        };
        let seen = found.iter().filter_map(outlined).collect();
        self.last = Some((picture, found));
        Ok(seen)
    }

    /// The lengths of the model.
    fn lengths(&self) -> Option<&Lengths> {
        self.perception.model().facts().lengths.as_ref()
    }

    /// z of the marks of a part on a surface at this z, in metres.
    fn marks_z_m(&self, surface_z_m: f64) -> f64 {
        surface_z_m + self.lengths().map_or(0.0, |lengths| lengths.mark_height_m)
    }

    /// Height above the table of the surface under a part with this grasp, in metres.
    fn higher_m(&self, base_from_tcp: &Isometry3<f64>) -> f64 {
        let grasp_height_m = self.lengths().map_or(0.0, |lengths| lengths.grasp_height_m);
        base_from_tcp.translation.z - grasp_height_m - self.camera.table_height_m
    }

    /// Converts a detection to a sighting in the plane of the marks.
    fn sighting(&self, found: &Found, camera_over_table: &CameraOverTable) -> Option<Sighting> {
        let target = target(found)?;
        let marks_z_m = self.marks_z_m(camera_over_table.table_height_m);
        let seen_middle = found.detection.outline.as_ref().map(Polygon::centroid);
        let middle_m = match seen_middle {
            Some(pixel) => camera_over_table.camera.at_height(&pixel, marks_z_m)?,
            None => Point3::new(target.base_from_tcp.translation.x, target.base_from_tcp.translation.y, marks_z_m),
        };
        let pose = found.pose?;
        // The part's visible side walls shift its pose equally in all pictures: this error is not noise.
        let noise_m = ErrorLength::POSITION.metres(&Circumstances { mark_height_m: 0.0, ..pose.circumstances });
        Some(Sighting {
            camera_m: camera_over_table.camera.world_from_camera.translation.vector.into(),
            middle_m,
            place_sigma_m: noise_m / SIGMAS_OF_RADIUS,
            size: self.size_of(found),
            size_sigma: pose.uncertainty.yaw_rad,
            target,
        })
    }

    /// Size of a part in the plane of the marks, relative to the demonstrated size; `None` if the model knows no
    /// lengths, or if the picture was not compared with a demonstration.
    fn size_of(&self, found: &Found) -> Option<f64> {
        found.detection.agreement?;
        let taught = self.perception.model().demonstrations().get(found.detection.demonstration_idx)?;
        Some(found.pose?.opening_m * self.lengths()?.pixels_per_m / taught.marks.width_px)
    }

    fn outline_of(&self, found: &Found, camera_over_table: &CameraOverTable) -> Option<SeenOutline> {
        let table_m = camera_over_table.table_height_m;
        let mark_m = self.marks_z_m(table_m);
        let on_plane = |pixel| camera_over_table.camera.at_height(pixel, mark_m).map(|p_in_base| p_in_base.xy());
        let corners = &found.detection.outline.as_ref()?.vertices;
        let outline_in_base = corners.iter().map(on_plane).collect::<Option<Vec<_>>>()?;
        Some(SeenOutline { outline_in_base, z_m: [table_m, mark_m] })
    }

    /// Keeps the last picture and the outlines of its parts.
    fn keep_views(&mut self, sightings: &[Sighting]) {
        let (Some((picture, found)), Some(camera_over_table)) = (&self.last, self.perception.camera_over_table())
        else {
            return;
        };
        let outlines = found.iter().filter(|found| found.pose.is_some()).map(|found| found.detection.outline.as_ref());
        let parts = sightings.iter().zip(outlines).filter_map(|(sighting, outline)| {
            let on_plane =
                |pixel| camera_over_table.camera.at_height(pixel, sighting.middle_m.z).map(|p_in_base| p_in_base.xy());
            let vertices = outline?.vertices.iter().map(on_plane).collect::<Option<Vec<_>>>()?;
            Some((*sighting, Polygon { vertices }))
        });
        let parts = parts.collect();
        self.sights.push(Sights { picture: PosedPicture::new(picture, camera_over_table.camera), parts });
    }

    /// Measures the height of the surface beside a part in two of the kept pictures.
    fn surface_of(&self, pair: &[Sighting; 2], expected: &MeasuredHeight) -> Option<MeasuredHeight> {
        let lengths = self.lengths()?;
        let kept = |sighting: &Sighting| {
            let shows = |(shown, _): &&(Sighting, Polygon)| shown == sighting;
            self.sights.iter().find_map(|sights| Some((&sights.picture, &sights.parts.iter().find(shows)?.1)))
        };
        let ([one, other], [(first, outline), (second, _)]) = (*pair, [kept(&pair[0])?, kept(&pair[1])?]);
        // The outline in the first picture, moved to the height and position that both pictures give.
        let marks_m = expected.height_m + lengths.mark_height_m;
        let [here, there] = [one.middle_at(marks_m), other.middle_at(marks_m)];
        let share = (one.camera_m.z - marks_m) / one.distance_m();
        let foot = one.camera_m.xy();
        let corner = |p: &Point2<f64>| foot + (p - foot) * share + 0.5 * (there - here);
        let outline_m = Polygon { vertices: outline.vertices.iter().map(corner).collect() };
        let part = PartOnSurface {
            outline_m: &outline_m,
            // A round bar's marks are at half its height; other parts' marks are on top.
            top_m: lengths.mark_height_m.max(2.0 * lengths.grasp_height_m) + TOP_LEEWAY_M,
            expected_m: expected.height_m,
            within_m: (SURFACE_SIGMAS * expected.sigma_m).clamp(SURFACE_WITHIN_M[0], SURFACE_WITHIN_M[1]),
        };
        let found = surface_height([first, second], &part)?;
        Some(MeasuredHeight { height_m: found.height_m, sigma_m: found.sigma_m })
    }
}

/// The heights at which a part is searched that is expected at a height, in metres.
fn heights_around(height_m: f64) -> RangeInclusive<f64> {
    height_m - HEIGHT_BY_SIZE_SIGMA_M..=height_m + HEIGHT_BY_SIZE_SIGMA_M
}

/// A detection as a target of the sequence.
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
        self.find_best(arm, 0.0)
    }

    fn find_nearest(&mut self, arm: &mut A, base_from_tcp: &Isometry3<f64>) -> sdg_robot::Result<Option<GraspTarget>> {
        let apart_m = |target: &GraspTarget| {
            (target.base_from_tcp.translation.vector - base_from_tcp.translation.vector).xy().norm()
        };
        let higher_m = self.higher_m(base_from_tcp);
        let heights_m = self.heights_m.is_some().then(|| heights_around(higher_m));
        let last = self.last.take();
        let found = self.find_all(arm, higher_m, heights_m.as_ref());
        self.last = last;
        let found = found?;
        // Only a part that was put down is searched in a place; before a grasp, parts in places are not the target.
        let is_allowed = |target: &GraspTarget| self.is_placed(base_from_tcp) || !self.is_placed(&target.base_from_tcp);
        let is_sure = |target: &GraspTarget| target.score >= sdg_robot::SURE && is_allowed(target);
        let sure = found.iter().enumerate().filter(|(_, (target, _))| is_sure(target));
        let nearest = sure.min_by(|(_, (a, _)), (_, (b, _))| apart_m(a).total_cmp(&apart_m(b)));
        let nearest = nearest.map(|(idx, _)| idx);
        Ok(self.choose(found, nearest))
    }

    fn sight(&mut self, arm: &mut A, expected: &GraspTarget) -> sdg_robot::Result<Vec<Sighting>> {
        let expected_at = expected.base_from_tcp.translation;
        let higher_m = self.higher_m(&expected.base_from_tcp);
        let seen = self.look(arm, higher_m, Some(&heights_around(higher_m)))?;
        let sightings: Vec<Sighting> = seen.into_iter().map(|(sighting, _)| sighting).collect();
        let is_near = |sighting: &Sighting| {
            let apart = sighting.target.base_from_tcp.translation.vector - expected_at.vector;
            sighting.target.score >= sdg_robot::MIN_CONFIRMING_SCORE && apart.xy().norm() <= SAME_PART_M
        };
        self.keep_views(&sightings);
        Ok(sightings.into_iter().filter(is_near).collect())
    }

    fn surface_beside(
        &mut self,
        pair: &[Sighting; 2],
        expected: &MeasuredHeight,
    ) -> sdg_robot::Result<Option<MeasuredHeight>> {
        Ok(self.surface_of(pair, expected))
    }

    fn others(&self) -> Vec<GraspTarget> {
        self.others.clone()
    }

    fn picture_time(&self) -> Option<Instant> {
        self.taken
    }
}

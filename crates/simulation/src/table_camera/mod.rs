//! A fixed camera above the table that shows moving parts: `sim:PART?speed=50&seed=1&fps=100&…`.
//!
//! ```text
//! TableCameraConfig ─ scene by seed, a lane of the table for each part ─ Mover: place and yaw at each frame
//!                                                                              │
//!                                      Renderer ─ noise ─ TableView { picture, ground truth of every part }
//! ```
//! Frames are `1 / fps` of simulated time apart and are rendered as fast as possible. The same configuration gives the
//! same frames, bit for bit. The scene contains no robot.

mod config;
mod motion;
mod scene;

use std::sync::Arc;
use std::time::{Duration, SystemTime};

use image::RgbImage;
use nalgebra::{Isometry3, Point2, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_camera::{CameraError, Frame};
use sdg_geometry::PosedCamera;

pub use self::config::TableCameraConfig;
use self::motion::Mover;
use self::scene::{away, lanes, middle_of, mjcf, renamed, scene};
use crate::camera::posed_camera;
use crate::data::Data;
use crate::error::{Result, SimulationError};
use crate::model::{Camera, Id, Joint, Model};
use crate::normal::normal;
use crate::objects::ObjectSpec;
use crate::render::{RenderConfig, Renderer};
use crate::scene::PlacedObject;
use crate::views::GraspTruth;

/// Height of the card above the table, in metres.
const CARD_HEIGHT_M: f64 = 0.05;
/// Number of noise values that are sampled once; every row of a frame starts at a random offset.
const NUM_NOISE: usize = 1 << 16;

/// A part on the table in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct MovingTruth {
    /// The part's pose, and its grasp in the base frame and in pixels.
    pub grasp: GraspTruth,
    /// Whether the picture shows the part: it is on the table and not under the card.
    pub is_shown: bool,
}

/// One frame with its ground truth.
#[derive(Debug, Clone)]
pub struct TableView {
    /// Number of the frame, from 0.
    pub number: u64,
    /// Simulated time since the first frame.
    pub time: Duration,
    /// The camera's picture, with noise.
    pub picture: RgbImage,
    /// Ground truth of all instances of the part, in a fixed order; other objects are not included.
    pub truths: Vec<MovingTruth>,
}

/// A moving part.
struct Moving {
    joint: Id<Joint>,
    mover: Mover,
    spec: ObjectSpec,
    /// Centre of the part's outline from above, in the object frame.
    middle: Point2<f64>,
    is_away: bool,
}

/// A camera above a table with moving parts.
pub struct TableCamera {
    config: TableCameraConfig,
    data: Data,
    renderer: Renderer,
    camera: Id<Camera>,
    moving: Vec<Moving>,
    card: Id<Joint>,
    noise: Vec<i16>,
    rng: Pcg64Mcg,
    number: u64,
    address: Arc<str>,
    began: SystemTime,
}

impl TableCamera {
    /// Builds the scene.
    ///
    /// # Errors
    /// [`SimulationError::UnknownName`] for a part that does not exist, [`SimulationError::Configuration`] for more parts
    /// than fit side by side, and as for [`Renderer::new`].
    pub fn new(config: &TableCameraConfig) -> Result<Self> {
        let spec = ObjectSpec::by_name(&config.part)?;
        let beside = config.part_beside(&spec)?;
        let scene = scene(config, &spec);
        let mut fragment = scene.fragment();
        let lanes = lanes(config.count + usize::from(beside.is_some()), config.num_things > 0);
        let mut moving = Vec::new();
        let specs = std::iter::repeat_n(&spec, config.count).chain(&beside);
        for (idx, (spec, lane)) in specs.zip(&lanes).enumerate() {
            let (middle, radius_m) = middle_of(spec);
            let [width_mm, length_mm] = [lane.y_m[1] - lane.y_m[0], 2.0 * radius_m].map(|metres| 1e3 * metres);
            if length_mm > width_mm {
                let name = &spec.name;
                return Err(SimulationError::Configuration {
                    field: "count",
                    expected: format!("parts of at most {width_mm:.1} mm for {} side by side", lanes.len()),
                    found: format!("the part {name} of {length_mm:.1} mm"),
                });
            }
            let is_part = idx < config.count;
            let speed_m_s = if is_part { config.speed_m_s } else { 0.0 };
            let turn_rad_s = if is_part { config.turn_rad_s } else { 0.0 };
            let seed = config.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(idx as u64);
            let mover = Mover::new(lane.shrunk(radius_m), speed_m_s, turn_rad_s, seed);
            moving.push((mover, spec.clone(), middle));
        }
        if let Some(beside) = &beside {
            fragment.append(renamed(beside.fragment(&away())));
        }
        let data = Data::new(Arc::new(Model::from_xml(&mjcf(config, &fragment), &fragment.files)?))?;
        let model = data.model().clone();
        let renderer = Renderer::new(&model, RenderConfig::default())?;
        let joint_of = |idx: usize| match idx {
            0 => "object_joint".to_owned(),
            _ if idx < config.count => format!("instance_{}_joint", idx - 1),
            _ => "beside_joint".to_owned(),
        };
        let moving = moving
            .into_iter()
            .enumerate()
            .map(|(idx, (mover, spec, middle))| {
                Ok(Moving { joint: model.id(&joint_of(idx))?, mover, spec, middle, is_away: false })
            })
            .collect::<Result<_>>()?;
        let mut rng = Pcg64Mcg::seed_from_u64(config.seed);
        Ok(Self {
            camera: model.id("over_table")?,
            card: model.id("card_joint")?,
            noise: (0..NUM_NOISE).map(|_| (config.noise * normal(&mut rng)).round() as i16).collect(),
            rng,
            number: 0,
            address: format!("sim:{}", config.part).into(),
            began: SystemTime::UNIX_EPOCH,
            config: config.clone(),
            data,
            renderer,
            moving,
        })
    }

    /// Opens the camera of an address (without `sim:`); the times of frames start now.
    ///
    /// # Errors
    /// As for [`TableCameraConfig`]'s `from_str` and [`Self::new`].
    pub fn open(text: &str) -> Result<Self> {
        let mut made = Self::new(&text.parse()?)?;
        made.address = format!("sim:{text}").into();
        made.began = SystemTime::now();
        Ok(made)
    }

    /// The camera's configuration.
    pub fn config(&self) -> &TableCameraConfig {
        &self.config
    }

    /// The camera, posed in the robot's base frame, whose z is 0 on the table.
    pub fn posed_camera(&self) -> PosedCamera {
        posed_camera(&self.renderer, &self.data, self.camera)
    }

    /// The next frame; `None` at the end of the sequence.
    ///
    /// # Errors
    /// As for [`Data::forward`] and [`Renderer::image`].
    pub fn next_view(&mut self) -> Result<Option<TableView>> {
        let secs = self.number as f64 / self.config.fps;
        if self.config.duration_secs.is_some_and(|duration| secs >= duration) {
            return Ok(None);
        }
        if self.number > 0 {
            self.moving.iter_mut().for_each(|moving| moving.mover.advance(1.0 / self.config.fps));
        }
        let is_hidden = self.config.hidden_secs.as_ref().is_some_and(|hidden| hidden.contains(&secs));
        if self.moving[0].is_away && !is_hidden {
            self.moving[0].mover.put_elsewhere();
        }
        self.moving[0].is_away = is_hidden;
        let is_covered = self.config.covered_secs.as_ref().is_some_and(|covered| covered.contains(&secs));
        for moving in &self.moving {
            let pose = if moving.is_away { away() } else { moving.base_from_object() };
            self.data.place(moving.joint, &pose);
        }
        let card = match is_covered {
            true => {
                let place = self.moving[0].mover.place;
                Isometry3::translation(place.x, place.y, CARD_HEIGHT_M)
            }
            false => away(),
        };
        self.data.place(self.card, &card);
        self.data.forward()?;
        let mut picture = self.renderer.image(&mut self.data, self.camera)?;
        self.add_noise(&mut picture);
        let camera = self.posed_camera();
        let parts = self.moving[..self.config.count].iter().enumerate();
        let truths = parts
            .filter_map(|(idx, moving)| {
                let placed = PlacedObject { spec: moving.spec.clone(), base_from_object: moving.base_from_object() };
                let is_under_card = is_covered && idx == 0;
                let is_shown = !(moving.is_away || is_under_card);
                Some(MovingTruth { grasp: GraspTruth::new(&placed, &camera)?, is_shown })
            })
            .collect();
        let view = TableView { number: self.number, time: Duration::from_secs_f64(secs), picture, truths };
        self.number += 1;
        Ok(Some(view))
    }

    fn add_noise(&mut self, picture: &mut RgbImage) {
        if self.config.noise == 0.0 {
            return;
        }
        // Every row starts at a random offset, so that the pattern does not repeat between rows or frames.
        let row_len = 3 * picture.width() as usize;
        for row in picture.chunks_exact_mut(row_len) {
            let from = self.rng.random_range(0..NUM_NOISE);
            for (idx, value) in row.iter_mut().enumerate() {
                let noise = self.noise[(from + idx) % NUM_NOISE];
                *value = (i16::from(*value) + noise).clamp(0, 255) as u8;
            }
        }
    }
}

impl sdg_camera::Camera for TableCamera {
    fn next_frame(&mut self) -> std::result::Result<Option<Frame>, CameraError> {
        let camera = self.address.to_string();
        let ended = |error: SimulationError| CameraError::Ended { camera, why: error.to_string() };
        let Some(view) = self.next_view().map_err(ended)? else { return Ok(None) };
        let (captured, camera) = (self.began + view.time, self.address.clone());
        Ok(Some(Frame { captured, ..Frame::new(view.picture, view.number, camera) }))
    }
}

impl Moving {
    fn base_from_object(&self) -> Isometry3<f64> {
        let Mover { place, yaw_rad, .. } = &self.mover;
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), *yaw_rad);
        let middle = turn * Vector3::new(self.middle.x, self.middle.y, 0.0);
        self.spec.base_from_object(place.x - middle.x, place.y - middle.y, *yaw_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::footprint;
    use crate::views::in_picture;

    fn views(text: &str, count: usize) -> Vec<TableView> {
        let mut camera = TableCamera::new(&text.parse().unwrap()).unwrap();
        (0..count).map_while(|_| camera.next_view().unwrap()).collect()
    }

    #[test]
    fn the_same_address_gives_the_same_frames_and_another_seed_others() {
        let [one, again, other] = ["key?seed=1", "key?seed=1", "key?seed=2"].map(|text| views(text, 2));
        assert_eq!(one[1].picture, again[1].picture);
        assert_eq!(one[1].truths, again[1].truths);
        assert_ne!(one[1].picture, other[1].picture);
    }

    #[test]
    fn the_part_moves_as_fast_as_asked_and_stays_in_the_picture() {
        let mut camera =
            TableCamera::new(&"rod_end?speed=50&turn=30&fps=20&seconds=4&noise=0".parse().unwrap()).unwrap();
        let (posed, mut last) = (camera.posed_camera(), None::<GraspTruth>);
        let mut number = 0;
        while let Some(view) = camera.next_view().unwrap() {
            let truth = view.truths[0].grasp.clone();
            assert!(in_picture(&posed, &truth.line.center(), 10.0), "{number}");
            if let Some(last) = last {
                let turned = (truth.direction_rad - last.direction_rad + 9.0).rem_euclid(std::f64::consts::TAU) - 9.0;
                let turned = sdg_geometry::Angle::from_radians(turned).radians().abs();
                assert!((turned - 1.5f64.to_radians()).abs() < 1e-6, "{turned}");
                // The marks are beside the part's centre, so that rotation also moves them.
                assert!((truth.tcp - last.tcp).norm() < 0.0025 + 0.06 * turned, "{number}");
            }
            last = Some(truth);
            number += 1;
        }
        assert_eq!(number, 80);
    }

    #[test]
    fn a_hidden_part_is_not_shown_and_comes_back_elsewhere() {
        let seen = views("key?fps=10&hide=0.2..0.4&cover=0.5..0.6&noise=0&turn=0", 8);
        let shown: Vec<bool> = seen.iter().map(|view| view.truths[0].is_shown).collect();
        assert_eq!(shown, [true, true, false, false, true, false, true, true]);
        let moved = (seen[4].truths[0].grasp.tcp - seen[1].truths[0].grasp.tcp).norm();
        assert!(moved > 0.02, "{moved}");
        // The picture shows the part at its true position: that pixel changes if the part is hidden or covered.
        let at = |view: &TableView, of: &TableView| {
            let center = of.truths[0].grasp.line.center();
            view.picture.get_pixel(center.x as u32, center.y as u32).0
        };
        assert_ne!(at(&seen[1], &seen[1]), at(&seen[2], &seen[1]));
        assert_ne!(at(&seen[5], &seen[5]), at(&seen[4], &seen[5]));
    }

    #[test]
    fn all_of_the_part_keep_apart_from_each_other_and_from_what_lies_beside() {
        for (address, count) in
            [("key?count=3&beside=mirrored&things=3&fps=2", 3), ("fuel_line?count=2&things=6&fps=2", 2)]
        {
            let mut camera = TableCamera::new(&address.parse().unwrap()).unwrap();
            let things = scene(&camera.config, &camera.moving[0].spec).distractors;
            for _ in 0..6 {
                assert_eq!(camera.next_view().unwrap().unwrap().truths.len(), count);
                let parts = camera.moving.iter().map(|moving| {
                    let base_from_object = moving.base_from_object();
                    PlacedObject { spec: moving.spec.clone(), base_from_object }.footprint()
                });
                let outlines: Vec<_> = parts.chain(things.iter().map(|thing| thing.footprint.clone())).collect();
                for (idx, outline) in outlines.iter().enumerate() {
                    assert!(outlines[..idx].iter().all(|other| footprint::separation(outline, other) > 0.0));
                }
            }
        }
    }

    #[test]
    fn no_distractor_of_any_seed_reaches_into_a_lane() {
        let spec = ObjectSpec::by_name("key").unwrap();
        let end_m = lanes(1, true)[0].y_m[1];
        let mut num_things = 0;
        for seed in 0..20 {
            let config = TableCameraConfig { seed, num_things: 6, ..TableCameraConfig::new("key") };
            for thing in scene(&config, &spec).distractors {
                assert!(thing.footprint.iter().all(|corner| corner.y >= end_m - 1e-9), "{seed}: {thing:?}");
                num_things += 1;
            }
        }
        assert!(num_things > 20, "{num_things}");
    }

    #[test]
    fn more_parts_than_fit_side_by_side_are_refused() {
        for (address, name) in [("fuel_line?count=4", "fuel_line"), ("key?count=3&beside=fuel_line", "fuel_line")] {
            let error = TableCamera::new(&address.parse().unwrap()).err().unwrap().to_string();
            let expected =
                format!("count: expected parts of at most 155.0 mm for 4 side by side, found the part {name} of 226");
            assert!(error.starts_with(&expected), "{error}");
        }
    }
}

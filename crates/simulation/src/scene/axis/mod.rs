//! Pictures in which one thing is harder than in an ordinary scene: the axes along which models are measured.
//!
//! ```text
//! (part, axis, number, seed) ─> ordinary random scene ─> changed along the axis ─> picture, truths, how much it was changed
//!                               SceneVariation::sample    camera, things, image
//! ```
//!
//! An axis has [`PICTURES_PER_AXIS`] pictures. The number of a picture is its **stratum**: what the axis changes runs from
//! its mildest in picture 0 to its hardest in the last one, within each stratum at random, so that 20 pictures cover the
//! whole range evenly. The same part, axis, number and seed give the same picture to the bit. All pictures are the wrist
//! camera's with the arm holding it, as in an attempt.

mod camera_pose;
mod clutter;
mod cover;
mod image_faults;
mod instances;
mod visible;

use std::fmt;
use std::ops::Range;
use std::str::FromStr;

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::{GraspTruth, SceneVariation, VariationConfig, base_from_look_camera};
use crate::camera::CameraView;
use crate::error::{Result, SimulationError};
use crate::objects::{LookAlikeKind, ObjectSpec};
use crate::workcell::{Workcell, WorkcellConfig};

/// How many pictures an axis has: as many strata.
pub const PICTURES_PER_AXIS: u64 = 20;

/// What is harder than in an ordinary picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Axis {
    /// The camera is 0.75 to 1.3 times as high as usual.
    Height,
    /// The camera is tilted by 5 to 20 degrees about a random axis in the table and looks at the part.
    Tilt,
    /// Another thing lies over 10 to 40 percent of what is seen of the part.
    Covered,
    /// Little light: a dark picture with photon and read noise.
    Dark,
    /// Motion blur in the even pictures, defocus in the odd ones.
    Blur,
    /// Light of another colour than the camera is balanced for.
    Tint,
    /// Ten to fifteen other things, pushed against the part and each other.
    Clutter,
    /// Three of the part.
    Instances,
    /// A part that resembles the part, and not the part.
    LookAlikes,
}

impl Axis {
    /// All axes, in the order in which they are reported.
    pub const ALL: [Self; 9] = [
        Self::Height,
        Self::Tilt,
        Self::Covered,
        Self::Dark,
        Self::Blur,
        Self::Tint,
        Self::Clutter,
        Self::Instances,
        Self::LookAlikes,
    ];

    /// The name at the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Height => "height",
            Self::Tilt => "tilt",
            Self::Covered => "covered",
            Self::Dark => "dark",
            Self::Blur => "blur",
            Self::Tint => "tint",
            Self::Clutter => "clutter",
            Self::Instances => "instances",
            Self::LookAlikes => "look-alikes",
        }
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Axis {
    type Err = SimulationError;

    /// Reads a name as [`Axis::name`] gives it.
    ///
    /// # Errors
    /// [`SimulationError::UnknownName`] with the names that exist.
    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|axis| axis.name() == name).ok_or_else(|| SimulationError::UnknownName {
            kind: "axis",
            name: name.to_owned(),
            existing: Self::ALL.map(|axis| axis.name().to_owned()).to_vec(),
        })
    }
}

/// How much a picture was changed along its axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisParameter {
    /// The number, in `unit`.
    pub value: f64,
    /// What the number counts: `of the usual height`, `degrees`, `px`.
    pub unit: &'static str,
    /// All of it in words.
    pub description: String,
}

/// One of the part's instances in a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct InstanceTruth {
    /// Where it is, and its grasp.
    pub grasp: GraspTruth,
    /// Share of its pixels that the picture shows, of those that it would show with nothing else on the table.
    pub visible_share: f64,
}

/// A picture of an axis with the truth about it.
#[derive(Debug, Clone)]
pub struct AxisView {
    /// What was made harder.
    pub axis: Axis,
    /// Which of the axis' pictures it is.
    pub number: u64,
    /// What was drawn.
    pub scene: SceneVariation,
    /// The picture and its camera.
    pub view: CameraView,
    /// All instances of the part; none among the look-alikes.
    pub truths: Vec<InstanceTruth>,
    /// How much the axis changed.
    pub parameter: AxisParameter,
    /// In what the part on the table differs from the part that is asked for; only among the look-alikes.
    pub look_alike: Option<LookAlikeKind>,
}

/// A part, axis, number and seed, as the axes' own modules need them.
struct Request<'a> {
    spec: &'a ObjectSpec,
    number: u64,
    /// Seed of the ordinary scene.
    scene_seed: u64,
    /// Place of the picture in the axis' range, 0 to 1.
    level: f64,
    /// What else the axis draws.
    rng: Pcg64Mcg,
}

impl<'a> Request<'a> {
    fn new(spec: &'a ObjectSpec, axis: Axis, number: u64, seed: u64) -> Self {
        // FNV-1a: parts whose pictures had one seed would share each unlucky lamp.
        let part = spec
            .name
            .bytes()
            .fold(0xcbf2_9ce4_8422_2325u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
        let mut rng = Pcg64Mcg::seed_from_u64(
            part ^ seed.wrapping_mul(0xd134_2543_de82_ef95)
                ^ (axis as u64) << 56
                ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15),
        );
        let scene_seed = rng.random();
        let stratum = (number % PICTURES_PER_AXIS) as f64;
        let level = (stratum + rng.random_range(0.0..1.0)) / PICTURES_PER_AXIS as f64;
        Self { spec, number, scene_seed, level, rng }
    }

    /// The place of the picture in a range.
    fn between(&self, range: Range<f64>) -> f64 {
        range.start + self.level * (range.end - range.start)
    }

    fn ordinary_scene(&self) -> SceneVariation {
        SceneVariation::sample(Some(self.spec), &VariationConfig::default(), self.scene_seed)
    }
}

/// What an axis made: the picture before truths are measured.
struct Drawn {
    cell: Workcell,
    scene: SceneVariation,
    view: CameraView,
    parameter: AxisParameter,
}

/// Draws picture `number` of an axis.
///
/// # Errors
/// As [`Workcell::new`]; [`SimulationError::Configuration`] where no place of camera or cover gives the picture that the
/// axis asks for.
pub fn axis_view(spec: &ObjectSpec, axis: Axis, number: u64, seed: u64) -> Result<AxisView> {
    let mut request = Request::new(spec, axis, number, seed);
    if axis == Axis::LookAlikes {
        return look_alike_view(&mut request);
    }
    let Drawn { mut cell, scene, view, parameter } = match axis {
        Axis::Height => camera_pose::draw_from_another_height(&mut request)?,
        Axis::Tilt => camera_pose::draw_tilted(&mut request)?,
        Axis::Covered => cover::draw_covered(&mut request)?,
        Axis::Clutter => clutter::draw_cluttered(&mut request)?,
        Axis::Instances => instances::draw_three(&mut request)?,
        Axis::Dark | Axis::Blur | Axis::Tint | Axis::LookAlikes => {
            let scene = request.ordinary_scene();
            let mut cell = Workcell::new(&WorkcellConfig::new(scene.clone()))?;
            let mut view = cell.view_from(&base_from_look_camera())?;
            let parameter = match axis {
                Axis::Dark => image_faults::darken(&mut view.image, &mut request),
                Axis::Blur => image_faults::blur(&mut view.image, &mut request),
                _ => image_faults::tint(&mut view.image, &mut request),
            };
            Drawn { cell, scene, view, parameter }
        }
    };
    let truths = visible::instance_truths(&mut cell, &scene, &view.camera)?;
    Ok(AxisView { axis, number, scene, view, truths, parameter, look_alike: None })
}

/// An ordinary picture with a look-alike in the part's place; the kinds take turns.
fn look_alike_view(request: &mut Request<'_>) -> Result<AxisView> {
    let kinds = request.spec.look_alike_kinds()?;
    let kind = kinds[(request.number % kinds.len() as u64) as usize];
    let look_alike = request.spec.look_alike(kind, request.rng.random())?;
    let scene = SceneVariation::sample(Some(&look_alike.spec), &VariationConfig::default(), request.scene_seed);
    let mut cell = Workcell::new(&WorkcellConfig::new(scene))?;
    let view = cell.view_from(&base_from_look_camera())?;
    Ok(AxisView {
        axis: Axis::LookAlikes,
        number: request.number,
        scene: cell.config().scene.clone(),
        view,
        truths: Vec::new(),
        parameter: AxisParameter { value: 1.0, unit: "look-alike", description: look_alike.description },
        look_alike: Some(kind),
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point2, Point3, Vector2};

    use super::visible::instance_bodies;
    use super::*;
    use crate::scene::{PlacedObject, footprint};

    /// Pixels between the middle of the drawn part and of its projected top: a wall of 12 mm seen from 20 degrees beside
    /// it takes 4 px on one side and moves the middle by half of that; the rest is the raster of a millimetre.
    const MIDDLE_TOLERANCE_PX: f64 = 3.0;

    #[test]
    fn names_are_read_as_they_are_written() {
        for axis in Axis::ALL {
            assert_eq!(axis.name().parse::<Axis>().unwrap(), axis);
        }
        let message = "tilted".parse::<Axis>().unwrap_err().to_string();
        assert!(message.contains("axis") && message.contains("tilted") && message.contains("look-alikes"), "{message}");
    }

    #[test]
    fn strata_divide_the_range() {
        let spec = ObjectSpec::by_name("rod_end").unwrap();
        for number in 0..PICTURES_PER_AXIS {
            let level = Request::new(&spec, Axis::Height, number, 3).level;
            assert_eq!((level * PICTURES_PER_AXIS as f64) as u64, number);
        }
        assert_eq!(Request::new(&spec, Axis::Height, 4, 3).level, Request::new(&spec, Axis::Height, 4, 3).level);
        assert_ne!(Request::new(&spec, Axis::Height, 4, 3).level, Request::new(&spec, Axis::Height, 4, 4).level);
        assert_ne!(Request::new(&spec, Axis::Height, 4, 3).level, Request::new(&spec, Axis::Tilt, 4, 3).level);
    }

    #[test]
    fn the_truth_lies_on_the_drawn_part_from_any_camera_pose() {
        for (name, axis, number) in [
            ("cranfield_face", Axis::Tilt, 19),
            ("fuel_line", Axis::Tilt, 10),
            ("fuel_line", Axis::Height, 0),
            ("cranfield_face", Axis::Height, 19),
        ] {
            let spec = ObjectSpec::by_name(name).unwrap();
            let mut request = Request::new(&spec, axis, number, 5);
            let mut drawn = match axis {
                Axis::Tilt => camera_pose::draw_tilted(&mut request).unwrap(),
                _ => camera_pose::draw_from_another_height(&mut request).unwrap(),
            };
            let truth = &visible::instance_truths(&mut drawn.cell, &drawn.scene, &drawn.view.camera).unwrap()[0];
            let projected: Vec<Point2<f64>> = spec
                .height_map(0.001)
                .unwrap()
                .filled()
                .map(|(at, z, _)| truth.grasp.base_from_object * Point3::new(at.x, at.y, z))
                .map(|p| drawn.view.camera.project(&p).unwrap())
                .collect();
            let body = instance_bodies(&drawn.cell, 1).unwrap()[0];
            let segmentation = drawn.cell.wrist_segmentation().unwrap();
            let model = drawn.cell.data().model();
            let shown: Vec<Point2<f64>> = segmentation
                .pixels_where(|geom| model.body_of(geom) == body)
                .map(|(x, y)| Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5))
                .collect();
            let middle =
                |points: &[Point2<f64>]| points.iter().map(|p| p.coords).sum::<Vector2<f64>>() / points.len() as f64;
            let apart = (middle(&projected) - middle(&shown)).norm();
            assert!(apart < MIDDLE_TOLERANCE_PX, "{name} {axis} {number}: {apart} px");
            let line = truth.grasp.line;
            // The marks are seen where they are said to be, within the part's outline.
            assert!((line.center().coords - middle(&shown)).norm() < 60.0, "{name} {axis}: {:?}", line.center());
            let range = if axis == Axis::Tilt { 5.0..20.0 } else { 0.75..1.3 };
            assert!(range.contains(&drawn.parameter.value), "{}", drawn.parameter.description);
        }
    }

    #[test]
    fn covers_hide_what_their_stratum_says() {
        for (name, number) in [("fuel_line", 0), ("housing", 19)] {
            let spec = ObjectSpec::by_name(name).unwrap();
            let shown = axis_view(&spec, Axis::Covered, number, 8).unwrap();
            let stratum = |number: u64| 0.10 + 0.30 * number as f64 / PICTURES_PER_AXIS as f64;
            let covered = 1.0 - shown.truths[0].visible_share;
            // The cover stops within two percent of the wanted share.
            assert!(
                (stratum(number) - 0.02..stratum(number + 1) + 0.02).contains(&covered),
                "{name} {number}: {covered}"
            );
            assert!((covered - shown.parameter.value).abs() < 1e-9, "{covered} and {}", shown.parameter.value);
        }
    }

    #[test]
    fn instances_keep_apart_and_things_in_clutter_do_not_cover() {
        let spec = ObjectSpec::by_name("rod_end").unwrap();
        let shown = axis_view(&spec, Axis::Instances, 3, 8).unwrap();
        assert_eq!(shown.truths.len(), 3);
        let outlines: Vec<_> =
            shown.scene.object.iter().chain(&shown.scene.instances).map(PlacedObject::footprint).collect();
        for (idx, one) in outlines.iter().enumerate() {
            assert!(shown.truths[idx].visible_share > 0.9, "{}", shown.truths[idx].visible_share);
            for other in &outlines[..idx] {
                assert!(footprint::separation(one, other) > 0.0);
            }
        }
        let cluttered = axis_view(&spec, Axis::Clutter, 12, 8).unwrap();
        assert!((10..=15).contains(&cluttered.scene.distractors.len()));
        // Tall things beside the part hide a little of it from a camera that is not straight above.
        assert!(cluttered.truths[0].visible_share > 0.85, "{}", cluttered.truths[0].visible_share);
    }

    #[test]
    fn a_picture_is_the_same_to_the_bit_and_look_alikes_have_no_truth() {
        let spec = ObjectSpec::by_name("fuel_line").unwrap();
        let [one, again] = [0; 2].map(|_| axis_view(&spec, Axis::Dark, 7, 2).unwrap());
        assert_eq!(one.view, again.view);
        let shown = axis_view(&spec, Axis::LookAlikes, 0, 2).unwrap();
        assert_eq!(shown.look_alike, Some(LookAlikeKind::Mirrored));
        assert!(shown.truths.is_empty() && shown.scene.object.unwrap().spec.name == "fuel_line_mirrored");
    }
}

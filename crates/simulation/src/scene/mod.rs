//! The objects on the table and their lighting, varied by seed.
//!
//! ```text
//! seed ─> SceneVariation { object at a pose, Lighting, Table, distractors } ─> MjcfFragment ─> Workcell
//!              shapes: solids ─> mesh            surfaces: texture
//! ```
//!
//! The table's top is the plane z = 0 of the robot's base frame. Each aspect of a scene has its own random stream, so
//! that a different number of distractors does not change the lamps. The same seed gives the same scene, bit for bit.

mod distractor;
mod distractor_kind;
mod distractor_pieces;
mod light;
mod seen_part;
mod table;

use std::ops::{Range, RangeInclusive};

use nalgebra::{Isometry2, Isometry3, Point2, Vector2};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::objects::ObjectSpec;
use crate::shapes::footprint;

pub use crate::fragment::{MjcfFragment, pose_attributes};
pub use distractor::Distractor;
pub use distractor_kind::DistractorKind;
pub use light::{Lamp, Lighting};
pub use seen_part::SeenPart;
pub use table::{Table, TableSurface};

/// The ranges of a scene's variation.
#[derive(Debug, Clone, PartialEq)]
pub struct VariationConfig {
    /// Range of the object's origin along the base's x, in metres.
    pub object_x_m: Range<f64>,
    /// Range of the object's origin along the base's y, in metres.
    pub object_y_m: Range<f64>,
    /// Number of distractors; those for which no free position is found are left out.
    pub distractors: RangeInclusive<usize>,
    /// Minimum distance between any two objects on the table, in metres.
    pub clearance_m: f64,
    /// Whether lamps, table and their colours also vary; otherwise they are nominal.
    pub appearance: bool,
    /// Convex areas of the table for neither the object nor distractors, in metres, counter-clockwise.
    pub taken: Vec<Vec<Point2<f64>>>,
}

impl Default for VariationConfig {
    fn default() -> Self {
        Self {
            object_x_m: 0.37..0.62,
            object_y_m: -0.20..0.20,
            distractors: 0..=6,
            clearance_m: 0.006,
            appearance: true,
            taken: Vec::new(),
        }
    }
}

impl VariationConfig {
    /// Whether the object is at the minimum distance from the taken areas. A sampled one is not if they leave no room
    /// for it.
    pub fn has_room_for(&self, object: &PlacedObject) -> bool {
        let outline = object.footprint();
        self.taken.iter().all(|area| footprint::separation(&outline, area) >= self.clearance_m)
    }
}

/// A part with its pose on the table.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedObject {
    /// The part.
    pub spec: ObjectSpec,
    /// Pose of the part at rest, in the robot's base frame.
    pub base_from_object: Isometry3<f64>,
}

/// All contents of a scene except the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneVariation {
    /// The part to grasp; `None` for a table without it.
    pub object: Option<PlacedObject>,
    /// More instances of the same part.
    pub instances: Vec<PlacedObject>,
    /// The light.
    pub lighting: Lighting,
    /// The table.
    pub table: Table,
    /// Other parts.
    pub distractors: Vec<Distractor>,
}

/// Independent streams of random numbers, one for each aspect.
#[derive(Clone, Copy)]
enum Stream {
    Object = 1,
    Light = 2,
    Table = 3,
    Distractors = 4,
}

impl Stream {
    fn rng(self, seed: u64) -> Pcg64Mcg {
        // SplitMix64's finaliser: neighbouring seeds and streams become unrelated.
        let mut mixed = seed.wrapping_add((self as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        Pcg64Mcg::seed_from_u64(mixed ^ (mixed >> 31))
    }
}

impl SceneVariation {
    /// The scene of demonstrations: the part alone on a light table in even light.
    pub fn nominal(object: Option<(&ObjectSpec, Isometry3<f64>)>) -> Self {
        Self {
            object: object.map(|(spec, base_from_object)| PlacedObject { spec: spec.clone(), base_from_object }),
            instances: Vec::new(),
            lighting: Lighting::nominal(),
            table: Table::nominal(),
            distractors: Vec::new(),
        }
    }

    /// Samples the scene of a seed: the object, if given, at a random position and angle, with random light, table and
    /// distractors.
    pub fn sample(object: Option<&ObjectSpec>, config: &VariationConfig, seed: u64) -> Self {
        let rng = &mut Stream::Object.rng(seed);
        let object = object.map(|spec| sample_object(spec, config, rng));
        let (lighting, table) = if config.appearance {
            (Lighting::sample(&mut Stream::Light.rng(seed)), Table::sample(&mut Stream::Table.rng(seed)))
        } else {
            (Lighting::nominal(), Table::nominal())
        };
        let of_object = object.iter().flat_map(|object| [object.footprint(), object.gripper_footprint()]);
        let taken = config.taken.iter().cloned().chain(of_object).collect();
        let distractors = sample_distractors(taken, config, &mut Stream::Distractors.rng(seed));
        Self { object, instances: Vec::new(), lighting, table, distractors }
    }

    /// The scene as MJCF sections and their files.
    pub fn fragment(&self) -> MjcfFragment {
        self.fragment_on_table(0.0)
    }

    /// As [`Self::fragment`], with the table's top at another z (m). The objects stay where they are.
    pub(crate) fn fragment_on_table(&self, table_height_m: f64) -> MjcfFragment {
        let mut fragment = self.lighting.fragment();
        fragment.append(self.table.fragment(table_height_m));
        if let Some(object) = &self.object {
            fragment.append(object.spec.fragment(&object.base_from_object));
        }
        for (index, instance) in self.instances.iter().enumerate() {
            fragment.append(instance.spec.instance_fragment(index, &instance.base_from_object));
        }
        for (index, distractor) in self.distractors.iter().enumerate() {
            fragment.append(distractor.fragment(index));
        }
        fragment
    }
}

impl PlacedObject {
    /// The part's convex outline from above, in the base frame.
    pub fn footprint(&self) -> Vec<Point2<f64>> {
        footprint::placed(&self.spec.footprint, &self.table_from_object())
    }

    /// The area that the open gripper covers when it descends to the marks.
    pub fn gripper_footprint(&self) -> Vec<Point2<f64>> {
        let (centre, direction) = self.spec.grasp_in_base(&self.base_from_object);
        let table_from_gripper = Isometry2::new(centre.xy().coords, direction);
        footprint::placed(&GRIPPER_FOOTPRINT.map(Point2::from), &table_from_gripper)
    }

    /// The part's planar pose on the table.
    pub(crate) fn table_from_object(&self) -> Isometry2<f64> {
        let x_axis = self.base_from_object.rotation * nalgebra::Vector3::x();
        Isometry2::new(self.base_from_object.translation.vector.xy(), x_axis.y.atan2(x_axis.x))
    }
}

/// Outline of two fingers, opened to 0.08 m, with their thickness: x along the marks, y along the jaws' motion.
const GRIPPER_FOOTPRINT: [[f64; 2]; 4] = [[-0.016, -0.062], [0.016, -0.062], [0.016, 0.062], [-0.016, 0.062]];

/// Number of poses that are tried for the object.
const OBJECT_TRIES: usize = 200;

/// Number of poses that are tried for a distractor before it is left out.
const PLACEMENT_TRIES: usize = 40;

/// Distance by which the range of distractors extends beyond the object's range, in metres.
const DISTRACTOR_MARGIN_M: f64 = 0.05;

/// At most `count` distractors of a seed with centres between bounds in the base frame, in metres, at a distance from
/// the areas in `taken`.
pub(crate) fn sample_distractors_between(
    x_m: Range<f64>,
    y_m: Range<f64>,
    taken: Vec<Vec<Point2<f64>>>,
    count: usize,
    seed: u64,
) -> Vec<Distractor> {
    let within = |range: Range<f64>| range.start + DISTRACTOR_MARGIN_M..range.end - DISTRACTOR_MARGIN_M;
    // If a range is narrower than both margins together, its ends are exchanged.
    let ordered = |range: Range<f64>| if range.start < range.end { range } else { range.end..range.start + 1e-6 };
    let config = VariationConfig {
        object_x_m: within(x_m),
        object_y_m: within(y_m),
        distractors: count..=count,
        ..VariationConfig::default()
    };
    let config =
        VariationConfig { object_x_m: ordered(config.object_x_m), object_y_m: ordered(config.object_y_m), ..config };
    sample_distractors(taken, &config, &mut Stream::Distractors.rng(seed))
}

/// The object at a random pose, at a distance from the areas in `config.taken`. If none of [`OBJECT_TRIES`] poses has
/// this distance, the last one is used.
fn sample_object(spec: &ObjectSpec, config: &VariationConfig, rng: &mut Pcg64Mcg) -> PlacedObject {
    let mut draw = || {
        let (x, y) = (rng.random_range(config.object_x_m.clone()), rng.random_range(config.object_y_m.clone()));
        let yaw = rng.random_range(-std::f64::consts::PI..std::f64::consts::PI);
        PlacedObject { spec: spec.clone(), base_from_object: spec.base_from_object(x, y, yaw) }
    };
    let mut object = draw();
    for _ in 1..OBJECT_TRIES {
        if config.has_room_for(&object) {
            break;
        }
        object = draw();
    }
    object
}

/// Distractors at random poses, at a distance from each other and from the areas in `taken`.
pub(crate) fn sample_distractors(
    mut taken: Vec<Vec<Point2<f64>>>,
    config: &VariationConfig,
    rng: &mut Pcg64Mcg,
) -> Vec<Distractor> {
    let spread = |range: &Range<f64>| range.start - DISTRACTOR_MARGIN_M..range.end + DISTRACTOR_MARGIN_M;
    let (x_range, y_range) = (spread(&config.object_x_m), spread(&config.object_y_m));
    let wanted = rng.random_range(config.distractors.clone());
    let mut distractors = Vec::with_capacity(wanted);
    for _ in 0..wanted {
        let kind = DistractorKind::ALL[rng.random_range(0..DistractorKind::ALL.len())];
        let seed = rng.random();
        for _ in 0..PLACEMENT_TRIES {
            let place = Vector2::new(rng.random_range(x_range.clone()), rng.random_range(y_range.clone()));
            let turn = rng.random_range(-std::f64::consts::PI..std::f64::consts::PI);
            let distractor = Distractor::new(kind, &Isometry2::new(place, turn), seed);
            if taken.iter().all(|other| footprint::separation(&distractor.footprint, other) >= config.clearance_m) {
                taken.push(distractor.footprint.clone());
                distractors.push(distractor);
                break;
            }
        }
    }
    distractors
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_gives_one_scene_and_another_seed_another() {
        let spec = ObjectSpec::by_name("rod_end").unwrap();
        let sample = |seed| SceneVariation::sample(Some(&spec), &VariationConfig::default(), seed);
        assert_eq!(sample(7), sample(7));
        assert_eq!(sample(7).fragment(), sample(7).fragment());
        assert_ne!(sample(7), sample(8));
    }

    #[test]
    fn leaving_the_object_out_changes_neither_light_nor_table() {
        let spec = ObjectSpec::by_name("rod_end").unwrap();
        let config = VariationConfig::default();
        let (with, without) =
            (SceneVariation::sample(Some(&spec), &config, 3), SceneVariation::sample(None, &config, 3));
        assert_eq!((with.lighting, with.table), (without.lighting, without.table));
        assert!(without.object.is_none());
    }

    #[test]
    fn things_keep_their_distance() {
        let config = VariationConfig { distractors: 6..=6, ..VariationConfig::default() };
        let mut placed = 0;
        for name in ObjectSpec::names() {
            let spec = ObjectSpec::by_name(name).unwrap();
            for seed in 0..8 {
                let scene = SceneVariation::sample(Some(&spec), &config, seed);
                let object = scene.object.unwrap();
                placed += scene.distractors.len();
                for (idx, distractor) in scene.distractors.iter().enumerate() {
                    let gap = footprint::separation(&distractor.footprint, &object.footprint());
                    assert!(gap >= config.clearance_m, "{name} {seed}: {gap}");
                    for other in &scene.distractors[..idx] {
                        assert!(footprint::separation(&distractor.footprint, &other.footprint) >= config.clearance_m);
                    }
                }
            }
        }
        let wanted = 8 * 6 * ObjectSpec::names().count();
        assert!(placed >= wanted * 5 / 6, "{placed} of {wanted}");
    }

    #[test]
    fn nothing_is_placed_in_taken_areas_and_free_parts_stay() {
        // Half of the object's range.
        let area = [[0.3, 0.0], [0.8, 0.0], [0.8, 0.5], [0.3, 0.5]].map(Point2::from).to_vec();
        let usual = VariationConfig { distractors: 0..=2, ..VariationConfig::default() };
        let config = VariationConfig { taken: vec![area.clone()], ..usual.clone() };
        let is_apart = |outline: &[Point2<f64>]| footprint::separation(outline, &area) >= config.clearance_m;
        let spec = ObjectSpec::by_name("rod_end").unwrap();
        let mut num_moved = 0;
        for seed in 0..200 {
            let scene = SceneVariation::sample(Some(&spec), &config, seed);
            let object = scene.object.unwrap();
            assert!(is_apart(&object.footprint()), "{seed}");
            assert!(scene.distractors.iter().all(|distractor| is_apart(&distractor.footprint)), "{seed}");
            let first = SceneVariation::sample(Some(&spec), &usual, seed).object.unwrap();
            num_moved += usize::from(first != object);
            assert_eq!(first == object, is_apart(&first.footprint()), "{seed}");
        }
        assert!(num_moved > 80, "{num_moved}");
    }
}

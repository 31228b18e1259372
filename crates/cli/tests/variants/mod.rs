//! One picture and its marks in 300 variants: each gives the same grasp, or is rejected with one line that names file
//! and field.
//!
//! ```text
//! scene ─┬─ picture: encoding, depth, alpha, Exif, name ──── detect ───────────┐
//!        ├─ marks: format, order, ids, units, paths, names ─ convert to COCO ──┼─ the same grasp, or a refusal
//!        └─ a sample of both ─────────────────────────────── teach, detect ────┘
//! ```
//! The seed and a variant's number determine the variant, so that a failure can be reproduced: `SDG_VARIANTS_SEED=7
//! cargo nextest run …`.

mod json_text;
mod marks;
mod outcome;
mod picture;
mod png;
mod scene;
mod tiff;
mod wrong_marks;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{LazyLock, Mutex};

use rand::Rng;
use rand_pcg::Pcg64Mcg;
use sdg_demonstration::random::generator_at;

use self::marks::Marks;
use self::outcome::{Outcome, of_detection, of_marks};
use self::picture::{Photo, lossless, pick, spoilt};
use self::scene::Scene;
use crate::picture_kinds::with_orientation;
use crate::support::{Folder, stdout};

const NUM_VARIANTS: usize = 300;
/// Minimum number of lossless variants; all of them must give the grasp.
const MIN_LOSSLESS: usize = 200;
/// Models are also taught from variants whose number is a multiple of this.
const TAUGHT_EACH: usize = 19;
const DEFAULT_SEED: u64 = 1;
const SEED_VARIABLE: &str = "SDG_VARIANTS_SEED";

fn scene() -> &'static Scene {
    static SCENE: LazyLock<Scene> = LazyLock::new(|| Scene::new([165.0, 118.0], 25.0, 5));
    &SCENE
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    /// The picture, stored without loss.
    Picture,
    /// The marks, stored without loss, for a picture stored without loss.
    Marks,
    /// The picture with changed pixels, or damaged.
    SpoiltPicture,
    WrongMarks,
}

impl Kind {
    /// Eight of ten variants are lossless.
    fn of(idx: usize) -> Self {
        match idx % 10 {
            0..=3 => Self::Picture,
            4..=7 => Self::Marks,
            8 => Self::SpoiltPicture,
            _ => Self::WrongMarks,
        }
    }

    fn is_lossless(self) -> bool {
        matches!(self, Self::Picture | Self::Marks)
    }
}

struct Variant {
    kind: Kind,
    photo: Photo,
    marks: Marks,
    /// Words of which a refusal must contain one; empty if a refusal is not allowed.
    refusal_words: &'static [&'static str],
    is_relative: bool,
    is_taught: bool,
}

impl Variant {
    fn new(seed: u64, idx: usize) -> Self {
        let mut dice = generator_at(seed, 0, idx as u64);
        let dice = &mut dice;
        let (scene, kind) = (scene(), Kind::of(idx));
        let mut photo = lossless(dice, &scene.photo);
        let mut marks = marks::lossless(dice, scene, &photo.name);
        let mut refusal_words: &[&str] = &[];
        match kind {
            Kind::SpoiltPicture => (photo, refusal_words) = spoilt(dice, &scene.photo),
            Kind::WrongMarks if dice.random_bool(0.15) => {
                let orientation = *pick(dice, &[2, 3, 4, 6, 8]);
                photo.bytes = with_orientation(&scene.photo.clone().into(), orientation);
                photo.recipe = format!("{:?}, marked as if Exif {orientation} were not there", photo.name);
                refusal_words = &["Exif"];
            }
            Kind::WrongMarks => (marks, refusal_words) = wrong_marks::wrong(dice, scene, &photo.name),
            _ => {}
        }
        let is_taught = idx.is_multiple_of(TAUGHT_EACH);
        Self { kind, photo, marks, refusal_words, is_relative: dice.random_bool(0.3), is_taught }
    }

    fn recipe(&self) -> String {
        match self.kind {
            Kind::Picture | Kind::SpoiltPicture if !self.is_taught => self.photo.recipe.clone(),
            _ => format!("{}; marks {}", self.photo.recipe, self.marks.recipe),
        }
    }

    /// Writes the variant's files to a folder and runs the program on them.
    fn run(&self, folder: &Path, model: &str) -> Outcome {
        let at = |name: &str| folder.join(name);
        let mut files = vec![(&self.photo.name, &self.photo.bytes), (&self.marks.name, &self.marks.bytes)];
        files.extend(self.marks.beside.iter().map(|(name, bytes)| (name, bytes)));
        for (name, bytes) in files {
            fs::create_dir_all(at(name).parent().unwrap()).unwrap();
            fs::write(at(name), bytes).unwrap();
        }
        if self.kind == Kind::WrongMarks {
            wrong_marks::other_scene().photo.save(at(wrong_marks::OTHER_PHOTO)).unwrap();
        }
        let path = |name: &str| if self.is_relative { format!("./{name}") } else { at(name).display().to_string() };
        let sdg = |arguments: &[&str]| -> Output {
            Command::new(env!("CARGO_BIN_EXE_sdg")).args(arguments).current_dir(folder).output().unwrap()
        };
        let (photo, marks) = (path(&self.photo.name), path(&self.marks.name));
        let names = [&self.photo.name, &self.marks.name];
        let refused = |done: &Output| outcome::of_refusal(done, &names, self.refusal_words);
        if self.is_taught {
            let taught = at("model.sdg").display().to_string();
            let done = sdg(&["teach", "--model", "S", "--demo", &format!("{photo}:{marks}"), "--out", &taught]);
            if !done.status.success() {
                return refused(&done);
            }
            scene().photo.save(at("scene.png")).unwrap();
            let found = sdg(&["detect", "--json", "--grasp-model", &taught, "scene.png"]);
            return of_detection(&found, scene()).unwrap_or_else(|| refused(&found));
        }
        if matches!(self.kind, Kind::Picture | Kind::SpoiltPicture) {
            let found = sdg(&["detect", "--json", "--grasp-model", model, &photo]);
            return of_detection(&found, scene())
                .unwrap_or_else(|| refused(&sdg(&["detect", "--grasp-model", model, &photo])));
        }
        let mut input = marks;
        // Not below the variant's folder, whose data.yaml has other labels.
        let steps = tempfile::tempdir().unwrap();
        for (idx, format) in self.marks.through.iter().chain(&["coco"]).enumerate() {
            // Each step has its own folder for its data.yaml.
            let step = steps.path().join(format!("step {idx}"));
            fs::create_dir(&step).unwrap();
            let output = step.join("marks").display().to_string();
            let done = sdg(&["annotation", "convert", "--format", format, "--image", &photo, &input, &output]);
            if !done.status.success() {
                return refused(&done);
            }
            input = output;
        }
        of_marks(&fs::read(PathBuf::from(input)).unwrap(), scene())
    }
}

/// A model taught from the scene, with which variants of the picture are searched.
fn taught(folder: &Folder) -> String {
    scene().photo.save(folder.path("scene.png")).unwrap();
    let mut dice: Pcg64Mcg = generator_at(0, 1, 0);
    folder.text("scene.json", &marks::labelme(&mut dice, scene(), "scene.png").to_string());
    let model = folder.path("model.sdg");
    stdout(&["teach", "--model", "S", "--demo", &folder.path("scene.png"), "--out", &model]);
    model
}

#[test]
fn each_variant_gives_the_grasp_or_is_refused_by_file_and_field() {
    let seed = std::env::var(SEED_VARIABLE).map_or(DEFAULT_SEED, |seed| seed.parse().unwrap());
    let folder = Folder::new();
    let model = taught(&folder);
    let next = AtomicUsize::new(0);
    let outcomes: Mutex<BTreeMap<usize, (Kind, Outcome)>> = Mutex::default();
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                loop {
                    let idx = next.fetch_add(1, Ordering::Relaxed);
                    if idx >= NUM_VARIANTS {
                        return;
                    }
                    let variant = Variant::new(seed, idx);
                    let here = PathBuf::from(folder.path(&format!("variant {idx}")));
                    fs::create_dir(&here).unwrap();
                    let mut outcome = variant.run(&here, &model);
                    if variant.kind.is_lossless() && outcome != Outcome::Same {
                        outcome = outcome.into_failure("a variant without loss");
                    }
                    if let Outcome::Other(why) = &outcome {
                        eprintln!("variant {idx} of seed {seed}, {:?}: {}: {why}", variant.kind, variant.recipe());
                    }
                    fs::remove_dir_all(&here).unwrap();
                    outcomes.lock().unwrap().insert(idx, (variant.kind, outcome));
                }
            });
        }
    });
    let outcomes = outcomes.into_inner().unwrap();
    let count = |wanted: &dyn Fn(Kind, &Outcome) -> bool| {
        outcomes.values().filter(|(kind, outcome)| wanted(*kind, outcome)).count()
    };
    for kind in [Kind::Picture, Kind::Marks, Kind::SpoiltPicture, Kind::WrongMarks] {
        let same = count(&|of, outcome| of == kind && *outcome == Outcome::Same);
        let refused = count(&|of, outcome| of == kind && *outcome == Outcome::Refused);
        println!("{kind:?}: {same} gave the grasp, {refused} were refused");
    }
    let lossless = count(&|kind, outcome| kind.is_lossless() && *outcome == Outcome::Same);
    let others = count(&|_, outcome| matches!(outcome, Outcome::Other(_)));
    assert_eq!((outcomes.len(), others), (NUM_VARIANTS, 0), "variants, and those with a third outcome");
    assert!(lossless >= MIN_LOSSLESS, "{lossless} of {NUM_VARIANTS} lose nothing and give the grasp");
}

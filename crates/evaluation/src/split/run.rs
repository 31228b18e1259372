//! Teaches a model from the demonstration of a set, and runs it on the set's pictures.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use sdg_cell::Perception;
use sdg_demonstration::Demonstration;
use sdg_grasp::{ModelKind, TeachOptions, Verification};
use sdg_inputs::annotation_files::beside_photo;
use sdg_inputs::demonstrations;

use super::counts::Counts;
use super::file::SplitSet;
use crate::labelled_pictures::{LabelledFolder, Tested};
use crate::taught_file::TaughtFile;

/// A set whose demonstration was read, and whose labels were checked.
pub struct ReadySet {
    pub set: SplitSet,
    folder: PathBuf,
    demonstration: Demonstration,
}

/// Results of a model on a set.
pub struct SetRun {
    pub set: SplitSet,
    pub seed: u64,
    /// Duration of teaching, in seconds.
    pub teach_secs: f64,
    pub tested: Vec<Tested>,
}

/// The results of a model on all sets, with every seed.
pub struct Measured {
    pub model: ModelKind,
    pub seeds: Vec<u64>,
    pub runs: Vec<SetRun>,
}

/// The kind of a picture: the one in the labels, or else whether the part is in it.
pub(super) fn kind_of(tested: &Tested) -> &str {
    let unnamed = if tested.truths.is_empty() { "without part" } else { "with part" };
    tested.picture.kind.as_deref().unwrap_or(unnamed)
}

impl ReadySet {
    /// Reads the demonstration of a set and checks its labels, before teaching, which takes long.
    ///
    /// # Errors
    /// The folder does not exist, or the demonstration or labels are invalid.
    pub fn open(set: SplitSet, sets: &Path) -> Result<Self> {
        let folder = sets.join(&set.folder);
        if !folder.is_dir() {
            bail!("{}: expected the folder of set \"{}\", found none", folder.display(), set.name);
        }
        let photo = folder.join(&set.demo);
        let demonstration = demonstrations::read_pair(&photo, &beside_photo(&photo)?)?;
        LabelledFolder::check_labels(&folder)?;
        Ok(Self { set, folder, demonstration })
    }

    /// The folder of the set.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The photo and the marks for teaching.
    pub fn demonstration(&self) -> &Demonstration {
        &self.demonstration
    }

    /// Teaches a model with the defaults of `sdg teach`, and runs it on the set's pictures as `sdg detect` does.
    ///
    /// # Errors
    /// Teaching or detection fails; pictures or labels cannot be read.
    pub fn run(&self, model: ModelKind, seed: u64) -> Result<SetRun> {
        let named = || format!("{}, model {model}, seed {seed}", self.set.name);
        let mut options = TeachOptions::new(seed);
        options.kind = model;
        options.symmetry = self.set.symmetry;
        let demonstrations = std::slice::from_ref(&self.demonstration);
        let taught =
            TaughtFile::teach(demonstrations, &options, &mut |_| ControlFlow::Continue(())).with_context(named)?;
        let teach_secs = taught.model.facts().seconds;
        let detector = Perception::of_any_camera(taught.model);
        let labelled = LabelledFolder::read(&self.folder, &detector, None)?;
        let detect = |picture| Tested::detect(picture, &detector, Verification::ByShape);
        let tested = labelled.pictures.into_iter().map(detect).collect::<Result<_>>()?;
        Ok(SetRun { set: self.set.clone(), seed, teach_secs, tested })
    }
}

impl SetRun {
    /// The result on one line.
    pub fn in_words(&self) -> String {
        Counts::of(&self.tested).in_words()
    }
}

impl Measured {
    /// The worst figures of all seeds, each figure on its own, for the pictures that `takes` selects.
    pub fn worst(&self, takes: impl Fn(&SetRun, &Tested) -> bool) -> Counts {
        let of_seed = |seed: &u64| {
            let runs = self.runs.iter().filter(|run| run.seed == *seed);
            Counts::of(runs.flat_map(|run| run.tested.iter().filter(|tested| takes(run, tested))))
        };
        self.seeds.iter().map(of_seed).reduce(Counts::worse_of).unwrap_or_default()
    }

    /// Pictures per second; `None` without pictures.
    pub fn pictures_per_second(&self) -> Option<f64> {
        let tested = || self.runs.iter().flat_map(|run| &run.tested);
        let seconds: f64 = tested().map(|tested| tested.seconds).sum();
        (seconds > 0.0).then(|| tested().count() as f64 / seconds)
    }
}

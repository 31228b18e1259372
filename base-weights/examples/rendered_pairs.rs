//! Aligned pairs of photo and picture from the tuned sets of a split that have exact ground truth: training data of the
//! likeness network, in addition to generated parts.
//!
//! `rendered_pairs SPLIT SETS OUT`: `train_likeness --rendered OUT` reads the file. A part's index is its position in
//! the split.

use std::path::Path;

use anyhow::{Context, Result, bail};
use sdg_evaluation::labelled_pictures::{Instance, TRUTH_FILE, TruthEntry};
use sdg_evaluation::split::{ReadySet, Side, read_split};
use sdg_files::write_atomically;
use sdg_geometry::{PlanarGrasp, PlanarSimilarity};
use sdg_grasp::fitting::{FitInstance, FitPart, FitPicture, PairFacts, append_pair, likeness_examples};

/// Kind of the pictures in which other objects cover the part.
const COVERING: &str = "clutter";

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [split, sets, out] = &arguments[..] else {
        bail!("usage: rendered_pairs SPLIT SETS OUT");
    };
    let mut bytes = Vec::new();
    let tuned = read_split(Path::new(split))?.into_iter().enumerate().filter(|(_, set)| set.side == Side::Tuned);
    for (idx, set) in tuned {
        let name = set.name.clone();
        let Some((part, kinds)) = fit_part(&ReadySet::open(set, Path::new(sets))?)? else {
            continue;
        };
        let (mut right, mut wrong) = (0, 0);
        for example in likeness_examples(&part)? {
            let facts = PairFacts {
                stream: 0,
                part_idx: u16::try_from(idx)?,
                is_right: example.is_right,
                is_clear: kinds[example.picture_idx] != COVERING,
            };
            append_pair(&mut bytes, facts, &example.pair);
            *if example.is_right { &mut right } else { &mut wrong } += 1;
        }
        println!("{name}: {right} right, {wrong} wrong");
    }
    write_atomically(Path::new(out), &bytes)?;
    Ok(())
}

/// The set's part with its pictures, in the form that the fit reads, and the kind of each picture. `None` without exact
/// ground truth (`truth.json`).
///
/// # Errors
/// A picture that cannot be read.
fn fit_part(ready: &ReadySet) -> Result<Option<(FitPart, Vec<String>)>> {
    if !ready.folder().join(TRUTH_FILE).exists() {
        return Ok(None);
    }
    let annotation = &ready.demonstration().annotation;
    let marks = annotation.grasp.context("expected a marked grasp")?;
    let mut symmetry = ready.set.symmetry;
    let (mut kinds, mut pictures) = (Vec::new(), Vec::new());
    for entry in TruthEntry::read_all(ready.folder())? {
        let (optional, counted): (Vec<_>, Vec<_>) = entry.instances.iter().partition(|instance| instance.optional);
        symmetry = counted.iter().find_map(|instance| instance.extent).map_or(symmetry, |extent| extent.symmetry);
        let instance = |instance: &&Instance| {
            let (grasp, extent) = instance.grasp.zip(instance.extent)?;
            let scale = extent.diagonal_px / annotation.bbox.width().hypot(annotation.bbox.height());
            let [from, to] = [&marks, &grasp].map(|line| PlanarGrasp::from_line(line, 0.0));
            let image_from_demonstration =
                PlanarSimilarity::about(from.center(), to.center(), to.angle - from.angle, scale);
            Some(FitInstance { grasp, image_from_demonstration })
        };
        pictures.push(FitPicture {
            image: sdg_inputs::read_image(&ready.folder().join(&entry.image))?,
            instances: counted.iter().filter_map(instance).collect(),
            undecided: optional.iter().map(|instance| instance.bbox).collect(),
        });
        kinds.push(entry.kind.unwrap_or_default());
    }
    let part = FitPart { demonstration: ready.demonstration().clone(), symmetry, pictures };
    Ok(Some((part, kinds)))
}

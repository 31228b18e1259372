//! `sdg evaluate --split`: sets that may be used for tuning and sets that are only reported.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use sdg_evaluation::split::{
    ReadySet, Side, SplitSet, candidates, measure, read_split, results_json, sides_of, tables,
};
use sdg_grasp::ModelKind;

use super::args::EvaluateArgs;
use super::model_names::models;
use crate::exit::{Outcome, Usage};
use crate::progress::EvaluationProgress;

/// Reads all sets first, then teaches and measures one set at a time, because the speed of detection is measured.
pub fn run(args: &EvaluateArgs, file: &Path) -> Result<Outcome> {
    let Some(sets_folder) = &args.split.sets else {
        return Err(Usage("--split: expected --sets DIR beside it, found none".to_owned()).into());
    };
    let models = models(&args.models, &[ModelKind::S])?;
    let seeds = &args.split.seeds;
    if let Some(twice) = (1..seeds.len()).find(|&idx| seeds[..idx].contains(&seeds[idx])) {
        return Err(Usage(format!("--seeds: expected each seed once, found {} again", seeds[twice])).into());
    }
    let is_measured = |set: &SplitSet| !args.split.tuned || set.side == Side::Tuned;
    let sets = read_split(file)?.into_iter().filter(is_measured);
    let sets = sets.map(|set| ReadySet::open(set, sets_folder)).collect::<Result<Vec<_>>>()?;
    let sides = sides_of(&sets);
    if sides.is_empty() {
        bail!("{}: expected sets to measure, found none", file.display());
    }
    if let (Some(results), Some(records)) = (&args.split.results, &args.split.records)
        && sdg_files::is_same_path(results, records)
    {
        let found = records.display();
        return Err(Usage(format!("--records: expected another file than --results, found {found} for both")).into());
    }
    for path in [&args.split.results, &args.split.records].into_iter().flatten() {
        sdg_files::check_replaceable(path, None, b"{")?;
    }

    let progress = EvaluationProgress::new();
    let measured = measure(&models, seeds, &sets, &progress)?;
    progress.finish();

    let results = results_json(file, &sides, &measured);
    let write_results = |path: &PathBuf| -> Result<()> { Ok(sdg_files::write(path, results.to_string().as_bytes())?) };
    let write_records = |path: &PathBuf| -> Result<()> {
        let lines = measured.iter().map(candidates).collect::<Result<String>>()?;
        Ok(sdg_files::write(path, lines.as_bytes())?)
    };
    // The measurement took long: if one file cannot be written, the other one and the tables still are.
    let written = [args.split.results.as_ref().map(write_results), args.split.records.as_ref().map(write_records)];
    if args.json {
        println!("{results}");
    } else {
        let tables: Vec<String> = measured.iter().map(|of_model| tables(of_model, &sides)).collect();
        print!("{}", tables.join("\n"));
    }
    written.into_iter().flatten().collect::<Result<()>>()?;
    Ok(Outcome::Done)
}

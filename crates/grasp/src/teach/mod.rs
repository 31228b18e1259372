//! From demonstrations to a grasp model.
//!
//! ```text
//! demonstrations ─ (model A: crops ─ orientation CNN)
//!        ├─ Augmenter ─ frames, windows ─ train ─ detector ─┐
//!        │      ├─ held-out samples ─── validation ─────────┴─ calibrate ─ GraspModel
//!        │      └─ scenes without the part ────────────────────────┘            │
//!        └─ (model S: nothing to train) ────────────────────────────────────────┤
//! pictures without the part ─ some of the samples, and the scores in them ──────┘
//! ```

mod absent;
mod detector_teaching;
#[cfg(all(test, any(feature = "ndarray", feature = "wgpu", feature = "cuda")))]
mod device_parity;
mod edge_height;
mod event;
mod fine_tuning;
mod held_back;
pub(crate) mod negatives;
mod network_teaching;
mod options;
mod orientation;
mod other_parts;
mod paper;
mod preset;
mod r50;
mod side_by_side;
mod start;
pub(crate) mod symmetry;
#[cfg(test)]
pub(crate) mod tests;
mod turned;
mod unmarked;

use std::ops::ControlFlow;
use std::time::Instant;

use image::RgbImage;
use sdg_demonstration::{Augmenter, Demonstration};
use sdg_detection::GeneralizedRcnn;
use sdg_geometry::GraspLine;
use sdg_layers::state_dict;
use sdg_training::{History, SampleSource, Trained, TrainingError, ValidationRecord, first_windows, train};

use crate::cutout_budget::{CutoutBudget, MIN_PART_PX, check_count};
use crate::decimal::decimal;
use crate::error::{GraspError, Result};
use crate::facts::{ModelKind, TeachingFacts, ValidationFacts};
use crate::model::GraspModel;
use crate::models::mask::MaskMatcher;
use crate::models::{Network, Proposals, Reading};
use crate::network_evidence::NetworkEvidence;
use crate::score_calibration::ScoreCalibration;
use crate::search_window::check_region;
use crate::taught::TaughtDemonstration;

use absent::AbsentSamples;
pub use absent::AcceptedNegative;
use edge_height::edge_height;
pub use event::TeachingEvent;
pub use fine_tuning::FineTuning;
use held_back::HeldBack;
use negatives::NegativeScenes;
pub(crate) use network_teaching::NetworkTeaching;
use network_teaching::ReadingTeaching;
pub use options::TeachOptions;
pub use preset::Preset;
use side_by_side::side_by_side;
pub use start::Start;
use symmetry::HiddenTurns;
pub use turned::{TurnedGrasp, turned_grasps};
pub use unmarked::without_unmarked_parts;

/// A model and the run that made it.
#[derive(Debug, Clone)]
pub struct Taught {
    /// The model, ready to detect.
    pub model: GraspModel,
    /// Losses and validations of the detector; `None` for model S, which has none.
    pub history: Option<History>,
    /// The pictures without the part in which the model still accepts something.
    pub accepted_negatives: Vec<AcceptedNegative>,
}

/// Teaches a grasp model. `observe` is called after every step and validation, and may stop teaching, which then
/// keeps the best network so far if it is good enough.
///
/// # Errors
/// No demonstration, a demonstration that lacks marks required by the model or is among the pictures without the part,
/// a region in which the part cannot be searched, missing base weights, or a training without a usable result.
pub fn teach(
    demonstrations: &[Demonstration],
    options: &TeachOptions,
    observe: &mut dyn FnMut(&TeachingEvent) -> ControlFlow<()>,
) -> Result<Taught> {
    let start = Instant::now();
    check_marks(demonstrations, options.kind)?;
    let is_shown = |picture: &RgbImage| demonstrations.iter().any(|demonstration| demonstration.image == *picture);
    if let Some(at) = options.negatives.iter().position(is_shown) {
        return Err(GraspError::DemonstrationAsNegative { number: at + 1 });
    }
    if options.lengths.is_none() {
        check_teaching_region(demonstrations, options)?;
    }
    let options = options.with_start_read()?;
    let mut by_search = without_network(demonstrations, &options)?;
    let (alone, _) = without_unmarked_parts(&by_search, demonstrations)?;
    let mut lengths = options.lengths.clone();
    if let Some(lengths) = lengths.as_mut().filter(|_| demonstrations.len() > 1) {
        let of_known_size = by_search.clone().of_known_size()?;
        lengths.edges = edge_height(of_known_size.demonstrations(), demonstrations, options.symmetry, lengths)?;
    }
    let mut taught = match NetworkTeaching::new(&options, demonstrations[0].image.dimensions().into()) {
        Some(teaching) => teach_network(demonstrations, &alone, &teaching, &options, observe, start)?,
        None => {
            by_search.score_calibration.resemblance =
                NegativeScenes::new(&alone, options.seed, NUM_NEGATIVE_SCENES_WITHOUT_NETWORK)?
                    .observe(None)?
                    .resemblance();
            Taught { model: by_search, history: None, accepted_negatives: Vec::new() }
        }
    };
    if !options.negatives.is_empty() {
        (taught.model, taught.accepted_negatives) = absent::calibrated(taught.model, demonstrations, &options)?;
    }
    taught.model.facts.lengths = lengths;
    taught.model.facts.seconds = decimal(start.elapsed().as_secs_f64());
    taught.model = taught.model.with_region(options.region)?;
    Ok(taught)
}

/// Whether a region can be searched for the part of these demonstrations with these [`TeachOptions`]. Demonstrations
/// made by [`seen_from_above`](crate::seen_from_above) are checked by
/// [`check_region_from_above`](crate::check_region_from_above).
///
/// # Errors
/// A region without pixels. A region that names the size of its pictures must also lie within them and be large enough
/// for the part.
pub fn check_teaching_region(demonstrations: &[Demonstration], options: &TeachOptions) -> Result<()> {
    match &options.region {
        Some(region) => check_region(region, Some(&taught(demonstrations, options)?)),
        None => Ok(()),
    }
}

/// Checks the marks: every model needs the grasp line and enough pixels of the part, and model D also an outline.
/// Several demonstrations must agree.
fn check_marks(demonstrations: &[Demonstration], kind: ModelKind) -> Result<()> {
    check_count(demonstrations.len())?;
    for Demonstration { annotation, .. } in demonstrations {
        annotation.require_grasp()?;
        let (width, height) = (annotation.bbox.width(), annotation.bbox.height());
        if width.max(height) < MIN_PART_PX {
            return Err(GraspError::PartTooSmall { least: MIN_PART_PX, width, height });
        }
        if kind == ModelKind::D {
            annotation.require_outline()?;
        }
    }
    check_agreement(demonstrations)
}

/// Checks that several demonstrations show one part, and that no photo is marked in two ways.
fn check_agreement(demonstrations: &[Demonstration]) -> Result<()> {
    let contradiction = |expected: String, found: String| GraspError::ContradictingDemonstrations { expected, found };
    let first = &demonstrations[0].annotation.label;
    for (idx, demonstration) in demonstrations.iter().enumerate() {
        let label = &demonstration.annotation.label;
        if label != first {
            return Err(contradiction(
                format!("the first is labelled \"{first}\""),
                format!("number {} labelled \"{label}\"", idx + 1),
            ));
        }
        let same_photo = demonstrations[..idx].iter().position(|other| other.image == demonstration.image);
        let Some(other_idx) = same_photo else { continue };
        let grasp = |idx: usize| demonstrations[idx].annotation.require_grasp().copied();
        let (one, other) = (grasp(other_idx)?, grasp(idx)?);
        if one != other {
            let at = |line: GraspLine| format!("({:.0}, {:.0})", line.center().x, line.center().y);
            return Err(contradiction(
                format!("the photo of number {} is grasped at {}", other_idx + 1, at(one)),
                format!("the same photo as number {}, grasped at {}", idx + 1, at(other)),
            ));
        }
    }
    Ok(())
}

/// Number of scenes of other objects in which the resemblance is measured. Chosen by hand to save time, not measured.
const NUM_NEGATIVE_SCENES: u64 = 12;
/// The number for model S, which must be ready in less than a second. Chosen by hand to save time, not measured.
pub(crate) const NUM_NEGATIVE_SCENES_WITHOUT_NETWORK: u64 = 8;

/// The demonstrations as stored in the model.
fn taught(demonstrations: &[Demonstration], options: &TeachOptions) -> Result<Vec<TaughtDemonstration>> {
    let mut budget = CutoutBudget::default();
    let with_tolerance = |demonstration| {
        let taught = TaughtDemonstration::new(demonstration)?;
        budget.take(&taught.cutout, &taught.marks)?;
        let mut check = taught.check().clone();
        check.search.scales = options.size_tolerance.clone();
        if check == *taught.check() { Ok(taught) } else { taught.with_check(check) }
    };
    demonstrations.iter().map(with_tolerance).collect()
}

/// Model S, which is the demonstrations alone, with a neutral resemblance of other objects.
fn without_network(demonstrations: &[Demonstration], options: &TeachOptions) -> Result<GraspModel> {
    Ok(GraspModel {
        preset: options.preset.name().to_owned(),
        network: None,
        demonstrations: taught(demonstrations, options)?,
        score_calibration: ScoreCalibration::NEUTRAL,
        facts: TeachingFacts {
            seed: options.seed,
            symmetry: options.symmetry,
            size_tolerance: Some([*options.size_tolerance.start(), *options.size_tolerance.end()]),
            lengths: options.lengths.clone(),
            region: None,
            samples: 0,
            steps: 0,
            seconds: 0.0,
            validation: None,
            orientation: None,
            negatives: None,
            base_weights_sha256: None,
        },
    })
}

/// Number of windows from which this project's base weights compute the detector's last layers before training.
const NUM_VIEWS: usize = 64;

/// Teaches a model with a network. Samples are made from `alone`, the photos of the demonstrations without
/// unmarked parts.
pub(crate) fn teach_network(
    demonstrations: &[Demonstration],
    alone: &[Demonstration],
    teaching: &NetworkTeaching,
    options: &TeachOptions,
    observe: &mut dyn FnMut(&TeachingEvent) -> ControlFlow<()>,
    start: Instant,
) -> Result<Taught> {
    let taught = taught(demonstrations, options)?;
    // The base weights are applied first, so that an error in them appears at once instead of after minutes.
    let detector = teaching.detector.initial(options.start.weights(), &options.device, options.seed)?;
    let comparison = match options.start.weights() {
        Some(base_weights) => base_weights.comparison(&options.device)?,
        None => None,
    };
    let mut orientation_facts = None;
    let reading = match &teaching.reading {
        ReadingTeaching::BoxAndCrop(orientation_teaching) => {
            let (network, facts) = orientation::teach(alone, orientation_teaching, options, observe)?;
            orientation_facts = Some(facts);
            Reading::BoxAndCrop(Box::new(network))
        }
        ReadingTeaching::BoxAndKeypoints => Reading::BoxAndKeypoints,
        ReadingTeaching::Keypoints => Reading::Keypoints,
        ReadingTeaching::Mask => Reading::Mask(MaskMatcher::new(&taught)?),
    };

    let augmenter = Augmenter::new(alone, teaching.samples.clone(), options.seed)?;
    let held_back_augmenter = Augmenter::new(alone, teaching.held_back.clone(), options.seed)?;
    let [to_learn, to_hold_back] = other_parts::draw(teaching.num_other_parts, options.seed);
    let augmenter = augmenter.with_other_parts(&to_learn)?;
    let held_back_augmenter = held_back_augmenter.with_other_parts(&to_hold_back)?;
    let turns = HiddenTurns::new(alone, options.symmetry);
    let numbers: Vec<u64> = (0..teaching.training.validation.samples as u64).collect();
    let held_back = side_by_side(&numbers, |&number| Ok(turns.canonical(held_back_augmenter.held_out(number))))?;
    // It takes up to half a gigabyte for each photo.
    drop(held_back_augmenter);
    let held_back = HeldBack { samples: &held_back, turns: &turns };
    let mut training = teaching.training.clone();
    training.time_budget = options.time_budget.map(|budget| budget.saturating_sub(start.elapsed()));

    let recurring = |i: u64| teaching.distinct_samples.map_or(i, |distinct| i % distinct);
    let windows = augmenter.windows(teaching.detector.network.input.size_divisibility as u32);
    let resize_rule = teaching.detector.network.input.resize;
    let window_of = |picture: &RgbImage| absent::window(picture, options, &taught);
    let frame_size = augmenter.output_size();
    let absent = AbsentSamples::new(&options.negatives, window_of, frame_size, resize_rule, options.seed);
    let source = SampleSource {
        frames: &|i| {
            let whole = || absent.sample(i, augmenter.output_size());
            whole().unwrap_or_else(|| turns.canonical(augmenter.sample(recurring(i))))
        },
        windows: &|i| {
            let window = || absent.sample(i, windows.output_size());
            window().unwrap_or_else(|| turns.canonical(windows.sample(recurring(i))))
        },
    };
    let detector = match options.start.weights() {
        Some(base_weights) if base_weights.is_ours() => {
            let (images, targets) = first_windows(NUM_VIEWS, &teaching.detector.network.input, &source)?;
            base_weights.imprint(detector, &images, &targets)?
        }
        _ => detector,
    };
    // The model that is validated, calibrated and returned equals the model read from its file, without the head that
    // exists only during teaching.
    let finished = |detector: &GeneralizedRcnn| -> Result<Network> {
        let own = teaching.detector.network.init(&options.device, options.seed)?;
        let detector = state_dict::import(own, &state_dict::export(detector)).0;
        Ok(Network { detector, reading: reading.clone(), comparison: comparison.clone() }.rounded())
    };
    // The samples also show the part at sizes outside the later search range.
    let of_any_size: Vec<TaughtDemonstration> =
        demonstrations.iter().map(TaughtDemonstration::new).collect::<Result<_>>()?;
    let mut proposed = Vec::new();
    let Trained { detector, history } = train(
        detector,
        &training,
        source,
        &mut |detector: &GeneralizedRcnn| {
            let proposals = finished(detector).and_then(|network| held_back.propose(&network, &of_any_size));
            proposed.push(proposals.map_err(|error| TrainingError::Examination(error.into()))?);
            Ok(proposed.last().map_or_else(Vec::new, |proposals| held_back.outcomes(proposals)))
        },
        &mut |event| observe(&TeachingEvent::from(*event)),
    )?;
    let network = finished(&detector)?;
    let mut on_other_parts = other_parts::shown(alone, &to_hold_back, &network, options.seed)?;
    on_other_parts.highest.extend(absent::highest_scores(&network, &of_any_size, options)?);
    let is_kept = |(record, _): &(&ValidationRecord, &Vec<Proposals>)| record.steps_done == history.best.steps_done;
    let Some((_, proposals)) = history.validations.iter().zip(&proposed).find(is_kept) else {
        panic!("the network that is kept was validated")
    };
    let calibrated =
        held_back.calibrate(network.usual_threshold(), proposals, &of_any_size, &on_other_parts.highest)?;
    let (hits, positives) = (calibrated.hits, calibrated.positives);
    if (hits as f64) < teaching.min_hit_rate * positives as f64 {
        return Err(GraspError::NotLearnt { hits, positives, steps: history.steps.len() });
    }
    let negatives = NegativeScenes::new(alone, options.seed, NUM_NEGATIVE_SCENES)?;
    let others = negatives.observe(Some(&network))?;
    let elsewhere: Vec<f64> = calibrated
        .elsewhere
        .iter()
        .copied()
        .chain(others.network_scores())
        .chain(on_other_parts.best_agreement)
        .collect();
    let evidence = NetworkEvidence::new(&calibrated.on_part, &elsewhere, &calibrated.network);
    let facts = TeachingFacts {
        seed: options.seed,
        symmetry: options.symmetry,
        size_tolerance: Some([*options.size_tolerance.start(), *options.size_tolerance.end()]),
        lengths: options.lengths.clone(),
        region: None,
        samples: history.steps.iter().map(|step| step.samples).sum(),
        steps: history.steps.len(),
        seconds: decimal(start.elapsed().as_secs_f64()),
        validation: Some(ValidationFacts {
            hit_rate: decimal(history.best.validation.hit_rate()),
            error_px: decimal(calibrated.error_px),
            error_degrees: decimal(calibrated.error_degrees),
        }),
        orientation: orientation_facts,
        negatives: None,
        base_weights_sha256: options.start.weights().map(|base_weights| base_weights.sha256.clone()),
    };
    let model = GraspModel {
        preset: options.preset.name().to_owned(),
        network: Some(network),
        demonstrations: taught,
        score_calibration: ScoreCalibration {
            network: calibrated.network,
            evidence: Some(evidence),
            resemblance: others.resemblance(),
        },
        facts,
    };
    Ok(Taught { model, history: Some(history), accepted_negatives: Vec::new() })
}

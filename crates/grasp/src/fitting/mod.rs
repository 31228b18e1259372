//! Fits the constants of [`CheckConfig`] on pictures with ground truth: for maintainers.
//!
//! ```text
//! parts with pictures ─ observe: search, evidence of correct and wrong poses ┬─ score: logistic regression ─┐
//! constant × grid ─ observe again ─ regression again ────────────────────────┴─ loss on the training half ──┤
//!                                                       best value of each ─── loss on the held-out half ───┘
//! ```
//! First the pictures are searched once, and the weights of the score are fitted. Then each listed constant of
//! [`CheckConfig::search`] ([`constant_names`]) is fitted alone, with the others at their present values. For each
//! value the weights are fitted again, and for each value but the present one the pictures are searched again, because
//! the evidence depends on the constants.
//!
//! **Loss** ([`Loss`]). A picture's detections are scored as in detection. Let p be the best score of a correct pose of
//! an instance and q the best score of a wrong pose in a picture, each 0 if there is none; both are clamped to the
//! range from 0.01 to 0.99. A part's loss is the mean of −ln p over the instances plus the mean of −ln (1 − q) over the
//! pictures; the loss of several parts is the mean of their losses. The minimum is 0.02. A correct pose lies within 4 %
//! of the part's diagonal and 10° of an instance, up to its symmetry. Poses on a part that differs only in size count
//! as neither correct nor wrong: without a calibrated camera, that part looks like the taught one at another distance.
//!
//! **Intervals.** Parts are independent, pictures of one part are not. A difference between two values is therefore
//! computed per part; its interval is the mean ± 1.96 standard errors of those differences.
//!
//! A fit changes no constant, and is deterministic for any number of threads.

mod constants;
mod likeness;
mod loss;
mod observation;
mod pair_records;
mod pictures;
mod regression;
mod report;

use crate::check_config::{CheckConfig, ScoreConfig};
use crate::error::{GraspError, Result};

use self::constants::{CONSTANTS, Constant};
pub use self::likeness::{LikenessExample, likeness_examples};
pub use self::loss::{Difference, Loss};
use self::loss::{losses, mean_loss};
use self::observation::{PartObservations, PreparedPart};
pub use self::pair_records::{PAIR_RECORD_BYTES, PairFacts, append_pair, pair_facts, pair_of};
pub use self::pictures::{FitInstance, FitPart, FitPicture};
use self::regression::fit_score;
pub use self::report::{ConstantReport, FitReport, ScoreReport, Trial};

/// The settings of a fit.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct FitOptions {
    /// The seed of the composed negatives of each part.
    pub seed: u64,
    /// Names of the constants to fit, as [`constant_names`] lists them; if empty, all. The score's weights are always
    /// fitted.
    pub only: Vec<String>,
}

/// The name of the score's weights among the names of the constants. The weights are always fitted; if this is the only
/// chosen name, no constant is.
const SCORE: &str = "score";

/// The names of all constants that can be fitted, and of the score's weights.
pub fn constant_names() -> Vec<&'static str> {
    std::iter::once(SCORE).chain(CONSTANTS.iter().map(|constant| constant.name)).collect()
}

/// The progress of a fit, which takes minutes to hours.
#[derive(Debug)]
#[non_exhaustive]
pub enum FitEvent<'a> {
    /// The pictures of the training half are searched with a value of a constant.
    Searching {
        /// Name of the constant.
        constant: &'static str,
        /// The tried value.
        value: f64,
    },
    /// The score's weights have been fitted.
    Score(&'a ScoreReport),
    /// A constant has been fitted.
    Fitted(&'a ConstantReport),
}

/// Fits the score's weights and each chosen constant on `training`, and reports the effect on `held_out`; `observe` is
/// called with the progress.
///
/// # Errors
/// A name that belongs to no constant, a half with fewer than two parts, and a part that cannot be taught.
pub fn fit(
    training: &[FitPart],
    held_out: &[FitPart],
    options: &FitOptions,
    observe: &mut dyn FnMut(&FitEvent<'_>),
) -> Result<FitReport> {
    let chosen = chosen_constants(&options.only)?;
    for found in [training.len(), held_out.len()] {
        if found < 2 {
            return Err(GraspError::InvalidConfig {
                name: "parts",
                expected: "at least 2 on either side",
                found: found as f64,
            });
        }
    }
    let prepare = |parts| PreparedPart::prepare_all(parts, options.seed);
    let sides = Sides { training: prepare(training)?, held_out: prepare(held_out)? };
    let today = CheckConfig::DEFAULT;
    let observed = sides.observed(&today)?;
    let score = report_score(&observed);
    observe(&FitEvent::Score(&score));

    let mut constants = Vec::new();
    for constant in chosen {
        let report = fit_constant(constant, &sides, &observed, observe)?;
        observe(&FitEvent::Fitted(&report));
        constants.push(report);
    }
    Ok(FitReport {
        num_training: training.len(),
        num_held_out: held_out.len(),
        today: mean_loss(&losses(&observed.held_out, &today.score)),
        today_training: mean_loss(&losses(&observed.training, &today.score)),
        constants,
        score,
    })
}

fn chosen_constants(only: &[String]) -> Result<Vec<&'static Constant>> {
    if only.is_empty() {
        return Ok(CONSTANTS.iter().collect());
    }
    only.iter()
        .filter(|name| *name != SCORE)
        .map(|name| {
            CONSTANTS
                .iter()
                .find(|constant| constant.name == name)
                .ok_or_else(|| GraspError::UnknownConstant { known: constant_names(), found: name.clone() })
        })
        .collect()
}

/// Both halves of the parts.
struct Sides<'a> {
    training: Vec<PreparedPart<'a>>,
    held_out: Vec<PreparedPart<'a>>,
}

/// The observations of both halves.
struct Observed {
    training: Vec<PartObservations>,
    held_out: Vec<PartObservations>,
}

impl Sides<'_> {
    fn observed(&self, config: &CheckConfig) -> Result<Observed> {
        Ok(Observed {
            training: PreparedPart::observe_all(&self.training, config)?,
            held_out: PreparedPart::observe_all(&self.held_out, config)?,
        })
    }
}

/// Refits the score's weights for each value, and searches the pictures again for each but the present one.
fn fit_constant(
    constant: &Constant,
    sides: &Sides<'_>,
    today: &Observed,
    observe: &mut dyn FnMut(&FitEvent<'_>),
) -> Result<ConstantReport> {
    let value_today = constant.get(&CheckConfig::DEFAULT);
    let mut trials = Vec::new();
    let mut best: Option<(f64, CheckConfig)> = None;
    let mut config_today = CheckConfig::DEFAULT;
    for &value in constant.grid {
        let mut config = CheckConfig::DEFAULT;
        constant.set(&mut config, value);
        let again;
        let observed = if value == value_today {
            &today.training
        } else {
            observe(&FitEvent::Searching { constant: constant.name, value });
            again = PreparedPart::observe_all(&sides.training, &config)?;
            &again
        };
        config.score = fit_score(observed, &config.score);
        let loss = mean_loss(&losses(observed, &config.score)).total;
        trials.push(Trial { value, loss });
        if value == value_today {
            config_today = config.clone();
        }
        if best.as_ref().is_none_or(|(least, _)| loss < *least) {
            best = Some((loss, config));
        }
    }
    let config = best.map_or_else(|| config_today.clone(), |(_, config)| config);
    let before = losses(&today.held_out, &config_today.score);
    let after = if constant.get(&config) == value_today {
        before.clone()
    } else {
        losses(&PreparedPart::observe_all(&sides.held_out, &config)?, &config.score)
    };
    Ok(ConstantReport {
        name: constant.name,
        file: constant.file,
        today: value_today,
        fitted: constant.get(&config),
        trials,
        before: mean_loss(&before),
        after: mean_loss(&after),
        difference: Difference::between(&before, &after),
    })
}

/// The score's weights: fitted on the training half and measured on the held-out half, and fitted on all parts. The
/// weights fitted on all parts are the ones to adopt.
fn report_score(observed: &Observed) -> ScoreReport {
    let today = ScoreConfig::DEFAULT;
    let fitted = fit_score(&observed.training, &today);
    let all: Vec<PartObservations> = observed.training.iter().chain(&observed.held_out).cloned().collect();
    let [before, after] = [&today, &fitted].map(|score| losses(&observed.held_out, score));
    ScoreReport {
        fitted,
        on_all: fit_score(&all, &today),
        before: mean_loss(&before),
        after: mean_loss(&after),
        difference: Difference::between(&before, &after),
    }
}

#[cfg(test)]
mod tests;

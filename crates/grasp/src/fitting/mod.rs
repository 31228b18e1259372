//! The constants of [`CheckConfig`] fitted on pictures with truth, for whoever maintains them.
//!
//! ```text
//! parts with pictures ─ observe: search, agreements of right and wrong poses, of negatives ─┐
//! constant × grid ──────────────────────────────────────────────────────────────────────────┼─ loss on the training half
//!                                                                 best value of each ───────┴─ loss on the held-out half
//! ```
//! Each constant is fitted alone, the others at today's values: first those of size and threshold, for which no picture is
//! searched again, then those of [`CheckConfig::search`], for which every one is. The threshold's margin above the
//! negatives depends on how large agreements are, so that it is fitted again for every value of the latter, today's
//! included. Size and threshold are fitted together, too, by coordinate descent.
//!
//! **Loss** ([`Loss`]). A picture's detections are scored as in use: agreement, less the size penalty, through the
//! logistic at the part's own threshold. Let p be the best score of a right pose of an instance (0 where there is none) and
//! q the best score of a wrong pose in a picture (likewise); both are kept within 0.01 and 0.99. A part's loss is the mean of
//! −ln p over the instances plus the mean of −ln (1 − q) over the pictures; the loss of several parts is their mean.
//! 0.02 is the least, 0.69 is one coin toss. A right pose lies within 4 % of the part's size and 10° of an instance, turns
//! that its symmetry hides not counted.
//!
//! **Intervals.** Parts are independent, pictures of one part are not: a difference between two values is taken part by
//! part, and its interval is the mean ± 1.96 standard errors of those differences.
//!
//! Nothing here changes a constant. Deterministic, whatever the number of threads.

mod constants;
mod loss;
mod observation;
mod pictures;
mod report;

use crate::check_config::CheckConfig;
use crate::error::{GraspError, Result};

use self::constants::{CONSTANTS, Constant};
pub use self::loss::{Difference, Loss};
use self::loss::{losses, mean_loss};
use self::observation::{PartObservations, PreparedPart};
pub use self::pictures::{FitInstance, FitPart, FitPicture};
pub use self::report::{ConstantReport, FitReport, JointReport, Trial};

/// What is fitted.
#[derive(Debug, Clone, Default)]
pub struct FitOptions {
    /// Decides the negatives that are composed for each part.
    pub seed: u64,
    /// Names of the constants to fit, as [`constant_names`] lists them; all where empty.
    pub only: Vec<String>,
}

/// The names of all constants that can be fitted.
pub fn constant_names() -> Vec<&'static str> {
    CONSTANTS.iter().map(|constant| constant.name).collect()
}

/// What a fit is doing: it takes minutes to hours.
#[derive(Debug)]
#[non_exhaustive]
pub enum FitEvent<'a> {
    /// All pictures are searched with a constant's value.
    Searching {
        /// The constant.
        constant: &'static str,
        /// The value.
        value: f64,
    },
    /// Size and threshold are fitted together.
    Joint(&'a JointReport),
    /// A constant is fitted.
    Fitted(&'a ConstantReport),
}

/// Fits each constant on `training` and tells what its value does on `held_out`; `observe` hears how it goes.
///
/// # Errors
/// A name that no constant has, fewer than two parts on either side, and a part that cannot be taught.
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
    let joint = fit_jointly(&observed);
    observe(&FitEvent::Joint(&joint));

    let mut constants = Vec::new();
    for constant in chosen {
        let report = if constant.needs_search {
            fit_of_search(constant, &sides, &observed, observe)?
        } else {
            fit_of_check(constant, &observed)
        };
        observe(&FitEvent::Fitted(&report));
        constants.push(report);
    }
    Ok(FitReport {
        num_training: training.len(),
        num_held_out: held_out.len(),
        today: mean_loss(&losses(&observed.held_out, &today)),
        today_training: mean_loss(&losses(&observed.training, &today)),
        constants,
        joint,
    })
}

fn chosen_constants(only: &[String]) -> Result<Vec<&'static Constant>> {
    if only.is_empty() {
        return Ok(CONSTANTS.iter().collect());
    }
    only.iter()
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

/// What was seen in both halves.
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

/// A constant of the search: every picture is searched again, and the margin above the negatives fitted again.
fn fit_of_search(
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
        let loss = fit_margin(&mut config, observed);
        trials.push(Trial { value, loss });
        if value == value_today {
            config_today = config.clone();
        }
        if best.as_ref().is_none_or(|(least, _)| loss < *least) {
            best = Some((loss, config));
        }
    }
    let config = best.map_or_else(|| config_today.clone(), |(_, config)| config);
    let before = losses(&today.held_out, &config_today);
    let after = if constant.get(&config) == value_today {
        before.clone()
    } else {
        losses(&PreparedPart::observe_all(&sides.held_out, &config)?, &config)
    };
    Ok(ConstantReport {
        name: constant.name,
        file: constant.file,
        is_margin_fitted: true,
        today: value_today,
        fitted: constant.get(&config),
        trials,
        before: mean_loss(&before),
        after: mean_loss(&after),
        difference: Difference::between(&before, &after),
    })
}

/// Sets the margin of the threshold that suits `observed` best; the loss there.
fn fit_margin(config: &mut CheckConfig, observed: &[PartObservations]) -> f64 {
    constants::MARGIN.descend(config, &mut |config| mean_loss(&losses(observed, config)).total)
}

/// A constant of size or threshold: the observations stay.
fn fit_of_check(constant: &Constant, observed: &Observed) -> ConstantReport {
    let today = CheckConfig::DEFAULT;
    let mut config = today.clone();
    let mut trials = Vec::new();
    constant.descend(&mut config, &mut |config| {
        let loss = mean_loss(&losses(&observed.training, config)).total;
        trials.push(Trial { value: constant.get(config), loss });
        loss
    });
    let [before, after] = [&today, &config].map(|config| losses(&observed.held_out, config));
    ConstantReport {
        name: constant.name,
        file: constant.file,
        is_margin_fitted: false,
        today: constant.get(&today),
        fitted: constant.get(&config),
        trials,
        before: mean_loss(&before),
        after: mean_loss(&after),
        difference: Difference::between(&before, &after),
    }
}

/// Size and threshold together, by coordinate descent until a round changes nothing.
fn fit_jointly(observed: &Observed) -> JointReport {
    const MAX_ROUNDS: usize = 10;
    let today = CheckConfig::DEFAULT;
    let mut config = today.clone();
    for _ in 0..MAX_ROUNDS {
        let before = config.clone();
        for constant in CONSTANTS.iter().filter(|constant| !constant.needs_search) {
            constant.descend(&mut config, &mut |config| mean_loss(&losses(&observed.training, config)).total);
        }
        if config == before {
            break;
        }
    }
    let [before, after] = [&today, &config].map(|config| losses(&observed.held_out, config));
    JointReport {
        values: CONSTANTS
            .iter()
            .filter(|constant| !constant.needs_search)
            .map(|constant| (constant.name, constant.get(&today), constant.get(&config)))
            .collect(),
        before: mean_loss(&before),
        after: mean_loss(&after),
        difference: Difference::between(&before, &after),
    }
}

#[cfg(test)]
mod tests;

//! The results of a fit, and their printed form.

use std::fmt;

use super::loss::{Difference, Loss};
use crate::check_config::ScoreConfig;

/// A tried value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trial {
    /// The tried value.
    pub value: f64,
    /// The loss on the training half.
    pub loss: f64,
}

/// The result for one constant.
#[derive(Debug, Clone, PartialEq)]
pub struct ConstantReport {
    /// The constant's field of [`crate::CheckConfig`].
    pub name: &'static str,
    /// The file that contains the constant's value.
    pub file: &'static str,
    /// Present value.
    pub today: f64,
    /// The value with the smallest loss on the training half.
    pub fitted: f64,
    /// All tried values.
    pub trials: Vec<Trial>,
    /// Loss on the held-out half with the present value.
    pub before: Loss,
    /// Loss on the held-out half with the fitted value.
    pub after: Loss,
    /// Difference of the losses, fitted minus present.
    pub difference: Difference,
}

/// The result for the score's weights.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoreReport {
    /// The weights fitted on the training half.
    pub fitted: ScoreConfig,
    /// The weights fitted on both halves, which are the ones to adopt.
    pub on_all: ScoreConfig,
    /// Loss on the held-out half with the present weights.
    pub before: Loss,
    /// Loss on the held-out half with the weights fitted on the training half.
    pub after: Loss,
    /// Difference of the losses, `after` minus `before`.
    pub difference: Difference,
}

/// The results of a fit; the printed form is Markdown.
#[derive(Debug, Clone, PartialEq)]
pub struct FitReport {
    /// Parts used for fitting.
    pub num_training: usize,
    /// Parts used for measuring the fitted values.
    pub num_held_out: usize,
    /// Loss of the present values on the held-out half.
    pub today: Loss,
    /// Loss of the present values on the training half.
    pub today_training: Loss,
    /// The result for each constant alone.
    pub constants: Vec<ConstantReport>,
    /// The result for the score's weights.
    pub score: ScoreReport,
}

impl fmt::Display for FitReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "Parts: {} to fit on, {} held out.\n", self.num_training, self.num_held_out)?;
        writeln!(
            f,
            "| today's values | loss | of right poses | of wrong poses | right accepted | pictures with a false alarm |"
        )?;
        writeln!(f, "|---|--:|--:|--:|---|---|")?;
        for (name, loss) in [("training half", &self.today_training), ("held-out half", &self.today)] {
            let Loss { total, right, wrong, accepted, false_alarms } = loss;
            writeln!(
                f,
                "| {name} | {total:.3} | {right:.3} | {wrong:.3} | {} of {} | {} of {} |",
                accepted[0], accepted[1], false_alarms[0], false_alarms[1]
            )?;
        }
        writeln!(
            f,
            "\n{}\nEach constant is fitted alone, with the others as today; the score's weights are fitted again for \
             every value, also for today's.",
            self.score
        )?;
        writeln!(f, "Loss, right accepted and false alarms on the held-out half.\n")?;
        writeln!(
            f,
            "| constant | today | fitted | loss: today → fitted | difference, 95 % | right accepted | false alarms | changes |"
        )?;
        writeln!(f, "|---|--:|--:|---|---|---|---|---|")?;
        for constant in &self.constants {
            writeln!(f, "{constant}")?;
        }
        writeln!(f, "\nLoss on the training half of every value that was tried:\n")?;
        for constant in &self.constants {
            writeln!(f, "- `{}`: {}", constant.name, constant.tried())?;
        }
        Ok(())
    }
}

/// A row of the table.
impl fmt::Display for ConstantReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "| `{}` | {} | {} |", self.name, Short(self.today), Short(self.fitted))?;
        change(f, &self.before, &self.after, &self.difference)?;
        write!(f, " {} |", verdict(self.today != self.fitted, &self.difference))
    }
}

impl ConstantReport {
    /// All tried values and their losses, in ascending order.
    pub fn tried(&self) -> String {
        let mut trials = self.trials.clone();
        trials.sort_by(|a, b| a.value.total_cmp(&b.value));
        let tried: Vec<String> = trials.iter().map(|t| format!("{}: {:.3}", Short(t.value), t.loss)).collect();
        tried.join(", ")
    }
}

impl fmt::Display for ScoreReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "The score, each term's weight (neutral value):\n")?;
        writeln!(f, "| term | today | fitted on the training half | on both halves |")?;
        writeln!(f, "|---|--:|--:|--:|")?;
        let columns = [&ScoreConfig::DEFAULT, &self.fitted, &self.on_all];
        for (k, (name, _)) in ScoreConfig::DEFAULT.terms().iter().enumerate() {
            write!(f, "| {name} |")?;
            for config in columns {
                let (_, term) = config.terms()[k];
                write!(f, " {} ({}) |", Short(term.weight), Short(term.neutral))?;
            }
            writeln!(f)?;
        }
        let [today, fitted, on_all] = columns.map(|config| Short(config.bias));
        writeln!(f, "| bias | {today} | {fitted} | {on_all} |")?;
        writeln!(f, "\n| loss: today → fitted | difference, 95 % | right accepted | false alarms | changes |")?;
        write!(f, "|---|---|---|---|---|\n|")?;
        change(f, &self.before, &self.after, &self.difference)?;
        writeln!(f, " {} |", verdict(self.fitted != ScoreConfig::DEFAULT, &self.difference))
    }
}

fn change(f: &mut fmt::Formatter<'_>, before: &Loss, after: &Loss, difference: &Difference) -> fmt::Result {
    write!(
        f,
        " {:.3} → {:.3} | {:+.3} ± {:.3} | {} → {} of {} | {} → {} of {} |",
        before.total,
        after.total,
        difference.mean,
        difference.half_interval,
        before.accepted[0],
        after.accepted[0],
        after.accepted[1],
        before.false_alarms[0],
        after.false_alarms[0],
        after.false_alarms[1]
    )
}

/// Whether the fit changes a constant or the weights, in words.
fn verdict(is_other: bool, difference: &Difference) -> &'static str {
    match (is_other, difference.is_improvement()) {
        (false, _) => "no",
        (true, true) => "yes",
        (true, false) => "not beyond the interval",
    }
}

/// A number with at most three decimals.
struct Short(f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", (self.0 * 1e3).round() / 1e3)
    }
}

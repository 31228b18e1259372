//! Many executions of one target.

use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use peak_alloc::PeakAlloc;

use crate::mutator::mutated;
use crate::target::{MAX_SECONDS, Target};

/// What an execution broke.
#[derive(Debug, Clone)]
pub struct Failure {
    /// Of the execution.
    pub number: u64,
    /// What was promised and what was found, in words.
    pub reason: String,
    /// The input.
    pub input: Vec<u8>,
}

/// What came of many executions.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Executions.
    pub count: u64,
    /// Of which the reader accepted the input.
    pub accepted: u64,
    /// Seconds of the slowest.
    pub slowest_secs: f64,
    /// Most bytes that one took.
    pub most_bytes: usize,
    /// What broke a promise.
    pub failures: Vec<Failure>,
}

/// Runs a target on the inputs of these numbers.
///
/// `allocator` is the program's, which nothing else uses meanwhile: it counts what is taken.
pub fn run(target: &Target, numbers: Range<u64>, allocator: &PeakAlloc) -> Outcome {
    let seeds = (target.seeds)();
    let mut outcome = Outcome::default();
    for number in numbers {
        let input = mutated(target, &seeds, number);
        let before = allocator.current_usage();
        allocator.reset_peak_usage();
        let start = Instant::now();
        let accepted = catch_unwind(AssertUnwindSafe(|| (target.run)(&input)));
        let seconds = start.elapsed().as_secs_f64();
        let taken = allocator.peak_usage().saturating_sub(before);
        outcome.count += 1;
        outcome.slowest_secs = outcome.slowest_secs.max(seconds);
        outcome.most_bytes = outcome.most_bytes.max(taken);
        let bound = target.max_extra_bytes + 20 * input.len();
        let reason = match accepted {
            Err(panic) => {
                let text = panic.downcast_ref::<String>().cloned();
                let text = text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()));
                Some(format!("a panic: {}", text.unwrap_or_default()))
            }
            Ok(_) if seconds > MAX_SECONDS => Some(format!("{seconds:.1} s, of at most {MAX_SECONDS}")),
            Ok(_) if taken > bound => Some(format!("{taken} bytes, of at most {bound}")),
            Ok(accepted) => {
                outcome.accepted += u64::from(accepted);
                None
            }
        };
        outcome.failures.extend(reason.map(|reason| Failure { number, reason, input }));
    }
    outcome
}

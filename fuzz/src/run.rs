//! Runs many executions of one target.

use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, MutexGuard, Once, PoisonError};
use std::time::Instant;

use peak_alloc::PeakAlloc;

use crate::mutator::mutated;
use crate::target::{MAX_BYTES_PER_INPUT_BYTE, MAX_SECONDS, Target};

/// An execution that panicked, or took too much time or memory.
#[derive(Debug, Clone)]
pub struct Failure {
    /// Number of the execution.
    pub number: u64,
    /// The panic, or the limit and the observed value.
    pub reason: String,
    /// The input.
    pub input: Vec<u8>,
}

/// The results of many executions.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// Number of executions.
    pub count: u64,
    /// Number of executions whose input the reader accepted.
    pub accepted: u64,
    /// Time of the slowest execution, in seconds.
    pub slowest_secs: f64,
    /// Most memory that an execution took, in bytes.
    pub most_bytes: usize,
    /// The executions that failed.
    pub failures: Vec<Failure>,
}

/// The result of one execution.
#[derive(Debug, Clone)]
pub struct Execution {
    /// Whether the reader accepted the input.
    pub accepted: bool,
    /// Time that it took, in seconds.
    pub seconds: f64,
    /// Most memory in use, beyond the memory in use before, in bytes.
    pub bytes: usize,
    /// The reason of a failure, if any: the panic, or the limit and the observed value.
    pub broken: Option<String>,
}

/// The first panic of any thread since the execution began, including caught panics.
static PANIC: Mutex<Option<String>> = Mutex::new(None);

fn panic_text() -> MutexGuard<'static, Option<String>> {
    PANIC.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Records panics instead of printing them.
fn note_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        std::panic::set_hook(Box::new(|panic| {
            panic_text().get_or_insert_with(|| panic.to_string().replace('\n', " "));
        }));
    });
}

/// Runs a target on one input.
///
/// `allocator` counts the memory of the whole process, which must do nothing else at the same time.
pub fn execute(target: &Target, input: &[u8], allocator: &PeakAlloc) -> Execution {
    note_panics();
    let before = allocator.current_usage();
    allocator.reset_peak_usage();
    let start = Instant::now();
    let accepted = catch_unwind(AssertUnwindSafe(|| (target.run)(input)));
    let seconds = start.elapsed().as_secs_f64();
    let bytes = allocator.peak_usage().saturating_sub(before);
    let bound = target.max_extra_bytes + MAX_BYTES_PER_INPUT_BYTE * input.len();
    let panic = panic_text().take();
    let broken = match panic {
        Some(panic) => Some(format!("a panic: {panic}")),
        None if seconds > MAX_SECONDS => Some(format!("expected at most {MAX_SECONDS} s, found {seconds:.1} s")),
        None if bytes > bound => Some(format!("expected at most {bound} bytes, found {bytes}")),
        None => None,
    };
    Execution { accepted: broken.is_none() && accepted.unwrap_or_default(), seconds, bytes, broken }
}

/// Runs a target on the inputs of these numbers, made from its seeds; `allocator` as in [`execute`].
pub fn run(target: &Target, seeds: &[Vec<u8>], numbers: Range<u64>, allocator: &PeakAlloc) -> Outcome {
    let mut outcome = Outcome::default();
    for number in numbers {
        let input = mutated(target, seeds, number);
        let Execution { accepted, seconds, bytes, broken } = execute(target, &input, allocator);
        outcome.count += 1;
        outcome.accepted += u64::from(accepted);
        outcome.slowest_secs = outcome.slowest_secs.max(seconds);
        outcome.most_bytes = outcome.most_bytes.max(bytes);
        outcome.failures.extend(broken.map(|reason| Failure { number, reason, input }));
    }
    outcome
}

//! Thread pools by number of threads.

use std::process;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::fault::{Fault, FaultKind, Result};

/// Idle pools: concurrent callers use one each.
static IDLE_POOLS: Mutex<Vec<ThreadPool>> = Mutex::new(Vec::new());
/// Id of the first process that detected or taught, which owns its threads; 0 before.
static COMPUTING_PID: AtomicU32 = AtomicU32::new(0);
/// Id of the first process that read a model, which owns one thread per core; 0 before.
static READING_PID: AtomicU32 = AtomicU32::new(0);
/// Maximum number of threads.
const MAX_THREADS: usize = 1024;

/// Runs work on this number of threads; `None` selects one thread per core, shared by all callers.
///
/// # Errors
/// The number is 0 or too large, the system refuses threads, or the process was forked from one with threads of this
/// library.
pub fn on_threads<T: Send>(threads: Option<usize>, work: impl FnOnce() -> T + Send) -> Result<T> {
    let Some(count) = threads else {
        check_thread_per_core()?;
        return Ok(work());
    };
    check_process()?;
    if !(1..=MAX_THREADS).contains(&count) {
        return Err(Fault::new(
            FaultKind::Argument,
            format!("expected threads from 1 to {MAX_THREADS}, found {count}"),
        ));
    }
    let at_rest = || IDLE_POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let pool = {
        let mut pools = at_rest();
        pools.iter().position(|pool| pool.current_num_threads() == count).map(|idx| pools.swap_remove(idx))
    };
    let pool = match pool {
        Some(pool) => pool,
        None => ThreadPoolBuilder::new()
            .num_threads(count)
            .build()
            .map_err(|error| Fault::new(FaultKind::Internal, format!("no threads for detection: {error}")))?,
    };
    let done = pool.install(work);
    at_rest().push(pool);
    Ok(done)
}

/// Rejects a forked process: it does not have the threads of its parent, and would wait for them forever.
///
/// # Errors
/// The process was forked from one that had detected or taught.
fn check_process() -> Result<()> {
    claim(&COMPUTING_PID)
}

/// Rejects a forked process before work on one thread per core, such as teaching: a reader of a model may own these
/// threads.
///
/// # Errors
/// The process was forked from one that had read a model, detected or taught.
pub(crate) fn check_thread_per_core() -> Result<()> {
    check_process()?;
    check_owner(READING_PID.load(Ordering::Relaxed))
}

/// Rejects a forked process before a model is read, which takes one thread per core.
///
/// # Errors
/// The process was forked from one that had read a model, detected or taught.
pub(crate) fn check_reader() -> Result<()> {
    check_owner(COMPUTING_PID.load(Ordering::Relaxed))?;
    claim(&READING_PID)
}

fn claim(owner: &AtomicU32) -> Result<()> {
    let own = process::id();
    check_owner(owner.compare_exchange(0, own, Ordering::Relaxed, Ordering::Relaxed).err().unwrap_or(own))
}

fn check_owner(owner: u32) -> Result<()> {
    match owner {
        other if other != 0 && other != process::id() => Err(Fault::new(
            FaultKind::Forked,
            "expected a new process (spawn), found a process that was forked after its parent had loaded a model, detected or taught: the threads \
             of the parent do not exist in it",
        )),
        _ => Ok(()),
    }
}

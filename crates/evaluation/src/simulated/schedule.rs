//! Runs units of work with dependencies on several workers.

use std::ops::ControlFlow;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use anyhow::Result;

/// A unit of work and the units that it depends on.
#[derive(Debug, Clone)]
pub struct Task<U> {
    pub unit: U,
    /// Indices of the tasks that this one waits for; all are smaller than its own, so that there are no cycles.
    pub after: Vec<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Status {
    Waiting,
    Running,
    Done,
}

struct State {
    status: Vec<Status>,
    stopped: bool,
    error: Option<anyhow::Error>,
}

/// Runs tasks on `workers` threads, always the first task that is ready. After `work` breaks, no further task begins;
/// the first error of `work` also ends the run and is returned.
///
/// Each thread has its own rayon pool of `threads_per_worker` threads, so that units divide the cores evenly.
///
/// # Errors
/// The first error of `work`; or the operating system provides no threads.
///
/// # Panics
/// If a task waits for a later one, or `work` panics.
pub fn run_all<U: Sync>(
    tasks: &[Task<U>],
    workers: usize,
    threads_per_worker: usize,
    work: &(dyn Fn(&U) -> Result<ControlFlow<()>> + Sync),
) -> Result<()> {
    /// As large as the stack of the main thread.
    const STACK_BYTES: usize = 8 << 20;
    for (i, task) in tasks.iter().enumerate() {
        assert!(task.after.iter().all(|&before| before < i), "task {i} waits for a later one");
    }
    let pools = (0..workers.max(1))
        .map(|_| rayon::ThreadPoolBuilder::new().num_threads(threads_per_worker).stack_size(STACK_BYTES).build())
        .collect::<Result<Vec<_>, _>>()?;
    let queue = Queue {
        state: Mutex::new(State { status: vec![Status::Waiting; tasks.len()], stopped: false, error: None }),
        changed: Condvar::new(),
    };
    std::thread::scope(|scope| {
        for pool in &pools {
            scope.spawn(|| {
                while let Some(i) = queue.take(tasks) {
                    let _stop_on_panic = StopOnPanic(&queue);
                    let outcome = pool.install(|| work(&tasks[i].unit));
                    queue.finish(i, outcome);
                }
            });
        }
    });
    let state = queue.state.into_inner().unwrap_or_else(PoisonError::into_inner);
    state.error.map_or(Ok(()), Err)
}

struct Queue {
    state: Mutex<State>,
    changed: Condvar,
}

impl Queue {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The first task that is ready; waits if no task is ready but a running one may make one ready. `None` after a
    /// stop, or if no task is left.
    fn take<U>(&self, tasks: &[Task<U>]) -> Option<usize> {
        let mut state = self.lock();
        loop {
            if state.stopped {
                return None;
            }
            let is_ready = |i: usize| {
                state.status[i] == Status::Waiting
                    && tasks[i].after.iter().all(|&before| state.status[before] == Status::Done)
            };
            if let Some(i) = (0..tasks.len()).find(|&i| is_ready(i)) {
                state.status[i] = Status::Running;
                return Some(i);
            }
            if !state.status.contains(&Status::Running) {
                return None;
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn finish(&self, i: usize, outcome: Result<ControlFlow<()>>) {
        let mut state = self.lock();
        state.status[i] = Status::Done;
        match outcome {
            Ok(ControlFlow::Continue(())) => {}
            Ok(ControlFlow::Break(())) => state.stopped = true,
            Err(error) => {
                state.stopped = true;
                state.error.get_or_insert(error);
            }
        }
        drop(state);
        self.changed.notify_all();
    }
}

/// Stops the queue if a worker panics. Otherwise, the other workers would wait for a task that never ends.
struct StopOnPanic<'a>(&'a Queue);

impl Drop for StopOnPanic<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.lock().stopped = true;
            self.0.changed.notify_all();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    fn task(unit: usize, after: &[usize]) -> Task<usize> {
        Task { unit, after: after.to_vec() }
    }

    /// The order in which units ended.
    fn order(tasks: &[Task<usize>], workers: usize) -> Vec<usize> {
        let done = Mutex::new(Vec::new());
        run_all(tasks, workers, 1, &|unit| {
            done.lock().unwrap().push(*unit);
            Ok(ControlFlow::Continue(()))
        })
        .unwrap();
        done.into_inner().unwrap()
    }

    #[test]
    fn one_worker_takes_them_in_their_order() {
        assert_eq!(order(&[task(0, &[]), task(1, &[]), task(2, &[0])], 1), [0, 1, 2]);
        assert_eq!(order(&[], 2), [0usize; 0]);
    }

    #[test]
    fn nothing_starts_before_what_it_waits_for() {
        let tasks = [task(0, &[]), task(1, &[0]), task(2, &[0]), task(3, &[1, 2]), task(4, &[3])];
        for workers in [1, 2, 4] {
            let order = order(&tasks, workers);
            let place = |unit| order.iter().position(|&u| u == unit).unwrap();
            assert_eq!(order.len(), tasks.len());
            for task in &tasks {
                assert!(task.after.iter().all(|&before| place(before) < place(task.unit)), "{order:?}");
            }
        }
    }

    #[test]
    fn two_workers_work_at_the_same_time() {
        let running = AtomicUsize::new(0);
        let most = AtomicUsize::new(0);
        run_all(&[task(0, &[]), task(1, &[])], 2, 1, &|_| {
            let now = running.fetch_add(1, Ordering::SeqCst) + 1;
            most.fetch_max(now, Ordering::SeqCst);
            let start = std::time::Instant::now();
            while most.load(Ordering::SeqCst) < 2 && start.elapsed().as_secs() < 10 {
                std::thread::yield_now();
            }
            running.fetch_sub(1, Ordering::SeqCst);
            Ok(ControlFlow::Continue(()))
        })
        .unwrap();
        assert_eq!(most.into_inner(), 2);
    }

    #[test]
    fn an_error_or_a_break_ends_the_run() {
        let done = AtomicUsize::new(0);
        let tasks = [task(0, &[]), task(1, &[0]), task(2, &[1])];
        let failed = run_all(&tasks, 2, 1, &|unit| {
            done.fetch_add(1, Ordering::SeqCst);
            if *unit == 1 { anyhow::bail!("broken") } else { Ok(ControlFlow::Continue(())) }
        });
        assert_eq!(failed.unwrap_err().to_string(), "broken");
        assert_eq!(done.swap(0, Ordering::SeqCst), 2);
        run_all(&tasks, 1, 1, &|_| {
            done.fetch_add(1, Ordering::SeqCst);
            Ok(ControlFlow::Break(()))
        })
        .unwrap();
        assert_eq!(done.into_inner(), 1);
    }

    #[test]
    fn each_worker_has_its_threads() {
        run_all(&[task(0, &[])], 1, 3, &|_| {
            assert_eq!(rayon::current_num_threads(), 3);
            Ok(ControlFlow::Continue(()))
        })
        .unwrap();
    }
}

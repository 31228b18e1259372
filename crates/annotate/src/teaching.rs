//! Teaching on a thread, and its progress.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use sdg_demonstration::ModelKind;
use serde::Serialize;

use crate::error::{Error, Result};
use crate::teacher::{GraspTeacher, TaughtModel, TaughtSummary, TeachRequest, TeachingMaterial, TeachingStep};

/// Maximum number of points of the loss curve on the page; a longer run keeps every second, fourth … point.
const MAX_POINTS: usize = 240;

/// State of a teaching run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// No teaching run was started yet.
    #[default]
    Idle,
    /// A teaching run is in progress.
    Running,
    /// A teaching run in progress was asked to end with its current result.
    Stopping,
    /// The teaching run has ended with a model.
    Done,
    /// The teaching run failed; there is no model.
    Failed,
}

/// State and progress of a teaching run, as the page shows it.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct News {
    /// State of the teaching run.
    pub status: Status,
    /// The model being taught.
    pub model: Option<ModelKind>,
    /// The network being trained.
    pub of: &'static str,
    /// Number of photos of the part that it learns from.
    pub photos: usize,
    /// Number of pictures without the part in this teaching.
    pub negatives: usize,
    /// Steps done.
    pub done: usize,
    /// Steps planned.
    pub planned: usize,
    /// Seconds since the start.
    pub elapsed_secs: f64,
    /// Estimated remaining seconds at the pace so far. `None` if unknown: before the second step, if another network
    /// follows, and after the last step, while the model is tested.
    pub left_secs: Option<f64>,
    /// `[step, loss]`, thinned.
    pub losses: Vec<(usize, f64)>,
    /// `[step, share found]`.
    pub validations: Vec<(usize, f64)>,
    /// Quality of the model, once it is taught.
    pub summary: Option<TaughtSummary>,
    /// File that the model was written to.
    pub written_to: Option<String>,
    /// Why it failed.
    pub error: Option<String>,
}

/// The pace of one network's training.
struct Pace {
    /// Every `stride`-th point of the loss curve is kept.
    stride: usize,
    /// Time at which the network's first step was reported, and the number of steps done then.
    since_secs: f64,
    since_done: usize,
}

impl Pace {
    fn left_secs(&self, elapsed_secs: f64, done: usize, planned: usize) -> Option<f64> {
        let steps = done.checked_sub(self.since_done).filter(|steps| *steps > 0 && done < planned)?;
        Some((elapsed_secs - self.since_secs) / steps as f64 * (planned - done) as f64)
    }
}

/// The teaching runs of a session; one at a time.
#[derive(Default)]
pub struct Teaching {
    /// The lock is held when `is_closed` is set or read.
    news: Mutex<News>,
    is_closed: AtomicBool,
    stop: AtomicBool,
    model: Mutex<Option<Arc<dyn TaughtModel>>>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Teaching {
    /// State of the teaching run.
    pub fn news(&self) -> News {
        locked(&self.news).clone()
    }

    /// The model in use: the one taught last, or the one of [`set_model`](Self::set_model).
    ///
    /// # Errors
    /// [`Error::NotTaught`].
    pub fn model(&self) -> Result<Arc<dyn TaughtModel>> {
        locked(&self.model).clone().ok_or(Error::NotTaught)
    }

    /// Asks a teaching run in progress to end with its current result.
    pub fn stop(&self) {
        let mut news = locked(&self.news);
        if news.status == Status::Running {
            news.status = Status::Stopping;
            self.stop.store(true, Ordering::SeqCst);
        }
    }

    fn record(&self, step: TeachingStep, start: Instant, pace: &mut Pace) -> ControlFlow<()> {
        let mut news = locked(&self.news);
        news.elapsed_secs = start.elapsed().as_secs_f64();
        match step {
            TeachingStep::Step { of, is_last, done, planned, loss } => {
                if news.of != of {
                    // Another network has another scale of the loss, and its own pace.
                    news.losses.clear();
                    *pace = Pace { stride: 1, since_secs: news.elapsed_secs, since_done: done };
                }
                (news.of, news.done, news.planned) = (of, done, planned);
                news.left_secs = pace.left_secs(news.elapsed_secs, done, planned).filter(|_| is_last);
                if done % pace.stride == 0 && loss.is_finite() {
                    news.losses.push((done, loss));
                }
                if news.losses.len() > MAX_POINTS {
                    pace.stride *= 2;
                    let stride = pace.stride;
                    news.losses.retain(|(step, _)| step % stride == 0);
                }
            }
            TeachingStep::Validated { done, hit_rate } => news.validations.push((done, hit_rate)),
        }
        if self.stop.load(Ordering::SeqCst) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
    /// Checks that no teaching run is in progress.
    ///
    /// # Errors
    /// [`Error::Busy`] while a teaching run is in progress.
    pub fn check_idle(&self) -> Result<()> {
        idle(&locked(&self.news))
    }

    /// Ends the use of this value: no teaching run starts any more.
    ///
    /// # Errors
    /// [`Error::Busy`] while a teaching run is in progress.
    pub fn close(&self) -> Result<()> {
        let news = locked(&self.news);
        idle(&news)?;
        self.is_closed.store(true, Ordering::SeqCst);
        Ok(())
    }

    /// Begins a teaching run whose pictures are still to be read: from now on it is in progress.
    ///
    /// # Errors
    /// [`Error::Busy`] while a teaching run is in progress, or after [`Self::close`].
    pub fn prepare(self: &Arc<Self>, model: ModelKind) -> Result<Preparation> {
        let mut news = locked(&self.news);
        idle(&news)?;
        if self.is_closed.load(Ordering::SeqCst) {
            return Err(Error::Busy("this project was closed: load the page again"));
        }
        self.stop.store(false, Ordering::SeqCst);
        let begun = News { status: Status::Running, model: Some(model), ..News::default() };
        let before = std::mem::replace(&mut *news, begun);
        Ok(Preparation { teaching: Arc::clone(self), before: Some(before) })
    }

    /// Sets the model that [`Self::model`] returns, such as one read from a file.
    pub fn set_model(&self, model: Arc<dyn TaughtModel>) {
        *locked(&self.model) = Some(model);
    }
}

/// A teaching run that is in progress and not yet on its thread. If this value is dropped without
/// [`start`](Self::start), the news are those before the run.
pub struct Preparation {
    teaching: Arc<Teaching>,
    /// The news before the run; `None` after its start.
    before: Option<News>,
}

impl Drop for Preparation {
    fn drop(&mut self) {
        if let Some(before) = self.before.take() {
            *locked(&self.teaching.news) = before;
        }
    }
}

impl Preparation {
    /// Starts the teaching run on a thread; `keep` writes the model and returns its path. [`Teaching::news`] gives the
    /// progress.
    pub fn start(
        mut self,
        teacher: Arc<dyn GraspTeacher>,
        request: TeachRequest,
        material: TeachingMaterial,
        keep: impl FnOnce(&dyn TaughtModel) -> Result<PathBuf> + Send + 'static,
    ) -> News {
        self.before = None;
        let teaching = Arc::clone(&self.teaching);
        let begun = {
            let mut news = locked(&teaching.news);
            (news.photos, news.negatives) = (material.demonstrations.len(), material.negatives.len());
            news.clone()
        };
        std::thread::spawn(move || {
            let start = Instant::now();
            let mut pace = Pace { stride: 1, since_secs: 0.0, since_done: 0 };
            let mut observe = |step| teaching.record(step, start, &mut pace);
            let taught = catch_unwind(AssertUnwindSafe(|| teacher.teach(&material, &request, &mut observe)));
            // Reported as an error, because a page that waits for the result would otherwise wait for ever.
            let taught = taught.unwrap_or_else(|_| Err("teaching failed internally; the terminal says more".into()));
            let outcome = taught.map_err(Error::Teacher).and_then(|model| {
                let written_to = keep(&*model)?;
                let summary = model.summary();
                teaching.set_model(Arc::from(model));
                Ok((summary, written_to))
            });
            let mut news = locked(&teaching.news);
            news.elapsed_secs = start.elapsed().as_secs_f64();
            match outcome {
                Ok((summary, written_to)) => {
                    news.status = Status::Done;
                    news.summary = Some(summary);
                    news.written_to = Some(written_to.display().to_string());
                }
                Err(error) => {
                    news.status = Status::Failed;
                    news.error = Some(error.to_string());
                }
            }
        });
        begun
    }
}

fn idle(news: &News) -> Result<()> {
    match news.status {
        Status::Running | Status::Stopping => Err(Error::Busy("a teaching is going on; stop it first, or wait")),
        Status::Idle | Status::Done | Status::Failed => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_time_is_said_to_be_left_that_is_not_known() {
        let teaching = Teaching::default();
        let start = Instant::now();
        let mut pace = Pace { stride: 1, since_secs: 0.0, since_done: 0 };
        let mut left_after = |of, is_last, done| {
            let step = TeachingStep::Step { of, is_last, done, planned: 3, loss: 1.0 };
            assert!(teaching.record(step, start, &mut pace).is_continue());
            teaching.news().left_secs
        };
        // Another network follows with an unknown pace, so the total time is unknown.
        assert_eq!([1, 2, 3].map(|done| left_after("its turns", false, done)), [None; 3]);
        // One step does not give a pace, and after the last one the model is tested.
        assert_eq!(left_after("the network", true, 1), None);
        assert!(left_after("the network", true, 2).is_some());
        assert_eq!(left_after("the network", true, 3), None);
    }

    #[test]
    fn a_teaching_is_in_progress_while_it_is_prepared() {
        let teaching = Arc::new(Teaching::default());
        let preparation = teaching.prepare(ModelKind::S).unwrap();
        assert!(teaching.check_idle().is_err() && teaching.close().is_err());
        assert!(teaching.prepare(ModelKind::S).is_err());
        drop(preparation);
        assert_eq!(teaching.news(), News::default());
        teaching.close().unwrap();
        assert!(teaching.prepare(ModelKind::S).is_err(), "the project is closed");
    }

    #[test]
    fn the_pace_is_that_of_the_network_itself() {
        let pace = Pace { stride: 1, since_secs: 20.0, since_done: 1 };
        assert_eq!(pace.left_secs(24.0, 3, 13), Some(20.0));
    }
}

//! Teaching on a thread, and its progress.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use sdg_demonstration::{Demonstration, ModelKind};
use sdg_report::write_atomically;
use serde::Serialize;

use crate::error::{Error, Result};
use crate::teacher::{GraspTeacher, TaughtModel, TaughtSummary, TeachRequest, TeachingStep};

/// Points of the loss curve that the page gets; a longer run keeps every second, fourth … of its own.
const MAX_POINTS: usize = 240;

/// State of a teaching.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// No teaching was started yet.
    #[default]
    Idle,
    /// Not ended yet.
    Running,
    /// It was asked to end with what there is.
    Stopping,
    /// It has ended with a model.
    Done,
    /// It failed; there is no model.
    Failed,
}

/// State and progress of a teaching, as the page shows it.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct News {
    /// State of the teaching.
    pub status: Status,
    /// The model being taught.
    pub model: Option<ModelKind>,
    /// What is being taught just now.
    pub of: &'static str,
    /// Steps done.
    pub done: usize,
    /// Steps planned.
    pub planned: usize,
    /// Seconds since the start.
    pub elapsed_secs: f64,
    /// Seconds that are left, by the pace so far; `None` before the first step.
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

/// The one teaching that may go on.
#[derive(Default)]
pub struct Teaching {
    news: Mutex<News>,
    stop: AtomicBool,
    model: Mutex<Option<Arc<dyn TaughtModel>>>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Teaching {
    /// State of the teaching.
    pub fn news(&self) -> News {
        locked(&self.news).clone()
    }

    /// The model taught last.
    ///
    /// # Errors
    /// [`Error::NotTaught`].
    pub fn model(&self) -> Result<Arc<dyn TaughtModel>> {
        locked(&self.model).clone().ok_or(Error::NotTaught)
    }

    /// Asks a running teaching to end with what there is.
    pub fn stop(&self) {
        let mut news = locked(&self.news);
        if news.status == Status::Running {
            news.status = Status::Stopping;
            self.stop.store(true, Ordering::SeqCst);
        }
    }

    fn record(&self, step: TeachingStep, start: Instant, stride: &mut usize) -> ControlFlow<()> {
        let mut news = locked(&self.news);
        news.elapsed_secs = start.elapsed().as_secs_f64();
        match step {
            TeachingStep::Step { of, done, planned, loss } => {
                if news.of != of {
                    // Another network: its loss is on another scale.
                    news.losses.clear();
                    *stride = 1;
                }
                (news.of, news.done, news.planned) = (of, done, planned);
                let pace = news.elapsed_secs / done.max(1) as f64;
                news.left_secs = Some(pace * planned.saturating_sub(done) as f64);
                if done % *stride == 0 && loss.is_finite() {
                    news.losses.push((done, loss));
                }
                if news.losses.len() > MAX_POINTS {
                    *stride *= 2;
                    let stride = *stride;
                    news.losses.retain(|(step, _)| step % stride == 0);
                }
            }
            TeachingStep::Validated { done, hit_rate } => news.validations.push((done, hit_rate)),
        }
        if self.stop.load(Ordering::SeqCst) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
    /// # Errors
    /// [`Error::Busy`] while a teaching goes on.
    pub fn check_idle(&self) -> Result<()> {
        idle(&locked(&self.news))
    }

    /// Starts to teach on a thread; the model is written to `model_path`. The news tell how it goes.
    ///
    /// # Errors
    /// [`Error::Busy`] while a teaching goes on.
    pub fn start(
        self: &Arc<Self>,
        teacher: Arc<dyn GraspTeacher>,
        request: TeachRequest,
        demonstrations: Vec<Demonstration>,
        model_path: PathBuf,
    ) -> Result<News> {
        let mut news = locked(&self.news);
        idle(&news)?;
        *news = News { status: Status::Running, model: Some(request.model), ..News::default() };
        self.stop.store(false, Ordering::SeqCst);
        let begun = news.clone();
        drop(news);

        let teaching = Arc::clone(self);
        std::thread::spawn(move || {
            let start = Instant::now();
            let mut stride = 1;
            let mut observe = |step| teaching.record(step, start, &mut stride);
            let taught = catch_unwind(AssertUnwindSafe(|| teacher.teach(&demonstrations, &request, &mut observe)));
            // A page that waited for a teaching which broke off would wait for ever.
            let taught = taught.unwrap_or_else(|_| Err("teaching broke off inside; the terminal says more".into()));
            let outcome = taught.map_err(Error::Teacher).and_then(|model| teaching.keep(model, &model_path));
            let mut news = locked(&teaching.news);
            news.elapsed_secs = start.elapsed().as_secs_f64();
            match outcome {
                Ok(summary) => {
                    news.status = Status::Done;
                    news.summary = Some(summary);
                    news.written_to = Some(model_path.display().to_string());
                }
                Err(error) => {
                    news.status = Status::Failed;
                    news.error = Some(error.to_string());
                }
            }
        });
        Ok(begun)
    }

    /// Writes the model down and keeps it for the pictures to try.
    fn keep(&self, model: Box<dyn TaughtModel>, path: &Path) -> Result<TaughtSummary> {
        write_atomically(path, &model.to_bytes().map_err(Error::Teacher)?)?;
        let summary = model.summary();
        *locked(&self.model) = Some(Arc::from(model));
        Ok(summary)
    }
}

fn idle(news: &News) -> Result<()> {
    match news.status {
        Status::Running | Status::Stopping => Err(Error::Busy("a teaching is going on; stop it first, or wait")),
        Status::Idle | Status::Done | Status::Failed => Ok(()),
    }
}

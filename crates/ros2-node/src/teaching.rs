//! `~/teach`: teaching on a thread, while pictures are still searched.

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use sdg_inputs::one_line;
use sdg_ros2::messages::TeachRequest;
use tempfile::TempPath;

use crate::requests::given;

/// The inputs of a teaching run.
#[derive(Debug, Clone, PartialEq)]
pub struct TeachJob {
    /// The photo's path. `PHOTO:MARKS` names a file of marks that is not beside the photo.
    pub photo: String,
    /// The file of marks, if the request named or contained one.
    pub marks: Option<PathBuf>,
    /// The file to write.
    pub out: PathBuf,
    /// The grasp model, by letter or name.
    pub model: String,
    /// Seed of all random choices.
    pub seed: u64,
    /// Maximum time for training the network.
    pub time_budget: Option<Duration>,
    /// Height of the marks above the table, if the camera file is to be used.
    pub mark_height_mm: Option<f64>,
    /// Whether the node then uses the model for detection.
    pub is_used: bool,
}

/// Teaches as the command `teach` of the program that runs the node, and writes the model. An error also for a written
/// model that fails on its held-out samples.
pub type Teach = dyn Fn(&TeachJob) -> Result<()> + Send + Sync;

impl TeachJob {
    /// Default model of a request.
    pub const DEFAULT_MODEL: &str = "C";
    /// Default seed of a request.
    pub const DEFAULT_SEED: u64 = 1;

    /// The job of a request, and the file with the marks that the request contained.
    fn read(request: &TeachRequest) -> Result<(Self, Option<TempPath>)> {
        if request.photo_path.is_empty() || request.out_path.is_empty() {
            bail!("expected photo_path and out_path, found \"{}\" and \"{}\"", request.photo_path, request.out_path);
        }
        if !request.annotation.is_empty() && !request.annotation_path.is_empty() {
            bail!("expected annotation or annotation_path, found both");
        }
        let brought = match request.annotation.as_str() {
            "" => None,
            text => {
                // The file is new and has an unpredictable name, because others may be able to write to the folder.
                let mut file = tempfile::Builder::new().prefix("sdg-marks-").suffix(".json").tempfile()?;
                file.write_all(text.as_bytes()).with_context(|| file.path().display().to_string())?;
                Some(file.into_temp_path())
            }
        };
        let named = || (!request.annotation_path.is_empty()).then(|| PathBuf::from(&request.annotation_path));
        let (model, budget_secs) = (request.model.as_str(), given("time_budget_secs", request.time_budget_secs)?);
        let job = Self {
            photo: request.photo_path.clone(),
            marks: brought.as_ref().map(|file| file.to_path_buf()).or_else(named),
            out: PathBuf::from(&request.out_path),
            model: if model.is_empty() { Self::DEFAULT_MODEL } else { model }.to_owned(),
            seed: if request.seed == 0 { Self::DEFAULT_SEED } else { request.seed },
            time_budget: budget_secs.map(Duration::try_from_secs_f64).transpose().context("time_budget_secs")?,
            mark_height_mm: given("mark_height_mm", request.mark_height_mm)?,
            is_used: request.use_it,
        };
        Ok((job, brought))
    }

    /// Checks that the node can use the taught model. A job without a height teaches a model without lengths, and would
    /// replace the file of the node's model if it has the same path.
    fn check_usable(&self, needs_lengths: bool) -> Result<()> {
        if self.is_used && needs_lengths && self.mark_height_mm.is_none() {
            bail!("expected mark_height_mm, because this node uses only models with lengths, found none");
        }
        Ok(())
    }
}

/// A running teaching.
pub(super) struct Teaching {
    thread: Option<JoinHandle<Result<(), String>>>,
    out: PathBuf,
    started: Instant,
    pub(super) is_used: bool,
    /// The file with the marks of the request; it is removed when dropped.
    _marks: Option<TempPath>,
}

impl Teaching {
    /// Begins teaching for a request.
    ///
    /// # Errors
    /// An invalid request, marks that cannot be written to a temporary file, and the errors of [`Self::begin`].
    pub(super) fn of_request(request: &TeachRequest, teach: &Arc<Teach>, needs_lengths: bool) -> Result<Self> {
        let (job, marks) = TeachJob::read(request)?;
        Ok(Self { _marks: marks, ..Self::begin(job, teach, needs_lengths)? })
    }

    /// Begins teaching; `needs_lengths` is whether the node uses only models with lengths.
    ///
    /// # Errors
    /// The node could not use the model.
    pub(super) fn begin(job: TeachJob, teach: &Arc<Teach>, needs_lengths: bool) -> Result<Self> {
        job.check_usable(needs_lengths)?;
        let (out, is_used, teach) = (job.out.clone(), job.is_used, Arc::clone(teach));
        let thread = std::thread::spawn(move || teach(&job).map_err(|error| one_line(&error)));
        Ok(Self { thread: Some(thread), out, started: Instant::now(), is_used, _marks: None })
    }

    /// The model file and the duration in seconds, or the reason why there is no usable model; `None` while teaching is
    /// in progress.
    pub(super) fn finished(&mut self) -> Option<Result<(PathBuf, f64), String>> {
        if !self.thread.as_ref().is_some_and(JoinHandle::is_finished) {
            return None;
        }
        let taught = self.thread.take()?.join().unwrap_or_else(|_| Err("teaching panicked".to_owned()));
        Some(taught.map(|()| (self.out.clone(), self.started.elapsed().as_secs_f64())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_becomes_a_job_with_defaults_and_a_temporary_file_of_marks() {
        let request = TeachRequest {
            photo_path: "part.png".to_owned(),
            out_path: "part.sdg".to_owned(),
            annotation: "{}".to_owned(),
            ..TeachRequest::default()
        };
        let (job, brought) = TeachJob::read(&request).unwrap();
        let marks = job.marks.unwrap();
        assert_eq!((job.model.as_str(), job.seed, job.time_budget, job.mark_height_mm), ("C", 1, None, None));
        assert_eq!(std::fs::read_to_string(&marks).unwrap(), "{}");
        drop(brought);
        assert!(!marks.exists());
        assert!(TeachJob::read(&TeachRequest { out_path: String::new(), ..request }).is_err());
    }

    #[test]
    fn a_request_with_invalid_numbers_or_two_annotations_is_refused() {
        let request = || TeachRequest {
            photo_path: "part.png".to_owned(),
            out_path: "part.sdg".to_owned(),
            annotation: "{}".to_owned(),
            ..TeachRequest::default()
        };
        for (refused, expected) in [
            (TeachRequest { mark_height_mm: -5.0, ..request() }, "mark_height_mm: expected a number above 0"),
            (TeachRequest { time_budget_secs: -1.0, ..request() }, "time_budget_secs: expected a number above 0"),
            (TeachRequest { annotation_path: "part.json".to_owned(), ..request() }, "found both"),
        ] {
            let error = TeachJob::read(&refused).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }

    #[test]
    fn a_model_without_lengths_is_not_taught_for_a_node_that_needs_them() {
        let check = |use_it: bool, mark_height_mm: f64, needs_lengths: bool| {
            let (photo_path, out_path) = ("part.png".to_owned(), "part.sdg".to_owned());
            let request = TeachRequest { photo_path, out_path, use_it, mark_height_mm, ..TeachRequest::default() };
            TeachJob::read(&request).unwrap().0.check_usable(needs_lengths)
        };
        let error = check(true, 0.0, true).unwrap_err().to_string();
        assert!(error.contains("mark_height_mm"), "{error}");
        assert!(check(true, 16.0, true).is_ok() && check(false, 0.0, true).is_ok() && check(true, 0.0, false).is_ok());
    }
}

//! The module `sdg._native`.

use std::ffi::OsString;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Duration;

use pyo3::prelude::*;
use pyo3::types::PyByteArray;
use sdg_bindings::{AcceptedNegative, CameraTeaching, RegionChoice, RotationalSymmetry, Teaching, View};
use sdg_grasp::{SearchRegion, TeachOptions};

use crate::array::picture;
use crate::errors::exception;

/// Teaching and detection, with the GIL released.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::{Camera, Model, Tracker, evaluate, read_picture, run_command, teach};

    #[pymodule_init]
    fn init(module: &super::Bound<'_, super::PyModule>) -> super::PyResult<()> {
        use super::PyModuleMethods;
        sdg_grasp::keep_freed_memory();
        module.add("VERSION", env!("CARGO_PKG_VERSION"))
    }
}

/// Runs work with the GIL released.
fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> sdg_bindings::Result<T> + Send) -> PyResult<T> {
    py.detach(work).map_err(|fault| exception(py, fault))
}

/// A calibrated camera and its pose.
#[pyclass(frozen)]
struct Camera(sdg_bindings::Camera);

#[pymethods]
impl Camera {
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        detached(py, || sdg_bindings::Camera::read(&path)).map(Self)
    }

    #[staticmethod]
    fn from_yaml(py: Python<'_>, text: &str) -> PyResult<Self> {
        detached(py, || sdg_bindings::Camera::from_yaml(text)).map(Self)
    }

    #[getter]
    fn size_px(&self) -> (u32, u32) {
        self.0.size_px().into()
    }

    #[getter]
    fn frame(&self) -> Option<&'static str> {
        self.0.frame()
    }
}

/// A region checked by the Python code: four numbers, or True for the whole picture.
#[derive(FromPyObject)]
enum Region {
    Part((u32, u32, u32, u32)),
    All(bool),
}

fn view(camera: Option<&Camera>, region: Option<Region>, threads: Option<usize>) -> View {
    let region = match region {
        None | Some(Region::All(false)) => RegionChoice::OfModel,
        Some(Region::All(true)) => RegionChoice::All,
        Some(Region::Part((x, y, width, height))) => RegionChoice::Part([x, y, width, height]),
    };
    View { camera: camera.map(|camera| camera.0.clone()), region, threads }
}

/// A grasp model.
#[pyclass(frozen)]
struct Model(sdg_bindings::Model);

#[pymethods]
impl Model {
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        detached(py, || sdg_bindings::Model::read(&path)).map(Self)
    }

    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        detached(py, || self.0.write(&path))
    }

    #[getter]
    fn kind(&self) -> String {
        self.0.grasp_model().kind().letter().to_string()
    }

    #[getter]
    fn object(&self) -> String {
        self.0.grasp_model().object().to_owned()
    }

    #[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
    #[pyo3(signature = (array, channels, camera, region, threads, min_score))]
    fn detect(
        &self,
        py: Python<'_>,
        array: &Bound<'_, PyAny>,
        channels: &str,
        camera: Option<&Camera>,
        region: Option<Region>,
        threads: Option<usize>,
        min_score: f64,
    ) -> PyResult<String> {
        let picture = picture(array, channels)?;
        let view = view(camera, region, threads);
        detached(py, || Ok(self.0.detect(&picture, &view, min_score)?.to_json()))
    }
}

/// Parts tracked from frame to frame.
#[pyclass(frozen)]
struct Tracker(Mutex<sdg_bindings::Tracker>);

#[pymethods]
impl Tracker {
    #[new]
    #[pyo3(signature = (model, camera, region, threads, search_frames))]
    fn new(
        py: Python<'_>,
        model: &Model,
        camera: Option<&Camera>,
        region: Option<Region>,
        threads: Option<usize>,
        search_frames: Option<u32>,
    ) -> PyResult<Self> {
        let view = view(camera, region, threads);
        let tracker = detached(py, || sdg_bindings::Tracker::new(&model.0, &view, search_frames))?;
        Ok(Self(Mutex::new(tracker)))
    }

    fn frame(&self, py: Python<'_>, array: &Bound<'_, PyAny>, channels: &str, captured_s: f64) -> PyResult<String> {
        let picture = picture(array, channels)?;
        detached(py, || self.tracker().frame(picture, captured_s))
    }

    /// Waits for a running search.
    fn close(&self, py: Python<'_>) {
        py.detach(|| self.tracker().close());
    }
}

impl Tracker {
    fn tracker(&self) -> std::sync::MutexGuard<'_, sdg_bindings::Tracker> {
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

/// Teaches like `sdg teach`; lengths in metres; symmetry 0 means full. With the model, returns a text for each negative
/// in which it still accepts something.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
fn teach(
    py: Python<'_>,
    demonstrations: Vec<(PathBuf, PathBuf)>,
    model: &str,
    preset: &str,
    seed: u64,
    steps: Option<usize>,
    time_budget_s: Option<f64>,
    symmetry: u32,
    size_tolerance: (f64, f64),
    region: Option<(u32, u32, u32, u32)>,
    camera: Option<(PathBuf, f64, f64)>,
    negatives: Vec<PathBuf>,
) -> PyResult<(Model, Vec<String>)> {
    let mut options = TeachOptions::new(seed);
    let refused = |error: sdg_grasp::GraspError| exception(py, error.into());
    options.kind = model.parse().map_err(|error| refused(sdg_grasp::GraspError::UnknownModel(error)))?;
    options.preset = preset.parse().map_err(refused)?;
    options.steps = steps;
    options.time_budget = time_budget_s.map(Duration::from_secs_f64);
    options.symmetry = match symmetry {
        0 => RotationalSymmetry::Full,
        1 => RotationalSymmetry::None,
        count => RotationalSymmetry::Fold(count),
    };
    options.size_tolerance = size_tolerance.0..=size_tolerance.1;
    options.region = region.map(|(x, y, width, height)| SearchRegion::new([x, y, width, height]));
    let camera =
        camera.map(|(file, mark_height_m, grasp_height_m)| CameraTeaching { file, mark_height_m, grasp_height_m });
    let from = Teaching { demonstrations, negatives, camera };
    let mut signal = None;
    let taught = py.detach(|| {
        sdg_bindings::teach(&from, options, &mut |_| {
            // Ctrl-C is a Python exception, which no other code checks for during the
            // teaching.
            match Python::attach(|py| py.check_signals()) {
                Ok(()) => ControlFlow::Continue(()),
                Err(raised) => {
                    signal = Some(raised);
                    ControlFlow::Break(())
                }
            }
        })
    });
    if let Some(raised) = signal {
        return Err(raised);
    }
    let (model, accepted) = taught.map_err(|fault| exception(py, fault))?;
    let told = |negative: &AcceptedNegative| format!("negative {}: {negative}", from.negatives[negative.idx].display());
    Ok((Model(model), accepted.iter().map(told).collect()))
}

/// Figures of a model on labelled pictures, as JSON.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
fn evaluate(
    py: Python<'_>,
    model: &Model,
    folder: PathBuf,
    camera: Option<&Camera>,
    region: Option<Region>,
    threads: Option<usize>,
    label: Option<String>,
    min_score: f64,
    report: PathBuf,
) -> PyResult<String> {
    let view = view(camera, region, threads);
    detached(py, || sdg_bindings::evaluate(&model.0, &folder, &view, label.as_deref(), min_score, &report))
}

/// The height, width and bytes of a picture.
#[pyfunction]
fn read_picture<'py>(
    py: Python<'py>,
    path: PathBuf,
    camera: Option<&Camera>,
) -> PyResult<(u32, u32, Bound<'py, PyByteArray>)> {
    let camera = camera.map(|camera| camera.0.clone());
    let picture = detached(py, || sdg_bindings::read_picture(&path, camera.as_ref()))?;
    Ok((picture.height(), picture.width(), PyByteArray::new(py, picture.as_raw())))
}

/// Runs the command `sdg` with these arguments, its own name first; returns its exit code.
#[pyfunction]
fn run_command(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| sdg_cli::run(&sdg_cli::parse_args(arguments)))
}

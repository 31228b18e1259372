//! The folders of a comparison, and the files that a work needs; missing files are made.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::network::Network;
use crate::registry::{Side, WorkSpec};

/// The shipped demonstration for augmentation and teaching.
const DEMONSTRATION: &str = "datasets/demonstrations/pendulum";

/// The folders of a comparison.
#[derive(Debug, Clone)]
pub struct Paths {
    /// Output folder: `target/bench`.
    pub out: PathBuf,
    /// Folder of the Python workers: `benches/peers`.
    pub peers: PathBuf,
    demonstration: PathBuf,
}

/// The files of one side of one work.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Files {
    weights: Option<PathBuf>,
    onnx: Option<PathBuf>,
    demonstration: Option<PathBuf>,
    model: Option<PathBuf>,
}

impl Files {
    /// The files as arguments of a worker.
    pub fn arguments(&self) -> impl Iterator<Item = (&'static str, &Path)> {
        [
            ("--weights", &self.weights),
            ("--onnx", &self.onnx),
            ("--demonstration", &self.demonstration),
            ("--model", &self.model),
        ]
        .into_iter()
        .filter_map(|(flag, path)| Some((flag, path.as_deref()?)))
    }
}

impl Paths {
    /// The folders of a repository.
    pub fn new(root: &Path) -> Self {
        Self {
            out: root.join("target/bench"),
            peers: root.join("benches/peers"),
            demonstration: root.join(DEMONSTRATION),
        }
    }

    /// Creates the output folders.
    pub fn create(&self) -> Result<()> {
        ensure!(
            self.peers.join("worker.py").exists(),
            "{}: expected worker.py, found none; run from the repository or give --root",
            self.peers.display()
        );
        ["logs", "weights"].iter().try_for_each(|folder| {
            let path = self.out.join(folder);
            std::fs::create_dir_all(&path).with_context(|| path.display().to_string())
        })
    }

    /// The Python interpreter of the peers.
    pub fn python(&self) -> Result<PathBuf> {
        let python = self.out.join("venv/bin/python");
        ensure!(
            python.exists(),
            "{}: expected the peers' Python, found no file; `make bench` installs it",
            python.display()
        );
        Ok(python)
    }

    /// The grasp model that `teaching` writes.
    pub fn model(&self) -> PathBuf {
        self.out.join("pendulum.sdg")
    }

    /// The files that a side needs; missing files are made.
    pub fn files_for(&self, work: &WorkSpec, side: Side) -> Result<Files> {
        let mut files = Files::default();
        if let Some(network) = work.network {
            files.weights = Some(self.weights(network)?);
        }
        if matches!(side, Side::Peer(peer) if ["onnxruntime", "openvino"].contains(&peer.id)) {
            files.onnx = Some(self.onnx(&self.weights(Network::Faster)?)?);
            files.weights = None;
        }
        if work.network.is_none() {
            files.demonstration = Some(match side {
                Side::Ours => self.demonstration.clone(),
                Side::Peer(_) => self.demonstration.join("image.png"),
            });
        }
        if (work.long || work.needs_model) && matches!(side, Side::Ours) {
            files.model = Some(self.model());
        }
        Ok(files)
    }

    fn weights(&self, network: Network) -> Result<PathBuf> {
        let path = self.out.join("weights").join(format!("{}.safetensors", network.name()));
        if !path.exists() {
            // In a separate process, so that its memory does not count for another process.
            let mut command = Command::new(std::env::current_exe()?);
            run(command.args(["weights", network.name()]).arg(&path))?;
        }
        Ok(path)
    }

    fn onnx(&self, weights: &Path) -> Result<PathBuf> {
        let path = self.out.join("weights/backbone.onnx");
        if !path.exists() {
            let unfinished = path.with_extension("unfinished.onnx");
            let mut command = Command::new(self.python()?);
            run(command.arg(self.peers.join("export_onnx.py")).arg(weights).arg(&unfinished))?;
            std::fs::rename(&unfinished, &path).with_context(|| path.display().to_string())?;
        }
        Ok(path)
    }
}

fn run(command: &mut Command) -> Result<()> {
    let output = command.output().with_context(|| format!("{command:?}"))?;
    let text = String::from_utf8_lossy(&output.stderr);
    let last = text.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("it printed nothing");
    ensure!(output.status.success(), "{command:?} failed: {last}");
    Ok(())
}

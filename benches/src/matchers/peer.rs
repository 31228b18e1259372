//! Runs `peers/matchers.py`, one process per peer and photo.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, Result, bail};
use nalgebra::Point2;
use sdg_geometry::{Angle, GraspLine, PlanarGrasp, PlanarSimilarity, Polygon};
use sdg_grasp::{GraspDetection, TurnSource};
use serde::Deserialize;
use serde_json::json;

use super::sets::Case;

/// Names of the peers in `matchers.py` and in the table.
pub const PEERS: [(&str, &str); 3] = [
    ("corrmatch", "corrmatch 0.2.5"),
    ("matchtemplate", "OpenCV matchTemplate, every 5°, coarse to fine"),
    ("linemod", "OpenCV LINEMOD, every 5°"),
];

/// A running peer, and the transform from its results to grasps.
pub struct PeerProcess {
    kind: &'static str,
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    outline: Polygon,
    grasp: GraspLine,
    width_px: f64,
}

#[derive(Deserialize)]
struct Answer {
    seconds: f64,
    /// Centre of the outline's box, angle in degrees, score.
    found: Vec<[f64; 4]>,
}

impl PeerProcess {
    pub fn start(kind: &'static str, case: &Case, python: &Path, script: &Path, threads: u32) -> Result<Self> {
        let annotation = &case.demonstration.annotation;
        let outline = annotation.outline.clone().unwrap_or_else(|| Polygon::from_box(&annotation.bbox));
        let points: Vec<[f64; 2]> = outline.vertices.iter().map(|point| [point.x, point.y]).collect();
        let mut child = Command::new(python)
            .arg(script)
            .arg(kind)
            .arg("--photo")
            .arg(absolute(&case.photo)?)
            .args(["--outline", &json!(points).to_string(), "--threads", &threads.to_string()])
            .env("RAYON_NUM_THREADS", threads.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| python.display().to_string())?;
        let (Some(input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            bail!("{kind}: expected pipes to the process")
        };
        let grasp = *annotation.require_grasp()?;
        let width_px = annotation.jaw_width.unwrap_or_else(|| grasp.opening_across(&outline));
        let output = BufReader::new(output);
        let mut peer = Self { kind, child, input, output, outline, grasp, width_px };
        let ready = peer.line()?;
        if !ready.contains("\"ready\"") {
            bail!("{kind}: expected the message \"ready\", found {ready}");
        }
        Ok(peer)
    }

    fn line(&mut self) -> Result<String> {
        let mut line = String::new();
        if self.output.read_line(&mut line)? == 0 {
            bail!("{}: the process ended; standard error has the reason", self.kind);
        }
        Ok(line)
    }

    /// Returns the seconds, and the detections with the best first.
    pub fn find(&mut self, picture: &Path) -> Result<(f64, Vec<GraspDetection>)> {
        writeln!(self.input, "{}", json!({"image": absolute(picture)?}))?;
        let line = self.line()?;
        let Answer { seconds, found } =
            serde_json::from_str(&line).with_context(|| format!("{}: {line}", self.kind))?;
        Ok((seconds, found.into_iter().map(|found| self.detection(found)).collect()))
    }

    fn detection(&self, [x, y, degrees, score]: [f64; 4]) -> GraspDetection {
        let middle = self.outline.bounds().center();
        let pose = PlanarSimilarity::about(middle, Point2::new(x, y), Angle::from_degrees(degrees), 1.0);
        let outline = self.outline.transformed(&pose);
        GraspDetection {
            demonstration_idx: 0,
            score,
            network_score: 0.0,
            agreement: None,
            evidence: None,
            bbox: outline.bounds(),
            keypoints: Vec::new(),
            outline: Some(outline),
            grasp: PlanarGrasp::from_line(&self.grasp.transformed(&pose), self.width_px),
            turn_source: TurnSource::Search,
            light: 1.0,
        }
    }
}

fn absolute(path: &Path) -> Result<PathBuf> {
    path.canonicalize().with_context(|| path.display().to_string())
}

impl Drop for PeerProcess {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

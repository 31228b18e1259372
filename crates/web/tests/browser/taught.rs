//! Models and test pictures made by `sdg` itself.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;

use crate::{repository, target};

/// Number of training steps, enough to detect the pendulum; the test compares detections,
/// not their quality.
const STEPS: &str = "120";
/// Number of augmented pictures, in addition to the demonstration itself.
const SAMPLES: usize = 6;

/// A folder with files made by `sdg`.
pub struct Made {
    folder: TempDir,
}

impl Made {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A model of the pendulum, taught from its one photo.
    pub fn model(&self, letter: &str) -> PathBuf {
        let out = self.path(&format!("pendulum-{letter}.sdg"));
        let mut args = vec!["teach", "--model", letter, "--seed", "1"];
        if letter != "S" {
            args.extend(["--steps", STEPS]);
        }
        let demonstration = demonstration();
        let marks = demonstration.with_file_name("annotation.json");
        let demo = format!("{}:{}", demonstration.display(), marks.display());
        sdg(&[&args[..], &["--demo", &demo, "--out", out.to_str().unwrap()]].concat());
        out
    }

    /// The demonstration, augmented samples of it as PNG, and the demonstration as JPEG.
    pub fn pictures(&self) -> Vec<PathBuf> {
        let demonstration = demonstration();
        let marks = demonstration.with_file_name("annotation.json");
        let demo = format!("{}:{}", demonstration.display(), marks.display());
        let folder = self.path("samples");
        let count = SAMPLES.to_string();
        sdg(&["augment", "--demo", &demo, "--count", &count, "--seed", "5", "--out", folder.to_str().unwrap()]);
        let mut pictures = vec![demonstration.clone()];
        pictures.extend((0..SAMPLES).map(|i| folder.join(format!("{i:06}.png"))));
        let jpeg = self.path("photo.jpg");
        image::open(&demonstration).unwrap().to_rgb8().save(&jpeg).unwrap();
        pictures.push(jpeg);
        pictures
    }
}

pub fn demonstration() -> PathBuf {
    repository().join("datasets/demonstrations/pendulum/image.png")
}

/// The output of `sdg detect --json --all` for pictures, each with the best detection
/// first.
pub fn detect(model: &Path, pictures: &[PathBuf]) -> Vec<Vec<Value>> {
    let mut args = vec!["detect", "--json", "--all", "--grasp-model", model.to_str().unwrap()];
    args.extend(pictures.iter().map(|picture| picture.to_str().unwrap()));
    let lines = sdg(&args);
    lines.lines().map(|line| serde_json::from_str::<Value>(line).unwrap()["detections"].take()).map(array).collect()
}

pub fn array(value: Value) -> Vec<Value> {
    value.as_array().unwrap().clone()
}

/// Runs the program built beside this test.
fn sdg(args: &[&str]) -> String {
    let binary = target().join("release/sdg");
    assert!(binary.is_file(), "make build writes {}", binary.display());
    let output = Command::new(binary).args(args).output().unwrap();
    // Exit code 3 means nothing to grasp, which is also a valid answer.
    let answered = matches!(output.status.code(), Some(0 | 3));
    assert!(answered, "sdg {}: {}", args.join(" "), String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

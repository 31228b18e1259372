//! A full disk or a closed pipe at standard output or standard error.

use std::fs::{self, File};
use std::io::PipeWriter;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::slice::from_ref;

use crate::support::{Folder, shipped, taught_pendulum};
use crate::weights::{config, fixture};

fn run(arguments: &[&str], stdout: impl Into<Stdio>, stderr: impl Into<Stdio>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sdg")).args(arguments).stdout(stdout).stderr(stderr).output().unwrap()
}

fn full_disk() -> File {
    File::options().write(true).open("/dev/full").unwrap()
}

/// A pipe without a reader.
fn closed_pipe() -> PipeWriter {
    std::io::pipe().unwrap().1
}

/// The arguments of a plan, which prints lines and, with `--json`, an object.
fn plan() -> [&'static str; 7] {
    let workcell = concat!(env!("CARGO_MANIFEST_DIR"), "/../../datasets/workcell/workcell.toml");
    ["plan", "--workcell", workcell, "--goal", "500,-300,150", "--no-drawing", "--json"]
}

#[test]
fn results_do_not_depend_on_standard_error() {
    let folder = Folder::new();
    let (model, photo) = (folder.path("model.sdg"), shipped("pendulum", "image.png"));
    taught_pendulum(&model, None);
    let photo = photo.to_str().unwrap();
    // Two pictures end with a total on standard error.
    let detect = ["detect", "--grasp-model", &model, "--json", photo, photo];
    for (arguments, num_lines) in [(&detect[..], 2), (&plan()[..], 1)] {
        let written = run(arguments, Stdio::piped(), Stdio::piped());
        assert!(!written.stderr.is_empty(), "{arguments:?}");
        for stderr in [Stdio::from(full_disk()), Stdio::from(closed_pipe())] {
            let output = run(arguments, Stdio::piped(), stderr);
            assert_eq!(output.status.code(), Some(0), "{arguments:?}");
            assert_eq!(String::from_utf8(output.stdout).unwrap().lines().count(), num_lines, "{arguments:?}");
        }
    }
}

#[test]
fn a_closed_output_ends_no_work_and_a_full_one_is_an_error() {
    let folder = Folder::new();
    let [photo, marks] = ["image.png", "annotation.json"].map(|name| shipped("pendulum", name));
    let marks = marks.to_str().unwrap();
    let (model, converted) = (folder.path("model.sdg"), folder.path("marks.json"));
    let demo = format!("{}:{marks}", photo.display());
    let teach = ["teach", "--model", "S", "--demo", &demo, "--out", &model];
    let convert = ["annotation", "convert", marks, &converted, "--format", "labelme"];
    let (known, drawn, frames) = (folder.path("known.sdg"), folder.path("drawn"), folder.path("frames"));
    taught_pendulum(&known, None);
    let photo = photo.to_str().unwrap();
    let detect = ["detect", "--grasp-model", &known, photo, photo];
    let draw = [&detect[..], &["--draw", &drawn]].concat();
    let drawings = ["drawn/image.png", "drawn/image-2.png"].map(|name| folder.path(name));
    let from = format!("file:{photo}?loop");
    let grab = ["camera", "grab", "--from", &from, "--count", "2", "--out", &frames];
    let grabbed = ["frames/000000.png", "frames/000001.png"].map(|name| folder.path(name));
    let (checkpoint, weights) = (fixture("detectron2_keypoint.pkl"), folder.path("weights.safetensors"));
    let network = config(Path::new(&folder.path("")), 1);
    let convert_weights = ["weights", "convert", &checkpoint, &weights, "--config", network.to_str().unwrap()];
    for (arguments, written) in [
        (&teach[..], from_ref(&model)),
        (&plan()[..], &[][..]),
        (&convert[..], from_ref(&converted)),
        (&detect[..], &[][..]),
        (&draw[..], &drawings[..]),
        (&grab[..], &grabbed[..]),
        (&convert_weights[..], from_ref(&weights)),
    ] {
        let output = run(arguments, closed_pipe(), Stdio::piped());
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(0) && !stderr.contains("panicked"), "{arguments:?}: {stderr}");

        written.iter().for_each(|file| fs::remove_file(file).unwrap());
        let output = run(arguments, full_disk(), Stdio::piped());
        let stderr = String::from_utf8(output.stderr).unwrap();
        let error = stderr.lines().last().unwrap_or_default();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {stderr}");
        assert!(error.starts_with("sdg: standard output: No space left"), "{arguments:?}: {stderr}");
        assert!(written.iter().all(|file| Path::new(file).exists()), "{arguments:?}");
    }
}

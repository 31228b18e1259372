//! The commands of the guides, run one document after another in a folder with a photo, pictures, a model and the files
//! of a workcell.
//!
//! A block with requirements that not every computer meets states them in a comment above it (`<!-- needs: a camera
//! -->`) and is not run. A block that takes long (`<!-- takes: half a minute -->`) is run by `make test-guides`.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use super::blocks::{Marker, blocks};
use super::root;
use crate::support::{Folder, shipped, taught_pendulum};

/// The documents whose commands are run. Any other document with commands fails [`every_guide_with_commands_is_run`].
const GUIDES: &[&str] = &[
    "README.md",
    "docs/c.md",
    "docs/calibration.md",
    "docs/camera.md",
    "docs/devices.md",
    "docs/fci.md",
    "docs/install.md",
    "docs/live-pictures.md",
    "docs/own-part.md",
    "docs/planning.md",
    "docs/python.md",
    "docs/results.md",
    "docs/robot.md",
    "docs/ros2.md",
    "docs/slurm.md",
    "docs/tour.md",
    "docs/weights.md",
];

/// A folder with the contents that the guides assume: the shipped pendulum's photo, pictures and model, with the names
/// that the guides use.
fn folder_of_a_reader() -> Folder {
    let folder = Folder::new();
    let link = |to: &Path, name: &str| std::os::unix::fs::symlink(to, folder.path(name)).unwrap();
    for name in ["bin", "target", "target/release", "more-pictures", "pictures", "sets"] {
        fs::create_dir(folder.path(name)).unwrap();
    }
    let program = Path::new(env!("CARGO_BIN_EXE_sdg"));
    link(program, "bin/sdg");
    link(program, "target/release/sdg");
    // Copies, because a guide that writes into the repository would change it.
    let copied = |from: &Path, to: &str| {
        fs::create_dir_all(Path::new(&folder.path(to)).parent().unwrap()).unwrap();
        fs::copy(from, folder.path(to)).unwrap();
    };
    for part in ["pendulum", "pliers"] {
        for name in ["image.png", "annotation.json"] {
            copied(&shipped(part, name), &format!("datasets/demonstrations/{part}/{name}"));
        }
    }
    for (file, names) in
        [("camera.yaml", &["wrist.yaml", "webcam.yaml", "camera.yaml"][..]), ("workcell.toml", &["cell.toml"])]
    {
        let shipped_file = root().join("datasets/workcell").join(file);
        copied(&shipped_file, &format!("datasets/workcell/{file}"));
        names.iter().for_each(|name| copied(&shipped_file, name));
    }
    copied(&shipped("pendulum", "image.png"), "photo.png");
    copied(&shipped("pendulum", "annotation.json"), "photo.json");
    taught_pendulum(folder.path("part.sdg"), Some(&root().join("datasets/workcell/camera.yaml")));
    // The photo is a picture of the camera with which the model was taught, and shows the part on the table.
    for name in ["table.png", "more-pictures/1.png", "pictures/1.png"] {
        copied(&shipped("pendulum", "image.png"), name);
    }
    copied(&shipped("pendulum", "annotation.json"), "pictures/1.json");
    folder
}

/// Runs the commands of a guide; those that take long only with `all`. Returns the number of blocks that ran.
fn run(guide: &str, all: bool) -> usize {
    let document = fs::read_to_string(root().join(guide)).unwrap();
    let mut folder = None;
    let mut num_run = 0;
    for block in blocks(&document).into_iter().filter(|block| block.is_shell()) {
        match &block.marker {
            Some(Marker::Needs(_)) => continue,
            Some(Marker::Takes(_)) if !all => continue,
            _ => {}
        }
        let folder = folder.get_or_insert_with(folder_of_a_reader);
        let path = format!("{}:{}", folder.path("bin"), std::env::var("PATH").unwrap());
        let output = Command::new("bash")
            .args(["-euo", "pipefail", "-c", &block.script()])
            .current_dir(folder.path(""))
            .env("PATH", path)
            .env("HOME", folder.path(""))
            .output()
            .unwrap();
        num_run += 1;
        assert!(
            output.status.success(),
            "{guide}, line {}: {}\n{}{}{}",
            block.line,
            output.status,
            block.text,
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        );
    }
    num_run
}

#[test]
fn every_guide_with_commands_is_run() {
    let mut found: BTreeSet<String> = BTreeSet::new();
    let names =
        fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let guides = names.filter(|name| name.ends_with(".md")).map(|name| format!("docs/{name}"));
    for guide in guides.chain(["README.md".to_owned()]) {
        let document = fs::read_to_string(root().join(&guide)).unwrap();
        if blocks(&document).iter().any(|block| block.is_shell()) {
            found.insert(guide);
        }
    }
    let run: BTreeSet<String> = GUIDES.iter().map(|guide| (*guide).to_owned()).collect();
    assert_eq!(found, run, "guides with commands (left), guides that this file runs (right)");
}

#[test]
fn commands_of_the_guides_run() {
    let num_run: usize = GUIDES.iter().map(|guide| run(guide, false)).sum();
    assert!(num_run >= 10, "expected ten blocks that run or more, found {num_run}");
}

#[test]
#[ignore = "make test-guides: minutes"]
fn commands_of_the_guides_run_the_long_ones_too() {
    for guide in GUIDES {
        println!("{guide}: {} blocks", run(guide, true));
    }
}

//! The commands under test: their inputs, their arguments, and the checks of their outputs.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail, ensure};
use clap::ValueEnum;

use crate::boards;
use crate::page::Page;

/// A command that writes files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Scenario {
    /// `sdg teach --model S`.
    Teach,
    /// `sdg evaluate` of one part with model S.
    Evaluate,
    /// A session of the annotation page: marks, a picture, and teaching.
    Annotate,
    /// `sdg weights convert`.
    Convert,
    /// `sdg camera calibrate`.
    Calibrate,
    /// `sdg camera table`, which writes into the camera file.
    Table,
}

/// Paths and programs that the tests use.
#[derive(Debug, Clone)]
pub struct Places {
    /// The program `sdg`.
    pub sdg: PathBuf,
    /// The root of the repository.
    pub root: PathBuf,
    /// The folder for the tests' own files: target/endurance.
    pub work: PathBuf,
}

impl Places {
    /// A call of `sdg` in a folder.
    pub fn sdg(&self, folder: &Path, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.sdg);
        command.args(arguments).current_dir(folder).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // The page's list of projects is also a file.
        command.env("XDG_STATE_HOME", folder.join("state")).env("HOME", folder);
        command
    }

    /// Runs `sdg` and returns its standard output.
    ///
    /// # Errors
    /// The standard error of a call that fails.
    pub fn run(&self, folder: &Path, arguments: &[&str]) -> Result<Vec<u8>> {
        let output = self.sdg(folder, arguments).output()?;
        let error = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "sdg {}: {}: {error}", arguments.join(" "), output.status);
        Ok(output.stdout)
    }

    fn copy(&self, file: &str, folder: &Path, name: &str) -> Result<()> {
        let from = self.root.join(file);
        fs::copy(&from, folder.join(name)).with_context(|| from.display().to_string())?;
        Ok(())
    }
}

impl Scenario {
    /// Name in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Teach => "teach",
            Self::Evaluate => "evaluate",
            Self::Annotate => "annotate",
            Self::Convert => "weights convert",
            Self::Calibrate => "camera calibrate",
            Self::Table => "camera table",
        }
    }

    /// Arguments of `sdg`.
    pub fn arguments(self) -> &'static [&'static str] {
        match self {
            Self::Teach => &["teach", "--model", "S", "--demo", "photo.png", "--out", "part.sdg"],
            Self::Evaluate => &[
                "evaluate",
                "--models",
                "S",
                "--objects",
                "pendulum",
                "--attempts",
                "1",
                "--views",
                "1",
                "--scenes",
                "1",
                "--jobs",
                "2",
                "--out",
                "results",
            ],
            Self::Annotate => &["annotate", "photo.png", "--no-browser", "--json"],
            Self::Convert => {
                &["weights", "convert", "weights.safetensors", "converted.safetensors", "--config", "config.json"]
            }
            Self::Calibrate => &[
                "camera",
                "calibrate",
                "--out",
                "camera.yaml",
                "0.png",
                "1.png",
                "2.png",
                "3.png",
                "4.png",
                "5.png",
                "6.png",
                "7.png",
            ],
            Self::Table => &["camera", "table", "table.png", "--camera", "camera.yaml"],
        }
    }

    /// Writes the inputs. With `has_old`, Teach, Convert and Calibrate also get an older output, different from the new
    /// one.
    ///
    /// # Errors
    /// Files that cannot be made.
    pub fn prepare(self, places: &Places, folder: &Path, has_old: bool) -> Result<()> {
        let demonstration = |name: &str| format!("datasets/demonstrations/pendulum/{name}");
        let photo = || {
            places.copy(&demonstration("image.png"), folder, "photo.png")?;
            places.copy(&demonstration("annotation.json"), folder, "photo.json")
        };
        match self {
            Self::Teach => {
                photo()?;
                if has_old {
                    let old = self.once(places, "old.sdg", |folder| {
                        places.copy(&demonstration("image.png"), folder, "photo.png")?;
                        places.copy(&demonstration("annotation.json"), folder, "photo.json")?;
                        let arguments =
                            ["teach", "--model", "S", "--demo", "photo.png", "--out", "old.sdg", "--symmetry", "2"];
                        places.run(folder, &arguments)
                    })?;
                    fs::copy(old, folder.join("part.sdg"))?;
                }
            }
            // The command resumes, so an old result would be the new one.
            Self::Evaluate => {}
            Self::Annotate => {
                photo()?;
                fs::create_dir(folder.join("state"))?;
            }
            Self::Convert => {
                places.copy("tests/golden/detectron2/keypoint/weights.safetensors", folder, "weights.safetensors")?;
                places.copy("tests/golden/detectron2/keypoint/config.json", folder, "config.json")?;
                if has_old {
                    let output = [self.arguments(), &["--f16"]].concat();
                    places.run(folder, &output)?;
                }
            }
            Self::Calibrate => {
                let made = places.work.join("boards");
                boards::write_once(&made)?;
                for idx in 0..8 {
                    let name = format!("{idx}.png");
                    fs::copy(made.join(&name), folder.join(&name))?;
                }
                if has_old {
                    fs::copy(made.join("camera.yaml"), folder.join("camera.yaml"))?;
                }
            }
            Self::Table => {
                let made = places.work.join("boards");
                boards::write_once(&made)?;
                for name in ["table.png", "camera.yaml"] {
                    fs::copy(made.join(name), folder.join(name))?;
                }
            }
        }
        Ok(())
    }

    /// A file that is made once for all kills.
    fn once(self, places: &Places, name: &str, make: impl FnOnce(&Path) -> Result<Vec<u8>>) -> Result<PathBuf> {
        let folder = places.work.join("once");
        let file = folder.join(name);
        if !file.exists() {
            fs::create_dir_all(&folder)?;
            make(&folder)?;
        }
        Ok(file)
    }

    /// Name of the output file, which must be the new one after the command has succeeded.
    pub fn output(self) -> Option<&'static str> {
        match self {
            Self::Teach => Some("part.sdg"),
            Self::Evaluate => Some("results/tables.json"),
            Self::Annotate => None,
            Self::Convert => Some("converted.safetensors"),
            Self::Calibrate | Self::Table => Some("camera.yaml"),
        }
    }

    /// Checks that a file left by a command can be read as a file of its kind.
    ///
    /// # Errors
    /// A damaged file.
    pub fn check_whole(places: &Places, file: &Path) -> Result<()> {
        let folder = places.work.join("reading");
        fs::create_dir_all(&folder)?;
        let name = file.to_str().context("expected a path in UTF-8")?;
        let photo = places.root.join("datasets/demonstrations/pendulum/image.png");
        let photo = photo.to_str().context("expected a path in UTF-8")?;
        match file.extension().and_then(|extension| extension.to_str()) {
            Some("json") => {
                drop(serde_json::from_slice::<serde_json::Value>(&fs::read(file)?).context("expected JSON")?)
            }
            Some("sdg") => {
                let found = places.run(&folder, &["detect", "--grasp-model", name, photo, "--json"])?;
                ensure!(!found.is_empty(), "expected detections");
            }
            Some("safetensors") => drop(places.run(&folder, &["weights", "inspect", name, "--json"])?),
            Some("yaml") => {
                let table = places.work.join("boards/table.png");
                let table = table.to_str().context("expected a path in UTF-8")?;
                places.run(&folder, &["camera", "table", table, "--camera", name, "--out", "read.yaml"])?;
            }
            Some("png") => drop(image::open(file)?),
            Some("md" | "html") => {
                let text = String::from_utf8(fs::read(file)?)?;
                ensure!(!text.is_empty() && !text.contains('\0'), "expected text");
            }
            other => bail!("expected a file of a known kind, found {other:?}"),
        }
        Ok(())
    }

    /// One in this many kills is followed by a second run of the command; teaching takes seconds.
    pub fn again_every(self) -> u64 {
        if self == Self::Teach { 4 } else { 1 }
    }

    /// Does what a user does after the power cut: runs the same command again, which must succeed.
    ///
    /// # Errors
    /// A command that fails; a page without the marks; tables that differ from those in `reference`, the folder of the
    /// run without a power cut.
    pub fn again(self, places: &Places, folder: &Path, reference: &Path) -> Result<()> {
        if self == Self::Annotate {
            let mut server = places.sdg(folder, self.arguments()).spawn()?;
            let page = Page::of(server.stdout.take().context("expected a pipe")?);
            let session = page.and_then(|page| page.json("GET", "/api/session", b""));
            server.kill()?;
            server.wait()?;
            let session = session?;
            let marks = &session["images"][0]["marks"];
            ensure!(marks["grasp"].is_object(), "the page has lost the marks: {session}");
            return Ok(());
        }
        places.run(folder, self.arguments())?;
        if self == Self::Evaluate {
            let [found, expected] = [folder, reference].map(|folder| timeless(places, &folder.join("results")));
            ensure!(found? == expected?, "the tables differ from those of a run without a power cut");
        }
        Ok(())
    }
}

/// The tables of an evaluation without the values that differ from run to run.
fn timeless(places: &Places, results: &Path) -> Result<Vec<u8>> {
    let output = Command::new("python3").arg(places.root.join("scripts/timeless-tables.py")).arg(results).output()?;
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Ok(output.stdout)
}

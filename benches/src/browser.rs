//! `sdg-bench browser`: the page's detection compared with onnxruntime-web, in one page of a headless Chromium.
//!
//! Both sides run the network of one taught model on one picture, alternately and each on one thread. Our side runs as
//! on the page, from the picture file to grasps. onnxruntime-web runs the export from PyTorch (`peers/export_edge.py`),
//! from the normalised input to keypoints. Times are reported only if both sides find the same box and scores.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use clap::Args as ClapArgs;
use sdg_detection::ImageTransform;
use sdg_geometry::median;
use sdg_webdriver::{Browser, BrowserOptions, serve_folder};
use serde_json::{Value, json};

use crate::compare::machine::Machine;
use crate::network::Network;
use crate::results::{duration, rewrite};

const PICTURE: &str = "datasets/demonstrations/pendulum/image.png";
/// Files of our download, without weights.
const OUR_MODULE: [&str; 2] = ["sdg_web_bg.wasm", "sdg_web.js"];
/// Files of onnxruntime-web's download, without weights.
const THEIR_MODULE: [&str; 3] = ["ort-wasm-simd-threaded.wasm", "ort-wasm-simd-threaded.mjs", "ort.wasm.min.mjs"];
/// Maximum difference between the two sides' scores, whose sums have different orders.
const MAX_SCORE: f64 = 0.01;
/// Maximum difference between the two sides' boxes, in pixels of the picture.
const MAX_PX: f64 = 0.5;
/// The promised minimum number of frames per second without WebGPU.
const MIN_FRAMES: f64 = 5.0;

/// `sdg-bench browser`
#[derive(Debug, ClapArgs)]
pub struct BrowserArgs {
    /// Grasp model C of the preset `edge`; `make bench` writes one to target/bench/pendulum.sdg
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Timed runs of each side
    #[arg(long, default_value_t = 30, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: u32,
    /// Root of the repository
    #[arg(long, default_value = ".", value_name = "DIR")]
    root: PathBuf,
    /// Rewrite the table in this file
    #[arg(long, value_name = "FILE")]
    results: Option<PathBuf>,
}

/// Copies the files, runs the page and prints the table; fails if the sides differ or our frame rate is too low.
pub fn run(args: &BrowserArgs) -> Result<()> {
    let folder = args.root.join("target/bench/browser");
    let model = args.model.clone().unwrap_or_else(|| args.root.join("target/bench/pendulum.sdg"));
    ensure!(
        model.is_file(),
        "{}: expected a grasp model, which the work `teaching` of `make bench` writes",
        model.display()
    );
    lay_out(&args.root, &folder, &model)?;

    let site = serve_folder(folder.clone())?;
    let browser = Browser::start(&BrowserOptions::default())?;
    browser.open(&site.url("compare.html"))?;
    browser.wait_for("the page's script", "return window.ready === true")?;
    let script = "return window.compare(...arguments)";
    let measured = browser.run(script, &[json!(args.rounds), json!(3)])?;
    let errors = browser.console_errors()?;
    ensure!(errors.is_empty(), "expected no errors in the page's console, found {errors:?}");
    check_same(&measured)?;

    let table = markdown(&measured, &folder)?;
    println!("{table}");
    if let Some(results) = &args.results {
        rewrite(results, "browser", &table)?;
    }
    let frames = 1e3 / times(&measured, "verified")?;
    ensure!(frames >= MIN_FRAMES, "expected {MIN_FRAMES} frames a second, found {frames:.1}");
    Ok(())
}

/// Copies all files of the page into one folder.
fn lay_out(root: &Path, folder: &Path, model: &Path) -> Result<()> {
    let peer = root.join("target/bench/onnxruntime-web/node_modules/onnxruntime-web/dist");
    std::fs::create_dir_all(folder)?;
    let copy = |from: &Path, name: &str| {
        std::fs::copy(from, folder.join(name)).map(drop).with_context(|| format!("{}: cannot copy", from.display()))
    };
    let page = root.join("target/web");
    for name in [&OUR_MODULE[..], &["detector.js", "worker.js"]].concat() {
        copy(&page.join(name), name)?;
    }
    for name in THEIR_MODULE {
        copy(&peer.join(name), name)?;
    }
    for name in ["compare.html", "compare.js"] {
        copy(&root.join("benches/browser").join(name), name)?;
    }
    copy(&root.join(PICTURE), "picture.png")?;
    copy(model, "model.sdg")?;

    let python = root.join("target/bench/venv/bin/python");
    let output = Command::new(&python)
        .arg(root.join("benches/peers/export_edge.py"))
        .arg(model)
        .arg(folder.join("edge.onnx"))
        .output()
        .with_context(|| format!("{}: `make bench` installs it", python.display()))?;
    ensure!(output.status.success(), "export_edge.py failed: {}", String::from_utf8_lossy(&output.stderr));
    std::fs::write(folder.join("input.f32"), network_input(&root.join(PICTURE))?)?;
    Ok(())
}

/// The network's input for the picture, `[3, H, W]` padded with zeros, as bytes.
fn network_input(picture: &Path) -> Result<Vec<u8>> {
    let config = Network::Edge.config().input;
    let image = image::open(picture).with_context(|| picture.display().to_string())?.to_rgb8();
    let transformed = ImageTransform::new(&config).apply(&image)?;
    let [height, width] =
        [transformed.height, transformed.width].map(|side| side.next_multiple_of(config.size_divisibility));
    let mut padded = vec![0.0_f32; 3 * height * width];
    for (row, pixels) in transformed.pixels.chunks_exact(transformed.width).enumerate() {
        let (channel, y) = (row / transformed.height, row % transformed.height);
        padded[(channel * height + y) * width..][..transformed.width].copy_from_slice(pixels);
    }
    Ok(padded.iter().flat_map(|value| value.to_le_bytes()).collect())
}

/// Checks that both sides found the same box and the same scores of the part and of its keypoints. The positions of the
/// keypoints are not compared, because our positions are a fit to the network's positions, made for the grasp.
fn check_same(measured: &Value) -> Result<()> {
    let ours = &measured["network"]["detections"][0];
    let theirs = &measured["theirs"];
    compare("the score", &ours["network_score"], &theirs["scores"][0], 1.0, MAX_SCORE)?;
    // onnxruntime-web's boxes are in pixels of the network's input, half as large as the picture.
    let image_over_input = number(&measured["network"]["width"])? / 320.0;
    for side in 0..4 {
        let what = format!("number {side} of the box");
        compare(&what, &ours["box"][side], &theirs["boxes"][side], image_over_input, MAX_PX)?;
    }
    for (idx, keypoint) in ours["keypoints"].as_array().context("no keypoints")?.iter().enumerate() {
        let what = format!("the score of keypoint {idx}");
        compare(&what, &keypoint[2], &theirs["keypoints"][3 * idx + 2], 1.0, MAX_SCORE)?;
    }
    Ok(())
}

/// Checks that two numbers agree; `scale` converts theirs to our units.
fn compare(what: &str, ours: &Value, theirs: &Value, scale: f64, max: f64) -> Result<()> {
    let (ours, theirs) = (number(ours)?, number(theirs)? * scale);
    ensure!(
        (ours - theirs).abs() <= max,
        "not the same network: {what} is {ours} in our module and {theirs} in onnxruntime-web"
    );
    Ok(())
}

fn number(value: &Value) -> Result<f64> {
    value.as_f64().context("expected a number in the page's measurements, found none")
}

/// The median time of one side, in milliseconds.
fn times(measured: &Value, side: &str) -> Result<f64> {
    let times = measured["times"][side].as_array().context("no times")?;
    let times: Vec<f64> = times.iter().filter_map(Value::as_f64).collect();
    ensure!(!times.is_empty(), "expected times of {side}, found none");
    median(times).context("expected timed frames, found none")
}

fn markdown(measured: &Value, folder: &Path) -> Result<String> {
    let Machine { processor, commit, .. } = Machine::read();
    let version = measured["version"].as_str().unwrap_or("?");
    let [network, verified, theirs] = ["network", "verified", "theirs"].map(|side| times(measured, side));
    let (network, verified, theirs) = (network?, verified?, theirs?);
    let (our_bytes, their_bytes) = (compressed(folder, &OUR_MODULE)?, compressed(folder, &THEIR_MODULE)?);
    let mut text = format!(
        "{processor}, one thread; {}; commit {commit}.\n\n\
         | edge in the browser, 480×640 | ours | onnxruntime-web {version} | ratio |\n|---|--:|--:|--:|\n",
        chromium(),
    );
    let row = |what: &str, milliseconds: f64| format!("{what} | {}", duration(1e-3 * milliseconds));
    let _ = writeln!(
        text,
        "| {} | {} | {:.2} |",
        row("one frame, network (ours from the file's bytes to grasps)", network),
        duration(1e-3 * theirs),
        theirs / network
    );
    let _ = writeln!(text, "| {}, {:.1} a second | | |", row("one frame, verified", verified), 1e3 / verified);
    let mb = |bytes: usize| format!("{:.2} MB", bytes as f64 / 1e6);
    let _ = writeln!(
        text,
        "| download, compressed (gzip -9), without weights | {} | {} | {:.1} |",
        mb(our_bytes),
        mb(their_bytes),
        their_bytes as f64 / our_bytes as f64
    );
    Ok(text)
}

fn chromium() -> String {
    let output = Command::new("chromium").arg("--version").output();
    let text = output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default();
    text.split_whitespace().take(2).collect::<Vec<_>>().join(" ")
}

/// Size of files, compressed as a web server sends them.
fn compressed(folder: &Path, names: &[&str]) -> Result<usize> {
    names
        .iter()
        .map(|name| -> Result<usize> {
            let bytes = std::fs::read(folder.join(name)).with_context(|| (*name).to_owned())?;
            let mut gzip =
                Command::new("gzip").args(["-9", "-c"]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
            let mut input = gzip.stdin.take().context("expected a pipe to gzip")?;
            let writer = std::thread::spawn(move || input.write_all(&bytes));
            let output = gzip.wait_with_output()?;
            ensure!(matches!(writer.join(), Ok(Ok(()))) && output.status.success(), "gzip failed on {name}");
            Ok(output.stdout.len())
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(left: f64) -> Value {
        let ours = json!({"network_score": 0.9, "box": [left, 20.0, 40.0, 60.0], "keypoints": [[15.0, 25.0, 0.5]]});
        json!({
            "times": {"network": [90.0, 100.0, 110.0], "verified": [125.0], "theirs": [200.0]},
            "network": {"width": 640, "detections": [ours]},
            "theirs": {"scores": [0.905], "boxes": [5.0, 10.0, 20.0, 30.0], "keypoints": [9.0, 12.5, 0.495]},
            "version": "1.0",
        })
    }

    #[test]
    fn another_network_is_seen() {
        check_same(&measured(10.2)).unwrap();
        let error = check_same(&measured(11.0)).unwrap_err().to_string();
        assert!(error.contains("number 0 of the box is 11 in our module and 10 in onnxruntime-web"), "{error}");
        let mut other = measured(10.2);
        other["network"]["detections"][0]["keypoints"][0][2] = json!(0.7);
        let error = check_same(&other).unwrap_err().to_string();
        assert!(error.contains("the score of keypoint 0 is 0.7"), "{error}");
    }

    #[test]
    fn the_table_tells_times_ratio_and_sizes() {
        let folder = tempfile::tempdir().unwrap();
        for name in [&OUR_MODULE[..], &THEIR_MODULE[..]].concat() {
            std::fs::write(folder.path().join(name), vec![7; 100_000]).unwrap();
        }
        let table = markdown(&measured(10.0), folder.path()).unwrap();
        assert!(table.contains("| 100 ms | 200 ms | 2.00 |") && table.contains("8.0 a second"), "{table}");
        assert!(table.contains("0.00 MB | 0.00 MB | 1.5"), "{table}");
    }
}

//! The units of an evaluation divided among several processes, with model S on one part: the tables equal those of the
//! ordinary run, and missing, failed, stale or duplicate units prevent the tables.

use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::support::{Folder, sdg};
use serde_json::Value;

const TEACH: &str = "teach-S-rod_end";
const LOOK: &str = "look-rod_end";
const GRASP: &str = "grasp-S-rod_end";
const TIME: &str = "time-rod_end";

/// Arguments of the smallest possible evaluation, in a folder.
fn arguments<'a>(out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    const SMALLEST: [&str; 14] = [
        "evaluate",
        "--models",
        "S",
        "--objects",
        "rod_end",
        "--attempts",
        "1",
        "--views",
        "1",
        "--scenes",
        "1",
        "--seed",
        "3",
        "--json",
    ];
    [&SMALLEST[..], &["--out", out], more].concat()
}

fn evaluate(out: &str, more: &[&str]) -> Output {
    sdg(&arguments(out, more))
}

/// The JSON object printed by a call that succeeds.
fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", error_of(output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn error_of(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Standard error of a call that fails with this code; it must contain all of `parts`.
fn refused(output: &Output, code: i32, parts: &[&str]) -> String {
    let error = error_of(output);
    assert_eq!(output.status.code(), Some(code), "{error}");
    for part in parts {
        assert!(error.contains(part), "expected {part} in {error}");
    }
    error
}

/// A JSON object without the values that differ between runs: times, and sizes of files that contain times.
fn timeless(value: Value) -> Value {
    const TIMES: [&str; 6] =
        ["seconds", "teaching_secs", "longest_teaching_secs", "frames_per_second", "bytes", "largest_bytes"];
    match value {
        Value::Object(fields) => fields
            .into_iter()
            .filter(|(name, _)| !TIMES.contains(&name.as_str()))
            .map(|(k, v)| (k, timeless(v)))
            .collect(),
        Value::Array(values) => values.into_iter().map(timeless).collect(),
        other => other,
    }
}

/// Markdown without the columns of times.
fn without_times(text: &str) -> String {
    let (mut times, mut lines): (Vec<usize>, Vec<String>) = (Vec::new(), Vec::new());
    let mut last_was_row = false;
    for line in text.lines() {
        let cells: Vec<&str> = line.split('|').collect();
        if cells.len() > 1 {
            if !last_was_row {
                let is_time = |cell: &str| ["images per second", "teaching, "].iter().any(|time| cell.contains(time));
                times = (0..cells.len()).filter(|&i| is_time(cells[i])).collect();
            }
            let kept = cells.iter().enumerate().filter(|(i, _)| !times.contains(i)).map(|(_, cell)| *cell);
            lines.push(kept.collect::<Vec<_>>().join("|"));
        } else {
            lines.push(line.to_owned());
        }
        last_was_row = cells.len() > 1;
    }
    lines.join("\n")
}

fn tables(out: &str) -> (Value, String) {
    let json = serde_json::from_slice(&fs::read(Path::new(out).join("tables.json")).unwrap()).unwrap();
    (timeless(json), without_times(&fs::read_to_string(Path::new(out).join("tables.md")).unwrap()))
}

fn record(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// The only file of a unit whose name has this prefix.
fn file_of(out: &str, unit: &str, begins: &str) -> std::path::PathBuf {
    let entries = fs::read_dir(Path::new(out).join("units").join(unit)).unwrap().map(|entry| entry.unwrap().path());
    let found: Vec<_> =
        entries.filter(|path| path.file_name().unwrap().to_str().unwrap().starts_with(begins)).collect();
    assert_eq!(found.len(), 1, "{found:?}");
    found[0].clone()
}

#[test]
fn units_done_by_several_processes_make_the_tables_of_one() {
    let (serial, shared) = (Folder::new(), Folder::new());
    let (serial, shared) = (serial.path("run"), shared.path("run"));
    json(&evaluate(&serial, &["--jobs", "1"]));

    let listed = json(&evaluate(&shared, &["--list-units"]));
    let names: Vec<&str> = listed["units"].as_array().unwrap().iter().map(|u| u["name"].as_str().unwrap()).collect();
    assert_eq!(names, [TEACH, LOOK, GRASP, TIME]);
    assert_eq!(listed["units"][2]["after"], serde_json::json!([TEACH]));
    assert!(!Path::new(&shared).exists(), "listing makes nothing");

    json(&evaluate(&shared, &["--unit", TEACH]));
    // No tables are made before all units are done, and each missing unit is named.
    let error =
        refused(&evaluate(&shared, &["--collect"]), 1, &["3 of 4 units cannot be counted", "look-rod_end: missing"]);
    assert!(error.contains("grasp-S-rod_end: missing") && error.contains("time-rod_end: missing"), "{error}");
    assert!(!Path::new(&shared).join("tables.md").exists());
    let watched = json(&sdg(&["evaluate", "--watch", &shared, "--json"]));
    assert_eq!((&watched["units"], &watched["done"], &watched["waiting"]), (&4.into(), &1.into(), &3.into()));
    assert!(watched["seconds_left"].as_f64().unwrap() > 0.0 && watched["is_settled"] == false);

    // Two processes in one folder at the same time.
    let begin = |unit: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sdg"));
        command.args(arguments(&shared, &["--unit", unit])).stdout(Stdio::null()).stderr(Stdio::piped());
        command.spawn().unwrap()
    };
    for process in [begin(LOOK), begin(GRASP)] {
        let output = process.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", error_of(&output));
    }
    let receipt = record(&file_of(&shared, GRASP, "done-"));
    let before = fs::read(Path::new(&shared).join("cells/S-rod_end.attempts-verified.json")).unwrap();
    // Finished units are skipped.
    let ended = json(&evaluate(&shared, &["--unit", GRASP, TIME]));
    assert_eq!((&ended["units"][0]["ended"], &ended["units"][1]["ended"]), (&"already".into(), &"done".into()));
    assert_eq!(fs::read(Path::new(&shared).join("cells/S-rod_end.attempts-verified.json")).unwrap(), before);
    assert_eq!(record(&file_of(&shared, GRASP, "done-")), receipt);

    json(&evaluate(&shared, &["--collect"]));
    assert_eq!(tables(&shared), tables(&serial));
    let finished = sdg(&["evaluate", "--watch", &shared]);
    assert!(finished.status.success());
    let screen = String::from_utf8(finished.stdout).unwrap();
    assert!(
        screen.starts_with("4 of 4 units done, 0 running, 0 failed, 0 waiting\nteach 1 of 1, look 1 of 1,"),
        "{screen}"
    );
    // The ordinary run reuses the results.
    assert_eq!(json(&evaluate(&shared, &["--jobs", "1"]))["remaining"], 0);
    damaged_results_are_refused(&shared);
}

#[test]
fn a_missing_simulator_is_told_once_and_before_anything_is_done() {
    let (libraries, folder) = (Folder::new(), Folder::new());
    // These empty files are found before the installed library.
    for name in ["libmujoco.so.2.2.2", "libmujoco.so"] {
        File::create(libraries.path(name)).unwrap();
    }
    let out = folder.path("run");
    let without_mujoco = |units: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sdg"));
        command.env("LD_LIBRARY_PATH", libraries.path("")).args(arguments(&out, &[&["--unit"], units].concat()));
        command.output().unwrap()
    };
    let error = refused(&without_mujoco(&[TEACH, LOOK, GRASP]), 1, &["MuJoCo could not be loaded", "libmujoco2.2.2"]);
    assert_eq!(error.lines().count(), 1, "{error}");
    assert!(!Path::new(&out).exists());
    // Teaching does not need the simulator.
    assert_eq!(json(&without_mujoco(&[TEACH]))["units"][0]["ended"], "done");
}

/// Faults in a folder in which all units are done.
fn damaged_results_are_refused(shared: &str) {
    let at = |name: &str| Path::new(shared).join(name);
    let is_refused = |parts: &[&str]| refused(&evaluate(shared, &["--collect"]), 1, parts);

    // Results made with another number of pictures; teaching does not depend on this number.
    let with_two_views = |more: &[&str]| {
        let mut arguments = arguments(shared, more);
        let views = arguments.iter().position(|argument| *argument == "--views").unwrap();
        arguments[views + 1] = "2";
        sdg(&arguments)
    };
    let error = refused(&with_two_views(&["--collect"]), 1, &["stale", "views: expected 2, found 1"]);
    assert!(!error.contains(TEACH), "{error}");
    refused(&with_two_views(&["--unit", LOOK]), 1, &["done with other settings", "--out"]);

    // Two receipts of one unit.
    let receipt = file_of(shared, LOOK, "done-");
    let second = receipt.with_file_name("done-elsewhere-7-1.json");
    fs::copy(&receipt, &second).unwrap();
    is_refused(&["look-rod_end: duplicate: done by", "1 of 4 units"]);
    fs::remove_file(second).unwrap();

    // A file differs from its receipt, and then is missing.
    let (file, kept) = (at("cells/S-rod_end.look.json"), at("cells/kept"));
    fs::copy(&file, &kept).unwrap();
    fs::write(&file, fs::read_to_string(&file).unwrap() + "\n").unwrap();
    is_refused(&["look-rod_end: stale: cells/S-rod_end.look.json differs from the file"]);
    fs::remove_file(&file).unwrap();
    is_refused(&["look-rod_end: stale: cells/S-rod_end.look.json is gone"]);
    fs::rename(&kept, &file).unwrap();

    // Results of another program version: one result, and then all of them.
    let whole = fs::read_to_string(&receipt).unwrap();
    let program = record(&receipt)["settings"]["program"].as_str().unwrap().to_owned();
    assert_eq!(program.len(), 64);
    fs::write(&receipt, whole.replace(&program, "0ther")).unwrap();
    is_refused(&["look-rod_end: stale: done with other settings (program: expected", "found 0ther"]);
    fs::write(&receipt, &whole).unwrap();
    let settings = fs::read_to_string(at("settings.json")).unwrap();
    fs::write(at("settings.json"), settings.replace(&program, "0ther")).unwrap();
    is_refused(&["settings.json: made with other settings (program: expected"]);
    fs::write(at("settings.json"), settings).unwrap();

    // Two collectors at the same time, and a collector beside an ordinary run.
    let lock = File::create(at(".collect.lock")).unwrap();
    lock.lock().unwrap();
    is_refused(&["another --collect is running in this folder"]);
    drop(lock);
    let lock = File::open(at(".lock")).unwrap();
    lock.lock().unwrap();
    is_refused(&["another evaluation is running in this folder"]);
    drop(lock);
    json(&evaluate(shared, &["--collect"]));
}

#[test]
fn failures_are_recorded_and_told() {
    let folder = Folder::new();
    let out = folder.path("run");
    // A unit without its teaching cannot run.
    refused(
        &evaluate(&out, &["--unit", GRASP]),
        1,
        &["expected teach-S-rod_end to be done before", "all machines use the same one"],
    );
    // A folder in place of a file: even root cannot write it.
    let obstacle = Path::new(&out).join("cells/S-rod_end.teaching.json");
    fs::create_dir(&obstacle).unwrap();
    for _ in 0..2 {
        refused(&evaluate(&out, &["--unit", TEACH]), 1, &["teach-S-rod_end", "S-rod_end.teaching.json"]);
    }
    refused(
        &evaluate(&out, &["--collect"]),
        1,
        &["teach-S-rod_end: missing: failed 2 times", "grasp-S-rod_end: missing: failed once", "4 of 4 units"],
    );
    let watched = json(&sdg(&["evaluate", "--watch", &out, "--json"]));
    let teach = watched["failed"].as_array().unwrap().iter().find(|failed| failed["unit"] == TEACH).unwrap();
    assert!(teach["tries"] == 2 && teach["why"].as_str().unwrap().contains("teaching.json"), "{teach}");
    // The second failure is final, and no other unit can begin: the watch ends.
    let ended = sdg(&["evaluate", "--watch", &out]);
    refused(&ended, 1, &["4 of 4 units have no result"]);
    assert!(String::from_utf8(ended.stdout).unwrap().contains("\nfailed:\n  teach-S-rod_end  2 times, last on "));

    // A unit that is running, and later one whose process was killed.
    fs::remove_dir(&obstacle).unwrap();
    let unit = Path::new(&out).join("units").join(LOOK);
    fs::create_dir_all(&unit).unwrap();
    let running = r#"{"by": {"host": "n7", "pid": 12, "job": "31"}, "started_secs": 1700000000}"#;
    fs::write(unit.join("running.json"), running).unwrap();
    let lock = File::create(unit.join("lock")).unwrap();
    lock.lock().unwrap();
    refused(&evaluate(&out, &["--collect"]), 1, &["look-rod_end: still running on n7 (process 12, job 31)"]);
    let watched = json(&sdg(&["evaluate", "--watch", &out, "--json"]));
    assert_eq!((&watched["running"][0]["unit"], &watched["running"][0]["by"]["host"]), (&LOOK.into(), &"n7".into()));
    // A second process for the same unit waits until the unit is free.
    let mut command = Command::new(env!("CARGO_BIN_EXE_sdg"));
    command.args(arguments(&out, &["--unit", LOOK])).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut waiting = command.spawn().unwrap();
    let mut told = String::new();
    BufReader::new(waiting.stderr.as_mut().unwrap()).read_line(&mut told).unwrap();
    assert!(
        told.starts_with("look-rod_end: running in another process, by n7 (process 12, job 31); waiting"),
        "{told}"
    );
    assert!(waiting.try_wait().unwrap().is_none());
    drop(lock);
    // The second process then begins, and reports what is missing.
    assert_eq!(waiting.wait().unwrap().code(), Some(1));
    fs::write(unit.join("running.json"), running).unwrap();
    let gone = "look-rod_end: missing: n7 (process 12, job 31) ended without a result";
    refused(&evaluate(&out, &["--collect"]), 1, &[gone]);
    // The next try succeeds.
    json(&evaluate(&out, &["--unit", TEACH, LOOK]));
}

#[test]
fn wrong_usage_and_folders_are_told() {
    let folder = Folder::new();
    let out = folder.path("run");
    refused(
        &evaluate(&out, &["--unit", "grasp-rod_end"]),
        2,
        &["found \"grasp-rod_end\"", "grasp-S-rod_end", "--list-units"],
    );
    assert!(!Path::new(&out).exists());
    refused(&sdg(&["evaluate", "--watch", &folder.path("none")]), 1, &["found no plan"]);
    refused(&evaluate("/proc/evaluation", &["--unit", TEACH]), 1, &["/proc/evaluation"]);
    refused(&evaluate(&out, &["--collect", "--list-units"]), 2, &["--list-units"]);
    refused(&evaluate(&out, &["--yes"]), 2, &["--submit"]);

    // A full disk: files are limited to a kilobyte. Nothing is half-written, and the reason is recorded.
    let words: Vec<String> = arguments(&out, &["--unit", TEACH]).iter().map(|word| format!("'{word}'")).collect();
    let line = format!("trap '' XFSZ; ulimit -f 1; exec '{}' {}", env!("CARGO_BIN_EXE_sdg"), words.join(" "));
    let full = Command::new("bash").args(["-c", &line]).output().unwrap();
    refused(&full, 1, &["teach-S-rod_end", "S-rod_end.sdg"]);
    assert_eq!(fs::read_dir(Path::new(&out).join("models")).unwrap().count(), 0);
    assert!(record(&file_of(&out, TEACH, "failed-"))["why"].as_str().unwrap().contains("S-rod_end.sdg"));
}

#[test]
fn the_submit_script_is_one_that_bash_reads() {
    let folder = Folder::new();
    let out = folder.path("a run");
    let printed = json(&evaluate(&out, &["--submit", "slurm", "--sbatch=--partition=cpu", "--memory-mb", "1500"]));
    let script = printed["script"].as_str().unwrap();
    for part in ["--requeue", "--mem=1500M", "--partition=cpu", "--dependency=\"afterany:", "--seed 3", LOOK] {
        assert!(script.contains(part), "expected {part} in {script}");
    }
    let listed =
        ["evaluate", "--models", "S", "--objects", "pendulum, rod_end", "--submit", "slurm", "--json", "--out", &out];
    let printed = json(&sdg(&listed));
    let script_of_two = printed["script"].as_str().unwrap();
    assert!(script_of_two.contains("--objects pendulum,rod_end --"), "without the space: {script_of_two}");
    let path = folder.text("submit.sh", script);
    assert!(Command::new("bash").args(["-n", &path]).status().unwrap().success());
    assert!(!Path::new(&out).exists(), "printing makes nothing");
    // Without Slurm, the error names the missing program.
    let mut command = Command::new(env!("CARGO_BIN_EXE_sdg"));
    command.args(arguments(&out, &["--submit", "slurm", "--yes"])).env("PATH", "/bin/nothing:/usr/bin");
    if !Path::new("/usr/bin/sbatch").exists() {
        refused(&command.output().unwrap(), 1, &["sbatch"]);
    }
}

#[test]
fn submitted_jobs_are_told() {
    let folder = Folder::new();
    let out = folder.path("a run");
    let submit = |words: Vec<&str>| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sdg"));
        // A function of bash instead of Slurm's program.
        command.args(words).env("BASH_FUNC_sbatch%%", "() { echo '41;cluster'; }");
        command.output().unwrap()
    };
    let words = arguments(&out, &["--submit", "slurm", "--yes"]);
    let printed = json(&submit(words.clone()));
    assert_eq!(printed, serde_json::json!({ "jobs": ["41", "41", "41"], "units": 4, "out": out }));
    let printed = submit(words.into_iter().filter(|word| *word != "--json").collect());
    let printed = String::from_utf8(printed.stdout).unwrap();
    assert!(printed.starts_with("teach: job 41, 1 units\n"), "{printed}");
    assert!(
        printed.contains(&format!("--watch '{out}'; ")) && printed.contains(&format!("--out '{out}' ")),
        "{printed}"
    );
}

//! Failures of programs and robots during a motion: the arm stops; after a killed program, it does not move until a
//! person confirms.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Stdio};
use std::thread;
use std::time::Duration;

use crate::simulated_arm::Simulated;
use crate::support::sdg;
use serde_json::Value;

/// The shipped workcell with a home position that has joint 1 at 50 degrees.
fn workcell(folder: &Path) -> PathBuf {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/workcell");
    let whole = fs::read_to_string(shipped.join("workcell.toml")).unwrap();
    let head = whole.split("[[look_out]]").next().unwrap().replace("mounting = \"hand\"", "mounting = \"base\"");
    let path = folder.join("workcell.toml");
    fs::write(&path, format!("{head}[[look_out]]\njoints_deg = [50, -45, 0, -135, 0, 90, 45]\n")).unwrap();
    path
}

/// Times after the message `moving home` at which a test disturbs the motion. A test tries them in turn until the
/// motion has begun by that time; when it begins depends on the machine.
const MOVING: [Duration; 5] = [
    Duration::from_millis(500),
    Duration::from_secs(1),
    Duration::from_secs(2),
    Duration::from_secs(4),
    Duration::from_secs(8),
];

/// Tries the times of [`MOVING`] until one of them lies within the motion.
fn once_moving<T>(attempt: impl FnMut(Duration) -> Option<T>) -> T {
    MOVING.into_iter().find_map(attempt).expect("the arm moves within 8 s")
}

/// A running `sdg robot home`, whose motion has been announced.
struct Moving {
    child: Child,
    stderr: BufReader<ChildStderr>,
}

impl Moving {
    /// Waits for the time `moving_for` after the message. At a hundredth of the speed, the motion takes a minute of
    /// simulated time.
    fn start(simulated: &Simulated, workcell: &Path, states: &Path, moving_for: Duration) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_sdg"))
            .args(["robot", "home", "--robot", &simulated.address, "--yes", "--no-realtime", "--speed", "0.01"])
            .args(["--workcell".as_ref(), workcell.as_os_str(), "--states".as_ref(), states.as_os_str()])
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut stderr = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        stderr.read_line(&mut line).unwrap();
        assert!(line.starts_with("moving home, "), "{line}");
        thread::sleep(moving_for);
        Self { child, stderr }
    }

    fn signal(&self, name: &str) {
        let sent = Command::new("kill").args([format!("-{name}"), self.child.id().to_string()]).status().unwrap();
        assert!(sent.success());
    }

    /// The remaining output and the exit code.
    fn finish(mut self) -> (String, Option<i32>) {
        let mut text = String::new();
        self.stderr.read_to_string(&mut text).unwrap();
        (text, self.child.wait().unwrap().code())
    }
}

/// The output of `sdg robot state --json`.
fn state_line(simulated: &Simulated) -> Value {
    let output = sdg(&["robot", "state", "--robot", &simulated.address, "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Joint positions in rad, and the mode.
fn state(simulated: &Simulated) -> (Vec<f64>, String) {
    let line = state_line(simulated);
    let joints = line["joints_rad"].as_array().unwrap().iter().map(|value| value.as_f64().unwrap()).collect();
    (joints, line["mode"].as_str().unwrap().to_owned())
}

/// Whether the arm has left its start but not reached the end.
fn is_on_its_way(simulated: &Simulated) -> bool {
    (1e-4..0.8).contains(&state(simulated).0[0])
}

/// Asserts that the arm does not move, and returns its position.
fn assert_stands(simulated: &Simulated) -> Vec<f64> {
    let (joints, _) = state(simulated);
    thread::sleep(Duration::from_millis(200));
    let (later, _) = state(simulated);
    assert!(joints.iter().zip(&later).all(|(one, other)| (one - other).abs() < 2e-3), "{joints:?} {later:?}");
    later
}

/// The number of recorded states in a file.
fn num_states(path: &Path) -> usize {
    let text = fs::read_to_string(path).unwrap();
    assert!(text.starts_with("time_secs,mode,q_rad_1,"), "{text}");
    text.lines().count() - 1
}

#[test]
fn a_program_that_is_killed_leaves_the_arm_standing_until_a_person_recovers_it() {
    let folder = tempfile::tempdir().unwrap();
    let (workcell, states) = (workcell(folder.path()), folder.path().join("states.csv"));
    let simulated = once_moving(|moving_for| {
        let simulated = Simulated::start(&[]);
        let moving = Moving::start(&simulated, &workcell, &states, moving_for);
        moving.signal("KILL");
        moving.finish();
        is_on_its_way(&simulated).then_some(simulated)
    });
    let stopped = assert_stands(&simulated);
    assert_eq!(state(&simulated).1, "reflex");
    let home = ["robot", "home", "--robot", &simulated.address, "--yes", "--no-realtime", "--speed", "0.6"];
    let home = [&home[..], &["--workcell", workcell.to_str().unwrap(), "--states", states.to_str().unwrap()]].concat();
    let refused = sdg(&home);
    let stderr = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(refused.status.code(), Some(1), "{stderr}");
    assert!(stderr.contains("nothing moves until a person has checked the arm and recovers it: "), "{stderr}");
    assert!(stderr.contains("; sdg robot recover recovers it"), "{stderr}");

    // Nor does the hand move, and the record of the failure is kept.
    let opening_m = || state_line(&simulated)["hand"]["opening_m"].as_f64().unwrap();
    let before_m = opening_m();
    fs::write(&states, "the failure").unwrap();
    let to_states = ["--states", states.to_str().unwrap()];
    for hand in [&["open", "--width-mm", "20"][..], &["close"], &["home", "--hand", "--yes"]] {
        let refused = sdg(&[&["robot"], hand, &["--robot", &simulated.address], &to_states].concat());
        let stderr = String::from_utf8(refused.stderr).unwrap();
        assert_eq!(refused.status.code(), Some(1), "{hand:?}: {stderr}");
        assert!(stderr.contains("nothing moves until a person has checked the arm"), "{hand:?}: {stderr}");
        assert_eq!(fs::read_to_string(&states).unwrap(), "the failure", "{hand:?}");
        assert!((opening_m() - before_m).abs() < 1e-4, "{hand:?}");
    }

    // Without a terminal, there is no consent.
    let recover = ["robot", "recover", "--robot", &simulated.address];
    assert!(sdg(&recover).status.success());
    assert_eq!(state(&simulated).1, "reflex");
    assert!(sdg(&[&recover[..], &["--yes"]].concat()).status.success());
    let (joints, mode) = state(&simulated);
    assert_eq!(mode, "idle");
    assert!(joints.iter().zip(&stopped).all(|(one, other)| (one - other).abs() < 2e-3), "{joints:?} {stopped:?}");

    let moved = sdg(&home);
    assert!(moved.status.success(), "{}", String::from_utf8_lossy(&moved.stderr));
    assert!((state(&simulated).0[0] - 50_f64.to_radians()).abs() < 2e-3);
}

#[test]
fn ctrl_c_and_sigterm_stop_the_arm_on_its_path_and_keep_the_last_second() {
    let folder = tempfile::tempdir().unwrap();
    let (workcell, states) = (workcell(folder.path()), folder.path().join("states.csv"));
    for signal in ["INT", "TERM"] {
        let (simulated, stderr, code) = once_moving(|moving_for| {
            let simulated = Simulated::start(&[]);
            let moving = Moving::start(&simulated, &workcell, &states, moving_for);
            moving.signal(signal);
            let (stderr, code) = moving.finish();
            is_on_its_way(&simulated).then_some((simulated, stderr, code))
        });
        assert_eq!(code, Some(1), "{signal}: {stderr}");
        let expected =
            format!("the arm's last second: {}\nsdg: the arm was stopped: a person requested it\n", states.display());
        assert_eq!(stderr, expected, "{signal}");
        assert!((600..=1002).contains(&num_states(&states)), "{signal}: {}", num_states(&states));
        assert_stands(&simulated);
        assert_eq!(state(&simulated).1, "idle", "{signal}");
    }
}

#[test]
fn a_robot_that_goes_in_a_motion_is_one_line_and_its_last_second_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (workcell, states) = (workcell(folder.path()), folder.path().join("states.csv"));
    let (address, stderr, code) = once_moving(|moving_for| {
        let simulated = Simulated::start(&[]);
        let address = simulated.address.clone();
        let moving = Moving::start(&simulated, &workcell, &states, moving_for);
        drop(simulated);
        let (stderr, code) = moving.finish();
        (states.exists() && num_states(&states) > 100).then_some((address, stderr, code))
    });
    assert_eq!(code, Some(1), "{stderr}");
    let lines: Vec<_> = stderr.lines().collect();
    assert_eq!(lines.len(), 2, "{stderr}");
    assert!(lines[1].starts_with(&format!("sdg: the connection to the robot at {address} is lost: ")), "{stderr}");
}

/// Whether these tests were started with `nohup`: the programs that they start then also ignore SIGHUP.
fn is_hangup_ignored() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).unwrap();
    u64::from_str_radix(ignored.trim(), 16).unwrap() & 1 != 0
}

#[test]
fn a_simulated_robot_whose_output_is_closed_ends_without_an_error() {
    // Its standard output is closed after the first line, and it prints another one at the end.
    let signals = ["-INT", "-TERM", "-HUP"];
    for signal in signals.into_iter().filter(|signal| *signal != "-HUP" || !is_hangup_ignored()) {
        assert_eq!(Simulated::start(&[]).interrupted(signal), Some(0), "{signal}");
    }
}

#[test]
fn a_program_started_with_nohup_outlives_its_terminal() {
    let mut nohup = Command::new("nohup");
    nohup.arg(env!("CARGO_BIN_EXE_sdg"));
    let simulated = Simulated::start_by(nohup, &[]);
    simulated.signal("-HUP");
    thread::sleep(Duration::from_millis(300));
    assert_eq!(state(&simulated).1, "idle");
    assert_eq!(simulated.interrupted("-TERM"), Some(0));
}

//! Shell completions, manual pages, and the page of a teaching run.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::support::sdg;
use clap::CommandFactory;
use sdg_cli::args::Args;

fn commands() -> Vec<String> {
    Args::command().get_subcommands().map(|command| command.get_name().to_owned()).collect()
}

#[test]
fn completions_know_every_command_and_bash_reads_them() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let done = sdg(&["completions", shell]);
        let script = String::from_utf8(done.stdout).unwrap();
        for command in commands() {
            assert!(script.contains(&command), "{shell}: {command}");
        }
        assert!(script.contains("grasp-model"), "{shell}");
        if shell == "bash" {
            let mut bash = Command::new("bash").arg("-n").stdin(Stdio::piped()).spawn().unwrap();
            bash.stdin.take().unwrap().write_all(script.as_bytes()).unwrap();
            assert!(bash.wait().unwrap().success());
        }
    }
    let unknown = sdg(&["completions", "csh"]);
    assert_eq!(unknown.status.code(), Some(2));
}

#[test]
fn bash_completes_an_option() {
    let script = String::from_utf8(sdg(&["completions", "bash"]).stdout).unwrap();
    // The query that bash sends for `sdg detect --gr<TAB>`.
    let ask = "COMP_WORDS=(sdg detect --gr) COMP_CWORD=2; _sdg sdg --gr detect; printf '%s\\n' \"${COMPREPLY[@]}\"";
    let done = Command::new("bash").args(["-c", &format!("{script}\n{ask}")]).output().unwrap();
    let replies = String::from_utf8(done.stdout).unwrap();
    assert!(replies.lines().any(|reply| reply.trim() == "--grasp-model"), "{replies}");
}

#[test]
fn manual_pages_mention_every_command() {
    let page = String::from_utf8(sdg(&["man"]).stdout).unwrap();
    assert!(page.contains(".TH sdg 1"), "{page}");
    // roff escapes hyphens.
    let page = page.replace("\\-", "-");
    for command in commands() {
        assert!(page.contains(&format!("sdg-{command}(1)")), "{command}");
    }

    let folder = tempfile::tempdir().unwrap();
    let done = sdg(&["man", "--out", folder.path().join("man1").to_str().unwrap()]);
    assert!(done.status.success());
    let read = |name: &str| fs::read_to_string(folder.path().join("man1").join(name)).unwrap().replace("\\-", "-");
    for command in commands() {
        assert!(read(&format!("sdg-{command}.1")).contains("sdg"), "{command}");
    }
    assert!(read("sdg-teach.1").contains("--time-budget") && read("sdg-weights-convert.1").contains("--reinit"));
}

#[test]
fn help_ends_with_examples_and_exit_codes() {
    for verb in [["detect", "--help"], ["detect", "-h"]] {
        let help = String::from_utf8(sdg(&verb).stdout).unwrap();
        assert!(help.contains("Examples:\n  sdg detect --grasp-model part.sdg pictures --draw drawn"), "{help}");
        let last = help.trim_end().lines().last().unwrap();
        assert!(last.contains("docs/command-line.md"), "{help}");
        assert!(help.contains("Exit codes: 0 done, 1 failed"), "{help}");
    }
}

#[test]
#[cfg(not(feature = "ros2"))]
fn a_build_without_ros_2_says_so() {
    let refused = sdg(&["ros2", "--grasp-model", "part.sdg"]);
    assert_eq!(refused.status.code(), Some(2));
    let stderr = String::from_utf8(refused.stderr).unwrap();
    assert!(stderr.contains("built without ROS 2") && stderr.lines().count() == 1, "{stderr}");
}

#[test]
fn teaching_leaves_a_page() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets/demonstrations/rod_end");
    let demonstration = format!("{0}/image.png:{0}/annotation.json", shipped.display());
    let done = sdg(&[
        "teach",
        "--model",
        "S",
        "--demo",
        &demonstration,
        "--out",
        &at("m.sdg"),
        "--report",
        &at("report"),
        "--json",
    ]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let line: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(line["report"].as_str(), Some(at("report/index.html").as_str()));
    let page = fs::read_to_string(at("report/index.html")).unwrap();
    for part in ["Demonstration", "As marked", "Tried", "with the part; score", "sdg teach --model S", "<img"] {
        assert!(page.contains(part), "{part}");
    }
}

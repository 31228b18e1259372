//! Guides agree with the program: their calls name existing commands and options, their commands run, and the sources
//! contain the messages that the page of symptoms quotes.

mod blocks;
mod run;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command as Process;

use clap::Command;

use blocks::{blocks, calls, spans};

/// Options of other programs that documents mention.
const OTHERS: &[&str] = &[
    // cargo and its tests
    "--release",
    "--locked",
    "--features",
    "--no-default-features",
    "--workspace",
    "--bins",
    "--example",
    "--test",
    "--bin",
    "--lib",
    "--profile",
    // Docker, Podman
    "--user",
    "--userns",
    // franka-sim
    "--joint-discontinuity-scale",
    // Slurm
    "--exclusive",
    "--requeue",
    // ROS 2
    "--ros-args",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// The documents that a user reads. Decisions and results are left out because they describe the past; the page's style
/// is left out because its variables look like options.
fn documents() -> Vec<(String, String)> {
    let listed = Process::new("git")
        .args(["ls-files", "--cached", "--others", "--exclude-standard", "--", "*.md"])
        .current_dir(root())
        .output()
        .unwrap();
    let names = String::from_utf8(listed.stdout).unwrap();
    let is_other = |name: &str| {
        ["docs/decisions/", "base-weights/", "crates/annotate/page/"].iter().any(|folder| name.starts_with(folder))
            || name.ends_with("RESULTS.md")
    };
    let kept = names.lines().filter(|name| !is_other(name) && root().join(name).exists());
    let documents: Vec<_> =
        kept.map(|name| (name.to_owned(), fs::read_to_string(root().join(name)).unwrap())).collect();
    assert!(documents.len() > 30, "expected the documents of a git checkout, found {}", documents.len());
    documents
}

/// The error in a call of `sdg`, if there is one.
fn fault(root: &Command, words: &[String]) -> Option<String> {
    let mut command = root;
    let mut rest = words;
    while command.has_subcommands() {
        let verb = rest.first()?;
        if verb.chars().all(|c| !c.is_ascii_lowercase()) {
            // A placeholder, such as VERB or ….
            return None;
        }
        // `camera list|grab|watch` names several verbs.
        let alternatives: Vec<&str> = verb.split('|').collect();
        for alternative in &alternatives {
            if command.find_subcommand(alternative).is_none() {
                return Some(format!("no verb {alternative} of {}", command.get_name()));
            }
        }
        command = command.find_subcommand(alternatives[0])?;
        rest = &rest[1..];
        if alternatives.len() > 1 {
            return None;
        }
    }
    if command.get_name() == "ros2" && cfg!(not(feature = "ros2")) {
        return None;
    }
    rest.iter().flat_map(|word| word.split('|')).find_map(|word| {
        let option = word.split(['=', '…', '/']).next()?;
        let long = option.strip_prefix("--").filter(|name| !name.is_empty())?;
        let is_known = ["help", "version"].contains(&long)
            || command
                .get_arguments()
                .any(|arg| arg.get_long_and_visible_aliases().is_some_and(|all| all.contains(&long)));
        (!is_known).then(|| format!("no option --{long} of {}", command.get_name()))
    })
}

fn long_options(command: &Command, found: &mut BTreeSet<String>) {
    found.extend(command.get_arguments().filter_map(|arg| arg.get_long()).map(|name| format!("--{name}")));
    for below in command.get_subcommands() {
        long_options(below, found);
    }
}

#[test]
fn calls_in_documents_name_verbs_and_options_that_there_are() {
    let program = sdg_cli::command();
    let mut known: BTreeSet<String> = OTHERS.iter().map(|name| (*name).to_owned()).collect();
    known.extend(["--help", "--version"].map(str::to_owned));
    long_options(&program, &mut known);
    // A build without the feature `ros2` does not know that command's options; its source has their fields.
    let ros2_fields = fs::read_to_string(root().join("crates/cli/src/commands/ros2/args.rs")).unwrap();
    let is_of_ros2 = |option: &str| ros2_fields.contains(&format!("pub {}:", option[2..].replace('-', "_")));
    let mut faults = Vec::new();
    let mut num_calls = 0;
    for (name, document) in documents() {
        let in_blocks =
            blocks(&document).into_iter().filter(|block| block.is_shell()).flat_map(|block| calls(&block.script()));
        let of_spans = spans(&document);
        let in_spans = of_spans.iter().filter(|span| span.starts_with("sdg ")).flat_map(|span| calls(span));
        for call in in_blocks.chain(in_spans) {
            num_calls += 1;
            faults.extend(fault(&program, &call).map(|fault| format!("{name}: sdg {}: {fault}", call.join(" "))));
        }
        for span in of_spans.iter().filter(|span| span.starts_with("--")) {
            for word in span.split_whitespace().filter(|word| word.starts_with("--") && word.len() > 2) {
                let option = word.split(['=', '…', '|', '[']).next().unwrap();
                if !known.contains(option) && !is_of_ros2(option) {
                    faults.push(format!("{name}: `{span}`: no verb has the option {option}"));
                }
            }
        }
    }
    assert!(num_calls > 200, "expected hundreds of calls in the documents, found {num_calls}");
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// All texts of the sources, with the line breaks inside string literals removed.
fn sources() -> String {
    fn collect(folder: &Path, texts: &mut String) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                collect(&path, texts);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let text = fs::read_to_string(&path).unwrap();
                // Tests quote messages but do not create them.
                *texts += text.split("#[cfg(test)]").next().unwrap();
            }
        }
    }
    let mut texts = String::new();
    for entry in fs::read_dir(root().join("crates")).unwrap() {
        let folder = entry.unwrap().path().join("src");
        if folder.is_dir() {
            collect(&folder, &mut texts);
        }
    }
    let mut joined = String::new();
    for piece in texts.split("\\\n") {
        joined += if joined.is_empty() { piece } else { piece.trim_start() };
    }
    joined
}

#[test]
fn the_messages_of_the_page_of_symptoms_stand_in_the_sources() {
    let page = fs::read_to_string(root().join("docs/troubleshooting.md")).unwrap();
    let sources = sources();
    let mut num_messages = 0;
    let mut missing = Vec::new();
    for line in page.lines().filter(|line| line.starts_with("| `")) {
        let message = line.split('`').nth(1).unwrap();
        num_messages += 1;
        for piece in message.split('…').map(str::trim).filter(|piece| !piece.is_empty()) {
            if !sources.contains(piece) {
                missing.push(format!("\"{piece}\" of \"{message}\""));
            }
        }
    }
    assert!(num_messages > 30, "expected the messages of docs/troubleshooting.md, found {num_messages}");
    assert!(missing.is_empty(), "no source has\n{}", missing.join("\n"));
}

//! docs/reference.md lists every command with its arguments and options, as the program defines them.
//!
//! `SDG_WRITE_REFERENCE=1` writes the page instead of comparing it. Builds with other features have other commands and
//! are not compared.
#![cfg(all(feature = "annotate", feature = "simulation", not(feature = "ros2")))]

use std::fmt::Write;
use std::fs;
use std::path::Path;

use clap::{Arg, Command};

const MAX_COLUMNS: usize = 100;

/// The page's text above the commands.
const HEAD: &str = "# Commands and options

Every command with its arguments and options, written by a test from the program's own definition.
`sdg COMMAND --help` prints the same. Common rules and output: [the command line](command-line.md).
";

#[test]
fn the_reference_says_what_the_program_says() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference.md");
    let mut root = sdg_cli::command().disable_help_subcommand(true);
    root.build();
    let mut text = HEAD.to_owned();
    for command in root.get_subcommands() {
        write_verb(&mut text, command, "sdg");
    }
    if std::env::var_os("SDG_WRITE_REFERENCE").is_some() {
        fs::write(&page, &text).unwrap();
    }
    let found = fs::read_to_string(&page).unwrap_or_default();
    let differs = text.lines().zip(found.lines()).find(|(expected, found)| expected != found);
    assert!(
        found == text,
        "docs/reference.md is not what the program says, first {differs:?}: SDG_WRITE_REFERENCE=1 and this test write it"
    );
}

fn write_verb(text: &mut String, command: &Command, parents: &str) {
    let path = format!("{parents} {}", command.get_name());
    if command.has_subcommands() {
        for below in command.get_subcommands() {
            write_verb(text, below, &path);
        }
        return;
    }
    writeln!(text, "\n## `{path}`\n").unwrap();
    if command.get_name() == "ros2" {
        text.push_str("Only in builds with cargo's feature `ros2`; its options: [ROS 2](ros2.md).\n");
        return;
    }
    let about = command.get_long_about().or(command.get_about()).unwrap();
    writeln!(text, "{}\n", sentence(&in_markdown(&about.to_string()))).unwrap();
    let usage = command.clone().render_usage().to_string();
    writeln!(text, "```text\n{}\n```\n", usage.trim_start_matches("Usage: ")).unwrap();
    let shown = || command.get_arguments().filter(|arg| !arg.is_hide_set() && !is_of_every_verb(arg));
    let mut headings: Vec<Option<&str>> = Vec::new();
    for arg in shown() {
        if !headings.contains(&arg.get_help_heading()) {
            headings.push(arg.get_help_heading());
        }
    }
    for heading in headings {
        if let Some(heading) = heading {
            writeln!(text, "{heading}:\n").unwrap();
        }
        for arg in shown().filter(|arg| arg.get_help_heading() == heading) {
            text.push_str(&item(&signature(arg), &meaning(arg)));
        }
        text.push('\n');
    }
    let ending = command.get_after_long_help().or(command.get_after_help()).map(ToString::to_string);
    // The exit codes end the help of every command.
    let ending = ending.unwrap_or_default();
    let own = ending.split("Exit codes:").next().unwrap_or_default().trim_end();
    if !own.is_empty() {
        writeln!(text, "```text\n{own}\n```").unwrap();
    }
}

fn is_of_every_verb(arg: &Arg) -> bool {
    ["help", "version"].contains(&arg.get_id().as_str())
}

/// `--min-score SCORE`, as code.
fn signature(arg: &Arg) -> String {
    let takes_value = arg.is_positional() || arg.get_action().takes_values();
    let values: Vec<String> = arg.get_value_names().unwrap_or_default().iter().map(|name| name.to_string()).collect();
    let values = if takes_value { values.join(" ") } else { String::new() };
    let dashes = match (arg.get_short(), arg.get_long()) {
        (Some(short), Some(long)) => format!("-{short}, --{long} "),
        (Some(short), None) => format!("-{short} "),
        (None, Some(long)) => format!("--{long} "),
        (None, None) => String::new(),
    };
    let several =
        if takes_value && arg.get_num_args().is_some_and(|number| number.max_values() > 1) { " …" } else { "" };
    format!("`{dashes}{values}").trim_end().to_owned() + several + "`"
}

/// An item of a list, wrapped at [`MAX_COLUMNS`]. A signature is not divided.
fn item(signature: &str, meaning: &str) -> String {
    let mut item = format!("- {signature}");
    let mut columns = item.chars().count();
    for word in ["–"].into_iter().chain(meaning.split(' ')) {
        let width = word.chars().count();
        if columns + 1 + width > MAX_COLUMNS {
            item.push_str("\n ");
            columns = 1;
        }
        write!(item, " {word}").unwrap();
        columns += 1 + width;
    }
    item + "\n"
}

/// The help, the default, and the possible values.
fn meaning(arg: &Arg) -> String {
    let help = arg.get_long_help().or(arg.get_help()).map(ToString::to_string).unwrap_or_default();
    let mut meaning = sentence(&in_markdown(&help));
    if !arg.get_action().takes_values() {
        return meaning;
    }
    let values: Vec<String> = arg
        .get_possible_values()
        .iter()
        .filter(|value| !value.is_hide_set())
        .map(|value| format!("`{}`", value.get_name()))
        .collect();
    if !values.is_empty() {
        write!(meaning, " One of {}.", values.join(", ")).unwrap();
    }
    let defaults: Vec<_> =
        arg.get_default_values().iter().map(|value| format!("`{}`", value.to_string_lossy())).collect();
    if !defaults.is_empty() && !arg.is_hide_default_value_set() {
        write!(meaning, " Default: {}.", defaults.join(", ")).unwrap();
    }
    meaning
}

/// The text on one line, with `<` and `*` escaped for Markdown.
fn in_markdown(help: &str) -> String {
    help.split_whitespace().collect::<Vec<_>>().join(" ").replace('<', "\\<").replace('*', "\\*")
}

fn sentence(text: &str) -> String {
    if text.ends_with(['.', ':', '?']) || text.is_empty() { text.to_owned() } else { format!("{text}.") }
}

//! The end of the help texts and manual pages: two examples of the command and the exit codes.

use clap::Command;

/// The last line of every help text and manual page.
const EXIT_CODES: &str =
    "Exit codes: 0 done, 1 failed, 2 wrong usage, 3 found nothing, 4 poor model (docs/command-line.md)";

/// Two example calls of each command without subcommands.
const EXAMPLES: &[[&str; 2]] = &[
    ["sdg demo", "sdg demo --object rod_end --attempts 20 --seed 2"],
    ["sdg annotate photo.png", "sdg annotate --from v4l: --size 1280x720"],
    [
        "sdg teach --model S --demo photo.png --out part.sdg",
        "sdg teach --demo photo.png --demo photo-2.png --out part.sdg --report report",
    ],
    [
        "sdg detect --grasp-model part.sdg pictures --draw drawn",
        "sdg detect --grasp-model part.sdg --from v4l: --draw 8080",
    ],
    [
        "sdg rehearse --grasp-model part.sdg --object pendulum",
        "sdg rehearse --grasp-model part.sdg --height-mm 12 --length-mm 85",
    ],
    ["sdg simulate --fci", "sdg simulate --fci --lockstep --object pendulum"],
    [
        "sdg evaluate --pictures pictures --grasp-model part.sdg",
        "sdg evaluate --models S --objects pendulum,rod_end --attempts 2 --report report",
    ],
    [
        "sdg grasp --robot sim --from sim:pendulum --grasp-model part.sdg --workcell cell.toml",
        "sdg grasp --robot 172.16.0.2 --from v4l: --grasp-model part.sdg --workcell cell.toml --dry-run",
    ],
    [
        "sdg ros2 --grasp-model part.sdg --camera camera.yaml -r image:=/camera/color/image_raw",
        "sdg ros2 --grasp-model part.sdg --base-frame panda_link0",
    ],
    [
        "sdg plan --workcell cell.toml --goal 500,-300,150",
        "sdg plan --workcell cell.toml --start 31,20,0,-120,0,140,76 --goal 500,-300,150 --json",
    ],
    ["sdg workcell show cell.toml", "sdg workcell show cell.toml --out cell.png"],
    ["sdg robot state --robot 172.16.0.2", "sdg robot state --robot 172.16.0.2 --json"],
    ["sdg robot home --robot 172.16.0.2 --workcell cell.toml", "sdg robot home --hand --robot 172.16.0.2"],
    ["sdg robot recover --robot 172.16.0.2", "sdg robot recover --robot 172.16.0.2 --yes"],
    ["sdg robot open --robot 172.16.0.2", "sdg robot open --robot 172.16.0.2 --width-mm 40"],
    ["sdg robot close --robot 172.16.0.2", "sdg robot close --robot 172.16.0.2 --force-n 40"],
    [
        "sdg augment --demo photo.png --count 40 --out samples",
        "sdg augment --held-back --demo photo.png --count 40 --out samples",
    ],
    [
        "sdg annotation convert photo.json photo.txt --image photo.png --format yolo-pose",
        "sdg annotation convert photo.txt photo.coco.json --image photo.png",
    ],
    [
        "sdg weights convert model_final.pkl base.safetensors",
        "sdg weights convert model_final.pkl base.safetensors --f16",
    ],
    ["sdg weights inspect model_final.pkl", "sdg weights inspect model.pth --json"],
    [
        "sdg weights verify model.pkl --config c.json --image i.png --against expected.safetensors",
        "sdg weights verify model.pkl --config c.json --image i.png --against expected.safetensors --json",
    ],
    ["sdg camera list", "sdg camera list --json"],
    ["sdg camera grab --from v4l: --out photo.png", "sdg camera grab --from v4l: --count 20 --every 2 --out frames"],
    ["sdg camera watch --from v4l:", "sdg camera watch --from v4l: --seconds 10"],
    ["sdg camera board --out board.svg --pdf board.pdf", "sdg camera board --paper a3 --squares 14x9 --out large.svg"],
    [
        "sdg camera calibrate --board board.svg --out camera.yaml a.png b.png c.png",
        "sdg camera calibrate --board board.svg --measured-mm 98.5 --from v4l: --out camera.yaml",
    ],
    [
        "sdg camera table table.png --camera camera.yaml --board board.svg",
        "sdg camera table table.png --camera camera.yaml --board board.svg --sheet-in-base-mm 400,-50",
    ],
    [
        "sdg camera hand-eye --camera camera.yaml --poses poses.yaml --mount hand --board board.svg",
        "sdg camera hand-eye --camera camera.yaml --poses poses.yaml --mount base --out camera.yaml",
    ],
    ["sdg completions bash", "sdg completions fish"],
    ["sdg man", "sdg man --out man1"],
    ["sdg devices", "sdg devices --json"],
];

/// Adds the exit codes, and the examples that exist, to the end of the help of the command and of all its
/// subcommands.
pub fn with_examples(command: Command) -> Command {
    with_ending(command, "")
}

fn with_ending(command: Command, parents: &str) -> Command {
    let path = format!("{parents}{}", command.get_name());
    let ending = match examples_of(&path) {
        Some([one, other]) => format!("Examples:\n  {one}\n  {other}\n\n{EXIT_CODES}"),
        None => EXIT_CODES.to_owned(),
    };
    let command = match command.get_after_long_help().map(ToString::to_string) {
        Some(own) => command.after_long_help(format!("{own}\n\n{ending}")),
        None => command,
    };
    let command = match command.get_after_help().map(ToString::to_string) {
        Some(own) => command.after_help(format!("{own}\n\n{ending}")),
        None => command.after_help(ending),
    };
    command.mut_subcommands(|command| with_ending(command, &format!("{path} ")))
}

/// The examples of the command with this path, such as `sdg camera grab`.
fn examples_of(path: &str) -> Option<&'static [&'static str; 2]> {
    let path: Vec<_> = path.split(' ').collect();
    EXAMPLES.iter().find(|examples| path.iter().copied().eq(examples[0].split(' ').take(path.len())) && path.len() > 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::Args;
    use clap::{CommandFactory, Parser};

    /// Longer lines are wrapped in the help and can then not be copied.
    const MAX_CHARS: usize = 98;

    fn verbs(command: &Command, parents: &str) -> Vec<String> {
        let path = format!("{parents}{}", command.get_name());
        let below: Vec<_> = command.get_subcommands().flat_map(|command| verbs(command, &format!("{path} "))).collect();
        if below.is_empty() { vec![path] } else { below }
    }

    #[test]
    fn every_verb_has_two_examples_that_parse() {
        for verb in verbs(&Args::command(), "") {
            let examples = examples_of(&verb).unwrap_or_else(|| panic!("no examples of {verb}"));
            for line in examples {
                assert!(line.starts_with(&verb), "{line}");
                assert!(line.len() <= MAX_CHARS, "{line}");
                let parsed = Args::try_parse_from(line.split(' '));
                assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
            }
        }
    }
}

//! The commands of the command line. The arguments and help of most commands are in their own files in `commands/`.

use clap::{Parser, Subcommand};

use crate::commands::annotate::AnnotateArgs;
use crate::commands::annotation::AnnotationArgs;
use crate::commands::augment::AugmentArgs;
use crate::commands::camera::CameraCommand;
use crate::commands::completions::CompletionsArgs;
use crate::commands::demo::DemoArgs;
use crate::commands::detect::DetectArgs;
use crate::commands::devices::DevicesArgs;
use crate::commands::evaluate::EvaluateArgs;
use crate::commands::grasp::GraspArgs;
use crate::commands::man::ManArgs;
use crate::commands::plan::PlanArgs;
use crate::commands::rehearse::RehearseArgs;
use crate::commands::robot::RobotCommand;
use crate::commands::teach::TeachArgs;
use crate::commands::weights::WeightsArgs;
use crate::commands::workcell::WorkcellCommand;

/// Teach a robot a grasp from one photo, on an ordinary computer.
#[derive(Debug, Parser)]
#[command(name = "sdg", version, propagate_version = true, arg_required_else_help = true)]
pub struct Args {
    /// The command to run.
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Teach a shipped object from one photo, then grasp it in simulation
    Demo(DemoArgs),
    /// Mark the grasp on photos in the browser, inspect training samples, teach a model and try it
    Annotate(AnnotateArgs),
    /// Teach a grasp model from demonstrations and write it to one file
    #[command(
        override_usage = "sdg teach [OPTIONS] --out <FILE> --demo <IMAGE[:ANNOTATION]>\n       sdg teach [OPTIONS] --out <FILE> --demos <DIR>"
    )]
    Teach(TeachArgs),
    /// Find planar grasps in images or live pictures
    #[command(
        override_usage = "sdg detect [OPTIONS] --grasp-model <FILE> <IMAGE|DIR|->...\n       sdg detect [OPTIONS] --grasp-model <FILE> --from <ADDRESS>"
    )]
    Detect(DetectArgs),
    /// Run grasp attempts in MuJoCo and report them
    Rehearse(RehearseArgs),
    /// Serve a simulated robot on the network to other programs
    #[cfg(feature = "simulation")]
    Simulate(crate::commands::simulate::SimulateArgs),
    /// A simulated robot; not in this build, which lacks cargo's feature "simulation"
    #[cfg(not(feature = "simulation"))]
    Simulate(NotBuiltArgs),
    /// Evaluate every model on every part by the paper's protocol, or test a model on your own labelled pictures
    Evaluate(Box<EvaluateArgs>),
    /// Grasp a part with a real or a simulated arm, from the picture to the lifted part
    Grasp(GraspArgs),
    /// Detect parts in the pictures of a ROS 2 topic and publish their grasps; teaching and grasping are services
    #[cfg(feature = "ros2")]
    Ros2(Box<crate::commands::ros2::args::Ros2Args>),
    /// A ROS 2 node; not in this build, which lacks cargo's feature "ros2"
    #[cfg(not(feature = "ros2"))]
    Ros2(NotBuiltArgs),
    /// Plan a motion around the obstacles of a workcell and draw it; nothing moves
    Plan(PlanArgs),
    /// Draw a workcell from above, with the area of the table that the arm reaches
    #[command(subcommand)]
    Workcell(WorkcellCommand),
    /// Show the state of a real arm, move it home, recover it after an error, open and close its hand
    #[command(subcommand)]
    Robot(RobotCommand),
    /// Write augmented samples as pictures and COCO JSON, for inspection
    Augment(AugmentArgs),
    /// Convert annotation files from one tool's format to another's
    Annotation(AnnotationArgs),
    /// Convert, inspect and verify Detectron2 and torchvision checkpoints
    Weights(WeightsArgs),
    /// List, calibrate and watch cameras, and save their frames
    #[command(subcommand)]
    Camera(CameraCommand),
    /// Print a completion script for your shell
    Completions(CompletionsArgs),
    /// Print or write manual pages
    Man(ManArgs),
    /// List the devices that this build and this machine can compute on
    Devices(DevicesArgs),
}

/// Accepts any arguments of a command that is not in this build; the command then fails with an error that says so.
#[cfg(not(all(feature = "ros2", feature = "simulation")))]
#[derive(Debug, clap::Args)]
pub struct NotBuiltArgs {
    /// Ignored.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    arguments: Vec<String>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_is_consistent() {
        Args::command().debug_assert();
    }

    #[test]
    fn documented_calls_parse() {
        for line in [
            "sdg demo",
            "sdg demo --json",
            "sdg annotate photo.png",
            "sdg annotate --from v4l: --size 1280x720 --exposure-ms 8",
            "sdg annotate --from dir:pictures?loop part.png --camera c.yaml --mark-height-mm 12",
            "sdg annotate a.png b.png:b.json --try table --out m.sdg --port 8080 --no-browser --json",
            "sdg teach --model C --demo a.png:a.json --demo b.png:b.json --out m.sdg --preset edge --symmetry full --seed 3 --time-budget 60 --report r",
            "sdg detect --grasp-model m.sdg --json --no-verify a.png b.png",
            "sdg detect --grasp-model m.sdg --device wgpu a.png",
            "sdg devices --json",
            "sdg detect --grasp-model m.sdg --min-score 0.3 folder -",
            "sdg teach --demo a.png --demo b.png:b.json --out m.sdg",
            "sdg rehearse --grasp-model m.sdg --object pendulum --attempts 20 --seed 2",
            "sdg rehearse --grasp-model m.sdg --height-mm 12 --length-mm 85 --mass-g 60 --friction 0.4",
            "sdg simulate --fci --lockstep --port 1400",
            "sdg augment --held-back --demo a.png --count 40 --out samples",
            "sdg evaluate",
            "sdg evaluate --models B,C --objects pendulum,rod_end --attempts 2 --seed 3 --out d --report r --json",
            "sdg evaluate --axes",
            "sdg evaluate --axes tilt,covered --axis-views 3 --models S --search-points 32 --against other --json",
            "sdg evaluate --list-units --json",
            "sdg evaluate --models S --out d --unit teach-S-pendulum look-pendulum",
            "sdg evaluate --out d --collect --json",
            "sdg evaluate --watch d --json",
            "sdg evaluate --submit slurm --cores 4 --memory-mb 2000 --limit-mins 30 --sbatch=--partition=cpu --yes",
            "sdg teach --model S --demos d --out o --part a --part b --json",
            "sdg evaluate --pictures d --grasp-model m.sdg",
            "sdg evaluate --pictures d --grasp-model m.sdg --no-verify --min-score 0.4 --label rod --device flex --report r --json",
            "sdg plan --workcell w.toml --start 0,-45,0,-135,0,90,45 --goal 500,-100,200,90",
            "sdg plan --workcell w.toml --goal 500,0,200 --goal -300,400,300,180,0,-90 --turns 4 --held-mm 30,100 --seed 2 --json --no-drawing",
            "sdg augment --demo a.png:a.json --count 5 --out samples",
            "sdg annotation convert photo.json photo.txt --image photo.png --format yolo-pose --json",
            "sdg completions bash",
            "sdg man --out pages",
            "sdg weights convert model.pkl model.safetensors --preset r50-detectron2 --f16 --reinit roi_heads --json",
            "sdg weights inspect model.pth --json",
            "sdg weights verify model.pkl --config c.json --image i.png --against expected.safetensors --json",
        ] {
            assert!(Args::try_parse_from(line.split(' ')).is_ok(), "{line}");
        }
        assert!(Args::try_parse_from(["sdg", "teach", "--demo", "a:b", "--out", "m", "--time-budget", "-1"]).is_err());
        assert!(Args::try_parse_from(["sdg", "teach", "--demo", "a:b", "--out", "m", "--symmetry", "0"]).is_err());
        for line in [
            "sdg evaluate --axis-views 3",
            "sdg evaluate --axes --collect",
            "sdg evaluate --list-units --collect",
            "sdg evaluate --watch d --unit teach-S-pendulum",
            "sdg evaluate --cores 4",
            "sdg teach --demos d --demo a --out o",
            "sdg teach --part a --demo a --out o",
            "sdg evaluate --pictures d",
            "sdg evaluate --grasp-model m.sdg",
            "sdg evaluate --no-verify",
            "sdg evaluate --device flex",
            "sdg evaluate --pictures d --grasp-model m.sdg --models S",
            "sdg evaluate --pictures d --grasp-model m.sdg --views 10",
            "sdg evaluate --pictures d --grasp-model m.sdg --min-score 1.1",
        ] {
            assert!(Args::try_parse_from(line.split(' ')).is_err(), "{line}");
        }
    }
}

//! The verbs. What each takes, with its help, stands in `commands/`, in the file of the verb.

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

/// Teach a robot a grasp from one photo, on an ordinary computer.
#[derive(Debug, Parser)]
#[command(name = "sdg", version, propagate_version = true, arg_required_else_help = true)]
pub struct Args {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// The main job on shipped input: teach one object from one photo, then grasp it in simulation
    Demo(DemoArgs),
    /// Mark the grasp on photos in the browser, see what will be learnt, teach and try
    Annotate(AnnotateArgs),
    /// Demonstrations to a grasp model in one file
    Teach(TeachArgs),
    /// Planar grasps in images
    Detect(DetectArgs),
    /// Grasp attempts in MuJoCo
    Rehearse(RehearseArgs),
    /// A simulated robot on the network, for programs of others
    #[cfg(feature = "simulation")]
    Simulate(crate::commands::simulate::SimulateArgs),
    /// The paper's protocol: every model on every part, and the paper's tables; or a model on your own labelled pictures
    Evaluate(EvaluateArgs),
    /// One grasp, from the picture to the lifted part, with a real arm or a simulated one
    Grasp(GraspArgs),
    /// A motion around the obstacles of a workcell, told and drawn; nothing moves
    Plan(PlanArgs),
    /// A real arm by hand: state, home, recovery, hand
    #[command(subcommand)]
    Robot(RobotCommand),
    /// Augmented samples as pictures and COCO JSON, to look at
    Augment(AugmentArgs),
    /// Annotation files from one tool's format to another's
    Annotation(AnnotationArgs),
    /// Detectron2 and torchvision checkpoints: convert, inspect, verify
    Weights(WeightsArgs),
    /// Cameras: calibrate them, and look through them
    #[command(subcommand)]
    Camera(CameraCommand),
    /// A completion script for your shell, on standard output
    Completions(CompletionsArgs),
    /// Manual pages
    Man(ManArgs),
    /// What this build and this machine can compute on
    Devices(DevicesArgs),
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
            "sdg augment --held-back --demo a.png --count 40 --out samples",
            "sdg evaluate",
            "sdg evaluate --models B,C --objects pendulum,rod_end --attempts 2 --seed 3 --out d --report r --json",
            "sdg evaluate --axes",
            "sdg evaluate --axes tilt,covered --axis-views 3 --models S --search-points 32 --against other --json",
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

//! The node's settings, read and checked before it joins ROS 2.

use std::sync::Arc;

use anyhow::Result;
use sdg_grasp::GraspError;
use sdg_inputs::camera_files::{self, CameraFile};
use sdg_inputs::{read_model, read_workcell};
use sdg_ros2::dds::Qos;
use sdg_ros2_node::{CameraPoseSource, GraspInputs, Settings};

use super::args::Ros2Args;
use super::teaching::{teach, trigger_job};
use crate::commands::devices;
use crate::exit::Usage;
use crate::interrupt::Interrupt;
use crate::robots;

/// Queue depth of the picture subscription.
const PICTURE_DEPTH: usize = 10;

/// Reads the files of the node.
///
/// # Errors
/// A file cannot be used; a table height is given without a base frame; a model without lengths is given or is to be
/// taught, although the node needs lengths.
pub(super) fn node_settings(args: &Ros2Args, interrupt: &Interrupt) -> Result<Settings> {
    check_trigger(args)?;
    let device = devices::open(&args.compute)?;
    let model = args.grasp_model.as_ref().map(|path| read_model(path, &device)).transpose()?;
    if args.table_height_mm.is_some() && args.base_frame.is_none() {
        return Err(Usage("--table-height-mm: expected --base-frame, the frame of this height".to_owned()).into());
    }
    let camera_pose = match (&args.base_frame, &args.camera) {
        (Some(base_frame), camera) => {
            let of_workcell = match &args.arm.workcell {
                Some(path) => Some(read_workcell(path)?.0.table_height_m),
                None => None,
            };
            let told_m = args.table_height_mm.map(|height_mm| height_mm * 1e-3);
            CameraPoseSource::Transforms {
                base_frame: base_frame.clone(),
                table_height_m: told_m.or(of_workcell).unwrap_or(0.0),
                intrinsics: camera.as_deref().map(CameraFile::read_intrinsics).transpose()?,
            }
        }
        // A camera on the hand has no fixed pose: only the grasp service gets poses from its pictures.
        (None, Some(path)) if args.arm.allow_motion => {
            CameraFile::read(path).map_or(CameraPoseSource::Unknown, |camera| CameraPoseSource::File(camera.over_table))
        }
        (None, Some(path)) => CameraPoseSource::File(CameraFile::read(path)?.over_table),
        (None, None) => CameraPoseSource::Unknown,
    };
    if let (Some(model), Some(path)) = (&model, &args.grasp_model)
        && needs_lengths(args)
        && model.facts().lengths.is_none()
    {
        return Err(anyhow::Error::new(GraspError::NoLengths).context(path.display().to_string()));
    }
    let (camera, interrupt, teach_device) = (args.camera.clone(), interrupt.clone(), device.clone());
    Ok(Settings {
        model,
        device,
        camera_pose,
        max_transform_age_secs: args.max_transform_age_secs,
        min_score: args.min_score,
        queue: args.queue as usize,
        is_compressed: args.ros.compressed,
        picture_qos: Qos { is_reliable: args.ros.reliable, depth: PICTURE_DEPTH, ..Qos::SENSORS },
        teach: Arc::new(move |job| teach(job, &teach_device, camera.as_deref(), &interrupt)),
        trigger_teaching: trigger_job(&args.teach),
    })
}

/// Whether the node uses only models with lengths: for poses of detections, or for grasps by the arm, also with a camera
/// on the hand, whose pictures have no poses.
fn needs_lengths(args: &Ros2Args) -> bool {
    args.camera.is_some() || args.base_frame.is_some() || args.arm.allow_motion
}

/// Checks that `~/teach_trigger` teaches a model with lengths if the node needs them.
fn check_trigger(args: &Ros2Args) -> Result<(), Usage> {
    if args.teach.teach_demo.is_some() && needs_lengths(args) && args.teach.teach_mark_height_mm.is_none() {
        let why = "a node with --camera, --base-frame or --allow-motion uses only models with lengths";
        return Err(Usage(format!("--teach-demo: expected --camera and --teach-mark-height-mm, because {why}")));
    }
    Ok(())
}

/// Reads and checks the workcell and the camera of the grasp service, and checks the speed.
///
/// # Errors
/// An option or a file is missing, a file cannot be used, or the speed is out of range.
pub(super) fn grasp_settings(args: &Ros2Args) -> Result<GraspInputs> {
    let needed = |option: &str| Usage(format!("--allow-motion: expected {option} FILE"));
    let workcell_path = args.arm.workcell.as_ref().ok_or_else(|| needed("--workcell"))?;
    let (workcell, camera_of_workcell) = read_workcell(workcell_path)?;
    robots::pace(args.arm.speed)?;
    let camera_path = args.camera.clone().or(camera_of_workcell).ok_or_else(|| needed("--camera"))?;
    let (calibrated, _) = camera_files::read(&camera_path)?;
    let camera = camera_files::mounted(&calibrated, &workcell, &camera_path)?;
    let base_frame = arm_base_frame(args);
    let told = args.arm.height.told(workcell.table_height_m);
    Ok(GraspInputs { workcell, camera, told, speed: args.arm.speed, base_frame })
}

/// The frame of the poses in responses of the grasp service: by default, the arm's base link.
fn arm_base_frame(args: &Ros2Args) -> String {
    args.base_frame.clone().unwrap_or_else(|| format!("{}link0", args.arm.joint_prefix))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use clap::Parser;
    use sdg_ros2_node::TeachJob;

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        ros2: Ros2Args,
    }

    fn parsed(line: &str) -> Result<Ros2Args, clap::Error> {
        Line::try_parse_from(line.split(' ')).map(|line| line.ros2)
    }

    #[test]
    fn the_base_frame_has_the_prefix_of_the_joints() {
        for (line, expected) in [
            ("ros2", "panda_link0"),
            ("ros2 --joint-prefix fr3_", "fr3_link0"),
            ("ros2 --joint-prefix fr3_ --base-frame base", "base"),
        ] {
            assert_eq!(arm_base_frame(&parsed(line).unwrap()), expected);
        }
    }

    #[test]
    fn the_trigger_of_a_node_that_needs_lengths_has_a_height_of_marks() {
        let teach = "ros2 --teach-demo part.png --teach-out part.sdg";
        for needs in ["--camera camera.yaml", "--base-frame panda_link0"] {
            let error = check_trigger(&parsed(&format!("{teach} {needs}")).unwrap()).unwrap_err().to_string();
            assert!(error.contains("--teach-mark-height-mm"), "{error}");
        }
        for line in [teach.to_owned(), format!("{teach} --camera camera.yaml --teach-mark-height-mm 16")] {
            check_trigger(&parsed(&line).unwrap()).unwrap();
        }
        assert!(parsed(&format!("{teach} --teach-mark-height-mm 16")).is_err(), "the height needs a camera");
    }

    #[test]
    fn a_node_with_a_camera_on_the_hand_rejects_a_model_without_lengths() {
        let folder = tempfile::tempdir().unwrap();
        let shipped = |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets").join(name);
        let job = TeachJob {
            photo: shipped("demonstrations/pendulum/image.png").display().to_string(),
            marks: Some(shipped("demonstrations/pendulum/annotation.json")),
            out: folder.path().join("part.sdg"),
            model: "S".to_owned(),
            seed: TeachJob::DEFAULT_SEED,
            time_budget: None,
            mark_height_mm: None,
            is_used: true,
        };
        let with_model = |line: &str| Ros2Args { grasp_model: Some(job.out.clone()), ..parsed(line).unwrap() };
        let (without_poses, interrupt) = (with_model("ros2"), Interrupt::default());
        teach(&job, &devices::open(&without_poses.compute).unwrap(), None, &interrupt).unwrap();
        assert!(node_settings(&without_poses, &interrupt).is_ok());

        // A camera on the hand has no fixed pose above the table.
        let camera = std::fs::read_to_string(shipped("workcell/camera.yaml")).unwrap();
        let on_hand = folder.path().join("camera.yaml");
        std::fs::write(&on_hand, camera.split("\ntable:").next().unwrap()).unwrap();
        let grasping = with_model("ros2 --allow-motion --workcell cell.toml --camera camera.yaml");
        let grasping = Ros2Args { camera: Some(on_hand), ..grasping };
        let error = node_settings(&grasping, &interrupt).err().unwrap();
        assert!(matches!(error.downcast_ref(), Some(GraspError::NoLengths)), "{error:#}");
    }
}

//! The node's settings, read and checked before it joins ROS 2.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Result;
use sdg_geometry::Mount;
use sdg_grasp::GraspError;
use sdg_inputs::camera_files::{self, CameraFile};
use sdg_inputs::{read_model, read_workcell};
use sdg_robot::workcell::Workcell;
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

/// The files of the node's cell.
pub(super) struct CellFiles {
    /// The workcell.
    pub(super) workcell: Option<Workcell>,
    /// The path of the camera file.
    pub(super) camera: Option<PathBuf>,
}

impl CellFiles {
    /// Reads the workcell file, which also names the camera file if the arm may move and no other one is given.
    ///
    /// # Errors
    /// The workcell file cannot be used, or a node whose arm may move has no camera file.
    pub(super) fn read(args: &Ros2Args) -> Result<Self> {
        let camera = args.camera.clone();
        let Some(path) = &args.arm.workcell else { return Ok(Self { workcell: None, camera }) };
        let (workcell, camera_of_workcell) = read_workcell(path)?;
        let camera = match args.arm.allow_motion {
            true => Some(robots::camera_file(camera.as_deref(), camera_of_workcell, path)?),
            false => camera,
        };
        Ok(Self { workcell: Some(workcell), camera })
    }

    /// Whether the arm may move, and the camera with it.
    fn is_camera_moved(&self, args: &Ros2Args) -> bool {
        args.arm.allow_motion && self.workcell.as_ref().is_some_and(|workcell| workcell.mount == Mount::Hand)
    }
}

/// Reads the other files of the node.
///
/// # Errors
/// A file cannot be used; a height is given without the option that uses it; a model without lengths is given or is to
/// be taught, although the node needs lengths.
pub(super) fn node_settings(args: &Ros2Args, files: &CellFiles, interrupt: &Interrupt) -> Result<Settings> {
    check_trigger(args)?;
    check_told_height(args)?;
    let device = devices::open(&args.compute)?;
    let model = args.grasp_model.as_ref().map(|path| read_model(path, &device)).transpose()?;
    if args.table_height_mm.is_some() && args.base_frame.is_none() {
        return Err(Usage("--table-height-mm: expected --base-frame, the frame of this height".to_owned()).into());
    }
    let camera_pose = match (&args.base_frame, &files.camera) {
        (Some(base_frame), camera) => {
            let of_workcell = files.workcell.as_ref().map(|workcell| workcell.table_height_m);
            let told_m = args.table_height_mm.map(|height_mm| height_mm * 1e-3);
            CameraPoseSource::Transforms {
                base_frame: base_frame.clone(),
                table_height_m: told_m.or(of_workcell).unwrap_or(0.0),
                intrinsics: camera.as_deref().map(CameraFile::read_intrinsics).transpose()?,
            }
        }
        // A camera on the hand has no fixed pose, even if its file has one, such as that of the taught photos: only the
        // grasp service gets poses from its pictures.
        (None, Some(_)) if files.is_camera_moved(args) => CameraPoseSource::Unknown,
        (None, Some(path)) => CameraPoseSource::File(CameraFile::read(path)?.over_table),
        (None, None) => CameraPoseSource::Unknown,
    };
    if let (Some(model), Some(path)) = (&model, &args.grasp_model)
        && needs_lengths(args)
        && model.facts().lengths.is_none()
    {
        return Err(anyhow::Error::new(GraspError::NoLengths).context(path.display().to_string()));
    }
    let (camera, interrupt, teach_device) = (files.camera.clone(), interrupt.clone(), device.clone());
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

/// Checks that a given height of marks is used, which only grasps do.
fn check_told_height(args: &Ros2Args) -> Result<(), Usage> {
    match (args.arm.height.mark_height_mm, args.arm.allow_motion) {
        (Some(_), false) => Err(Usage("--mark-height-mm: expected --allow-motion, found none".to_owned())),
        _ => Ok(()),
    }
}

/// Reads and checks the camera of the grasp service, and checks the speed.
///
/// # Errors
/// The camera file cannot be used, or the speed is out of range.
pub(super) fn grasp_settings(args: &Ros2Args, workcell: &Workcell, camera: &Path) -> Result<GraspInputs> {
    robots::pace(args.arm.speed)?;
    let (calibrated, _) = camera_files::read(camera)?;
    let camera = camera_files::mounted(&calibrated, workcell, camera)?;
    let base_frame = arm_base_frame(args);
    let told = args.arm.height.told(workcell.table_height_m);
    Ok(GraspInputs { workcell: workcell.clone(), camera, told, speed: args.arm.speed, base_frame })
}

/// The frame of the poses in responses of the grasp service: by default, the arm's base link.
fn arm_base_frame(args: &Ros2Args) -> String {
    args.base_frame.clone().unwrap_or_else(|| format!("{}link0", args.arm.joint_prefix))
}

#[cfg(test)]
mod tests {
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

    fn shipped(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../datasets").join(name)
    }

    /// A node that moves the arm of the shipped workcell, whose camera is on the hand.
    fn moving() -> Ros2Args {
        let mut args = parsed("ros2 --allow-motion --workcell cell.toml").unwrap();
        args.arm.workcell = Some(shipped("workcell/workcell.toml"));
        args
    }

    #[test]
    fn a_camera_on_the_hand_has_no_fixed_pose_even_if_its_file_has_one() {
        let args = moving();
        let files = CellFiles::read(&args).unwrap();
        let camera = shipped("workcell/camera.yaml");
        assert_eq!(files.camera.as_ref(), Some(&camera), "the file named in the workcell file");
        CameraFile::read(&camera).unwrap();
        let source = |files: &CellFiles| node_settings(&args, files, &Interrupt::default()).unwrap().camera_pose;
        assert!(matches!(source(&files), CameraPoseSource::Unknown));
        let workcell = files.workcell.map(|workcell| Workcell { mount: Mount::Base, ..workcell });
        assert!(matches!(source(&CellFiles { workcell, camera: files.camera }), CameraPoseSource::File(_)));
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
    fn options_of_grasps_need_the_permission_to_move() {
        let moving = "ros2 --allow-motion --workcell cell.toml";
        assert!(parsed("ros2 --speed 0.2").is_err());
        assert_eq!(parsed(&format!("{moving} --speed 0.2")).unwrap().arm.speed, 0.2);
        let error = check_told_height(&parsed("ros2 --mark-height-mm 16").unwrap()).unwrap_err().to_string();
        assert!(error.starts_with("--mark-height-mm: expected --allow-motion"), "{error}");
        for line in ["ros2".to_owned(), format!("{moving} --mark-height-mm 16")] {
            check_told_height(&parsed(&line).unwrap()).unwrap();
        }
    }

    #[test]
    fn a_node_with_a_camera_on_the_hand_rejects_a_model_without_lengths() {
        let folder = tempfile::tempdir().unwrap();
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
        let with_model = |args: Ros2Args| Ros2Args { grasp_model: Some(job.out.clone()), ..args };
        let (without_poses, interrupt) = (with_model(parsed("ros2").unwrap()), Interrupt::default());
        let settings = |args: &Ros2Args| node_settings(args, &CellFiles::read(args).unwrap(), &interrupt);
        teach(&job, &devices::open(&without_poses.compute).unwrap(), None, &interrupt).unwrap();
        assert!(settings(&without_poses).is_ok());
        let error = settings(&with_model(moving())).err().unwrap();
        assert!(matches!(error.downcast_ref(), Some(GraspError::NoLengths)), "{error:#}");
    }
}

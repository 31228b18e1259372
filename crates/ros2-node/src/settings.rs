//! What the node works with, read and checked before it joins.

use std::path::PathBuf;

use anyhow::Result;
use sdg_grasp::{Device, GraspModel};
use sdg_inputs::camera_files::CameraFile;
use sdg_ros2::dds::Qos;

use super::place::PlaceSource;
use super::teaching::TriggerTeaching;
use crate::commands::devices;
use crate::commands::ros2::args::Ros2Args;
use crate::exit::Usage;
use crate::robots;

/// Pictures that the network keeps for the node.
const PICTURE_DEPTH: usize = 10;

/// A node's settings.
pub(crate) struct Settings {
    pub(super) model: Option<GraspModel>,
    pub(super) device: Device,
    pub(super) place: PlaceSource,
    pub(super) max_transform_age_secs: f64,
    pub(super) min_score: f64,
    pub(super) queue: usize,
    pub(super) is_compressed: bool,
    pub(super) picture_qos: Qos,
    pub(super) trigger_teaching: Option<TriggerTeaching>,
    pub(super) camera_file: Option<PathBuf>,
}

impl Settings {
    /// Reads the files.
    ///
    /// # Errors
    /// A file that cannot be used; a model without lengths where there is a camera.
    pub(crate) fn read(args: &Ros2Args) -> Result<Self> {
        let device = devices::open(&args.compute)?;
        let model = args.grasp_model.as_ref().map(|path| sdg_inputs::read_model(path, &device)).transpose()?;
        if args.table_height_mm.is_some() && args.base_frame.is_none() {
            return Err(Usage("--table-height-mm: expected --base-frame, in which it is".to_owned()).into());
        }
        let place = match (&args.base_frame, &args.camera) {
            (Some(base_frame), camera) => {
                let of_workcell = match &args.arm.workcell {
                    Some(path) => Some(robots::read_workcell(path)?.0.table_height_m),
                    None => None,
                };
                let told_m = args.table_height_mm.map(|height_mm| height_mm * 1e-3);
                PlaceSource::Transforms {
                    base_frame: base_frame.clone(),
                    table_height_m: told_m.or(of_workcell).unwrap_or(0.0),
                    intrinsics: camera.as_deref().map(CameraFile::read_intrinsics).transpose()?,
                }
            }
            // A camera on the hand has no place of its own: its pictures are searched for the grasp alone.
            (None, Some(path)) if args.arm.allow_motion => {
                CameraFile::read(path).map_or(PlaceSource::Unknown, |camera| PlaceSource::File(camera.over_table))
            }
            (None, Some(path)) => PlaceSource::File(CameraFile::read(path)?.over_table),
            (None, None) => PlaceSource::Unknown,
        };
        if let (Some(model), false, Some(path)) =
            (&model, matches!(place, PlaceSource::Unknown), args.grasp_model.as_ref())
            && model.facts().lengths.is_none()
        {
            let error = sdg_grasp::GraspError::NoLengths;
            return Err(anyhow::Error::new(error).context(path.display().to_string()));
        }
        Ok(Self {
            model,
            device,
            place,
            max_transform_age_secs: args.max_transform_age_secs,
            min_score: args.min_score,
            queue: args.queue as usize,
            is_compressed: args.ros.compressed,
            picture_qos: Qos { is_reliable: args.ros.reliable, depth: PICTURE_DEPTH, ..Qos::SENSORS },
            trigger_teaching: TriggerTeaching::new(&args.teach),
            camera_file: args.camera.clone(),
        })
    }
}

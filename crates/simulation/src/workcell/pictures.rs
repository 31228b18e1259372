//! The workcell's pictures by its own camera and by an outside camera, at one instant or over time.

use image::RgbImage;
use nalgebra::Isometry3;
use sdg_geometry::PosedCamera;
use sdg_kinematics::{IkOptions, ready_pose};

use super::Workcell;
use crate::camera::CameraView;
use crate::controller::ArmReference;
use crate::error::{Result, SimulationError};
use crate::lens::Frustum;
use crate::record::{RecordConfig, Recorder};
use crate::render::{RenderConfig, Renderer, Segmentation};

impl Workcell {
    /// The present picture of the wrist camera, or of the camera beside the robot if the configuration has one.
    ///
    /// # Errors
    /// As for [`crate::Data::forward`] and [`Renderer::image`]; [`SimulationError::Configuration`] for a lens whose
    /// model does not cover the corners of its own picture.
    pub fn wrist_view(&mut self) -> Result<CameraView> {
        // After a step, body positions are one period behind the joints.
        self.data.forward()?;
        let drawn = CameraView::capture(&mut self.wrist_renderer, &mut self.data, self.camera)?;
        match self.config.wrist_camera {
            None => Ok(drawn),
            Some(intrinsics) => Ok(CameraView {
                image: Frustum::around(&intrinsics)?.resample(&drawn.image, &intrinsics),
                camera: PosedCamera { intrinsics, ..drawn.camera },
            }),
        }
    }

    /// The geom at each pixel of the rendered picture of [`Self::wrist_view`], before the lens is applied.
    ///
    /// # Errors
    /// As for [`Renderer::segmentation`].
    pub fn wrist_segmentation(&mut self) -> Result<Segmentation> {
        self.wrist_renderer.segmentation(&mut self.data, self.camera)
    }

    /// Sets the arm to a configuration in which its wrist camera is at a pose, without advancing time, and takes a
    /// picture. Used for demonstrations and test images.
    ///
    /// # Errors
    /// [`SimulationError::Configuration`] for a pose that the arm cannot reach; and the errors of [`Self::wrist_view`].
    pub fn view_from(&mut self, base_from_camera: &Isometry3<f64>) -> Result<CameraView> {
        self.reach_camera_pose(base_from_camera)?;
        self.wrist_view()
    }

    /// As [`Workcell::view_from`], without the picture.
    pub(crate) fn reach_camera_pose(&mut self, base_from_camera: &Isometry3<f64>) -> Result<()> {
        let base_from_tcp = self.base_from_tcp_for_camera(base_from_camera);
        let solution = self.panda.inverse(&base_from_tcp, &ready_pose(), &IkOptions::default()).map_err(|error| {
            SimulationError::Configuration {
                field: "base_from_camera",
                expected: "a pose within the arm's reach".into(),
                found: error.to_string(),
            }
        })?;
        self.panda_ids.set_position(&mut self.data, &solution.q);
        self.reference = ArmReference::at_rest(solution.q);
        self.data.forward()
    }

    /// A picture of the whole workcell by the outside camera, in its present state.
    ///
    /// # Errors
    /// As for [`Renderer::new`] and [`Renderer::image`].
    pub fn scene_image(&mut self, render: RenderConfig) -> Result<RgbImage> {
        let mut renderer = Renderer::new(self.data.model(), render)?;
        renderer.image(&mut self.data, self.scene_camera)
    }

    /// A picture of the whole workcell by the outside camera with the arm in another configuration and the fingers at
    /// an opening (m), for showing plans.
    ///
    /// # Errors
    /// As for [`crate::Data::forward`] and [`Renderer::image`].
    pub fn scene_image_at(
        &mut self,
        renderer: &mut Renderer,
        q: &sdg_kinematics::JointVector,
        opening_m: f64,
    ) -> Result<RgbImage> {
        self.panda_ids.set_position(&mut self.data, q);
        self.panda_ids.set_finger_position_m(&mut self.data, 0.5 * opening_m);
        self.data.forward()?;
        renderer.image(&mut self.data, self.scene_camera)
    }

    /// Starts to record pictures of the outside camera over time.
    ///
    /// # Errors
    /// As for [`Renderer::new`].
    pub fn start_recording(&mut self, config: &RecordConfig) -> Result<()> {
        self.recorder = Some(Recorder::new(self.data.model(), self.scene_camera, config)?);
        Ok(())
    }

    /// Ends the recording and returns its pictures.
    pub fn stop_recording(&mut self) -> Vec<RgbImage> {
        self.recorder.take().map(Recorder::into_frames).unwrap_or_default()
    }
}

//! The fixed pose of a camera.

use nalgebra::Isometry3;
use sdg_kinematics::ArmGeometry;

/// The fixed pose of a camera (optical frame); lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CameraPose {
    /// On the hand: `flange_from_camera`.
    OnFlange(Isometry3<f64>),
    /// Beside the robot: `base_from_camera`.
    InBase(Isometry3<f64>),
}

impl CameraPose {
    /// `tcp_from_camera` of a camera on the hand.
    pub(crate) fn tcp_from_camera(&self, arm: &ArmGeometry) -> Option<Isometry3<f64>> {
        match self {
            Self::OnFlange(flange_from_camera) => Some(arm.flange_from_tcp().inverse() * flange_from_camera),
            Self::InBase(_) => None,
        }
    }

    /// The pose of the tcp at which the camera has the pose `base_from_camera`; for a camera beside the robot,
    /// `base_from_camera` itself.
    pub(crate) fn base_from_tcp(&self, arm: &ArmGeometry, base_from_camera: &Isometry3<f64>) -> Isometry3<f64> {
        let tcp_from_camera = self.tcp_from_camera(arm);
        tcp_from_camera.map_or(*base_from_camera, |tcp_from_camera| base_from_camera * tcp_from_camera.inverse())
    }
}

//! The simulated workcell's camera, for the finder that real arms have.

use sdg_cell::{CameraPose, Pictures, PlacedCamera, TakenPicture};
use sdg_simulation::{CameraPlace, Workcell};

/// The camera of the simulated workcell.
pub struct SimulatedPictures;

impl Pictures<Workcell> for SimulatedPictures {
    fn take(&mut self, cell: &mut Workcell) -> sdg_robot::Result<TakenPicture> {
        Ok(TakenPicture { picture: cell.wrist_view()?.image, taken: None })
    }
}

/// Where the simulator puts a camera.
pub fn camera_place(camera: &PlacedCamera) -> CameraPlace {
    match camera.pose {
        CameraPose::OnFlange(flange_from_camera) => CameraPlace::OnFlange(flange_from_camera),
        CameraPose::InBase(base_from_camera) => CameraPlace::InBase(base_from_camera),
    }
}

//! Results as JSON, as printed by `sdg camera` (docs/command-line.md).

use nalgebra::Isometry3;
use sdg_geometry::Mount;
use serde_json::{Value, json};

use crate::hand_eye::HandEye;
use crate::intrinsics::Calibration;

/// A pose in the format of camera files and files of robot poses.
pub fn pose_json(pose: &Isometry3<f64>) -> Value {
    let translation: [f64; 3] = pose.translation.vector.into();
    let rotation: [f64; 4] = pose.rotation.coords.into();
    json!({"translation_m": translation, "rotation_xyzw": rotation})
}

impl Calibration {
    /// The intrinsics with their errors, and the advice; not the results of single pictures.
    pub fn to_json(&self) -> Value {
        let by_name = |values: &[f64]| {
            Self::NAMES.into_iter().map(str::to_owned).zip(values.iter().map(|v| json!(v))).collect::<Value>()
        };
        json!({
            "width": self.camera.width, "height": self.camera.height,
            "intrinsics": by_name(&self.values()), "sigma": by_name(&self.sigma), "rms_px": self.rms_px,
            "advice": self.advice.iter().map(ToString::to_string).collect::<Vec<_>>(),
        })
    }
}

impl HandEye {
    /// The names of the frames of [`Self::frame_from_camera`] and [`Self::frame_from_board`].
    pub fn frame_names(mount: Mount) -> [&'static str; 2] {
        match mount {
            Mount::Hand => ["flange", "base"],
            Mount::Base => ["base", "flange"],
        }
    }

    /// The poses with their errors; not the results of single pictures.
    pub fn to_json(&self, mount: Mount) -> Value {
        let [frame, board_frame] = Self::frame_names(mount);
        let [spread_m, spread_rad] = self.max_spread();
        let robot =
            self.robot_sigma.map(|[metres, radians]| json!({"mm": 1000.0 * metres, "deg": radians.to_degrees()}));
        json!({
            (format!("{frame}_from_camera")): pose_json(&self.frame_from_camera),
            (format!("{board_frame}_from_board")): pose_json(&self.frame_from_board),
            "sigma_mm": 1000.0 * self.sigma_m, "sigma_deg": self.sigma_rad.to_degrees(), "rms_px": self.rms_px,
            "board_rms_px": self.board_rms_px, "robot_sigma": robot,
            "spread_mm": 1000.0 * spread_m, "spread_deg": spread_rad.to_degrees(),
        })
    }
}

//! What can be wrong with a camera file.

/// Why a camera file cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraFileError {
    /// Not YAML, or not with the names that ROS gives.
    #[error("expected a camera file as ROS's camera_calibration writes it, found: {found}")]
    Unreadable {
        /// What the parser says.
        found: String,
    },
    /// A lens model other than `plumb_bob`.
    #[error(
        "expected distortion_model plumb_bob with 4 or 5 coefficients, found {found} with {coefficients}; calibrate again with that \
         model (in OpenCV: without CALIB_RATIONAL_MODEL and not as fisheye)"
    )]
    Lens {
        /// The model's name.
        found: String,
        /// How many coefficients it has.
        coefficients: usize,
    },
    /// A camera matrix that is none.
    #[error(
        "expected a camera matrix [fx, 0, cx, 0, fy, cy, 0, 0, 1] with a positive focal length and its centre in the picture, \
         found {found:?} for {width} × {height} pixels"
    )]
    Matrix {
        /// The matrix, row by row.
        found: Vec<f64>,
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// A pose that is none.
    #[error("expected table.frame_from_camera.{name} to be {expected}, found {found:?}")]
    Pose {
        /// The field.
        name: &'static str,
        /// What it must be.
        expected: &'static str,
        /// What it is.
        found: Vec<f64>,
    },
    /// The file has intrinsics alone.
    #[error("expected the camera's pose over the table (`table:`), found none; `sdg camera table` measures it")]
    NoPose,
    /// A camera that hangs where none does.
    #[error("expected the camera 0.05 to 20 m above the table, found {height:.2} m{hint}")]
    Height {
        /// Metres over the table.
        height: f64,
        /// What may be wrong.
        hint: &'static str,
    },
    /// A picture of another camera.
    #[error(
        "expected pictures of {width} × {height} pixels, as the camera was calibrated, found {found_width} × {found_height}"
    )]
    OtherSize {
        /// Pixels in a row of the calibrated camera.
        width: u32,
        /// Its rows.
        height: u32,
        /// Pixels in a row of the picture.
        found_width: u32,
        /// Its rows.
        found_height: u32,
    },
    /// A workspace without extent.
    #[error("expected table.workspace_m with each range from low to high, found x {x:?}, y {y:?}")]
    Workspace {
        /// Range of x.
        x: [f64; 2],
        /// Range of y.
        y: [f64; 2],
    },
}

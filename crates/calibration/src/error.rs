//! Errors of a camera file.

/// The reason why a camera file cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum CameraFileError {
    /// Not YAML, or not with ROS's names.
    #[error("expected a camera file as ROS's camera_calibration writes it, found: {found}")]
    Unreadable { found: String },
    /// A lens model other than `plumb_bob`.
    #[error(
        "expected distortion_model plumb_bob with 4 or 5 coefficients, found {found} with {coefficients}; calibrate again with that \
         model (in OpenCV: without CALIB_RATIONAL_MODEL and not as fisheye)"
    )]
    Lens {
        found: String,
        /// Number of its coefficients.
        coefficients: usize,
    },
    /// Another line of the file that names a lens of another kind than `distortion_model`.
    #[error(
        "expected a pinhole camera with distortion_model plumb_bob, found {key}: {found}; calibrate again with that model (in OpenCV: not as \
         fisheye)"
    )]
    OtherModel { key: &'static str, found: String },
    /// NaN or an infinity.
    #[error("expected finite distortion_coefficients, found {found:?}")]
    Coefficients { found: Vec<f64> },
    /// A polynomial that turns back within the picture: two points of the world would have one pixel.
    #[error(
        "expected distortion_coefficients under which every pixel shows one place, found {found:?}, which fold the picture at ({x:.0}, {y:.0}); \
         calibrate again with the board held into the corners, too"
    )]
    Folds { found: Vec<f64>, x: f64, y: f64 },
    /// An invalid camera matrix.
    #[error(
        "expected a camera matrix [fx, 0, cx, 0, fy, cy, 0, 0, 1] with a positive focal length and its centre in the picture, \
         found {found:?} for {width} × {height} pixels"
    )]
    Matrix {
        /// The matrix, row by row.
        found: Vec<f64>,
        width: u32,
        height: u32,
    },
    /// A pose that is not a rigid transform.
    #[error("expected {name} to be {expected}, found {found:?}")]
    Pose { name: String, expected: &'static str, found: Vec<f64> },
    /// The file has only intrinsics.
    #[error("expected the camera's pose over the table (`table:`), found none; `sdg camera table` measures it")]
    NoPose,
    /// A camera at an impossible height.
    #[error("expected the camera 0.05 to 20 m above the table, found {height:.2} m{hint}")]
    Height { height: f64, hint: &'static str },
    /// A picture of another camera.
    #[error(
        "expected pictures of {width} × {height} pixels, as the camera was calibrated, found {found_width} × {found_height}"
    )]
    OtherSize {
        /// Pixels in a row of the calibrated camera.
        width: u32,
        height: u32,
        /// Pixels in a row of the picture.
        found_width: u32,
        found_height: u32,
    },
    /// An existing file without ROS's layout.
    #[error(
        "expected the existing camera file to have each field on lines of its own, as ROS's camera_calibration writes it; write another file"
    )]
    NotUpdatable,
    /// A workspace without extent.
    #[error("expected table.workspace_m with each range from low to high, found x {x:?}, y {y:?}")]
    Workspace { x: [f64; 2], y: [f64; 2] },
}

/// The reason why a board, a calibration or a pose cannot be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum CalibrationError {
    /// A number of squares outside the supported range.
    #[error("expected {least} to {most} squares along each side of the board, found {columns} x {rows}")]
    BoardSize { columns: u32, rows: u32, least: u32, most: u32 },
    /// A size of squares outside the supported range.
    #[error("expected squares of 0.5 to 500 mm, found {} mm", 1000.0 * .found_m)]
    SquareSize { found_m: f64 },
    /// An impossible reading of the ruler.
    #[error(
        "expected the printed 100 mm line to measure 90 to 110 mm, found {measured_mm} mm: measure the line below the board, in millimetres"
    )]
    Ruler { measured_mm: f64 },
    /// A board that is larger than the paper.
    #[error(
        "expected {columns} x {rows} squares that fit on {paper}: at most {fits_mm:.1} mm each, found {square_mm:.1} mm"
    )]
    Paper { paper: &'static str, columns: u32, rows: u32, square_mm: f64, fits_mm: f64 },
    /// A file that `sdg camera board` did not write.
    #[error("expected a board as `sdg camera board` writes it, found a file without the size of its squares")]
    NoBoardFile,
    /// No grid of corners in the picture.
    #[error(
        "expected the board, found {}: it may be seen edge-on, cut off, covered, dark or out of focus",
        if *.corners == 0 { "no corners of squares in a grid".to_owned() } else { format!("at most {columns} x {rows} corners of squares in a grid") }
    )]
    BoardNotFound {
        /// Corners in the largest grid.
        corners: usize,
        /// Its extent along one axis.
        columns: usize,
        /// Its extent along the other.
        rows: usize,
    },
    /// A grid of corners whose placement on the board is unknown.
    #[error(
        "expected enough of the board to identify the visible squares, found {corners} corners and no place on the \
         board that matches its dots: show more of it, or print it with `sdg camera board`; a checkerboard without \
         dots must be seen whole"
    )]
    BoardUnclear { corners: usize },
    /// A checkerboard without dots that has other squares, or is not completely visible.
    #[error(
        "expected a checkerboard of {columns} x {rows} squares, found one of {found_columns} x {found_rows}: it has other \
         squares, or is not seen whole"
    )]
    OtherCheckerboard { columns: u32, rows: u32, found_columns: u32, found_rows: u32 },
    /// The board has more squares than expected.
    #[error("expected a board of {columns} x {rows} squares, found one of at least {found_columns} x {found_rows}")]
    OtherBoard {
        /// Squares along x, as expected.
        columns: u32,
        /// Squares along y, as expected.
        rows: u32,
        /// Squares along x, at least.
        found_columns: u32,
        /// Squares along y, at least.
        found_rows: u32,
    },
    /// Fewer pictures than a calibration needs.
    #[error("expected at least {least} pictures that show the board, found {found}{}", .hint)]
    TooFewPictures {
        /// The smallest sufficient number.
        least: usize,
        found: usize,
        /// A further hint, or empty.
        hint: &'static str,
    },
    /// Pictures that do not determine the focal length.
    #[error(
        "expected pictures that show the board tilted in several directions, found {found}: their poses are similar \
         and do not determine the focal length{}; tilt the board by 20 to 40 degrees to the left, to the right, \
         upwards and downwards", .hint
    )]
    PosesAlike {
        found: String,
        /// The focal length's error, or empty.
        hint: String,
    },
    /// Corners that no pose explains.
    #[error("expected corners that a pinhole camera can show of a flat board, found none that converge")]
    NoPose,
    /// A camera below the sheet, or at its horizon.
    #[error(
        "expected a camera that looks down at the sheet, found it {tilt_deg:.1} degrees from straight above: beyond {max_deg} degrees the table's \
         horizon is near"
    )]
    Horizon {
        /// The angle between the optical axis and the sheet's normal.
        tilt_deg: f64,
        max_deg: f64,
    },
    /// Robot poses that cannot be read.
    #[error("expected robot poses as documented in docs/calibration.md, found: {found}")]
    PosesUnreadable { found: String },
    /// A robot pose that is not a rigid transform.
    #[error("expected base_from_flange.{name} of {picture} to be {expected}, found {found:?}")]
    RobotPose { picture: String, name: &'static str, expected: &'static str, found: Vec<f64> },
    /// Robot poses that do not determine the transform.
    #[error(
        "expected robot poses that turn the flange about two axes, found {found}: add poses turned by 20 to 40 degrees about {missing}"
    )]
    TurnsAlike { found: String, missing: String },
    /// Robot poses and pictures that do not match.
    #[error("expected robot poses and pictures that agree, found {found}{hint}")]
    HandEyeDisagrees {
        /// Their difference.
        found: String,
        hint: String,
        /// Whether the hint is that the camera is mounted at the other place than given.
        is_other_mount: bool,
    },
    /// One or two robot poses that do not match their pictures, among others that do.
    #[error(
        "expected robot poses and pictures that agree, found {found}: {}", wrong_poses(.names, *.are_exchanged, *.left_px)
    )]
    WrongPoses {
        /// The difference of all.
        found: String,
        /// Indices of the pictures among the given ones, from 0.
        pictures: Vec<usize>,
        /// The pictures' names, in the same order: their numbers from 1 before [`Self::with_picture_names`].
        names: Vec<String>,
        /// Whether each of two has the other's pose.
        are_exchanged: bool,
        /// Reprojection error without them, or with both exchanged.
        left_px: f64,
    },
    /// A board of another size than given.
    #[error(
        "expected a board of the given size, found squares of {:.2} ± {:.2} mm instead of {:.2} mm: by the robot's \
         metres the board seems {:.1} % of that size, which leaves {left_px:.2} px; measure the 100 mm line below the \
         board, or its squares, and give the measured size",
        1000.0 * .told_m * .scale, 1000.0 * .told_m * .sigma, 1000.0 * .told_m, 100.0 * .scale
    )]
    OtherBoardScale {
        /// The given side of a square, metres.
        told_m: f64,
        /// The size as a multiple of the given one, and its standard error.
        scale: f64,
        sigma: f64,
        left_px: f64,
    },
}

impl CalibrationError {
    /// The same with the names of the pictures, which the caller knows, instead of their numbers.
    #[must_use]
    pub fn with_picture_names(mut self, name: impl Fn(usize) -> String) -> Self {
        if let Self::WrongPoses { pictures, names, .. } = &mut self {
            *names = pictures.iter().map(|picture| name(*picture)).collect();
        }
        self
    }
}

fn wrong_poses(names: &[String], are_exchanged: bool, left_px: f64) -> String {
    let joined = names.join(" and ");
    if are_exchanged {
        return format!("the poses of {joined} seem to be exchanged; each with the other's leaves {left_px:.2} px");
    }
    let (poses, seem, them) = if names.len() == 1 { ("pose", "seems", "it") } else { ("poses", "seem", "them") };
    format!(
        "the {poses} of {joined} {seem} to be wrong: without {them} the others leave {left_px:.2} px; correct {them} or leave {them} out"
    )
}

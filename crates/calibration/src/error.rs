//! The error types of this crate.

/// The reason why a camera file cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum CameraFileError {
    /// The file is not YAML, or does not have ROS's names.
    #[error("expected a camera file as ROS's camera_calibration writes it, found: {found}")]
    Unreadable { found: String },
    /// The lens model is not `plumb_bob`, or the number of coefficients is not 4 or 5.
    #[error(
        "expected distortion_model plumb_bob with 4 or 5 coefficients, found {found} with {coefficients}; calibrate again with that \
         model (in OpenCV: without CALIB_RATIONAL_MODEL and not as fisheye)"
    )]
    Lens {
        found: String,
        /// Number of coefficients found.
        coefficients: usize,
    },
    /// A field other than `distortion_model` names a lens of another kind.
    #[error(
        "expected a pinhole camera with distortion_model plumb_bob, found {key}: {found}; calibrate again with that model (in OpenCV: not as \
         fisheye)"
    )]
    OtherModel { key: &'static str, found: String },
    /// A coefficient is NaN or infinite.
    #[error("expected finite distortion_coefficients, found {found:?}")]
    Coefficients { found: Vec<f64> },
    /// The lens shows two points of the world, or none, at a pixel of the picture.
    #[error(
        "expected distortion_coefficients that map every pixel to one point, found {found:?}, which fold the picture \
         at ({x:.0}, {y:.0}); calibrate again, with the board also in the corners of the picture"
    )]
    Folds { found: Vec<f64>, x: f64, y: f64 },
    /// The camera matrix is invalid.
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
    /// A pose is not a rigid transform, or a pose or the workspace is too far away.
    #[error("expected {name} to be {expected}, found {found:?}")]
    Pose { name: String, expected: &'static str, found: Vec<f64> },
    /// The file has no pose above the table.
    #[error("expected the camera's pose above the table (`table:`), found none")]
    NoPose,
    /// The camera's height is impossible.
    #[error("expected the camera 0.05 to 20 m above the table, found {height:.2} m{hint}")]
    Height { height: f64, hint: &'static str },
    /// The picture's size is not the camera's.
    #[error(
        "expected pictures of {width} × {height} pixels, as the camera was calibrated, found {found_width} × {found_height}"
    )]
    OtherSize {
        /// Width of the calibrated camera's pictures, in pixels.
        width: u32,
        height: u32,
        /// Width of the picture, in pixels.
        found_width: u32,
        found_height: u32,
    },
    /// The existing file does not have ROS's layout.
    #[error(
        "expected the existing camera file to have each field on lines of its own, as ROS's camera_calibration writes it; write another file"
    )]
    NotUpdatable,
    /// The workspace has no extent.
    #[error("expected table.workspace_m with each range from low to high, found x {x:?}, y {y:?}")]
    Workspace { x: [f64; 2], y: [f64; 2] },
}

/// The reason why a board, a calibration or a pose cannot be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum CalibrationError {
    /// The number of squares is outside the supported range.
    #[error("expected {least} to {most} squares along each side of the board, found {columns} x {rows}")]
    BoardSize { columns: u32, rows: u32, least: u32, most: u32 },
    /// The size of the squares is outside the supported range.
    #[error("expected squares of 0.5 to 500 mm, found {} mm", 1000.0 * .found_m)]
    SquareSize { found_m: f64 },
    /// The measured length of the 100 mm line is impossible.
    #[error(
        "expected the printed 100 mm line to measure 90 to 110 mm, found {measured_mm} mm: measure the line below the board, in millimetres"
    )]
    Ruler { measured_mm: f64 },
    /// The board is larger than the paper.
    #[error(
        "expected {columns} x {rows} squares that fit on {paper}: at most {fits_mm:.1} mm each, found {square_mm:.1} mm"
    )]
    Paper { paper: &'static str, columns: u32, rows: u32, square_mm: f64, fits_mm: f64 },
    /// The file is not one of this crate's sheets.
    #[error("expected a board's file with the size of its squares, found a file without it")]
    NoBoardFile,
    /// The picture has no grid with enough corners.
    #[error(
        "expected the board, found {}: it may be seen edge-on, cut off, covered, dark or out of focus",
        if *.corners == 0 { "no corners of squares in a grid".to_owned() } else { format!("at most {columns} x {rows} corners of squares in a grid") }
    )]
    BoardNotFound {
        /// Number of corners in the largest grid.
        corners: usize,
        /// Number of corners along the largest grid's first axis.
        columns: usize,
        /// Number of corners along the largest grid's second axis.
        rows: usize,
    },
    /// The placement of the grid on the board is unknown, or the grid's corners are not those of a board.
    #[error(
        "expected enough of the board to identify the visible squares, found {corners} corners and no position on the \
         board that matches its dots: show more of it, or print it with its dots; a checkerboard without dots \
         must be completely visible"
    )]
    BoardUnclear { corners: usize },
    /// A checkerboard without dots has a different number of squares, or is not completely visible.
    #[error(
        "expected a checkerboard of {columns} x {rows} squares, found one of {found_columns} x {found_rows}: it has other \
         squares, or is not completely visible"
    )]
    OtherCheckerboard { columns: u32, rows: u32, found_columns: u32, found_rows: u32 },
    /// The board has more squares than expected.
    #[error("expected a board of {columns} x {rows} squares, found one of at least {found_columns} x {found_rows}")]
    OtherBoard {
        /// Expected number of squares along x.
        columns: u32,
        /// Expected number of squares along y.
        rows: u32,
        /// Minimum number of squares found along x.
        found_columns: u32,
        /// Minimum number of squares found along y.
        found_rows: u32,
    },
    /// There are fewer pictures than a calibration needs.
    #[error("expected at least {least} pictures that show the board, found {found}{}", .hint)]
    TooFewPictures {
        /// Minimum number of pictures.
        least: usize,
        found: usize,
        /// A further hint, or empty.
        hint: &'static str,
    },
    /// The pictures do not determine the focal length.
    #[error(
        "expected pictures that show the board tilted in several directions, found {found}: their poses are similar \
         and do not determine the focal length{}; tilt the board by 20 to 40 degrees to the left, to the right, \
         upwards and downwards", .hint
    )]
    PosesAlike {
        found: String,
        /// The focal length's relative error as text, or empty.
        hint: String,
    },
    /// No pose explains the corners.
    #[error("expected corners of a flat board in a pinhole camera's picture, found corners that no pose explains")]
    NoPose,
    /// The camera is below the sheet, or tilted so far that the sheet's horizon is near.
    #[error(
        "expected a camera that looks down at the sheet, found it tilted by {tilt_deg:.1} degrees from the vertical: \
         beyond {max_deg} degrees the table's \
         horizon is near"
    )]
    Horizon {
        /// The angle between the optical axis and the sheet's normal.
        tilt_deg: f64,
        max_deg: f64,
    },
    /// The robot poses cannot be read.
    #[error("expected robot poses as documented in docs/calibration.md, found: {found}")]
    PosesUnreadable { found: String },
    /// A robot pose is not a rigid transform, or is too far from the base.
    #[error("expected base_from_flange.{name} of {picture} to be {expected}, found {found:?}")]
    RobotPose { picture: String, name: &'static str, expected: &'static str, found: Vec<f64> },
    /// The robot poses do not determine the transform.
    #[error(
        "expected robot poses that rotate the flange about two axes, found {found}: add poses rotated by 20 to 40 \
         degrees about {missing}"
    )]
    TurnsAlike { found: String, missing: String },
    /// Robot poses and pictures do not match.
    #[error("expected robot poses and pictures that agree, found {found}{hint}")]
    HandEyeDisagrees {
        /// The difference between robot poses and pictures.
        found: String,
        hint: String,
        /// Whether the hint is that the camera is mounted on the hand instead of beside the robot, or the reverse.
        is_other_mount: bool,
    },
    /// One or two robot poses do not match their pictures, and the others do.
    #[error(
        "expected robot poses and pictures that agree, found {found}: {}", wrong_poses(.names, *.are_exchanged, *.left_px)
    )]
    WrongPoses {
        /// The difference between all robot poses and pictures.
        found: String,
        /// Indices of the pictures with wrong poses, from 0.
        pictures: Vec<usize>,
        /// Names of the pictures with wrong poses, in the same order: numbers from 1 before
        /// [`Self::with_picture_names`].
        names: Vec<String>,
        /// Whether the poses of two pictures are exchanged.
        are_exchanged: bool,
        /// Reprojection error without the wrong poses, or with the exchanged ones put back.
        left_px: f64,
    },
    /// The board's size differs from the given one.
    #[error(
        "expected a board of the given size, found squares of {:.2} ± {:.2} mm instead of {:.2} mm: measured by the \
         robot, the board has {:.1} % of that size, with a reprojection error of {left_px:.2} px; measure the 100 mm line below the \
         board, or its squares, and give the measured size",
        1000.0 * .told_m * .scale, 1000.0 * .told_m * .sigma, 1000.0 * .told_m, 100.0 * .scale
    )]
    OtherBoardScale {
        /// The given side of a square, in metres.
        told_m: f64,
        /// The estimated size as a multiple of the given one.
        scale: f64,
        /// Standard error of `scale`.
        sigma: f64,
        left_px: f64,
    },
}

impl CalibrationError {
    /// Replaces the numbers of the pictures by their names, which the caller knows.
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
        return format!(
            "the poses of {joined} seem to be exchanged; exchanged back, the reprojection error is \
                        {left_px:.2} px"
        );
    }
    let (poses, seem, them) = if names.len() == 1 { ("pose", "seems", "it") } else { ("poses", "seem", "them") };
    format!(
        "the {poses} of {joined} {seem} to be wrong: without {them} the reprojection error of the others is \
         {left_px:.2} px; correct {them} or leave {them} out"
    )
}

//! The constants and structures in the header.

use std::ffi::c_char;

/// Version of this header's functions and structures, and number in the shared library's name. The library rejects
/// structures of another version.
pub const SDG_ABI_VERSION: u32 = 1;

/// A model, a camera, or the detections of a picture: a number that is never reused. 0 is no object.
pub type sdg_handle = u64;

/// SDG_OK or the kind of an error; sdg_last_error gives the text.
pub type sdg_status = i32;

/// No error.
pub const SDG_OK: sdg_status = 0;
/// A value that a function does not accept.
pub const SDG_ERROR_ARGUMENT: sdg_status = 1;
/// A file that does not exist, or cannot be read or written.
pub const SDG_ERROR_FILE: sdg_status = 2;
/// A file that is not a grasp model, is damaged, or has another version.
pub const SDG_ERROR_MODEL_FILE: sdg_status = 3;
/// Invalid bit depth, size, channels or rows of a picture.
pub const SDG_ERROR_PICTURE: sdg_status = 4;
/// An invalid camera file; or a camera for a model that was taught without one.
pub const SDG_ERROR_CAMERA: sdg_status = 5;
/// A region that is empty, not inside the picture, or too small for the part.
pub const SDG_ERROR_REGION: sdg_status = 6;
/// A photo or marks unsuitable for teaching.
pub const SDG_ERROR_TEACHING: sdg_status = 7;
/// No accepted detection; only from sdg_detections_best.
pub const SDG_ERROR_NOTHING_TO_GRASP: sdg_status = 8;
/// A handle that was freed, that never existed, or that is of another kind of object.
pub const SDG_ERROR_HANDLE: sdg_status = 9;
/// The program was compiled with a header of another ABI version.
pub const SDG_ERROR_VERSION: sdg_status = 10;
/// An internal error of this library.
pub const SDG_ERROR_INTERNAL: sdg_status = 11;
/// The process was forked after its parent had loaded a model, detected or taught.
pub const SDG_ERROR_FORKED: sdg_status = 12;

/// sdg_picture.order: red first. Ignored for grey.
pub const SDG_RGB: u32 = 0;
/// sdg_picture.order: blue first, as in OpenCV's Mat.
pub const SDG_BGR: u32 = 1;

/// sdg_options.region_kind: the region that the model was taught with; the whole picture if it has none.
pub const SDG_REGION_OF_MODEL: u32 = 0;
/// sdg_options.region_kind: the whole picture.
pub const SDG_REGION_ALL: u32 = 1;
/// sdg_options.region_kind: the numbers of sdg_options.region.
pub const SDG_REGION_PART: u32 = 2;

/// sdg_detection.frame: no camera; all numbers of the pose are 0.
pub const SDG_FRAME_NONE: u32 = 0;
/// sdg_detection.frame: the table, z up.
pub const SDG_FRAME_TABLE: u32 = 1;
/// sdg_detection.frame: the robot's base.
pub const SDG_FRAME_BASE: u32 = 2;

/// sdg_detection.turn_source: a source unknown to this header.
pub const SDG_TURN_OTHER: u32 = 0;
/// sdg_detection.turn_source: the network's angle class of the box's crop (model A).
pub const SDG_TURN_CROP: u32 = 1;
/// sdg_detection.turn_source: the line through the keypoints (models B and C).
pub const SDG_TURN_KEYPOINTS: u32 = 2;
/// sdg_detection.turn_source: the part's texture (model D).
pub const SDG_TURN_TEXTURE: u32 = 3;
/// sdg_detection.turn_source: the mask's outline (model D).
pub const SDG_TURN_OUTLINE: u32 = 4;
/// sdg_detection.turn_source: search over all angles (model S, and parts of other models that only the search found).
pub const SDG_TURN_SEARCH: u32 = 5;

/// sdg_teaching.symmetry: the part looks the same at every angle.
pub const SDG_SYMMETRY_FULL: u32 = 4294967295;

/// Bytes of sdg_detection.refused.
pub const SDG_REFUSED_BYTES: u32 = 128;

/// A picture of the caller, read only during the call. The first row is at the top, and the first pixel of a row at the
/// left.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sdg_picture {
    /// SDG_ABI_VERSION.
    pub abi_version: u32,
    /// Width in pixels.
    pub width: u32,
    /// Height: number of rows.
    pub height: u32,
    /// Bytes per pixel: 3, or 1 for grey.
    pub channels: u32,
    /// Bits per channel: 8.
    pub bits_per_channel: u32,
    /// SDG_RGB or SDG_BGR.
    pub order: u32,
    /// Bytes from the start of a row to the start of the next; at least width * channels.
    pub row_bytes: usize,
    /// Number of bytes readable from pixels on.
    pub num_bytes: usize,
    /// First byte of the first row.
    pub pixels: *const u8,
}

/// Search options. NULL is equivalent to all numbers 0 except abi_version.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sdg_options {
    /// SDG_ABI_VERSION.
    pub abi_version: u32,
    /// Number of threads, at most 1024; 0 for one per core. The results do not depend on it.
    pub threads: u32,
    /// The calibrated camera that took the picture, for poses in metres; 0 for none.
    pub camera: sdg_handle,
    /// SDG_REGION_OF_MODEL, SDG_REGION_ALL or SDG_REGION_PART.
    pub region_kind: u32,
    /// Left edge, upper edge, width and height in pixels; with SDG_REGION_PART.
    pub region: [u32; 4],
}

/// Inputs of a teaching run. Numbers that are 0 and pointers that are NULL select the defaults of `sdg teach`; photo
/// and marks must be given.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sdg_teaching {
    /// SDG_ABI_VERSION.
    pub abi_version: u32,
    /// Number of angles at which the part looks the same: 2 for half a turn, ..., SDG_SYMMETRY_FULL for a disc; 0 and 1
    /// for none.
    pub symmetry: u32,
    /// File of the photo.
    pub photo: *const c_char,
    /// File of the marks, in LabelMe or COCO format.
    pub marks: *const c_char,
    /// The model's letter: "S" takes seconds; NULL selects "C", whose network takes half a minute or more.
    pub model: *const c_char,
    /// File of the calibrated camera that took the photo, for poses in metres; NULL for none.
    pub camera: *const c_char,
    /// Height of the marks above the table in metres, with a camera.
    pub mark_height_m: f64,
    /// Height above the table at which the gripper closes, in metres, with a camera; 0 for half of mark_height_m.
    pub grasp_height_m: f64,
    /// Seed of the random numbers; 0 for 1, the default of `sdg teach`.
    pub seed: u64,
    /// Number of training steps of a network; 0 for the model's default.
    pub steps: u64,
}

/// Contributions of each kind of evidence to the score, in log-odds. NaN: not evaluated.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sdg_evidence {
    /// The network's proposals; NaN for models without one.
    pub network: f64,
    /// Edges of the photo found in the picture.
    pub edges: f64,
    /// Colours inside the outline.
    pub surface: f64,
    /// Hue.
    pub hue: f64,
    /// Fraction of the part in agreeing regions.
    pub visible: f64,
    /// Size compared with the expected one.
    pub size: f64,
    /// Fraction of the part outside the picture.
    pub outside: f64,
    /// Resemblance to other objects.
    pub resemblance: f64,
    /// Likeness to the photo, by the comparison network.
    pub likeness: f64,
    /// Details, by the network trained on look-alikes.
    pub details: f64,
    /// Table at places where the part should be.
    pub table: f64,
    /// Fraction of the outline without an edge.
    pub rim: f64,
    /// Edges that are not in the photo.
    pub added: f64,
    /// Advantage of the mirror image's fit.
    pub mirror: f64,
}

/// A candidate position of the part. Pixels: x right, y down, centre of the first pixel at (0.5, 0.5).
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sdg_detection {
    /// Calibrated, from 0 to 1; accepted from 0.5.
    pub score: f64,
    /// The network's own score; NaN without a network (model S).
    pub network_score: f64,
    /// Agreement of the demonstration with the picture, from 0 to 1.
    pub agreement: f64,
    /// The part's size relative to its nominal size; NaN with a camera.
    pub size: f64,
    /// Left, upper, right and lower edge, in pixels.
    pub bounds: [f64; 4],
    /// x of the grasp point, in pixels.
    pub grasp_x: f64,
    /// y of the grasp point, in pixels.
    pub grasp_y: f64,
    /// Direction from the first mark to the second, in (-180, 180], y down; the jaws close across it.
    pub grasp_angle_deg: f64,
    /// The part's width between the jaws, in pixels.
    pub grasp_width_px: f64,
    /// Grasp point in the frame, in metres.
    pub p_m: [f64; 3],
    /// Rotation about the frame's z, right-handed.
    pub yaw_deg: f64,
    /// Distance between the jaws for the part's width, in metres.
    pub opening_m: f64,
    /// The position is within this distance with a probability of 68 %.
    pub sigma_mm: f64,
    /// The rotation is within this angle with a probability of 68 %.
    pub sigma_deg: f64,
    /// The components of the score.
    pub evidence: sdg_evidence,
    /// SDG_FRAME_TABLE or SDG_FRAME_BASE with a camera, SDG_FRAME_NONE without.
    pub frame: u32,
    /// 1 if it is accepted, 0 if it is refused.
    pub is_accepted: u32,
    /// SDG_TURN_CROP, ...: the source of the angle's first estimate.
    pub turn_source: u32,
    /// Number of corners of the outline; see sdg_detections_polygon.
    pub num_polygon: u32,
    /// Number of keypoints; see sdg_detections_keypoints.
    pub num_keypoints: u32,
    /// Why it is refused, in UTF-8; empty if it is accepted.
    pub refused: [c_char; 128],
}

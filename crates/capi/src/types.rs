//! Constants and structures of the header.

use std::ffi::c_char;

/// Version of this header's functions and structures; the number in the shared library's name. A library refuses structures of another.
pub const SDG_ABI_VERSION: u32 = 1;

/// A model, a camera, or the detections of a picture: a number that is given once and never again. 0 is none.
pub type sdg_handle = u64;

/// SDG_OK or the kind of an error, whose text sdg_last_error gives.
pub type sdg_status = i32;

/// No error.
pub const SDG_OK: sdg_status = 0;
/// A value that a function does not take.
pub const SDG_ERROR_ARGUMENT: sdg_status = 1;
/// A file that is not there, or that cannot be read or written.
pub const SDG_ERROR_FILE: sdg_status = 2;
/// A file that is no grasp model, a damaged one, or one of another version.
pub const SDG_ERROR_MODEL_FILE: sdg_status = 3;
/// A picture's bits, size, channels or rows.
pub const SDG_ERROR_PICTURE: sdg_status = 4;
/// A camera's file; a camera given to a model that was taught without.
pub const SDG_ERROR_CAMERA: sdg_status = 5;
/// A region that does not lie in the picture.
pub const SDG_ERROR_REGION: sdg_status = 6;
/// A photo and marks that nothing can be taught from.
pub const SDG_ERROR_TEACHING: sdg_status = 7;
/// No part in the picture; from sdg_detections_best alone.
pub const SDG_ERROR_NOTHING_TO_GRASP: sdg_status = 8;
/// A handle that was freed, that was never given, or that is of another object.
pub const SDG_ERROR_HANDLE: sdg_status = 9;
/// A program that was compiled with the header of another ABI version.
pub const SDG_ERROR_VERSION: sdg_status = 10;
/// A fault of this library.
pub const SDG_ERROR_INTERNAL: sdg_status = 11;
/// A process that was forked after its parent had detected or taught.
pub const SDG_ERROR_FORKED: sdg_status = 12;

/// sdg_picture.order: red first. Of no meaning for grey.
pub const SDG_RGB: u32 = 0;
/// sdg_picture.order: blue first, as in OpenCV's Mat.
pub const SDG_BGR: u32 = 1;

/// sdg_options.region_kind: the region that the model was taught with; all of the picture where it has none.
pub const SDG_REGION_OF_MODEL: u32 = 0;
/// sdg_options.region_kind: all of the picture.
pub const SDG_REGION_ALL: u32 = 1;
/// sdg_options.region_kind: the numbers of sdg_options.region.
pub const SDG_REGION_PART: u32 = 2;

/// sdg_detection.frame: without a camera; all numbers of the pose are 0.
pub const SDG_FRAME_NONE: u32 = 0;
/// sdg_detection.frame: the table, z up.
pub const SDG_FRAME_TABLE: u32 = 1;
/// sdg_detection.frame: the robot's base.
pub const SDG_FRAME_BASE: u32 = 2;

/// sdg_detection.turn_source: a source that this header does not know.
pub const SDG_TURN_OTHER: u32 = 0;
/// sdg_detection.turn_source: the network's class of the box's crop (model A).
pub const SDG_TURN_CROP: u32 = 1;
/// sdg_detection.turn_source: the line through the keypoints (models B and C).
pub const SDG_TURN_KEYPOINTS: u32 = 2;
/// sdg_detection.turn_source: the part's texture (model D).
pub const SDG_TURN_TEXTURE: u32 = 3;
/// sdg_detection.turn_source: the mask's outline (model D).
pub const SDG_TURN_OUTLINE: u32 = 4;
/// sdg_detection.turn_source: every turn was tried (model S).
pub const SDG_TURN_SEARCH: u32 = 5;

/// sdg_teaching.symmetry: the part looks the same at every turn.
pub const SDG_SYMMETRY_FULL: u32 = 4294967295;

/// Bytes of sdg_detection.refused.
pub const SDG_REFUSED_BYTES: u32 = 128;

/// A picture of the caller's, read during the call alone. The upper row is the first, the left pixel of a row is the first.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sdg_picture {
    /// SDG_ABI_VERSION.
    pub abi_version: u32,
    /// Pixels of a row.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Bytes of a pixel: 3, or 1 for grey.
    pub channels: u32,
    /// Bits of a channel: 8.
    pub bits_per_channel: u32,
    /// SDG_RGB or SDG_BGR.
    pub order: u32,
    /// Bytes from the start of a row to the start of the next; at least width * channels.
    pub row_bytes: usize,
    /// Bytes that may be read from pixels on.
    pub num_bytes: usize,
    /// First byte of the first row.
    pub pixels: *const u8,
}

/// How a picture is searched. NULL in its place is the same as all numbers 0 but abi_version.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sdg_options {
    /// SDG_ABI_VERSION.
    pub abi_version: u32,
    /// Number of threads, at most 1024; 0 for as many as there are cores. It changes no digit of a result.
    pub threads: u32,
    /// The calibrated camera that took the picture, for poses in metres; 0 for none.
    pub camera: sdg_handle,
    /// SDG_REGION_OF_MODEL, SDG_REGION_ALL or SDG_REGION_PART.
    pub region_kind: u32,
    /// Left edge, upper edge, width and height in pixels; with SDG_REGION_PART.
    pub region: [u32; 4],
}

/// What a model is taught from. Numbers that are 0 and pointers that are NULL have the defaults of `sdg teach`.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sdg_teaching {
    /// SDG_ABI_VERSION.
    pub abi_version: u32,
    /// Turns after which the part looks the same: 2 for half a turn, ..., SDG_SYMMETRY_FULL for a disc; 0 and 1 for none.
    pub symmetry: u32,
    /// File of the photo.
    pub photo: *const c_char,
    /// File of the marks, LabelMe's or COCO's.
    pub marks: *const c_char,
    /// The model's letter: "S" takes seconds; NULL is "C", whose network takes minutes.
    pub model: *const c_char,
    /// File of the calibrated camera that took the photo, for poses in metres; NULL for none.
    pub camera: *const c_char,
    /// Height of the marks over the table in metres, with a camera.
    pub mark_height_m: f64,
    /// Height over the table at which the gripper closes, in metres, with a camera; 0 for half of mark_height_m.
    pub grasp_height_m: f64,
    /// Seed of the random numbers; 0 for 1, the default of `sdg teach`.
    pub seed: u64,
    /// Training steps of a network; 0 for the model's own number.
    pub steps: u64,
}

/// Contributions of each kind of evidence to the score, in log-odds. NaN: of a kind that was not asked.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sdg_evidence {
    /// The network's proposals; NaN for models without one.
    pub network: f64,
    /// Edges of the photo that the picture has.
    pub edges: f64,
    /// Colours inside the outline.
    pub surface: f64,
    /// Hue.
    pub hue: f64,
    /// Share of the part in regions that agree.
    pub visible: f64,
    /// Size beside the expected one.
    pub size: f64,
    /// Share of the part outside the picture.
    pub outside: f64,
    /// Resemblance to other things.
    pub resemblance: f64,
    /// Likeness to the photo by the comparing network.
    pub likeness: f64,
    /// Details by the network that knows look-alikes.
    pub details: f64,
    /// Table where the part should be.
    pub table: f64,
    /// Share of the outline without an edge.
    pub rim: f64,
    /// Edges that the photo does not have.
    pub added: f64,
    /// How much better the mirror image fits.
    pub mirror: f64,
}

/// A place where the part may lie. Pixels: x right, y down, the middle of the first pixel at (0.5, 0.5).
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct sdg_detection {
    /// From 0 to 1, calibrated: from 0.5 on it is accepted.
    pub score: f64,
    /// The network's own score; NaN where no network was asked (model S).
    pub network_score: f64,
    /// How well the demonstration agrees with the picture, from 0 to 1.
    pub agreement: f64,
    /// The part's size over its nominal size; NaN with a camera.
    pub size: f64,
    /// Left, upper, right and lower edge, in pixels.
    pub bounds: [f64; 4],
    /// Grasp point, in pixels.
    pub grasp_x: f64,
    /// Grasp point, in pixels.
    pub grasp_y: f64,
    /// Direction from the first mark to the second, in (-180, 180], y down; the jaws close across it.
    pub grasp_angle_deg: f64,
    /// The part's width between the jaws, in pixels.
    pub grasp_width_px: f64,
    /// Grasp point in the frame, in metres.
    pub p_m: [f64; 3],
    /// Turn about the frame's z, right-handed.
    pub yaw_deg: f64,
    /// Distance between the jaws for the part's width, in metres.
    pub opening_m: f64,
    /// The position lies within this with a probability of 68 %.
    pub sigma_mm: f64,
    /// The turn lies within this with a probability of 68 %.
    pub sigma_deg: f64,
    /// What the score is made of.
    pub evidence: sdg_evidence,
    /// SDG_FRAME_TABLE or SDG_FRAME_BASE with a camera, SDG_FRAME_NONE without.
    pub frame: u32,
    /// 1 where it is accepted, 0 where it is refused.
    pub is_accepted: u32,
    /// SDG_TURN_CROP, ...: the first source of the turn.
    pub turn_source: u32,
    /// Corners of the outline; sdg_detections_polygon gives them.
    pub num_polygon: u32,
    /// Keypoints; sdg_detections_keypoints gives them.
    pub num_keypoints: u32,
    /// Why it is refused, in UTF-8; empty where it is accepted.
    pub refused: [c_char; 128],
}

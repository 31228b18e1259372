//! Errors of a grasp model, its file or its grasps.

/// The reason why a model could not be taught, read or used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages explain the fields")]
pub enum GraspError {
    /// A letter or name that belongs to no model.
    #[error(transparent)]
    UnknownModel(#[from] sdg_demonstration::UnknownModel),
    /// A preset that this version lacks.
    #[error("expected a preset out of {}, found \"{found}\"", .known.join(", "))]
    UnknownPreset {
        /// The presets that this version has.
        known: Vec<&'static str>,
        found: String,
    },
    /// A name that belongs to no device.
    #[error("expected a device out of {}, found \"{found}\"", .known.join(", "))]
    UnknownBackend {
        /// The existing names.
        known: Vec<&'static str>,
        found: String,
    },
    /// A device whose backend was not compiled in.
    #[error(
        "expected a device out of {}, which this build has; found \"{asked}\"",
        .built.join(", ")
    )]
    BackendNotBuilt { asked: &'static str, built: Vec<&'static str> },
    /// A device that this machine does not have.
    #[error("expected a device for {backend} on this machine, found {found}")]
    NoSuchDevice { backend: &'static str, found: String },
    /// Bytes that are not a grasp model.
    #[error("expected a grasp model file of this project, found {found}")]
    NotAModel {
        /// The kind of the file, as far as the first bytes show.
        found: String,
    },
    /// A grasp model file of another version.
    #[error(
        "expected a grasp model of format version {expected}, found version {found}: it was written by another sdg"
    )]
    OtherVersion { expected: u32, found: String },
    /// A grasp model file that is inconsistent or was truncated.
    #[error("the grasp model file is damaged: expected {expected}, found {found}")]
    Damaged {
        /// The expected content.
        expected: String,
        found: String,
    },
    /// An image that is too small.
    #[error("expected an image of at least {least} × {least} pixels, found {width} × {height}")]
    ImageTooSmall { least: u32, width: u32, height: u32 },
    /// A region that cannot be searched.
    #[error(transparent)]
    Region(#[from] crate::region::RegionError),
    /// A grasp whose ray misses the marks' plane.
    #[error("the ray through pixel ({x:.1}, {y:.1}) does not meet the plane at z = {height_m} m")]
    OffPlane {
        x: f64,
        y: f64,
        /// The plane's z in the camera's world, in metres.
        height_m: f64,
    },
    /// No plan view can be made.
    #[error(transparent)]
    PlanView(#[from] sdg_geometry::PlanViewError),
    /// A model without lengths.
    #[error("expected a model taught with a camera, found one without")]
    NoLengths,
    /// A part that is too wide for the gripper.
    #[error(
        "the part is {:.0} mm wide at the grasp, and the gripper opens {:.0} mm",
        .width_m * 1e3, .max_opening_m * 1e3
    )]
    TooWide {
        /// Width of the part between the jaws, in metres.
        width_m: f64,
        /// Stroke of the gripper, in metres.
        max_opening_m: f64,
    },
    /// No demonstration was given.
    #[error("expected at least one demonstration, found none")]
    NoDemonstration,
    /// More demonstrations than a model holds.
    #[error("expected at most {most} demonstrations, found {found}")]
    TooManyDemonstrations { most: usize, found: usize },
    /// Marked parts with too many pixels in all.
    #[error(
        "expected marked parts of at most {most} megapixels in all photos together, found more: use fewer or smaller \
         photos"
    )]
    PartsTooLarge {
        /// In millions of pixels.
        most: u64,
    },
    /// Outlines that are much smaller than boxes and grasps.
    #[error(
        "expected outlines about as large as the marked boxes and grasps, found much smaller ones: correct the marks"
    )]
    MarksFarApart,
    /// Demonstrations of different parts.
    #[error("expected demonstrations of one part: {expected}; found {found}")]
    ContradictingDemonstrations {
        /// The value in the earlier demonstrations.
        expected: String,
        found: String,
    },
    /// A part with too few pixels in its photo.
    #[error(
        "expected a part of at least {least} pixels in its photo, found {width:.0} × {height:.0}: photograph it from \
         a shorter distance, or with more pixels"
    )]
    PartTooSmall {
        least: f64,
        /// Width of the part's box.
        width: f64,
        /// Height of the part's box.
        height: f64,
    },
    /// A demonstration that the model cannot be taught from.
    #[error(transparent)]
    Demonstration(#[from] sdg_demonstration::Error),
    /// A demonstration among the pictures that must not show the part.
    #[error("expected pictures without the part, found that picture {number} of them is a demonstration")]
    DemonstrationAsNegative {
        /// The number among those pictures, from 1.
        number: usize,
    },
    /// A demonstration without a shape to compare, or a setting of the search out of range.
    #[error("the demonstration cannot be compared with images: {0}")]
    Shape(#[from] sdg_shape::ShapeError),
    /// A value of a configuration out of its range.
    #[error("expected {name} {expected}, found {found}")]
    InvalidConfig {
        name: &'static str,
        /// The accepted range, in words.
        expected: &'static str,
        found: f64,
    },
    /// A name that belongs to no constant that can be fitted.
    #[cfg(feature = "teach")]
    #[error("expected a constant out of {}, found \"{found}\"", .known.join(", "))]
    UnknownConstant {
        /// The constants that can be fitted.
        known: Vec<&'static str>,
        found: String,
    },
    /// Invalid input or configuration of the detector.
    #[error(transparent)]
    Detection(#[from] sdg_detection::DetectionError),
    /// A preset that needs base weights, in a build without weights for it.
    #[cfg(feature = "teach")]
    #[error("expected base weights for the preset {preset}, found none in this build")]
    NeedsBaseWeights { preset: &'static str },
    /// Base weights that cannot be read or belong to another network.
    #[cfg(feature = "teach")]
    #[error("base weights: {fitting} parameters fit the network; found {found}")]
    BaseWeights {
        fitting: usize,
        /// The first parameter that does not fit.
        found: String,
    },
    /// Invalid input or configuration of the orientation CNN.
    #[error(transparent)]
    Orientation(#[from] sdg_orientation::OrientationError),
    /// Error of the comparison network.
    #[error(transparent)]
    Comparison(#[from] sdg_comparison::ComparisonError),
    /// A demonstration that shows neither texture nor an outline, or a mask of another size than its image.
    #[error(transparent)]
    Sift(#[from] sdg_sift::SiftError),
    /// Teaching ended without a model.
    #[cfg(feature = "teach")]
    #[error(transparent)]
    Training(#[from] sdg_training::TrainingError),
    /// The observer requested a stop before a network could be kept.
    #[cfg(feature = "teach")]
    #[error("stopped while the orientation CNN was taught: there is no model to keep")]
    StoppedTooEarly,
    /// Teaching ended with a network that does not find the part.
    #[cfg(feature = "teach")]
    #[error(
        "after {steps} steps the network finds the part in {hits} of {positives} held-back samples: too few for a usable model; \
         give it more time, or a demonstration with a clearer outline"
    )]
    NotLearnt {
        /// Samples in which the demonstration, laid over the image at the network's candidate, lies on the part.
        hits: usize,
        positives: usize,
        steps: usize,
    },
}

/// The result of this crate's functions.
pub type Result<T> = std::result::Result<T, GraspError>;

//! Errors of a photo or its annotation, most with the expected and the found value.

use sdg_picture::PictureError;
use thiserror::Error;

/// Result of this crate's functions.
pub type Result<T> = std::result::Result<T, Error>;

/// The reason why a photo, an annotation or an augmentation was refused.
///
/// `place` fields give the position in the file: `line 3, column 7` for invalid JSON, a path such as
/// `shapes[2].points[0]` for JSON with the wrong content, `line 3` for YOLO's text.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum Error {
    /// The photo itself.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// The annotation is neither JSON nor of another known format.
    #[error("annotation is not JSON ({place}): {reason}")]
    NotJson { place: String, reason: String },
    /// JSON, but neither COCO nor LabelMe; or not an annotation at all.
    #[error(
        "wrong annotation file: expected COCO JSON (`images`, `annotations`), LabelMe JSON (`shapes`), YOLO-pose labels \
         or OpenDR's .npy, found {found}"
    )]
    WrongFile {
        /// The top-level keys or the kind of value.
        found: String,
    },
    /// A value in the annotation is missing or of the wrong kind.
    #[error("annotation, {place}: expected {expected}, found {found}")]
    Malformed { place: String, expected: String, found: String },
    /// A number is NaN or infinite.
    #[error("annotation, {place}: expected a finite number, found {found}")]
    NotFinite {
        /// Path inside the JSON, or line and column.
        place: String,
        found: String,
    },
    /// The annotation belongs to an image of another size.
    #[error(
        "annotation of another image: it was made on {}×{} pixels, the image has {}×{}",
        annotated[0], annotated[1], image[0], image[1]
    )]
    OtherImageSize {
        /// Width and height that the annotation declares.
        annotated: [u32; 2],
        /// Width and height of the image.
        image: [u32; 2],
    },
    /// A coordinate lies outside the image.
    #[error(
        "annotation, {place}: expected a place inside the image of {}×{} pixels, found ({x}, {y})",
        image[0], image[1]
    )]
    OutsideImage {
        place: String,
        x: f64,
        y: f64,
        /// Width and height of the image.
        image: [u32; 2],
    },
    /// A box, line or outline without extent.
    #[error("annotation, {place}: expected {expected}, found {found}")]
    ZeroSize { place: String, expected: String, found: String },
    /// Two edges of the outline cross.
    #[error("annotation, {place}: expected an outline that does not cross itself, found edges that cross")]
    SelfCrossing { place: String },
    /// The annotation of this image contains no object.
    #[error("annotation holds no object: expected {expected}, found {found}")]
    NoObject {
        /// The requirements of an object.
        expected: String,
        found: String,
    },
    /// Several shapes of one kind without an assignment to objects.
    #[error("annotation of several objects: expected a `group_id` on every shape, found {found}")]
    Ungrouped {
        /// Groups and shapes that were found.
        found: String,
    },
    /// One object was expected and several are annotated.
    #[error("expected one annotated object, found {found}")]
    SeveralObjects { found: usize },
    /// A file of several images does not have exactly one image of the given name, or no name was given.
    #[error("annotation of several images: expected {expected}, found {found}")]
    ImageNotFound {
        /// The requested image.
        expected: String,
        /// The images in the file.
        found: String,
    },
    /// A format of two files, of which one is missing.
    #[error("annotation in two files: expected {expected}, found {found}")]
    MissingBeside { expected: &'static str, found: &'static str },
    /// A format that is read but not written.
    #[error("annotations are not written in the format `{format}`: expected coco, labelme or yolo-pose")]
    ReadOnlyFormat { format: &'static str },
    /// An annotation without marks that a model needs.
    #[error("annotation of `{label}` lacks {missing}: {why}")]
    Lacking {
        label: String,
        missing: &'static str,
        /// Why the missing marks are needed, and how to add them.
        why: String,
    },
    /// Marks of one part that contradict each other.
    #[error("contradictory marks of `{label}`: expected {expected}, found {found}")]
    Contradictory { label: String, expected: &'static str, found: String },
    /// An invalid augmentation setting.
    #[error("augmentation, {setting}: expected {expected}, found {found}")]
    Setting { setting: &'static str, expected: String, found: String },
}

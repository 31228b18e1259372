//! The annotation formats: recognition of a file's format, and its declared images.

use crate::file_name::without_escapes;
use crate::json::{self, Node, describe};
use crate::npy;
use crate::other_kind::{other_json, other_kind};
use crate::written::WrittenAnnotation;
use crate::{Annotation, CocoFile, Error, ImageFacts, LabelledInstance, Result};
use crate::{coco, foreign, labelme, opendr, yolo_pose};

/// A kind of annotation file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AnnotationFormat {
    /// COCO JSON, the canonical format: contains everything.
    Coco,
    /// LabelMe JSON: contains everything.
    LabelMe,
    /// Text with one object per line, for Ultralytics' pose models: no outlines; labels in a `data.yaml` beside it.
    YoloPose,
    /// `boxes_*.npy` and `kps_*.npy` of OpenDR's augmentation: no outlines, no labels; read only.
    OpenDr,
}

/// The size of an image according to an annotation file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeclaredImage {
    /// The image's file name, as written in the annotation file.
    pub file_name: Option<String>,
    /// Width, in pixels.
    pub width: u32,
    /// Height, in pixels.
    pub height: u32,
}

impl AnnotationFormat {
    /// All formats.
    pub const ALL: [Self; 4] = [Self::Coco, Self::LabelMe, Self::YoloPose, Self::OpenDr];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Coco => "coco",
            Self::LabelMe => "labelme",
            Self::YoloPose => "yolo-pose",
            Self::OpenDr => "opendr",
        }
    }

    /// Recognises the format by the content.
    ///
    /// # Errors
    /// Content of no known format.
    pub fn of(bytes: &[u8]) -> Result<Self> {
        if npy::is_npy(bytes) {
            return Ok(Self::OpenDr);
        }
        if yolo_pose::looks_like(bytes) {
            return Ok(Self::YoloPose);
        }
        if let Some(found) = other_kind(bytes) {
            return Err(Error::WrongFile { found });
        }
        json_format(&json::parse(bytes)?)
    }

    /// The images and sizes that a file declares; empty for formats without such declarations.
    ///
    /// # Errors
    /// Content that is not an annotation file, or invalid sizes.
    pub fn declared_images(bytes: &[u8]) -> Result<Vec<DeclaredImage>> {
        let format = Self::of(bytes)?;
        if !matches!(format, Self::Coco | Self::LabelMe) {
            return Ok(Vec::new());
        }
        let value = json::parse(bytes)?;
        let root = Node::root(&value);
        let declared = |node: &Node, [name, width, height]: [&str; 3]| -> Result<Option<DeclaredImage>> {
            let file_name = node.optional(name)?.map(|name| name.text().map(str::to_owned)).transpose()?;
            let (Some(width), Some(height)) = (node.optional(width)?, node.optional(height)?) else { return Ok(None) };
            Ok(Some(DeclaredImage { file_name, width: width.pixels()?, height: height.pixels()? }))
        };
        if format == Self::LabelMe {
            return Ok(declared(&root, ["imagePath", "imageWidth", "imageHeight"])?.into_iter().collect());
        }
        let images = root.field("images", "the list of images")?.items()?;
        let declared = images.iter().map(|image| declared(image, ["file_name", "width", "height"]));
        Ok(declared.collect::<Result<Vec<_>>>()?.into_iter().flatten().collect())
    }

    /// The single picture that a file names, and the field with its name; the name may be a path or a web address.
    pub fn named_picture(bytes: &[u8]) -> Option<(&'static str, String)> {
        let value = json::parse(bytes).ok()?;
        let (field, name) = match json_format(&value).ok()? {
            Self::LabelMe => ("imagePath", value.get("imagePath")),
            _ => match value.get("images")?.as_array()?.as_slice() {
                [only] => ("images[0].file_name", only.get("file_name")),
                _ => return None,
            },
        };
        Some((field, without_escapes(name?.as_str()?)))
    }

    /// Writes the marks of one image. Reading the text back gives the same marks, except for those in `left_out`.
    ///
    /// # Errors
    /// [`Error::ReadOnlyFormat`] for OpenDR's.
    pub fn write(self, image: &ImageFacts, objects: &[Annotation]) -> Result<WrittenAnnotation> {
        self.write_labelled(image, &LabelledInstance::not_optional(objects.to_vec()))
    }

    /// As [`write`](Self::write), with the flag `optional`.
    ///
    /// # Errors
    /// [`Error::ReadOnlyFormat`] for OpenDR's.
    pub fn write_labelled(self, image: &ImageFacts, instances: &[LabelledInstance]) -> Result<WrittenAnnotation> {
        let file_name = image.file_name.unwrap_or("");
        let whole = |text| WrittenAnnotation { text, data_yaml: None, left_out: Vec::new() };
        match self {
            Self::Coco => {
                let mut file = CocoFile::new();
                file.push_labelled(file_name, image.width, image.height, instances);
                Ok(whole(file.to_json()))
            }
            Self::LabelMe => {
                let objects = instances.iter().map(|instance| &instance.annotation);
                let without_line = objects.filter(|object| object.grasp.is_none());
                let left_out = without_line.filter_map(|object| {
                    let (label, width) = (&object.label, object.jaw_width?);
                    Some(format!("the jaws of `{label}`, {width} pixels apart: LabelMe's are marks of a grasp's line"))
                });
                let left_out = left_out.collect();
                Ok(WrittenAnnotation { left_out, ..whole(labelme::write(file_name, image, instances)) })
            }
            Self::YoloPose => Ok(yolo_pose::write(image, instances)),
            Self::OpenDr => Err(Error::ReadOnlyFormat { format: self.name() }),
        }
    }

    pub(crate) fn read(self, bytes: &[u8], beside: Option<&[u8]>, image: &ImageFacts) -> Result<Vec<LabelledInstance>> {
        match self {
            Self::OpenDr => opendr::read(bytes, beside, image).map(LabelledInstance::not_optional),
            Self::YoloPose => yolo_pose::read(bytes, beside, image).map(LabelledInstance::not_optional),
            Self::LabelMe => labelme::read(&Node::root(&json::parse(bytes)?), image),
            Self::Coco => coco::read(&Node::root(&json::parse(bytes)?), image),
        }
    }
}

impl Annotation {
    /// The skipped marks of an image in a COCO or LabelMe file that mark no part, in words: circles, lines, masks,
    /// points of other names, crowds.
    pub fn passed_over(bytes: &[u8], image: &ImageFacts) -> Vec<String> {
        foreign::passed_over(bytes, image)
    }

    /// Reads every object that a file marks on the image; the content determines the [`AnnotationFormat`].
    ///
    /// # Errors
    /// An invalid file; a file for an image of another size; several LabelMe objects without group ids. Marks that are
    /// outside the image by more than a pixel, without extent or not finite; half a grasp line; an outline of fewer
    /// than three points, or one that crosses itself. The message gives the position.
    pub fn read(bytes: &[u8], image: &ImageFacts) -> Result<Vec<Self>> {
        Self::read_with(bytes, None, image)
    }

    /// As [`read`](Self::read), with the second file that some formats have in `beside`: a YOLO dataset's `data.yaml`,
    /// or the other one of OpenDR's two files.
    ///
    /// # Errors
    /// The errors of [`read`](Self::read); or the second file does not match.
    pub fn read_with(bytes: &[u8], beside: Option<&[u8]>, image: &ImageFacts) -> Result<Vec<Self>> {
        let instances = LabelledInstance::read_with(bytes, beside, image)?;
        Ok(instances.into_iter().map(|instance| instance.annotation).collect())
    }
}

impl LabelledInstance {
    /// As [`Annotation::read_with`], with the flag `optional`, which is `false` in formats without it.
    ///
    /// # Errors
    /// The errors of [`Annotation::read_with`].
    pub fn read_with(bytes: &[u8], beside: Option<&[u8]>, image: &ImageFacts) -> Result<Vec<Self>> {
        AnnotationFormat::of(bytes)?.read(bytes, beside, image)
    }
}

/// Distinguishes LabelMe from COCO by their lists.
pub(crate) fn json_format(value: &serde_json::Value) -> Result<AnnotationFormat> {
    let is_list = |name: &str| value.get(name).is_some_and(serde_json::Value::is_array);
    if is_list("shapes") {
        Ok(AnnotationFormat::LabelMe)
    } else if is_list("images") && is_list("annotations") {
        Ok(AnnotationFormat::Coco)
    } else {
        Err(Error::WrongFile { found: other_json(value).map_or_else(|| describe(value), str::to_owned) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const IMAGE: ImageFacts = ImageFacts { width: 640, height: 480, file_name: None };

    #[test]
    fn content_tells_the_format() {
        for (bytes, format) in [
            (&b"{\"shapes\": []}"[..], AnnotationFormat::LabelMe),
            (b" {\"images\": [], \"annotations\": []}", AnnotationFormat::Coco),
            (b"\xef\xbb\xbf0 0.5 0.5 0.25 0.25 0.4 0.4 2 0.6 0.6 2\r\n", AnnotationFormat::YoloPose),
            (b"\x93NUMPY\x01\x00", AnnotationFormat::OpenDr),
        ] {
            assert_eq!(AnnotationFormat::of(bytes), Ok(format));
        }
        for other in [&b"[1, 2]"[..], b"\x89PNG", b"", b"12", b"a b c d e", b"{\"images\": []}"] {
            assert!(AnnotationFormat::of(other).is_err(), "{other:?}");
        }
    }

    #[test]
    fn declared_sizes() {
        let labelme = br#"{"shapes": [], "imagePath": "a.png", "imageWidth": 640, "imageHeight": 480}"#;
        let expected = DeclaredImage { file_name: Some("a.png".into()), width: 640, height: 480 };
        assert_eq!(AnnotationFormat::declared_images(labelme), Ok(vec![expected.clone()]));
        let coco = br#"{"images": [{"id": 1, "file_name": "a.png", "width": 640, "height": 480}], "annotations": []}"#;
        assert_eq!(AnnotationFormat::declared_images(coco), Ok(vec![expected]));
        assert_eq!(AnnotationFormat::declared_images(b"0 0.5 0.5 0.5 0.5"), Ok(vec![]));
        let spoilt = br#"{"shapes": [], "imageWidth": -3, "imageHeight": 480}"#;
        assert!(AnnotationFormat::declared_images(spoilt).unwrap_err().to_string().contains("imageWidth"));
    }

    #[test]
    fn the_picture_that_is_named() {
        let named = |bytes: &[u8]| AnnotationFormat::named_picture(bytes);
        let labelme = br#"{"shapes": [], "imagePath": "C:\\a%20b.png"}"#;
        assert_eq!(named(labelme), Some(("imagePath", "C:\\a b.png".into())));
        let coco = br#"{"images": [{"id": 1, "file_name": "x/a.png"}], "annotations": []}"#;
        assert_eq!(named(coco), Some(("images[0].file_name", "x/a.png".into())));
        assert_eq!(named(br#"{"images": [{"file_name": "a"}, {"file_name": "b"}], "annotations": []}"#), None);
        assert_eq!(named(b"0 0.5 0.5 0.5 0.5"), None);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]
        #[test]
        fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..120)) {
            prop_assert!(Annotation::read(&bytes, &IMAGE).is_err());
        }
    }
}

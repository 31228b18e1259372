//! A demonstration: one photo and one part marked on it.

use image::RgbImage;
use sdg_geometry::{Keypoint, Polygon};

use crate::draft::Draft;
use crate::erase::erase_parts;
use crate::{Annotation, Error, ImageFacts, ImageLimits, Result, decode_image};

/// Number of keypoints of a grasp line: the two clicked points and ten evenly spaced between them.
pub const NUM_KEYPOINTS: usize = 12;

/// One photo and its marks.
#[derive(Debug, Clone, PartialEq)]
pub struct Demonstration {
    /// The photo, upright.
    pub image: RgbImage,
    /// The part on it, in pixels of the photo.
    pub annotation: Annotation,
}

impl Demonstration {
    /// Reads a photo and its annotation, which must mark one object.
    ///
    /// `file_name` is the photo's path or file name, which selects the image in a COCO file of several images.
    ///
    /// # Errors
    /// The errors of [`decode_image`] and [`Annotation::read`], and several objects.
    pub fn decode(image: &[u8], annotation: &[u8], file_name: Option<&str>) -> Result<Self> {
        let mut all = Self::decode_all(image, annotation, file_name)?;
        match (all.pop(), all.len()) {
            (Some(only), 0) => Ok(only),
            (_, others) => Err(Error::SeveralObjects { found: others + 1 }),
        }
    }

    /// Reads a photo of several marked objects as one demonstration each; the other objects are removed from
    /// each photo, so that none of them is taught as background.
    ///
    /// # Errors
    /// The errors of [`decode_image`] and [`Annotation::read`].
    pub fn decode_all(image: &[u8], annotation: &[u8], file_name: Option<&str>) -> Result<Vec<Self>> {
        let image = decode_image(image, &ImageLimits::default())?;
        let facts = ImageFacts { width: image.width(), height: image.height(), file_name };
        let annotations = Annotation::read(annotation, &facts)?;
        Ok(annotations
            .iter()
            .enumerate()
            .map(|(i, annotation)| {
                let others: Vec<Polygon> =
                    annotations.iter().enumerate().filter(|&(j, _)| j != i).map(|(_, other)| other.region()).collect();
                Self { image: image.clone(), annotation: annotation.clone() }.without(&others)
            })
            .collect())
    }

    /// This demonstration with these regions of the photo (pixels) removed, except for the part itself.
    #[must_use]
    pub fn without(self, others: &[Polygon]) -> Self {
        if others.is_empty() {
            return self;
        }
        let image = erase_parts(&self.image, others, Some(&self.annotation.region()));
        Self { image, ..self }
    }

    /// Checks a demonstration that was assembled by hand.
    ///
    /// # Errors
    /// An annotation outside the image, without extent, not finite, or with an outline that crosses itself.
    pub fn check(&self) -> Result<()> {
        let Annotation { label, bbox, grasp, jaw_width, outline } = &self.annotation;
        let place = |what: &str| format!("{what} of `{label}`");
        let draft = Draft {
            label: Some(label.clone()),
            place: place("annotation"),
            corners: Some((bbox.corners().to_vec(), place("box"))),
            grasp_start: grasp.map(|line| (line.start, place("grasp"))),
            grasp_end: grasp.map(|line| (line.end, place("grasp"))),
            jaw_width: jaw_width.map(|width| (width, place("jaw width"))),
            outline: outline.as_ref().map(|outline| (outline.vertices.clone(), place("outline"))),
        };
        let facts = ImageFacts { width: self.image.width(), height: self.image.height(), file_name: None };
        draft.finish(&facts).map(drop)
    }

    /// `count` keypoints evenly spaced on the grasp line, both ends included; usually [`NUM_KEYPOINTS`].
    ///
    /// # Errors
    /// [`Error::Lacking`] if no grasp is marked.
    pub fn keypoints(&self, count: usize) -> Result<Vec<Keypoint>> {
        Ok(self.annotation.require_grasp()?.keypoints(count))
    }
}

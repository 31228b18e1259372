//! A demonstration: one photo and one part marked on it.

use image::{RgbImage, imageops};
use sdg_geometry::{BoundingBox, Keypoint, PlanarSimilarity, Polygon};

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

    /// This demonstration with its photo cropped to at most this width and height, in pixels. The marks are in the
    /// middle unless they are near a border of the photo; marks that are larger than the crop extend beyond it.
    #[must_use]
    pub fn cropped(&self, size: [u32; 2]) -> Self {
        let photo: [u32; 2] = self.image.dimensions().into();
        let middle = self.annotation.extent().center();
        let [width, height] = [0, 1].map(|axis| size[axis].min(photo[axis]));
        let from = |middle: f64, side: u32, photo: u32| ((middle - 0.5 * f64::from(side)) as u32).min(photo - side);
        let [left, top] = [from(middle.x, width, photo[0]), from(middle.y, height, photo[1])];
        let Annotation { label, bbox: BoundingBox { x1, y1, x2, y2 }, grasp, jaw_width, outline } = &self.annotation;
        let (dx, dy) = (-f64::from(left), -f64::from(top));
        let crop_from_photo = PlanarSimilarity::translation(dx, dy);
        Self {
            image: imageops::crop_imm(&self.image, left, top, width, height).to_image(),
            annotation: Annotation {
                label: label.clone(),
                bbox: BoundingBox { x1: x1 + dx, y1: y1 + dy, x2: x2 + dx, y2: y2 + dy },
                grasp: grasp.map(|grasp| grasp.transformed(&crop_from_photo)),
                jaw_width: *jaw_width,
                outline: outline.as_ref().map(|outline| outline.transformed(&crop_from_photo)),
            },
        }
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

#[cfg(test)]
mod tests {
    use image::Rgb;
    use nalgebra::Point2;
    use sdg_geometry::GraspLine;

    use super::*;

    #[test]
    fn a_crop_has_the_marks_in_its_middle_or_ends_at_the_border() {
        // Every pixel has its own colour.
        let image = RgbImage::from_fn(200, 100, |x, y| Rgb([x as u8, y as u8, 0]));
        let at = |x: f64, y: f64| {
            let bbox = BoundingBox { x1: x - 10.0, y1: y - 5.0, x2: x + 10.0, y2: y + 5.0 };
            let outline = Some(Polygon::from_box(&bbox));
            let grasp = Some(GraspLine::new(Point2::new(x, y - 8.0), Point2::new(x, y + 8.0)));
            let annotation = Annotation { label: "part".into(), bbox, grasp, jaw_width: Some(9.0), outline };
            Demonstration { image: image.clone(), annotation }
        };
        for ([x, y], size, [left, top]) in [
            ([100.0, 50.0], [60, 40], [70_u32, 30]),
            ([15.0, 95.0], [60, 40], [0, 60]),
            ([190.0, 50.0], [60, 400], [140, 0]),
            ([100.0, 50.0], [200, 100], [0, 0]),
        ] {
            let cropped = at(x, y).cropped(size);
            let moved = at(x - f64::from(left), y - f64::from(top));
            assert_eq!(cropped.annotation, moved.annotation, "{x} {y} {size:?}");
            assert_eq!(cropped.image.dimensions(), (size[0], size[1].min(100)));
            assert_eq!(cropped.image.get_pixel(3, 2).0, [left as u8 + 3, top as u8 + 2, 0]);
        }
    }
}

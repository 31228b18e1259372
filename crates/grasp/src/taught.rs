//! A demonstration in a model: cropped to the part, with the data that are compared with images.

use image::RgbImage;
use nalgebra::{Point2, Vector2};
use sdg_comparison::{ComparisonConfig, Reference};
use sdg_demonstration::{Annotation, Demonstration};
use sdg_geometry::{BoundingBox, GraspLine, Keypoint, PlanarGrasp, PlanarSimilarity, Polygon};
use std::sync::{Arc, OnceLock};

use crate::check_config::CheckConfig;
use crate::colors::{Colors, gray};
use crate::decimal::decimal;
use crate::prepared::{Prepared, PreparedSizes, WorkingSize};
use crate::sizes::SizeRange;
use crate::taught_marks::{TaughtMarks, extent};
use crate::{GraspError, NUM_KEYPOINTS};

/// Margin in pixels around the part, so that gradients at the outline use both sides. Chosen by hand, not measured.
pub(crate) const MARGIN_PX: f64 = 16.0;

/// Maximum number of vertices of an outline: the time of a model's start grows with it. For a round part with a
/// diameter of 1,000 pixels, vertices are then 12 pixels apart, and edges within 0.04 pixels of the circle.
const MAX_VERTICES: usize = 256;

/// The cut-out, its marks, and the data that are compared with images.
#[derive(Debug, Clone)]
pub struct TaughtDemonstration {
    /// The photo, cropped to the part and a margin.
    pub cutout: RgbImage,
    /// The marks on the cut-out.
    pub marks: TaughtMarks,
    prepared: PreparedSizes,
    /// The cut-out without colours, for pictures without colours.
    gray: OnceLock<RgbImage>,
    prepared_gray: PreparedSizes,
    reference: OnceLock<Reference>,
    finer_reference: OnceLock<Reference>,
    check: CheckConfig,
}

impl TaughtDemonstration {
    /// Crops a demonstration to its part.
    ///
    /// # Errors
    /// A demonstration without a marked grasp, or without a shape to compare in the outline.
    pub fn new(demonstration: &Demonstration) -> Result<Self, GraspError> {
        let Annotation { label, bbox, jaw_width, outline, .. } = &demonstration.annotation;
        let grasp = *demonstration.annotation.require_grasp()?;
        demonstration.annotation.check()?;
        let (width, height) = demonstration.image.dimensions();
        let BoundingBox { x1, y1, x2, y2 } = extent(bbox, &grasp);
        let cut = BoundingBox { x1: x1 - MARGIN_PX, y1: y1 - MARGIN_PX, x2: x2 + MARGIN_PX, y2: y2 + MARGIN_PX }
            .clip(f64::from(width), f64::from(height));
        let (left, top) = (cut.x1.floor(), cut.y1.floor());
        let (right, bottom) = (cut.x2.ceil(), cut.y2.ceil());
        let cutout = image::imageops::crop_imm(
            &demonstration.image,
            left as u32,
            top as u32,
            (right - left) as u32,
            (bottom - top) as u32,
        )
        .to_image();

        let to_cutout = Vector2::new(-left, -top);
        let moved = |p: &Point2<f64>| (p + to_cutout).map(decimal);
        let corners = bbox.corners();
        let (upper_left, lower_right) = (moved(&corners[0]), moved(&corners[2]));
        let bbox = BoundingBox { x1: upper_left.x, y1: upper_left.y, x2: lower_right.x, y2: lower_right.y };
        let outline = outline.as_ref().map(|o| Polygon { vertices: o.vertices.iter().map(moved).collect() });
        let grasp = GraspLine::new(moved(&grasp.start), moved(&grasp.end));
        let width_px = decimal(jaw_width.unwrap_or_else(|| {
            // Without an outline, the width is measured across the box, which overestimates it, so that the gripper
            // opens wider than necessary.
            grasp.opening_across(&outline.clone().unwrap_or_else(|| Polygon::from_box(&bbox)))
        }));
        Self::from_parts(
            cutout,
            TaughtMarks {
                label: label.clone(),
                bbox,
                grasp,
                outline,
                width_px,
                photo_size: Some([width, height]),
                photo_middle: Some([0.5 * f64::from(width) - left, 0.5 * f64::from(height) - top]),
            },
        )
    }

    /// Restores a stored demonstration.
    ///
    /// # Errors
    /// A cut-out without a shape to compare in the outline.
    pub fn from_parts(cutout: RgbImage, marks: TaughtMarks) -> Result<Self, GraspError> {
        Self::with_config(cutout, marks, CheckConfig::DEFAULT)
    }

    pub(crate) fn with_config(
        cutout: RgbImage,
        mut marks: TaughtMarks,
        check: CheckConfig,
    ) -> Result<Self, GraspError> {
        check.check()?;
        marks.outline = marks.outline.map(|outline| outline.thinned(MAX_VERTICES));
        let made = Self {
            cutout,
            marks,
            prepared: PreparedSizes::default(),
            gray: OnceLock::new(),
            prepared_gray: PreparedSizes::default(),
            reference: OnceLock::new(),
            finer_reference: OnceLock::new(),
            check,
        };
        // Errors of a demonstration must appear here, not at the first picture.
        let own_size = &SizeRange::all(None, [1, 1], &made.check.search.scales)[0];
        made.prepared(own_size, Colors::There)?;
        Ok(made)
    }

    /// The demonstration prepared for pictures in which the part has a size in `range`, with or without colours, and
    /// the resizing of those pictures.
    ///
    /// # Errors
    /// A part without a shape to compare at that size.
    pub(crate) fn prepared(
        &self,
        range: &SizeRange,
        colors: Colors,
    ) -> Result<(WorkingSize, Arc<Prepared>), GraspError> {
        let working = self.working(range);
        let (cutout, prepared) = match colors {
            Colors::There => (&self.cutout, &self.prepared),
            Colors::None => (self.gray.get_or_init(|| gray(&self.cutout)), &self.prepared_gray),
        };
        let prepared = prepared.get(cutout, &self.marks, &working, range, &self.check.search)?;
        Ok((working, prepared))
    }

    /// The resizing of pictures in which the part has a size in `range`.
    pub(crate) fn working(&self, range: &SizeRange) -> WorkingSize {
        let bounds = self.marks.region().bounds();
        WorkingSize::new(bounds.width().max(bounds.height()), range.middle())
    }

    /// The data that the model's comparison network compares with pictures.
    pub(crate) fn reference(&self, config: &ComparisonConfig) -> &Reference {
        self.reference.get_or_init(|| Reference::new(&self.cutout, &self.marks.region(), config))
    }

    /// As [`Self::reference`], in views of twice the resolution.
    pub(crate) fn finer_reference(&self, config: &ComparisonConfig) -> &Reference {
        let made = || Reference::new(&self.cutout, &self.marks.region(), &config.finer());
        self.finer_reference.get_or_init(made)
    }

    /// The demonstration with other settings of comparison and search. These are not stored: a model read from a file
    /// has the size tolerance and the change of the score's bias from teaching, and otherwise the defaults.
    ///
    /// # Errors
    /// A value out of range, or a cut-out without a shape to compare in the outline.
    pub fn with_check(self, check: CheckConfig) -> Result<Self, GraspError> {
        Self::with_config(self.cutout, self.marks, check)
    }

    /// The settings of comparison and search.
    pub fn check(&self) -> &CheckConfig {
        &self.check
    }

    /// The twelve keypoints, in pixels of the cut-out.
    pub fn keypoints(&self) -> Vec<Keypoint> {
        self.marks.grasp.keypoints(NUM_KEYPOINTS)
    }

    /// The grasp for a pose of the cut-out in an image.
    pub fn grasp(&self, image_from_cutout: &PlanarSimilarity) -> PlanarGrasp {
        let line = self.marks.grasp.transformed(image_from_cutout);
        PlanarGrasp::from_line(&line, self.marks.width_px * image_from_cutout.scale)
    }

    /// The outline for a pose of the cut-out in an image; the box's corners if no outline was drawn.
    pub fn outline(&self, image_from_cutout: &PlanarSimilarity) -> Polygon {
        self.marks.region().transformed(image_from_cutout)
    }
}

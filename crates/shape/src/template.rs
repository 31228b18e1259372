//! A demonstration prepared for comparison with images.

use image::RgbImage;
use nalgebra::Point2;
use sdg_geometry::{PlanarSimilarity, Polygon};

use crate::alignment::PointLanes;
use crate::config::{MIN_POINTS, ShapeConfig, check_config};
use crate::edge_points::{EdgePoint, EdgeSelection, rms_radius, select_edge_points};
use crate::error::ShapeError;
use crate::gradient_field::{GradientField, GradientLevel};
use crate::pose::{LevelMap, Pose};
use crate::sightings::FIRST_REACH;

/// Minimum length of the longer side of an outline's box, in demonstration pixels. Chosen by hand, not measured.
const MIN_EXTENT_PX: f64 = 12.0;
/// Minimum extent of the part at the finest level, in level pixels; a smaller part is read at full resolution. Chosen
/// by hand, not measured.
const FINEST_EXTENT: f64 = 400.0;
/// Minimum extent of the part at the coarsest level, in level pixels. Chosen by hand, not measured.
const COARSEST_EXTENT: f64 = 32.0;
/// The score is divided by the share of the template inside the image, but by at least this value. Chosen by hand, not
/// measured.
const MIN_VISIBLE: f64 = 0.6;

/// The edges of one demonstrated part, ready to be compared with images.
#[derive(Debug, Clone)]
pub struct ShapeTemplate {
    pub(crate) config: ShapeConfig,
    /// Pivot of all poses, in demonstration pixels.
    pub(crate) center: Point2<f64>,
    /// Finest first.
    pub(crate) levels: Vec<TemplateLevel>,
    pub(crate) agreement_level_idx: usize,
}

/// Margin read around the edge points, in level pixels: along their normals, and for interpolation between pixels.
const BESIDE: f64 = (FIRST_REACH + 4) as f64;

/// The edge points at one pyramid level of the demonstration.
#[derive(Debug, Clone)]
pub(crate) struct TemplateLevel {
    /// Demonstration pixels per level pixel, a power of two.
    pub(crate) pixel_size: f64,
    /// Root mean square distance of the points from the centre, in demonstration pixels.
    pub(crate) radius_px: f64,
    /// Largest distance of a point from the centre, in demonstration pixels.
    reach_px: f64,
    pub(crate) points: Vec<EdgePoint>,
    lanes: PointLanes,
}

impl ShapeTemplate {
    /// Reads the part's edges from the demonstration.
    ///
    /// # Units and frames
    /// `outline` is in pixels of `image`. A box is accepted as an outline, but is less exact: the
    /// background's edges inside it count as the part's.
    ///
    /// # Errors
    /// [`ShapeError`] for an outline without an area or outside the image, for a part without edges,
    /// and for a configuration out of range.
    pub fn new(image: &RgbImage, outline: &Polygon, config: &ShapeConfig) -> Result<Self, ShapeError> {
        Self::with_inner_edges(image, outline, config, 1.0)
    }

    /// As [`Self::new`], with the edges along the outline only.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn of_outline(image: &RgbImage, outline: &Polygon, config: &ShapeConfig) -> Result<Self, ShapeError> {
        Self::with_inner_edges(image, outline, config, 0.0)
    }

    fn with_inner_edges(
        image: &RgbImage,
        outline: &Polygon,
        config: &ShapeConfig,
        inner_weight: f64,
    ) -> Result<Self, ShapeError> {
        check_config(config)?;
        let outline = checked_outline(image, outline)?;
        let bounds = outline.bounds();
        let extent = bounds.width().max(bounds.height());
        let center = bounds.center();
        let field = GradientField::with_config(image, &config.gradient);
        let levels_to = |extent_in_level: f64| (extent / extent_in_level).log2().floor().max(0.0) as usize;
        let last = field.num_levels() - 1;
        let finest = levels_to(FINEST_EXTENT).min(last);
        let coarsest = levels_to(COARSEST_EXTENT).clamp(finest, last);

        let mut levels = Vec::new();
        for idx in finest..=coarsest {
            let pixel_size = (1u32 << idx) as f64;
            let selection = EdgeSelection {
                outline: &outline,
                center,
                max_points: if idx == coarsest && idx > finest {
                    config.max_points.div_ceil(3)
                } else {
                    config.max_points
                },
                outline_weight: config.outline_weight,
                inner_weight,
            };
            let points = select_edge_points(field.level(idx), pixel_size, &selection);
            if points.len() < MIN_POINTS {
                if levels.is_empty() {
                    return Err(ShapeError::TooFewEdges { expected: MIN_POINTS, found: points.len() });
                }
                // Coarser levels are needed only for initial poses with larger errors.
                break;
            }
            let lanes = PointLanes::new(&points);
            let reach_px =
                points.iter().map(|point| f64::from(point.offset[0].hypot(point.offset[1]))).fold(0.0, f64::max);
            levels.push(TemplateLevel { pixel_size, radius_px: rms_radius(&points), reach_px, points, lanes });
        }
        let agreement_level_idx = levels_to(config.agreement.extent).saturating_sub(finest).min(levels.len() - 1);
        Ok(Self { config: config.clone(), center, levels, agreement_level_idx })
    }

    /// Root mean square distance of the finest edges from the pivot, in demonstration pixels.
    pub(crate) fn radius_px(&self) -> f64 {
        self.levels[0].radius_px
    }

    /// The agreement of the part's edges at this pose with the image's, in `[0, 1]`.
    ///
    /// At 1, every edge of the demonstration lies on an edge of the same direction. Random directions and areas without
    /// edges give 0. Points outside the image do not count, as long as they have at most 40 % of the weight.
    ///
    /// # Units and frames
    /// The pose maps demonstration pixels to pixels of the image the field was computed from.
    pub fn agreement(&self, field: &GradientField, image_from_demonstration: &PlanarSimilarity) -> f64 {
        let pose = Pose::from_similarity(image_from_demonstration, self.center);
        self.agreement_at(field, &pose)
    }

    pub(crate) fn agreement_at(&self, field: &GradientField, pose: &Pose) -> f64 {
        let level = &self.levels[self.agreement_level_idx];
        let matched = level.matched_level(field, pose, [0.0; 4]);
        matched.mean_alignment(level, pose, LevelSampling::Bilinear).max(0.0)
    }
}

/// How a level is read: `Nearest` is fast, for the grid of poses; `Bilinear` is exact, for hill climbing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum LevelSampling {
    Nearest,
    Bilinear,
}

/// The image level that has the resolution of a template level.
pub(crate) struct MatchedLevel<'a> {
    pub(crate) image_level: &'a GradientLevel,
    /// Image pixels per pixel of `image_level`.
    pub(crate) image_pixel_size: f64,
}

impl TemplateLevel {
    /// The image level whose resolution matches this level at the pose `start`. It can be read at all poses that differ
    /// from `start` by at most `limits` (px, px, rad, ln scale).
    pub(crate) fn matched_level<'a>(
        &self,
        field: &'a GradientField,
        start: &Pose,
        limits: [f64; 4],
    ) -> MatchedLevel<'a> {
        let idx = field.level_idx_for(self.pixel_size * start.log_scale.exp());
        let image_pixel_size = (1u32 << idx) as f64;
        let shift = limits[0].hypot(limits[1]);
        let reach = self.reach_px * (start.log_scale + limits[3]).exp() + shift + BESIDE * image_pixel_size;
        MatchedLevel { image_level: field.level_about(idx, &start.center, reach), image_pixel_size }
    }
}

impl MatchedLevel<'_> {
    /// Weighted mean of cos 2(difference of directions), image gradients below the noise counting as 0;
    /// in `[-1, 1]`.
    pub(crate) fn mean_alignment(&self, level: &TemplateLevel, pose: &Pose, sampling: LevelSampling) -> f64 {
        let map = pose.level_map(self.image_pixel_size);
        let (sum, visible) = match sampling {
            LevelSampling::Nearest => self.nearest_sums(level, &map),
            LevelSampling::Bilinear => level.lanes.sums(self.image_level, &map),
        };
        f64::from(sum) / f64::from(visible).max(MIN_VISIBLE)
    }

    /// Weighted sum of the alignments over the points inside the image, and the sum of their weights.
    fn nearest_sums(&self, level: &TemplateLevel, map: &LevelMap) -> (f32, f32) {
        let (mut sum, mut visible) = (0.0f32, 0.0f32);
        for point in &level.points {
            let [x, y] = map.apply(point.offset);
            if let Some([dx, dy, _]) = self.image_level.nearest(x, y) {
                let [ex, ey] = map.turn_double(point.double);
                sum += point.weight * (dx * ex + dy * ey);
                visible += point.weight;
            }
        }
        (sum, visible)
    }
}

/// The outline, or the reason why it cannot be used.
fn checked_outline(image: &RgbImage, outline: &Polygon) -> Result<Polygon, ShapeError> {
    if outline.vertices.len() < 3 {
        return Err(ShapeError::OutlineDegenerate { found: format!("{} vertices", outline.vertices.len()) });
    }
    if let Some(v) = outline.vertices.iter().find(|v| !(v.x.is_finite() && v.y.is_finite())) {
        return Err(ShapeError::OutlineDegenerate { found: format!("a vertex at ({}, {})", v.x, v.y) });
    }
    let inside = outline.bounds().clip(f64::from(image.width()), f64::from(image.height()));
    let [short, long] = [inside.width().min(inside.height()), inside.width().max(inside.height())];
    if short < 1.0 || long < MIN_EXTENT_PX {
        return Err(ShapeError::OutlineTooSmall {
            expected_px: MIN_EXTENT_PX,
            width: image.width(),
            height: image.height(),
            found_width_px: inside.width(),
            found_height_px: inside.height(),
        });
    }
    Ok(outline.clip(f64::from(image.width()), f64::from(image.height())))
}

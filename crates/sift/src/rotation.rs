//! The rotation of a part relative to its template, from its texture, or from its outline if there is too little
//! texture.

use nalgebra::Point2;
use sdg_geometry::{Angle, Mask, PlanarSimilarity};

use crate::guided::matches_at_pose;
use crate::ransac::{KeypointPair, RansacConfig, fit_similarity};
use crate::sift::check_mask;
use crate::silhouette::Silhouette;
use crate::{Features, Plane, Sift, SiftError, match_features};

/// Settings of [`RotationEstimator`].
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RotationConfig {
    /// Maximum ratio of a match; see [`match_features`].
    pub ratio: f32,
    /// Settings of the search for a similarity.
    pub ransac: RansacConfig,
    /// Pixels by which a mask is widened for keypoints: keypoints of a part's corners are just outside its outline.
    pub mask_margin_px: u32,
    /// Minimum overlap of the outlines, from 0 to 1, for a rotation from the outlines.
    pub min_overlap: f64,
}

impl Default for RotationConfig {
    fn default() -> Self {
        Self { ratio: 0.8, ransac: RansacConfig::default(), mask_margin_px: 3, min_overlap: 0.6 }
    }
}

/// Estimates the rotation, scale and shift of a part relative to its template.
#[derive(Default)]
pub struct RotationEstimator {
    sift: Sift,
    config: RotationConfig,
}

/// A part as demonstrated.
pub struct RotationTemplate {
    features: Features,
    silhouette: Option<Silhouette>,
}

impl RotationTemplate {
    /// The features on the part.
    pub fn features(&self) -> &Features {
        &self.features
    }
}

/// The pose of a part relative to its template, and the source of that pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotationEstimate {
    /// The rotation from the template to the image; positive is clockwise as seen.
    pub angle: Angle,
    /// The whole pose, in pixels.
    pub image_from_template: PlanarSimilarity,
    /// The source of the rotation.
    pub method: RotationMethod,
    /// Intersection over union of the two masks at this pose, if both were given.
    pub overlap: Option<f64>,
}

/// The source of a rotation, and figures of its reliability.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum RotationMethod {
    /// Matched keypoints.
    Features {
        /// Matches that passed the ratio test.
        matches: usize,
        /// Matches that agree with the pose.
        inliers: usize,
        /// Keypoints of the template found at the pose, including repeated texture; the final pose is computed from
        /// them if there are at least as many as inliers.
        guided_matches: usize,
        /// Root mean square distance of the matches from which the final pose is computed, in pixels.
        residual_px: f64,
        /// Decimal logarithm of the expected number of equally good agreements by chance.
        log10_false_alarms: f64,
    },
    /// The outlines of the two masks, because too few keypoints agreed.
    Silhouette {
        /// Intersection over union at the second best rotation. If it is close to the estimate's overlap, the
        /// outline is similar at both rotations, and the estimate is unreliable.
        runner_up_overlap: f64,
    },
}

impl RotationEstimate {
    /// Whether the overlap of the outlines at another rotation is lower by less than 0.03; never true for matched
    /// keypoints.
    pub fn is_ambiguous(&self) -> bool {
        match self.method {
            RotationMethod::Features { .. } => false,
            RotationMethod::Silhouette { runner_up_overlap } => {
                self.overlap.is_none_or(|overlap| overlap - runner_up_overlap < 0.03)
            }
        }
    }
}

impl RotationEstimator {
    /// An estimator with these settings.
    ///
    /// # Errors
    /// A setting outside its range.
    pub fn new(sift: Sift, config: RotationConfig) -> Result<Self, SiftError> {
        let refuse = |name, expected, found| Err(SiftError::BadSetting { name, expected, found });
        if !(config.ratio > 0.0 && config.ratio <= 1.0) {
            return refuse("ratio", "above 0 and at most 1", config.ratio.into());
        }
        if !(0.0..=1.0).contains(&config.min_overlap) {
            return refuse("min_overlap", "from 0 to 1", config.min_overlap);
        }
        config.ransac.check()?;
        Ok(Self { sift, config })
    }

    /// Makes a template from an image of the part and, if there is one, the part's mask. Without a mask, the whole
    /// image is taken for the part.
    ///
    /// # Errors
    /// A mask whose size differs from the image's; a template with fewer than three keypoints and without a usable
    /// mask.
    pub fn template(&self, image: &Plane, mask: Option<&Mask>) -> Result<RotationTemplate, SiftError> {
        let features = self.features(image, mask)?;
        let silhouette = mask.and_then(Silhouette::new);
        if silhouette.is_none() && features.len() < MIN_KEYPOINTS {
            return Err(SiftError::BareTemplate { expected: MIN_KEYPOINTS, found: features.len() });
        }
        Ok(RotationTemplate { features, silhouette })
    }

    /// Finds the part in an image, inside the mask if there is one. `None` if neither texture nor outline determines
    /// a rotation.
    ///
    /// The keypoints are used if more of them agree than by chance; otherwise the outlines, if both masks were
    /// given. The result is deterministic.
    ///
    /// # Errors
    /// A mask whose size differs from the image's.
    pub fn estimate(
        &self,
        template: &RotationTemplate,
        image: &Plane,
        mask: Option<&Mask>,
    ) -> Result<Option<RotationEstimate>, SiftError> {
        let features = self.features(image, mask)?;
        let silhouette = mask.and_then(Silhouette::new);
        let outlines = template.silhouette.as_ref().zip(silhouette.as_ref());
        let pixels = mask.map_or(image.width() * image.height(), Mask::area);

        if let Some((pose, method)) = self.pose_by_features(&template.features, &features, pixels as f64) {
            let overlap = outlines.map(|(ours, theirs)| ours.overlap(theirs, &pose));
            return Ok(Some(RotationEstimate { angle: pose.angle, image_from_template: pose, method, overlap }));
        }
        let fit = outlines.and_then(|(ours, theirs)| ours.lay_on(theirs));
        Ok(fit.filter(|fit| fit.overlap >= self.config.min_overlap).map(|fit| RotationEstimate {
            angle: fit.image_from_template.angle,
            image_from_template: fit.image_from_template,
            method: RotationMethod::Silhouette { runner_up_overlap: fit.runner_up_overlap },
            overlap: Some(fit.overlap),
        }))
    }

    fn features(&self, image: &Plane, mask: Option<&Mask>) -> Result<Features, SiftError> {
        check_mask(image, mask)?;
        let widened = mask.map(|mask| widened(mask, self.config.mask_margin_px));
        self.sift.detect_and_describe(image, widened.as_ref())
    }

    fn pose_by_features(
        &self,
        template: &Features,
        image: &Features,
        search_area: f64,
    ) -> Option<(PlanarSimilarity, RotationMethod)> {
        let matches = match_features(template, image, self.config.ratio);
        let pairs: Vec<KeypointPair> =
            matches.iter().map(|m| (template.keypoints[m.query_idx], image.keypoints[m.train_idx])).collect();
        let fit = fit_similarity(&pairs, search_area, &self.config.ransac)?;

        let guided = matches_at_pose(template, image, &fit.image_from_template, &self.config.ransac);
        let from: Vec<Point2<f64>> = guided.iter().map(|&(i, _)| template.keypoints[i].position).collect();
        let to: Vec<Point2<f64>> = guided.iter().map(|&(_, j)| image.keypoints[j].position).collect();
        // The new pose is used only if it comes from at least as many matches as the fit has inliers.
        let refined = PlanarSimilarity::fit(&from, &to).filter(|_| guided.len() >= fit.inliers.len());
        let (pose, residual_px) = match refined {
            Some(pose) => {
                let squares: f64 = from.iter().zip(&to).map(|(a, b)| (pose.apply(a) - b).norm_squared()).sum();
                (pose, (squares / from.len() as f64).sqrt())
            }
            None => (fit.image_from_template, fit.residual_px),
        };
        let method = RotationMethod::Features {
            matches: matches.len(),
            inliers: fit.inliers.len(),
            guided_matches: guided.len(),
            residual_px,
            log10_false_alarms: fit.log10_false_alarms,
        };
        Some((pose, method))
    }
}

/// Minimum number of keypoints for an agreement beyond chance.
const MIN_KEYPOINTS: usize = 3;

/// The mask and all pixels within `margin` of it, along rows and columns.
fn widened(mask: &Mask, margin: u32) -> Mask {
    let (width, height) = (mask.width(), mask.height());
    let reach = |at: u32, size: u32| at.saturating_sub(margin)..at.saturating_add(margin + 1).min(size);
    let along_rows = Mask::from_fn(width, height, |x, y| reach(x, width).any(|x| mask.get(x, y)));
    Mask::from_fn(width, height, |x, y| reach(y, height).any(|y| along_rows.get(x, y)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widening_adds_a_rim_and_stops_at_the_border() {
        let mask = Mask::from_fn(9, 7, |x, y| (x, y) == (1, 3));
        let wide = widened(&mask, 2);
        assert_eq!(wide.area(), 4 * 5);
        assert!(wide.get(0, 1) && wide.get(3, 5) && !wide.get(4, 3));
        assert_eq!(widened(&mask, 0), mask);
    }

    #[test]
    fn settings_are_checked() {
        let ransac = RansacConfig { tolerance_px: 0.0, ..RansacConfig::default() };
        let config = RotationConfig { ransac, ..RotationConfig::default() };
        let error = RotationEstimator::new(Sift::default(), config).err().unwrap();
        assert_eq!(error.to_string(), "expected tolerance_px above 0, found 0");
    }
}

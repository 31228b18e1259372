//! Boxes with errors like those of a detector.

use rand::Rng;
use sdg_geometry::BoundingBox;
use sdg_orientation::{OrientationError, check_setting};

/// The error range of a box, uniformly distributed for each axis.
///
/// With 6 % of position and 12 % of size on both axes, the IoU with the true box is at least 0.77.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxJitter {
    /// Maximum shift of the centre, as a fraction of the box's width and height.
    pub position: f64,
    /// Maximum change of width and height: factors between e^-size and e^size.
    pub size: f64,
}

impl BoxJitter {
    /// No errors.
    pub const NONE: Self = Self { position: 0.0, size: 0.0 };

    /// Samples a box near `bbox`.
    pub fn apply(&self, bbox: &BoundingBox, rng: &mut impl Rng) -> BoundingBox {
        let mut within = |most: f64| most * (2.0 * rng.random::<f64>() - 1.0);
        let center = bbox.center();
        let (x, y) =
            (center.x + within(self.position) * bbox.width(), center.y + within(self.position) * bbox.height());
        let (half_width, half_height) =
            (0.5 * bbox.width() * within(self.size).exp(), 0.5 * bbox.height() * within(self.size).exp());
        BoundingBox { x1: x - half_width, y1: y - half_height, x2: x + half_width, y2: y + half_height }
    }

    pub(super) fn validate(&self) -> Result<(), OrientationError> {
        check_setting(
            (0.0..=0.5).contains(&self.position),
            "jitter.position",
            "a share between 0 and 0.5",
            self.position,
        )?;
        check_setting((0.0..=1.0).contains(&self.size), "jitter.size", "between 0 and 1", self.size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn boxes_are_off_by_what_is_allowed_and_no_more() {
        let jitter = BoxJitter { position: 0.06, size: 0.12 };
        let truth = BoundingBox { x1: 100.0, y1: 50.0, x2: 200.0, y2: 90.0 };
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        let drawn: Vec<BoundingBox> = (0..400).map(|_| jitter.apply(&truth, &mut rng)).collect();
        let most = |of: fn(&BoundingBox) -> f64| drawn.iter().map(of).fold(0.0, f64::max);
        let shift = most(|b| (b.center().x - 150.0).abs());
        assert!((5.5..=6.0).contains(&shift), "{shift}");
        let width = most(|b| b.width());
        assert!((112.0..=100.0 * 0.12f64.exp()).contains(&width), "{width}");
        let least = drawn.iter().map(|b| b.iou(&truth)).fold(1.0, f64::min);
        assert!((0.65..0.85).contains(&least), "{least}");
        assert_eq!(BoxJitter::NONE.apply(&truth, &mut rng), truth);
    }
}

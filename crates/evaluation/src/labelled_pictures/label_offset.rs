//! Detects labels that mark another grasp on the same part: most detections then have the same pose relative to their
//! labels.
//!
//! ```text
//! detections without a hit ─ the nearest label that was not found ─ offset in the label's frame, in diagonals, and angle
//!                                                                        └─ most of them equal? ─ LabelOffset
//! ```

use nalgebra::{Rotation2, Vector2};
use sdg_geometry::{Angle, RotationalSymmetry};
use serde::Serialize;

use super::score::{MAX_ANGLE_DEG, MAX_DISTANCE_DIAGONALS, Tested, Totals, TrueGrasp, judge};
use crate::statistics::Share;

/// Maximum distance between a label and a detection of the same part, in diagonals.
const MAX_OFFSET_DIAGONALS: f64 = 0.75;
/// Minimum number of agreeing detections.
const MIN_AGREEING: usize = 3;
/// Minimum fraction of agreeing detections among all that hit no instance but are near a label that was not found.
const MIN_AGREEING_SHARE: f64 = 0.6;

/// The common pose of detections relative to their labels.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LabelOffset {
    /// Number of detections with this offset, among all that hit no instance but are near a label that was not found.
    pub agreeing: Share,
    /// Mean offset along the label's direction, in percent of the part's diagonal.
    pub along_percent: f64,
    /// Mean offset across the label's direction, in percent of the part's diagonal.
    pub across_percent: f64,
    /// Mean length of the offsets, in pixels.
    pub px: f64,
    /// Angle from the label's direction to the detection's, in (-180, 180].
    pub turn_deg: f64,
    /// The totals with labels shifted by this offset.
    pub totals: Totals,
}

/// A detection relative to a label.
#[derive(Debug, Clone, Copy)]
struct Beside {
    /// Offset in the label's frame, in diagonals.
    offset: Vector2<f64>,
    turn: Angle,
    px: f64,
    symmetry: RotationalSymmetry,
}

impl Beside {
    /// This detection relative to an equivalent direction of the label: the one for which offset and angle are
    /// nearest to those of `other`.
    fn turned_to(&self, other: &Self) -> Self {
        let count = match self.symmetry {
            RotationalSymmetry::Fold(count) => count,
            _ => 1,
        };
        let turns = (0..count).map(|step| std::f64::consts::TAU * f64::from(step) / f64::from(count));
        let turned = turns.map(|by| Self {
            offset: Rotation2::new(-by) * self.offset,
            turn: self.turn - Angle::from_radians(by),
            ..*self
        });
        let away = |one: &Self| (one.offset - other.offset).norm() + one.turn.distance(other.turn);
        turned.min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or(*self)
    }

    fn is_like(&self, other: &Self) -> bool {
        (self.offset - other.offset).norm() <= MAX_DISTANCE_DIAGONALS
            && self.turn.distance(other.turn).to_degrees() <= MAX_ANGLE_DEG
    }
}

/// The offset between labels and detections, if most detections agree on one. Only detections count that hit no
/// instance but are near a label that was not found.
pub fn label_offset(tested: &[Tested], min_score: f64) -> Option<LabelOffset> {
    let beside: Vec<Beside> = tested.iter().flat_map(|tested| beside_labels(tested, min_score)).collect();
    let agreeing = |seed: &Beside| {
        let turned = beside.iter().map(|one| one.turned_to(seed));
        turned.filter(|one| one.is_like(seed)).collect::<Vec<_>>()
    };
    let alike = beside.iter().map(agreeing).max_by_key(Vec::len)?;
    let count = alike.len() as f64;
    if alike.len() < MIN_AGREEING || count < MIN_AGREEING_SHARE * beside.len() as f64 {
        return None;
    }
    let offset = alike.iter().map(|one| one.offset).sum::<Vector2<f64>>() / count;
    let (sin, cos) = alike
        .iter()
        .fold((0.0, 0.0), |(sin, cos), one| (sin + one.turn.radians().sin(), cos + one.turn.radians().cos()));
    let turn = Angle::from_direction(cos, sin);
    let moved: Vec<_> = tested.iter().map(|tested| judge(&moved(tested, offset, turn), min_score)).collect();
    Some(LabelOffset {
        agreeing: Share { count: alike.len(), of: beside.len() },
        along_percent: 100.0 * offset.x,
        across_percent: 100.0 * offset.y,
        px: alike.iter().map(|one| one.px).sum::<f64>() / count,
        turn_deg: turn.degrees(),
        totals: Totals::of(&moved),
    })
}

/// Each detection that hits no instance, relative to the nearest label that was not found. Detections and labels are
/// assigned one to one, in order of decreasing score.
fn beside_labels(tested: &Tested, min_score: f64) -> Vec<Beside> {
    let judged = judge(tested, min_score);
    let mut free: Vec<&TrueGrasp> = tested
        .truths
        .iter()
        .enumerate()
        .filter(|(idx, truth)| !judged.is_found(*idx) && !truth.optional)
        .filter_map(|(_, truth)| truth.grasp.as_ref())
        .filter(|grasp| grasp.symmetry != RotationalSymmetry::Full)
        .collect();
    let mut beside = Vec::new();
    for (detection, _) in tested.detections.iter().zip(&judged.hits).filter(|(_, hit)| hit.is_none()) {
        let away = |grasp: &&TrueGrasp| (detection.grasp.center() - grasp.center).norm() / grasp.diagonal_px;
        let near = free.iter().enumerate().filter(|(_, grasp)| away(grasp) <= MAX_OFFSET_DIAGONALS);
        let Some((at, grasp)) = near.min_by(|(_, a), (_, b)| away(a).total_cmp(&away(b))) else { continue };
        let shift = detection.grasp.center() - grasp.center;
        beside.push(Beside {
            offset: Rotation2::new(-grasp.angle.radians()) * shift / grasp.diagonal_px,
            turn: detection.grasp.angle - grasp.angle,
            px: shift.norm(),
            symmetry: grasp.symmetry,
        });
        free.remove(at);
    }
    beside
}

fn moved(tested: &Tested, offset: Vector2<f64>, turn: Angle) -> Tested {
    let mut moved = tested.clone();
    for grasp in moved.truths.iter_mut().filter_map(|truth| truth.grasp.as_mut()) {
        grasp.center += Rotation2::new(grasp.angle.radians()) * offset * grasp.diagonal_px;
        grasp.angle = grasp.angle + turn;
    }
    moved
}

impl LabelOffset {
    /// The offset as a sentence for the user.
    pub fn in_words(&self) -> String {
        let Self { agreeing, along_percent, across_percent, px, turn_deg, totals } = self;
        format!(
            "the labels mark a different grasp from the taught one: {} detections that hit no instance have the same \
             offset from their labels, {px:.1} px ({along_percent:.0} % of the diagonal along the label, \
             {across_percent:.0} % across) and {turn_deg:.0}°; with the labels moved by this offset, {} parts are found \
             and {} detections are wrong",
            agreeing, totals.found, totals.wrong
        )
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;
    use sdg_geometry::{BoundingBox, PlanarGrasp};
    use sdg_grasp::{GraspDetection, TurnSource};

    use super::super::picture::LabelledPicture;
    use super::super::score::Truth;
    use super::*;

    /// A part with a diagonal of 100 pixels, labelled in its centre at an angle, and a detection at an offset in the
    /// label's frame.
    fn tested(symmetry: RotationalSymmetry, degrees: f64, along: f64, across: f64, turn: f64) -> Tested {
        let (angle, center) = (Angle::from_degrees(degrees), Point2::new(300.0, 200.0));
        let grasp = TrueGrasp { center, angle, diagonal_px: 100.0, symmetry, pixel_m: None };
        let bbox = BoundingBox { x1: 260.0, y1: 170.0, x2: 340.0, y2: 230.0 };
        let found = center + Rotation2::new(angle.radians()) * Vector2::new(along, across);
        let detection = GraspDetection {
            demonstration_idx: 0,
            score: 0.9,
            network_score: 0.9,
            agreement: None,
            evidence: None,
            light: 1.0,
            bbox,
            keypoints: Vec::new(),
            outline: None,
            grasp: PlanarGrasp { x: found.x, y: found.y, angle: Angle::from_degrees(degrees + turn), width: 4.0 },
            turn_source: TurnSource::Search,
        };
        let picture = LabelledPicture {
            path: "a.png".into(),
            labels: "a.json".into(),
            size: [640, 480],
            instances: Vec::new(),
            kind: None,
        };
        let truths = vec![Truth { grasp: Some(grasp), bbox, optional: false }];
        Tested { picture, truths, detections: vec![detection], seconds: 0.0 }
    }

    #[test]
    fn labels_of_another_grasp_are_recognised() {
        let none = RotationalSymmetry::None;
        let mut pictures: Vec<Tested> =
            (0..9).map(|i| tested(none, 40.0 * f64::from(i), 20.0 + 0.3 * f64::from(i), -10.0, 90.0)).collect();
        pictures.push(tested(none, 10.0, -50.0, 30.0, 10.0));
        let offset = label_offset(&pictures, 0.5).unwrap();
        assert_eq!(offset.agreeing, Share { count: 9, of: 10 });
        assert!(
            (offset.along_percent - 21.2).abs() < 1e-6 && (offset.across_percent + 10.0).abs() < 1e-6,
            "{offset:?}"
        );
        assert!((offset.turn_deg - 90.0).abs() < 1e-6);
        assert_eq!((offset.totals.found, offset.totals.wrong), (Share { count: 9, of: 10 }, 1));
        assert!(offset.in_words().contains("9 of 10"), "{}", offset.in_words());
    }

    #[test]
    fn a_part_that_looks_alike_after_half_a_turn_may_be_labelled_either_way() {
        let fold = RotationalSymmetry::Fold(2);
        let pictures: Vec<Tested> =
            (0..6)
                .map(|i| {
                    if i % 2 == 0 {
                        tested(fold, 30.0, 20.0, 5.0, 0.0)
                    } else {
                        tested(fold, 210.0, -20.0, -5.0, 180.0)
                    }
                })
                .collect();
        assert_eq!(label_offset(&pictures, 0.5).unwrap().agreeing, Share { count: 6, of: 6 });
    }

    #[test]
    fn what_is_wrong_in_several_ways_or_right_is_no_offset() {
        let none = RotationalSymmetry::None;
        let all_ways: Vec<Tested> = (0..9)
            .map(|i| tested(none, 0.0, 12.0 * f64::from(i % 5) - 30.0, 6.0 * f64::from(i % 3), 40.0 * f64::from(i)))
            .collect();
        assert_eq!(label_offset(&all_ways, 0.5), None);
        let right: Vec<Tested> = (0..9).map(|i| tested(none, 40.0 * f64::from(i), 1.0, 1.0, 2.0)).collect();
        assert_eq!(label_offset(&right, 0.5), None);
        let few: Vec<Tested> = (0..2).map(|i| tested(none, 40.0 * f64::from(i), 20.0, 0.0, 0.0)).collect();
        assert_eq!(label_offset(&few, 0.5), None);
    }
}

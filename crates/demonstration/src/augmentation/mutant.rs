//! Distractors made from the part's own pieces.

use nalgebra::{Point2, Rotation2, Vector2};
use sdg_geometry::Polygon;

use super::random::{SampleRng, chance, index_below, log_uniform, uniform};

/// A mutant counts as the part itself if the overlap (IoU) of their silhouettes, at similar size, reaches this at any
/// angle.
const TOO_ALIKE_IOU: f64 = 0.8;
/// Maximum number of mutants per demonstration.
const BANK_SIZE: usize = 24;

/// A map of positions from a mutant to the part, both relative to the part's centre, in photo pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mutant {
    kind: Kind,
    /// The direction of the change.
    axis: Vector2<f32>,
    /// Radius around the centre that contains the whole mutant, in photo pixels.
    pub radius: f32,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// Only the piece beyond `offset` along the axis.
    Piece { offset: f32 },
    /// Longer or shorter along the axis.
    Stretched { factor: f32 },
    /// One half and its mirror image.
    Doubled { offset: f32 },
    /// Moved across the axis by `bend` · (position along it)².
    Bent { bend: f32 },
    /// Left and right exchanged.
    Mirrored,
    /// Unchanged: useful only for another part.
    Whole,
}

impl Mutant {
    /// The source of the colour at the mutant's point `p`, and the distance from the cut there (positive: kept).
    #[inline(always)]
    pub fn source(&self, p: Vector2<f32>) -> (Vector2<f32>, f32) {
        const UNCUT: f32 = 1e6;
        let along = p.dot(&self.axis);
        let across = Vector2::new(-self.axis.y, self.axis.x);
        match self.kind {
            Kind::Piece { offset } => (p, along - offset),
            Kind::Stretched { factor } => (p + self.axis * (along / factor - along), UNCUT),
            Kind::Doubled { offset } if along < offset => (p + self.axis * (2.0 * (offset - along)), UNCUT),
            Kind::Doubled { .. } => (p, UNCUT),
            Kind::Bent { bend } => (p - across * (bend * along * along), UNCUT),
            Kind::Mirrored => (p - self.axis * (2.0 * along), UNCUT),
            Kind::Whole => (p, UNCUT),
        }
    }

    /// An unchanged part, all of which lies within `radius` of its centre.
    pub fn whole(radius: f32) -> Self {
        Self { kind: Kind::Whole, axis: Vector2::new(1.0, 0.0), radius }
    }

    /// Mutants of a part that do not look like it at any angle; the mirror image of a symmetric part does, and is left
    /// out.
    pub fn bank(region: &Polygon, center: Point2<f64>, area_points: &[Point2<f64>], rng: &mut SampleRng) -> Vec<Self> {
        let around: Vec<Vector2<f32>> = area_points.iter().map(|p| (p - center).cast()).collect();
        let radius = region.vertices.iter().map(|v| (v - center).norm()).fold(1.0, f64::max) as f32;
        let silhouette = Silhouette::new(region, center);
        let mut bank = Vec::new();
        for _ in 0..BANK_SIZE * 3 {
            let mutant = Self::draw(&around, radius, rng);
            if bank.len() < BANK_SIZE && silhouette.max_iou(&mutant) < TOO_ALIKE_IOU {
                bank.push(mutant);
            }
        }
        bank
    }

    fn draw(around: &[Vector2<f32>], radius: f32, rng: &mut SampleRng) -> Self {
        let long = principal_axis(around);
        let turn = uniform(rng, -0.4, 0.4);
        let mut axis = Rotation2::new(turn) * long;
        if chance(rng, 0.5) {
            axis = -axis;
        }
        let mut places: Vec<f32> = around.iter().map(|p| p.dot(&axis)).collect();
        places.sort_by(f32::total_cmp);
        let quantile = |q: f32| places[((places.len() - 1) as f32 * q) as usize];
        let half_length = places[places.len() - 1].abs().max(places[0].abs()).max(1.0);
        let (kind, grown) = match index_below(rng, 10) {
            0..=2 => (Kind::Piece { offset: quantile(uniform(rng, 0.45, 0.7)) }, 1.0),
            3..=4 => {
                let factor = if chance(rng, 0.5) { log_uniform(rng, 1.5, 2.1) } else { log_uniform(rng, 0.45, 0.62) };
                (Kind::Stretched { factor }, factor.max(1.0))
            }
            5..=6 => (Kind::Doubled { offset: quantile(uniform(rng, 0.4, 0.6)) }, 1.6),
            7..=8 => {
                let sign = if chance(rng, 0.5) { 1.0 } else { -1.0 };
                (Kind::Bent { bend: sign * uniform(rng, 0.25, 0.6) / half_length }, 1.5)
            }
            _ => (Kind::Mirrored, 1.0),
        };
        Self { kind, axis, radius: radius * grown }
    }
}

/// The direction of the points' largest spread.
fn principal_axis(points: &[Vector2<f32>]) -> Vector2<f32> {
    let (xx, xy, yy) =
        points.iter().fold((0.0, 0.0, 0.0), |(xx, xy, yy), p| (xx + p.x * p.x, xy + p.x * p.y, yy + p.y * p.y));
    let angle = 0.5 * (2.0f32 * xy).atan2(xx - yy);
    Vector2::new(angle.cos(), angle.sin())
}

/// The part's outline on a coarse grid, about its centre.
struct Silhouette {
    inside: Vec<bool>,
    cell: f32,
    area: f32,
}

const GRID: i32 = 48;

impl Silhouette {
    fn new(region: &Polygon, center: Point2<f64>) -> Self {
        let radius = region.vertices.iter().map(|v| (v - center).norm()).fold(1.0, f64::max);
        let cell = (2.0 * radius / f64::from(GRID)) as f32;
        let place = |i: i32| (i as f32 + 0.5 - GRID as f32 / 2.0) * cell;
        let at = |x: i32, y: i32| Point2::new(f64::from(place(x)) + center.x, f64::from(place(y)) + center.y);
        let inside: Vec<bool> = (0..GRID * GRID).map(|i| region.contains(&at(i % GRID, i / GRID))).collect();
        let area = inside.iter().filter(|&&cell| cell).count() as f32 * cell * cell;
        Self { inside, cell, area }
    }

    fn holds(&self, p: Vector2<f32>) -> bool {
        let index = |v: f32| (v / self.cell + GRID as f32 / 2.0).floor() as i32;
        let (x, y) = (index(p.x), index(p.y));
        (0..GRID).contains(&x) && (0..GRID).contains(&y) && self.inside[(y * GRID + x) as usize]
    }

    /// The largest overlap (IoU) of the mutant's silhouette with the part's over all angles, with equal centres. The
    /// areas are equalised, but only as far as another height of the camera could equalise them.
    fn max_iou(&self, mutant: &Mutant) -> f64 {
        let step = mutant.radius / 30.0;
        let mut places = Vec::new();
        for y in -30..30 {
            for x in -30..30 {
                let p = Vector2::new((x as f32 + 0.5) * step, (y as f32 + 0.5) * step);
                let (source, kept) = mutant.source(p);
                if kept > 0.0 && self.holds(source) {
                    places.push(p);
                }
            }
        }
        if places.is_empty() {
            return 0.0;
        }
        let mean = places.iter().fold(Vector2::zeros(), |sum, p| sum + p) / places.len() as f32;
        let area = places.len() as f32 * step * step;
        let scale = (self.area / area).sqrt().clamp(0.75, 1.33);
        (0..72)
            .map(|turn| {
                let rotation = Rotation2::new(turn as f32 * std::f32::consts::TAU / 72.0);
                let both = places.iter().filter(|&&p| self.holds(rotation * (p - mean) * scale)).count();
                let intersection = both as f32 * (step * scale).powi(2);
                f64::from(intersection / (self.area + area * scale * scale - intersection))
            })
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::{Stream, sample_rng};
    use super::*;

    fn polygon(corners: &[(f64, f64)]) -> (Polygon, Point2<f64>) {
        let polygon = Polygon::new(corners.iter().map(|&(x, y)| Point2::new(x, y)).collect()).unwrap();
        let center = polygon.centroid();
        (polygon, center)
    }

    fn mirrored() -> Mutant {
        Mutant { kind: Kind::Mirrored, axis: Vector2::new(1.0, 0.0), radius: 200.0 }
    }

    #[test]
    fn the_mirror_image_of_a_rectangle_is_the_rectangle_and_that_of_an_l_is_not() {
        let (rectangle, center) = polygon(&[(0.0, 0.0), (160.0, 0.0), (160.0, 40.0), (0.0, 40.0)]);
        assert!(Silhouette::new(&rectangle, center).max_iou(&mirrored()) > 0.9);
        let (l, center) = polygon(&[(0.0, 0.0), (160.0, 0.0), (160.0, 30.0), (30.0, 30.0), (30.0, 80.0), (0.0, 80.0)]);
        assert!(Silhouette::new(&l, center).max_iou(&mirrored()) < TOO_ALIKE_IOU);
    }

    #[test]
    fn a_bank_holds_several_kinds_and_none_that_looks_like_the_part() {
        let (l, center) = polygon(&[(0.0, 0.0), (160.0, 0.0), (160.0, 30.0), (30.0, 30.0), (30.0, 80.0), (0.0, 80.0)]);
        let points: Vec<_> = (0..160)
            .flat_map(|x| (0..80).map(move |y| Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5)))
            .filter(|p| l.contains(p))
            .collect();
        let bank = Mutant::bank(&l, center, &points, &mut sample_rng(1, Stream::Preparation, 0));
        assert_eq!(bank.len(), BANK_SIZE);
        let kinds: std::collections::BTreeSet<String> =
            bank.iter().map(|m| format!("{:?}", m.kind).chars().take(5).collect()).collect();
        assert!(kinds.len() >= 4, "{kinds:?}");
        let silhouette = Silhouette::new(&l, center);
        assert!(bank.iter().all(|mutant| silhouette.max_iou(mutant) < TOO_ALIKE_IOU));
    }
}

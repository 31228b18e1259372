//! Parts of revolution, which lie on their side at any roll angle: screws, pins, fittings.
//!
//! Their outline is its own mirror image about a long axis, and the light on them changes across that axis in the same
//! way along its whole length. On a flat part the light does not change in this way
//! (docs/decisions/028-parts-of-revolution.md).

use image::RgbImage;
use nalgebra::{Point2, Rotation2, Vector2};
use sdg_geometry::{GraspLine, Mask, Polygon};

/// Minimum share of the part covered by its mirror image. Seven rendered parts of revolution and a photographed screw
/// have at least 0.92; the part with the lowest share has a deep thread with one start, whose sides differ.
const MIN_SYMMETRY: f64 = 0.85;
/// Minimum length over mean width; the parts measured for [`MIN_SYMMETRY`] have at least 3.4.
const MIN_SLENDERNESS: f64 = 2.5;
/// Minimum share of the light's variance that is explained by the position across the axis. The parts measured for
/// [`MIN_SYMMETRY`] have at least 0.39; flat parts that are as symmetric and as slender have at most 0.19.
const MIN_EXPLAINED: f64 = 0.28;
/// Minimum change of the light across the axis, as a standard deviation over the mean. Chosen by hand.
const MIN_CHANGE: f64 = 0.06;
/// Search range of the axis's angle about the main axis of the outline: number of steps in each direction, and step in
/// degrees. Chosen by hand.
const TURNS: (i32, f64) = (12, 0.5);
/// Search range of the axis's offset: number of steps in each direction, and step in shares of the greatest width.
/// Chosen by hand.
const OFFSETS: (i32, f64) = (6, 0.005);
/// Number of pixels used to find the axis. Chosen to save time.
const AXIS_PIXELS: usize = 1000;
/// Number of sections along the axis in which the light is averaged.
const ALONG: usize = 40;
/// Number of sections across the axis in which the light is averaged.
const ACROSS: usize = 8;
/// Share of the radius that is used: pixels nearest to the outline show the background.
const INNER: f64 = 0.8;
/// A point further from the axis, in mean radii, belongs to a wing: heads and hexagons of the parts measured for
/// [`MIN_SYMMETRY`] reach up to 1.9, the wings of a wing bolt 2.9.
const MAX_RADIUS_OVER_MEAN: f64 = 2.3;

/// The axis of a part of revolution, as its photo shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Revolution {
    on_axis: Point2<f64>,
    axis: Vector2<f64>,
    /// Pixels of the part: position along the axis from `on_axis`, and signed distance from the axis.
    pixels: Vec<[f64; 2]>,
}

impl Revolution {
    /// The axis of the part that `outline` encloses; `None` if it is not a part of revolution.
    ///
    /// # Units and frames
    /// `outline` is in pixels of `cutout`.
    pub fn of(cutout: &RgbImage, outline: &Polygon) -> Option<Self> {
        // Most parts are not slender, which is quick to check.
        let bounds = outline.bounds();
        let longest = bounds.width().hypot(bounds.height());
        if longest * longest < MIN_SLENDERNESS * outline.area() {
            return None;
        }
        let mask = outline.rasterize(cutout.width(), cutout.height());
        let pixels: Vec<Point2<f64>> = (0..cutout.height())
            .flat_map(|y| (0..cutout.width()).map(move |x| (x, y)))
            .filter(|&(x, y)| mask.get(x, y))
            .map(|(x, y)| Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5))
            .collect();
        // An odd stride, which rarely coincides with the rows, spreads the pixels over the part.
        let few: Vec<Point2<f64>> = pixels.iter().step_by((pixels.len() / AXIS_PIXELS).max(1) | 1).copied().collect();
        let (on_axis, axis) = axis_of_symmetry(&mask, &few)?;
        let pixels_by_axis: Vec<[f64; 2]> = pixels.iter().map(|at| by_axis(at, &on_axis, &axis)).collect();
        let made = Self { on_axis, axis, pixels: pixels_by_axis };
        let brightness = |at: &Point2<f64>| {
            let [r, g, b] = cutout.get_pixel(at.x as u32, at.y as u32).0.map(f64::from);
            0.299 * r + 0.587 * g + 0.114 * b
        };
        made.is_round(&pixels.iter().map(brightness).collect::<Vec<_>>()).then_some(made)
    }

    /// Vector along the axis, as long as the part.
    pub(crate) fn axis(&self) -> Vector2<f64> {
        let (first, last) = self.ends();
        (last - first) * self.axis
    }

    /// The first and last position of the part along the axis.
    fn ends(&self) -> (f64, f64) {
        let along = self.pixels.iter().map(|[along, _]| *along);
        along.fold((f64::INFINITY, f64::NEG_INFINITY), |(first, last), at| (first.min(at), last.max(at)))
    }

    /// Height in pixels of the part's upper side above the axis, beside a line: equal to the distance of the outline
    /// from the axis there.
    pub fn radius_beside(&self, line: &GraspLine) -> f64 {
        let ends = [line.start, line.end].map(|end| by_axis(&end, &self.on_axis, &self.axis)[0]);
        let (first, last) = (ends[0].min(ends[1]) - 1.0, ends[0].max(ends[1]) + 1.0);
        let beside = self.pixels.iter().filter(|[along, _]| (first..=last).contains(along));
        beside.map(|[_, across]| across.abs()).fold(0.0, f64::max)
    }

    /// Whether the light changes across the axis as on a round body.
    fn is_round(&self, brightness: &[f64]) -> bool {
        let (first, last) = self.ends();
        let piece_px = ((last - first) / ALONG as f64).max(1.0);
        let mut pieces: Vec<Vec<(f64, f64)>> = vec![Vec::new(); ALONG + 1];
        for ([along, across], light) in self.pixels.iter().zip(brightness) {
            pieces[((along - first) / piece_px) as usize].push((*across, *light));
        }
        pieces.retain(|piece| piece.len() >= 4);
        let radius = |piece: &[(f64, f64)]| piece.iter().map(|(across, _)| across.abs()).fold(0.0, f64::max);
        let mean_radius = pieces.iter().map(|piece| radius(piece)).sum::<f64>() / (pieces.len() as f64).max(1.0);
        let greatest = pieces.iter().map(|piece| radius(piece)).fold(0.0, f64::max);
        if last - first < MIN_SLENDERNESS * 2.0 * mean_radius || greatest > MAX_RADIUS_OVER_MEAN * mean_radius {
            return false;
        }
        // For each section the mean light at each position across, divided by the section's mean.
        let rows: Vec<[Option<f64>; ACROSS]> = pieces
            .iter()
            .map(|piece| {
                let radius = radius(piece);
                // Limits the noise of dark parts.
                const DARK: f64 = 8.0;
                let mean_light = piece.iter().map(|(_, light)| light).sum::<f64>() / piece.len() as f64 + DARK;
                let mut sums = [(0.0, 0.0); ACROSS];
                for (across, light) in piece.iter().filter(|(across, _)| across.abs() < INNER * radius) {
                    let (sum, count) = &mut sums[((across / radius / INNER + 1.0) / 2.0 * ACROSS as f64) as usize];
                    (*sum, *count) = (*sum + light / mean_light, *count + 1.0);
                }
                sums.map(|(sum, count)| (count > 0.0).then(|| sum / count))
            })
            .collect();
        let mean = |values: &mut dyn Iterator<Item = f64>| {
            let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
            if count > 0.0 { sum / count } else { 0.0 }
        };
        let across: [f64; ACROSS] = std::array::from_fn(|k| mean(&mut rows.iter().filter_map(|row| row[k])));
        let middle = mean(&mut across.iter().copied());
        let change = mean(&mut across.iter().map(|light| (light - middle).powi(2))).sqrt();
        // Variance about the mean of each section, and the variance that the position across does not explain.
        let own = mean(&mut rows.iter().flat_map(|row| {
            let own_mean = mean(&mut row.iter().flatten().copied());
            row.iter().flatten().map(move |light| (light - own_mean).powi(2))
        }));
        let rests: Vec<f64> = rows
            .iter()
            .flat_map(|row| row.iter().zip(across))
            .filter_map(|(light, across)| Some((*light)? - across))
            .collect();
        let mean_rest = mean(&mut rests.iter().copied());
        let left = mean(&mut rests.iter().map(|rest| (rest - mean_rest).powi(2)));
        change >= MIN_CHANGE && left <= (1.0 - MIN_EXPLAINED) * own
    }
}

/// A pixel's position along the axis from `on_axis`, and its signed distance from the axis.
fn by_axis(at: &Point2<f64>, on_axis: &Point2<f64>, axis: &Vector2<f64>) -> [f64; 2] {
    let from = at - on_axis;
    [from.dot(axis), axis.x * from.y - axis.y * from.x]
}

/// The mirror axis of the outline near its main axis; `None` if there is none.
fn axis_of_symmetry(mask: &Mask, pixels: &[Point2<f64>]) -> Option<(Point2<f64>, Vector2<f64>)> {
    let count = pixels.len() as f64;
    let middle = Point2::from(pixels.iter().map(|at| at.coords).sum::<Vector2<f64>>() / count.max(1.0));
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for at in pixels {
        let d = at - middle;
        (xx, xy, yy) = (xx + d.x * d.x, xy + d.x * d.y, yy + d.y * d.y);
    }
    let main = 0.5 * (2.0 * xy).atan2(xx - yy);
    let main_axis = Vector2::new(main.cos(), main.sin());
    let width = 2.0 * pixels.iter().map(|at| by_axis(at, &middle, &main_axis)[1].abs()).fold(0.0, f64::max);
    let mut best = (0.0, middle, main_axis);
    for turn in -TURNS.0..=TURNS.0 {
        let axis = Rotation2::new((f64::from(turn) * TURNS.1).to_radians()) * main_axis;
        let left = Vector2::new(-axis.y, axis.x);
        for offset in -OFFSETS.0..=OFFSETS.0 {
            let on_axis = middle + f64::from(offset) * OFFSETS.1 * width * left;
            let is_covered = |at: &&Point2<f64>| {
                let mirrored = **at - 2.0 * by_axis(at, &on_axis, &axis)[1] * left;
                let (x, y) = (mirrored.x, mirrored.y);
                let is_inside = x >= 0.0 && y >= 0.0 && x < f64::from(mask.width()) && y < f64::from(mask.height());
                is_inside && mask.get(x as u32, y as u32)
            };
            let share = pixels.iter().filter(is_covered).count() as f64 / count.max(1.0);
            if share > best.0 {
                best = (share, on_axis, axis);
            }
        }
    }
    (best.0 >= MIN_SYMMETRY).then_some((best.1, best.2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    /// A stepped bar along an axis at 30°, lit from the side as a round or as a flat body.
    fn bar(light: impl Fn(f64) -> f64) -> (RgbImage, Polygon) {
        let (middle, axis) = (Point2::new(100.0, 80.0), Vector2::new(0.75f64.sqrt(), 0.5));
        let left = Vector2::new(-axis.y, axis.x);
        let profile = [(-60.0, 8.0), (20.0, 8.0), (20.0, 14.0), (60.0, 14.0)];
        let side = |sign: f64| profile.iter().map(move |&(along, radius)| middle + along * axis + sign * radius * left);
        let outline = Polygon { vertices: side(-1.0).chain(side(1.0).rev()).collect() };
        let image = RgbImage::from_fn(200, 160, |x, y| {
            let at = Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let [along, across] = by_axis(&at, &middle, &axis);
            let radius = if along < 20.0 { 8.0 } else { 14.0 };
            let grain = f64::from((x * 7 + y * 13) % 11);
            let value = if along.abs() < 60.0 && across.abs() < radius { 120.0 * light(across / radius) } else { 40.0 };
            Rgb([(value + grain) as u8; 3])
        });
        (image, outline)
    }

    #[test]
    fn a_bar_that_is_lit_as_a_round_one_has_an_axis() {
        let (image, outline) = bar(|across| 0.6 + 0.8 * (1.0 - (across - 0.3).powi(2)).max(0.0));
        let found = Revolution::of(&image, &outline).unwrap();
        assert!(found.axis.x.abs() > 0.86 && (found.axis.y / found.axis.x - 0.577).abs() < 0.03, "{:?}", found.axis);
        let line = |along: f64| {
            let middle = Point2::new(100.0, 80.0) + along * Vector2::new(0.75f64.sqrt(), 0.5);
            GraspLine::new(middle - Vector2::new(2.0, -3.46), middle + Vector2::new(2.0, -3.46))
        };
        assert!((found.radius_beside(&line(-20.0)) - 8.0).abs() < 1.0);
        assert!((found.radius_beside(&line(40.0)) - 14.0).abs() < 1.0);
    }

    #[test]
    fn a_flat_bar_and_a_crooked_one_have_none() {
        let (image, outline) = bar(|_| 1.0);
        assert_eq!(Revolution::of(&image, &outline), None);
        let (image, mut outline) = bar(|across| 0.6 + 0.8 * (1.0 - (across - 0.3).powi(2)).max(0.0));
        outline.vertices[3] += Vector2::new(-30.0, 40.0);
        assert_eq!(Revolution::of(&image, &outline), None);
    }
}

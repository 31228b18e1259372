//! Photo and picture side by side, in the photo's frame: the input of the network.

use image::RgbImage;
use sdg_geometry::{PlanarSimilarity, Polygon};

use crate::frame::Frame;

/// Rows and columns of the network's input.
pub const SIDE: usize = 64;
/// Values of a pixel: the photo's colour, the picture's colour, inside the outline or not, inside the picture or not.
pub const NUM_CHANNELS: usize = 8;
/// The part's longer side in the input; the surroundings of the part show whether its outline is there.
const PART_SIDE: f64 = SIDE as f64 / 1.2;
/// Mean brightness of the part, in photo and picture, after exposure is normalised.
const MEAN: f32 = 0.5;
/// Larger values are clipped: four times [`MEAN`].
const MAX: f32 = 2.0;
/// Limits the brightening of a black part.
const DARK: f32 = 0.02;

/// A photo's colours, and whether each pixel lies inside the outline.
#[derive(Debug, Clone)]
pub(super) struct Photo {
    frame: Frame,
    colors: Vec<Option<[f32; 3]>>,
    inside: Vec<bool>,
}

/// The input of the network at a pose: colours from 0 to 1, row by row; `None` where there is no picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// The photo's colours.
    pub photo: Vec<Option<[f32; 3]>>,
    /// The picture's colours, at the pose.
    pub picture: Vec<Option<[f32; 3]>>,
    /// Whether a pixel lies in the outline.
    pub inside: Vec<bool>,
}

impl Photo {
    pub(super) fn new(cutout: &RgbImage, outline: &Polygon) -> Self {
        let frame = Frame::about(&outline.bounds(), PART_SIDE, SIDE);
        let colors = frame.sampled(cutout, &PlanarSimilarity::IDENTITY);
        let inside = frame.pixels().map(|at| outline.contains(&frame.place(at))).collect();
        Self { frame, colors, inside }
    }

    /// [`Pair::values`] of [`Self::beside`].
    pub(super) fn values_beside(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> Vec<f32> {
        values(&self.colors, &self.frame.sampled(image, image_from_cutout), &self.inside)
    }

    pub(super) fn beside(&self, image: &RgbImage, image_from_cutout: &PlanarSimilarity) -> Pair {
        let picture = self.frame.sampled(image, image_from_cutout);
        Pair { photo: self.colors.clone(), picture, inside: self.inside.clone() }
    }
}

impl Pair {
    /// The network's input: [`NUM_CHANNELS`] values per pixel, row by row. Exposure is normalised, so that the part is
    /// equally bright in both; hue is not.
    pub fn values(&self) -> Vec<f32> {
        values(&self.photo, &self.picture, &self.inside)
    }
}

fn values(photo: &[Option<[f32; 3]>], picture: &[Option<[f32; 3]>], inside: &[bool]) -> Vec<f32> {
    let mut values = Vec::with_capacity(NUM_CHANNELS * inside.len());
    let colors = exposed_values(photo, inside).zip(exposed_values(picture, inside));
    for (((of_photo, of_picture), picture), inside) in colors.zip(picture).zip(inside) {
        values.extend(of_photo);
        values.extend(of_picture);
        values.extend([*inside, picture.is_some()].map(|is| f32::from(u8::from(is))));
    }
    values
}

/// Colours with normalised exposure: their mean inside is [`MEAN`]; 0 where there is no colour.
pub(crate) fn exposed_values(colors: &[Option<[f32; 3]>], inside: &[bool]) -> impl Iterator<Item = [f32; 3]> {
    let gain = gain(colors, inside);
    colors.iter().map(move |color| exposed(color, gain))
}

/// The factor that brings the mean colour inside to [`MEAN`].
fn gain(colors: &[Option<[f32; 3]>], inside: &[bool]) -> f32 {
    let (mut sum, mut count) = (0.0, 0);
    for color in colors.iter().zip(inside).filter(|(_, inside)| **inside).filter_map(|(color, _)| *color) {
        sum += color.iter().sum::<f32>();
        count += 3;
    }
    MEAN / (sum / (count as f32).max(1.0) + DARK)
}

fn exposed(color: &Option<[f32; 3]>, gain: f32) -> [f32; 3] {
    color.map_or([0.0; 3], |color| color.map(|value| ((value + DARK) * gain).min(MAX)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;
    use nalgebra::Point2;
    use sdg_geometry::{Angle, BoundingBox};

    /// A plate with a bright corner on a table.
    fn photo(light: f32) -> RgbImage {
        RgbImage::from_fn(160, 120, |x, y| {
            let color = match (x, y) {
                (40..=60, 30..=45) => [220.0, 210.0, 60.0],
                (40..120, 30..90) => [90.0, 60.0, 40.0],
                _ => [150.0, 150.0, 155.0],
            };
            Rgb(color.map(|value: f32| (value * light) as u8))
        })
    }

    fn taught() -> Photo {
        let outline = Polygon::from_box(&BoundingBox { x1: 40.0, y1: 30.0, x2: 120.0, y2: 90.0 });
        Photo::new(&photo(1.0), &outline)
    }

    /// Mean difference of photo and picture inside the outline, in the network's input.
    fn difference(pair: &Pair) -> f32 {
        let values = pair.values();
        let inside: Vec<_> = values.chunks_exact(NUM_CHANNELS).filter(|pixel| pixel[6] == 1.0).collect();
        let of_pixel = |pixel: &&[f32]| (0..3).map(|c| (pixel[c] - pixel[c + 3]).abs()).sum::<f32>();
        inside.iter().map(of_pixel).sum::<f32>() / inside.len() as f32
    }

    #[test]
    fn the_same_part_looks_the_same_however_it_lies_and_is_lit() {
        assert_eq!(difference(&taught().beside(&photo(1.0), &PlanarSimilarity::IDENTITY)), 0.0);
        assert!(difference(&taught().beside(&photo(0.6), &PlanarSimilarity::IDENTITY)) < 0.05);
        // The picture and the pose rotated by 90°.
        let turned = image::imageops::rotate90(&photo(1.0));
        let pose =
            PlanarSimilarity { scale: 1.0, angle: Angle::from_degrees(90.0), tx: f64::from(turned.width()), ty: 0.0 };
        let pair = taught().beside(&turned, &pose);
        assert!(difference(&pair) < 0.02, "{}", difference(&pair));
        // At a pose rotated by 180° the corner is elsewhere.
        let center = Point2::new(80.0, 60.0);
        let wrong = PlanarSimilarity::about(center, center, Angle::from_degrees(180.0), 1.0);
        assert!(difference(&taught().beside(&photo(1.0), &wrong)) > 0.1);
    }

    #[test]
    fn the_part_fills_five_sixths_and_what_is_outside_the_picture_is_missing() {
        let pair = taught().beside(&photo(1.0), &PlanarSimilarity { tx: 60.0, ..PlanarSimilarity::IDENTITY });
        let middle_row = &pair.inside[SIDE / 2 * SIDE..][..SIDE];
        let count = middle_row.iter().filter(|inside| **inside).count();
        assert!((52..=54).contains(&count), "{count}");
        // 20 of its 80 pixels lie outside.
        let missing = (0..SIDE).filter(|&x| middle_row[x] && pair.picture[SIDE / 2 * SIDE + x].is_none()).count();
        assert!((12..=15).contains(&missing), "{missing}");
        assert!(pair.values().iter().all(|value| (0.0..=MAX).contains(value)));
    }
}

//! Draws pictures of any size with a demonstration's part on its table, rotated. The part is taken from the photo
//! itself, so the ground truth is known.

use image::imageops::interpolate_bilinear;
use image::{Rgb, RgbImage};
use nalgebra::Point2;
use sdg_demonstration::{Annotation, Demonstration};
use sdg_geometry::{Angle, BoundingBox, GraspLine, PlanarSimilarity, Polygon};

/// Side of the square in the photo's upper left corner: it shows bare table, and is repeated as the pictures' table.
const TABLE_PX: u32 = 64;
/// Samples per side of a pixel at the part's outline.
const SAMPLES: u32 = 3;

/// Draws the parts on the table, each at its pose.
pub fn picture(photo: &Demonstration, [width, height]: [u32; 2], picture_from_photo: &[PlanarSimilarity]) -> RgbImage {
    let mirrored = |at: u32| {
        let phase = at % (2 * TABLE_PX);
        if phase < TABLE_PX { phase } else { 2 * TABLE_PX - 1 - phase }
    };
    let mut picture = RgbImage::from_fn(width, height, |x, y| *photo.image.get_pixel(mirrored(x), mirrored(y)));
    let outline = outline(photo);
    for pose in picture_from_photo {
        let photo_from_picture = pose.inverse();
        let BoundingBox { x1, y1, x2, y2 } =
            outline.transformed(pose).bounds().clip(f64::from(width), f64::from(height));
        for y in y1 as u32..y2.ceil() as u32 {
            for x in x1 as u32..x2.ceil() as u32 {
                lay(&mut picture, [x, y], photo, &outline, &photo_from_picture);
            }
        }
    }
    picture
}

/// Blends a pixel of the part into the picture, by the fraction of the pixel that the part covers.
fn lay(
    picture: &mut RgbImage,
    [x, y]: [u32; 2],
    photo: &Demonstration,
    outline: &Polygon,
    photo_from_picture: &PlanarSimilarity,
) {
    let mut sum = [0.0f32; 3];
    let mut covered = 0u32;
    for k in 0..SAMPLES * SAMPLES {
        let [right, down] = [k % SAMPLES, k / SAMPLES].map(|k| (f64::from(k) + 0.5) / f64::from(SAMPLES));
        let at = photo_from_picture.apply(&Point2::new(f64::from(x) + right, f64::from(y) + down));
        let color = || interpolate_bilinear(&photo.image, (at.x - 0.5) as f32, (at.y - 0.5) as f32);
        if let Some(Rgb(color)) = outline.contains(&at).then(color).flatten() {
            covered += 1;
            (0..3).for_each(|c| sum[c] += f32::from(color[c]));
        }
    }
    if covered > 0 {
        let all = (SAMPLES * SAMPLES) as f32;
        let table = picture.get_pixel(x, y).0;
        let bare = (all - covered as f32) / all;
        let mixed = [0, 1, 2].map(|c| (sum[c] / all + bare * f32::from(table[c])).round() as u8);
        picture.put_pixel(x, y, Rgb(mixed));
    }
}

fn outline(photo: &Demonstration) -> Polygon {
    photo.annotation.outline.clone().unwrap_or_else(|| Polygon::from_box(&photo.annotation.bbox))
}

/// `count` poses at scale 1 on a grid over a picture of this size, each with a different angle.
pub fn poses(
    photo: &Demonstration,
    [width, height]: [u32; 2],
    count: u32,
    first_turn_deg: f64,
) -> Vec<PlanarSimilarity> {
    /// Multiples of the golden angle are far from each other.
    const GOLDEN_ANGLE_DEG: f64 = 137.507_764;
    let middle = outline(photo).bounds().center();
    let columns = (f64::from(count) * f64::from(width) / f64::from(height)).sqrt().round().max(1.0) as u32;
    let rows = count.div_ceil(columns);
    (0..count)
        .map(|k| {
            let [column, row] = [k % columns, k / columns].map(f64::from);
            let at = Point2::new(
                (column + 0.5) / f64::from(columns) * f64::from(width) + 0.37 * f64::from(k % 3),
                (row + 0.5) / f64::from(rows) * f64::from(height) + 0.41 * f64::from(k % 5),
            );
            let turn = Angle::from_degrees(first_turn_deg + GOLDEN_ANGLE_DEG * f64::from(k));
            PlanarSimilarity::about(middle, at, turn, 1.0)
        })
        .collect()
}

/// Draws the photo's part alone, in the middle of a photo of another size, with its marks.
pub fn photo_of_size(photo: &Demonstration, size: [u32; 2]) -> Demonstration {
    let outline_there = outline(photo);
    let middle = Point2::new(0.5 * f64::from(size[0]), 0.5 * f64::from(size[1]));
    let pose = PlanarSimilarity::about(outline_there.bounds().center(), middle, Angle::ZERO, 1.0);
    let outline_there = outline_there.transformed(&pose);
    let Annotation { label, grasp, jaw_width, .. } = &photo.annotation;
    let annotation = Annotation {
        label: label.clone(),
        bbox: outline_there.bounds(),
        grasp: grasp.as_ref().map(|line| GraspLine::new(pose.apply(&line.start), pose.apply(&line.end))),
        jaw_width: *jaw_width,
        outline: Some(outline_there),
    };
    Demonstration { image: picture(photo, size, &[pose]), annotation }
}

/// Draws dark strokes all over the picture: edges that belong to no part. The strokes depend only on `count` and the
/// picture's size.
pub fn add_strokes(picture: &mut RgbImage, count: u32) {
    const LENGTH_PX: u32 = 40;
    let (width, height) = picture.dimensions();
    for k in 0..count {
        // The fractions of an irrational number's multiples are distributed evenly over 0 to 1.
        let share = |factor: f64| (f64::from(k + 1) * factor).fract();
        let from = [share(0.754_877_67) * f64::from(width), share(0.569_840_29) * f64::from(height)];
        let (sin, cos) = (std::f64::consts::TAU * share(0.618_033_99)).sin_cos();
        for step in 0..LENGTH_PX {
            for across in 0..4 {
                let along = f64::from(step);
                let [x, y] =
                    [from[0] + along * cos - f64::from(across) * sin, from[1] + along * sin + f64::from(across) * cos];
                if (0.0..f64::from(width)).contains(&x) && (0.0..f64::from(height)).contains(&y) {
                    picture.put_pixel(x as u32, y as u32, Rgb([40, 42, 45]));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::works::read_demonstration;
    use std::path::Path;

    fn pendulum() -> Demonstration {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../datasets/demonstrations/pendulum");
        read_demonstration(&root).unwrap()
    }

    /// Maximum mean difference in grey values; interpolation changes the photo's noise and print.
    const MAX_DIFFERENCE: f64 = 3.0;

    #[test]
    fn a_part_laid_where_it_was_photographed_is_the_photo_there() {
        let photo = pendulum();
        let drawn = picture(&photo, [640, 480], &[PlanarSimilarity::IDENTITY]);
        let inside = outline(&photo);
        let (mut num_inside, mut difference) = (0, 0.0);
        for (x, y, pixel) in drawn.enumerate_pixels() {
            let at = Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            if inside.contains(&at) && inside.distance_to_edge(&at) > 2.0 {
                let own = photo.image.get_pixel(x, y);
                difference += (0..3).map(|c| f64::from(pixel[c].abs_diff(own[c]))).sum::<f64>() / 3.0;
                num_inside += 1;
            }
        }
        // A pixel is the mean of nine samples between its neighbours.
        let mean = difference / f64::from(num_inside);
        assert!(mean < MAX_DIFFERENCE, "{mean}");
        assert!(num_inside > 2000, "{num_inside}");
    }

    #[test]
    fn poses_lie_in_the_picture_apart_and_turned() {
        let photo = pendulum();
        let poses = poses(&photo, [1280, 960], 16, 0.0);
        let bounds: Vec<_> = poses.iter().map(|pose| outline(&photo).transformed(pose).bounds()).collect();
        for (k, one) in bounds.iter().enumerate() {
            assert!(one.x1 > 0.0 && one.y1 > 0.0 && one.x2 < 1280.0 && one.y2 < 960.0, "{one:?}");
            assert!(bounds[..k].iter().all(|other| other.intersection(one) == 0.0));
        }
        let larger = photo_of_size(&photo, [1280, 960]);
        assert!(larger.check().is_ok() && larger.image.dimensions() == (1280, 960));
    }
}

//! The photo without the part: the hole is filled from its rim, with the noise of its surroundings.

use image::{Rgb, RgbImage};
use sdg_geometry::Polygon;

use crate::raster::Raster;

/// Removes the parts inside `regions` from a photo, except inside `keep`.
pub(crate) fn erase_parts(image: &RgbImage, regions: &[Polygon], keep: Option<&Polygon>) -> RgbImage {
    let (width, height) = image.dimensions();
    let kept = keep.map(|polygon| polygon.rasterize(width, height));
    let mut hole = vec![false; width as usize * height as usize];
    for region in regions {
        let mask = region.rasterize(width, height);
        for y in 0..height {
            for x in 0..width {
                hole[(y * width + x) as usize] |= mask.get(x, y) && kept.as_ref().is_none_or(|kept| !kept.get(x, y));
            }
        }
    }
    let filled = fill(&Raster::from_image(image), &hole);
    RgbImage::from_fn(width, height, |x, y| {
        let at = (y * width + x) as usize;
        if !hole[at] {
            return *image.get_pixel(x, y);
        }
        let [r, g, b, _] = filled.pixels[at];
        Rgb([r, g, b].map(|v| (v * 255.0 + 0.5).clamp(0.0, 255.0) as u8))
    })
}

/// Fills the hole smoothly from its rim and adds the fine grain of another area of the picture.
pub(crate) fn fill(picture: &Raster, hole: &[bool]) -> Raster {
    let mut filled = pull_push(picture, hole);
    let (width, height) = (picture.width, picture.height);
    let Some((dx, dy)) = grain_offset(width, height, hole) else { return filled };
    for y in 0..height {
        for x in 0..width {
            let at = y * width + x;
            let (sx, sy) = (x as isize + dx, y as isize + dy);
            if !hole[at] || sx < 0 || sy < 0 || sx >= width as isize || sy >= height as isize {
                continue;
            }
            let source = sy as usize * width + sx as usize;
            if hole[source] {
                continue;
            }
            let mean = local_mean(picture, hole, sx as usize, sy as usize);
            let grain = picture.pixels[source];
            for ((out, grain), mean) in filled.pixels[at].iter_mut().zip(grain).zip(mean) {
                *out = (*out + grain - mean).clamp(0.0, 1.0);
            }
        }
    }
    filled
}

/// The mean of the known pixels around a pixel.
fn local_mean(picture: &Raster, hole: &[bool], x: usize, y: usize) -> [f32; 3] {
    const RADIUS: usize = 3;
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for v in y.saturating_sub(RADIUS)..(y + RADIUS + 1).min(picture.height) {
        for u in x.saturating_sub(RADIUS)..(x + RADIUS + 1).min(picture.width) {
            if !hole[v * picture.width + u] {
                let pixel = picture.pixels[v * picture.width + u];
                (0..3).for_each(|k| sum[k] += pixel[k]);
                count += 1.0;
            }
        }
    }
    sum.map(|s| s / count)
}

/// The shift, of about the hole's own size, for which most of the hole falls on known pixels.
fn grain_offset(width: usize, height: usize, hole: &[bool]) -> Option<(isize, isize)> {
    let (mut x1, mut y1, mut x2, mut y2) = (width, height, 0, 0);
    for (at, _) in hole.iter().enumerate().filter(|&(_, &inside)| inside) {
        let (x, y) = (at % width, at / width);
        (x1, y1, x2, y2) = (x1.min(x), y1.min(y), x2.max(x), y2.max(y));
    }
    let (w, h) = ((x2 + 1).checked_sub(x1)? as isize, (y2 + 1).checked_sub(y1)? as isize);
    let known = |&(dx, dy): &(isize, isize)| {
        let falls_on_known = |at: usize| {
            let (x, y) = ((at % width) as isize + dx, (at / width) as isize + dy);
            (0..width as isize).contains(&x)
                && (0..height as isize).contains(&y)
                && !hole[y as usize * width + x as usize]
        };
        hole.iter().enumerate().filter(|&(at, &inside)| inside && falls_on_known(at)).count()
    };
    [(w, 0), (-w, 0), (0, h), (0, -h), (w, h), (-w, -h), (w, -h), (-w, h)].into_iter().max_by_key(known)
}

/// Averages known pixels into increasingly coarse levels, then fills each level's holes from the next coarser one.
///
/// # Source
/// Gortler et al. 1996, "The Lumigraph", section 3.4.
fn pull_push(picture: &Raster, hole: &[bool]) -> Raster {
    let mut level = picture.clone();
    for (pixel, &inside) in level.pixels.iter_mut().zip(hole) {
        // The fourth float is the weight, colours are stored multiplied by it.
        *pixel = if inside { [0.0; 4] } else { [pixel[0], pixel[1], pixel[2], 1.0] };
    }
    let mut levels = vec![level];
    while let Some(fine) = levels.last().filter(|fine| fine.width > 1 || fine.height > 1) {
        let (width, height) = (fine.width.div_ceil(2), fine.height.div_ceil(2));
        let mut coarse = Raster::filled(width, height, [0.0; 4]);
        for y in 0..fine.height {
            for x in 0..fine.width {
                let sum = &mut coarse.pixels[(y / 2) * width + x / 2];
                let pixel = fine.pixels[y * fine.width + x];
                (0..4).for_each(|k| sum[k] += pixel[k]);
            }
        }
        for pixel in &mut coarse.pixels {
            // A weight saturates at one: more pixels do not make a known value more certain.
            let factor = if pixel[3] > 1.0 { 1.0 / pixel[3] } else { 1.0 };
            *pixel = pixel.map(|v| v * factor);
        }
        levels.push(coarse);
    }
    let mut coarse: Option<Raster> = None;
    for mut fine in levels.into_iter().rev() {
        for y in 0..fine.height {
            for x in 0..fine.width {
                let pixel = &mut fine.pixels[y * fine.width + x];
                if pixel[3] < 1.0 {
                    // If no pixel is known, the hole becomes medium grey.
                    let below = match &coarse {
                        Some(coarse) => coarse.bilinear((x as f32 + 0.5) / 2.0, (y as f32 + 0.5) / 2.0),
                        None if pixel[3] > 0.0 => pixel.map(|v| v / pixel[3]),
                        None => [0.5; 4],
                    };
                    let lacking = 1.0 - pixel[3];
                    (0..3).for_each(|k| pixel[k] += below[k] * lacking);
                    pixel[3] = 1.0;
                }
            }
        }
        coarse = Some(fine);
    }
    let mut filled = coarse.unwrap_or_else(|| picture.clone());
    for (pixel, (&inside, original)) in filled.pixels.iter_mut().zip(hole.iter().zip(&picture.pixels)) {
        if !inside {
            *pixel = *original;
        }
    }
    filled
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square_hole(size: usize, from: usize, to: usize) -> Vec<bool> {
        (0..size * size).map(|at| (from..to).contains(&(at % size)) && (from..to).contains(&(at / size))).collect()
    }

    #[test]
    fn a_plain_picture_is_filled_with_its_colour() {
        let picture = Raster::filled(40, 40, [0.25, 0.5, 0.75, 0.0]);
        let filled = fill(&picture, &square_hole(40, 10, 30));
        for pixel in &filled.pixels {
            assert!((pixel[0] - 0.25).abs() < 1e-5 && (pixel[2] - 0.75).abs() < 1e-5, "{pixel:?}");
        }
    }

    #[test]
    fn nothing_of_the_part_remains_and_nothing_else_changes() {
        let hole = square_hole(64, 20, 44);
        let mut picture = Raster::filled(64, 64, [0.2; 4]);
        for (at, pixel) in picture.pixels.iter_mut().enumerate() {
            *pixel = if hole[at] { [1.0; 4] } else { [0.2 + 0.2 * ((at % 64) as f32 / 64.0); 4] };
        }
        let filled = fill(&picture, &hole);
        for (at, pixel) in filled.pixels.iter().enumerate() {
            assert!(pixel[0] < 0.5, "{at}: {pixel:?}");
            assert!(hole[at] || *pixel == picture.pixels[at]);
        }
    }

    #[test]
    fn a_picture_that_is_all_hole_is_grey() {
        let filled = fill(&Raster::filled(5, 4, [0.9; 4]), &[true; 20]);
        assert!(filled.pixels.iter().all(|pixel| (pixel[0] - 0.5).abs() < 1e-6));
    }
}

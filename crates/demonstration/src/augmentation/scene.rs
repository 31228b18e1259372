//! One composed scene: table, distractors, the part, covering objects, light, lens, sensor.

use image::RgbImage;
use nalgebra::{Matrix3, Point2};
use sdg_geometry::Visibility;

use super::background::{NoiseBank, paint_photo, paint_surfaces};
use super::config::SceneStyle;
use super::distance::BAND_PX;
use super::distractor::{Distractor, Lamp, paint_mutant};
use super::figure::Figure;
use super::homography::Homography;
use super::light::relight;
use super::mutant::Mutant;
use super::noise::NormalTable;
use super::pose::draw_pose;
use super::prepared::Prepared;
use super::random::{SampleRng, chance, index_below, log_uniform, uniform};
use super::sample::{Sample, SampleObject};
use super::sensor::{blur, expose};
use crate::raster::{PixelRect, Raster, blend, smoothstep};

/// Size range of other parts relative to the part: much larger or smaller ones are refused by their size.
const OTHER_PART_SIZE: [f32; 2] = [0.6, 1.5];

/// The common data of all scenes.
pub(crate) struct Studio<'a> {
    pub parts: &'a [Prepared],
    /// Other parts, which lie beside the part or in its place.
    pub others: &'a [Prepared],
    pub style: &'a SceneStyle,
    pub noises: &'a NoiseBank,
    pub normal: &'a NormalTable,
    /// Width and height of the painted picture.
    pub size: [u32; 2],
    /// Width and height of the frame of which the picture is a window.
    pub frame: [u32; 2],
}

impl Studio<'_> {
    /// Draws the properties of a scene and paints it.
    pub fn compose(&self, rng: &mut SampleRng) -> Sample {
        let demonstration_idx = index_below(rng, self.parts.len());
        let part = &self.parts[demonstration_idx];
        let positive = chance(rng, self.style.positive_share);
        let [width, height] = self.size;
        let mut canvas = Raster::filled(width as usize, height as usize, [0.0; 4]);
        canvas.frame_width = self.frame[0] as usize;
        let lamp = Lamp::draw(rng, self.frame[0] as f32 / 320.0);
        let pose = draw_pose(part, self.style, f64::from(width), f64::from(height), rng);

        // Without an outline there is no cut-out for another table.
        let own_table = !part.has_outline || chance(rng, self.style.photo_background_share);
        if own_table {
            paint_photo(&mut canvas, part, &part.prepared_from_image(&pose), positive);
        } else {
            paint_surfaces(&mut canvas, self.noises, part, rng);
        }
        self.paint_distractors(&mut canvas, part, positive, own_table, &lamp, rng);

        let mut objects = Vec::new();
        if positive {
            self.paint_part(&mut canvas, part, &pose, own_table, &lamp, rng);
            let mut object = SampleObject::new(part, &pose, self.size, demonstration_idx);
            if chance(rng, self.style.occlusion_probability) {
                self.cover(&mut canvas, part, &pose, &mut object, &lamp, rng);
            }
            objects.push(object);
        }
        relight(&mut canvas, rng);
        blur(&mut canvas, self.style, rng);
        let image: RgbImage = expose(&canvas, self.normal, self.style, rng);
        Sample { image, objects }
    }

    fn paint_distractors(
        &self,
        canvas: &mut Raster,
        part: &Prepared,
        positive: bool,
        own_table: bool,
        lamp: &Lamp,
        rng: &mut SampleRng,
    ) {
        let least = if positive { 0 } else { 1 };
        let most =
            if positive && own_table { self.style.max_distractors.div_ceil(2) } else { self.style.max_distractors };
        // In proportion to the window's side: fewer in a window, but still some beside the part.
        let share = f64::from(self.size[0] * self.size[1]) / f64::from(self.frame[0] * self.frame[1]);
        let most = ((most as f64 * share.sqrt()).ceil() as usize).max(least);
        let count = least + index_below(rng, most + 1 - least);
        let part_radius = (part.radius * part.nominal_scale) as f32;
        for _ in 0..count {
            let center = [uniform(rng, 0.0, canvas.width as f32), uniform(rng, 0.0, canvas.height as f32)];
            if !part.mutants.is_empty() && part.has_outline && chance(rng, self.style.mutant_share) {
                let mutant = part.mutants[index_below(rng, part.mutants.len())];
                let [low, high] = self.style.scale;
                let scale = part.nominal_scale as f32 * log_uniform(rng, low, high);
                paint_mutant(canvas, part, &mutant, center, scale, lamp, rng);
            } else if !self.others.is_empty() && chance(rng, self.style.other_part_share) {
                let other = &self.others[index_below(rng, self.others.len())];
                let whole = Mutant::whole(other.radius as f32);
                let scale = part_radius * log_uniform(rng, OTHER_PART_SIZE[0], OTHER_PART_SIZE[1]) / whole.radius;
                paint_mutant(canvas, other, &whole, center, scale, lamp, rng);
            } else {
                let smallest = 0.04 * canvas.frame_width as f32;
                let size = (part_radius * log_uniform(rng, 0.3, 1.4)).clamp(smallest, 0.45 * canvas.frame_width as f32);
                let figure = Figure::draw(rng);
                Distractor::new(figure, center, size, part, rng).paint(canvas, lamp, &self.noises.rough);
            }
        }
    }

    /// Paints the cut-out on the canvas; on its own table without an additional shadow, because the photo has one.
    fn paint_part(
        &self,
        canvas: &mut Raster,
        part: &Prepared,
        pose: &Homography,
        own_table: bool,
        lamp: &Lamp,
        rng: &mut SampleRng,
    ) {
        let Some(bounds) = pose.bounds(&part.region.vertices) else { return };
        let bounds = [bounds.x1, bounds.y1, bounds.x2, bounds.y2].map(|v| v as f32);
        let prepared_from_image = part.prepared_from_image(pose);
        // Distances in the raster are in prepared pixels; edges and shadows are defined in canvas pixels.
        let canvas_from_prepared = (scale_at(pose, &part.center) / part.prepared_from_photo) as f32;
        if !own_table && lamp.shadow > 0.0 {
            let shift = lamp.shadow_shift_px;
            let soft = lamp.cut_out_softness_px(BAND_PX * canvas_from_prepared, canvas.frame_width);
            let moved = Homography::new(Matrix3::new_translation(&nalgebra::Vector2::new(
                f64::from(shift * lamp.towards[0]),
                f64::from(shift * lamp.towards[1]),
            )));
            let source = prepared_from_image.compose(&moved);
            let rect = PixelRect::covering(bounds, shift + soft, canvas.width, canvas.height);
            for y in rect.y1..rect.y2 {
                let row = source.row(y);
                for x in rect.x1..rect.x2 {
                    let (u, v) = row.at(x);
                    let inside = part.ended_at_border(part.photo.nearest(u, v)[3], u, v) * canvas_from_prepared;
                    let dark = lamp.shadow * smoothstep(-soft, soft, inside);
                    blend(&mut canvas.pixels[y * canvas.width + x], [0.0; 3], dark);
                }
            }
        }
        // The photo's light if the part is on its own table, otherwise a slightly different one.
        let gain: [f32; 3] = if own_table { [1.0; 3] } else { std::array::from_fn(|_| uniform(rng, 0.9, 1.1)) };
        let level = if own_table { 1.0 } else { uniform(rng, 0.75, 1.15) };
        let (edge, feather) = (uniform(rng, -0.3, 1.2), uniform(rng, 0.5, 1.6));
        let rect = PixelRect::covering(bounds, 2.0, canvas.width, canvas.height);
        for y in rect.y1..rect.y2 {
            let row = prepared_from_image.row(y);
            for x in rect.x1..rect.x2 {
                let (u, v) = row.at(x);
                let pixel = part.photo.bilinear(u, v);
                let inside = part.ended_at_border(pixel[3], u, v) * canvas_from_prepared;
                let alpha = smoothstep(edge - feather, edge + feather, inside);
                if alpha > 0.0 {
                    let color = std::array::from_fn(|k| pixel[k] * gain[k] * level);
                    blend(&mut canvas.pixels[y * canvas.width + x], color, alpha);
                }
            }
        }
    }

    /// Lays an object over the part, if one is found that hides at most as much of the part as the style allows.
    fn cover(
        &self,
        canvas: &mut Raster,
        part: &Prepared,
        pose: &Homography,
        object: &mut SampleObject,
        lamp: &Lamp,
        rng: &mut SampleRng,
    ) {
        const TRIES: usize = 8;
        let places: Vec<[f32; 2]> = part
            .area_points
            .iter()
            .map(|point| pose.apply(point))
            .map(|place| [place.x as f32, place.y as f32])
            .collect();
        let radius = (part.radius * scale_at(pose, &part.center)) as f32;
        for _ in 0..TRIES {
            let figure = match index_below(rng, 3) {
                0 => Figure::bar(rng),
                1 => Figure::blob(rng),
                _ => Figure::draw(rng),
            };
            let aim = places[index_below(rng, places.len())];
            let size = radius * uniform(rng, 0.3, 1.5);
            let away = uniform(rng, 0.0, 0.8) * size;
            let [dx, dy] = super::random::direction(rng);
            let center = [aim[0] + away * dx, aim[1] + away * dy];
            let cover = Distractor::new(figure, center, size, part, rng);
            let hidden = places.iter().filter(|place| cover.distance_px(place[0], place[1]) < 0.0).count();
            if hidden == 0 || hidden as f32 > self.style.max_occluded * places.len() as f32 {
                continue;
            }
            cover.paint(canvas, lamp, &self.noises.rough);
            for keypoint in &mut object.keypoints {
                let covered = cover.distance_px(keypoint.x as f32, keypoint.y as f32) < 0.0;
                if covered && keypoint.visibility == Visibility::Visible {
                    keypoint.visibility = Visibility::Occluded;
                }
            }
            return;
        }
    }
}

/// Canvas pixels per photo pixel, around a point.
fn scale_at(pose: &Homography, place: &Point2<f64>) -> f64 {
    let here = pose.apply(place);
    let right = pose.apply(&Point2::new(place.x + 1.0, place.y)) - here;
    let below = pose.apply(&Point2::new(place.x, place.y + 1.0)) - here;
    right.perp(&below).abs().sqrt()
}

#[cfg(test)]
mod tests {
    use sdg_geometry::{Angle, PlanarSimilarity, Polygon};

    use super::super::random::{Stream, sample_rng};
    use super::*;
    use crate::{Annotation, Demonstration};

    /// The part with these corners in a white photo of 300 × 300 pixels, prepared in the photo's resolution.
    fn part(corners: [(f64, f64); 4]) -> Prepared {
        let outline = Polygon { vertices: corners.map(|(x, y)| Point2::new(x, y)).to_vec() };
        let annotation = Annotation {
            label: "part".into(),
            bbox: outline.bounds(),
            grasp: None,
            jaw_width: None,
            outline: Some(outline),
        };
        let image = RgbImage::from_pixel(300, 300, image::Rgb([255; 3]));
        let mut rng = sample_rng(1, Stream::Preparation, 0);
        Prepared::without_mutants(&Demonstration { image, annotation }, [300, 300], &mut rng)
    }

    /// A light whose shadows have this softness and strength, and lie below their parts.
    fn lamp(shadow: f32, shadow_softness_px: f32) -> Lamp {
        Lamp { towards: [1.0, 0.0], elevation: 0.7, shadow, shadow_shift_px: 0.0, shadow_softness_px }
    }

    /// Paints the part on another table than its own.
    fn paint(canvas: &mut Raster, part: &Prepared, pose: &Homography, lamp: &Lamp, seed: u64) {
        let mut rng = sample_rng(seed, Stream::Training, 0);
        let (noises, normal) = (NoiseBank::new(&mut rng), NormalTable::new(&mut rng));
        let size = [canvas.width as u32, canvas.height as u32];
        let style = SceneStyle::default();
        let studio =
            Studio { parts: &[], others: &[], style: &style, noises: &noises, normal: &normal, size, frame: size };
        studio.paint_part(canvas, part, pose, false, lamp, &mut rng);
    }

    #[test]
    fn the_shadow_of_a_cut_out_ends_in_a_wide_frame() {
        let diamond = part([(150.0, 90.0), (210.0, 150.0), (150.0, 210.0), (90.0, 150.0)]);
        let lamp = lamp(0.7, 88.0);
        let mut table = Raster::filled(300, 300, [0.5; 4]);
        table.frame_width = 4032;
        let (mut with_part, mut with_mutant) = (table.clone(), table);
        paint(&mut with_part, &diamond, &Homography::scaling(1.0), &lamp, 1);
        let whole = Mutant::whole(diamond.radius as f32);
        let mut rng = sample_rng(1, Stream::Training, 0);
        paint_mutant(&mut with_mutant, &diamond, &whole, [150.0; 2], 1.0, &lamp, &mut rng);
        for canvas in [with_part, with_mutant] {
            let red = |x: usize, y: usize| canvas.pixels[y * 300 + x][0];
            // 3 to 20 px from the diamond at any angle, and more than 50 px from it.
            assert!(red(212, 150) < 0.5, "{}", red(212, 150));
            assert_eq!(red(70, 70), 0.5);
        }
        assert_eq!(lamp.cut_out_softness_px(24.0, 1100), 88.0);
    }

    #[test]
    fn a_part_at_the_border_of_its_photo_ends_there() {
        let half = part([(0.0, 0.0), (150.0, 0.0), (150.0, 300.0), (0.0, 300.0)]);
        let middle = Point2::new(250.0, 250.0);
        let turned = PlanarSimilarity::about(half.center, middle, Angle::from_degrees(30.0), 1.0);
        let pose = Homography::from_similarity(&turned);
        let outline = SampleObject::new(&half, &pose, [500; 2], 0).outline.unwrap();
        // The soft edges of part and shadow reach 1.9 px and 5 px, at a corner √2 times as far.
        for (shadow, reach) in [(0.0, 3.0), (0.7, 8.0)] {
            for seed in 0..4 {
                let mut canvas = Raster::filled(500, 500, [0.5; 4]);
                paint(&mut canvas, &half, &pose, &lamp(shadow, 5.0), seed);
                for (at, pixel) in canvas.pixels.iter().enumerate() {
                    let point = Point2::new((at % 500) as f64 + 0.5, (at / 500) as f64 + 0.5);
                    let is_near = || outline.contains(&point) || outline.distance_to_edge(&point) < reach;
                    assert!((pixel[0] - 0.5).abs() < 0.002 || is_near(), "seed {seed}: {pixel:?} at {point}");
                }
            }
        }
    }
}

//! One composed scene: table, distractors, the part, covering objects, light, lens, sensor.

use image::RgbImage;
use nalgebra::{Matrix3, Point2};
use sdg_geometry::Visibility;

use super::background::{NoiseBank, paint_photo, paint_surfaces};
use super::config::SceneStyle;
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
            let (shift, soft) = (lamp.shadow_shift_px, lamp.shadow_softness_px);
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
                    let inside = part.photo.nearest(u, v)[3] * canvas_from_prepared;
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
                let alpha = smoothstep(edge - feather, edge + feather, pixel[3] * canvas_from_prepared);
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

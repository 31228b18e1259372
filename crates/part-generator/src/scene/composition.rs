//! The composition of a picture: bodies, light and camera.

use std::sync::Arc;

use rand::Rng;
use rand_pcg::Pcg64Mcg;

use super::contents::Scene;
use super::layout::Layout;
use super::light::{LightStyle, Lighting};
use super::photo::FOCAL_OVER_WIDTH;
use super::placement::Placement;
use super::sample::{Conditions, OtherKind};
use super::scenes::{MAX_BODIES, Scenes, Subject};
use super::sensor::Sensor;
use super::table::{Table, TableStyle};
use super::view::View;
use crate::Part;
use crate::random::Draw;

/// Maximum ratio of sizes between other parts and the part, in both directions, if a few draws find such a
/// part.
pub(super) const SIZE_RATIO: f64 = 1.8;

/// Maximum number of draws for a part of suitable size.
const MAX_SIZE_DRAWS: usize = 6;

impl Scenes {
    /// Samples camera, light, table, and positions: first of the instances, then of the other objects, with
    /// their kinds.
    pub(super) fn compose(&self, part_idx: usize, rng: &mut Pcg64Mcg) -> (Scene, Vec<OtherKind>, usize, Conditions) {
        let (config, subject) = (&self.config, &self.subjects[part_idx]);
        let (view, conditions) = self.draw_view(subject, rng);
        let present = !rng.chance(config.absent_share as f32);
        let mut layout = Layout::new(&view);
        let wanted = if present { rng.whole(config.instances[0], config.instances[1]) } else { 0 };
        for _ in 0..wanted {
            layout.lay(&subject.part, config.min_inside_share as f32, rng);
        }
        if present && layout.bodies.is_empty() {
            // No position was found, for example for a large part: a smaller fraction of it may be inside the picture.
            for least in [0.9, 0.7, 0.0] {
                if layout.lay(&subject.part, least, rng) {
                    break;
                }
            }
        }
        let num_instances = layout.bodies.len();
        let kinds = self.place_others(subject, &mut layout, num_instances, rng);
        let bodies = layout.bodies;
        (finish(view, bodies, conditions.glare, rng), kinds, num_instances, conditions)
    }

    /// Samples the camera and the conditions of the picture.
    pub(super) fn draw_view(&self, subject: &Subject, rng: &mut Pcg64Mcg) -> (View, Conditions) {
        let config = &self.config;
        let chance = |rng: &mut Pcg64Mcg, p: f64| rng.chance(p as f32);
        let range = |rng: &mut Pcg64Mcg, [low, high]: [f64; 2]| rng.uniform(low as f32, high as f32);
        let distance = range(rng, config.distance);
        let tilted = chance(rng, config.tilt_probability);
        let tilt = if tilted { range(rng, config.tilt_rad) } else { 0.0 };
        let focal = FOCAL_OVER_WIDTH * config.width as f32;
        let view = View::new(
            config.width,
            config.height,
            focal,
            distance * subject.photo.distance_mm as f32,
            tilt,
            rng.angle(),
        );
        let glare = chance(rng, config.glare_probability);
        let conditions = Conditions {
            distance: distance.into(),
            tilt_rad: tilt.into(),
            dark: chance(rng, config.dark_probability),
            blur_px: if chance(rng, config.blur_probability) { rng.log_uniform(0.9, 2.2).into() } else { 0.0 },
            motion_px: if chance(rng, config.motion_probability) { rng.log_uniform(2.5, 8.0).into() } else { 0.0 },
            tinted: chance(rng, config.tint_probability),
            glare,
        };
        (view, conditions)
    }

    /// Places other parts beside the instances, and covers on them; returns their kinds.
    pub(super) fn place_others(
        &self,
        subject: &Subject,
        layout: &mut Layout<'_>,
        num_instances: usize,
        rng: &mut Pcg64Mcg,
    ) -> Vec<OtherKind> {
        let config = &self.config;
        let mut kinds = Vec::new();
        let wanted = rng.whole(config.others[0], config.others[1]);
        for _ in 0..wanted {
            let (kind, other) = self.draw_other(subject, rng);
            let touches = num_instances > 0 && rng.chance(config.touch_probability as f32);
            let laid = if touches {
                let neighbour = rng.whole(0, num_instances - 1);
                layout.lay_touching(&other, neighbour, rng)
            } else {
                layout.lay(&other, 0.3, rng)
            };
            if laid && layout.bodies.len() < MAX_BODIES {
                kinds.push(kind);
            }
        }
        for covered in 0..num_instances {
            if rng.chance(config.cover_probability as f32) && !subject.covers.is_empty() {
                let share = rng.uniform(config.cover_share[0] as f32, config.cover_share[1] as f32);
                for _ in 0..6 {
                    let cover = &subject.covers[rng.whole(0, subject.covers.len() - 1)];
                    if layout.cover(cover, covered, share, rng) {
                        kinds.push(OtherKind::Cover);
                        break;
                    }
                }
            }
        }
        kinds
    }

    fn draw_other(&self, subject: &Subject, rng: &mut Pcg64Mcg) -> (OtherKind, Arc<Part>) {
        let similar = rng.chance(self.config.look_alike_share as f32) && !subject.look_alikes.is_empty();
        if (similar || self.others.is_empty())
            && let Some((kind, part)) =
                subject.look_alikes.get(rng.random_range(0..subject.look_alikes.len().max(1) as u32) as usize)
        {
            return (OtherKind::LookAlike(*kind), part.clone());
        }
        let pool = if self.others.is_empty() { std::slice::from_ref(&subject.part) } else { &self.others[..] };
        // Other objects have about the size of the part; otherwise the picture would show little else.
        let mut best = &pool[rng.whole(0, pool.len() - 1)];
        let ratio = |other: &Arc<Part>| (other.diagonal_mm() / subject.part.diagonal_mm()).ln().abs();
        for _ in 0..MAX_SIZE_DRAWS {
            if ratio(best) < SIZE_RATIO.ln() {
                break;
            }
            let other = &pool[rng.whole(0, pool.len() - 1)];
            best = if ratio(other) < ratio(best) { other } else { best };
        }
        let part = best;
        (OtherKind::Part(part.kind()), part.clone())
    }

    pub(super) fn sensor(&self, conditions: &Conditions, rng: &mut Pcg64Mcg) -> Sensor {
        let px = self.config.width as f32 / 320.0;
        let tint = if conditions.tinted { 0.35 } else { 0.06 };
        let warmth = rng.uniform(-tint, tint);
        let green = rng.uniform(-0.4 * tint, 0.4 * tint);
        let (sin, cos) = rng.angle().sin_cos();
        let way = conditions.motion_px as f32 * px;
        let mut sensor = Sensor {
            exposure: rng.log_uniform(0.65, 1.5),
            white_balance: [1.0 + warmth, 1.0 + green, 1.0 - warmth],
            noise: rng.log_uniform(0.003, 0.025),
            blur: rng.uniform(0.25, 0.7) * px.max(0.6),
            motion: [cos * way, sin * way],
            vignetting: rng.uniform(0.0, 0.4),
            veil: if rng.chance(0.2) { rng.uniform(0.0, 0.06) } else { 0.0 },
            contrast: rng.uniform(0.95, 1.7),
            saturation: rng.uniform(0.8, 1.7),
            jpeg: rng.chance(self.config.jpeg_probability as f32).then(|| rng.uniform(40.0, 92.0) as u8),
        };
        if conditions.blur_px > 0.0 {
            sensor.blur = conditions.blur_px as f32 * px;
        }
        if conditions.dark {
            sensor.exposure *= rng.log_uniform(0.09, 0.25);
            sensor.noise = rng.log_uniform(0.03, 0.08);
        }
        sensor
    }
}

/// Samples light and table for the placed bodies.
pub(super) fn finish(view: View, bodies: Vec<Placement>, glare: bool, rng: &mut Pcg64Mcg) -> Scene {
    let far_shadow = (glare && rng.chance(0.5) || rng.chance(0.12)).then(|| {
        let (sin, cos) = rng.angle().sin_cos();
        let across = view.mm_per_px() * view.width as f32;
        ([cos, sin], across * rng.uniform(-0.2, 0.4), across * rng.log_uniform(0.01, 0.4), rng.uniform(0.2, 0.6))
    });
    let style = LightStyle { even: false, glare, hard: glare || rng.chance(0.15) };
    let lighting = Lighting::draw(style, rng);
    let table = Table::draw(TableStyle::Any, rng);
    Scene { view, lighting, table, bodies, far_shadow }
}

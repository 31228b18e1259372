//! Scenes by random access.

use std::cell::RefCell;
use std::sync::Arc;

use rand::Rng;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use sdg_geometry::{BoundingBox, PlanarSimilarity};

use super::config::SceneConfig;
use super::contents::Scene;
use super::layout::Layout;
use super::light::{LightStyle, Lighting};
use super::photo::{DemonstrationPhoto, FOCAL_OVER_WIDTH, Silhouette, grasp_line, pose};
use super::render::{Canvas, Footprint, Rendered};
use super::sample::{Conditions, Instance, OtherKind, OtherObject, Sample};
use super::sensor::{self, Sensor};
use super::table::{Table, TableStyle};
use super::view::View;
use crate::random::{Draw, Stream, generator, scramble};
use crate::{GeneratorError, LookAlike, Part, Result};

/// Sizes of look-alikes.
const SIZES: [f64; 4] = [0.8, 0.9, 1.1, 1.25];

/// Look-alikes with a moved feature for each part.
const NUM_MOVED: u64 = 3;

/// Covers to choose from for each part.
const NUM_COVERS: u64 = 6;

/// Other parts are at most so many times as large or as small as the part, where a few draws find such a one.
const SIZE_RATIO: f64 = 1.8;

/// How many those draws are.
const MAX_SIZE_DRAWS: usize = 6;

/// The most bodies in a picture: their numbers fit a byte beside the table's.
const MAX_BODIES: usize = 200;

thread_local! {
    /// The memory of each thread's pictures: asking the system for it takes a tenth of a picture's time.
    static CANVAS: RefCell<Canvas> = RefCell::default();
}

/// A part with what is drawn around it.
struct Subject {
    part: Arc<Part>,
    photo: DemonstrationPhoto,
    look_alikes: Vec<(LookAlike, Arc<Part>)>,
    covers: Vec<Arc<Part>>,
}

/// Pictures of scenes: sample *i* of a seed is the same whoever asks, in whatever order.
pub struct Scenes {
    config: SceneConfig,
    seed: u64,
    subjects: Vec<Subject>,
    others: Vec<Arc<Part>>,
}

impl Scenes {
    /// Prepares scenes of parts: their demonstrations, look-alikes, covers, and other parts. Sample *i* is of part
    /// *i* modulo their number.
    ///
    /// # Errors
    /// No part, or a configuration that [`SceneConfig::check`] refuses.
    pub fn new(parts: &[Part], config: SceneConfig, seed: u64) -> Result<Self> {
        config.check()?;
        if parts.is_empty() {
            return Err(GeneratorError::NoPart);
        }
        let with_look_alikes = config.look_alike_share > 0.0;
        let subjects = parts
            .par_iter()
            .map(|part| {
                let address = scramble(seed ^ part.recipe.grain_seed);
                Subject {
                    part: Arc::new(part.clone()),
                    photo: DemonstrationPhoto::take(part, &config.photo, config.photo_seed),
                    look_alikes: if with_look_alikes { look_alikes(part, address) } else { Vec::new() },
                    covers: (0..NUM_COVERS)
                        .filter(|_| config.cover_probability > 0.0)
                        .map(|k| {
                            let size = part.diagonal_mm() as f32 * (0.3 + 0.12 * k as f32);
                            Arc::new(Part::cover(size, address.wrapping_add(k)))
                        })
                        .collect(),
                }
            })
            .collect();
        let others = (0..config.num_other_parts as u64)
            .into_par_iter()
            .map(|k| Arc::new(Part::generate(scramble(scramble(seed ^ 0x6f74_6865_7273).wrapping_add(k)))))
            .collect();
        Ok(Self { config, seed, subjects, others })
    }

    /// The configuration.
    pub fn config(&self) -> &SceneConfig {
        &self.config
    }

    /// The demonstration of a part, which the truth of its samples refers to.
    pub fn photo(&self, part_idx: usize) -> &DemonstrationPhoto {
        &self.subjects[part_idx].photo
    }

    /// A part.
    pub fn part(&self, part_idx: usize) -> &Part {
        &self.subjects[part_idx].part
    }

    /// The look-alikes of a part.
    pub fn look_alikes(&self, part_idx: usize) -> impl Iterator<Item = (LookAlike, &Part)> {
        self.subjects[part_idx].look_alikes.iter().map(|(kind, part)| (*kind, part.as_ref()))
    }

    /// Draws a sample.
    pub fn sample(&self, index: u64) -> Sample {
        let part_idx = (index % self.subjects.len() as u64) as usize;
        let mut rng = generator(self.seed, Stream::Sample, index);
        let (scene, kinds, num_instances, conditions) = self.compose(part_idx, &mut rng);
        let sensor = self.sensor(&conditions, &mut rng);
        let (Rendered { ids, footprints }, image) = CANVAS.with_borrow_mut(|canvas| {
            let rendered = scene.render(num_instances, canvas);
            (rendered, sensor::take(canvas, scene.view.width, &sensor, &mut rng))
        });
        let subject = &self.subjects[part_idx];
        let instances =
            footprints.iter().enumerate().map(|(k, footprint)| instance(subject, &scene, k, footprint, &ids)).collect();
        let others = kinds
            .into_iter()
            .enumerate()
            .map(|(k, kind)| {
                let [x1, y1, x2, y2] = scene.bodies[num_instances + k].picture_box(&scene.view).map(f64::from);
                OtherObject { kind, bbox: BoundingBox { x1, y1, x2, y2 } }
            })
            .collect();
        Sample { image, part_idx, instances, others, conditions, camera: scene.view.camera(), ids }
    }

    /// Draws camera, light, table, and what lies where: instances first, then others with their kinds.
    fn compose(&self, part_idx: usize, rng: &mut Pcg64Mcg) -> (Scene, Vec<OtherKind>, usize, Conditions) {
        let (config, subject) = (&self.config, &self.subjects[part_idx]);
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
        let present = !chance(rng, config.absent_share);
        let mut layout = Layout::new(&view);
        let wanted = if present { rng.whole(config.instances[0], config.instances[1]) } else { 0 };
        for _ in 0..wanted {
            layout.lay(&subject.part, config.min_inside_share as f32, rng);
        }
        if present && layout.bodies.is_empty() {
            // The part is too large for a free place: its middle is wherever it fits best.
            for least in [0.9, 0.7, 0.0] {
                if layout.lay(&subject.part, least, rng) {
                    break;
                }
            }
        }
        let num_instances = layout.bodies.len();
        let mut kinds = Vec::new();
        let wanted = rng.whole(config.others[0], config.others[1]);
        for _ in 0..wanted {
            let (kind, other) = self.draw_other(subject, rng);
            let touches = num_instances > 0 && chance(rng, config.touch_probability);
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
            if chance(rng, config.cover_probability) && !subject.covers.is_empty() {
                let share = range(rng, config.cover_share);
                for _ in 0..6 {
                    let cover = &subject.covers[rng.whole(0, subject.covers.len() - 1)];
                    if layout.cover(cover, covered, share, rng) {
                        kinds.push(OtherKind::Cover);
                        break;
                    }
                }
            }
        }
        let bodies = layout.bodies;
        let far_shadow = (glare && rng.chance(0.5) || rng.chance(0.12)).then(|| {
            let (sin, cos) = rng.angle().sin_cos();
            let across = view.mm_per_px() * view.width as f32;
            ([cos, sin], across * rng.uniform(-0.2, 0.4), across * rng.log_uniform(0.01, 0.4), rng.uniform(0.2, 0.6))
        });
        let style = LightStyle { even: false, glare, hard: glare || rng.chance(0.15) };
        let lighting = Lighting::draw(style, rng);
        let table = Table::draw(TableStyle::Any, rng);
        (Scene { view, lighting, table, bodies, far_shadow }, kinds, num_instances, conditions)
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
        // Things that lie about are about as large as the part, or the picture would show little else.
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

    fn sensor(&self, conditions: &Conditions, rng: &mut Pcg64Mcg) -> Sensor {
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

/// The truth about an instance.
fn instance(subject: &Subject, scene: &Scene, body: usize, footprint: &Footprint, ids: &[u8]) -> Instance {
    let picture_from_part = pose(scene, body);
    let image_from_demonstration: PlanarSimilarity =
        picture_from_part.compose(&subject.photo.photo_from_part.inverse());
    let silhouette = Silhouette::of(footprint);
    let visible = ids.iter().filter(|&&id| usize::from(id) == body).count();
    Instance {
        grasp: grasp_line(&subject.part, &picture_from_part),
        marks_m: scene.bodies[body].marks_m(),
        jaw_width_px: f64::from(subject.part.grasp().jaw_width_mm) * picture_from_part.scale,
        image_from_demonstration,
        scale: image_from_demonstration.scale,
        visible_share: visible as f64 / silhouette.mask.area().max(1) as f64,
        bbox: silhouette.bbox(),
        silhouette,
    }
}

/// The look-alikes of a part that there are.
fn look_alikes(part: &Part, seed: u64) -> Vec<(LookAlike, Arc<Part>)> {
    let moved = (0..NUM_MOVED).map(|k| (LookAlike::FeatureMoved, seed.wrapping_add(k)));
    let sizes = SIZES.map(|size| (LookAlike::Scaled(size), 0));
    std::iter::once((LookAlike::Mirrored, 0))
        .chain(moved)
        .chain(sizes)
        .filter_map(|(kind, seed)| part.look_alike(kind, seed).map(|made| (kind, Arc::new(made))))
        .collect()
}

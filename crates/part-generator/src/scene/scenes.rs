//! Scenes of parts, with random access to samples.

use std::cell::RefCell;
use std::sync::Arc;

use rayon::prelude::*;
use sdg_geometry::{BoundingBox, PlanarSimilarity};

use super::config::SceneConfig;
use super::contents::Scene;
use super::photo::{DemonstrationPhoto, Silhouette, grasp_line, pose};
use super::render::{Canvas, Footprint, Rendered};
use super::sample::{Instance, OtherObject, Sample};
use super::sensor;
use crate::random::{Stream, generator, scramble};
use crate::{GeneratorError, LookAlike, Part, Result};

/// Scale factors of look-alikes.
const SIZES: [f64; 4] = [0.8, 0.9, 1.1, 1.25];

/// Number of look-alikes with a moved feature for each part.
const NUM_MOVED: u64 = 3;

/// Number of covers to choose from for each part.
const NUM_COVERS: u64 = 6;

/// Maximum number of bodies in a picture: their ids and the table's id fit into a byte.
pub(super) const MAX_BODIES: usize = 200;

thread_local! {
    /// Buffers of each thread: allocating them takes a tenth of a picture's time.
    pub(super) static CANVAS: RefCell<Canvas> = RefCell::default();
}

/// A part with the objects drawn around it.
pub(super) struct Subject {
    pub(super) part: Arc<Part>,
    pub(super) photo: DemonstrationPhoto,
    pub(super) look_alikes: Vec<(LookAlike, Arc<Part>)>,
    pub(super) covers: Vec<Arc<Part>>,
}

/// Pictures of scenes: sample *i* of a seed does not depend on the order in which samples are made.
pub struct Scenes {
    pub(super) config: SceneConfig,
    pub(super) seed: u64,
    pub(super) subjects: Vec<Subject>,
    pub(super) others: Vec<Arc<Part>>,
}

impl Scenes {
    /// Prepares scenes of parts: their demonstrations, look-alikes, covers, and other parts. Sample *i* shows the part
    /// with index *i* modulo the number of parts.
    ///
    /// # Errors
    /// No part, or an invalid configuration ([`SceneConfig::check`]).
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

    /// The configuration of the scenes.
    pub fn config(&self) -> &SceneConfig {
        &self.config
    }

    /// The demonstration of a part, to which the ground truth of its samples refers.
    pub fn photo(&self, part_idx: usize) -> &DemonstrationPhoto {
        &self.subjects[part_idx].photo
    }

    /// The part with an index, in the order given.
    pub fn part(&self, part_idx: usize) -> &Part {
        &self.subjects[part_idx].part
    }

    /// The look-alikes of a part; none if the configuration's `look_alike_share` is 0.
    pub fn look_alikes(&self, part_idx: usize) -> impl Iterator<Item = (LookAlike, &Part)> {
        self.subjects[part_idx].look_alikes.iter().map(|(kind, part)| (*kind, part.as_ref()))
    }

    /// Renders sample `index`.
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
}

/// The ground truth of an instance.
pub(super) fn instance(subject: &Subject, scene: &Scene, body: usize, footprint: &Footprint, ids: &[u8]) -> Instance {
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

/// All existing look-alikes of a part.
fn look_alikes(part: &Part, seed: u64) -> Vec<(LookAlike, Arc<Part>)> {
    let moved = (0..NUM_MOVED).map(|k| (LookAlike::FeatureMoved, seed.wrapping_add(k)));
    let sizes = SIZES.map(|size| (LookAlike::Scaled(size), 0));
    std::iter::once((LookAlike::Mirrored, 0))
        .chain(moved)
        .chain(sizes)
        .filter_map(|(kind, seed)| part.look_alike(kind, seed).map(|made| (kind, Arc::new(made))))
        .collect()
}

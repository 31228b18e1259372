//! A random part: its construction, relief, grasp and symmetry.

use std::sync::Arc;

use nalgebra::Point2;
use sdg_geometry::{Mask, Polygon, RotationalSymmetry, outer_outline};

use crate::grasp::{self, PartGrasp};
use crate::part_kind::PartKind;
use crate::part_pair::{centroid, symmetry};
use crate::random::{Draw, Stream, generator};
use crate::recipe::{self, Recipe};
use crate::relief::Relief;

/// Number of recipes that are tried. About one in four is rejected, so that no seed is expected to reach this limit.
const MAX_TRIES: u64 = 400;

/// Minimum diagonal of a part, in millimetres.
const MIN_DIAGONAL_MM: f32 = 18.0;

/// A rigid part, seen from above, in millimetres: x right, y down, z up from the table.
#[derive(Debug, Clone)]
pub struct Part {
    pub(crate) kind: PartKind,
    pub(crate) recipe: Recipe,
    pub(crate) relief: Arc<Relief>,
    pub(crate) center: [f32; 2],
    pub(crate) symmetry: RotationalSymmetry,
    pub(crate) grasp: PartGrasp,
    pub(crate) outline: Polygon,
}

impl Part {
    /// The part of a seed; kinds are equally frequent.
    pub fn generate(seed: u64) -> Self {
        let kind = generator(seed, Stream::Recipe, u64::MAX).whole(0, PartKind::ALL.len() - 1);
        Self::generate_of_kind(PartKind::ALL[kind], seed)
    }

    /// The part of a kind and a seed.
    ///
    /// # Panics
    /// If none of [`MAX_TRIES`] recipes gives a part that can be grasped; no such seed is known.
    pub fn generate_of_kind(kind: PartKind, seed: u64) -> Self {
        (0..MAX_TRIES)
            .find_map(|attempt| {
                let mut rng = generator(seed, Stream::Recipe, attempt);
                Self::from_recipe(kind, Recipe::draw(kind, &mut rng))
            })
            .expect("one of many recipes gives a part that can be grasped")
    }

    /// A covering object: paper, a cable, a finger, a rag.
    pub(crate) fn cover(size_mm: f32, seed: u64) -> Self {
        let recipe = recipe::cover(size_mm, &mut generator(seed, Stream::Others, 0));
        let relief = Arc::new(Relief::draw(&recipe));
        let center = centroid(&relief);
        let outline = outline(&relief).unwrap_or_else(|| Polygon { vertices: Vec::new() });
        // The marks of a cover are never read.
        let grasp = PartGrasp { start: center, end: center, jaw_width_mm: 0.0, height_mm: 0.0 };
        Self { kind: PartKind::Stamping, recipe, relief, center, symmetry: RotationalSymmetry::None, grasp, outline }
    }

    /// The part of a recipe; `None` if it falls apart, is too small, or cannot be grasped.
    pub(crate) fn from_recipe(kind: PartKind, recipe: Recipe) -> Option<Self> {
        let relief = Arc::new(Relief::draw(&recipe));
        if !is_one_piece(&relief) {
            return None;
        }
        let outline = outline(&relief)?;
        let bounds = outline.bounds();
        if bounds.width().hypot(bounds.height()) < f64::from(MIN_DIAGONAL_MM) {
            return None;
        }
        let center = centroid(&relief);
        let symmetry = symmetry(&relief, center);
        let grasp = grasp::find(&relief, center, symmetry)?;
        Some(Self { kind, recipe, relief, center, symmetry, grasp, outline })
    }

    /// The part's kind.
    pub fn kind(&self) -> PartKind {
        self.kind
    }

    /// The rotations about the vertical axis after which the part looks the same, computed from
    /// its heights and colours.
    pub fn symmetry(&self) -> RotationalSymmetry {
        self.symmetry
    }

    /// The part's grasp.
    pub fn grasp(&self) -> PartGrasp {
        self.grasp
    }

    /// The part's outer outline in the vertical view, in millimetres in its own frame.
    pub fn outline(&self) -> &Polygon {
        &self.outline
    }

    /// Width, depth and height, in millimetres.
    pub fn size_mm(&self) -> [f64; 3] {
        let bounds = self.outline.bounds();
        [bounds.width(), bounds.height(), f64::from(self.relief.top_mm)]
    }

    /// The diagonal of the outline's bounding box, in millimetres.
    pub fn diagonal_mm(&self) -> f64 {
        let bounds = self.outline.bounds();
        bounds.width().hypot(bounds.height())
    }
}

/// The outer outline in millimetres.
fn outline(relief: &Relief) -> Option<Polygon> {
    let level = &relief.levels[0];
    let mask = Mask::from_fn(level.width as u32, level.height as u32, |x, y| {
        level.texels[y as usize * level.width + x as usize].top > 0
    });
    let in_cells = outer_outline(&mask)?;
    let vertices = in_cells
        .vertices
        .iter()
        .map(|v| {
            let mm = |value: f64, min: f32| value * f64::from(level.cell) + f64::from(min);
            Point2::new(mm(v.x, relief.min[0]), mm(v.y, relief.min[1]))
        })
        .collect();
    Polygon::new(vertices).ok()
}

/// Whether the part is connected, except for specks, and covers enough cells.
fn is_one_piece(relief: &Relief) -> bool {
    let level = &relief.levels[1];
    let mut left: Vec<bool> = level.texels.iter().map(|texel| texel.top > 0).collect();
    let total = left.iter().filter(|&&covered| covered).count();
    let mut largest = 0;
    for first in 0..left.len() {
        if !left[first] {
            continue;
        }
        let (mut stack, mut count) = (vec![first], 0usize);
        left[first] = false;
        while let Some(at) = stack.pop() {
            count += 1;
            // The grid's margin is empty, so neighbours exist.
            for next in [at - 1, at + 1, at - level.width, at + level.width] {
                if left[next] {
                    left[next] = false;
                    stack.push(next);
                }
            }
        }
        largest = largest.max(count);
    }
    total > 60 && largest as f32 > 0.995 * total as f32
}

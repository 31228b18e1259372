//! The construction tree of a part.

use super::feature::{Feature, Prepared};
use super::material::Material;

/// The construction tree of a part: its materials and features, in millimetres.
///
/// The part's frame has x right, y down as seen from above, z up from the table.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Recipe {
    /// The materials; features refer to them by index.
    pub materials: Vec<Material>,
    /// The features in the order in which they are applied.
    pub features: Vec<Feature>,
    /// Seed of the surface's grain.
    pub grain_seed: u64,
}

impl Recipe {
    /// The features, prepared for application to many points.
    pub fn prepare(&self) -> Vec<Prepared<'_>> {
        self.features.iter().map(Feature::prepare).collect()
    }

    /// Bounding box of everything that features add: [min x, min y, max x, max y].
    pub fn bounds(&self) -> [f32; 4] {
        self.features.iter().filter(|feature| feature.operation.adds()).fold(
            [f32::MAX, f32::MAX, f32::MIN, f32::MIN],
            |b, feature| {
                let f = feature.bounds();
                [b[0].min(f[0]), b[1].min(f[1]), b[2].max(f[2]), b[3].max(f[3])]
            },
        )
    }

    /// The mirror image across the y axis.
    pub fn mirrored(&self) -> Self {
        let mut made = self.clone();
        made.features.iter_mut().for_each(Feature::mirror);
        for material in &mut made.materials {
            material.mirror();
        }
        made
    }
}

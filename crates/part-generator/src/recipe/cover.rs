//! Objects that cover parts: slips of paper, cables, fingers, cloth, tape.

use rand_pcg::Pcg64Mcg;

use super::builder::Builder;
use super::construction::Recipe;
use super::feature::{Edge, Operation};
use super::material::Material;
use super::shape::Shape;
use crate::random::Draw;

/// Samples an object of about `size` millimetres that can cover a part.
pub(crate) fn cover(size: f32, rng: &mut Pcg64Mcg) -> Recipe {
    let half = 0.5 * size;
    match rng.whole(0, 3) {
        0 => {
            // A slip of paper, card or tape, sometimes printed.
            let mut builder = Builder::new(Material { grain: 0.03, ..Material::print(rng) });
            let shape = Shape::Rectangle { half: [half, half * rng.uniform(0.3, 0.8)], corner: 0.0 };
            builder.add(shape, [0.0; 2], 0.0, 0.4, Edge::SHARP, 0);
            if rng.chance(0.5) {
                let ink = builder.material(Material::print(rng));
                builder.print([0.0; 2], 0.0, [0.7 * half, 0.2 * half], ink, rng);
            }
            builder.finish(rng)
        }
        1 => {
            // A cable in a wave.
            let mut builder = Builder::new(Material::plastic(rng));
            let (waves, swing) = (rng.uniform(0.5, 1.5), rng.uniform(0.1, 0.4) * half);
            let radius = rng.uniform(1.2, 4.0);
            let points = (0..=24)
                .map(|k| k as f32 / 12.0 - 1.0)
                .map(|t| [t * 1.4 * half, swing * (t * waves * 3.0).sin(), radius])
                .collect();
            builder.push(Shape::Path { points, radius }, [0.0; 2], 0.0, Operation::Tube, 0);
            builder.finish(rng)
        }
        2 => {
            // A finger, gloved or bare.
            let skin = rng.log_uniform(0.1, 0.55);
            let material = if rng.chance(0.6) {
                Material { albedo: [skin, 0.62 * skin, 0.45 * skin], roughness: 0.5, ..Material::plastic(rng) }
            } else {
                Material::plastic(rng)
            };
            let mut builder = Builder::new(material);
            let radius = rng.uniform(6.5, 9.5);
            let points = vec![
                [-1.6 * half - 20.0, 0.0, radius],
                [-0.2 * half, rng.uniform(-4.0, 4.0), radius + 1.0],
                [0.6 * half, 0.0, radius],
            ];
            builder.push(Shape::Path { points, radius }, [0.0; 2], 0.0, Operation::Tube, 0);
            builder.finish(rng)
        }
        _ => {
            // A rag with folds.
            let mut builder = Builder::new(Material { grain: 0.12, grain_mm: 1.5, ..Material::plastic(rng) });
            let vertices = (0..9)
                .map(|k| (k as f32 / 9.0 * std::f32::consts::TAU, half * rng.uniform(0.6, 1.0)))
                .map(|(angle, radius)| [radius * angle.cos(), radius * angle.sin()])
                .collect();
            builder.add(Shape::Polygon { vertices, corner: 0.1 * half }, [0.0; 2], 0.0, 1.5, Edge::rounded(1.0), 0);
            for _ in 0..rng.whole(3, 6) {
                let fold = Shape::Rectangle { half: [half * rng.uniform(0.3, 0.8), half * 0.12], corner: half * 0.12 };
                let center = [half * rng.uniform(-0.4, 0.4), half * rng.uniform(-0.4, 0.4)];
                let operation = Operation::Emboss { by: half * rng.uniform(0.04, 0.1), width: half * 0.12 };
                builder.push(fold, center, rng.angle(), operation, 0);
            }
            builder.finish(rng)
        }
    }
}

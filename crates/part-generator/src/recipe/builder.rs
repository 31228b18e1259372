//! Collects features, and finds free space for the next one.

use rand_pcg::Pcg64Mcg;

use super::construction::Recipe;
use super::feature::{Edge, Feature, Operation, State};
use super::material::Material;
use super::shape::Shape;
use crate::random::Draw;

/// A recipe under construction.
pub(super) struct Builder {
    materials: Vec<Material>,
    features: Vec<Feature>,
    /// Circles that later features must avoid: x, y, radius.
    taken: Vec<[f32; 3]>,
    group: u16,
}

impl Builder {
    /// Starts a recipe with a body of `material`.
    pub fn new(material: Material) -> Self {
        Self { materials: vec![material], features: Vec::new(), taken: Vec::new(), group: 0 }
    }

    /// Adds a material and returns its index.
    pub fn material(&mut self, material: Material) -> u8 {
        self.materials.push(material);
        (self.materials.len() - 1) as u8
    }

    /// Starts a new group of features that can be moved together.
    pub fn next_group(&mut self) {
        self.group += 1;
    }

    /// Adds a feature to the current group.
    pub fn push(&mut self, shape: Shape, center: [f32; 2], turn: f32, operation: Operation, material: u8) {
        self.features.push(Feature { shape, center, turn, operation, material, group: self.group });
    }

    /// Adds material from the table to `top`.
    pub fn add(&mut self, shape: Shape, center: [f32; 2], turn: f32, top: f32, edge: Edge, material: u8) {
        self.push(shape, center, turn, Operation::Add { bottom: 0.0, top, edge }, material);
    }

    /// Cuts a hole through everything, or a pocket down to `floor`.
    pub fn cut(&mut self, shape: Shape, center: [f32; 2], turn: f32, floor: f32, chamfer: f32, material: u8) {
        self.push(shape, center, turn, Operation::Cut { floor, chamfer, machined: false }, material);
    }

    /// The surface above a point, as built so far.
    pub fn state_at(&self, x: f32, y: f32) -> State {
        let mut state = State::EMPTY;
        self.features.iter().for_each(|feature| feature.prepare().apply(x, y, &mut state));
        state
    }

    /// Reserves a circle, which later features avoid.
    pub fn take(&mut self, center: [f32; 2], radius: f32) {
        self.taken.push([center[0], center[1], radius]);
    }

    /// The bounding box of the material that the features so far add.
    pub fn bounds(&self) -> [f32; 4] {
        let whole = Recipe { materials: Vec::new(), features: self.features.clone(), grain_seed: 0 };
        whole.bounds()
    }

    /// Reserves a random free circle of `radius` on a level surface and returns its centre.
    pub fn room(&mut self, radius: f32, rng: &mut Pcg64Mcg) -> Option<[f32; 2]> {
        let b = self.bounds();
        for _ in 0..40 {
            let center = [rng.uniform(b[0], b[2]), rng.uniform(b[1], b[3])];
            if self.is_free(center, radius) {
                self.take(center, radius);
                return Some(center);
            }
        }
        None
    }

    /// Whether a circle is on a level surface and free.
    pub fn is_free(&self, center: [f32; 2], radius: f32) -> bool {
        let clear = self.taken.iter().all(|&[x, y, taken]| (x - center[0]).hypot(y - center[1]) > taken + radius + 0.3);
        if !clear {
            return false;
        }
        let middle = self.state_at(center[0], center[1]);
        middle.is_covered()
            && [1.0f32, 0.5].iter().all(|&share| {
                (0..8).all(|k| {
                    let (sin, cos) = (k as f32 * std::f32::consts::FRAC_PI_4).sin_cos();
                    let state = self.state_at(center[0] + cos * radius * share, center[1] + sin * radius * share);
                    state.is_covered() && (state.top - middle.top).abs() < 0.05 * radius + 0.1
                })
            })
    }

    /// Adds a few lines of marks that look like print, in a frame with half size `half` around
    /// `center`.
    pub fn print(&mut self, center: [f32; 2], turn: f32, half: [f32; 2], material: u8, rng: &mut Pcg64Mcg) {
        let (sin, cos) = turn.sin_cos();
        let lines = rng.whole(1, 3);
        let pitch = 2.0 * half[1] / lines as f32;
        for line in 0..lines {
            let y = -half[1] + pitch * (line as f32 + 0.5);
            let mut x = -half[0];
            let letter = pitch * rng.uniform(0.3, 0.5);
            while x < half[0] - letter {
                let width = letter * rng.uniform(0.5, 1.2);
                if rng.chance(0.85) {
                    let bar = rng.chance(0.5);
                    let shape = Shape::Rectangle {
                        half: [
                            width * if bar { 0.2 } else { 0.42 },
                            pitch * if bar { 0.34 } else { rng.uniform(0.12, 0.34) },
                        ],
                        corner: 0.05 * pitch,
                    };
                    let (lx, ly) = (x + 0.5 * width, y);
                    let place = [center[0] + cos * lx - sin * ly, center[1] + sin * lx + cos * ly];
                    self.push(shape, place, turn, Operation::Paint, material);
                }
                x += width + 0.25 * letter;
            }
        }
    }

    /// The finished recipe.
    pub fn finish(self, rng: &mut Pcg64Mcg) -> Recipe {
        Recipe { materials: self.materials, features: self.features, grain_seed: rng.whole(0, 1 << 30) as u64 }
    }
}

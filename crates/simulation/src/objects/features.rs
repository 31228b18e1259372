//! The features of a part: groups of connected pieces of its meshes that can be moved.
//!
//! ```text
//! meshes ─> pieces ─> contacts between pieces ─> from the largest piece outwards: each piece with all pieces attached to it
//! ```

use nalgebra::{Point3, Vector3};

use super::shape::VisualMesh;

/// Largest distance between the boxes of two pieces that touch, in metres.
const TOUCH_M: f64 = 0.0004;

/// Size of the largest feature, as a fraction of the diagonal of the part's bounding box.
const MAX_FEATURE: f64 = 0.42;

/// A box along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub(super) low: Point3<f64>,
    pub(super) high: Point3<f64>,
}

impl Bounds {
    fn empty() -> Self {
        let far = Point3::from(Vector3::repeat(f64::INFINITY));
        Self { low: far, high: -far }
    }

    fn joined(&self, other: &Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    pub(super) fn size(&self) -> Vector3<f64> {
        self.high - self.low
    }

    pub(super) fn diagonal_m(&self) -> f64 {
        self.size().norm()
    }

    pub(super) fn centre(&self) -> Point3<f64> {
        nalgebra::center(&self.low, &self.high)
    }

    pub(super) fn contains(&self, point: &Point3<f64>, margin_m: f64) -> bool {
        (0..3).all(|k| point[k] >= self.low[k] - margin_m && point[k] <= self.high[k] + margin_m)
    }

    fn touches(&self, other: &Self) -> bool {
        (0..3).all(|k| self.low[k] <= other.high[k] + TOUCH_M && other.low[k] <= self.high[k] + TOUCH_M)
    }

    /// The volume, with thin boxes counted as a millimetre thick.
    fn volume(&self) -> f64 {
        self.size().map(|side| side.max(0.001)).product()
    }
}

/// A connected piece of one mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    pub(super) bounds: Bounds,
}

/// Every piece of a part, and the piece of each point.
pub(super) struct Pieces {
    pub(super) pieces: Vec<Piece>,
    /// The index into `pieces` of each position of each mesh.
    pub(super) piece_of: Vec<Vec<usize>>,
}

impl Pieces {
    pub(super) fn of(meshes: &[VisualMesh]) -> Self {
        let (mut pieces, mut piece_of) = (Vec::new(), Vec::new());
        for VisualMesh { mesh, .. } in meshes {
            let (numbers, count) = mesh.pieces();
            let first = pieces.len();
            pieces.extend((0..count).map(|_| Piece { bounds: Bounds::empty() }));
            for (position, number) in mesh.positions.iter().zip(&numbers) {
                let bounds = &mut pieces[first + number].bounds;
                *bounds = bounds.joined(&Bounds { low: *position, high: *position });
            }
            piece_of.push(numbers.into_iter().map(|number| first + number).collect());
        }
        Self { pieces, piece_of }
    }

    /// The box around the whole part.
    pub(super) fn bounds(&self) -> Bounds {
        self.pieces.iter().fold(Bounds::empty(), |bounds, piece| bounds.joined(&piece.bounds))
    }

    /// Groups of pieces that could be moved together, as sorted indices, each group once.
    ///
    /// The part's body is the piece with the largest box; every other piece is attached to the largest of its
    /// neighbours that are one step closer to the body. A feature is a piece with all pieces attached to it, and with
    /// the small pieces that touch it.
    pub(super) fn features(&self) -> Vec<Vec<usize>> {
        let count = self.pieces.len();
        let bounds = |idx: usize| &self.pieces[idx].bounds;
        let neighbours: Vec<Vec<usize>> =
            (0..count).map(|a| (0..count).filter(|&b| a != b && bounds(a).touches(bounds(b))).collect()).collect();
        let Some(body) = (0..count).max_by(|&a, &b| bounds(a).volume().total_cmp(&bounds(b).volume())) else {
            return Vec::new();
        };
        let mut level = vec![usize::MAX; count];
        level[body] = 0;
        let mut parent = vec![None; count];
        let mut ring = vec![body];
        while !ring.is_empty() {
            let mut next = Vec::new();
            for &from in &ring {
                for &to in &neighbours[from] {
                    if level[to] == usize::MAX {
                        level[to] = level[from] + 1;
                        next.push(to);
                    }
                    let is_larger = parent[to].is_none_or(|known| bounds(from).volume() > bounds(known).volume());
                    if level[to] == level[from] + 1 && is_larger {
                        parent[to] = Some(from);
                    }
                }
            }
            ring = next;
        }
        let max_diagonal = MAX_FEATURE * self.bounds().diagonal_m();
        let mut features: Vec<Vec<usize>> = Vec::new();
        for first in (0..count).filter(|&idx| idx != body && bounds(idx).diagonal_m() <= max_diagonal) {
            let mut is_in = vec![false; count];
            is_in[first] = true;
            let mut group = *bounds(first);
            loop {
                let joins = |idx: usize| {
                    let stands_on_it = parent[idx].is_some_and(|parent| is_in[parent]);
                    let is_small_beside = level[idx] >= level[first]
                        && bounds(idx).diagonal_m() < 0.5 * group.diagonal_m()
                        && neighbours[idx].iter().any(|&other| is_in[other]);
                    stands_on_it || is_small_beside
                };
                let joining: Vec<usize> = (0..count).filter(|&idx| idx != body && !is_in[idx] && joins(idx)).collect();
                if joining.is_empty() {
                    break;
                }
                for idx in joining {
                    is_in[idx] = true;
                    group = group.joined(bounds(idx));
                }
            }
            let feature: Vec<usize> = (0..count).filter(|&idx| is_in[idx]).collect();
            if group.diagonal_m() <= max_diagonal && !features.contains(&feature) {
                features.push(feature);
            }
        }
        features
    }

    /// The box around some pieces.
    pub(super) fn bounds_of(&self, feature: &[usize]) -> Bounds {
        feature.iter().fold(Bounds::empty(), |bounds, &idx| bounds.joined(&self.pieces[idx].bounds))
    }
}

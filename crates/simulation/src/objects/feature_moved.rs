//! Look-alikes with one change: a moved feature, a stretched or shortened region, or a narrower bore.
//!
//! All checks use the view from above, which is also the camera's. A moved feature must have the same surface under it,
//! at the same height, and the view must change visibly.

use nalgebra::{Point2, Point3, Vector2, Vector3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_geometry::{RotationalSymmetry, convex_hull};

use super::ObjectSpec;
use super::features::{Bounds, Pieces};
use super::height_map::HeightMap;
use super::look_alike::rounded;
use super::mjcf_tags::{Tag, map_tags};
use super::shape::{VisualMesh, triangles};
use crate::error::Result;

/// Distance of the move, as a fraction of the diagonal of the part's bounding box.
const MOVES: std::ops::Range<f64> = 0.05..0.10;

/// Side of a cell of the views from above, in metres.
const CELL_M: f64 = 0.001;
/// Smallest height difference that is visible from above, in metres.
const SAME_HEIGHT_M: f64 = 0.001;
/// Largest height difference of surfaces that count as the same, in metres.
const SAME_GROUND_M: f64 = 0.0015;
/// Maximum fraction of a feature's cells that may have another surface under them after the move.
const MAX_OTHER_GROUND: f64 = 0.04;
/// Minimum fraction of the cells visible from above that must change.
const MIN_CHANGE: f64 = 0.012;
/// Number of random moves tried for each feature.
const MOVES_PER_FEATURE: usize = 8;

/// Length of the stretched region, as a fraction of the part's length.
const STRETCHED_SHARE: f64 = 0.3;
/// Size up to which pieces keep their shape when a region is stretched, as a fraction of the diagonal of the part's
/// bounding box.
const RIGID_SHARE: f64 = 0.3;

/// A change of the positions of a part's points.
enum Change {
    /// Moves some pieces together by a vector.
    Move { feature: Vec<usize>, bounds: Bounds, by: Vector3<f64> },
    /// Moves the points beyond a region along x by a distance, and stretches the region itself.
    Stretch { from: f64, to: f64, by: f64 },
    /// Changes the radius of the bore of a round part.
    Bore { radius: f64, outer: f64, by: f64 },
}

impl ObjectSpec {
    /// The part with one change, and a description of it.
    ///
    /// # Errors
    /// As for `visual_meshes`.
    pub(super) fn with_feature_moved(&self, seed: u64) -> Result<(Self, String)> {
        let rng = &mut Pcg64Mcg::seed_from_u64(seed ^ 0x4d4f_5645_445f_4654);
        let meshes = self.visual_meshes()?;
        let pieces = Pieces::of(&meshes);
        let change = match self.symmetry {
            RotationalSymmetry::Full => None,
            _ => moved_feature(&meshes, &pieces, rng),
        };
        let change = change.unwrap_or_else(|| match self.symmetry {
            RotationalSymmetry::Full => other_bore(&meshes, &pieces, rng),
            _ => stretched(&meshes, &pieces, rng),
        });
        self.changed(&meshes, &pieces, &change)
    }

    fn changed(&self, meshes: &[VisualMesh], pieces: &Pieces, change: &Change) -> Result<(Self, String)> {
        let description = change.description(pieces);
        let mut spec = self.renamed("feature_moved", &description);
        let rigid_m = RIGID_SHARE * pieces.bounds().diagonal_m();
        let moved = |mesh_idx: usize, idx: usize, p: Point3<f64>| {
            let piece = pieces.piece_of[mesh_idx][idx];
            change.applied(piece, &pieces.pieces[piece].bounds, rigid_m, p)
        };
        spec.map_meshes(|mesh_idx, mesh| mesh.mapped(|idx, p| moved(mesh_idx, idx, p)))?;
        let corners = meshes.iter().enumerate().flat_map(|(mesh_idx, VisualMesh { mesh, .. })| {
            mesh.positions.iter().enumerate().map(move |(idx, p)| moved(mesh_idx, idx, *p).xy())
        });
        // Rounding makes nearly straight edges straight.
        spec.footprint = convex_hull(corners.map(|p| p.map(|value| (value * 1e5).round() / 1e5)));
        if let Change::Stretch { .. } = change {
            spec.grasp_start = change.along_x(spec.grasp_start).map(rounded);
            spec.grasp_end = change.along_x(spec.grasp_end).map(rounded);
        }
        spec.mjcf = map_tags(&spec.mjcf, |tag| tag.name == "geom" && change.move_shape(tag));
        Ok((spec, description))
    }
}

impl Change {
    /// The new position of a point of a piece.
    fn applied(&self, piece: usize, bounds: &Bounds, rigid_m: f64, p: Point3<f64>) -> Point3<f64> {
        match self {
            Self::Move { feature, by, .. } => match feature.binary_search(&piece) {
                Ok(_) => p + by,
                Err(_) => p,
            },
            Self::Stretch { .. } if bounds.diagonal_m() <= rigid_m => {
                p + (self.along_x(bounds.centre()) - bounds.centre())
            }
            Self::Stretch { .. } => self.along_x(p),
            Self::Bore { .. } => {
                // Pieces around the axis get a narrower bore; a piece beside the axis (a ball) moves as a whole.
                let around_axis = bounds.contains(&Point3::new(0.0, 0.0, bounds.centre().z), 0.0);
                if around_axis { self.radially(p) } else { p + (self.radially(bounds.centre()) - bounds.centre()) }
            }
        }
    }

    fn along_x(&self, p: Point3<f64>) -> Point3<f64> {
        match self {
            Self::Stretch { from, to, by } => {
                Point3::new(p.x + by * ((p.x - from) / (to - from)).clamp(0.0, 1.0), p.y, p.z)
            }
            _ => p,
        }
    }

    fn radially(&self, p: Point3<f64>) -> Point3<f64> {
        let Self::Bore { radius, outer, by } = self else { return p };
        let r = p.x.hypot(p.y);
        if r < 1e-9 {
            return p;
        }
        let share = 1.0 - ((r - radius) / (outer - radius)).clamp(0.0, 1.0);
        let factor = (r + by * share) / r;
        Point3::new(p.x * factor, p.y * factor, p.z)
    }

    /// Moves a collision shape with its visible piece; false if it stays.
    fn move_shape(&self, tag: &mut Tag) -> bool {
        if tag.get("group") != Some("3") {
            return false;
        }
        let point = |values: &[f64]| Point3::new(values[0], values[1], values[2]);
        let (pos, ends) = (tag.numbers("pos"), tag.numbers("fromto"));
        let middle = match (&pos, &ends) {
            (Some(pos), _) if pos.len() == 3 => point(pos),
            (_, Some(ends)) if ends.len() == 6 => nalgebra::center(&point(&ends[..3]), &point(&ends[3..])),
            _ => return false,
        };
        match self {
            Self::Move { bounds, by, .. } => {
                let is_its =
                    bounds.contains(&middle, 0.002) && (middle - bounds.centre()).norm() < 0.35 * bounds.diagonal_m();
                if is_its {
                    tag.map_numbers("pos", |p| (0..3).for_each(|k| p[k] += by[k]));
                    tag.map_numbers("fromto", |p| (0..6).for_each(|k| p[k] += by[k % 3]));
                }
                is_its
            }
            Self::Stretch { .. } => {
                let is_straight_box = tag.get("type") == Some("box") && tag.get("quat").is_none();
                match (is_straight_box, tag.numbers("size").as_deref(), pos) {
                    (true, Some(&[half, ..]), Some(pos)) => {
                        let ends = [-half, half].map(|x| self.along_x(point(&pos) + Vector3::x() * x).x);
                        tag.map_numbers("pos", |p| p[0] = 0.5 * (ends[0] + ends[1]));
                        tag.map_numbers("size", |s| s[0] = 0.5 * (ends[1] - ends[0]));
                    }
                    (_, _, Some(pos)) => {
                        let x = self.along_x(point(&pos)).x;
                        tag.map_numbers("pos", |p| p[0] = x);
                    }
                    _ => tag.map_numbers("fromto", |p| {
                        for end in [0, 3] {
                            p[end] = self.along_x(point(&p[end..end + 3])).x;
                        }
                    }),
                }
                true
            }
            // Collision shapes stay, because only the outer ring touches table and jaws.
            Self::Bore { .. } => false,
        }
    }

    fn description(&self, pieces: &Pieces) -> String {
        let diagonal_m = pieces.bounds().diagonal_m();
        match self {
            Self::Move { bounds, by, .. } => {
                let c = bounds.centre();
                format!(
                    "feature at ({:.0}, {:.0}) mm moved by ({:.0}, {:.0}) mm, {:.0} % of the diagonal",
                    c.x * 1e3,
                    c.y * 1e3,
                    by.x * 1e3,
                    by.y * 1e3,
                    by.norm() / diagonal_m * 100.0
                )
            }
            Self::Stretch { from, to, by } => format!(
                "{:.0} to {:.0} mm along the part {} by {:.0} mm, {:.0} % of the diagonal",
                from * 1e3,
                to * 1e3,
                if *by > 0.0 { "stretched" } else { "shortened" },
                by.abs() * 1e3,
                by.abs() / diagonal_m * 100.0
            ),
            Self::Bore { radius, by, .. } => format!(
                "bore of {:.0} instead of {:.0} mm, its wall moved by {:.0} % of the diagonal",
                2e3 * (radius + by),
                2e3 * radius,
                by.abs() / diagonal_m * 100.0
            ),
        }
    }
}

/// A random feature and move that pass all checks; `None` if none is found.
fn moved_feature(meshes: &[VisualMesh], pieces: &Pieces, rng: &mut Pcg64Mcg) -> Option<Change> {
    let all = triangles(meshes);
    let before = HeightMap::new(&all, CELL_M);
    let diagonal_m = pieces.bounds().diagonal_m();
    let mut possible = Vec::new();
    for feature in pieces.features() {
        let parted = Parted::new(meshes, pieces, &feature);
        let bounds = pieces.bounds_of(&feature);
        let directions = [Vector3::x(), -Vector3::x(), Vector3::y(), -Vector3::y()];
        let found = (0..MOVES_PER_FEATURE).find_map(|attempt| {
            let by = directions[(attempt + rng.random_range(0..4)) % 4] * (diagonal_m * rng.random_range(MOVES));
            (parted.still_stands(&by) && parted.change(&before, &by) >= MIN_CHANGE).then_some(by)
        });
        if let Some(by) = found {
            possible.push(Change::Move { feature, bounds, by });
        }
    }
    match possible.len() {
        0 => None,
        count => Some(possible.swap_remove(rng.random_range(0..count))),
    }
}

/// A part separated into one feature and the rest.
struct Parted {
    feature_triangles: Vec<([Point3<f64>; 3], u32)>,
    rest_triangles: Vec<([Point3<f64>; 3], u32)>,
    rest: HeightMap,
    /// The feature's cells from above, with the holes inside it.
    cells: Vec<Point2<f64>>,
}

impl Parted {
    fn new(meshes: &[VisualMesh], pieces: &Pieces, feature: &[usize]) -> Self {
        let (mut feature_triangles, mut rest_triangles) = (Vec::new(), Vec::new());
        for (mesh_idx, VisualMesh { mesh, .. }) in meshes.iter().enumerate() {
            for face in &mesh.faces {
                let piece = pieces.piece_of[mesh_idx][face[0].position as usize];
                let to =
                    if feature.binary_search(&piece).is_ok() { &mut feature_triangles } else { &mut rest_triangles };
                to.push((mesh.corners(face), mesh_idx as u32));
            }
        }
        let map = HeightMap::new(&feature_triangles, CELL_M);
        let rest = HeightMap::new(&rest_triangles, CELL_M);
        let cells = filled_rows(&map);
        Self { feature_triangles, rest_triangles, rest, cells }
    }

    /// Whether the feature has the same surface under it after a move.
    fn still_stands(&self, by: &Vector3<f64>) -> bool {
        let ground = |at: &Point2<f64>| self.rest.at(at).map(|(z, _)| z);
        let is_same = |a: Option<f64>, b: Option<f64>| match (a, b) {
            (Some(a), Some(b)) => (a - b).abs() <= SAME_GROUND_M,
            (None, None) => true,
            _ => false,
        };
        let others = self.cells.iter().filter(|at| !is_same(ground(at), ground(&(**at + by.xy())))).count();
        // After the move, the feature must touch the rest along nearly as many cells as before.
        let touching = |shift: Vector2<f64>| {
            let neighbours = [[1.5, 0.0], [-1.5, 0.0], [0.0, 1.5], [0.0, -1.5]].map(|d| Vector2::from(d) * CELL_M);
            self.cells.iter().filter(|at| neighbours.iter().any(|d| ground(&(**at + shift + d)).is_some())).count()
        };
        let (before, after) = (touching(Vector2::zeros()), touching(by.xy()));
        (others as f64) <= MAX_OTHER_GROUND * self.cells.len() as f64
            && before > 0
            && after as f64 >= 0.85 * before as f64
    }

    /// Fraction of the cells visible from above that a move changes.
    fn change(&self, before: &HeightMap, by: &Vector3<f64>) -> f64 {
        let moved = self.feature_triangles.iter().map(|(corners, mesh)| (corners.map(|p| p + by), *mesh));
        let after: Vec<_> = self.rest_triangles.iter().copied().chain(moved).collect();
        HeightMap::new(&after, CELL_M).difference(before, &nalgebra::Isometry2::identity(), SAME_HEIGHT_M)
    }
}

/// The filled cells of a map, and all cells between them in the same row.
fn filled_rows(map: &HeightMap) -> Vec<Point2<f64>> {
    let mut cells = Vec::new();
    for row in 0..map.height {
        let is_filled = |col: usize| map.cells[row * map.width + col].is_some();
        let first = (0..map.width).find(|&col| is_filled(col));
        let last = (0..map.width).rfind(|&col| is_filled(col));
        if let (Some(first), Some(last)) = (first, last) {
            cells.extend(
                (first..=last).map(|col| map.corner + Vector2::new(col as f64 + 0.5, row as f64 + 0.5) * map.cell_m),
            );
        }
    }
    cells
}

/// Stretches or shortens the region along x in which the part changes least, so that the points beyond it move.
fn stretched(meshes: &[VisualMesh], pieces: &Pieces, rng: &mut Pcg64Mcg) -> Change {
    let map = HeightMap::new(&triangles(meshes), CELL_M);
    let bounds = pieces.bounds();
    let columns: Vec<Vec<i64>> = (0..map.width)
        .map(|col| {
            let height = |row: usize| map.cells[row * map.width + col].map_or(-1, |(z, _)| (z / SAME_HEIGHT_M) as i64);
            (0..map.height).map(height).collect()
        })
        .collect();
    // Number of cells in which each column differs from the one before it.
    let changes: Vec<usize> = columns
        .windows(2)
        .map(|pair| pair[0].iter().zip(&pair[1]).filter(|(a, b)| a.abs_diff(**b) > 1).count())
        .collect();
    let region = ((STRETCHED_SHARE * map.width as f64) as usize).clamp(1, changes.len().max(1));
    // The region keeps a distance from both ends, so that they stay unchanged.
    let margin = map.width / 10;
    let starts = margin..changes.len().saturating_sub(region + margin).max(margin + 1);
    let cost = |start: usize| changes.iter().skip(start).take(region).sum::<usize>();
    let least = starts.min_by_key(|&start| cost(start)).unwrap_or(0);
    let at = |col: usize| map.corner.x + col as f64 * map.cell_m;
    let by = bounds.diagonal_m() * rng.random_range(MOVES) * if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    Change::Stretch { from: at(least + 1), to: at(least + 1 + region), by }
}

/// A round part with a narrower bore.
fn other_bore(meshes: &[VisualMesh], pieces: &Pieces, rng: &mut Pcg64Mcg) -> Change {
    let radii = meshes.iter().flat_map(|visual| visual.mesh.positions.iter().map(|p| p.x.hypot(p.y)));
    let (radius, outer) = radii.fold((f64::INFINITY, 0.0), |(low, high), r| (f64::min(low, r), f64::max(high, r)));
    // The bore keeps at least 0.3 of its radius.
    let by = (pieces.bounds().diagonal_m() * rng.random_range(MOVES)).min(0.7 * radius);
    Change::Bore { radius, outer, by: -by }
}

//! Closed triangle meshes with texture coordinates, created by code and written as OBJ text.
//!
//! Positions are stored without normals. [`TriangleMesh::to_obj`] computes one normal per face corner as the average
//! over the face itself and the adjacent faces whose angle to it is at most [`CREASE_DEG`]. Round surfaces thus appear
//! smooth, edges stay sharp, and builders need not handle shading.

use std::collections::HashMap;
use std::fmt::Write as _;

use nalgebra::{Isometry3, Matrix3, Point2, Point3, Vector3};

/// Angle between two faces above which the edge between them is shaded as a sharp edge.
pub const CREASE_DEG: f64 = 38.0;

/// Distance below which two positions count as one point in the search for adjacent faces, in metres.
const WELD_M: f64 = 1e-7;

/// A point of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshVertex {
    /// Position in metres.
    pub position: Point3<f64>,
    /// Texture coordinates; 1 is one repeat of the texture.
    pub texcoord: Point2<f64>,
}

/// A triangle mesh whose faces are counter-clockwise seen from outside.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriangleMesh {
    /// The points; at a seam of the texture the same position occurs twice.
    pub vertices: Vec<MeshVertex>,
    /// Three indices into `vertices` per face.
    pub faces: Vec<[u32; 3]>,
}

/// Volume, centre and second moments of a closed mesh at unit density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// Volume in cubic metres, which is the mass at unit density.
    pub volume: f64,
    /// Centre of mass in metres.
    pub centre: Point3<f64>,
    /// Inertia about the centre, at unit density (m⁵).
    pub inertia: Matrix3<f64>,
}

impl TriangleMesh {
    /// Adds a point and returns its index.
    pub fn push(&mut self, position: Point3<f64>, texcoord: Point2<f64>) -> u32 {
        let index = u32::try_from(self.vertices.len()).expect("a mesh has fewer than 2^32 points");
        self.vertices.push(MeshVertex { position, texcoord });
        index
    }

    /// Adds a grid of `rows × cols` points and two triangles per cell; triangles without area are left out.
    ///
    /// The faces point in the direction (next column) × (next row).
    pub fn push_grid(&mut self, rows: usize, cols: usize, point: impl Fn(usize, usize) -> MeshVertex) {
        let base = self.vertices.len() as u32;
        for row in 0..rows {
            for col in 0..cols {
                self.vertices.push(point(row, col));
            }
        }
        let index = |row: usize, col: usize| base + (row * cols + col) as u32;
        for row in 0..rows - 1 {
            for col in 0..cols - 1 {
                let (a, b) = (index(row, col), index(row, col + 1));
                let (c, d) = (index(row + 1, col + 1), index(row + 1, col));
                self.faces.push([a, b, c]);
                self.faces.push([a, c, d]);
            }
        }
        self.drop_degenerate_faces();
    }

    /// Appends another mesh.
    pub fn append(&mut self, other: &TriangleMesh) {
        let base = self.vertices.len() as u32;
        self.vertices.extend_from_slice(&other.vertices);
        self.faces.extend(other.faces.iter().map(|face| face.map(|index| index + base)));
    }

    /// Moves every point.
    pub fn transformed(mut self, target_from_mesh: &Isometry3<f64>) -> Self {
        for vertex in &mut self.vertices {
            vertex.position = target_from_mesh * vertex.position;
        }
        self
    }

    /// Projects the texture from above: `(x, y) / metres_per_repeat`.
    pub fn textured_from_above(mut self, metres_per_repeat: f64) -> Self {
        for vertex in &mut self.vertices {
            vertex.texcoord = Point2::from(vertex.position.coords.xy() / metres_per_repeat);
        }
        self
    }

    /// Smallest and largest coordinates.
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        let mut low = Point3::from(Vector3::repeat(f64::INFINITY));
        let mut high = Point3::from(Vector3::repeat(f64::NEG_INFINITY));
        for vertex in &self.vertices {
            low = low.inf(&vertex.position);
            high = high.sup(&vertex.position);
        }
        (low, high)
    }

    /// Positions of one face.
    pub fn corners(&self, face: [u32; 3]) -> [Point3<f64>; 3] {
        face.map(|index| self.vertices[index as usize].position)
    }

    /// Integrates volume, centre and inertia over the closed mesh, as a sum of signed tetrahedra.
    ///
    /// # Source
    /// Tonon, "Explicit exact formulas for the 3-D tetrahedron inertia tensor", 2004, in covariance form.
    pub fn mass_properties(&self) -> MassProperties {
        let mut volume = 0.0;
        let mut first = Vector3::zeros();
        let mut second = Matrix3::zeros();
        // Covariance of the unit tetrahedron spanned by the three axes: 1/60 on the diagonal, 1/120 elsewhere.
        let canonical = Matrix3::from_fn(|row, col| if row == col { 1.0 / 60.0 } else { 1.0 / 120.0 });
        for &face in &self.faces {
            let [a, b, c] = self.corners(face);
            let edges = Matrix3::from_columns(&[a.coords, b.coords, c.coords]);
            let determinant = edges.determinant();
            volume += determinant / 6.0;
            first += (a.coords + b.coords + c.coords) * (determinant / 24.0);
            second += edges * canonical * edges.transpose() * determinant;
        }
        let centre = first / volume;
        let covariance = second - centre * centre.transpose() * volume;
        MassProperties {
            volume,
            centre: Point3::from(centre),
            inertia: Matrix3::identity() * covariance.trace() - covariance,
        }
    }

    /// Writes OBJ text: positions (rounded to a hundredth of a millimetre), texture coordinates and normals.
    pub fn to_obj(&self) -> String {
        let normals = self.corner_normals();
        let mut text = String::new();
        let mut positions = Interned::default();
        let mut texcoords = Interned::default();
        let mut directions = Interned::default();
        let mut body = String::new();
        for (face, face_normals) in self.faces.iter().zip(&normals) {
            body.push('f');
            for (&index, normal) in face.iter().zip(face_normals) {
                let vertex = &self.vertices[index as usize];
                let p = vertex.position;
                let position = positions.index(format!("{} {} {}", short(p.x, 5), short(p.y, 5), short(p.z, 5)));
                let texcoord =
                    texcoords.index(format!("{} {}", short(vertex.texcoord.x, 3), short(vertex.texcoord.y, 3)));
                let direction =
                    directions.index(format!("{} {} {}", short(normal.x, 2), short(normal.y, 2), short(normal.z, 2)));
                let _ = write!(body, " {position}/{texcoord}/{direction}");
            }
            body.push('\n');
        }
        for (keyword, interned) in [("v", positions), ("vt", texcoords), ("vn", directions)] {
            for line in interned.lines {
                let _ = writeln!(text, "{keyword} {line}");
            }
        }
        text + &body
    }

    /// One normal per face corner (see the module documentation); adjacent faces are weighted by their angle at the
    /// corner.
    fn corner_normals(&self) -> Vec<[Vector3<f64>; 3]> {
        let key = |p: Point3<f64>| {
            [(p.x / WELD_M).round() as i64, (p.y / WELD_M).round() as i64, (p.z / WELD_M).round() as i64]
        };
        let mut around: HashMap<[i64; 3], Vec<(Vector3<f64>, f64)>> = HashMap::new();
        let mut face_normals = Vec::with_capacity(self.faces.len());
        for &face in &self.faces {
            let corners = self.corners(face);
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).normalize();
            for idx in 0..3 {
                let to_next = corners[(idx + 1) % 3] - corners[idx];
                let to_previous = corners[(idx + 2) % 3] - corners[idx];
                around.entry(key(corners[idx])).or_default().push((normal, to_next.angle(&to_previous)));
            }
            face_normals.push(normal);
        }
        let min_cosine = CREASE_DEG.to_radians().cos();
        self.faces
            .iter()
            .zip(face_normals)
            .map(|(&face, own)| {
                self.corners(face).map(|corner| {
                    let sum: Vector3<f64> = around[&key(corner)]
                        .iter()
                        .filter(|(normal, _)| normal.dot(&own) >= min_cosine)
                        .map(|(normal, angle)| normal * *angle)
                        .sum();
                    sum.try_normalize(0.0).unwrap_or(own)
                })
            })
            .collect()
    }

    fn drop_degenerate_faces(&mut self) {
        let faces = std::mem::take(&mut self.faces);
        self.faces = faces
            .into_iter()
            .filter(|&face| {
                let [a, b, c] = self.corners(face);
                (b - a).cross(&(c - a)).norm() > WELD_M * WELD_M
            })
            .collect();
    }
}

/// Distinct lines of text, in the order of their first occurrence. Indices are counted from 1, as in OBJ.
#[derive(Default)]
struct Interned {
    lines: Vec<String>,
    numbers: HashMap<String, usize>,
}

impl Interned {
    fn index(&mut self, line: String) -> usize {
        if let Some(&number) = self.numbers.get(&line) {
            return number;
        }
        self.lines.push(line.clone());
        self.numbers.insert(line, self.lines.len());
        self.lines.len()
    }
}

/// A decimal without trailing zeros and without a negative zero.
fn short(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::shapes::solids::{box_solid, lathe};
    use approx::assert_relative_eq;

    #[test]
    fn box_has_the_mass_properties_of_the_textbook() {
        let (a, b, c) = (0.2, 0.1, 0.05);
        let at = Isometry3::translation(1.0, 2.0, 3.0);
        let properties = box_solid(a, b, c, 0.0).transformed(&at).mass_properties();
        let mass = a * b * c;
        assert_relative_eq!(properties.volume, mass, epsilon = 1e-12);
        assert_relative_eq!(properties.centre, Point3::new(1.0, 2.0, 3.0 + c / 2.0), epsilon = 1e-9);
        assert_relative_eq!(properties.inertia[(0, 0)], mass / 12.0 * (b * b + c * c), epsilon = 1e-12);
        assert_relative_eq!(properties.inertia[(2, 2)], mass / 12.0 * (a * a + b * b), epsilon = 1e-12);
        assert_relative_eq!(properties.inertia[(0, 1)], 0.0, epsilon = 1e-12);
    }

    #[test]
    fn cylinder_is_smooth_around_and_sharp_at_its_edge() {
        let mesh = lathe(&[(0.0, 0.0), (0.01, 0.0), (0.01, 0.03), (0.0, 0.03)], 24);
        for (face, normals) in mesh.faces.iter().zip(mesh.corner_normals()) {
            for (corner, normal) in mesh.corners(*face).iter().zip(normals) {
                if normal.z.abs() < 0.5 {
                    let radial = Vector3::new(corner.x, corner.y, 0.0).normalize();
                    assert!(radial.dot(&normal) > 0.9999, "side normal {normal} at {corner}");
                } else {
                    assert_relative_eq!(normal.z.abs(), 1.0, epsilon = 1e-9);
                }
            }
        }
    }

    #[test]
    fn obj_numbers_every_corner_within_its_lists() {
        let obj = box_solid(0.02, 0.02, 0.01, 0.001).to_obj();
        let count = |keyword: &str| obj.lines().filter(|line| line.split(' ').next() == Some(keyword)).count();
        let limits = [count("v"), count("vt"), count("vn")];
        assert!(count("f") > 10);
        for line in obj.lines().filter(|line| line.starts_with("f ")) {
            for corner in line.split(' ').skip(1) {
                let numbers: Vec<usize> = corner.split('/').map(|number| number.parse().unwrap()).collect();
                assert_eq!(numbers.len(), 3);
                assert!(numbers.iter().zip(limits).all(|(&number, limit)| number >= 1 && number <= limit));
            }
        }
    }
}

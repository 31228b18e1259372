//! Reads, changes and writes the triangle meshes of a part's OBJ files.

use std::fmt::Write as _;

use nalgebra::{Point2, Point3, Vector3};

/// One corner of a face: indices into positions, texture coordinates and normals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ObjCorner {
    pub(crate) position: u32,
    texcoord: Option<u32>,
    normal: Option<u32>,
}

/// The triangles of one OBJ file, in metres.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ObjMesh {
    /// Points in the object frame.
    pub(crate) positions: Vec<Point3<f64>>,
    texcoords: Vec<Point2<f64>>,
    normals: Vec<Vector3<f64>>,
    /// Three corners per face, counter-clockwise seen from outside.
    pub(crate) faces: Vec<[ObjCorner; 3]>,
}

impl ObjMesh {
    /// Reads the lines `v`, `vt`, `vn` and `f` of an OBJ text of triangles; other lines are ignored.
    ///
    /// The error contains the number and text of an invalid line.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let mut mesh = Self { positions: Vec::new(), texcoords: Vec::new(), normals: Vec::new(), faces: Vec::new() };
        for (number, line) in text.lines().enumerate() {
            let mut words = line.split_ascii_whitespace();
            let keyword = words.next().unwrap_or_default();
            if !matches!(keyword, "v" | "vt" | "vn" | "f") {
                continue;
            }
            let fail = |expected: &str| format!("line {}: expected {expected}, found {line:?}", number + 1);
            if keyword == "f" {
                let corners: Option<Vec<ObjCorner>> = words.map(|word| mesh.corner(word)).collect();
                let corners = corners.ok_or_else(|| fail("corners a/b/c within the file's lists"))?;
                mesh.faces.push(corners.try_into().map_err(|_| fail("a triangle"))?);
                continue;
            }
            let values: Option<Vec<f64>> =
                words.map(|word| word.parse().ok().filter(|v: &f64| v.is_finite())).collect();
            match (keyword, values.as_deref()) {
                ("v", Some(&[x, y, z, ..])) => mesh.positions.push(Point3::new(x, y, z)),
                ("vt", Some(&[u, v, ..])) => mesh.texcoords.push(Point2::new(u, v)),
                ("vn", Some(&[x, y, z, ..])) => mesh.normals.push(Vector3::new(x, y, z)),
                _ => return Err(fail("finite numbers")),
            }
        }
        if mesh.faces.is_empty() {
            return Err("expected triangles, found none".to_owned());
        }
        Ok(mesh)
    }

    /// One corner of a face line; `None` if an index is outside the lists.
    fn corner(&self, word: &str) -> Option<ObjCorner> {
        let index = |text: &str, count: usize| -> Option<u32> {
            let number: usize = text.parse().ok()?;
            (1..=count).contains(&number).then(|| (number - 1) as u32)
        };
        let mut parts = word.split('/');
        let position = index(parts.next()?, self.positions.len())?;
        let mut optional = |count: usize| match parts.next() {
            None | Some("") => Some(None),
            Some(text) => index(text, count).map(Some),
        };
        Some(ObjCorner { position, texcoord: optional(self.texcoords.len())?, normal: optional(self.normals.len())? })
    }

    /// Writes the mesh as OBJ text.
    pub(crate) fn to_obj(&self) -> String {
        let mut text = String::new();
        // Rounds to micrometres, so that scaled coordinates have no meaningless digits.
        let rounded = |value: f64| (value * 1e6).round() / 1e6 + 0.0;
        for p in &self.positions {
            let _ = writeln!(text, "v {} {} {}", rounded(p.x), rounded(p.y), rounded(p.z));
        }
        for t in &self.texcoords {
            let _ = writeln!(text, "vt {} {}", t.x, t.y);
        }
        for n in &self.normals {
            let _ = writeln!(text, "vn {} {} {}", n.x, n.y, n.z);
        }
        for face in &self.faces {
            text.push('f');
            for corner in face {
                let _ = write!(text, " {}", corner.position + 1);
                match (corner.texcoord, corner.normal) {
                    (Some(texcoord), Some(normal)) => {
                        let _ = write!(text, "/{}/{}", texcoord + 1, normal + 1);
                    }
                    (Some(texcoord), None) => {
                        let _ = write!(text, "/{}", texcoord + 1);
                    }
                    (None, Some(normal)) => {
                        let _ = write!(text, "//{}", normal + 1);
                    }
                    (None, None) => {}
                }
            }
            text.push('\n');
        }
        text
    }

    /// The mirror image in the plane y = 0; faces stay counter-clockwise seen from outside.
    pub(crate) fn mirrored(mut self) -> Self {
        for p in &mut self.positions {
            p.y = -p.y;
        }
        for n in &mut self.normals {
            n.y = -n.y;
        }
        for face in &mut self.faces {
            face.swap(1, 2);
        }
        self
    }

    /// Moves every point. Normals are kept, so that the shading is correct only if `map` hardly rotates the surface.
    pub(crate) fn mapped(mut self, map: impl Fn(usize, Point3<f64>) -> Point3<f64>) -> Self {
        for (idx, position) in self.positions.iter_mut().enumerate() {
            *position = map(idx, *position);
        }
        self
    }

    /// The positions of a face.
    pub(crate) fn corners(&self, face: &[ObjCorner; 3]) -> [Point3<f64>; 3] {
        face.map(|corner| self.positions[corner.position as usize])
    }

    /// The index (from zero) of the connected piece of each position, and the number of pieces.
    ///
    /// Positions at the same point count as connected, so that a seam of the texture does not divide a piece.
    pub(crate) fn pieces(&self) -> (Vec<usize>, usize) {
        let mut parent: Vec<usize> = (0..self.positions.len()).collect();
        let mut first_at = std::collections::HashMap::new();
        for (idx, p) in self.positions.iter().enumerate() {
            let key = p.coords.map(|value| (value * 1e6).round() as i64);
            let first = *first_at.entry([key.x, key.y, key.z]).or_insert(idx);
            join(&mut parent, first, idx);
        }
        for face in &self.faces {
            let [a, b, c] = face.map(|corner| corner.position as usize);
            join(&mut parent, a, b);
            join(&mut parent, b, c);
        }
        let mut numbers = std::collections::HashMap::new();
        let piece_of = (0..self.positions.len())
            .map(|idx| {
                let root = root(&mut parent, idx);
                let next = numbers.len();
                *numbers.entry(root).or_insert(next)
            })
            .collect();
        (piece_of, numbers.len())
    }
}

fn root(parent: &mut [usize], mut idx: usize) -> usize {
    while parent[idx] != idx {
        parent[idx] = parent[parent[idx]];
        idx = parent[idx];
    }
    idx
}

fn join(parent: &mut [usize], a: usize, b: usize) {
    let (a, b) = (root(parent, a), root(parent, b));
    // The smaller index is the representative, so that the order of the faces does not matter.
    parent[a.max(b)] = a.min(b);
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO_TRIANGLES: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nv 6 5 5\nv 5 6 5\nvt 0 0\nvn 0 0 1\n\
                                 f 1/1/1 2/1/1 3/1/1\nf 4//1 5//1 6//1\n";

    #[test]
    fn text_is_read_and_written_again() {
        let mesh = ObjMesh::parse(TWO_TRIANGLES).unwrap();
        assert_eq!((mesh.positions.len(), mesh.faces.len()), (6, 2));
        assert_eq!(ObjMesh::parse(&mesh.to_obj()).unwrap(), mesh);
        assert_eq!(mesh.pieces(), (vec![0, 0, 0, 1, 1, 1], 2));
    }

    #[test]
    fn a_mirror_image_keeps_its_outside_out() {
        let mesh = ObjMesh::parse(TWO_TRIANGLES).unwrap().mirrored();
        let [a, b, c] = mesh.corners(&mesh.faces[0]);
        assert!((b - a).cross(&(c - a)).z > 0.0);
        assert_eq!(mesh.positions[2].y, -1.0);
    }

    #[test]
    fn bad_lines_are_named() {
        for (text, expected) in [("v 0 0 0\nf 1 1 2\n", "line 2"), ("v 0 a 0\n", "line 1"), ("v 0 0 0\n", "triangles")]
        {
            let message = ObjMesh::parse(text).unwrap_err();
            assert!(message.contains(expected), "{message}");
        }
    }
}

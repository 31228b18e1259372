//! Solids from which parts are built: extrusions with chamfered edges, solids of revolution, bent tubes, screw threads.
//!
//! The meshes are closed, in metres, and stand on z = 0 unless stated otherwise; in their texture coordinates, 1 is one
//! repeat of the texture.

use std::f64::consts::{PI, TAU};

use earcut::Earcut;
use nalgebra::{Isometry3, Point2, Point3, UnitQuaternion, Vector2, Vector3};

use super::mesh::{MeshVertex, TriangleMesh};

/// Default metres of surface per repeat of a texture.
pub const METRES_PER_REPEAT: f64 = 0.05;

/// Minimum length of a chord in metres: shorter ones would collapse to a point, because OBJ text has hundredths of a
/// millimetre.
const MIN_CHORD_M: f64 = 2e-5;

/// A circle of `count` points, counter-clockwise.
pub fn circle(centre: Point2<f64>, radius: f64, count: usize) -> Vec<Point2<f64>> {
    (0..count)
        .map(|step| {
            let angle = TAU * step as f64 / count as f64;
            centre + Vector2::new(angle.cos(), angle.sin()) * radius
        })
        .collect()
}

/// A regular hexagon with a given width across flats; two flats are parallel to x.
pub fn hexagon(across_flats: f64) -> Vec<Point2<f64>> {
    circle(Point2::origin(), across_flats / 3f64.sqrt(), 6)
}

/// A rectangle about the origin with rounded corners.
pub fn rounded_rectangle(length: f64, width: f64, radius: f64) -> Vec<Point2<f64>> {
    let (x, y) = (length / 2.0 - radius, width / 2.0 - radius);
    let mut points = Vec::new();
    for (quarter, (cx, cy)) in [(x, y), (-x, y), (-x, -y), (x, -y)].into_iter().enumerate() {
        for step in 0..=6 {
            let angle = PI / 2.0 * (quarter as f64 + f64::from(step) / 6.0);
            points.push(Point2::new(cx + radius * angle.cos(), cy + radius * angle.sin()));
        }
    }
    points
}

/// The outline of a lever: two discs, joined by a bar of constant width with filleted corners.
///
/// `left` and `right` are (x of the centre, radius) on the x axis; `fillet` rounds the four inner corners.
pub fn lever_outline(left: (f64, f64), right: (f64, f64), bar_width: f64, fillet: f64) -> Vec<Point2<f64>> {
    let half = bar_width / 2.0;
    // A fillet circle touches the disc, and the bar's edge from outside (centre at y = half + fillet).
    let reach = |radius: f64| {
        let touching = radius + fillet;
        let height = half + fillet;
        assert!(touching > height, "the bar must be narrower than the disc");
        (touching * touching - height * height).sqrt()
    };
    let height = half + fillet;
    let mut upper = Vec::new();
    let (right_x, left_x) = (right.0 - reach(right.1), left.0 + reach(left.1));
    let right_tangent = height.atan2(right_x - right.0);
    for step in 0..=24 {
        let angle = right_tangent * f64::from(step) / 24.0;
        upper.push(Point2::new(right.0 + right.1 * angle.cos(), right.1 * angle.sin()));
    }
    for step in 1..=6 {
        let start = right_tangent - PI;
        let angle = start + (-PI / 2.0 - start) * f64::from(step) / 6.0;
        upper.push(Point2::new(right_x + fillet * angle.cos(), height + fillet * angle.sin()));
    }
    let left_tangent = height.atan2(left_x - left.0);
    for step in 0..6 {
        let end = left_tangent - PI;
        let angle = -PI / 2.0 + (end + PI / 2.0) * f64::from(step) / 6.0;
        upper.push(Point2::new(left_x + fillet * angle.cos(), height + fillet * angle.sin()));
    }
    for step in 0..=18 {
        let angle = left_tangent + (PI - left_tangent) * f64::from(step) / 18.0;
        upper.push(Point2::new(left.0 + left.1 * angle.cos(), left.1 * angle.sin()));
    }
    let lower: Vec<Point2<f64>> =
        upper[1..upper.len() - 1].iter().rev().map(|point| Point2::new(point.x, -point.y)).collect();
    upper.into_iter().chain(lower).collect()
}

/// Moves an outline by `distance` to its inside (its left), with mitred corners.
fn inset(outline: &[Point2<f64>], distance: f64) -> Vec<Point2<f64>> {
    let count = outline.len();
    (0..count)
        .map(|idx| {
            let before = (outline[idx] - outline[(idx + count - 1) % count]).normalize();
            let after = (outline[(idx + 1) % count] - outline[idx]).normalize();
            let left = |edge: Vector2<f64>| Vector2::new(-edge.y, edge.x);
            let middle = (left(before) + left(after)).normalize();
            outline[idx] + middle * (distance / middle.dot(&left(before)).max(0.3))
        })
        .collect()
}

/// Extrudes an outline with holes, all counter-clockwise, from z = 0 to `height`.
///
/// The upper edges of outline and holes have a chamfer of `chamfer` metres; 0 for none.
pub fn extrude(outline: &[Point2<f64>], holes: &[Vec<Point2<f64>>], height: f64, chamfer: f64) -> TriangleMesh {
    let mut rings = vec![outline.to_vec()];
    // A clockwise hole has the material on its left, like the outline.
    rings.extend(holes.iter().map(|hole| hole.iter().rev().copied().collect::<Vec<_>>()));
    let top_rings: Vec<Vec<Point2<f64>>> =
        rings.iter().map(|ring| if chamfer > 0.0 { inset(ring, chamfer) } else { ring.clone() }).collect();
    let mut mesh = TriangleMesh::default();
    let texcoord = |p: Point2<f64>| Point2::from(p.coords / METRES_PER_REPEAT);
    for (ring, top) in rings.iter().zip(&top_rings) {
        let rows = if chamfer > 0.0 { 3 } else { 2 };
        mesh.push_grid(rows, ring.len() + 1, |row, col| {
            let idx = col % ring.len();
            let (point, z) = match row {
                0 => (ring[idx], 0.0),
                1 => (ring[idx], height - chamfer),
                _ => (top[idx], height),
            };
            MeshVertex { position: Point3::new(point.x, point.y, z), texcoord: texcoord(point) }
        });
    }
    for (cap_rings, z, upward) in [(&top_rings, height, true), (&rings, 0.0, false)] {
        let base = mesh.vertices.len() as u32;
        let points: Vec<[f64; 2]> = cap_rings.iter().flatten().map(|point| [point.x, point.y]).collect();
        let mut hole_starts = Vec::new();
        let mut start = 0u32;
        for ring in cap_rings {
            if start > 0 {
                hole_starts.push(start);
            }
            start += ring.len() as u32;
        }
        let mut triangles: Vec<u32> = Vec::new();
        Earcut::new().earcut(points.iter().copied(), &hole_starts, &mut triangles);
        for point in &points {
            let point = Point2::new(point[0], point[1]);
            mesh.push(Point3::new(point.x, point.y, z), texcoord(point));
        }
        for triangle in triangles.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|corner| points[triangle[corner] as usize]);
            let counter_clockwise = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0;
            let face = [base + triangle[0], base + triangle[1], base + triangle[2]];
            mesh.faces.push(if counter_clockwise == upward { face } else { [face[0], face[2], face[1]] });
        }
    }
    mesh
}

/// A cuboid about the z axis on z = 0, with chamfered upper edges.
pub fn box_solid(length: f64, width: f64, height: f64, chamfer: f64) -> TriangleMesh {
    let (x, y) = (length / 2.0, width / 2.0);
    let outline = [Point2::new(-x, -y), Point2::new(x, -y), Point2::new(x, y), Point2::new(-x, y)];
    extrude(&outline, &[], height, chamfer)
}

/// The solid of revolution of a profile (radius, z) about the z axis.
///
/// The profile runs counter-clockwise around the material in the (radius, z) half plane. If it does not start and end
/// on the axis, its last point is joined to its first one (a ring).
pub fn lathe(profile: &[(f64, f64)], segments: usize) -> TriangleMesh {
    let mut profile = profile.to_vec();
    let on_axis = profile.first().is_some_and(|p| p.0 == 0.0) && profile.last().is_some_and(|p| p.0 == 0.0);
    if !on_axis {
        profile.push(profile[0]);
    }
    let mut mesh = TriangleMesh::default();
    mesh.push_grid(profile.len(), segments + 1, |row, col| {
        let (radius, z) = profile[row];
        let angle = TAU * (col % segments) as f64 / segments as f64;
        let position = Point3::new(radius * angle.cos(), radius * angle.sin(), z);
        MeshVertex { position, texcoord: Point2::from(position.coords.xy() / METRES_PER_REPEAT) }
    });
    mesh
}

/// A ring that stands on z = 0, with chamfered edges.
pub fn ring(inner_radius: f64, outer_radius: f64, height: f64, chamfer: f64, segments: usize) -> TriangleMesh {
    let c = chamfer;
    let profile = [
        (inner_radius + c, 0.0),
        (outer_radius - c, 0.0),
        (outer_radius, c),
        (outer_radius, height - c),
        (outer_radius - c, height),
        (inner_radius + c, height),
        (inner_radius, height - c),
        (inner_radius, c),
    ];
    lathe(&profile, segments)
}

/// A cylinder that stands on z = 0, with chamfered edges.
pub fn cylinder(radius: f64, height: f64, chamfer: f64, segments: usize) -> TriangleMesh {
    let c = chamfer;
    lathe(
        &[(0.0, 0.0), (radius - c, 0.0), (radius, c), (radius, height - c), (radius - c, height), (0.0, height)],
        segments,
    )
}

/// A hexagonal prism about the z axis whose corners are chamfered at 30° at both ends, as on nuts and bolt heads.
pub fn hex_prism(across_flats: f64, height: f64, bore_radius: f64) -> TriangleMesh {
    let segments = 48;
    let apothem = across_flats / 2.0;
    // Radius of the hexagon at a polar angle, and the shortening of its ends by a 30° cone that starts at the flats.
    let rim = |angle: f64| apothem / ((angle + PI / 6.0).rem_euclid(PI / 3.0) - PI / 6.0).cos();
    let taken = |radius: f64| (radius - apothem * 0.98).max(0.0) * (PI / 6.0).tan();
    let mut mesh = TriangleMesh::default();
    let hollow = bore_radius > 0.0;
    let rows = if hollow { 7 } else { 6 };
    mesh.push_grid(rows, segments + 1, |row, col| {
        // The angle is offset by 90°, so that flats are at y = ±apothem.
        let angle = TAU * (col % segments) as f64 / segments as f64;
        let outer = rim(angle + PI / 2.0);
        let (radius, z) = match row {
            0 | 6 => (bore_radius, 0.0),
            1 => (apothem * 0.98, 0.0),
            2 => (outer, taken(outer)),
            3 => (outer, height - taken(outer)),
            4 => (apothem * 0.98, height),
            _ => (bore_radius, height),
        };
        let position = Point3::new(radius * angle.cos(), radius * angle.sin(), z);
        MeshVertex { position, texcoord: Point2::from(position.coords.xy() / METRES_PER_REPEAT) }
    });
    mesh
}

/// A screw thread about the z axis from z = 0 to `length`: a 60° ridge that rises by `pitch` per revolution.
pub fn thread(major_radius: f64, pitch: f64, length: f64, segments: usize) -> TriangleMesh {
    let depth = 0.54 * pitch;
    let rows = (length / pitch * 4.0).ceil() as usize + 1;
    let mut mesh = TriangleMesh::default();
    let radius_at = |angle: f64, z: f64| {
        let phase = (z / pitch - angle / TAU).rem_euclid(1.0);
        // The ends are chamfered, so that the ridge fades into the core.
        let fade = ((length - z).min(z) / pitch).clamp(0.0, 1.0);
        let ridge = (1.0 - (2.0 * phase - 1.0).abs() * 1.25).clamp(0.0, 1.0);
        major_radius - depth + depth * ridge * fade
    };
    mesh.push_grid(rows + 2, segments + 1, |row, col| {
        let angle = TAU * (col % segments) as f64 / segments as f64;
        let z = length * (row.clamp(1, rows) - 1) as f64 / (rows - 1) as f64;
        let radius = if row == 0 || row == rows + 1 { 0.0 } else { radius_at(angle, z) };
        let position = Point3::new(radius * angle.cos(), radius * angle.sin(), z);
        MeshVertex { position, texcoord: Point2::new(col as f64 / segments as f64, z / METRES_PER_REPEAT) }
    });
    mesh
}

/// Rounds the corners of a polyline by arcs of `radius` metres with `steps` chords each. Nearly straight corners are
/// not changed.
pub fn rounded_path(corners: &[Point3<f64>], radius: f64, steps: usize) -> Vec<Point3<f64>> {
    let mut path = vec![corners[0]];
    for window in corners.windows(3) {
        let (into, out) = ((window[1] - window[0]).normalize(), (window[2] - window[1]).normalize());
        let turn = into.angle(&out);
        let Some(axis) = into.cross(&out).try_normalize(1e-9) else {
            continue;
        };
        if radius * turn < steps as f64 * MIN_CHORD_M {
            path.push(window[1]);
            continue;
        }
        let start = window[1] - into * radius * (turn / 2.0).tan();
        let centre = start + axis.cross(&into) * radius;
        for step in 0..=steps {
            let part = UnitQuaternion::from_scaled_axis(axis * (turn * step as f64 / steps as f64));
            path.push(centre + part * (start - centre));
        }
    }
    path.push(corners[corners.len() - 1]);
    path
}

/// A round bar of `radius` metres along a path, with flat ends. If the path lies in a plane and ends at its start, the
/// bar is closed. Texture coordinate u runs around the bar (0 and 1 below, 0.5 on top).
pub fn sweep(path: &[Point3<f64>], radius: f64, segments: usize) -> TriangleMesh {
    let count = path.len();
    let closed = path[0] == path[count - 1];
    let tangents: Vec<Vector3<f64>> = (0..count)
        .map(|idx| match idx {
            _ if closed && (idx == 0 || idx == count - 1) => path[1] - path[count - 2],
            0 => path[1] - path[0],
            _ => path[(idx + 1).min(count - 1)] - path[idx - 1],
        })
        .map(|tangent| tangent.normalize())
        .collect();
    // The direction `up` is transported along the path with the smallest rotation, so that the bar does not twist.
    let mut up = vec![perpendicular(&tangents[0])];
    for pair in tangents.windows(2) {
        let turn = UnitQuaternion::rotation_between(&pair[0], &pair[1]).unwrap_or_else(UnitQuaternion::identity);
        up.push(turn * up[up.len() - 1]);
    }
    let mut along = vec![0.0];
    for pair in path.windows(2) {
        along.push(along[along.len() - 1] + (pair[1] - pair[0]).norm());
    }
    let mut mesh = TriangleMesh::default();
    let caps = if closed { 0 } else { 1 };
    mesh.push_grid(count + 2 * caps, segments + 1, |row, col| {
        let idx = (row + 1 - caps).clamp(1, count) - 1;
        let around = (col % segments) as f64 / segments as f64;
        let angle = PI + TAU * around;
        let side = tangents[idx].cross(&up[idx]);
        let capping = caps == 1 && (row == 0 || row == count + 1);
        let offset = if capping { 0.0 } else { radius };
        // With `side = tangent × up`, an increasing angle rotates about the tangent, so that faces point outwards.
        let position = path[idx] + (up[idx] * angle.cos() + side * angle.sin()) * offset;
        MeshVertex { position, texcoord: Point2::new(col as f64 / segments as f64, along[idx] / METRES_PER_REPEAT) }
    });
    mesh
}

/// The direction perpendicular to `tangent` that is closest to z, or closest to x if `tangent` is nearly vertical.
fn perpendicular(tangent: &Vector3<f64>) -> Vector3<f64> {
    let up = if tangent.z.abs() > 0.9 { Vector3::x() } else { Vector3::z() };
    (up - tangent * tangent.dot(&up)).normalize()
}

/// The transform that lays a solid along x: z becomes +x, +y stays +y, and the axis is at `height`.
pub fn lying_along_x(height: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        nalgebra::Translation3::new(0.0, 0.0, height),
        UnitQuaternion::from_axis_angle(&Vector3::y_axis(), PI / 2.0),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Largest relative error of volumes: round solids are polygons of many sides.
    const FACET_TOLERANCE: f64 = 0.02;

    fn volume_is(mesh: &TriangleMesh, expected: f64) {
        assert_relative_eq!(mesh.mass_properties().volume, expected, max_relative = FACET_TOLERANCE);
    }

    #[test]
    fn volumes_match_their_formulas() {
        volume_is(&cylinder(0.01, 0.05, 0.0005, 48), PI * 1e-4 * 0.05);
        volume_is(&ring(0.01, 0.02, 0.01, 0.0002, 64), PI * (4e-4 - 1e-4) * 0.01);
        volume_is(&hex_prism(0.02, 0.012, 0.0), 3f64.sqrt() / 2.0 * 4e-4 * 0.012);
        let plate = extrude(
            &rounded_rectangle(0.08, 0.04, 0.004),
            &[circle(Point2::new(0.02, 0.0), 0.005, 48), circle(Point2::new(-0.02, 0.005), 0.005, 48)],
            0.006,
            0.0,
        );
        volume_is(&plate, (0.08 * 0.04 - (4.0 - PI) * 1.6e-5 - 2.0 * PI * 2.5e-5) * 0.006);
    }

    #[test]
    fn bent_tube_has_the_volume_of_its_centre_line() {
        let corners = [Point3::new(0.0, 0.0, 0.01), Point3::new(0.1, 0.0, 0.01), Point3::new(0.1, 0.1, 0.01)];
        let (radius, bend) = (0.004, 0.02);
        let tube = sweep(&rounded_path(&corners, bend, 12), radius, 32);
        // Pappus: the volume is the area times the length of the centre's path.
        let length = 2.0 * (0.1 - bend) + bend * PI / 2.0;
        volume_is(&tube, PI * radius * radius * length);
        let (low, high) = tube.bounds();
        assert_relative_eq!(high.x, 0.1 + radius, epsilon = 2e-4);
        assert_relative_eq!(low.z, 0.01 - radius, epsilon = 1e-9);
    }

    #[test]
    fn thread_lies_between_core_and_crest() {
        let mesh = thread(0.009, 0.0025, 0.04, 24);
        let crest = mesh.vertices.iter().map(|v| v.position.coords.xy().norm()).fold(0.0, f64::max);
        assert!(crest <= 0.009 + 1e-12 && crest > 0.0085, "crest {crest}");
        let core = 0.009 - 0.54 * 0.0025;
        let volume = mesh.mass_properties().volume;
        assert!(volume > PI * core * core * 0.04 * 0.97 && volume < PI * 0.009 * 0.009 * 0.04);
    }

    #[test]
    fn lever_outline_is_as_wide_as_its_bar_in_the_middle() {
        let outline = lever_outline((-0.06, 0.015), (0.06, 0.027), 0.016, 0.006);
        let area: f64 = (0..outline.len())
            .map(|idx| {
                let (a, b) = (outline[idx], outline[(idx + 1) % outline.len()]);
                (a.x * b.y - b.x * a.y) / 2.0
            })
            .sum();
        assert!(area > 0.0, "counter-clockwise");
        let widest = outline.iter().map(|p| p.y).fold(0.0, f64::max);
        assert_relative_eq!(widest, 0.027, epsilon = 1e-4);
        let least = outline.iter().filter(|p| p.x.abs() < 0.03).map(|p| p.y.abs()).fold(1.0, f64::min);
        assert!(least >= 0.008 - 1e-9);
    }
}

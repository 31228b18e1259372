//! Injection line of a Diesel engine: a bent steel tube with two different unions and a clip.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use sdg_simulation::objects::RotationalSymmetry;
use sdg_simulation::shapes::mesh::TriangleMesh;
use sdg_simulation::shapes::solids::{
    box_solid, cylinder, hex_prism, lathe, lying_along_x, ring, rounded_path, sweep, thread,
};
use sdg_simulation::shapes::texture::Texture;

use crate::part::{Finish, Part, Piece, RUBBER, STEEL, moved};

/// The part.
pub fn fuel_line() -> Part {
    let height = 0.0095;
    let point = |x: f64, y: f64| Point3::new(x, y, height);
    let corners =
        [point(-0.088, 0.046), point(-0.050, 0.0), point(0.042, 0.0), point(0.064, -0.040), point(0.098, -0.040)];
    let tube_radius = 0.004;
    let path = rounded_path(&corners, 0.014, 8);
    let tube = sweep(&path, tube_radius, 20);

    // Rotates the +x of a lying solid to the direction of a straight piece of the tube, `along` metres from its start.
    let on_tube = |from: usize, along: f64| {
        let direction = (corners[from + 1] - corners[from]).normalize();
        let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), direction.y.atan2(direction.x));
        Isometry3::from_parts(Translation3::from(corners[from] + direction * along), yaw)
    };
    let last = corners.len() - 2;
    let last_length = (corners[last + 1] - corners[last]).norm();
    // The rotation by 90° makes two of the flats horizontal.
    let lying = lying_along_x(0.0) * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), PI / 2.0);
    let lay = |mesh: TriangleMesh, along: f64| mesh.transformed(&(Isometry3::translation(along, 0.0, 0.0) * lying));

    // Male union at the start: cone, thread, hexagon. Female union nut at the end: hexagon and a round collar.
    let mut nuts = lay(hex_prism(0.019, 0.012, 0.0), 0.004).transformed(&on_tube(0, 0.0));
    nuts.append(&lay(cylinder(0.0078, 0.004, 0.0008, 32), 0.016).transformed(&on_tube(0, 0.0)));
    nuts.append(&lay(hex_prism(0.019, 0.017, 0.0), -0.009).transformed(&on_tube(last, last_length)));
    nuts.append(&lay(cylinder(0.0082, 0.006, 0.0010, 32), -0.015).transformed(&on_tube(last, last_length)));
    let mut ends = lay(thread(0.0068, 0.0022, 0.010, 20), -0.0055).transformed(&on_tube(0, 0.0));
    let cone = lathe(&[(0.0, 0.0), (0.0032, 0.0), (0.0050, 0.004), (0.0, 0.004)], 24);
    ends.append(&lay(cone, -0.0092).transformed(&on_tube(0, 0.0)));
    ends.append(&lay(ring(0.0035, 0.0066, 0.0015, 0.0004, 28), 0.0075).transformed(&on_tube(last, last_length)));

    let clip_place = on_tube(2, 0.0225);
    let mut clip = box_solid(0.013, 0.017, 0.0150, 0.0015).textured_from_above(0.03);
    clip.append(&moved(box_solid(0.009, 0.006, 0.0035, 0.0006), 0.0, 0.0065, 0.0148));
    let flat = Isometry3::translation(0.0, 0.0, -height);
    let clip = clip.transformed(&(clip_place * flat));

    let capsule = |a: Point3<f64>, b: Point3<f64>| {
        format!(
            "type=\"capsule\" size=\"{tube_radius}\" fromto=\"{:.5} {:.5} {:.5} {:.5} {:.5} {:.5}\"",
            a.x, a.y, a.z, b.x, b.y, b.z
        )
    };
    // Straight pieces stay whole; each bend becomes two chords.
    let mut knots: Vec<Point3<f64>> = vec![path[0]];
    knots.extend(path[1..path.len() - 1].chunks(9).flat_map(|bend| [bend[0], bend[4], bend[8]]));
    knots.push(path[path.len() - 1]);
    let mut collisions: Vec<String> = knots.windows(2).map(|pair| capsule(pair[0], pair[1])).collect();
    let boxed = |place: Isometry3<f64>, half: [f64; 3]| {
        let (p, q) = (place.translation.vector, place.rotation);
        format!(
            "type=\"box\" pos=\"{:.5} {:.5} {:.5}\" quat=\"{:.6} {:.6} {:.6} {:.6}\" size=\"{} {} {}\"",
            p.x, p.y, p.z, q.w, q.i, q.j, q.k, half[0], half[1], half[2]
        )
    };
    collisions.push(boxed(on_tube(0, 0.0095), [0.0105, 0.0075, 0.0095]));
    collisions.push(boxed(on_tube(last, last_length - 0.0035), [0.0115, 0.0075, 0.0095]));
    collisions.push(boxed(clip_place * Isometry3::translation(0.0, 0.0, -0.002), [0.0065, 0.0085, 0.0075]));

    Part {
        name: "fuel_line",
        title: "Fuel line",
        description: "Injection line of a Diesel engine: bent steel tube of 8 mm, 196 mm from end to end, with a male \
                      and a female union nut and a plastic clip",
        pieces: vec![
            Piece { name: "tube", mesh: tube, density: STEEL * 0.86, material: "tube" },
            Piece { name: "nuts", mesh: nuts.textured_from_above(0.04), density: STEEL * 0.75, material: "zinc" },
            Piece { name: "ends", mesh: ends.textured_from_above(0.03), density: STEEL * 0.75, material: "steel" },
            Piece { name: "clip", mesh: clip, density: RUBBER, material: "plastic" },
        ],
        finishes: vec![
            Finish {
                name: "tube",
                texture: Texture::round_bar(64, [0.58, 0.60, 0.63], 0.8, 21),
                specular: 0.4,
                shininess: 0.5,
            },
            Finish {
                name: "zinc",
                texture: Texture::brushed(128, [0.74, 0.66, 0.42], 0.10, 22),
                specular: 0.5,
                shininess: 0.4,
            },
            Finish {
                name: "steel",
                texture: Texture::brushed(64, [0.55, 0.55, 0.56], 0.12, 23),
                specular: 0.5,
                shininess: 0.4,
            },
            Finish {
                name: "plastic",
                texture: Texture::grained(64, [0.13, 0.13, 0.14], 0.08, 24),
                specular: 0.2,
                shininess: 0.3,
            },
        ],
        collisions,
        grasp_half_line: 0.026,
        jaw_width: 2.0 * tube_radius,
        grasp_height: 0.0085,
        mark_height: height,
        seen_height: height + tube_radius,
        friction: 0.6,
        symmetry: RotationalSymmetry::None,
    }
}

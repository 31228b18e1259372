//! Common rail of a Diesel engine: forged tube with four injector ports, inlet, lugs, pressure sensor and relief valve.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Point2, Point3, Vector2};
use sdg_simulation::objects::RotationalSymmetry;
use sdg_simulation::shapes::mesh::TriangleMesh;
use sdg_simulation::shapes::solids::{circle, cylinder, extrude, hex_prism, ring, rounded_rectangle, sweep, thread};
use sdg_simulation::shapes::texture::Texture;

use crate::part::{
    Finish, PLASTIC, Part, Piece, STEEL, box_between, cylinder_between, drawn_along_x, laid, laid_level, moved,
};

/// Radius of the tube, the height of its axis, and half its length.
const RADIUS: f64 = 0.012;
const AXIS: f64 = 0.0125;
const HALF_LENGTH: f64 = 0.068;
/// x of the ports for the injectors' lines, at +y.
const PORTS: [f64; 4] = [-0.059, -0.022, 0.022, 0.059];
/// x of the inlet for the pump's line, at -y.
const INLET: f64 = -0.0585;
const BOSS_RADIUS: f64 = 0.0082;
/// x of the lugs, at -y.
const LUGS: [f64; 2] = [-0.0365, 0.0405];
/// y of the lugs' bolts.
const BOLT_Y: f64 = -0.026;
const LUG_HEIGHT: f64 = 0.015;

/// The part.
pub fn common_line() -> Part {
    let point = |x: f64, y: f64| Point3::new(x, y, AXIS);
    let mut forged = sweep(&[point(-HALF_LENGTH, 0.0), point(HALF_LENGTH, 0.0)], RADIUS, 36);
    let mut screws = TriangleMesh::default();
    let mut mouths = TriangleMesh::default();
    let ports = PORTS.map(|x| (x, 1.0)).into_iter().chain([(INLET, -1.0)]);
    for (x, side) in ports {
        let yaw = side * FRAC_PI_2;
        forged.append(&sweep(&[point(x, side * 0.005), point(x, side * 0.0195)], BOSS_RADIUS, 28));
        screws.append(&laid(thread(0.0069, 0.0020, 0.0135, 18), point(x, side * 0.0190), yaw));
        mouths.append(&laid(cylinder(0.0040, 0.0012, 0.0004, 20), point(x, side * 0.0320), yaw));
    }

    let lug: Vec<Point2<f64>> = (0..=12)
        .map(|step| {
            let angle = PI * (1.0 + f64::from(step) / 12.0);
            Point2::new(0.0085 * angle.cos(), BOLT_Y + 0.0085 * angle.sin())
        })
        .chain([Point2::new(0.0085, 0.010), Point2::new(-0.0085, 0.010)])
        .collect();
    let bolt = circle(Point2::new(0.0, BOLT_Y), 0.0042, 28);
    let mut lugs = TriangleMesh::default();
    let mut faces = TriangleMesh::default();
    for x in LUGS {
        let outline: Vec<_> = lug.iter().map(|p| p + Vector2::new(x, 0.0)).collect();
        let hole: Vec<_> = bolt.iter().map(|p| p + Vector2::new(x, 0.0)).collect();
        lugs.append(&extrude(&outline, &[hole], LUG_HEIGHT, 0.0012));
        faces.append(&moved(ring(0.0042, 0.0076, 0.0012, 0.0003, 32), x, BOLT_Y, LUG_HEIGHT - 0.0004));
    }

    // Pressure sensor: hexagon, steel neck, plastic plug. Relief valve: hexagon, body, cap.
    let mut plated = laid_level(hex_prism(0.0235, 0.0085, 0.0), point(HALF_LENGTH - 0.0005, 0.0), 0.0);
    plated.append(&laid_level(hex_prism(0.0215, 0.0085, 0.0), point(-HALF_LENGTH + 0.0005, 0.0), PI));
    let mut necks = sweep(&[point(HALF_LENGTH + 0.0075, 0.0), point(HALF_LENGTH + 0.0125, 0.0)], 0.0095, 28);
    necks.append(&sweep(&[point(-HALF_LENGTH - 0.0075, 0.0), point(-HALF_LENGTH - 0.0205, 0.0)], 0.0085, 28));
    necks.append(&sweep(&[point(-HALF_LENGTH - 0.0200, 0.0), point(-HALF_LENGTH - 0.0270, 0.0)], 0.0048, 20));
    let plug_profile: Vec<_> =
        rounded_rectangle(0.0170, 0.0130, 0.003).iter().map(|p| p + Vector2::new(0.0, AXIS)).collect();
    let mut plug = drawn_along_x(&plug_profile, HALF_LENGTH + 0.0115, 0.0155, 0.0008);
    let latch = rounded_rectangle(0.010, 0.006, 0.0015);
    plug.append(&moved(extrude(&latch, &[], 0.0025, 0.0006), HALF_LENGTH + 0.0190, 0.0, AXIS + 0.0060));

    let mut collisions = vec![cylinder_between([-HALF_LENGTH, 0.0, AXIS], [HALF_LENGTH, 0.0, AXIS], RADIUS)];
    collisions.extend(LUGS.map(|x| box_between([x - 0.0085, BOLT_Y - 0.0085, 0.0], [x + 0.0085, 0.010, LUG_HEIGHT])));
    collisions.extend(PORTS.map(|x| cylinder_between([x, 0.005, AXIS], [x, 0.0325, AXIS], BOSS_RADIUS)));
    collisions.push(cylinder_between([INLET, -0.005, AXIS], [INLET, -0.0325, AXIS], BOSS_RADIUS));
    collisions.push(cylinder_between([HALF_LENGTH, 0.0, AXIS], [HALF_LENGTH + 0.0270, 0.0, AXIS], 0.0095));
    collisions.push(cylinder_between([-HALF_LENGTH, 0.0, AXIS], [-HALF_LENGTH - 0.0205, 0.0, AXIS], 0.0095));

    Part {
        name: "common_line",
        title: "Common line",
        description: "Common rail of a small Diesel engine: forged tube of 24 mm with four injector ports, inlet and two \
                      lugs, pressure sensor at one end and relief valve at the other; 190 mm long",
        pieces: vec![
            // The density allows for the bore of 10 mm.
            Piece { name: "tube", mesh: forged, density: STEEL * 0.8, material: "forged" },
            // The lugs' volume within the tube is counted with the tube.
            Piece { name: "lugs", mesh: lugs.textured_from_above(0.05), density: STEEL * 0.6, material: "rough" },
            Piece { name: "faces", mesh: faces.textured_from_above(0.03), density: STEEL, material: "machined" },
            Piece { name: "screws", mesh: screws, density: STEEL * 0.8, material: "rolled" },
            Piece { name: "mouths", mesh: mouths, density: STEEL, material: "dark" },
            Piece { name: "plated", mesh: plated.textured_from_above(0.04), density: STEEL * 0.7, material: "zinc" },
            Piece { name: "necks", mesh: necks, density: STEEL * 0.7, material: "neck" },
            Piece { name: "plug", mesh: plug.textured_from_above(0.03), density: PLASTIC, material: "dark" },
        ],
        finishes: vec![
            Finish {
                name: "forged",
                texture: Texture::round_bar(64, [0.36, 0.36, 0.38], 0.6, 71),
                specular: 0.35,
                shininess: 0.35,
            },
            Finish {
                name: "rough",
                texture: Texture::cast(96, [0.36, 0.36, 0.38], 0.08, 72),
                specular: 0.3,
                shininess: 0.3,
            },
            Finish {
                name: "machined",
                texture: Texture::brushed(64, [0.72, 0.72, 0.73], 0.08, 73),
                specular: 0.6,
                shininess: 0.5,
            },
            Finish {
                name: "rolled",
                texture: Texture::round_bar(64, [0.60, 0.60, 0.61], 0.5, 74),
                specular: 0.5,
                shininess: 0.5,
            },
            Finish {
                name: "zinc",
                texture: Texture::brushed(64, [0.66, 0.62, 0.48], 0.10, 75),
                specular: 0.5,
                shininess: 0.4,
            },
            Finish {
                name: "neck",
                texture: Texture::round_bar(64, [0.66, 0.67, 0.69], 0.7, 76),
                specular: 0.6,
                shininess: 0.5,
            },
            Finish {
                name: "dark",
                texture: Texture::grained(32, [0.10, 0.10, 0.11], 0.08, 77),
                specular: 0.2,
                shininess: 0.3,
            },
        ],
        collisions,
        grasp_half_line: 0.026,
        jaw_width: 2.0 * RADIUS,
        grasp_height: 0.0115,
        mark_height: AXIS,
        seen_height: AXIS + RADIUS,
        friction: 0.5,
        symmetry: RotationalSymmetry::None,
    }
}

//! Pneumatic cylinder of the tie-rod kind: two square caps, tube, four tie rods, piston rod, push-in fittings.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Point2, Point3, Vector2};
use sdg_simulation::objects::RotationalSymmetry;
use sdg_simulation::shapes::mesh::TriangleMesh;
use sdg_simulation::shapes::solids::{cylinder, hex_prism, ring, rounded_rectangle, sweep, thread};
use sdg_simulation::shapes::texture::Texture;

use crate::part::{
    ALUMINIUM, Finish, PLASTIC, Part, Piece, STEEL, box_between, cylinder_between, drawn_along_x, laid, laid_level,
};

/// Half the side of the square caps, and the height of the axis.
const CAP: f64 = 0.016;
/// Start and end of the rear cap along the axis.
const REAR_CAP: [f64; 2] = [-0.066, -0.043];
/// Start and end of the front cap along the axis.
const FRONT_CAP: [f64; 2] = [0.025, 0.048];
const TUBE_RADIUS: f64 = 0.0135;
/// Distance of the tie rods from the axis in y and z.
const TIE: f64 = 0.0115;
const TIE_RADIUS: f64 = 0.0022;
const ROD_RADIUS: f64 = 0.005;
/// Start and end of the rod's thread along the axis.
const THREAD: [f64; 2] = [0.0755, 0.0935];
/// x of the fittings, in the centre of each cap.
const FITTINGS: [f64; 2] = [-0.0545, 0.0365];

/// The part.
pub fn pneumatic_cylinder() -> Part {
    let point = |x: f64, y: f64, z: f64| Point3::new(x, y, CAP + z);
    let on_axis = |x: f64| point(x, 0.0, 0.0);

    let profile: Vec<Point2<f64>> =
        rounded_rectangle(2.0 * CAP, 2.0 * CAP, 0.003).iter().map(|p| p + Vector2::new(0.0, CAP)).collect();
    let mut caps = drawn_along_x(&profile, REAR_CAP[0], REAR_CAP[1] - REAR_CAP[0], 0.0008);
    caps.append(&drawn_along_x(&profile, FRONT_CAP[0], FRONT_CAP[1] - FRONT_CAP[0], 0.0008));
    caps.append(&laid(cylinder(0.0105, 0.006, 0.0008, 36), on_axis(FRONT_CAP[1] - 0.0005), 0.0));
    let tube = sweep(&[on_axis(REAR_CAP[1] - 0.001), on_axis(FRONT_CAP[0] + 0.001)], TUBE_RADIUS, 36);

    let corners = [(TIE, TIE), (-TIE, TIE), (TIE, -TIE), (-TIE, -TIE)];
    let mut ties = TriangleMesh::default();
    let mut nuts = TriangleMesh::default();
    for (y, z) in corners {
        let (from, to) = (REAR_CAP[0] - 0.0035, FRONT_CAP[1] + 0.0035);
        ties.append(&sweep(&[point(from, y, z), point(to, y, z)], TIE_RADIUS, 16));
        nuts.append(&laid_level(hex_prism(0.007, 0.003, 0.0), point(from + 0.0008, y, z), 0.0));
        nuts.append(&laid_level(hex_prism(0.007, 0.003, 0.0), point(to - 0.0038, y, z), 0.0));
    }
    nuts.append(&laid_level(hex_prism(0.016, 0.005, 0.0), on_axis(THREAD[0] + 0.003), 0.0));

    let wiper = laid(ring(ROD_RADIUS - 0.0002, 0.0075, 0.002, 0.0004, 28), on_axis(FRONT_CAP[1] + 0.005), 0.0);
    let rod = sweep(&[on_axis(FRONT_CAP[1]), on_axis(THREAD[0] + 0.0005)], ROD_RADIUS, 28);
    let screw = laid(thread(ROD_RADIUS, 0.0015, THREAD[1] - THREAD[0], 18), on_axis(THREAD[0]), 0.0);

    // Push-in fittings to one side: nickel-plated hexagon, blue body, release ring with the dark mouth of the hose.
    let mut hexagons = TriangleMesh::default();
    let mut bodies = TriangleMesh::default();
    let mut mouths = TriangleMesh::default();
    for x in FITTINGS {
        let side = |y: f64| point(x, CAP + y, 0.0);
        hexagons.append(&laid_level(hex_prism(0.012, 0.0055, 0.0), side(-0.0005), FRAC_PI_2));
        bodies.append(&sweep(&[side(0.0049), side(0.0135)], 0.0057, 24));
        mouths.append(&laid(ring(0.0031, 0.0046, 0.0028, 0.0005, 24), side(0.0134), FRAC_PI_2));
    }

    let mut collisions = vec![
        box_between([REAR_CAP[0], -CAP, 0.0], [REAR_CAP[1], CAP, 2.0 * CAP]),
        box_between([FRONT_CAP[0], -CAP, 0.0], [FRONT_CAP[1], CAP, 2.0 * CAP]),
        // One box spans the four tie rods.
        box_between(
            [REAR_CAP[1], -TIE - TIE_RADIUS, CAP - TIE - TIE_RADIUS],
            [FRONT_CAP[0], TIE + TIE_RADIUS, CAP + TIE + TIE_RADIUS],
        ),
        cylinder_between([FRONT_CAP[1], 0.0, CAP], [THREAD[1], 0.0, CAP], ROD_RADIUS),
    ];
    collisions.extend(FITTINGS.map(|x| cylinder_between([x, CAP, CAP], [x, CAP + 0.016, CAP], 0.006)));

    Part {
        name: "pneumatic_cylinder",
        title: "Pneumatic cylinder",
        description: "Double-acting pneumatic cylinder of the tie-rod kind, bore 25 mm: aluminium caps of 32 mm, tube and \
                      four tie rods, chromed rod with M10 thread and nut, two push-in fittings",
        pieces: vec![
            Piece { name: "caps", mesh: caps.textured_from_above(0.05), density: ALUMINIUM, material: "anodised" },
            // The density is the mean of wall, air, piston and inner rod.
            Piece { name: "tube", mesh: tube, density: ALUMINIUM * 0.7, material: "tube" },
            Piece { name: "ties", mesh: ties, density: STEEL, material: "bright" },
            Piece { name: "nuts", mesh: nuts.textured_from_above(0.03), density: STEEL * 0.8, material: "zinc" },
            Piece { name: "wiper", mesh: wiper, density: PLASTIC, material: "rubber" },
            Piece { name: "rod", mesh: rod, density: STEEL, material: "chrome" },
            Piece { name: "screw", mesh: screw, density: STEEL, material: "rolled" },
            Piece {
                name: "hexagons",
                mesh: hexagons.textured_from_above(0.03),
                density: STEEL * 0.5,
                material: "zinc",
            },
            Piece { name: "bodies", mesh: bodies, density: PLASTIC, material: "blue" },
            Piece { name: "mouths", mesh: mouths.textured_from_above(0.03), density: PLASTIC, material: "rubber" },
        ],
        finishes: vec![
            Finish {
                name: "anodised",
                texture: Texture::brushed(128, [0.58, 0.59, 0.61], 0.09, 41),
                specular: 0.4,
                shininess: 0.4,
            },
            Finish {
                name: "tube",
                texture: Texture::round_bar(64, [0.56, 0.57, 0.60], 0.7, 42),
                specular: 0.5,
                shininess: 0.5,
            },
            Finish {
                name: "bright",
                texture: Texture::round_bar(64, [0.66, 0.67, 0.69], 0.8, 43),
                specular: 0.6,
                shininess: 0.6,
            },
            Finish {
                name: "zinc",
                texture: Texture::brushed(64, [0.62, 0.62, 0.60], 0.10, 44),
                specular: 0.6,
                shininess: 0.5,
            },
            Finish {
                name: "chrome",
                texture: Texture::round_bar(64, [0.74, 0.75, 0.78], 0.9, 45),
                specular: 0.9,
                shininess: 0.8,
            },
            Finish {
                name: "rolled",
                texture: Texture::round_bar(64, [0.48, 0.49, 0.50], 0.45, 46),
                specular: 0.5,
                shininess: 0.5,
            },
            Finish {
                name: "rubber",
                texture: Texture::grained(32, [0.10, 0.10, 0.11], 0.06, 47),
                specular: 0.2,
                shininess: 0.3,
            },
            Finish {
                name: "blue",
                texture: Texture::round_bar(32, [0.10, 0.30, 0.66], 0.25, 48),
                specular: 0.4,
                shininess: 0.5,
            },
        ],
        collisions,
        grasp_half_line: 0.022,
        jaw_width: 2.0 * (TIE + TIE_RADIUS),
        grasp_height: 0.014,
        mark_height: CAP + TIE,
        seen_height: CAP + TUBE_RADIUS,
        friction: 0.5,
        symmetry: RotationalSymmetry::None,
    }
}

//! Lower half of a gearbox housing: cast aluminium, open at the top, with machined joint and bearing seats.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Point2, Point3, Vector2};
use sdg_simulation::objects::RotationalSymmetry;
use sdg_simulation::shapes::mesh::TriangleMesh;
use sdg_simulation::shapes::solids::{box_solid, circle, cylinder, extrude, hex_prism, ring, rounded_rectangle};
use sdg_simulation::shapes::texture::Texture;

use crate::part::{
    ALUMINIUM, BRASS, Finish, Part, Piece, box_between, cylinder_between, drawn_along_x, laid, laid_level, moved,
};

const HEIGHT: f64 = 0.030;
/// Half the outer length of the box.
const HALF_LENGTH: f64 = 0.044;
/// Half the outer width of the box.
const HALF_WIDTH: f64 = 0.022;
/// Thickness of the long walls.
const WALL: f64 = 0.005;
const FLOOR: f64 = 0.004;
/// Depth of the machined top.
const SKIN: f64 = 0.0010;
/// Distance by which the seats end below the long walls, because overlapping faces in one plane would be lit twice.
const SEAT_LOWER: f64 = 0.00006;
const LUG_LOWER: f64 = 0.00012;
/// Bolt lugs at the corners: their centres and radius.
const LUG: (f64, f64) = (0.0375, 0.0255);
const LUG_RADIUS: f64 = 0.0066;
const BOLT_RADIUS: f64 = 0.0028;
/// Feet at both ends: centre and end along x, and height.
const FOOT_CENTRE: f64 = 0.050;
const FOOT_END: f64 = 0.065;
const FOOT_HEIGHT: f64 = 0.006;

/// A foot at one end: the wide one has two bolts, the narrow one has one.
struct Foot {
    side: f64,
    half_width: f64,
    bolts: &'static [f64],
}

const FEET: [Foot; 2] = [
    Foot { side: -1.0, half_width: 0.025, bolts: &[0.016, -0.016] },
    Foot { side: 1.0, half_width: 0.012, bolts: &[0.0] },
];

/// A wall across the box with a bearing's half bore in its top.
struct Seat {
    /// Start and thickness of the wall, along x.
    wall: [f64; 2],
    /// Radius of the bore, and of the boss around it.
    radius: f64,
    boss_radius: f64,
    /// Start and length of the boss along x; `None` for the partition.
    boss: Option<[f64; 2]>,
}

const SEATS: [Seat; 3] = [
    Seat { wall: [-0.0438, 0.0080], radius: 0.0110, boss_radius: 0.0165, boss: Some([-0.0535, 0.0100]) },
    Seat { wall: [0.0358, 0.0080], radius: 0.0080, boss_radius: 0.0130, boss: Some([0.0435, 0.0100]) },
    Seat { wall: [0.0120, 0.0050], radius: 0.0095, boss_radius: 0.0095, boss: None },
];

/// The part.
pub fn housing() -> Part {
    let inner_width = HALF_WIDTH - 0.0005;
    let mut cast = moved(box_solid(2.0 * HALF_LENGTH - 0.001, 2.0 * HALF_WIDTH - 0.001, FLOOR, 0.0), 0.0, 0.0, 0.0001);
    let mut skin = TriangleMesh::default();
    let mut bores = TriangleMesh::default();
    for side in [-1.0, 1.0] {
        let y = side * (HALF_WIDTH - WALL / 2.0);
        cast.append(&moved(box_solid(2.0 * HALF_LENGTH, WALL, HEIGHT - SKIN, 0.0), 0.0, y, 0.0));
        skin.append(&moved(box_solid(2.0 * HALF_LENGTH, WALL, SKIN, 0.0003), 0.0, y, HEIGHT - SKIN));
    }
    for seat in &SEATS {
        let [x, length] = seat.wall;
        cast.append(&drawn_along_x(&saddle(inner_width, seat.radius), x, length, 0.0));
        let (mut from, mut to) = (x, x + length);
        if let Some([x, length]) = seat.boss {
            cast.append(&drawn_along_x(&half_ring(seat.radius, seat.boss_radius), x, length, 0.0));
            (from, to) = (from.min(x), to.max(x + length));
        }
        bores.append(&drawn_along_x(
            &half_ring(seat.radius - 0.0005, seat.radius + 0.0003),
            from - 0.0001,
            to - from + 0.0002,
            0.0,
        ));
        // The joint's face on either side of the bore.
        for side in [-1.0, 1.0] {
            let strip = |x: [f64; 2], edge: f64| {
                let (middle, width) = ((seat.radius + edge) / 2.0, edge - seat.radius);
                moved(
                    box_solid(x[1], width, SKIN, 0.0003),
                    x[0] + x[1] / 2.0,
                    side * middle,
                    HEIGHT - SKIN - SEAT_LOWER,
                )
            };
            skin.append(&strip(seat.wall, inner_width));
            if let Some(boss) = seat.boss {
                skin.append(&strip(boss, seat.boss_radius));
            }
        }
    }
    for (x, y) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(x, y)| (x * LUG.0, y * LUG.1)) {
        cast.append(&moved(ring(BOLT_RADIUS, LUG_RADIUS, HEIGHT - SKIN, 0.0, 32), x, y, 0.0));
        skin.append(&moved(ring(BOLT_RADIUS, LUG_RADIUS, SKIN, 0.0003, 32), x, y, HEIGHT - SKIN - LUG_LOWER));
    }

    let mut feet = TriangleMesh::default();
    for foot in &FEET {
        let place = Vector2::new(foot.side * FOOT_CENTRE, 0.0);
        let length = 2.0 * (FOOT_END - FOOT_CENTRE);
        let outline: Vec<_> =
            rounded_rectangle(length, 2.0 * foot.half_width, 0.005).iter().map(|p| p + place).collect();
        let holes: Vec<_> =
            foot.bolts.iter().map(|y| circle(Point2::new(foot.side * 0.0590, *y), 0.0032, 24)).collect();
        feet.append(&extrude(&outline, &holes, FOOT_HEIGHT, 0.0010));
    }
    // Ribs that stiffen the long walls, away from the jaws.
    for (x, side) in [(0.0200, 1.0), (0.0200, -1.0), (-0.0200, -1.0)] {
        feet.append(&moved(box_solid(0.0032, 0.0050, 0.024, 0.0006), x, side * (HALF_WIDTH + 0.0020), 0.0));
    }

    let floor = moved(box_solid(0.0800, 0.0350, 0.0012, 0.0), 0.0, 0.0, FLOOR - 0.0006);
    let mut fittings = laid_level(hex_prism(0.0100, 0.0050, 0.0), Point3::new(-0.0200, HALF_WIDTH, 0.0125), FRAC_PI_2);
    fittings.append(&laid(
        cylinder(0.0062, 0.0012, 0.0003, 28),
        Point3::new(-0.0200, HALF_WIDTH - 0.0002, 0.0125),
        FRAC_PI_2,
    ));

    let mut collisions = vec![box_between([-HALF_LENGTH, -HALF_WIDTH, 0.0], [HALF_LENGTH, HALF_WIDTH, HEIGHT])];
    for Foot { side, half_width, .. } in FEET {
        let (near, far) = (side * HALF_LENGTH, side * FOOT_END);
        collisions.push(box_between([near.min(far), -half_width, 0.0], [near.max(far), half_width, FOOT_HEIGHT]));
        for y in [-LUG.1, LUG.1] {
            collisions.push(cylinder_between([side * LUG.0, y, 0.0], [side * LUG.0, y, HEIGHT], LUG_RADIUS));
        }
    }
    for seat in &SEATS {
        if let Some([x, length]) = seat.boss {
            let r = seat.boss_radius;
            collisions.push(box_between([x, -r, HEIGHT - 0.7 * r], [x + length, r, HEIGHT]));
        }
    }
    collisions.push(cylinder_between([-0.0200, HALF_WIDTH, 0.0125], [-0.0200, HALF_WIDTH + 0.005, 0.0125], 0.0058));

    Part {
        name: "housing",
        title: "Housing",
        description: "Lower half of a gearbox housing, cast aluminium: open box of 88 by 44 by 30 mm with machined joint, \
                      bearing seats of 22 and 16 mm in bosses, partition, four bolt lugs, two unlike feet, brass oil plug",
        pieces: vec![
            Piece { name: "cast", mesh: cast.textured_from_above(0.06), density: ALUMINIUM, material: "cast" },
            Piece { name: "feet", mesh: feet.textured_from_above(0.06), density: ALUMINIUM, material: "cast" },
            Piece { name: "joint", mesh: skin.textured_from_above(0.05), density: ALUMINIUM, material: "milled" },
            Piece { name: "bores", mesh: bores.textured_from_above(0.03), density: ALUMINIUM * 0.5, material: "bored" },
            Piece {
                name: "floor",
                mesh: floor.textured_from_above(0.05),
                density: ALUMINIUM * 0.3,
                material: "primer",
            },
            Piece { name: "plug", mesh: fittings.textured_from_above(0.03), density: BRASS, material: "brass" },
        ],
        finishes: vec![
            Finish {
                name: "cast",
                texture: Texture::cast(160, [0.44, 0.45, 0.46], 0.09, 81),
                specular: 0.25,
                shininess: 0.3,
            },
            Finish {
                name: "milled",
                texture: Texture::brushed(96, [0.64, 0.65, 0.66], 0.10, 82),
                specular: 0.4,
                shininess: 0.5,
            },
            Finish {
                name: "bored",
                texture: Texture::brushed(64, [0.58, 0.59, 0.60], 0.12, 83),
                specular: 0.7,
                shininess: 0.6,
            },
            Finish {
                name: "primer",
                texture: Texture::grained(64, [0.30, 0.31, 0.32], 0.10, 84),
                specular: 0.1,
                shininess: 0.2,
            },
            Finish {
                name: "brass",
                texture: Texture::turned(32, [0.78, 0.62, 0.30], 0.14, 85),
                specular: 0.5,
                shininess: 0.5,
            },
        ],
        collisions,
        grasp_half_line: 0.020,
        jaw_width: 2.0 * HALF_WIDTH,
        grasp_height: 0.015,
        mark_height: HEIGHT,
        seen_height: HEIGHT,
        friction: 0.5,
        symmetry: RotationalSymmetry::None,
    }
}

/// Arc of the lower half of a bore about the joint's plane, from -y to +y, as (y, z).
fn lower_arc(radius: f64) -> impl DoubleEndedIterator<Item = Point2<f64>> {
    (0..=16).map(move |step| {
        let angle = PI * (1.0 + f64::from(step) / 16.0);
        Point2::new(radius * angle.cos(), HEIGHT - SKIN + (radius * angle.sin()).min(0.0))
    })
}

/// Outline (y, z) of a wall up to the joint, with a half bore in the centre of its top, counter-clockwise.
fn saddle(half_width: f64, radius: f64) -> Vec<Point2<f64>> {
    let corners =
        [(half_width, HEIGHT - SKIN), (-half_width, HEIGHT - SKIN), (-half_width, 0.0003), (half_width, 0.0003)];
    let [upper_right, upper_left, lower_left, lower_right] = corners.map(|(y, z)| Point2::new(y, z));
    [lower_left, lower_right, upper_right].into_iter().chain(lower_arc(radius).rev()).chain([upper_left]).collect()
}

/// Half of a ring below the joint, counter-clockwise.
fn half_ring(inner: f64, outer: f64) -> Vec<Point2<f64>> {
    lower_arc(outer).chain(lower_arc(inner).rev()).collect()
}

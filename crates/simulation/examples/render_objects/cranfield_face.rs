//! Face plate of the Cranfield assembly: printed, with the seats of pegs, shaft and spacer.

use std::f64::consts::PI;

use nalgebra::{Point2, Point3, Vector2};
use sdg_simulation::objects::RotationalSymmetry;
use sdg_simulation::shapes::mesh::TriangleMesh;
use sdg_simulation::shapes::solids::{circle, extrude, ring, rounded_path, rounded_rectangle};
use sdg_simulation::shapes::texture::Texture;

use crate::part::{Finish, PRINTED, Part, Piece, box_between, moved};

const THICKNESS: f64 = 0.012;
/// Half the width of the neck, at which the part is held.
const NECK: f64 = 0.020;
/// Half the width of the foot.
const FOOT: f64 = 0.036;
/// x of the start and end of the foot, of the start of the neck, and of the centre of the crown's half circle.
const FOOT_START: f64 = -0.092;
const FOOT_END: f64 = -0.038;
const NECK_START: f64 = -0.022;
const CROWN: f64 = 0.030;

/// The part.
pub fn cranfield_face() -> Part {
    let at = |points: &[Point2<f64>], x: f64, y: f64| -> Vec<Point2<f64>> {
        points.iter().map(|point| point + Vector2::new(x, y)).collect()
    };
    let shaft = (-0.065, 0.0);
    let square = rounded_rectangle(0.013, 0.013, 0.0006);
    let window = rounded_rectangle(0.030, 0.011, 0.005);
    let square_places = [(-0.080, 0.023), (-0.080, -0.023)];
    let round_places = [(-0.050, 0.023), (-0.050, -0.023)];
    let mut holes = vec![
        circle(Point2::new(shaft.0, shaft.1), 0.0085, 32),
        circle(Point2::new(CROWN + 0.002, 0.0), 0.0055, 28),
        at(&window, 0.0, 0.0),
    ];
    holes.extend(square_places.map(|(x, y)| at(&square, x, y)));
    holes.extend(round_places.map(|(x, y)| circle(Point2::new(x, y), 0.0065, 28)));
    let plate = extrude(&outline(), &holes, THICKNESS, 0.0010);

    // Collars make the seats deeper, as on printed plates.
    let collar = |inner: f64, outer: f64, height: f64, x: f64, y: f64| {
        moved(ring(inner, outer, height + 0.0005, 0.0006, 40), x, y, THICKNESS - 0.0005)
    };
    let mut collars = TriangleMesh::default();
    collars.append(&collar(0.0085, 0.0145, 0.005, shaft.0, shaft.1));
    collars.append(&collar(0.0055, 0.0100, 0.003, CROWN + 0.002, 0.0));
    for (x, y) in round_places {
        collars.append(&collar(0.0065, 0.0095, 0.002, x, y));
    }
    for (x, y) in square_places {
        let frame = extrude(&rounded_rectangle(0.019, 0.019, 0.0015), std::slice::from_ref(&square), 0.0025, 0.0006);
        collars.append(&moved(frame, x, y, THICKNESS - 0.0005));
    }

    let printed = |mesh: TriangleMesh| mesh.textured_from_above(0.04);
    Part {
        name: "cranfield_face",
        title: "Cranfield face",
        description: "Face plate after the Cranfield assembly benchmark, printed: foot with two square and two round peg \
                      seats about the shaft's, neck with a window, round crown; 142 mm tall, 72 mm wide, 12 mm thick",
        pieces: vec![
            Piece { name: "plate", mesh: printed(plate), density: PRINTED, material: "printed" },
            Piece { name: "collars", mesh: printed(collars), density: PRINTED, material: "printed" },
        ],
        finishes: vec![Finish {
            name: "printed",
            texture: Texture::printed(256, [0.12, 0.36, 0.66], 26.0, 51),
            specular: 0.15,
            shininess: 0.2,
        }],
        collisions: vec![
            box_between([FOOT_START, -FOOT, 0.0], [FOOT_END, FOOT, THICKNESS]),
            box_between([FOOT_END, -NECK, 0.0], [CROWN, NECK, THICKNESS]),
            format!("type=\"cylinder\" pos=\"{CROWN} 0 {half}\" size=\"{NECK} {half}\"", half = THICKNESS / 2.0),
            format!("type=\"cylinder\" pos=\"{} 0 0.0085\" size=\"0.0145 0.0085\"", shaft.0),
        ],
        grasp_half_line: 0.020,
        jaw_width: 2.0 * NECK,
        grasp_height: 0.008,
        mark_height: THICKNESS,
        seen_height: THICKNESS,
        friction: 0.6,
        symmetry: RotationalSymmetry::None,
    }
}

/// Foot, shoulders, neck and crown, counter-clockwise.
fn outline() -> Vec<Point2<f64>> {
    let corners = [
        (CROWN, NECK),
        (NECK_START, NECK),
        (FOOT_END, FOOT),
        (FOOT_START, FOOT),
        (FOOT_START, -FOOT),
        (FOOT_END, -FOOT),
        (NECK_START, -NECK),
        (CROWN, -NECK),
    ]
    .map(|(x, y)| Point3::new(x, y, 0.0));
    let mut outline: Vec<Point2<f64>> = rounded_path(&corners, 0.006, 5).iter().map(|point| point.xy()).collect();
    outline.extend((1..24).map(|step| {
        let angle = PI * (f64::from(step) / 24.0 - 0.5);
        Point2::new(CROWN + NECK * angle.cos(), NECK * angle.sin())
    }));
    outline
}

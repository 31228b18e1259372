//! Combination pliers lying flat: ground steel jaws with a lap joint and a riveted pivot, dipped handles in two
//! colours.

use nalgebra::Point2;
use sdg_simulation::objects::RotationalSymmetry;
use sdg_simulation::shapes::mesh::TriangleMesh;
use sdg_simulation::shapes::solids::{cylinder, extrude};
use sdg_simulation::shapes::texture::{Noise, Texture};

use crate::part::{Finish, Part, Piece, RUBBER, STEEL, box_between, centred_texture, moved};
use crate::print::{Lettering, in_rectangle, plan_texture};
use crate::shapes::{bezier, mirrored, oval_bar};

const THICKNESS: f64 = 0.0100;
/// Half the width of the joint, at which the hand holds the part.
const JOINT_HALF_WIDTH: f64 = 0.0120;
/// The upper half's round lap about the pivot, and the wider cut for it in the other half.
const LAP_RADIUS: f64 = 0.0092;
const CUT_RADIUS: f64 = 0.0097;
const RIVET_RADIUS: f64 = 0.0042;
const JAW_TIP: f64 = 0.0520;
/// Half the gap between the closed jaws.
const GAP: f64 = 0.00025;
const HANDLE_MIDDLE: f64 = 0.0054;
const HANDLE: [(f64, f64); 4] = [(-0.0240, 0.0108), (-0.0500, 0.0205), (-0.0800, 0.0225), (-0.1085, 0.0160)];
/// Side of the square that the steel's texture covers.
const SPAN: f64 = 0.10;

/// The part.
pub fn pliers() -> Part {
    // The upper half has its jaw at -y and its handle at +y; its pieces extend below its lap.
    let mut steel = TriangleMesh::default();
    let solid = |outline: &[Point2<f64>]| moved(extrude(outline, &[], THICKNESS - 0.0002, 0.0007), 0.0, 0.0, 0.0002);
    steel.append(&solid(&jaw(CUT_RADIUS)));
    steel.append(&solid(&mirrored(&jaw(LAP_RADIUS - 0.0006))));
    steel.append(&solid(&tang(LAP_RADIUS - 0.0006)));
    steel.append(&solid(&mirrored(&tang(CUT_RADIUS))));
    // The lap ends slightly lower: overlapping faces in one plane would be lit twice.
    let lap = cylinder(LAP_RADIUS, THICKNESS / 2.0 - 0.0001, 0.0004, 56);
    steel.append(&moved(lap, 0.0, 0.0, THICKNESS / 2.0));
    let lower_lap = moved(cylinder(JOINT_HALF_WIDTH - 0.0004, THICKNESS / 2.0, 0.0004, 56), 0.0, 0.0, 0.0001);
    let rivet = centred_texture(cylinder(RIVET_RADIUS, 0.0008, 0.0003, 36), 0.01);

    let mut sleeves = TriangleMesh::default();
    let mut inlays = TriangleMesh::default();
    for side in [1.0, -1.0] {
        let path = bezier(HANDLE.map(|(x, y)| Point2::new(x, y * side)), 72);
        sleeves.append(&oval_bar(&path, HANDLE_MIDDLE, sleeve_half_size));
        inlays.append(&oval_bar(&path[14..=62], HANDLE_MIDDLE, inlay_half_size));
    }

    let mut collisions = vec![
        box_between([-0.0140, -JOINT_HALF_WIDTH, 0.0], [0.0180, JOINT_HALF_WIDTH, THICKNESS]),
        box_between([0.0180, -0.0098, 0.0], [0.0350, 0.0098, THICKNESS]),
        box_between([0.0350, -0.0062, 0.0], [JAW_TIP - 0.0005, 0.0062, THICKNESS]),
    ];
    for side in [1.0, -1.0] {
        let path = bezier(HANDLE.map(|(x, y)| Point2::new(x, y * side)), 6);
        for (from, to) in path.iter().zip(&path[1..]) {
            collisions.push(format!(
                "type=\"capsule\" size=\"0.005\" fromto=\"{:.5} {:.5} 0.005 {:.5} {:.5} 0.005\"",
                from.x, from.y, to.x, to.y
            ));
        }
        collisions.push(format!(
            "type=\"capsule\" size=\"0.0045\" fromto=\"-0.014 {:.5} 0.0045 -0.024 {:.5} 0.0045\"",
            side * 0.0070,
            side * 0.0108
        ));
    }

    Part {
        name: "pliers",
        title: "Pliers",
        description: "Combination pliers, 160 mm, lying flat: ground steel head with serrated jaws, pipe grip, lap joint and \
                      riveted pivot; dipped red handles with black inlays",
        pieces: vec![
            Piece { name: "steel", mesh: centred_texture(steel, SPAN), density: STEEL, material: "ground" },
            // Most of the lower lap is inside the other pieces.
            Piece { name: "lap", mesh: lower_lap.textured_from_above(0.03), density: 0.3 * STEEL, material: "oiled" },
            Piece {
                name: "rivet",
                mesh: moved(rivet, 0.0, 0.0, THICKNESS - 0.0003),
                density: STEEL,
                material: "turned",
            },
            // The steel tangs run through the sleeves.
            Piece { name: "sleeves", mesh: sleeves.textured_from_above(0.05), density: 4200.0, material: "dipped" },
            Piece { name: "inlays", mesh: inlays.textured_from_above(0.03), density: 0.1 * RUBBER, material: "inlay" },
        ],
        finishes: vec![
            Finish { name: "ground", texture: ground_steel(), specular: 0.5, shininess: 0.5 },
            Finish {
                name: "oiled",
                texture: Texture::brushed(48, [0.20, 0.19, 0.19], 0.15, 142),
                specular: 0.3,
                shininess: 0.4,
            },
            Finish {
                name: "turned",
                texture: Texture::turned(48, [0.72, 0.73, 0.75], 0.18, 143),
                specular: 0.6,
                shininess: 0.5,
            },
            Finish {
                name: "dipped",
                texture: Texture::grained(96, [0.72, 0.10, 0.09], 0.05, 144),
                specular: 0.4,
                shininess: 0.4,
            },
            Finish {
                name: "inlay",
                texture: Texture::grained(64, [0.12, 0.12, 0.13], 0.10, 145),
                specular: 0.1,
                shininess: 0.2,
            },
        ],
        collisions,
        grasp_half_line: 0.015,
        jaw_width: 2.0 * JOINT_HALF_WIDTH,
        grasp_height: 0.0065,
        mark_height: THICKNESS - 0.0005,
        seen_height: THICKNESS - 0.0005,
        friction: 0.5,
        symmetry: RotationalSymmetry::None,
    }
}

/// Points of a circle about the pivot between two angles in degrees.
fn arc(radius: f64, from_deg: f64, to_deg: f64) -> impl Iterator<Item = Point2<f64>> {
    (0..=14).map(move |step| {
        let angle = (from_deg + (to_deg - from_deg) * f64::from(step) / 14.0).to_radians();
        Point2::new(radius * angle.cos(), radius * angle.sin())
    })
}

/// Outline of the jaw at +y from above, counter-clockwise, cut by a circle about the pivot.
fn jaw(cut_radius: f64) -> Vec<Point2<f64>> {
    let mut outline = Vec::new();
    // Along the inner edge to the tip: the cutter, the pipe grip, the serrated flat.
    outline.push(Point2::new(0.0160, GAP));
    for step in 0..=12 {
        let part = f64::from(step) / 12.0;
        let bulge = 0.0034 * (std::f64::consts::PI * part).sin().powf(0.8);
        outline.push(Point2::new(0.0190 + 0.0120 * part, GAP + 0.0002 + bulge));
    }
    for tooth in 0..10 {
        let x = 0.0330 + 0.0018 * f64::from(tooth);
        outline.extend([Point2::new(x, GAP), Point2::new(x + 0.0009, GAP + 0.0006)]);
    }
    outline.extend(
        [(JAW_TIP, GAP), (JAW_TIP, 0.0040), (0.0508, 0.0052), (0.0400, 0.0078), (0.0300, 0.0100), (0.0220, 0.0113)]
            .map(|(x, y)| Point2::new(x, y)),
    );
    outline.extend(
        [(0.0150, 0.0119), (0.0080, JOINT_HALF_WIDTH), (0.0003, JOINT_HALF_WIDTH)].map(|(x, y)| Point2::new(x, y)),
    );
    outline.extend(arc(cut_radius, 88.2, 1.5));
    outline
}

/// Outline of the piece from the joint into the handle at +y from above, counter-clockwise, cut by a circle about the
/// pivot.
fn tang(cut_radius: f64) -> Vec<Point2<f64>> {
    let mut outline: Vec<_> = [
        (-0.0003, JOINT_HALF_WIDTH),
        (-0.0090, JOINT_HALF_WIDTH),
        (-0.0180, 0.0128),
        (-0.0285, 0.0160),
        (-0.0275, 0.0096),
        (-0.0220, 0.0062),
        (-0.0160, 0.0026),
        (-0.0125, 0.0004),
    ]
    .map(|(x, y)| Point2::new(x, y))
    .to_vec();
    outline.extend(arc(cut_radius, 178.5, 91.8));
    outline
}

/// Half width and half height of a dipped sleeve: a guard near the joint, a belly, a rounded end.
fn sleeve_half_size(part: f64) -> (f64, f64) {
    let guard = 0.0011 * (-((part - 0.10) / 0.035).powi(2)).exp();
    let belly = 0.0008 * (-((part - 0.50) / 0.28).powi(2)).exp();
    // A blunt start and a quarter of an ellipse at the end.
    let end = |distance: f64, length: f64| (1.0 - (1.0 - (distance / length).min(1.0)).powi(2)).max(0.0).sqrt();
    let fade = (0.88 + 0.12 * end(part, 0.03)) * (0.12 + 0.88 * end(1.0 - part, 0.06));
    ((0.0044 + guard + belly) * fade, (0.0052 + 0.2 * belly) * fade)
}

/// Half width and half height of the inlay on a sleeve; the inlay is higher than the sleeve.
fn inlay_half_size(part: f64) -> (f64, f64) {
    let fade = (1.0 - (2.0 * part - 1.0).abs().powi(4)).max(0.02).sqrt();
    (0.0031 * fade, 0.0050 + 0.0008 * fade)
}

/// Brushed steel with darker marks stamped into jaws and tangs, drawn to scale.
fn ground_steel() -> Texture {
    let lines = Noise::new_stretched(6, 256, 141);
    let broad = Noise::new(5, 146);
    let stamps = [
        Lettering::level("CR-V", 26.0, 6.6, 2.4),
        Lettering::level("160", 26.0, -6.4, 2.4),
        Lettering { upright: true, ..Lettering::level("SDG", -6.9, 0.0, 1.8) },
    ];
    plan_texture(384, SPAN, |place| {
        let (u, v) = (place.x / SPAN, place.y / SPAN);
        // The cutter's edges are ground brighter.
        let cutter = in_rectangle(place, (0.0145, 0.0), (0.0085, 0.0030));
        let shade = 0.64 * (1.0 + 0.10 * lines.at(u, v) + 0.05 * broad.fractal(u, v, 2));
        let shade = if cutter { shade * 1.15 } else { shade };
        let shade = if stamps.iter().any(|stamp| stamp.covers(place)) { 0.45 * shade } else { shade };
        [shade, shade * 1.005, shade * 1.02]
    })
}

//! Assembled circuit board on brass standoffs: green solder mask with tracks and white print, controller, relay,
//! connectors, capacitors.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Isometry3, Point2, Translation3, UnitQuaternion, Vector3};
use sdg_simulation::objects::RotationalSymmetry;
use sdg_simulation::shapes::mesh::TriangleMesh;
use sdg_simulation::shapes::solids::{box_solid, circle, cylinder, extrude, hex_prism, lathe, rounded_rectangle};
use sdg_simulation::shapes::texture::Texture;

use crate::board_layout::{
    BUTTON, Block, CANS, CHIPS, CONTROLLER, CRYSTAL, DRIVER, FIXINGS, HEADER, JACK, LAMPS, LENGTH, MEMORY, MIDDLE_X,
    OPEN_HOLES, RELAY, SPAN, STANDOFF, TERMINALS, THICKNESS, TOP, USB, WIDTH, block,
};
use crate::board_print::{board_texture, plastics_texture};
use crate::part::{BRASS, Finish, PLASTIC, Part, Piece, STEEL, box_between, centred_texture, cylinder_between, moved};

fn solid(of: &Block, chamfer: f64) -> TriangleMesh {
    moved(box_solid(of.size.0, of.size.1, of.height, chamfer), of.at.0, of.at.1, TOP)
}

fn fixings() -> impl Iterator<Item = (f64, f64)> {
    FIXINGS.0.into_iter().flat_map(|x| [(x, FIXINGS.1), (x, -FIXINGS.1)])
}

/// The part.
pub fn circuit_board() -> Part {
    let outline: Vec<_> =
        rounded_rectangle(LENGTH, WIDTH, 0.0025).iter().map(|p| Point2::new(p.x + MIDDLE_X, p.y)).collect();
    let mut holes: Vec<_> = fixings().map(|(x, y)| circle(Point2::new(x, y), 0.0016, 20)).collect();
    holes.extend(OPEN_HOLES.map(|(x, y)| circle(Point2::new(x, y), 0.0014, 20)));
    let board = moved(extrude(&outline, &holes, THICKNESS, 0.0), 0.0, 0.0, STANDOFF);

    let mut plastics = TriangleMesh::default();
    for body in [&CONTROLLER, &DRIVER, &MEMORY] {
        plastics.append(&moved(solid(body, 0.0003), 0.0, 0.0, 0.0002));
    }
    for body in [&RELAY, &JACK, &HEADER, &BUTTON] {
        plastics.append(&solid(body, 0.0004));
    }
    for terminal in &TERMINALS {
        plastics.append(&solid(&Block { height: 0.0070, ..*terminal }, 0.0));
        let upper =
            block(terminal.at.0 - 0.0010, terminal.at.1, terminal.size.0 - 0.0030, terminal.size.1, terminal.height);
        plastics.append(&solid(&upper, 0.0005));
    }
    for (x, y, along_y) in CHIPS {
        let (length, width) = if along_y { (0.00125, 0.0011) } else { (0.0011, 0.00125) };
        plastics.append(&moved(box_solid(length, width, 0.0007, 0.0), x, y, TOP));
    }
    for (x, y) in LAMPS {
        let dome = [(0.0, 0.0), (0.0015, 0.0), (0.0015, 0.0022), (0.0011, 0.0031), (0.0005, 0.0036), (0.0, 0.0037)];
        plastics.append(&moved(lathe(&dome, 20), x, y, TOP));
    }
    plastics.append(&moved(cylinder(0.0017, 0.0020, 0.0003, 20), BUTTON.at.0, BUTTON.at.1, TOP + BUTTON.height));
    for (x, y, radius, height) in CANS {
        plastics.append(&moved(cylinder(radius, height, 0.0006, 32), x, y, TOP));
    }

    let mut tin = pins();
    tin.append(&solid(&USB, 0.0007));
    let oval = rounded_rectangle(CRYSTAL.size.0, CRYSTAL.size.1, CRYSTAL.size.1 / 2.0 - 0.00002);
    tin.append(&moved(extrude(&oval, &[], CRYSTAL.height, 0.0004), CRYSTAL.at.0, CRYSTAL.at.1, TOP));
    for (x, y) in fixings() {
        tin.append(&moved(screw_head(), x, y, TOP));
    }
    for terminal in &TERMINALS {
        for (x, y) in screws_of(terminal) {
            tin.append(&moved(cylinder(0.0017, 0.0004, 0.0001, 20), x, y, TOP + terminal.height));
        }
    }
    for (x, y, along_y) in CHIPS {
        for end in [-1.0, 1.0] {
            let shift = end * 0.00078;
            let (dx, dy) = if along_y { (0.0, shift) } else { (shift, 0.0) };
            let (length, width) = if along_y { (0.00127, 0.00046) } else { (0.00046, 0.00127) };
            tin.append(&moved(box_solid(length, width, 0.00072, 0.0), x + dx, y + dy, TOP));
        }
    }

    let mut brass = TriangleMesh::default();
    for (x, y) in fixings() {
        brass.append(&moved(hex_prism(0.0055, STANDOFF, 0.0), x, y, 0.0));
    }
    for column in 0..10 {
        for row in [-0.5, 0.5] {
            let (x, y) = (HEADER.at.0 + 0.00254 * (f64::from(column) - 4.5), HEADER.at.1 + 0.00254 * row);
            brass.append(&moved(box_solid(0.00064, 0.00064, 0.0085, 0.0002), x, y, TOP));
        }
    }
    // The bare tops of the capacitors, a little smaller than their sleeves.
    let mut lids = TriangleMesh::default();
    for (x, y, radius, height) in CANS {
        let lid = centred_texture(cylinder(radius - 0.0007, 0.0003, 0.0001, 32), 2.0 * radius);
        lids.append(&moved(lid, x, y, TOP + height - 0.00015));
    }

    let mut collisions = vec![box_between(
        [MIDDLE_X - LENGTH / 2.0, -WIDTH / 2.0, STANDOFF],
        [MIDDLE_X + LENGTH / 2.0, WIDTH / 2.0, TOP],
    )];
    collisions.extend(fixings().map(|(x, y)| cylinder_between([x, y, 0.0], [x, y, STANDOFF], 0.0028)));
    for body in [&USB, &JACK, &RELAY, &TERMINALS[0], &TERMINALS[1]] {
        let ((x, y), (length, width)) = (body.at, body.size);
        collisions.push(box_between(
            [x - length / 2.0, y - width / 2.0, TOP],
            [x + length / 2.0, y + width / 2.0, TOP + body.height],
        ));
    }
    collisions.extend(CANS.map(|(x, y, radius, height)| cylinder_between([x, y, TOP], [x, y, TOP + height], radius)));

    Part {
        name: "circuit_board",
        title: "Circuit board",
        description: "Assembled circuit board, 92 by 52 mm, on 8 mm brass standoffs: green solder mask, white print, controller \
                      with 44 pins, relay, USB socket, power jack, screw terminals, pin header, capacitors, crystal",
        pieces: vec![
            Piece { name: "board", mesh: centred_texture(board, SPAN), density: 1850.0, material: "mask" },
            Piece {
                name: "plastics",
                mesh: centred_texture(plastics, SPAN),
                density: 1.4 * PLASTIC,
                material: "plastics",
            },
            // Sockets and screws are mostly hollow or thin.
            Piece { name: "tin", mesh: tin.textured_from_above(0.02), density: 0.35 * STEEL, material: "tin" },
            Piece { name: "brass", mesh: brass.textured_from_above(0.02), density: BRASS, material: "gold" },
            Piece { name: "lids", mesh: lids, density: 2700.0, material: "lid" },
        ],
        finishes: vec![
            Finish { name: "mask", texture: board_texture(), specular: 0.3, shininess: 0.5 },
            Finish { name: "plastics", texture: plastics_texture(), specular: 0.2, shininess: 0.3 },
            Finish {
                name: "tin",
                texture: Texture::brushed(48, [0.70, 0.71, 0.72], 0.10, 162),
                specular: 0.6,
                shininess: 0.5,
            },
            Finish {
                name: "gold",
                texture: Texture::grained(32, [0.82, 0.66, 0.30], 0.06, 163),
                specular: 0.5,
                shininess: 0.5,
            },
            Finish { name: "lid", texture: scored_lid(), specular: 0.5, shininess: 0.5 },
        ],
        collisions,
        grasp_half_line: 0.030,
        jaw_width: WIDTH,
        grasp_height: 0.0095,
        mark_height: TOP,
        seen_height: TOP,
        friction: 0.6,
        symmetry: RotationalSymmetry::None,
    }
}

/// The screws of a terminal block, one every 5.08 mm.
pub fn screws_of(terminal: &Block) -> impl Iterator<Item = (f64, f64)> {
    const PITCH: f64 = 0.00508;
    let (x, y, count) = (terminal.at.0 - 0.0010, terminal.at.1, (terminal.size.1 / PITCH).round() as u32);
    (0..count).map(move |idx| (x, y + PITCH * (f64::from(idx) - f64::from(count - 1) / 2.0)))
}

/// The pins of the integrated circuits: on four sides of the controller, on two sides of the others.
fn pins() -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for (body, count, pitch, all_sides) in
        [(&CONTROLLER, 11, 0.0008, true), (&DRIVER, 8, 0.00127, false), (&MEMORY, 4, 0.00127, false)]
    {
        for pin in 0..count {
            let along = pitch * (f64::from(pin) - f64::from(count - 1) / 2.0);
            for side in [-1.0, 1.0] {
                let leg = |length, width| box_solid(length, width, 0.0007, 0.0001);
                let reach = side * (body.size.1 / 2.0 + 0.0005);
                mesh.append(&moved(leg(0.00042, 0.0012), body.at.0 + along, body.at.1 + reach, TOP));
                if all_sides {
                    let reach = side * (body.size.0 / 2.0 + 0.0005);
                    mesh.append(&moved(leg(0.0012, 0.00042), body.at.0 + reach, body.at.1 + along, TOP));
                }
            }
        }
    }
    mesh
}

/// A pan head with a recess.
fn screw_head() -> TriangleMesh {
    let mut mesh = lathe(
        &[
            (0.0, 0.0),
            (0.0028, 0.0),
            (0.0028, 0.0010),
            (0.0024, 0.0015),
            (0.0014, 0.0019),
            (0.0012, 0.0012),
            (0.0, 0.0012),
        ],
        28,
    );
    // A bar divides the recess.
    let bar = box_solid(0.0036, 0.0006, 0.0019, 0.0002);
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), FRAC_PI_2 / 2.0);
    mesh.append(&bar.transformed(&Isometry3::from_parts(Translation3::identity(), turn)));
    mesh
}

/// The top of a capacitor: aluminium scored with a cross.
fn scored_lid() -> Texture {
    Texture::paint(48, |u, v| {
        let (x, y) = (u - 0.5, v - 0.5);
        let scored = x.abs().min(y.abs()) < 0.03;
        let shade = if scored { 0.45 } else { 0.74 + 0.05 * (9.0 * (x + y)).sin() };
        [shade, shade, shade * 1.01]
    })
}

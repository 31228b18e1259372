//! Printed lever of the Cranfield assembly: a hub with a steel bushing, an arm, a heavy bob with a brass slug.

use nalgebra::{Isometry3, Point2};
use sdg_simulation::objects::RotationalSymmetry;
use sdg_simulation::shapes::mesh::TriangleMesh;
use sdg_simulation::shapes::solids::{circle, cylinder, extrude, lever_outline, ring};
use sdg_simulation::shapes::texture::Texture;

use crate::part::{BRASS, Finish, PRINTED, Part, Piece, STEEL, centred_texture, moved};

/// The part.
pub fn pendulum() -> Part {
    let (hub, bob) = ((-0.070, 0.0155), (0.044, 0.027));
    let arm_width = 0.016;
    let body = extrude(
        &lever_outline(hub, bob, arm_width, 0.009),
        &[circle(Point2::new(hub.0, 0.0), 0.008, 32), circle(Point2::new(bob.0, 0.0), 0.009, 32)],
        0.016,
        0.0012,
    )
    .textured_from_above(0.04);
    let printed = |mesh: TriangleMesh| mesh.textured_from_above(0.04);
    let mut raised = printed(moved(ring(0.008, 0.0132, 0.007, 0.0008, 40), hub.0, 0.0, 0.0155));
    raised.append(&printed(moved(ring(0.0165, 0.0245, 0.0045, 0.0010, 56), bob.0, 0.0, 0.0155)));
    let pointer = [Point2::new(0.0685, -0.0075), Point2::new(0.081, 0.0), Point2::new(0.0685, 0.0075)];
    raised.append(&printed(extrude(&pointer, &[], 0.010, 0.0010)));
    Part {
        name: "pendulum",
        title: "Pendulum",
        description: "Pendulum after the Cranfield assembly benchmark: printed lever, 166 mm long, with a bushed hub, \
                      a bob weighted by a brass slug, and a pointer",
        pieces: vec![
            Piece { name: "body", mesh: body, density: PRINTED, material: "printed" },
            Piece { name: "raised", mesh: raised, density: PRINTED, material: "printed" },
            Piece {
                name: "bushing",
                mesh: centred_texture(ring(0.006, 0.0082, 0.0238, 0.0006, 32), 0.02)
                    .transformed(&Isometry3::translation(hub.0, 0.0, 0.0)),
                density: STEEL,
                material: "steel",
            },
            Piece {
                name: "slug",
                mesh: centred_texture(cylinder(0.0091, 0.0172, 0.0007, 32), 0.02)
                    .transformed(&Isometry3::translation(bob.0, 0.0, 0.0)),
                density: BRASS,
                material: "brass",
            },
        ],
        finishes: vec![
            Finish {
                name: "printed",
                texture: Texture::printed(256, [0.86, 0.40, 0.13], 26.0, 11),
                specular: 0.15,
                shininess: 0.2,
            },
            Finish {
                name: "steel",
                texture: Texture::turned(64, [0.68, 0.69, 0.71], 0.18, 12),
                specular: 0.6,
                shininess: 0.5,
            },
            Finish {
                name: "brass",
                texture: Texture::turned(64, [0.80, 0.64, 0.32], 0.16, 13),
                specular: 0.5,
                shininess: 0.5,
            },
        ],
        collisions: vec![
            format!("type=\"box\" pos=\"-0.013 0 0.008\" size=\"0.050 {} 0.008\"", arm_width / 2.0),
            format!("type=\"cylinder\" pos=\"{} 0 0.01125\" size=\"{} 0.01125\"", hub.0, hub.1),
            format!("type=\"cylinder\" pos=\"{} 0 0.010\" size=\"{} 0.010\"", bob.0, bob.1),
        ],
        grasp_half_line: 0.024,
        jaw_width: arm_width,
        grasp_height: 0.009,
        mark_height: 0.016,
        seen_height: 0.016,
        friction: 0.6,
        symmetry: RotationalSymmetry::None,
    }
}

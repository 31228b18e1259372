//! Spring clip bent of one strip of sheet steel: upper leaf with a bead and a vinyl-covered lip, lower leaf with a tab
//! for screws.

use nalgebra::{Point2, Point3, Translation3, UnitQuaternion, Vector3};
use sdg_simulation::objects::RotationalSymmetry;
use sdg_simulation::shapes::mesh::TriangleMesh;
use sdg_simulation::shapes::solids::{circle, cylinder, extrude, ring, rounded_path, rounded_rectangle};
use sdg_simulation::shapes::texture::{Noise, Texture};

use crate::part::{BRASS, Finish, Part, Piece, RUBBER, STEEL, box_between, centred_texture};
use crate::print::{Lettering, plan_texture};
use crate::shapes::{bent_strip, resampled, rounded_polygon};

const SHEET: f64 = 0.0015;
const HALF_WIDTH: f64 = 0.0110;
/// The nip, as a point (x, z) of the strip's centre line.
const NIP: (f64, f64) = (0.0240, 0.0042);
/// Edge of the lip, as a point (x, z) of the strip's centre line.
const LIP: (f64, f64) = (0.0360, 0.0090);
const BACK: f64 = -0.0420;
const BACK_HEIGHT: f64 = 0.0128;
/// x of the start and of the end of the tab with the holes.
const TAB_START: f64 = 0.0240;
const TAB_END: f64 = 0.0530;
const SPAN: f64 = 0.10;

/// The part.
pub fn spring_clip() -> Part {
    let corner = |x: f64, z: f64| Point3::new(x, 0.0, z);
    let flat = |path: Vec<Point3<f64>>| -> Vec<Point2<f64>> { path.iter().map(|p| Point2::new(p.x, p.z)).collect() };
    // The back is round, because the arcs of its corners meet at its centre.
    let back = flat(rounded_path(
        &[
            corner(TAB_START, SHEET / 2.0),
            corner(BACK, SHEET / 2.0),
            corner(BACK, BACK_HEIGHT),
            corner(-0.0300, leaf_height(-0.0300)),
        ],
        0.0050,
        10,
    ));
    let upper = flat(rounded_path(
        &[corner(-0.0300, leaf_height(-0.0300)), corner(NIP.0, NIP.1), corner(LIP.0, LIP.1)],
        0.0060,
        8,
    ));
    let upper = resampled(&upper, 0.0015);
    let length: f64 = upper.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    let leaf = bent_strip(&upper, SHEET, |along| HALF_WIDTH.min(lip_half_width(length - along)));
    let lip: Vec<_> = upper.iter().copied().filter(|point| point.x > 0.0265).collect();
    let lip_length: f64 = lip.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    let cover = bent_strip(&lip, SHEET + 0.0014, |along| HALF_WIDTH.min(lip_half_width(lip_length - along)) + 0.0007);

    let tab_outline = rounded_polygon(&[
        (TAB_START, -HALF_WIDTH, 0.0),
        (0.0430, -HALF_WIDTH, 0.0060),
        (TAB_END, -0.0070, 0.0050),
        (TAB_END, 0.0070, 0.0050),
        (0.0430, HALF_WIDTH, 0.0060),
        (TAB_START, HALF_WIDTH, 0.0),
    ]);
    let holes = [circle(Point2::new(0.0450, 0.0045), 0.0023, 24), circle(Point2::new(0.0450, -0.0045), 0.0023, 24)];
    let mut lower = bent_strip(&resampled(&back, 0.0040), SHEET, |_| HALF_WIDTH);
    lower.append(&extrude(&tab_outline, &holes, SHEET, 0.0002));

    // Bead, rivet and washer follow the leaf's slope.
    let on_leaf = |mesh: TriangleMesh, x: f64, sunk: f64| {
        let tilt = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -leaf_slope().atan());
        let place = Translation3::new(x, 0.0, leaf_height(x) + SHEET / 2.0 - sunk);
        mesh.transformed(&nalgebra::Isometry3::from_parts(place, tilt))
    };
    let mut bead = on_leaf(extrude(&rounded_rectangle(0.0260, 0.0056, 0.0026), &[], 0.0014, 0.0011), 0.0010, 0.0003);
    bead.append(&on_leaf(ring(0.0027, 0.0048, 0.0010, 0.0003, 32), -0.0245, 0.0003));
    let rivet = on_leaf(centred_texture(cylinder(0.0030, 0.0018, 0.0006, 28), 0.008), -0.0245, 0.0003);

    let leaf_length = (NIP.0 + 0.0320).hypot(leaf_height(-0.0320) - NIP.1);
    let middle = (NIP.0 - 0.0320) / 2.0;
    let half_turn = -leaf_slope().atan() / 2.0;
    Part {
        name: "spring_clip",
        title: "Spring clip",
        description: "Spring clip, 95 by 22 by 14 mm, bent of 1.5 mm spring steel: upper leaf with a bead, a brass rivet and \
                      a vinyl-covered lip, lower leaf with a tab and two screw holes",
        pieces: vec![
            Piece { name: "leaf", mesh: centred_texture(leaf, SPAN), density: STEEL, material: "leaf" },
            Piece { name: "lower", mesh: lower.textured_from_above(0.05), density: STEEL, material: "steel" },
            Piece { name: "bead", mesh: bead.textured_from_above(0.05), density: STEEL * 0.1, material: "steel" },
            Piece { name: "rivet", mesh: rivet, density: BRASS, material: "brass" },
            Piece { name: "cover", mesh: cover.textured_from_above(0.04), density: RUBBER, material: "vinyl" },
        ],
        finishes: vec![
            Finish { name: "leaf", texture: stamped_steel(), specular: 0.45, shininess: 0.45 },
            Finish {
                name: "steel",
                texture: Texture::brushed(96, [0.55, 0.56, 0.58], 0.12, 152),
                specular: 0.45,
                shininess: 0.45,
            },
            Finish {
                name: "brass",
                texture: Texture::turned(32, [0.80, 0.64, 0.32], 0.16, 153),
                specular: 0.5,
                shininess: 0.5,
            },
            Finish {
                name: "vinyl",
                texture: Texture::grained(64, [0.86, 0.62, 0.08], 0.05, 154),
                specular: 0.3,
                shininess: 0.3,
            },
        ],
        collisions: vec![
            box_between([BACK, -HALF_WIDTH, 0.0], [TAB_END - 0.0010, HALF_WIDTH, SHEET]),
            box_between([BACK - 0.0007, -HALF_WIDTH, 0.0], [BACK + 0.0030, HALF_WIDTH, 0.0130]),
            box_between([BACK, -HALF_WIDTH, 0.0115], [-0.0310, HALF_WIDTH, 0.0135]),
            format!(
                "type=\"box\" pos=\"{middle:.5} 0 {:.5}\" size=\"{:.5} {HALF_WIDTH} {:.5}\" quat=\"{:.6} 0 {:.6} 0\"",
                leaf_height(middle),
                leaf_length / 2.0,
                SHEET / 2.0,
                half_turn.cos(),
                half_turn.sin()
            ),
            box_between([NIP.0, -HALF_WIDTH, NIP.1], [LIP.0, HALF_WIDTH, LIP.1]),
        ],
        grasp_half_line: 0.018,
        jaw_width: 2.0 * HALF_WIDTH,
        grasp_height: 0.0070,
        mark_height: leaf_height(0.0) + SHEET / 2.0,
        seen_height: leaf_height(0.0) + SHEET / 2.0,
        friction: 0.6,
        symmetry: RotationalSymmetry::None,
    }
}

/// z over x of the upper leaf between back and nip.
fn leaf_slope() -> f64 {
    (NIP.1 - BACK_HEIGHT) / (NIP.0 - BACK)
}

/// Height of the upper leaf's centre line at a position x along it.
fn leaf_height(x: f64) -> f64 {
    NIP.1 + leaf_slope() * (x - NIP.0)
}

/// Half the width of the rounded lip at a distance from its edge.
fn lip_half_width(from_edge: f64) -> f64 {
    const CORNER: f64 = 0.0060;
    let inside = (CORNER - from_edge).max(0.0);
    HALF_WIDTH - CORNER + (CORNER * CORNER - inside * inside).max(0.0).sqrt()
}

/// Rolled steel with letters etched beside the bead, drawn to scale.
fn stamped_steel() -> Texture {
    let lines = Noise::new_stretched(8, 320, 151);
    let broad = Noise::new(6, 155);
    let etched = [Lettering::level("SDG 24", 6.0, -7.0, 2.6), Lettering::level("INOX", 8.0, 7.0, 2.2)];
    plan_texture(384, SPAN, |place| {
        let (u, v) = (place.x / SPAN, place.y / SPAN);
        let shade = 0.57 * (1.0 + 0.09 * lines.at(u, v) + 0.06 * broad.fractal(u, v, 2));
        let shade = if etched.iter().any(|text| text.covers(place)) { 0.5 * shade } else { shade };
        [shade, shade * 1.01, shade * 1.04]
    })
}

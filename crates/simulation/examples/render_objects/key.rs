//! Key with a moulded bow: bitted and grooved blade of nickel-plated brass, emblem and grip ribs on the bow.

use nalgebra::Point2;
use sdg_simulation::objects::RotationalSymmetry;
use sdg_simulation::shapes::mesh::TriangleMesh;
use sdg_simulation::shapes::solids::{cylinder, extrude, rounded_rectangle};
use sdg_simulation::shapes::texture::Texture;

use crate::part::{BRASS, Finish, PLASTIC, Part, Piece, box_between, centred_texture, moved};
use crate::print::{Lettering, plan_texture};
use crate::shapes::rounded_polygon;

const BOW_HEIGHT: f64 = 0.0092;
const BOW_HALF_WIDTH: f64 = 0.0140;
/// x of the blade's start and tip.
const BLADE_START: f64 = 0.0195;
const BLADE_TIP: f64 = 0.0545;
const BLADE_HALF_WIDTH: f64 = 0.0043;
/// Heights of the blade's underside, of the floor of its grooves, and of its top.
const BLADE_HEIGHTS: [f64; 3] = [0.0034, 0.0049, 0.0058];
/// Cuts of the bitting: depth in metres, from the shoulder to the tip.
const CUTS: [f64; 6] = [0.0012, 0.0028, 0.0016, 0.0030, 0.0008, 0.0022];
const FIRST_CUT: f64 = 0.0255;
const CUT_SPACING: f64 = 0.0042;
const CUT_HALF_FLAT: f64 = 0.0006;
/// Slope of a cut's flanks.
const CUT_SLOPE: f64 = 1.15;
const EMBLEM: (f64, f64) = (-0.0040, 0.0078);

/// The part.
pub fn key() -> Part {
    let bow_outline = rounded_polygon(&[
        (-0.0250, -0.0095, 0.0080),
        (-0.0180, -BOW_HALF_WIDTH, 0.0100),
        (0.0120, -BOW_HALF_WIDTH, 0.0060),
        (0.0180, -0.0080, 0.0040),
        (0.0180, 0.0080, 0.0040),
        (0.0120, BOW_HALF_WIDTH, 0.0060),
        (-0.0180, BOW_HALF_WIDTH, 0.0100),
        (-0.0250, 0.0095, 0.0080),
    ]);
    let ring_slot: Vec<_> =
        rounded_rectangle(0.0050, 0.0130, 0.0024).iter().map(|p| p + nalgebra::Vector2::new(-0.0192, 0.0)).collect();
    let bow = extrude(&bow_outline, &[ring_slot], BOW_HEIGHT, 0.0012);
    let mut ribs = TriangleMesh::default();
    for x in [0.0065, 0.0090, 0.0115] {
        let rib = extrude(&rounded_rectangle(0.0013, 0.0150, 0.0006), &[], 0.0009, 0.0003);
        ribs.append(&moved(rib, x, 0.0, BOW_HEIGHT - 0.0003));
    }
    let emblem = centred_texture(cylinder(EMBLEM.1, 0.0010, 0.0003, 40), 0.02);

    let outline = blade_outline();
    let groove = |from: f64, to: f64, low: f64, high: f64| {
        vec![Point2::new(from, low), Point2::new(to, low), Point2::new(to, high), Point2::new(from, high)]
    };
    let grooves = [groove(0.0210, 0.0485, -0.0030, -0.0019), groove(0.0210, 0.0440, -0.0008, 0.0001)];
    let [under, floor, top] = BLADE_HEIGHTS;
    let mut blade = moved(extrude(&outline, &[], floor - under, 0.0), 0.0, 0.0, under);
    blade.append(&moved(extrude(&outline, &grooves, top - floor, 0.0002), 0.0, 0.0, floor));
    let collar = moved(extrude(&rounded_rectangle(0.0050, 0.0122, 0.0010), &[], 0.0038, 0.0005), 0.0185, 0.0, 0.0027);
    blade.append(&collar);

    Part {
        name: "key",
        title: "Key",
        description: "Key with a moulded bow of 43 by 28 by 9 mm: nickel-plated brass blade, 35 mm long, six cuts and two \
                      milled grooves; slot for a ring, emblem, three grip ribs",
        pieces: vec![
            // The density allows for a transponder and the blade's root in the bow.
            Piece { name: "bow", mesh: bow.textured_from_above(0.05), density: 1.3 * PLASTIC, material: "moulded" },
            Piece { name: "ribs", mesh: ribs.textured_from_above(0.05), density: PLASTIC, material: "moulded" },
            Piece {
                name: "emblem",
                mesh: moved(emblem, EMBLEM.0, 0.0, BOW_HEIGHT - 0.0005),
                density: PLASTIC,
                material: "emblem",
            },
            Piece { name: "blade", mesh: blade.textured_from_above(0.03), density: BRASS, material: "nickel" },
        ],
        finishes: vec![
            Finish {
                name: "moulded",
                texture: Texture::grained(96, [0.10, 0.15, 0.27], 0.07, 131),
                specular: 0.35,
                shininess: 0.35,
            },
            Finish { name: "emblem", texture: emblem_texture(), specular: 0.5, shininess: 0.5 },
            Finish {
                name: "nickel",
                texture: Texture::brushed(96, [0.72, 0.71, 0.67], 0.12, 132),
                specular: 0.6,
                shininess: 0.55,
            },
        ],
        collisions: vec![
            box_between([-0.0165, -BOW_HALF_WIDTH, 0.0], [0.0125, BOW_HALF_WIDTH, BOW_HEIGHT]),
            box_between([-0.0248, -0.0105, 0.0], [-0.0165, 0.0105, BOW_HEIGHT]),
            box_between([0.0125, -0.0090, 0.0], [0.0178, 0.0090, BOW_HEIGHT]),
            box_between([0.0178, -BLADE_HALF_WIDTH, under], [0.0530, 0.0030, top]),
        ],
        grasp_half_line: 0.012,
        jaw_width: 2.0 * BOW_HALF_WIDTH,
        grasp_height: 0.0062,
        mark_height: BOW_HEIGHT - 0.0008,
        seen_height: BOW_HEIGHT - 0.0008,
        friction: 0.6,
        symmetry: RotationalSymmetry::None,
    }
}

/// The blade from above, counter-clockwise: straight lower edge, pointed tip, bitting along the upper edge.
fn blade_outline() -> Vec<Point2<f64>> {
    let start = BLADE_START - 0.0025;
    let mut outline = vec![
        Point2::new(start, -BLADE_HALF_WIDTH),
        Point2::new(BLADE_TIP - 0.0035, -BLADE_HALF_WIDTH),
        Point2::new(BLADE_TIP, -0.0012),
        Point2::new(BLADE_TIP, 0.0002),
    ];
    // Corners of the bitting's upper edge, from the tip to the bow.
    const STEP: f64 = 0.0002;
    let last = BLADE_TIP - 0.0032;
    let steps = ((last - start) / STEP).round() as usize;
    outline.extend((0..=steps).map(|step| {
        let x = last - (last - start) * step as f64 / steps as f64;
        Point2::new(x, edge_height(x))
    }));
    without_straight_points(&outline)
}

/// y of the bitted edge at a position x along the blade.
fn edge_height(x: f64) -> f64 {
    CUTS.iter().enumerate().fold(BLADE_HALF_WIDTH, |edge, (idx, depth)| {
        let from_flat = ((x - (FIRST_CUT + CUT_SPACING * idx as f64)).abs() - CUT_HALF_FLAT).max(0.0);
        edge.min(BLADE_HALF_WIDTH - depth + CUT_SLOPE * from_flat)
    })
}

/// The outline without points on straight edges.
fn without_straight_points(outline: &[Point2<f64>]) -> Vec<Point2<f64>> {
    let count = outline.len();
    (0..count)
        .filter(|&idx| {
            let into = (outline[idx] - outline[(idx + count - 1) % count]).normalize();
            let out = (outline[(idx + 1) % count] - outline[idx]).normalize();
            (into.x * out.y - into.y * out.x).abs() > 1e-3
        })
        .map(|idx| outline[idx])
        .collect()
}

/// A bright disc with a dark rim and the maker's letters.
fn emblem_texture() -> Texture {
    let maker = Lettering::level("SDG", 0.0, 1.4, 3.6);
    let number = Lettering::level("7304", 0.0, -3.0, 2.0);
    plan_texture(160, 0.02, |place| {
        let radius = place.coords.norm();
        let ring = (0.0064..0.0069).contains(&radius);
        let inked = maker.covers(place) || number.covers(place) || ring;
        if inked { [0.13, 0.14, 0.17] } else { [0.74, 0.75, 0.76] }
    })
}

//! Deep groove ball bearing 6205: two ground rings, nine balls, a brass cage.

use std::f64::consts::TAU;

use nalgebra::Vector2;
use sdg_simulation::objects::RotationalSymmetry;
use sdg_simulation::shapes::mesh::TriangleMesh;
use sdg_simulation::shapes::solids::{lathe, ring};
use sdg_simulation::shapes::texture::{Noise, Texture};

use crate::part::{BRASS, Finish, Part, Piece, STEEL, centred_texture, moved};

/// Boundary dimensions of ISO 15, in metres.
const OUTER_RADIUS: f64 = 0.026;
const BORE_RADIUS: f64 = 0.0125;
const WIDTH: f64 = 0.015;
const CHAMFER: f64 = 0.0010;

/// Radii of the rings' shoulders, beside the grooves.
const OUTER_SHOULDER: f64 = 0.0222;
const INNER_SHOULDER: f64 = 0.0169;

const NUM_BALLS: u32 = 9;
const PITCH_RADIUS: f64 = 0.01952;
const BALL_RADIUS: f64 = 0.00397;
/// Radius of the grooves, slightly larger than that of the balls.
const GROOVE_RADIUS: f64 = 0.0041;

/// The part.
pub fn ball_bearing() -> Part {
    let middle = WIDTH / 2.0;
    // Offsets along the axis at which the groove's arc is drawn, from one shoulder to the other.
    let groove = |shoulder: f64| {
        let half = (GROOVE_RADIUS.powi(2) - (shoulder - PITCH_RADIUS).powi(2)).sqrt();
        (-4..=4).map(move |step| {
            let z = f64::from(step) / 4.0 * half;
            ((GROOVE_RADIUS.powi(2) - z * z).sqrt(), z)
        })
    };
    let c = CHAMFER;
    let mut outer = vec![
        (OUTER_SHOULDER + 0.0003, 0.0),
        (OUTER_RADIUS - c, 0.0),
        (OUTER_RADIUS, c),
        (OUTER_RADIUS, WIDTH - c),
        (OUTER_RADIUS - c, WIDTH),
        (OUTER_SHOULDER + 0.0003, WIDTH),
        (OUTER_SHOULDER, WIDTH - 0.0003),
    ];
    outer.extend(groove(OUTER_SHOULDER).map(|(depth, z)| (PITCH_RADIUS + depth, middle - z)));
    outer.push((OUTER_SHOULDER, 0.0003));
    let mut inner = vec![(BORE_RADIUS + c, 0.0), (INNER_SHOULDER - 0.0003, 0.0), (INNER_SHOULDER, 0.0003)];
    inner.extend(groove(INNER_SHOULDER).map(|(depth, z)| (PITCH_RADIUS - depth, middle + z)));
    inner.extend([
        (INNER_SHOULDER, WIDTH - 0.0003),
        (INNER_SHOULDER - 0.0003, WIDTH),
        (BORE_RADIUS + c, WIDTH),
        (BORE_RADIUS, WIDTH - c),
        (BORE_RADIUS, c),
    ]);
    let mut rings = lathe(&outer, 72);
    rings.append(&lathe(&inner, 54));

    let half_circle: Vec<(f64, f64)> = (0..=12)
        .map(|step| {
            let angle = TAU * (f64::from(step) / 24.0 - 0.25);
            (if step % 12 == 0 { 0.0 } else { BALL_RADIUS * angle.cos() }, BALL_RADIUS * angle.sin())
        })
        .collect();
    let ball = centred_texture(lathe(&half_circle, 18), 2.0 * BALL_RADIUS);
    let mut balls = TriangleMesh::default();
    for idx in 0..NUM_BALLS {
        let angle = TAU * f64::from(idx) / f64::from(NUM_BALLS);
        let place = Vector2::new(angle.cos(), angle.sin()) * PITCH_RADIUS;
        balls.append(&moved(ball.clone(), place.x, place.y, middle));
    }
    let cage = moved(ring(0.0173, 0.0218, 0.0056, 0.0004, 54), 0.0, 0.0, 0.0032);

    Part {
        name: "ball_bearing",
        title: "Ball bearing",
        description: "Deep groove ball bearing 6205, open: bore 25 mm, 52 mm outside, 15 mm wide, nine balls in a brass cage",
        pieces: vec![
            Piece {
                name: "rings",
                mesh: centred_texture(rings, 2.0 * OUTER_RADIUS),
                density: STEEL,
                material: "ground",
            },
            Piece { name: "balls", mesh: balls, density: STEEL, material: "polished" },
            Piece {
                name: "cage",
                mesh: centred_texture(cage, 2.0 * OUTER_RADIUS),
                density: BRASS * 0.5,
                material: "brass",
            },
        ],
        finishes: vec![
            Finish { name: "ground", texture: concentric([0.73, 0.74, 0.76], 0.10, 61), specular: 0.6, shininess: 0.6 },
            Finish { name: "polished", texture: mirror_ball(), specular: 0.9, shininess: 0.9 },
            Finish { name: "brass", texture: concentric([0.70, 0.52, 0.24], 0.08, 62), specular: 0.4, shininess: 0.4 },
        ],
        collisions: vec![format!("type=\"cylinder\" pos=\"0 0 {middle}\" size=\"{OUTER_RADIUS} {middle}\"")],
        grasp_half_line: 0.016,
        jaw_width: 2.0 * OUTER_RADIUS,
        grasp_height: 0.008,
        mark_height: WIDTH,
        seen_height: WIDTH,
        friction: 0.5,
        symmetry: RotationalSymmetry::Full,
    }
}

/// A face ground in rings, the same in every direction, so that a rotation of the bearing is not visible.
fn concentric(base: [f64; 3], strength: f64, seed: u64) -> Texture {
    let rings = Noise::new_stretched(1, 40, seed);
    Texture::paint(128, |u, v| {
        let radius = (u - 0.5).hypot(v - 0.5);
        let shade = 1.0 + strength * rings.at(0.5, (radius * 1.4).min(0.999));
        base.map(|channel| channel * shade)
    })
}

/// The appearance of a bright ball from above: the lit ceiling in the centre, the dark surroundings at the rim.
fn mirror_ball() -> Texture {
    Texture::paint(32, |u, v| {
        let radius = 2.0 * (u - 0.5).hypot(v - 0.5);
        let ceiling = 1.0 / (1.0 + ((radius - 0.62) * 12.0).exp());
        [0.30, 0.31, 0.33].map(|dark| dark + (0.95 - dark) * ceiling)
    })
}

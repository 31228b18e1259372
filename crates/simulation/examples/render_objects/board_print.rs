//! Print and tracks of the circuit board, and the colours of its plastic components.

use nalgebra::{Point2, Vector2};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use sdg_simulation::shapes::texture::{Color, Noise, Texture};

use crate::board_layout::{
    BUTTON, Block, CANS, CHIPS, CONTROLLER, DRIVER, FIXINGS, HEADER, JACK, LAMPS, LENGTH, MEMORY, MIDDLE_X, OPEN_HOLES,
    RELAY, SPAN, TERMINALS, WIDTH,
};
use crate::print::{Lettering, distance_to_segment, in_rectangle, plan_texture};

const TEXELS: u32 = 512;
const MASK: Color = [0.06, 0.33, 0.17];
const MASK_OVER_COPPER: Color = [0.10, 0.43, 0.22];
const PAD: Color = [0.76, 0.76, 0.72];
const PRINT: Color = [0.90, 0.92, 0.90];
const EDGE: Color = [0.55, 0.55, 0.33];
const BLACK: Color = [0.09, 0.09, 0.10];

/// White print on the board.
const LETTERING: [Lettering; 14] = [
    Lettering::level("SDG IO-4", -9.6, -11.2, 1.8),
    Lettering::level("V1.2", 4.0, -15.2, 1.6),
    Lettering::level("U1", -4.5, 9.3, 1.3),
    Lettering::level("U2", 20.3, 10.0, 1.3),
    Lettering::level("U3", -16.0, 3.9, 1.3),
    Lettering::level("K1", 27.5, -18.2, 1.6),
    Lettering::level("C1", -15.5, -14.0, 1.3),
    Lettering::level("Y1", 12.0, -10.5, 1.3),
    Lettering::level("J1", -8.5, 20.8, 1.6),
    Lettering::level("RST", -30.5, -21.5, 1.5),
    Lettering::level("5-24V DC", 3.0, -22.5, 1.9),
    Lettering { upright: true, ..Lettering::level("NO C NC +", 39.9, -8.5, 1.3) },
    Lettering { upright: true, ..Lettering::level("A B", 39.9, 11.0, 1.3) },
    Lettering::level("PWR TX RX", 33.0, 18.9, 1.1),
];

/// A track: a polyline and half its width.
struct Track {
    corners: Vec<Point2<f64>>,
    half_width: f64,
}

/// Horizontal, diagonal and vertical tracks from points of a grid, with a via at each end.
fn tracks() -> Vec<Track> {
    const GRID: f64 = 0.00127;
    let mut rng = Pcg64Mcg::seed_from_u64(161);
    (0..95)
        .map(|_| {
            let mut step = |range: std::ops::RangeInclusive<i32>| f64::from(rng.random_range(range)) * GRID;
            let start = Point2::new(MIDDLE_X + step(-33..=33), step(-17..=17));
            let (level, slope, upright) = (step(-9..=9), step(-3..=3), step(-5..=5));
            let bend = start + Vector2::new(level, 0.0);
            let after = bend + Vector2::new(slope.abs() * level.signum(), slope);
            let end = after + Vector2::new(0.0, upright.abs() * slope.signum());
            let half_width = if rng.random_bool(0.2) { 0.00045 } else { 0.00018 };
            let inside = |p: Point2<f64>| {
                let (x, y) = (LENGTH / 2.0 - 0.0015, WIDTH / 2.0 - 0.0015);
                Point2::new((p.x - MIDDLE_X).clamp(-x, x) + MIDDLE_X, p.y.clamp(-y, y))
            };
            Track { corners: [start, bend, after, end].map(inside).to_vec(), half_width }
        })
        .collect()
}

/// Whether a point is on the printed line around a rectangle.
fn outlined(place: Point2<f64>, of: &Block, margin: f64) -> bool {
    const STROKE: f64 = 0.0003;
    let grown = |by: f64| in_rectangle(place, of.at, (of.size.0 + 2.0 * by, of.size.1 + 2.0 * by));
    grown(margin) && !grown(margin - STROKE)
}

/// The board's upper side.
pub fn board_texture() -> Texture {
    let tracks = tracks();
    let blotches = Noise::new(9, 164);
    let printed = |place: Point2<f64>| {
        let blocks = [&CONTROLLER, &DRIVER, &MEMORY, &RELAY, &JACK, &HEADER, &BUTTON, &TERMINALS[0], &TERMINALS[1]];
        let margins = [0.0018, 0.0022, 0.0022, 0.0007, 0.0007, 0.0007, 0.0007, 0.0006, 0.0006];
        LETTERING.iter().any(|text| text.covers(place))
            || blocks.iter().zip(margins).any(|(block, margin)| outlined(place, block, margin))
            || CANS
                .iter()
                .any(|&(x, y, radius, _)| (0.0006..0.0009).contains(&((place - Point2::new(x, y)).norm() - radius)))
            || CHIPS.iter().any(|&(x, y, along_y)| {
                let size = if along_y { (0.0022, 0.0034) } else { (0.0034, 0.0022) };
                outlined(place, &Block { at: (x, y), size, height: 0.0 }, 0.0001)
            })
    };
    plan_texture(TEXELS, SPAN, |place| {
        let from_middle = Vector2::new(place.x - MIDDLE_X, place.y);
        let inside = (LENGTH / 2.0 - from_middle.x.abs()).min(WIDTH / 2.0 - from_middle.y.abs());
        if inside < 0.00015 {
            return EDGE;
        }
        let near_ring = |x: f64, y: f64, radius: f64| (place - Point2::new(x, y)).norm() < radius;
        let ringed = FIXINGS.0.iter().any(|&x| near_ring(x, FIXINGS.1, 0.0032) || near_ring(x, -FIXINGS.1, 0.0032))
            || OPEN_HOLES.iter().any(|&(x, y)| near_ring(x, y, 0.0023));
        let under_chip = CHIPS.iter().any(|&(x, y, along_y)| {
            let size = if along_y { (0.0014, 0.0026) } else { (0.0026, 0.0014) };
            in_rectangle(place, (x, y), size)
        });
        let via = |p: &Point2<f64>| (place - p).norm();
        let near_via = tracks
            .iter()
            .flat_map(|track| [&track.corners[0], &track.corners[3]])
            .map(via)
            .fold(f64::INFINITY, f64::min);
        if ringed || under_chip || (0.00022..0.0005).contains(&near_via) {
            return PAD;
        }
        if near_via < 0.00022 {
            return [0.05, 0.08, 0.06];
        }
        if printed(place) {
            return PRINT;
        }
        let on_track = tracks.iter().any(|track| {
            track.corners.windows(2).any(|pair| distance_to_segment(place, pair[0], pair[1]) < track.half_width)
        });
        // A copper plane fills the lower left and the surroundings of the relay.
        let plane = in_rectangle(place, (-0.0260, -0.0080), (0.0280, 0.0240))
            || in_rectangle(place, (0.0270, -0.0080), (0.0230, 0.0210));
        let base = if on_track != plane { MASK_OVER_COPPER } else { MASK };
        let shade = 1.0 + 0.06 * blotches.fractal(place.x / SPAN, place.y / SPAN, 3);
        base.map(|channel| channel * shade)
    })
}

/// The plastic components from above, each in its colour, with the print on them.
pub fn plastics_texture() -> Texture {
    let texts = [
        (Lettering::level("SDG32", 4.0, 3.6, 1.9), [0.62, 0.62, 0.60]),
        (Lettering::level("F103C8", 4.0, 0.4, 1.5), [0.62, 0.62, 0.60]),
        (Lettering::level("ULN2803", 27.5, 10.0, 1.5), [0.62, 0.62, 0.60]),
        (Lettering::level("24C", -16.0, -0.5, 1.4), [0.62, 0.62, 0.60]),
        (Lettering::level("RELAY", 27.5, -3.8, 2.2), PRINT),
        (Lettering::level("SRD-05VDC", 27.5, -7.8, 1.7), PRINT),
        (Lettering::level("10A 250V", 27.5, -11.8, 1.6), PRINT),
    ];
    let grain = Noise::new(60, 165);
    let within = |place: Point2<f64>, block: &Block| {
        in_rectangle(place, block.at, (block.size.0 + 0.0006, block.size.1 + 0.0006))
    };
    plan_texture(TEXELS, SPAN, |place| {
        if let Some((_, ink)) = texts.iter().find(|(text, _)| text.covers(place)) {
            return *ink;
        }
        // The dot beside the controller's first pin.
        if (place - Point2::new(-0.0005, -0.0025)).norm() < 0.0006 {
            return [0.25, 0.25, 0.26];
        }
        let can = CANS.iter().find(|&&(x, y, radius, _)| (place - Point2::new(x, y)).norm() < radius + 0.0003);
        let lamp = LAMPS.iter().position(|&(x, y)| (place - Point2::new(x, y)).norm() < 0.0020);
        let on_button = (place - Point2::new(BUTTON.at.0, BUTTON.at.1)).norm() < 0.0021;
        let base = if within(place, &RELAY) {
            [0.10, 0.25, 0.60]
        } else if TERMINALS.iter().any(|block| within(place, block)) {
            [0.13, 0.52, 0.38]
        } else if let Some(lamp) = lamp {
            [[0.85, 0.16, 0.12], [0.25, 0.75, 0.25], [0.90, 0.75, 0.15]][lamp]
        } else if let Some(&(x, _, radius, _)) = can {
            // The stripe that marks the negative lead.
            if place.x - x > 0.55 * radius { [0.66, 0.68, 0.72] } else { [0.10, 0.12, 0.22] }
        } else if within(place, &BUTTON) && !on_button {
            [0.60, 0.60, 0.62]
        } else if CHIPS.iter().any(|&(x, y, along_y)| along_y && in_rectangle(place, (x, y), (0.0016, 0.0016))) {
            [0.62, 0.50, 0.36]
        } else {
            BLACK
        };
        let shade = 1.0 + 0.06 * grain.at(place.x / SPAN, place.y / SPAN);
        base.map(|channel| channel * shade)
    })
}

//! Turned parts: shafts, screws and spindles lying on their side; rings, flanges, gears and knobs standing up.

use std::f32::consts::{PI, TAU};

use rand_pcg::Pcg64Mcg;

use super::builder::Builder;
use super::construction::Recipe;
use super::feature::{Edge, Operation, Ripple, RippleKind};
use super::material::Material;
use super::shape::Shape;
use crate::random::Draw;

/// Samples a stepped shaft with grooves, threads, flats and cross holes, of one or several materials.
pub(super) fn draw_lying(rng: &mut Pcg64Mcg) -> Recipe {
    let surface = if rng.chance(0.5) { Material::metal(rng) } else { Material::draw(rng) };
    let mut builder = Builder::new(surface);
    let length = rng.log_uniform(30.0, 180.0);
    let largest = (length * rng.uniform(0.05, 0.24)).clamp(2.5, 24.0);
    let num_sections = rng.whole(1, 6);
    let mut cuts: Vec<f32> = (0..num_sections - 1).map(|_| rng.uniform(0.06, 0.94)).collect();
    cuts.extend([0.0, 1.0]);
    cuts.sort_by(f32::total_cmp);
    let axis_z = largest;
    let mut radius = largest * rng.uniform(0.45, 1.0);
    let widest = rng.whole(0, num_sections - 1);
    for (idx, ends) in cuts.windows(2).enumerate() {
        let (from, to) = ((ends[0] - 0.5) * length, (ends[1] - 0.5) * length);
        if to - from < 0.8 {
            continue;
        }
        radius = if idx == widest { largest } else { (radius * rng.uniform(0.5, 1.6)).clamp(0.3 * largest, largest) };
        section(&mut builder, from, to, radius, axis_z, idx > 0, rng);
    }
    for _ in 0..rng.whole(0, 2) {
        builder.next_group();
        let x = rng.uniform(-0.45, 0.45) * length;
        let state = builder.state_at(x, 0.0);
        if state.top > 1.2 * axis_z {
            let r = state.top - axis_z;
            match rng.whole(0, 2) {
                0 => {
                    // A cross hole, deep but not through.
                    let radius = r * rng.uniform(0.2, 0.45);
                    builder.cut(Shape::Disc { radius }, [x, 0.0], 0.0, axis_z - 0.5 * r, 0.3, 0);
                }
                1 => {
                    // A flat or a keyway.
                    let half = [rng.uniform(0.04, 0.12) * length, r * rng.uniform(0.2, 1.1)];
                    let shape = Shape::Rectangle { half, corner: half[0].min(half[1]) * rng.uniform(0.0, 1.0) };
                    builder.cut(shape, [x, 0.0], 0.0, axis_z + r * rng.uniform(0.5, 0.8), 0.0, 0);
                }
                _ => {
                    // A ring of another material: seal, band, sleeve.
                    let material = builder.material(Material::draw(rng));
                    let half = rng.uniform(0.01, 0.05) * length;
                    let bulge = (r * 1.04).min(largest);
                    let profile = vec![[x - half, bulge], [x + half, bulge]];
                    let shape = Shape::Rectangle { half: [half, bulge], corner: 0.0 };
                    builder.push(
                        shape,
                        [0.0; 2],
                        0.0,
                        Operation::Turned { profile, axis_z, ripples: Vec::new() },
                        material,
                    );
                }
            }
        }
    }
    if rng.chance(0.3) {
        // A handle, lug or fitting to one side.
        builder.next_group();
        let material = if rng.chance(0.5) { 0 } else { builder.material(Material::draw(rng)) };
        let x = rng.uniform(-0.4, 0.4) * length;
        let reach = rng.uniform(0.8, 2.5) * largest;
        let half = rng.uniform(0.2, 0.6) * largest;
        let side = rng.sign();
        let points = vec![[x, 0.0, axis_z], [x + rng.uniform(-0.5, 0.5) * reach, side * (largest + reach), axis_z]];
        let end = [points[1][0], points[1][1]];
        builder.push(Shape::Path { points, radius: half }, [0.0; 2], 0.0, Operation::Tube, material);
        if rng.chance(0.5) {
            let radius = half * rng.uniform(1.2, 1.8);
            let edge = Edge { width: radius, drop: radius, round: true };
            builder.add(Shape::Disc { radius }, end, 0.0, axis_z + 0.8 * radius, edge, material);
        }
    }
    builder.finish(rng)
}

/// Adds a cylinder or cone with its cuts.
fn section(builder: &mut Builder, from: f32, to: f32, radius: f32, axis_z: f32, moves: bool, rng: &mut Pcg64Mcg) {
    let material = match rng.whole(0, 5) {
        0 => builder.material(Material::draw(rng)),
        1 => builder.material(Material::polished(rng)),
        _ => 0,
    };
    if moves {
        builder.next_group();
    }
    let (span, chamfer) = (to - from, (0.1 * radius).min(0.2 * (to - from)));
    let end = if rng.chance(0.15) { radius * rng.uniform(0.6, 1.0) } else { radius };
    let profile =
        vec![[from, radius - chamfer], [from + chamfer, radius], [to - chamfer, end], [to, (end - chamfer).max(0.2)]];
    let ripple = |pitch: f32, depth: f32, kind| Ripple { from: from + chamfer, to: to - chamfer, pitch, depth, kind };
    let mut ripples = Vec::new();
    match rng.whole(0, 7) {
        0 | 1 if span > radius => {
            let pitch = (radius * rng.uniform(0.2, 0.4)).clamp(1.0, 3.5);
            ripples.push(ripple(pitch, 0.5 * pitch, RippleKind::Thread));
        }
        2 if radius > 5.0 => {
            let pitch = rng.uniform(1.4, 2.6);
            ripples.push(ripple(pitch, 0.35 * pitch, RippleKind::Knurl));
        }
        3 if span < 3.0 * radius => ripples.push(ripple(1.0, 1.0, RippleKind::Hexagon)),
        4 if span > 1.5 * radius => {
            // Grooves at even distances.
            let pitch = span / rng.whole(2, 6) as f32;
            ripples.push(ripple(pitch, radius * rng.uniform(0.06, 0.2), RippleKind::Knurl));
            if let Some(groove) = ripples.last_mut() {
                *groove = Ripple { pitch: pitch.max(2.0), depth: 0.12 * radius, kind: RippleKind::Thread, ..*groove };
            }
        }
        _ => {}
    }
    let shape = Shape::Rectangle { half: [0.5 * span, radius], corner: 0.0 };
    builder.push(shape, [0.0; 2], 0.0, Operation::Turned { profile, axis_z, ripples }, material);
}

/// Samples a ring, flange, pulley, gear, nut or knob seen from above.
pub(super) fn draw_standing(rng: &mut Pcg64Mcg) -> Recipe {
    let surface = match rng.whole(0, 3) {
        0 | 1 => Material::turned(rng),
        _ => Material::draw(rng),
    };
    let mut builder = Builder::new(surface);
    let inner = builder.material(if rng.chance(0.6) { Material::turned(rng) } else { Material::draw(rng) });
    let radius = rng.log_uniform(10.0, 37.0);
    let mut top = radius * rng.log_uniform(0.08, 0.7);
    let edge = Edge::chamfer(rng.uniform(0.3, 0.08 * radius + 0.4));
    match rng.whole(0, 5) {
        0 => {
            let lobes = rng.whole(5, 36) as u32;
            let depth = (radius * rng.uniform(0.04, 0.12)).min(4.0 * radius / lobes as f32);
            let shape = Shape::Lobed { radius: radius - depth, lobes, depth, steepness: rng.uniform(1.0, 3.0) };
            builder.add(shape, [0.0; 2], 0.0, top, edge, 0);
        }
        1 => {
            let sides = rng.whole(4, 8);
            let vertices = (0..sides)
                .map(|k| (k as f32 / sides as f32 * TAU).sin_cos())
                .map(|(sin, cos)| [radius * cos, radius * sin])
                .collect();
            builder.add(Shape::Polygon { vertices, corner: 0.5 }, [0.0; 2], 0.0, top, edge, 0);
        }
        2 => {
            // A flange with ears.
            let ears = rng.whole(2, 4);
            let hub = radius * rng.uniform(0.5, 0.75);
            builder.add(Shape::Disc { radius: hub }, [0.0; 2], 0.0, top, edge, 0);
            let ear = radius - hub * 0.95;
            for k in 0..ears {
                let angle = k as f32 / ears as f32 * TAU;
                let center = [(radius - ear) * angle.cos(), (radius - ear) * angle.sin()];
                let half = [ear + 0.5, ear];
                builder.add(Shape::Rectangle { half, corner: ear }, center, angle, 0.7 * top, edge, 0);
                builder.cut(Shape::Disc { radius: 0.45 * ear }, center, 0.0, 0.0, 0.4, inner);
            }
        }
        _ => builder.add(Shape::Disc { radius }, [0.0; 2], 0.0, top, edge, 0),
    }
    // Steps towards the middle, up or down.
    let mut step = radius * rng.uniform(0.55, 0.9);
    for _ in 0..rng.whole(0, 3) {
        let material = if rng.chance(0.5) { 0 } else { inner };
        if rng.chance(0.55) {
            top += radius * rng.uniform(0.08, 0.4);
            builder.add(Shape::Disc { radius: step }, [0.0; 2], 0.0, top, Edge::chamfer(0.4), material);
        } else {
            top *= rng.uniform(0.5, 0.9);
            let operation = Operation::Cut { floor: top, chamfer: 0.3, machined: true };
            builder.push(Shape::Disc { radius: step }, [0.0; 2], 0.0, operation, material);
        }
        step *= rng.uniform(0.55, 0.88);
    }
    if rng.chance(0.7) {
        let bore = step * rng.uniform(0.4, 0.95);
        builder.cut(Shape::Disc { radius: bore }, [0.0; 2], 0.0, 0.0, rng.uniform(0.2, 0.8), inner);
        if rng.chance(0.3) {
            builder.next_group();
            let half = [0.35 * bore, 0.22 * bore];
            builder.cut(Shape::Rectangle { half, corner: 0.0 }, [bore, 0.0], 0.0, 0.0, 0.0, inner);
        }
    } else if rng.chance(0.5) {
        let half = [0.8 * step, 0.16 * step];
        builder.next_group();
        builder.cut(Shape::Rectangle { half, corner: 0.0 }, [0.0; 2], 0.0, 0.7 * top, 0.1, inner);
    }
    if rng.chance(0.45) {
        holes_on_circle(&mut builder, radius, inner, rng);
    }
    if rng.chance(0.35) {
        // A pin, set screw or index mark off the axis.
        builder.next_group();
        let mark = builder.material(Material::print(rng));
        let at = radius * rng.uniform(0.5, 0.85);
        let angle = rng.angle();
        let center = [at * angle.cos(), at * angle.sin()];
        if rng.chance(0.5) {
            builder.push(Shape::Disc { radius: 0.07 * radius }, center, 0.0, Operation::Paint, mark);
        } else {
            let under = builder.state_at(center[0], center[1]).top.max(1.0);
            let pin = 0.08 * radius;
            builder.add(Shape::Disc { radius: pin }, center, 0.0, under + pin, Edge::rounded(0.5 * pin), mark);
        }
    }
    if rng.chance(0.15) {
        let ink = builder.material(Material::print(rng));
        builder.next_group();
        builder.print([0.0, 0.7 * radius], 0.0, [0.35 * radius, 0.08 * radius], ink, rng);
    }
    builder.finish(rng)
}

fn holes_on_circle(builder: &mut Builder, radius: f32, material: u8, rng: &mut Pcg64Mcg) {
    let count = rng.whole(2, 8);
    let hole = radius * rng.uniform(0.04, 0.1);
    let circle = radius * rng.uniform(0.55, 0.85);
    let missing = if rng.chance(0.25) { rng.whole(0, count - 1) } else { count };
    for k in (0..count).filter(|&k| k != missing) {
        let angle = k as f32 / count as f32 * 2.0 * PI;
        let center = [circle * angle.cos(), circle * angle.sin()];
        builder.next_group();
        if builder.state_at(center[0], center[1]).is_covered() {
            builder.cut(Shape::Disc { radius: hole }, center, 0.0, 0.0, 0.3, material);
        }
    }
}

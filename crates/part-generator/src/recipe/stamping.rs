//! Flat parts punched out of sheet or plate: holes, slots, windows, notches, embossed ribs, studs, print.

use std::f32::consts::{PI, TAU};

use rand_pcg::Pcg64Mcg;

use super::builder::Builder;
use super::construction::Recipe;
use super::feature::{Edge, Operation};
use super::material::Material;
use super::shape::Shape;
use crate::random::Draw;

/// Samples a stamping.
pub(super) fn draw(rng: &mut Pcg64Mcg) -> Recipe {
    let mut builder = Builder::new(Material::draw(rng));
    let inner = builder.material(Material::metal(rng));
    let size = rng.log_uniform(28.0, 170.0);
    let thickness = rng.log_uniform(0.8, (0.09 * size).max(1.2));
    let edge = Edge::chamfer(rng.uniform(0.08, 0.35) * thickness.min(3.0));
    outline(&mut builder, size, thickness, edge, rng);

    if rng.chance(0.25) {
        bolt_circle(&mut builder, size, inner, rng);
    }
    if rng.chance(0.35) {
        builder.next_group();
        central_hole(&mut builder, size, inner, rng);
    }
    for _ in 0..rng.whole(0, 6) {
        builder.next_group();
        opening(&mut builder, size, thickness, inner, rng);
    }
    if rng.chance(0.3) {
        notch(&mut builder, size, inner, rng);
    }
    for _ in 0..rng.whole(0, 2) {
        if rng.chance(0.5) {
            builder.next_group();
            emboss(&mut builder, size, thickness, rng);
        }
    }
    if rng.chance(0.25) {
        builder.next_group();
        stud(&mut builder, size, thickness, rng);
    }
    if rng.chance(0.3) {
        let ink = builder.material(Material::print(rng));
        let half = [rng.uniform(0.08, 0.2) * size, rng.uniform(0.03, 0.07) * size];
        if let Some(center) = builder.room(half[0], rng) {
            builder.next_group();
            let turn = rng.whole(0, 3) as f32 * 0.5 * PI;
            builder.print(center, turn, half, ink, rng);
        }
    }
    builder.finish(rng)
}

/// Adds the blank, from which everything else is cut.
fn outline(builder: &mut Builder, size: f32, top: f32, edge: Edge, rng: &mut Pcg64Mcg) {
    let mut add = |shape: Shape, center: [f32; 2], turn: f32| builder.add(shape, center, turn, top, edge, 0);
    let half = 0.5 * size;
    match rng.whole(0, 8) {
        0 => {
            let short = half * rng.uniform(0.18, 0.9);
            add(Shape::Rectangle { half: [half, short], corner: short * rng.uniform(0.02, 1.0) }, [0.0; 2], 0.0);
        }
        1 => {
            // An uneven polygon.
            let corners = rng.whole(3, 7);
            let flat = rng.uniform(0.5, 1.0);
            let vertices = (0..corners)
                .map(|k| {
                    let angle = (k as f32 + rng.uniform(-0.3, 0.3)) / corners as f32 * TAU;
                    let radius = half * rng.uniform(0.55, 1.0);
                    [radius * angle.cos(), flat * radius * angle.sin()]
                })
                .collect();
            add(Shape::Polygon { vertices, corner: half * rng.uniform(0.02, 0.15) }, [0.0; 2], 0.0);
        }
        2 => add(Shape::Disc { radius: (0.5 * half).clamp(12.0, 38.0) }, [0.0; 2], 0.0),
        3 => {
            // A lever: two eyes joined by a web, sometimes with an arm.
            let (r0, r1) = (half * rng.uniform(0.16, 0.34), half * rng.uniform(0.12, 0.3));
            let bend = rng.uniform(-0.5, 0.5) * half;
            let ends = [[-half + r0, 0.0], [half - r1, bend]];
            add(Shape::Disc { radius: r0 }, ends[0], 0.0);
            add(Shape::Disc { radius: r1 }, ends[1], 0.0);
            let (dx, dy) = (ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]);
            let norm = dx.hypot(dy).max(1.0);
            let share = rng.uniform(0.6, 0.98);
            let (nx, ny) = (-dy / norm * share, dx / norm * share);
            let vertices = vec![
                [ends[0][0] + nx * r0, ends[0][1] + ny * r0],
                [ends[1][0] + nx * r1, ends[1][1] + ny * r1],
                [ends[1][0] - nx * r1, ends[1][1] - ny * r1],
                [ends[0][0] - nx * r0, ends[0][1] - ny * r0],
            ];
            add(Shape::Polygon { vertices, corner: 0.0 }, [0.0; 2], 0.0);
            if rng.chance(0.4) {
                let arm = half * rng.uniform(0.3, 0.6);
                let turn = rng.sign() * rng.uniform(0.8, 1.5);
                let center = [ends[0][0] + 0.5 * arm * turn.cos(), ends[0][1] + 0.5 * arm * turn.sin()];
                let short = r0 * rng.uniform(0.4, 0.8);
                add(Shape::Rectangle { half: [0.5 * arm + short, short], corner: short }, center, turn);
            }
        }
        4 => {
            // L, T, U and plus out of bars.
            let bar = half * rng.uniform(0.16, 0.34);
            let corner = bar * rng.uniform(0.02, 0.4);
            add(Shape::Rectangle { half: [half, bar], corner }, [0.0; 2], 0.0);
            for _ in 0..rng.whole(1, 3) {
                let reach = half * rng.uniform(0.3, 0.75);
                let x = rng.uniform(-1.0, 1.0) * (half - bar);
                let wide = bar * rng.uniform(0.5, 1.1);
                let side = rng.sign();
                add(Shape::Rectangle { half: [wide, reach], corner }, [x, side * (reach - bar)], 0.0);
            }
        }
        5 => {
            // A sector of a ring.
            let middle = half * rng.uniform(0.6, 0.85);
            let sweep = rng.uniform(1.6, 5.2);
            let points = (0..=20)
                .map(|k| {
                    let angle = sweep * (k as f32 / 20.0 - 0.5);
                    [middle * angle.cos() - 0.5 * middle, middle * angle.sin(), 0.0]
                })
                .collect();
            add(Shape::Path { points, radius: (half - middle).clamp(4.0, 24.0) }, [0.0; 2], 0.0);
            if rng.chance(0.5) {
                let angle = rng.sign() * 0.5 * sweep;
                let center = [middle * angle.cos() - 0.5 * middle, middle * angle.sin()];
                add(Shape::Disc { radius: (half - middle).clamp(4.0, 24.0) * rng.uniform(1.15, 1.5) }, center, 0.0);
            }
        }
        6 => {
            let lobes = rng.whole(3, 24) as u32;
            let radius = half.min(34.0);
            let depth = (radius * rng.uniform(0.03, 0.25)).min(3.5 * radius / lobes as f32);
            add(Shape::Lobed { radius, lobes, depth, steepness: rng.uniform(1.0, 3.0) }, [0.0; 2], 0.0);
        }
        7 => {
            // A strip with ears.
            let short = half * rng.uniform(0.14, 0.3);
            add(Shape::Rectangle { half: [0.8 * half, short], corner: 0.3 * short }, [0.0; 2], 0.0);
            for _ in 0..rng.whole(1, 3) {
                let radius = short * rng.uniform(0.5, 1.1);
                let center = [rng.uniform(-0.8, 0.8) * half, rng.sign() * (short + 0.3 * radius)];
                add(Shape::Disc { radius }, center, 0.0);
            }
        }
        _ => {
            // An uneven quadrilateral with rounded corners.
            let (a, b) = (half * rng.uniform(0.2, 0.7), half * rng.uniform(0.2, 0.7));
            let shift = half * rng.uniform(-0.4, 0.4);
            let vertices = vec![[-half, -a], [half, -b + shift * 0.3], [half * rng.uniform(0.6, 1.0), b], [-half, a]];
            add(Shape::Polygon { vertices, corner: 0.03 * half }, [0.0; 2], 0.0);
        }
    }
}

fn central_hole(builder: &mut Builder, size: f32, material: u8, rng: &mut Pcg64Mcg) {
    let radius = size * rng.uniform(0.05, 0.14);
    if !builder.is_free([0.0; 2], radius * 1.25) {
        return;
    }
    builder.take([0.0; 2], radius * 1.3);
    let chamfer = rng.uniform(0.1, 0.6);
    builder.cut(Shape::Disc { radius }, [0.0; 2], 0.0, 0.0, chamfer, material);
    if rng.chance(0.3) {
        // A keyway.
        let half = [0.4 * radius, 0.25 * radius];
        builder.cut(Shape::Rectangle { half, corner: 0.0 }, [radius, 0.0], 0.0, 0.0, 0.0, material);
    }
}

fn bolt_circle(builder: &mut Builder, size: f32, material: u8, rng: &mut Pcg64Mcg) {
    let count = rng.whole(2, 8);
    let radius = size * rng.uniform(0.012, 0.035);
    let circle = size * rng.uniform(0.12, 0.3);
    let first = rng.whole(0, 1) as f32 * PI / count as f32;
    let centers: Vec<[f32; 2]> = (0..count)
        .map(|k| first + k as f32 / count as f32 * TAU)
        .map(|angle| [circle * angle.cos(), circle * angle.sin()])
        .collect();
    if centers.iter().all(|&center| builder.is_free(center, radius * 1.5)) {
        for center in centers {
            builder.next_group();
            builder.take(center, 1.5 * radius);
            builder.cut(Shape::Disc { radius }, center, 0.0, 0.0, 0.2, material);
        }
    }
}

/// Cuts a hole, a slot, a window or a lobed opening, through the part or as a pocket.
fn opening(builder: &mut Builder, size: f32, thickness: f32, material: u8, rng: &mut Pcg64Mcg) {
    let reach = size * rng.log_uniform(0.02, 0.12);
    let Some(center) = builder.room(reach * 1.2, rng) else { return };
    let turn = if rng.chance(0.6) { rng.whole(0, 3) as f32 * 0.5 * PI } else { rng.angle() };
    let shape = match rng.whole(0, 7) {
        0..=3 => Shape::Disc { radius: reach },
        4 | 5 => {
            let short = reach * rng.uniform(0.2, 0.5);
            Shape::Rectangle { half: [reach, short], corner: short }
        }
        6 => Shape::Rectangle { half: [0.8 * reach, reach * rng.uniform(0.25, 0.6)], corner: 0.05 * reach },
        _ => Shape::Lobed { radius: 0.85 * reach, lobes: rng.whole(3, 6) as u32, depth: 0.15 * reach, steepness: 1.5 },
    };
    let pocket = thickness > 1.5 && rng.chance(0.2);
    let floor = if pocket { thickness * rng.uniform(0.3, 0.7) } else { 0.0 };
    let chamfer = if rng.chance(0.3) { rng.uniform(0.2, 0.45) * thickness.min(4.0) } else { 0.1 };
    builder.cut(shape, center, turn, floor, chamfer, material);
}

/// Cuts from the edge inwards.
fn notch(builder: &mut Builder, size: f32, material: u8, rng: &mut Pcg64Mcg) {
    let b = builder.bounds();
    let reach = size * rng.uniform(0.03, 0.1);
    let (x, y) = (rng.uniform(b[0], b[2]), if rng.chance(0.5) { b[1] } else { b[3] });
    // From the box inwards to the edge of the part.
    let inwards = if y == b[1] { 1.0 } else { -1.0 };
    let step = 0.02 * size;
    let Some(k) = (0..40).find(|&k| builder.state_at(x, y + inwards * k as f32 * step).is_covered()) else { return };
    let center = [x, y + inwards * k as f32 * step];
    builder.next_group();
    let turn = rng.whole(0, 1) as f32 * PI / 4.0;
    let shape = if rng.chance(0.5) {
        Shape::Disc { radius: reach }
    } else {
        Shape::Rectangle { half: [0.6 * reach, reach], corner: 0.1 * reach }
    };
    builder.cut(shape, center, turn, 0.0, 0.1, material);
    builder.take(center, 1.2 * reach);
}

fn emboss(builder: &mut Builder, size: f32, thickness: f32, rng: &mut Pcg64Mcg) {
    let reach = size * rng.uniform(0.05, 0.16);
    let Some(center) = builder.room(reach, rng) else { return };
    let short = reach * rng.uniform(0.2, 0.9);
    let by = rng.uniform(0.5, 1.2) * thickness.min(2.5) * if rng.chance(0.7) { 1.0 } else { -0.5 };
    let shape = Shape::Rectangle { half: [reach, short], corner: 0.9 * short };
    builder.push(shape, center, rng.angle(), Operation::Emboss { by, width: (0.5 * short).max(0.6) }, 0);
}

/// Adds a rivet, stud or welded nut.
fn stud(builder: &mut Builder, size: f32, thickness: f32, rng: &mut Pcg64Mcg) {
    let radius = (size * rng.uniform(0.025, 0.07)).clamp(1.5, 7.0);
    let Some(center) = builder.room(radius * 1.2, rng) else { return };
    let material = builder.material(Material::draw(rng));
    let top = thickness + radius * rng.uniform(0.3, 2.0);
    if rng.chance(0.4) {
        let vertices =
            (0..6).map(|k| (k as f32 / 6.0 * TAU).sin_cos()).map(|(sin, cos)| [radius * cos, radius * sin]).collect();
        builder.add(Shape::Polygon { vertices, corner: 0.0 }, center, rng.angle(), top, Edge::chamfer(0.3), material);
        builder.cut(Shape::Disc { radius: 0.5 * radius }, center, 0.0, 0.3 * thickness, 0.3, material);
    } else {
        let edge = Edge { width: radius, drop: (top - thickness).min(radius) * rng.uniform(0.2, 0.9), round: true };
        builder.add(Shape::Disc { radius }, center, 0.0, top, edge, material);
    }
}

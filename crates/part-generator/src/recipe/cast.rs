//! Cast and moulded parts: bodies grown together with fillets, bosses, ribs, machined seats, labels, screws.

use std::f32::consts::{PI, TAU};

use rand_pcg::Pcg64Mcg;

use super::builder::Builder;
use super::construction::Recipe;
use super::feature::{Edge, Operation};
use super::material::Material;
use super::shape::Shape;
use crate::random::Draw;

/// Samples a casting.
pub(super) fn draw_cast(rng: &mut Pcg64Mcg) -> Recipe {
    let surface = match rng.whole(0, 4) {
        0..=2 => Material::cast(rng),
        3 => Material::painted(rng),
        _ => Material::black(rng),
    };
    let mut builder = Builder::new(surface);
    let machined = builder.material(Material::turned(rng));
    let size = rng.log_uniform(40.0, 150.0);
    let base = size * rng.uniform(0.06, 0.16);
    let draft = Edge { width: 0.25 * base, drop: 0.25 * base, round: true };
    let fillet = size * rng.uniform(0.02, 0.05);
    let blend = |top: f32, edge: Edge| Operation::Blend { top, edge, fillet };

    // The body: two to four masses along a bent spine.
    let masses = rng.whole(2, 4);
    let mut centers: Vec<[f32; 2]> = Vec::new();
    for k in 0..masses {
        let x = size * (k as f32 / (masses - 1) as f32 - 0.5) * 0.7;
        let center = [x, size * rng.uniform(-0.16, 0.16)];
        let reach = size * rng.uniform(0.12, 0.24);
        let shape = if rng.chance(0.5) {
            Shape::Disc { radius: reach }
        } else {
            let half = [reach, reach * rng.uniform(0.6, 1.2)];
            Shape::Rectangle { half, corner: 0.3 * reach.min(half[1]) }
        };
        let turn = if rng.chance(0.6) { 0.0 } else { rng.angle() };
        builder.push(shape, center, turn, blend(base * rng.uniform(0.7, 1.3), draft), 0);
        if let Some(last) = centers.last() {
            let (dx, dy) = (center[0] - last[0], center[1] - last[1]);
            let half = [0.5 * dx.hypot(dy), size * rng.uniform(0.06, 0.14)];
            let middle = [0.5 * (center[0] + last[0]), 0.5 * (center[1] + last[1])];
            let shape = Shape::Rectangle { half, corner: 0.0 };
            builder.push(shape, middle, dy.atan2(dx), blend(base * rng.uniform(0.6, 1.0), draft), 0);
        }
        centers.push(center);
    }
    // Ribs between the masses.
    for ends in centers.windows(2) {
        if rng.chance(0.6) {
            let (dx, dy) = (ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]);
            let half = [0.5 * dx.hypot(dy), (0.25 * base).max(1.0)];
            let middle = [0.5 * (ends[0][0] + ends[1][0]), 0.5 * (ends[0][1] + ends[1][1])];
            let edge = Edge::rounded(0.7 * half[1]);
            let top = base * rng.uniform(1.3, 2.0);
            builder.push(Shape::Rectangle { half, corner: half[1] }, middle, dy.atan2(dx), blend(top, edge), 0);
        }
    }
    // Bosses with machined, often bored, tops.
    for &center in &centers {
        if !rng.chance(0.75) {
            continue;
        }
        builder.next_group();
        let radius = size * rng.uniform(0.05, 0.12);
        let top = base * rng.uniform(1.2, 2.6);
        let edge = Edge { width: 0.2 * radius, drop: 0.15 * radius, round: true };
        builder.push(Shape::Disc { radius }, center, 0.0, blend(top, edge), 0);
        if rng.chance(0.7) {
            let operation = Operation::Cut { floor: 0.95 * top, chamfer: 0.0, machined: true };
            builder.push(Shape::Disc { radius: 0.85 * radius }, center, 0.0, operation, machined);
        }
        if rng.chance(0.7) {
            let floor = if rng.chance(0.6) { 0.0 } else { 0.4 * top };
            let bore = radius * rng.uniform(0.35, 0.65);
            builder.cut(Shape::Disc { radius: bore }, center, 0.0, floor, 0.08 * radius, machined);
        }
        builder.take(center, radius);
    }
    // Lugs with bolt holes.
    let b = builder.bounds();
    for _ in 0..rng.whole(0, 4) {
        builder.next_group();
        let radius = size * rng.uniform(0.04, 0.075);
        let center = [rng.uniform(b[0], b[2]) * 0.85, rng.uniform(b[1], b[3])];
        let near = (0..12).any(|k| {
            let (sin, cos) = (k as f32 / 12.0 * TAU).sin_cos();
            builder.state_at(center[0] + 0.8 * radius * cos, center[1] + 0.8 * radius * sin).is_covered()
        });
        if !near {
            continue;
        }
        builder.push(Shape::Disc { radius }, center, 0.0, blend(0.6 * base, Edge::rounded(0.2 * base)), 0);
        builder.cut(Shape::Disc { radius: 0.5 * radius }, center, 0.0, 0.0, 0.1 * radius, machined);
        builder.take(center, radius);
    }
    if rng.chance(0.35) {
        // A ground face.
        builder.next_group();
        let half = [size * rng.uniform(0.08, 0.2), size * rng.uniform(0.04, 0.1)];
        let operation = Operation::Cut { floor: 0.8 * base, chamfer: 0.0, machined: true };
        let center = [rng.uniform(-0.3, 0.3) * size, rng.uniform(-0.1, 0.1) * size];
        builder.push(Shape::Rectangle { half, corner: 0.1 * half[1] }, center, 0.0, operation, machined);
    }
    builder.finish(rng)
}

/// Samples a moulded body: a box, grip or cap with recesses, ribs, inserts, screws and print.
pub(super) fn draw_moulded(rng: &mut Pcg64Mcg) -> Recipe {
    let surface = if rng.chance(0.35) { Material::black(rng) } else { Material::plastic(rng) };
    let mut builder = Builder::new(surface);
    let second = builder.material(Material::draw(rng));
    let size = rng.log_uniform(30.0, 140.0);
    let (half_x, half_y) = (0.5 * size, 0.5 * size * rng.uniform(0.22, 0.7));
    let top = size * rng.uniform(0.06, 0.22);
    let round = Edge::rounded((0.35 * top).min(0.3 * half_y));
    match rng.whole(0, 3) {
        0 => {
            let corner = half_y * rng.uniform(0.1, 1.0);
            builder.add(Shape::Rectangle { half: [half_x, half_y], corner }, [0.0; 2], 0.0, top, round, 0);
        }
        1 => {
            // A handle that widens.
            let wide = half_y * rng.uniform(0.4, 0.9);
            let waist = rng.uniform(-0.3, 0.3) * half_x;
            let vertices = vec![
                [-half_x, -wide],
                [waist, -half_y],
                [half_x, -0.6 * wide],
                [half_x, 0.6 * wide],
                [waist, half_y * rng.uniform(0.6, 1.0)],
                [-half_x, wide],
            ];
            builder.add(Shape::Polygon { vertices, corner: 0.12 * half_y }, [0.0; 2], 0.0, top, round, 0);
        }
        2 => {
            // A bent arm: a thick path with rounded edges.
            let knee = [rng.uniform(-0.3, 0.3) * half_x, rng.uniform(-1.0, 1.0) * half_y, 0.0];
            let points = vec![[-half_x, 0.0, 0.0], knee, [half_x, rng.uniform(-1.0, 1.0) * half_y, 0.0]];
            let radius = size * rng.uniform(0.06, 0.13);
            builder.add(Shape::Path { points, radius }, [0.0; 2], 0.0, top, round, 0);
            builder.add(Shape::Disc { radius: 1.4 * radius }, [-half_x, 0.0], 0.0, 1.15 * top, round, 0);
        }
        _ => {
            // A box with a socket or plug at one end.
            let corner = 0.15 * half_y;
            builder.add(Shape::Rectangle { half: [0.7 * half_x, half_y], corner }, [0.0; 2], 0.0, top, round, 0);
            let half = [0.25 * half_x, half_y * rng.uniform(0.4, 0.85)];
            let center = [0.8 * half_x, half_y * rng.uniform(-0.3, 0.3)];
            let edge = Edge::chamfer(0.05 * top);
            builder.add(Shape::Rectangle { half, corner: 0.0 }, center, 0.0, top * rng.uniform(0.6, 1.2), edge, second);
        }
    }
    if rng.chance(0.45) {
        // A tray: the middle is recessed, except for ribs.
        builder.next_group();
        let floor = top * rng.uniform(0.2, 0.7);
        let half = [half_x * rng.uniform(0.3, 0.6), half_y * rng.uniform(0.4, 0.7)];
        let center = [half_x * rng.uniform(-0.2, 0.2), 0.0];
        builder.cut(Shape::Rectangle { half, corner: 0.15 * half[1] }, center, 0.0, floor, 0.3, 0);
        for _ in 0..rng.whole(0, 3) {
            builder.next_group();
            let x = center[0] + rng.uniform(-0.8, 0.8) * half[0];
            let rib = Shape::Rectangle { half: [(0.02 * size).max(0.7), half[1]], corner: 0.0 };
            builder.add(rib, [x, 0.0], 0.0, top * rng.uniform(0.6, 0.95), Edge::SHARP, 0);
        }
        builder.take(center, half[1]);
    }
    if rng.chance(0.4) {
        // Grip grooves.
        builder.next_group();
        let count = rng.whole(3, 8);
        let pitch = size * rng.uniform(0.025, 0.05);
        let x = rng.uniform(-0.3, 0.3) * half_x;
        let half = [0.25 * pitch, half_y * rng.uniform(0.4, 1.2)];
        for k in 0..count {
            let center = [x + k as f32 * pitch, 0.0];
            let emboss = Operation::Emboss { by: -0.12 * top, width: 0.2 * pitch };
            builder.push(Shape::Rectangle { half, corner: half[0] }, center, 0.0, emboss, 0);
        }
    }
    for _ in 0..rng.whole(0, 4) {
        builder.next_group();
        screw_or_button(&mut builder, size, top, rng);
    }
    if rng.chance(0.5) {
        let half = [size * rng.uniform(0.06, 0.2), size * rng.uniform(0.03, 0.08)];
        if let Some(center) = builder.room(half[0], rng) {
            builder.next_group();
            let ink = builder.material(Material::print(rng));
            if rng.chance(0.5) {
                let label = builder.material(Material::print(rng));
                let shape = Shape::Rectangle { half: [half[0] * 1.1, half[1] * 1.25], corner: 0.5 };
                builder.push(shape, center, 0.0, Operation::Paint, label);
            }
            builder.print(center, rng.whole(0, 1) as f32 * PI, half, ink, rng);
        }
    }
    builder.finish(rng)
}

fn screw_or_button(builder: &mut Builder, size: f32, top: f32, rng: &mut Pcg64Mcg) {
    let radius = (size * rng.uniform(0.03, 0.08)).max(1.5);
    let Some(center) = builder.room(radius * 1.15, rng) else { return };
    let material = builder.material(Material::draw(rng));
    match rng.whole(0, 2) {
        0 => {
            // A screw sunk into its hole.
            builder.cut(Shape::Disc { radius }, center, 0.0, 0.6 * top, 0.2, 0);
            let head = Edge { width: radius, drop: 0.25 * radius, round: true };
            builder.add(Shape::Disc { radius: 0.85 * radius }, center, 0.0, 0.85 * top, head, material);
            let turn = rng.angle();
            let half = [0.6 * radius, 0.13 * radius];
            for quarter in 0..2 {
                let angle = turn + quarter as f32 * 0.5 * PI;
                builder.cut(Shape::Rectangle { half, corner: 0.0 }, center, angle, 0.7 * top, 0.0, material);
            }
        }
        1 => {
            let edge = Edge::rounded(0.3 * radius);
            let proud = top + radius * rng.uniform(0.15, 0.7);
            if rng.chance(0.5) {
                builder.add(Shape::Disc { radius }, center, 0.0, proud, edge, material);
            } else {
                let half = [0.9 * radius, 0.5 * radius];
                builder.add(Shape::Rectangle { half, corner: 0.2 * radius }, center, 0.0, proud, edge, material);
            }
        }
        _ => builder.cut(Shape::Disc { radius }, center, 0.0, 0.0, 0.3, material),
    }
}

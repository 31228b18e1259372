//! Parts bent from wire, tube and sheet.

use std::f32::consts::PI;

use rand_pcg::Pcg64Mcg;

use super::builder::Builder;
use super::construction::Recipe;
use super::feature::{Edge, Operation};
use super::material::Material;
use super::shape::Shape;
use crate::random::Draw;

/// Minimum radius of a wire as a fraction of the part's size: in a photo, thinner wires break into
/// pieces.
const MIN_WIRE_SHARE: f32 = 0.018;

/// Samples a bent wire or tube with straight legs, eyes, sleeves and fittings, or a coil.
pub(super) fn draw_wire(rng: &mut Pcg64Mcg) -> Recipe {
    let mut builder = Builder::new(Material::draw(rng));
    let size = rng.log_uniform(40.0, 190.0);
    let radius = (size * rng.log_uniform(MIN_WIRE_SHARE, 0.05)).clamp(0.8, 7.0);
    let points = if rng.chance(0.12) { coil(size, radius, rng) } else { bends(size, radius, rng) };
    let ends = [points[0], points[points.len() - 1]];
    let count = points.len();
    builder.push(Shape::Path { points: points.clone(), radius }, [0.0; 2], 0.0, Operation::Tube, 0);
    if rng.chance(0.4) {
        // A sleeve or hose over part of the length.
        builder.next_group();
        let material = builder.material(Material::draw(rng));
        let from = rng.whole(0, count.saturating_sub(3));
        let to = (from + rng.whole(1, (count / 3).max(1))).min(count - 1);
        let wider = radius * rng.uniform(1.1, 1.5);
        let sleeve: Vec<[f32; 3]> = points[from..=to].iter().map(|p| [p[0], p[1], p[2] + wider - radius]).collect();
        builder.push(Shape::Path { points: sleeve, radius: wider }, [0.0; 2], 0.0, Operation::Tube, material);
    }
    for (idx, end) in ends.into_iter().enumerate() {
        if !rng.chance(0.45) {
            continue;
        }
        builder.next_group();
        let material = if rng.chance(0.5) { 0 } else { builder.material(Material::draw(rng)) };
        let next = if idx == 0 { points[1] } else { points[count - 2] };
        let turn = (end[1] - next[1]).atan2(end[0] - next[0]);
        let wide = radius * rng.uniform(1.6, 2.8);
        match rng.whole(0, 2) {
            0 => {
                // A flattened eye.
                let center = [end[0] + 0.7 * wide * turn.cos(), end[1] + 0.7 * wide * turn.sin()];
                builder.add(Shape::Disc { radius: wide }, center, 0.0, radius * 1.1, Edge::rounded(0.3), material);
                builder.cut(Shape::Disc { radius: 0.55 * wide }, center, 0.0, 0.0, 0.2, material);
            }
            1 => {
                // A nut or ferrule.
                let half = [wide * rng.uniform(0.6, 1.4), wide];
                let edge = Edge { width: wide * 0.5, drop: wide * 0.4, round: false };
                let center = [end[0], end[1]];
                builder.add(Shape::Rectangle { half, corner: 0.0 }, center, turn, radius + wide * 0.87, edge, material);
            }
            _ => {
                let edge = Edge { width: wide, drop: wide, round: true };
                builder.add(Shape::Disc { radius: wide }, [end[0], end[1]], 0.0, radius + wide, edge, material);
            }
        }
    }
    builder.finish(rng)
}

/// Centre line of straight legs joined by arcs.
fn bends(size: f32, radius: f32, rng: &mut Pcg64Mcg) -> Vec<[f32; 3]> {
    let num_bends = rng.whole(1, 6);
    let (mut at, mut heading) = ([0.0f32, 0.0f32], 0.0f32);
    let mut points = vec![[at[0], at[1], radius]];
    let mut hand = rng.sign();
    for bend in 0..=num_bends {
        let leg = size * rng.uniform(0.08, 0.5);
        at = [at[0] + leg * heading.cos(), at[1] + leg * heading.sin()];
        points.push([at[0], at[1], radius]);
        if bend == num_bends {
            break;
        }
        let turn = match rng.whole(0, 3) {
            0 => 0.5 * PI,
            1 => 0.25 * PI,
            2 => PI * rng.uniform(0.7, 1.0),
            _ => rng.uniform(0.2, 1.8),
        } * hand;
        if rng.chance(0.6) {
            hand = -hand;
        }
        let bend_radius = (radius * rng.uniform(1.6, 5.0)).max(0.03 * size);
        let steps = ((turn.abs() * 4.0).ceil() as usize).max(2);
        for _ in 0..steps {
            heading += turn / steps as f32;
            let step = bend_radius * turn.abs() / steps as f32;
            at = [at[0] + step * heading.cos(), at[1] + step * heading.sin()];
            points.push([at[0], at[1], radius]);
        }
    }
    lift_crossings(&mut points, radius);
    fit(&mut points, size);
    points
}

/// Raises the line where it approaches an earlier strand.
fn lift_crossings(points: &mut [[f32; 3]], radius: f32) {
    for i in 2..points.len() {
        let clash = (0..i - 1).any(|j| {
            let (a, b, p) = (points[j], points[j + 1], points[i]);
            let (ex, ey) = (b[0] - a[0], b[1] - a[1]);
            let t = (((p[0] - a[0]) * ex + (p[1] - a[1]) * ey) / (ex * ex + ey * ey).max(1e-6)).clamp(0.0, 1.0);
            j + 2 < i && (p[0] - a[0] - ex * t).hypot(p[1] - a[1] - ey * t) < 3.0 * radius
        });
        if clash {
            points[i][2] = 3.0 * radius;
        }
    }
}

/// Centre line of a helical spring lying on its side, with straight ends.
fn coil(size: f32, radius: f32, rng: &mut Pcg64Mcg) -> Vec<[f32; 3]> {
    let turns = rng.whole(3, 8);
    let wire = radius.min(0.03 * size);
    let (length, across) = (0.6 * size, size * rng.uniform(0.08, 0.16));
    let mut points = vec![[-0.5 * size, 0.0, wire + across]];
    for k in 0..=turns * 10 {
        let t = k as f32 / (turns * 10) as f32;
        let phase = t * turns as f32 * 2.0 * PI;
        points.push([length * (t - 0.5), across * phase.sin(), wire + across * (1.0 + phase.cos())]);
    }
    points.push([0.5 * size, 0.0, wire + across]);
    points
}

/// Centres the line and scales its diagonal to `size`.
fn fit(points: &mut [[f32; 3]], size: f32) {
    let (mut low, mut high) = ([f32::MAX; 2], [f32::MIN; 2]);
    for p in points.iter() {
        for k in 0..2 {
            low[k] = low[k].min(p[k]);
            high[k] = high[k].max(p[k]);
        }
    }
    let extent = (high[0] - low[0]).hypot(high[1] - low[1]).max(1.0);
    let factor = size / extent;
    for p in points.iter_mut() {
        for k in 0..2 {
            p[k] = (p[k] - 0.5 * (low[k] + high[k])) * factor;
        }
    }
}

/// Samples a bracket: level pieces joined by slopes, with walls bent up, holes and slots.
pub(super) fn draw_sheet(rng: &mut Pcg64Mcg) -> Recipe {
    let mut builder = Builder::new(Material::draw(rng));
    let inner = builder.material(Material::metal(rng));
    let size = rng.log_uniform(30.0, 150.0);
    let thickness = rng.log_uniform(0.7, 3.5).min(0.06 * size);
    let (half_x, half_y) = (0.5 * size, 0.5 * size * rng.uniform(0.22, 0.75));
    let edge = Edge::chamfer(0.15 * thickness);

    // The strip along x: level pieces joined by slopes.
    let pieces = rng.whole(1, 4);
    let mut x = -half_x;
    let mut height = thickness;
    let lift = rng.uniform(0.05, 0.22) * size;
    let share = 2.0 * half_x / pieces as f32;
    for piece in 0..pieces {
        let level = share * if pieces > 1 { rng.uniform(0.5, 0.8) } else { 1.0 };
        let narrow = if rng.chance(0.3) { rng.uniform(0.5, 0.9) } else { 1.0 };
        let shape = |half: f32| Shape::Rectangle { half: [half, half_y * narrow], corner: 0.0 };
        let bottom = (height - thickness).max(0.0);
        if piece > 0 && rng.chance(0.5) {
            builder.next_group();
        }
        let center = [x + 0.5 * level, 0.0];
        builder.push(shape(0.5 * level), center, 0.0, Operation::Add { bottom, top: height, edge }, 0);
        x += level;
        if piece + 1 < pieces {
            let run = share - level;
            let next = if height > thickness { thickness } else { thickness + lift * rng.uniform(0.3, 1.0) };
            let slope = Operation::Slope { from: height, to: next, thickness: 1.3 * thickness, half_length: 0.5 * run };
            builder.push(shape(0.5 * run + 0.05), [x + 0.5 * run, 0.0], 0.0, slope, 0);
            height = next;
            x += run;
        }
    }
    // Walls along the edges.
    for _ in 0..rng.whole(0, 3) {
        builder.next_group();
        let wall = size * rng.uniform(0.06, 0.28);
        let along_x = rng.chance(0.6);
        let side = rng.sign();
        let (half, center) = if along_x {
            let reach = half_x * rng.uniform(0.2, 1.0);
            ([reach, thickness], [rng.uniform(-1.0, 1.0) * (half_x - reach), side * (half_y - thickness)])
        } else {
            let reach = half_y * rng.uniform(0.4, 1.0);
            ([thickness, reach], [side * (half_x - thickness), rng.uniform(-1.0, 1.0) * (half_y - reach)])
        };
        let edge = Edge { width: thickness * 0.8, drop: thickness * 0.6, round: true };
        builder.add(Shape::Rectangle { half, corner: 0.3 * thickness }, center, 0.0, thickness + wall, edge, 0);
        builder.take(center, 0.3 * half[0].max(half[1]));
    }
    for _ in 0..rng.whole(1, 5) {
        builder.next_group();
        let reach = size * rng.uniform(0.02, 0.07);
        let Some(center) = builder.room(reach * 1.3, rng) else { continue };
        let shape = if rng.chance(0.65) {
            Shape::Disc { radius: reach }
        } else {
            Shape::Rectangle { half: [reach, reach * 0.4], corner: 0.4 * reach }
        };
        let turn = rng.whole(0, 1) as f32 * 0.5 * PI;
        builder.cut(shape, center, turn, 0.0, 0.15, inner);
    }
    if rng.chance(0.2) {
        let ink = builder.material(Material::print(rng));
        let half = [0.12 * size, 0.04 * size];
        if let Some(center) = builder.room(half[0], rng) {
            builder.next_group();
            builder.print(center, 0.0, half, ink, rng);
        }
    }
    builder.finish(rng)
}

//! Photos of other parts, made by one change of a photo: a feature moved, removed or added; a notch or a lug at the
//! outline; the whole photo stretched.

use rand::Rng;
use rand_pcg::Pcg64Mcg;
use sdg_shape::{Pair, SIDE};

use crate::pairs::{AREA, between};

/// Radius of a feature, in pixels.
const RADIUS: [f32; 2] = [2.5, 7.0];
/// Displacement of a feature, in pixels.
const MOVED_PX: [f32; 2] = [4.0, 10.0];
/// Relative change of length in one direction.
const STRETCH: [f32; 2] = [0.1, 0.3];
/// Minimum total change of the photo by an edit, in pixels of full contrast.
const MIN_CHANGE: f32 = 2.5;
/// Maximum number of edits that are tried.
const TRIES: usize = 12;

/// Replaces the photo by that of another part; `None` if no edit changed the photo enough.
pub fn edited(pair: &Pair, rng: &mut Pcg64Mcg) -> Option<Pair> {
    (0..TRIES).find_map(|_| {
        let mut other = pair.clone();
        match rng.random_range(0..10) {
            0..=2 => move_feature(&mut other, rng, true),
            3..=4 => move_feature(&mut other, rng, false),
            5..=6 => put_in(&mut other, rng),
            7 => change_outline(&mut other, rng),
            _ => other = stretched(pair, rng),
        }
        let change: f32 = other.photo.iter().zip(&pair.photo).map(difference).sum();
        (change > MIN_CHANGE).then_some(other)
    })
}

fn difference((a, b): (&Option<[f32; 3]>, &Option<[f32; 3]>)) -> f32 {
    match (a, b) {
        (Some(a), Some(b)) => (0..3).map(|c| (a[c] - b[c]).abs()).sum::<f32>() / 3.0,
        _ => 0.0,
    }
}

fn place(i: usize) -> [f32; 2] {
    [(i % SIDE) as f32, (i / SIDE) as f32]
}

fn distance(a: [f32; 2], b: [f32; 2]) -> f32 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// A random pixel in the outline.
fn inside(pair: &Pair, rng: &mut Pcg64Mcg) -> [f32; 2] {
    let inside: Vec<usize> = (0..AREA).filter(|&i| pair.inside[i]).collect();
    place(if inside.is_empty() { AREA / 2 } else { inside[rng.random_range(0..inside.len())] })
}

/// Replaces a feature by its surroundings, and copies it elsewhere if `stands_elsewhere`.
fn move_feature(pair: &mut Pair, rng: &mut Pcg64Mcg, stands_elsewhere: bool) {
    let (from, radius) = (inside(pair, rng), rng.random_range(RADIUS[0]..RADIUS[1]));
    let (sin, cos) = rng.random_range(0.0..std::f32::consts::TAU).sin_cos();
    let moved = rng.random_range(MOVED_PX[0]..MOVED_PX[1]);
    let to = [from[0] + moved * cos, from[1] + moved * sin];
    let before = pair.photo.clone();
    let ring: Vec<([f32; 2], [f32; 3])> = (0..AREA)
        .filter(|&i| pair.inside[i] && (radius..radius + 3.0).contains(&distance(place(i), from)))
        .filter_map(|i| Some((place(i), before[i]?)))
        .collect();
    if ring.is_empty() {
        return;
    }
    for i in (0..AREA).filter(|&i| pair.inside[i] && distance(place(i), from) < radius) {
        let (mut sum, mut weights) = ([0.0; 3], 0.0);
        for (at, color) in &ring {
            let weight = 1.0 / distance(place(i), *at).powi(2).max(0.5);
            (0..3).for_each(|c| sum[c] += weight * color[c]);
            weights += weight;
        }
        pair.photo[i] = Some(sum.map(|value| value / weights));
    }
    if stands_elsewhere {
        paste(pair, &before, from, to, radius);
    }
}

/// Copies a feature of the photo to another place.
fn put_in(pair: &mut Pair, rng: &mut Pcg64Mcg) {
    let (from, to, radius) = (inside(pair, rng), inside(pair, rng), rng.random_range(RADIUS[0]..RADIUS[1]));
    let before = pair.photo.clone();
    paste(pair, &before, from, to, radius);
}

fn paste(pair: &mut Pair, before: &[Option<[f32; 3]>], from: [f32; 2], to: [f32; 2], radius: f32) {
    for i in (0..AREA).filter(|&i| pair.inside[i]) {
        let [x, y] = place(i);
        let share = (radius - distance([x, y], to) + 0.5).clamp(0.0, 1.0);
        let Some(of_feature) =
            (share > 0.0).then(|| between(before, &[x - to[0] + from[0], y - to[1] + from[1]])).flatten()
        else {
            continue;
        };
        let under = pair.photo[i].unwrap_or(of_feature);
        pair.photo[i] = Some(std::array::from_fn(|c| share * of_feature[c] + (1.0 - share) * under[c]));
    }
}

/// Adds a patch of table inside the outline, or of the part outside.
fn change_outline(pair: &mut Pair, rng: &mut Pcg64Mcg) {
    let is_edge = |i: &usize| {
        let (x, y) = (i % SIDE, i / SIDE);
        x > 0 && y > 0 && x < SIDE - 1 && y < SIDE - 1 && pair.inside[*i] != pair.inside[i + 1]
    };
    let edges: Vec<usize> = (0..AREA).filter(is_edge).collect();
    if edges.is_empty() {
        return;
    }
    let at = place(edges[rng.random_range(0..edges.len())]);
    let (radius, is_bite) = (rng.random_range(RADIUS[0]..RADIUS[1]), rng.random_bool(0.5));
    let is_near = |i: &usize| distance(place(*i), at) < radius + 4.0;
    let others: Vec<[f32; 3]> =
        (0..AREA).filter(is_near).filter(|&i| pair.inside[i] != is_bite).filter_map(|i| pair.photo[i]).collect();
    if others.is_empty() {
        return;
    }
    for i in (0..AREA).filter(|&i| distance(place(i), at) < radius) {
        if pair.inside[i] == is_bite {
            pair.photo[i] = Some(others[rng.random_range(0..others.len())]);
            pair.inside[i] = !is_bite;
        }
    }
}

/// Stretches or shortens the photo in one direction.
fn stretched(pair: &Pair, rng: &mut Pcg64Mcg) -> Pair {
    let (sin, cos) = rng.random_range(0.0..std::f32::consts::TAU).sin_cos();
    let share = rng.random_range(STRETCH[0]..STRETCH[1]);
    let factor = if rng.random_bool(0.5) { 1.0 + share } else { 1.0 / (1.0 + share) };
    let middle = 0.5 * (SIDE as f32 - 1.0);
    // The line at this distance from the middle keeps its position.
    let fixed = rng.random_range(-1.0..1.0f32) * 0.4 * SIDE as f32;
    let source = |i: usize| {
        let [x, y] = place(i).map(|k| k - middle);
        let along = cos * x + sin * y;
        let moved = (along - fixed) / factor + fixed - along;
        [x + moved * cos + middle, y + moved * sin + middle]
    };
    let nearest = |[x, y]: [f32; 2]| {
        let [x, y] = [x.round(), y.round()];
        let limit = SIDE as f32;
        (x >= 0.0 && y >= 0.0 && x < limit && y < limit).then(|| y as usize * SIDE + x as usize)
    };
    Pair {
        photo: (0..AREA).map(|i| between(&pair.photo, &source(i)).or(pair.photo[i])).collect(),
        inside: (0..AREA).map(|i| nearest(source(i)).is_some_and(|j| pair.inside[j])).collect(),
        picture: pair.picture.clone(),
    }
}

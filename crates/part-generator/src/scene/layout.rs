//! Positions of objects: free positions for parts, touching neighbours, covers.

use std::sync::Arc;

use rand_pcg::Pcg64Mcg;

use super::ground::Ground;
use super::placement::Placement;
use super::view::View;
use crate::Part;
use crate::random::Draw;

/// Number of positions tried for each part.
const MAX_TRIES: usize = 24;

/// Maximum fraction of a part's cells over another part.
const MAX_OVERLAP: f32 = 0.0;

/// The table while objects are placed on it.
pub(crate) struct Layout<'a> {
    view: &'a View,
    ground: Ground,
    /// The bodies, in the order of placement.
    pub bodies: Vec<Placement>,
}

impl<'a> Layout<'a> {
    pub fn new(view: &'a View) -> Self {
        let [x0, y0, x1, y1] = view.ground();
        let margin = 0.3 * (x1 - x0);
        let bounds = [x0 - margin, y0 - margin, x1 + margin, y1 + margin];
        Self { view, ground: Ground::new(bounds, 2.0 * view.mm_per_px()), bodies: Vec::new() }
    }

    /// Places a part at a free position where at least the fraction `min_inside` of its outline is inside the picture;
    /// false if none is found.
    pub fn lay(&mut self, part: &Arc<Part>, min_inside: f32, rng: &mut Pcg64Mcg) -> bool {
        let (w, h) = (self.view.width as f32, self.view.height as f32);
        for _ in 0..MAX_TRIES {
            let foot = self.view.sight(rng.uniform(0.0, w), rng.uniform(0.0, h)).foot;
            let body = self.centered(part, foot, rng.angle(), 0.0);
            if self.inside(&body) >= min_inside && self.ground.under(&body).1 <= MAX_OVERLAP {
                self.keep(body);
                return true;
            }
        }
        false
    }

    /// Places a part so that it touches a body, by moving it towards the body; false if no position is found.
    pub fn lay_touching(&mut self, part: &Arc<Part>, neighbour: usize, rng: &mut Pcg64Mcg) -> bool {
        let middle = self.middle(neighbour);
        let step = 1.5 * self.view.mm_per_px();
        for _ in 0..6 {
            let (sin, cos) = rng.angle().sin_cos();
            let turn = rng.angle();
            let reach = 0.55 * (self.bodies[neighbour].part.diagonal_mm() + part.diagonal_mm()) as f32;
            let at = |distance: f32| [middle[0] + cos * distance, middle[1] + sin * distance];
            let mut free = None;
            for k in 0..60 {
                let body = self.centered(part, at(reach - k as f32 * step), turn, 0.0);
                if self.ground.under(&body).1 > MAX_OVERLAP {
                    break;
                }
                free = Some(body);
            }
            if let Some(body) = free {
                self.keep(body);
                return true;
            }
        }
        false
    }

    /// Places a cover on a body so that about the fraction `share` of the body is covered; false if no position is
    /// found.
    pub fn cover(&mut self, cover: &Arc<Part>, covered: usize, share: f32, rng: &mut Pcg64Mcg) -> bool {
        let points = self.cells_of(covered);
        let middle = self.middle(covered);
        let reach = 0.5 * (self.bodies[covered].part.diagonal_mm() + cover.diagonal_mm()) as f32;
        let mut best: Option<(f32, Placement)> = None;
        for _ in 0..14 {
            let angle = rng.angle();
            let distance = reach * rng.uniform(0.0, 0.9);
            let at = [middle[0] + angle.cos() * distance, middle[1] + angle.sin() * distance];
            let body = self.centered(cover, at, rng.angle(), 0.0);
            let hidden = points.iter().filter(|&&place| is_over(&body, place)).count() as f32 / points.len() as f32;
            let error = (hidden - share).abs();
            if best.as_ref().is_none_or(|(least, _)| error < *least) {
                best = Some((error, body));
            }
        }
        match best {
            Some((error, body)) if error < 0.12 => {
                let top = self.ground.under(&body).0;
                let body = Placement::new(body.part, body.at, body.turn, top + 0.2, self.view.mm_per_px());
                self.keep(body);
                true
            }
            _ => false,
        }
    }

    fn keep(&mut self, body: Placement) {
        self.ground.put(&body);
        self.bodies.push(body);
    }

    /// A part with the centre of its box at a position.
    fn centered(&self, part: &Arc<Part>, middle: [f32; 2], turn: f32, base: f32) -> Placement {
        let mm_per_px = self.view.mm_per_px();
        let bounds = part.outline.bounds().center();
        let body = Placement::new(part.clone(), [0.0; 2], turn, base, mm_per_px);
        let offset = body.to_table([bounds.x as f32, bounds.y as f32]);
        Placement::new(body.part, [middle[0] - offset[0], middle[1] - offset[1]], turn, base, mm_per_px)
    }

    fn middle(&self, body: usize) -> [f32; 2] {
        let center = self.bodies[body].part.outline.bounds().center();
        self.bodies[body].to_table([center.x as f32, center.y as f32])
    }

    /// Positions of the cells of a body's coarsest grid.
    fn cells_of(&self, body: usize) -> Vec<[f32; 2]> {
        let body = &self.bodies[body];
        let relief = &body.part.relief;
        let level = &relief.levels[relief.levels.len() - 1];
        let mut places = Vec::new();
        for y in 0..level.height {
            for x in 0..level.width {
                if level.texels[y * level.width + x].top > 0 {
                    places.push(body.to_table(relief.place(level, x, y)));
                }
            }
        }
        places
    }

    /// Fraction of a body's outline inside the picture.
    fn inside(&self, body: &Placement) -> f32 {
        let vertices = &body.part.outline.vertices;
        let (w, h) = (self.view.width as f32, self.view.height as f32);
        let inside = vertices
            .iter()
            .filter(|v| {
                let [x, y] = body.to_table([v.x as f32, v.y as f32]);
                [0.0, body.part.relief.top_mm].iter().all(|&z| {
                    self.view
                        .project([x, y, z])
                        .is_some_and(|[px, py]| px > 0.5 && py > 0.5 && px < w - 0.5 && py < h - 0.5)
                })
            })
            .count();
        inside as f32 / vertices.len().max(1) as f32
    }
}

/// Whether a body is above a position of the table.
fn is_over(body: &Placement, place: [f32; 2]) -> bool {
    let relief = &body.part.relief;
    let level = &relief.levels[relief.levels.len() - 1];
    let [x, y] = body.direction_to_part([place[0] - body.at[0], place[1] - body.at[1]]);
    let (gx, gy) = ((x - relief.min[0]) / level.cell, (y - relief.min[1]) / level.cell);
    gx >= 0.0 && gy >= 0.0 && level.get(gx as i32, gy as i32).top > 0
}

//! The colours of a table top, one row of the picture at a time.

use super::{Layer, Pattern, Sheet, Table};
use crate::tiles::floor;

/// Texels per pixel below which a layer is read only at every second pixel.
const MAX_SMOOTH_TEXELS: f32 = 0.35;

/// Texels per pixel above which a layer needs no interpolation.
const MIN_FINE_TEXELS: f32 = 0.6;

/// Minimum albedo of a table.
const MIN_ALBEDO: f32 = 0.004;

impl Table {
    /// Writes the colours at positions of the table, in linear light; `mm_per_px` smooths lines. `turned` is scratch
    /// space of any length. The fourth channel is unused.
    pub fn colors(&self, places: &[[f32; 2]], mm_per_px: f32, turned: &mut Vec<[f32; 2]>, out: &mut [[f32; 4]]) {
        let [sin, cos] = self.sin_cos;
        turned.clear();
        turned.extend(
            places.iter().map(|p| [cos * p[0] + sin * p[1] + self.shift[0], cos * p[1] - sin * p[0] + self.shift[1]]),
        );
        let [red, green, blue] = self.base;
        out.fill([red, green, blue, 0.0]);
        if !matches!(self.pattern, Pattern::None) {
            turned.iter().zip(out.iter_mut()).for_each(|(&[x, y], color)| self.print(x, y, mm_per_px, color));
        }
        self.layers.iter().for_each(|layer| layer.add_to(turned, mm_per_px, out));
        for sheet in &self.sheets {
            sheet.lay_on(places, mm_per_px, out);
        }
        out.iter_mut().for_each(|color| *color = color.map(|c| c.max(MIN_ALBEDO)));
    }

    #[inline(always)]
    fn print(&self, x: f32, y: f32, mm_per_px: f32, color: &mut [f32; 4]) {
        let per_px = 1.0 / mm_per_px;
        // Fraction of a pixel within `half` of a line at distance `d`.
        let inside = |d: f32, half: f32| ((half - d) * per_px + 0.5).clamp(0.0, 1.0) * (2.0 * half * per_px).min(1.0);
        let to_line = |v: f32, pitch: f32| (v - pitch * floor(v / pitch + 0.5) as f32).abs();
        match &self.pattern {
            Pattern::None => {}
            Pattern::Grid { pitch, width, color: ink } => {
                let fine = inside(to_line(x, *pitch).min(to_line(y, *pitch)), 0.5 * width);
                let strong = inside(to_line(x, 5.0 * pitch).min(to_line(y, 5.0 * pitch)), 0.9 * width);
                mix(color, ink, (0.5 * fine).max(strong));
            }
            Pattern::Checks { pitch, color: other } => {
                let (u, v) = (x / pitch, y / pitch);
                // The colour changes within half a pixel of the nearest edge.
                let odd = (floor(u) + floor(v)) & 1 == 1;
                let d = to_line(x, *pitch).min(to_line(y, *pitch));
                let share = (d * per_px + 0.5).clamp(0.0, 1.0);
                mix(color, other, if odd { share } else { 1.0 - share });
            }
            Pattern::Boards { width, length, joint, vary } => {
                let board = floor(y / width) as f32;
                let offset = self.tiles.grain.nearest(board * 7.0, board * 3.0) * length;
                let piece = floor((x + offset) / length) as f32;
                let shade = 1.0 + vary * self.tiles.grain.nearest(board * 5.0 + 11.0, piece * 13.0 + board);
                let d = to_line(y, *width).min(to_line(x + offset, *length));
                let dark = 1.0 - 0.7 * inside(d, 0.5 * joint);
                color.iter_mut().for_each(|c| *c *= shade * dark);
            }
            Pattern::Dots { pitch, radius, color: other } => {
                let (dx, dy) = (to_line(x, *pitch), to_line(y, *pitch));
                mix(color, other, ((radius - (dx * dx + dy * dy).sqrt()) * per_px + 0.5).clamp(0.0, 1.0));
            }
            Pattern::Waves { pitch, strength } => {
                let fade = (pitch / (2.5 * mm_per_px)).min(1.0);
                let shade = 1.0 + fade * strength * wave(y / pitch);
                color.iter_mut().for_each(|c| *c *= shade);
            }
            Pattern::Weave { pitch, strength } => {
                let fade = (pitch / (2.5 * mm_per_px)).min(1.0);
                let shade = 1.0 + fade * strength * wave(x / pitch) * wave(y / pitch);
                color.iter_mut().for_each(|c| *c *= shade);
            }
            Pattern::Text { pitch, color: ink } => {
                let line = floor(y / pitch) as f32;
                let within = y / pitch - line;
                let letter = floor(x / (0.55 * pitch)) as f32;
                let written = self.tiles.cloud.nearest(letter * 0.31, line * 17.0) > -0.5
                    && self.tiles.grain.nearest(letter, line * 3.0) > -0.55;
                if written && within > 0.25 && within < 0.75 {
                    let stroke = self.tiles.grain.at(x / pitch * 7.0, y / pitch * 7.0);
                    let legible = (0.55 * pitch / (3.0 * mm_per_px)).min(1.0);
                    let share = (0.5 + 2.5 * stroke).clamp(0.0, 1.0) * legible + 0.4 * (1.0 - legible);
                    mix(color, ink, share);
                }
            }
        }
    }

    /// Slopes of the top's grain at a position.
    #[inline]
    pub fn slopes(&self, place: [f32; 2]) -> [f32; 2] {
        let [sin, cos] = self.sin_cos;
        let (x, y) = (cos * place[0] + sin * place[1], cos * place[1] - sin * place[0]);
        let across = self.ripple * self.tiles.streak.at(0.3 * x, 1.3 * y);
        [-sin * across, cos * across]
    }
}

impl Sheet {
    fn lay_on(&self, places: &[[f32; 2]], mm_per_px: f32, out: &mut [[f32; 4]]) {
        let per_px = 1.0 / mm_per_px;
        let [nx, ny] = self.normal;
        for (place, color) in places.iter().zip(out) {
            let depth = nx * place[0] + ny * place[1] - self.distance;
            mix(color, &self.color, (depth * per_px + 0.5).clamp(0.0, 1.0));
        }
    }
}

impl Layer {
    /// Adds the layer at positions in the table's own directions.
    fn add_to(&self, places: &[[f32; 2]], mm_per_px: f32, out: &mut [[f32; 4]]) {
        let [red, green, blue] = self.color;
        let color = [red, green, blue, 0.0];
        let add = |out: &mut [f32; 4], value: f32| (0..4).for_each(|k| out[k] += value * color[k]);
        let texel = |p: &[f32; 2]| (p[0] * self.scale[0] + self.shift[0], p[1] * self.scale[1] + self.shift[1]);
        let [least, most] = [self.scale[0].min(self.scale[1]), self.scale[0].max(self.scale[1])];
        if least * mm_per_px > MIN_FINE_TEXELS {
            for (place, out) in places.iter().zip(out) {
                let (u, v) = texel(place);
                add(out, self.tile.nearest(u, v));
            }
            return;
        }
        let between = |place: &[f32; 2]| {
            let (u, v) = texel(place);
            self.tile.at(u, v)
        };
        if most * mm_per_px > MAX_SMOOTH_TEXELS {
            places.iter().zip(out).for_each(|(place, out)| add(out, between(place)));
            return;
        }
        // Pairs of pixels: the second value is the mean of its neighbours.
        let Some(first) = places.first() else { return };
        let mut value = between(first);
        for (k, pair) in out.chunks_mut(2).enumerate() {
            let next = places.get(2 * k + 2).map_or(value, between);
            add(&mut pair[0], value);
            if let Some(second) = pair.get_mut(1) {
                add(second, 0.5 * (value + next));
            }
            value = next;
        }
    }
}

/// Mixes a colour with another colour.
#[inline(always)]
fn mix(color: &mut [f32; 4], other: &[f32; 3], share: f32) {
    for k in 0..3 {
        color[k] += (other[k] - color[k]) * share;
    }
}

/// Approximates the sine of a number of turns by two parabolas.
#[inline(always)]
fn wave(turns: f32) -> f32 {
    let t = turns - floor(turns + 0.5) as f32;
    8.0 * t - 16.0 * t * t.abs()
}

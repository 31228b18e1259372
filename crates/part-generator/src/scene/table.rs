//! Table tops: colours, grain, lines and print.

use rand_pcg::Pcg64Mcg;

use crate::random::Draw;
use crate::recipe::paint_color;
use crate::tiles::{Tile, Tiles};

mod color;

/// Probability of sheets on a table. Sheets are added because brightness varies more within a photograph than on one
/// table top.
const SHEETS_PROBABILITY: f32 = 0.4;

/// A layer of noise over the base colour.
struct Layer {
    tile: &'static Tile,
    /// Texels per millimetre along and across.
    scale: [f32; 2],
    shift: [f32; 2],
    /// Colour added for a value of 1.
    color: [f32; 3],
}

/// Lines, squares or dots with regular spacing.
enum Pattern {
    None,
    /// Lines with regular spacing, every fifth one stronger.
    Grid {
        pitch: f32,
        width: f32,
        color: [f32; 3],
    },
    /// Squares of two colours.
    Checks {
        pitch: f32,
        color: [f32; 3],
    },
    /// Boards or tiles with joints, each with its own shade.
    Boards {
        width: f32,
        length: f32,
        joint: f32,
        vary: f32,
    },
    /// Round holes or bumps.
    Dots {
        pitch: f32,
        radius: f32,
        color: [f32; 3],
    },
    /// Waves: corrugated board, conveyor belts.
    Waves {
        pitch: f32,
        strength: f32,
    },
    /// Woven threads.
    Weave {
        pitch: f32,
        strength: f32,
    },
    /// Lines of letters, as on paper.
    Text {
        pitch: f32,
        color: [f32; 3],
    },
}

/// A half-plane of another colour: a sheet of paper, a mat, the floor beside the table.
struct Sheet {
    /// Unit vector from the table top to the sheet.
    normal: [f32; 2],
    /// Distance in millimetres from the picture's centre to the sheet's edge.
    distance: f32,
    color: [f32; 3],
}

/// A table top.
pub(crate) struct Table {
    base: [f32; 3],
    layers: Vec<Layer>,
    pattern: Pattern,
    sheets: Vec<Sheet>,
    sin_cos: [f32; 2],
    shift: [f32; 2],
    /// Fraction of mirrored light: 0 for matt tops.
    pub gloss: f32,
    /// Index of the reflection map for a glossy top.
    pub gloss_level: usize,
    /// Slope of the top's grain, which breaks up reflections.
    pub ripple: f32,
    tiles: &'static Tiles,
}

/// Style of the tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TableStyle {
    /// Any kind of table, at random.
    Any,
    /// Plain and light to middle grey, as recommended for a demonstration's photo.
    Plain,
}

impl Table {
    /// Samples a table top.
    pub fn draw(style: TableStyle, rng: &mut Pcg64Mcg) -> Self {
        let tiles = Tiles::get();
        let (sin, cos) = rng.angle().sin_cos();
        let shift = [rng.uniform(0.0, 500.0), rng.uniform(0.0, 500.0)];
        let mut made = Self {
            base: grey(rng, 0.05, 0.85),
            layers: Vec::new(),
            pattern: Pattern::None,
            sheets: Vec::new(),
            sin_cos: [sin, cos],
            shift,
            gloss: 0.0,
            gloss_level: 3,
            ripple: 0.0,
            tiles,
        };
        if style == TableStyle::Plain {
            made.base = grey(rng, 0.1, 0.75);
            made.add(&tiles.cloud, [0.8, 0.8], 0.03, rng);
            made.add(&tiles.grain, [1.1, 1.1], 0.02, rng);
            return made;
        }
        made.draw_kind(rng);
        if rng.chance(SHEETS_PROBABILITY) {
            made.sheets = (0..rng.whole(1, 2)).map(|_| Sheet::draw(rng)).collect();
        }
        // Grain on all these tables; stains and spots on some.
        let stains = rng.uniform(0.0, 0.09);
        let scale = rng.log_uniform(0.25, 1.2);
        if stains > 0.03 {
            made.add(&tiles.cloud, [scale, scale], stains, rng);
        }
        let fine = rng.uniform(0.005, 0.05);
        made.add(&tiles.grain, [1.4, 1.4], fine, rng);
        if rng.chance(0.2) {
            let strength = rng.uniform(-0.5, 0.3);
            let scale = rng.log_uniform(0.5, 2.0);
            made.add(&tiles.spots, [scale, scale], strength, rng);
        }
        made
    }

    fn draw_kind(&mut self, rng: &mut Pcg64Mcg) {
        let tiles = self.tiles;
        match rng.whole(0, 15) {
            0 | 14 | 15 => {
                // Painted or laminated board.
                self.base = paint_color(rng).map(|c| 0.8 * c + 0.03);
                self.shine(rng.uniform(0.0, 0.12), rng);
            }
            1 => {
                // Speckled laminate or stone.
                self.base = grey(rng, 0.12, 0.6);
                for _ in 0..2 {
                    let (scale, strength) = (rng.log_uniform(0.6, 2.0), rng.uniform(-0.7, 0.5));
                    self.add(&tiles.spots, [scale, scale], strength, rng);
                }
                self.shine(rng.uniform(0.0, 0.08), rng);
            }
            2 | 3 => {
                // Wood, sometimes in boards.
                let level = rng.log_uniform(0.1, 0.5);
                let warmth = rng.uniform(0.4, 1.0);
                self.base = [level * (1.0 + 0.35 * warmth), level, level * (1.0 - 0.45 * warmth)];
                let scale = rng.log_uniform(0.5, 1.4);
                let strength = rng.uniform(0.08, 0.3);
                self.add(&tiles.wood, [0.22 * scale, scale], strength, rng);
                if rng.chance(0.5) {
                    let (width, length) = (rng.uniform(40.0, 120.0), rng.uniform(200.0, 600.0));
                    self.pattern = Pattern::Boards { width, length, joint: 0.8, vary: 0.2 };
                }
                self.shine(rng.uniform(0.0, 0.06), rng);
            }
            4 | 5 => {
                // Sheet metal: brushed, rolled, scratched.
                self.base = grey(rng, 0.12, 0.4);
                let strength = rng.uniform(0.05, 0.2);
                self.add(&tiles.streak, [rng.uniform(0.05, 0.4), rng.uniform(0.6, 1.8)], strength, rng);
                self.shine(rng.uniform(0.1, 0.45), rng);
                self.ripple = rng.uniform(0.01, 0.06);
            }
            6 => {
                // A cutting mat or squared paper.
                let paper = rng.chance(0.4);
                self.base = if paper { grey(rng, 0.6, 0.8) } else { paint_color(rng).map(|c| 0.35 * c + 0.01) };
                let pitch = if paper { 5.0 } else { 10.0 };
                let ink = if paper { paint_color(rng).map(|c| 0.5 * c) } else { grey(rng, 0.3, 0.7) };
                self.pattern = Pattern::Grid { pitch, width: rng.uniform(0.3, 0.8), color: ink };
            }
            7 => {
                let color = grey(rng, 0.05, 0.7);
                self.pattern = if rng.chance(0.5) {
                    Pattern::Checks { pitch: rng.log_uniform(6.0, 60.0), color }
                } else {
                    let pitch = rng.log_uniform(5.0, 40.0);
                    Pattern::Dots { pitch, radius: pitch * rng.uniform(0.15, 0.4), color }
                };
            }
            8 => {
                // Corrugated board or a ribbed belt.
                let level = rng.log_uniform(0.05, 0.45);
                let warmth = if rng.chance(0.6) { rng.uniform(0.4, 1.0) } else { 0.0 };
                self.base = [level * (1.0 + 0.25 * warmth), level, level * (1.0 - 0.4 * warmth)];
                self.pattern = Pattern::Waves { pitch: rng.uniform(3.0, 10.0), strength: rng.uniform(0.03, 0.2) };
            }
            9 => {
                // Cloth.
                self.base = paint_color(rng);
                self.pattern = Pattern::Weave { pitch: rng.uniform(1.2, 4.0), strength: rng.uniform(0.08, 0.35) };
            }
            10 => {
                // Printed paper.
                self.base = grey(rng, 0.55, 0.82);
                self.pattern = Pattern::Text { pitch: rng.uniform(3.5, 12.0), color: grey(rng, 0.02, 0.2) };
            }
            11 | 12 => {
                // Black: foam, rubber, painted steel.
                self.base = grey(rng, 0.01, 0.05);
                self.shine(rng.uniform(0.0, 0.05), rng);
            }
            _ => {
                // Stained workshop steel, concrete.
                self.base = grey(rng, 0.08, 0.35);
                for _ in 0..3 {
                    let (scale, strength) = (rng.log_uniform(0.3, 3.0), rng.uniform(0.05, 0.22));
                    self.add(&tiles.cloud, [scale, scale], strength, rng);
                }
            }
        }
    }

    /// Adds a layer that lightens and darkens the colour by the fraction `strength`.
    fn add(&mut self, tile: &'static Tile, scale: [f32; 2], strength: f32, rng: &mut Pcg64Mcg) {
        let tint = [rng.uniform(0.9, 1.1), 1.0, rng.uniform(0.9, 1.1)];
        let color = [0, 1, 2].map(|k| strength * tint[k] * (0.8 * self.base[k] + 0.02));
        let shift = [rng.uniform(0.0, 256.0), rng.uniform(0.0, 256.0)];
        self.layers.push(Layer { tile, scale, shift, color });
    }

    fn shine(&mut self, gloss: f32, rng: &mut Pcg64Mcg) {
        self.gloss = if gloss < 0.02 { 0.0 } else { gloss };
        self.gloss_level = rng.whole(1, 3);
    }

    /// The approximate mean colour.
    pub fn mean(&self) -> [f32; 3] {
        self.base
    }
}

impl Sheet {
    fn draw(rng: &mut Pcg64Mcg) -> Self {
        let (sin, cos) = rng.angle().sin_cos();
        let color = match rng.whole(0, 3) {
            0 => grey(rng, 0.6, 0.9),
            1 => grey(rng, 0.01, 0.06),
            2 => grey(rng, 0.05, 0.8),
            _ => paint_color(rng),
        };
        Self { normal: [cos, sin], distance: rng.uniform(-40.0, 140.0), color }
    }
}

/// A grey, slightly coloured.
fn grey(rng: &mut Pcg64Mcg, low: f32, high: f32) -> [f32; 3] {
    let level = rng.log_uniform(low, high);
    [level * rng.uniform(0.94, 1.06), level, level * rng.uniform(0.92, 1.08)]
}

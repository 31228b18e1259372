//! A part as a grid of heights, normals and materials, computed once from its recipe.

use crate::recipe::{Brushing, Material, Recipe, State};
use crate::tiles::{Tiles, floor};

/// Maximum number of cells along the longer side of the finest grid, without its margin.
const MAX_CELLS: f32 = 288.0;

/// Minimum cell size, in millimetres.
const MIN_CELL_MM: f32 = 0.12;

/// Number of grids; each has cells twice as wide as the one before.
const NUM_LEVELS: usize = 4;

/// Side of the blocks of cells for which the maximum height is stored.
pub(crate) const BLOCK_CELLS: usize = 8;

/// Number of height steps per millimetre.
const STEPS_PER_MM: f32 = 200.0;

/// Maximum slope of the surface in a normal.
const MAX_SLOPE: f32 = 3.0;

/// Height difference between neighbours, in cells, above which a step is a wall, which normals ignore.
const MIN_WALL_CELLS: f32 = 7.0;

/// The part above one cell.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Texel {
    /// Height of the upper side in steps; 0 if there is no material.
    pub top: u16,
    /// Height of the lower side in steps.
    pub bottom: u16,
    /// The normal's x and y times 127.
    pub normal: [i8; 2],
    /// Index of the material.
    pub material: u8,
    /// Shade of the material; 128 is neutral.
    pub tone: u8,
}

/// A grid of one cell size.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Level {
    pub width: usize,
    pub height: usize,
    /// Cell size in millimetres.
    pub cell: f32,
    pub texels: Vec<Texel>,
    /// The maximum height within each block of cells and its neighbouring blocks.
    block_tops: Vec<u16>,
    blocks_across: usize,
}

impl Level {
    fn new(width: usize, height: usize, cell: f32, texels: Vec<Texel>) -> Self {
        let (across, down) = (width.div_ceil(BLOCK_CELLS), height.div_ceil(BLOCK_CELLS));
        let mut tops = vec![0u16; across * down];
        for (y, row) in texels.chunks_exact(width).enumerate() {
            for (x, texel) in row.iter().enumerate() {
                let block = &mut tops[y / BLOCK_CELLS * across + x / BLOCK_CELLS];
                *block = texel.top.max(*block);
            }
        }
        let block_tops = (0..across * down)
            .map(|idx| {
                let (x, y) = (idx % across, idx / across);
                let rows = y.saturating_sub(1)..(y + 2).min(down);
                rows.flat_map(|v| &tops[v * across + x.saturating_sub(1)..v * across + (x + 2).min(across)])
                    .fold(0, |top, &other| top.max(other))
            })
            .collect();
        Self { width, height, cell, texels, block_tops, blocks_across: across }
    }

    /// An upper bound of the height of all cells within [`BLOCK_CELLS`] of a position, which is given in cells and
    /// must be on the grid.
    #[inline(always)]
    pub fn top_around(&self, x: f32, y: f32) -> u16 {
        let (u, v) = (floor(x).max(0) as usize / BLOCK_CELLS, floor(y).max(0) as usize / BLOCK_CELLS);
        self.block_tops.get(v * self.blocks_across + u).copied().unwrap_or(0)
    }

    /// The texel at integer coordinates; empty outside.
    #[inline(always)]
    pub fn get(&self, x: i32, y: i32) -> Texel {
        if (x as u32) < self.width as u32 && (y as u32) < self.height as u32 {
            self.texels[y as usize * self.width + x as usize]
        } else {
            Texel::default()
        }
    }
}

/// Heights, normals and materials of a part, in its own frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Relief {
    /// Position of the grids' first corner, in millimetres.
    pub min: [f32; 2],
    /// The grids, finest first.
    pub levels: Vec<Level>,
    /// Height of one step in millimetres.
    pub step: f32,
    /// Height of the highest point, in millimetres.
    pub top_mm: f32,
    /// The materials that the cells refer to by index.
    pub materials: Vec<Material>,
}

impl Relief {
    /// Evaluates a recipe on a grid.
    pub fn draw(recipe: &Recipe) -> Self {
        let [x0, y0, x1, y1] = recipe.bounds();
        let cell = ((x1 - x0).max(y1 - y0) / MAX_CELLS).max(MIN_CELL_MM);
        let margin = 3.0 * cell;
        let min = [x0 - margin, y0 - margin];
        // An integer number of cells at the coarsest level.
        let whole = 1usize << (NUM_LEVELS - 1);
        let cells = |extent: f32| (((extent + 2.0 * margin) / cell).ceil() as usize).next_multiple_of(whole);
        let (width, height) = (cells(x1 - x0), cells(y1 - y0));
        let features = recipe.prepare();
        let mut tops = vec![0.0f32; width * height];
        let mut texels = vec![Texel::default(); width * height];
        for y in 0..height {
            for x in 0..width {
                let (px, py) = (min[0] + (x as f32 + 0.5) * cell, min[1] + (y as f32 + 0.5) * cell);
                let mut state = State::EMPTY;
                features.iter().for_each(|feature| feature.apply(px, py, &mut state));
                if state.is_covered() {
                    let idx = y * width + x;
                    tops[idx] = state.top;
                    texels[idx].top = (state.top * STEPS_PER_MM).round().clamp(1.0, 65_535.0) as u16;
                    texels[idx].bottom = (state.bottom * STEPS_PER_MM).round().clamp(0.0, 65_535.0) as u16;
                    texels[idx].material = state.material;
                }
            }
        }
        let top_mm = tops.iter().copied().fold(0.0, f32::max);
        let tiles = Tiles::get();
        let shift = (recipe.grain_seed % 1009) as f32;
        for y in 1..height - 1 {
            for x in 1..width - 1 {
                let idx = y * width + x;
                if tops[idx] <= 0.0 {
                    continue;
                }
                let slope = |before: usize, after: usize| {
                    let limit = |rise: f32, covered: f32| {
                        let wall = covered <= 0.0 || rise.abs() > MIN_WALL_CELLS * cell;
                        (!wall).then_some((rise / cell).clamp(-MAX_SLOPE, MAX_SLOPE))
                    };
                    let back = limit(tops[idx] - tops[before], tops[before]);
                    let ahead = limit(tops[after] - tops[idx], tops[after]);
                    match (back, ahead) {
                        // At the lower or upper edge of a step, the level side determines the normal.
                        (Some(a), Some(b)) if (a - b).abs() > 1.0 => {
                            if a.abs() < b.abs() {
                                a
                            } else {
                                b
                            }
                        }
                        (Some(a), Some(b)) => 0.5 * (a + b),
                        (Some(one), None) | (None, Some(one)) => one,
                        (None, None) => 0.0,
                    }
                };
                let (mut sx, mut sy) = (slope(idx - 1, idx + 1), slope(idx - width, idx + width));
                let place = [min[0] + (x as f32 + 0.5) * cell, min[1] + (y as f32 + 0.5) * cell];
                let material = &recipe.materials[texels[idx].material as usize];
                let (gx, gy, tone) = grain(material, place, shift, tiles);
                sx += gx;
                sy += gy;
                let norm = (1.0 + sx * sx + sy * sy).sqrt();
                texels[idx].normal = [(-127.0 * sx / norm).round() as i8, (-127.0 * sy / norm).round() as i8];
                texels[idx].tone = (128.0 * (1.0 + tone)).clamp(20.0, 255.0) as u8;
            }
        }
        let mut levels = vec![Level::new(width, height, cell, texels)];
        while levels.len() < NUM_LEVELS {
            levels.push(halved(&levels[levels.len() - 1]));
        }
        Self { min, levels, step: 1.0 / STEPS_PER_MM, top_mm, materials: recipe.materials.clone() }
    }

    /// A copy scaled by `factor`.
    pub fn scaled(&self, factor: f32) -> Self {
        let mut made = self.clone();
        made.min = made.min.map(|v| v * factor);
        made.step *= factor;
        made.top_mm *= factor;
        made.levels.iter_mut().for_each(|level| level.cell *= factor);
        made
    }

    /// The coarsest grid whose cells are at most `cell_mm` wide, or the finest grid if all are wider.
    pub fn level_for(&self, cell_mm: f32) -> &Level {
        self.levels.iter().rev().find(|level| level.cell <= cell_mm).unwrap_or(&self.levels[0])
    }

    /// The centre of a cell, in millimetres.
    pub fn place(&self, level: &Level, x: usize, y: usize) -> [f32; 2] {
        [self.min[0] + (x as f32 + 0.5) * level.cell, self.min[1] + (y as f32 + 0.5) * level.cell]
    }
}

/// Slopes and relative shade that a material's grain adds at a position.
fn grain(material: &Material, place: [f32; 2], shift: f32, tiles: &Tiles) -> (f32, f32, f32) {
    let [x, y] = place;
    let mm = material.grain_mm;
    let (u, v) = (x / mm + shift, y / mm + 1.7 * shift);
    let mut slopes = [tiles.grain.at(u, v) * material.grain, tiles.grain.at(u + 91.3, v + 47.9) * material.grain];
    let cloud = tiles.cloud.at(2.1 * x + shift, 2.1 * y - shift);
    let mut tone = material.mottle * (0.7 * cloud + 0.5 * tiles.grain.at(u * 0.7 + 13.0, v * 0.7));
    if let Some(brushing) = material.brushing {
        let (along, across, direction) = match brushing {
            Brushing::Along(angle) => {
                let (sin, cos) = angle.sin_cos();
                (cos * x + sin * y, cos * y - sin * x, [-sin, cos])
            }
            Brushing::Around => {
                let radius = x.hypot(y).max(0.1);
                (y.atan2(x) * radius.min(6.0), radius, [x / radius, y / radius])
            }
        };
        let streak = tiles.streak.at(along * 0.6 + shift, across * 4.0 + shift);
        slopes[0] += 0.07 * streak * direction[0];
        slopes[1] += 0.07 * streak * direction[1];
        tone += 0.06 * streak;
    }
    (slopes[0], slopes[1], tone)
}

/// The grid with cells twice as wide.
fn halved(level: &Level) -> Level {
    let (width, height) = (level.width / 2, level.height / 2);
    let mut texels = Vec::with_capacity(width * height);
    for y in 0..height {
        for x in 0..width {
            let first = 2 * y * level.width + 2 * x;
            let four = [first, first + 1, first + level.width, first + level.width + 1].map(|k| level.texels[k]);
            let covered: Vec<&Texel> = four.iter().filter(|texel| texel.top > 0).collect();
            if covered.len() < 2 {
                texels.push(Texel::default());
                continue;
            }
            let n = covered.len() as i32;
            let mean = |value: fn(&Texel) -> i32| covered.iter().map(|texel| value(texel)).sum::<i32>() / n;
            texels.push(Texel {
                top: mean(|t| t.top.into()) as u16,
                bottom: mean(|t| t.bottom.into()) as u16,
                normal: [mean(|t| t.normal[0].into()) as i8, mean(|t| t.normal[1].into()) as i8],
                material: covered[(x + y) % covered.len()].material,
                tone: mean(|t| t.tone.into()) as u8,
            });
        }
    }
    Level::new(width, height, 2.0 * level.cell, texels)
}

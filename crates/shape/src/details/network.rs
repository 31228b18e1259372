//! The network's weights, its features of one picture, and its comparison of two.
//!
//! ```text
//! photo ──── tower (3 convolutions) ─ 32×32×24 ─┐
//!                                               ├─ |a − b|, a, b ─ 2 convolutions ─ 16×16×48 ─┬─ cells: differs there?
//! picture ── tower, the same weights ───────────┘                                             └─ 2 convolutions ─ pooled ─ log-odds
//! ```

use std::sync::LazyLock;

use pulp::{Arch, Simd, WithSimd};
use safetensors::SafeTensors;

use crate::error::ShapeError;
use crate::layers::{Layer, Linear, add_products, answered, convolved, layer, pooled};

/// Rows and columns of the network's input.
pub(super) const SIDE: usize = 128;
/// Values of a pixel: colour, inside the outline or not, inside the picture or not.
pub(super) const NUM_CHANNELS: usize = 5;
const TOWER: [Layer; 3] = [layer(NUM_CHANNELS, 16, 2), layer(16, 32, 2), layer(32, NUM_FEATURES, 1)];
const NUM_FEATURES: usize = 24;
const COMPARED: [Layer; 4] = [layer(3 * NUM_FEATURES, 48, 2), layer(48, 48, 1), layer(48, 64, 2), layer(64, 64, 1)];
/// Convolutions of [`COMPARED`] before the cells.
const NUM_BEFORE_CELLS: usize = 2;
/// Rows and columns of the cells.
pub(super) const CELLS_SIDE: usize = 16;
/// Pixels of a cell's side.
pub(super) const CELL: usize = SIDE / CELLS_SIDE;
/// Minimum share of a cell inside the outline for the cell to count.
const MIN_INSIDE: f32 = 0.3;
/// Used as the largest log-odds of a cell if no cell counts.
const NO_CELL: f32 = -20.0;
const NUM_OUTPUTS: usize = 64;
/// Mean and maximum of the last convolution's channels, the largest log-odds of a cell, and the mean probability of the
/// cells.
const NUM_POOLED: usize = 2 * NUM_OUTPUTS + 2;
const NUM_HIDDEN: usize = 64;

/// Weights of the network.
#[derive(Debug, Clone)]
pub(super) struct Network {
    tower: Vec<Linear>,
    compared: Vec<Linear>,
    cells: Linear,
    hidden: Linear,
    answer: Linear,
}

/// The comparison of photo and picture.
#[derive(Debug, Clone)]
pub(super) struct Answer {
    /// ln of the odds that the picture shows the part.
    pub(super) log_odds: f32,
    /// For [`CELLS_SIDE`] rows of cells, ln of the odds that the two differ there; `None` outside the outline.
    pub(super) cells: Vec<Option<f32>>,
}

/// The tower's output for one picture, row by row.
#[derive(Debug, Clone)]
pub(super) struct Features(Vec<f32>);

static SHIPPED: LazyLock<Network> = LazyLock::new(|| {
    Network::read(include_bytes!("../../details.safetensors"))
        .expect("the shipped weights are read by a test of this module")
});

impl Network {
    /// The shipped weights.
    pub(super) fn shipped() -> &'static Self {
        &SHIPPED
    }

    /// Reads a safetensors file: `tower.N.weight`, `compared.N.weight`, `cells.weight`, `hidden.weight`,
    /// `answer.weight`, each with outputs first, and a `.bias` for each.
    fn read(bytes: &[u8]) -> Result<Self, ShapeError> {
        let file = SafeTensors::deserialize(bytes).map_err(|error| ShapeError::Weights(error.to_string()))?;
        let convolutions = |name: &str, layers: &[Layer]| {
            let read = |(i, layer): (usize, &Layer)| {
                Linear::read(&file, &format!("{name}.{i}"), &[layer.outputs, layer.inputs, 3, 3])
            };
            layers.iter().enumerate().map(read).collect::<Result<Vec<_>, _>>()
        };
        Ok(Self {
            tower: convolutions("tower", &TOWER)?,
            compared: convolutions("compared", &COMPARED)?,
            cells: Linear::read(&file, "cells", &[1, COMPARED[NUM_BEFORE_CELLS - 1].outputs])?,
            hidden: Linear::read(&file, "hidden", &[NUM_HIDDEN, NUM_POOLED])?,
            answer: Linear::read(&file, "answer", &[1, NUM_HIDDEN])?,
        })
    }

    /// The features of a picture, given [`NUM_CHANNELS`] values per pixel, row by row.
    pub(super) fn features(&self, values: Vec<f32>) -> Features {
        Arch::new().dispatch(Tower { network: self, values })
    }

    /// `inside` marks the pixels in the outline.
    pub(super) fn compared(&self, photo: &Features, picture: &Features, inside: &[bool]) -> Answer {
        Arch::new().dispatch(Comparing { network: self, photo, picture, inside })
    }
}

struct Tower<'a> {
    network: &'a Network,
    values: Vec<f32>,
}

impl WithSimd for Tower<'_> {
    type Output = Features;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Features {
        let weights = &self.network.tower;
        let map = convolved::<16>(&self.values, SIDE, &TOWER[0], &weights[0]);
        let map = convolved::<32>(&map, SIDE / 2, &TOWER[1], &weights[1]);
        Features(convolved::<NUM_FEATURES>(&map, SIDE / 4, &TOWER[2], &weights[2]))
    }
}

struct Comparing<'a> {
    network: &'a Network,
    photo: &'a Features,
    picture: &'a Features,
    inside: &'a [bool],
}

impl WithSimd for Comparing<'_> {
    type Output = Answer;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Answer {
        let Self { network, photo, picture, inside } = self;
        let weights = &network.compared;
        let mut map = Vec::with_capacity(3 * photo.0.len());
        for (a, b) in photo.0.chunks_exact(NUM_FEATURES).zip(picture.0.chunks_exact(NUM_FEATURES)) {
            map.extend(a.iter().zip(b).map(|(a, b)| (a - b).abs()));
            map.extend(a);
            map.extend(b);
        }
        let map = convolved::<48>(&map, SIDE / 4, &COMPARED[0], &weights[0]);
        let map = convolved::<48>(&map, CELLS_SIDE, &COMPARED[1], &weights[1]);
        let cells = cells(&map, network, inside);
        let map = convolved::<64>(&map, CELLS_SIDE, &COMPARED[2], &weights[2]);
        let map = convolved::<NUM_OUTPUTS>(&map, CELLS_SIDE / 2, &COMPARED[3], &weights[3]);
        let mut values = pooled::<NUM_OUTPUTS>(&map);
        let counted = || cells.iter().flatten().copied();
        let probability = |log_odds: f32| 1.0 / (1.0 + (-log_odds).exp());
        values.push(counted().fold(NO_CELL, f32::max) / 4.0);
        values.push(counted().map(probability).sum::<f32>() / counted().count().max(1) as f32);
        Answer { log_odds: answered::<NUM_HIDDEN>(&values, &network.hidden, &network.answer), cells }
    }
}

/// The log-odds of a difference in each cell, as [`Answer::cells`].
fn cells(map: &[f32], network: &Network, inside: &[bool]) -> Vec<Option<f32>> {
    let channels = map.len() / (CELLS_SIDE * CELLS_SIDE);
    let cell = |(i, pixel): (usize, &[f32])| {
        let [x, y] = [i % CELLS_SIDE, i / CELLS_SIDE].map(|k| k * CELL);
        let num_inside =
            (0..CELL).flat_map(|dy| &inside[(y + dy) * SIDE + x..][..CELL]).filter(|is_inside| **is_inside).count();
        (num_inside as f32 > MIN_INSIDE * (CELL * CELL) as f32).then(|| {
            let mut log_odds = [network.cells.bias[0]];
            add_products(&mut log_odds, pixel, &network.cells.weights);
            log_odds[0]
        })
    };
    map.chunks_exact(channels).enumerate().map(cell).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The expected values are PyTorch's, in double precision with the shipped weights.
    #[test]
    fn the_shipped_network_answers_as_pytorch_does() {
        const OF_PAIR: usize = 8;
        for (seed, expected) in [(13, 0.182_157), (500, 0.018_307)] {
            let value = |i: usize| ((i * 7919 + seed * (i / 512)) % 1000) as f32 / 1000.0;
            let is_set = |i: usize| f64::from(value(i)) > 0.3;
            let mask = |i: usize| f32::from(u8::from(is_set(i)));
            let values = |first: usize| {
                let pixel = move |p: usize| {
                    let at = p * OF_PAIR;
                    [value(at + first), value(at + first + 1), value(at + first + 2), mask(at + 6), mask(at + 7)]
                };
                (0..SIDE * SIDE).flat_map(pixel).collect::<Vec<_>>()
            };
            let inside: Vec<bool> = (0..SIDE * SIDE).map(|p| is_set(p * OF_PAIR + 6)).collect();
            let network = Network::shipped();
            let [photo, picture] = [0, 3].map(|first| network.features(values(first)));
            let log_odds = network.compared(&photo, &picture, &inside).log_odds;
            assert!((log_odds - expected).abs() < 1e-3, "{log_odds}, expected {expected}");
        }
    }

    #[test]
    fn other_files_are_refused() {
        let other = Network::read(include_bytes!("../../likeness.safetensors")).unwrap_err();
        assert!(other.to_string().contains("tower.0"), "{other}");
    }
}

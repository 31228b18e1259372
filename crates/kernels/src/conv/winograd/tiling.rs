//! The division of maps into tiles, and the positions of their transformed values.

use crate::scratch::Scratch;
use crate::simd::lanes::LANES;

/// Side of an output tile.
pub(super) const OUTPUT_TILE: usize = 4;
/// Side of an input tile.
pub(super) const INPUT_TILE: usize = 6;
/// Number of products of a tile and a channel.
pub(super) const FREQUENCIES: usize = INPUT_TILE * INPUT_TILE;

/// The tiles of all output maps in sequence: tile t covers pixels from (4·ty, 4·tx) of image n.
#[derive(Clone, Copy)]
pub(super) struct Tiling {
    pub(super) num_images: usize,
    /// Tiles of an image, down and across.
    pub(super) tiles: [usize; 2],
}

impl Tiling {
    pub(super) fn new(num_images: usize, out_size: [usize; 2]) -> Self {
        Self { num_images, tiles: out_size.map(|size| size.div_ceil(OUTPUT_TILE)) }
    }

    pub(super) fn len(&self) -> usize {
        self.num_images * self.tiles[0] * self.tiles[1]
    }

    /// Image of a tile, and the pixel of its first output.
    #[inline(always)]
    pub(super) fn place(&self, tile: usize) -> (usize, [usize; 2]) {
        let [down, across] = self.tiles;
        let (image, tile) = (tile / (down * across), tile % (down * across));
        (image, [tile / across * OUTPUT_TILE, tile % across * OUTPUT_TILE])
    }
}

/// Transformed values of some tiles, `[36, tiles, C]`.
///
/// A cache line of floats separates frequencies: otherwise powers of two would put a tile's 36 values into one set of
/// the cache.
pub(super) struct Frequencies {
    pub(super) values: Scratch,
    pub(super) step: usize,
}

impl Frequencies {
    pub(super) fn new(tiles: usize, channels: usize) -> Self {
        let step = tiles * channels + LANES;
        Self { values: Scratch::take(FREQUENCIES * step), step }
    }
}

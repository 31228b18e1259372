//! JPEG files that no encoder here writes: without tables, and with long runs of zeros in their data.

const START_OF_SCAN: u8 = 0xda;
const HUFFMAN_TABLES: u8 = 0xc4;
/// Width of the pictures of zeros: eight blocks.
const WIDTH: u8 = 64;
/// Bytes of six rows of blocks without a difference: 48 blocks of each of three components, with two bits each. Runs of
/// 32 zeros or more are checked for a gap.
const SIX_ROWS: usize = 36;

/// A JPEG without Huffman tables, as webcams send it.
pub(super) fn without_tables(jpeg: &[u8]) -> Vec<u8> {
    let (mut kept, mut at) = (jpeg[..2].to_vec(), 2);
    while jpeg[at + 1] != START_OF_SCAN {
        let end = at + 2 + usize::from(u16::from_be_bytes([jpeg[at + 2], jpeg[at + 3]]));
        if jpeg[at + 1] != HUFFMAN_TABLES {
            kept.extend_from_slice(&jpeg[at..end]);
        }
        at = end;
    }
    kept.extend_from_slice(&jpeg[at..]);
    kept
}

/// A picture of two colours whose data are nearly all zeros.
pub(super) fn of_zeros() -> Vec<u8> {
    // Three blocks without a difference, then one with a difference of 1: four bits, so that a last byte has two bits.
    let mut data = [0; SIX_ROWS + 1];
    data[..2].copy_from_slice(&[0b0000_0010, 0b1000_0000]);
    of_codes(48, &[], &data)
}

/// A picture of one colour with a restart marker after every six rows of blocks.
pub(super) fn of_zeros_with_restarts() -> Vec<u8> {
    let interval = [0xff, 0xdd, 0, 4, 0, 48];
    let zeros = &[0; SIX_ROWS];
    of_codes(144, &interval, &[zeros.as_slice(), &[0xff, 0xd0], zeros, &[0xff, 0xd1], zeros].concat())
}

/// A picture with Huffman tables of two codes: `0` for no difference or the end of a block, `10` for a number of one bit.
fn of_codes(height: u8, interval: &[u8], data: &[u8]) -> Vec<u8> {
    let quantization: Vec<u8> = [[0xff, 0xdb, 0, 67, 0].as_slice(), &[8; 64]].concat();
    let frame = [0xff, 0xc0, 0, 17, 8, 0, height, 0, WIDTH, 3, 1, 0x11, 0, 2, 0x11, 0, 3, 0x11, 0];
    let table = |class: u8| [[0xff, HUFFMAN_TABLES, 0, 21, class, 1, 1].as_slice(), &[0; 14], &[0, 1]].concat();
    let scan = [0xff, START_OF_SCAN, 0, 12, 3, 1, 0, 2, 0, 3, 0, 0, 63, 0];
    let [differences, others] = [table(0), table(0x10)];
    let parts: [&[u8]; 9] =
        [&[0xff, 0xd8], &quantization, &frame, &differences, &others, interval, &scan, data, &[0xff, 0xd9]];
    parts.concat()
}

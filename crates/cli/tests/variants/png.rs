//! Hand-made PNG files with features that encoders rarely write: interlace, palettes, an Exif block, split data.

use crate::bad_input::crc32;

/// How the samples of a picture are stored.
#[derive(Debug, Clone)]
pub struct Png {
    pub size: [u32; 2],
    /// Row by row; 16-bit samples are big endian.
    pub samples: Vec<u8>,
    pub bytes_per_pixel: usize,
    pub bit_depth: u8,
    /// 0 grey, 2 RGB, 3 palette, 6 RGBA.
    pub color_type: u8,
    pub palette: Vec<u8>,
    /// One of PNG's five filters; 5 changes the filter from row to row.
    pub filter: u8,
    pub is_interlaced: bool,
    /// Number of data chunks.
    pub num_pieces: usize,
    pub orientation: Option<u8>,
}

/// The seven passes of Adam7: first column and row, steps.
const PASSES: [[usize; 4]; 7] =
    [[0, 0, 8, 8], [4, 0, 8, 8], [0, 4, 4, 8], [2, 0, 4, 4], [0, 2, 2, 4], [1, 0, 2, 2], [0, 1, 1, 2]];

impl Png {
    pub fn bytes(&self) -> Vec<u8> {
        let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
        let [width, height] = self.size.map(u32::to_be_bytes);
        let kind = [self.bit_depth, self.color_type, 0, 0, u8::from(self.is_interlaced)];
        chunk(&mut file, *b"IHDR", &[&width[..], &height, &kind].concat());
        if let Some(orientation) = self.orientation {
            chunk(&mut file, *b"eXIf", &exif(orientation));
        }
        if !self.palette.is_empty() {
            chunk(&mut file, *b"PLTE", &self.palette);
        }
        let [width, height] = self.size.map(|side| side as usize);
        let mut rows = Vec::new();
        let passes: &[[usize; 4]] = if self.is_interlaced { &PASSES } else { &[[0, 0, 1, 1]] };
        for [left, top, across, down] in passes {
            let mut above = Vec::new();
            for y in (*top..height).step_by(*down) {
                let pixel = |x: usize| {
                    let at = (y * width + x) * self.bytes_per_pixel;
                    &self.samples[at..at + self.bytes_per_pixel]
                };
                let row: Vec<u8> = (*left..width).step_by(*across).flat_map(pixel).copied().collect();
                let filter = if self.filter == 5 { (y % 5) as u8 } else { self.filter };
                rows.push(filter);
                rows.extend(filtered(&row, &above, self.bytes_per_pixel, filter));
                above = row;
            }
        }
        let data = zlib_stored(&rows);
        data.chunks(data.len().div_ceil(self.num_pieces)).for_each(|piece| chunk(&mut file, *b"IDAT", piece));
        chunk(&mut file, *b"IEND", &[]);
        file
    }
}

/// A big-endian Exif block that contains only the orientation.
fn exif(orientation: u8) -> Vec<u8> {
    [b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".as_slice(), &[orientation], &[0; 6]].concat()
}

fn chunk(file: &mut Vec<u8>, name: [u8; 4], data: &[u8]) {
    file.extend((data.len() as u32).to_be_bytes());
    let start = file.len();
    file.extend(name);
    file.extend(data);
    let checksum = crc32(&file[start..]);
    file.extend(checksum.to_be_bytes());
}

fn filtered(row: &[u8], above: &[u8], step: usize, filter: u8) -> Vec<u8> {
    let before = |line: &[u8], at: usize| at.checked_sub(step).and_then(|at| line.get(at)).copied().unwrap_or(0);
    let predicted = |at: usize| {
        let (left, up, up_left) = (before(row, at), above.get(at).copied().unwrap_or(0), before(above, at));
        match filter {
            0 => 0,
            1 => left,
            2 => up,
            3 => ((u16::from(left) + u16::from(up)) / 2) as u8,
            _ => {
                let [a, b, c] = [left, up, up_left].map(i16::from);
                let distance = |value: i16| (a + b - c - value).abs();
                let [pa, pb, pc] = [a, b, c].map(distance);
                if pa <= pb && pa <= pc {
                    left
                } else if pb <= pc {
                    up
                } else {
                    up_left
                }
            }
        }
    };
    (0..row.len()).map(|at| row[at].wrapping_sub(predicted(at))).collect()
}

/// A zlib stream of stored blocks.
pub fn zlib_stored(bytes: &[u8]) -> Vec<u8> {
    let mut stream = vec![0x78, 0x01];
    let num_blocks = bytes.len().div_ceil(0xffff);
    for (idx, block) in bytes.chunks(0xffff).enumerate() {
        let length = block.len() as u16;
        stream.push(u8::from(idx + 1 == num_blocks));
        stream.extend(length.to_le_bytes());
        stream.extend((!length).to_le_bytes());
        stream.extend(block);
    }
    let (a, b) = bytes.iter().fold((1_u32, 0_u32), |(a, b), byte| {
        let a = (a + u32::from(*byte)) % 65521;
        (a, (a + b) % 65521)
    });
    stream.extend((b << 16 | a).to_be_bytes());
    stream
}

//! Hand-made TIFF files: both byte orders, BigTIFF, four compressions, planes, palettes, floats, an orientation, a
//! thumbnail.

use super::png::zlib_stored;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compression {
    None = 1,
    Lzw = 5,
    Deflate = 8,
    PackBits = 32773,
}

/// A page and its storage format.
#[derive(Debug, Clone)]
pub struct Tiff {
    pub size: [u32; 2],
    /// Row by row, with interleaved channels; a sample's bytes are in the file's byte order.
    pub samples: Vec<u8>,
    pub num_channels: usize,
    pub bytes_per_sample: usize,
    pub is_big_endian: bool,
    pub is_big_tiff: bool,
    pub compression: Compression,
    pub rows_per_strip: usize,
    /// Each channel is stored separately.
    pub is_planar: bool,
    /// 16-bit values: reds, greens, blues.
    pub palette: Option<Vec<u16>>,
    pub is_float: bool,
    pub orientation: Option<u8>,
    /// Number of thumbnails before this page, each of 8×6 pixels; `other_pages` is the number of independent pictures
    /// of this size before the page.
    pub thumbnails: usize,
    pub other_pages: usize,
}

/// A tag with its values, of 16 or of 32 bits.
type Tag = (u16, Vec<u64>, bool);

impl Tiff {
    pub fn bytes(&self) -> Vec<u8> {
        let mut file = match (self.is_big_endian, self.is_big_tiff) {
            (true, true) => b"MM\0\x2b\0\x08\0\0".to_vec(),
            (false, true) => b"II\x2b\0\x08\0\0\0".to_vec(),
            (true, false) => b"MM\0\x2a".to_vec(),
            (false, false) => b"II\x2a\0".to_vec(),
        };
        let mut link_at = file.len();
        file.extend(vec![0; self.offset_width()]);
        for idx in 0..self.thumbnails + self.other_pages {
            let small = Self {
                size: [8, 6],
                samples: vec![90; 48],
                num_channels: 1,
                bytes_per_sample: 1,
                compression: Compression::None,
                rows_per_strip: 6,
                is_planar: false,
                palette: None,
                is_float: false,
                orientation: None,
                ..self.clone()
            };
            link_at = small.append(&mut file, link_at, idx < self.thumbnails);
        }
        self.append(&mut file, link_at, false);
        file
    }

    fn offset_width(&self) -> usize {
        if self.is_big_tiff { 8 } else { 4 }
    }

    fn number(&self, value: u64, width: usize) -> Vec<u8> {
        match self.is_big_endian {
            true => value.to_be_bytes()[8 - width..].to_vec(),
            false => value.to_le_bytes()[..width].to_vec(),
        }
    }

    /// Appends the page, writes its offset at `link_at`, and returns the position of the page's link to the next page.
    fn append(&self, file: &mut Vec<u8>, link_at: usize, is_thumbnail: bool) -> usize {
        let mut offsets = Vec::new();
        let mut lengths = Vec::new();
        for strip in self.strips() {
            let data = compressed(&strip, self.compression);
            offsets.push(file.len() as u64);
            lengths.push(data.len() as u64);
            file.extend(data);
        }
        let [width, height] = self.size.map(u64::from);
        let photometric = match (self.num_channels, &self.palette) {
            (_, Some(_)) => 3,
            (1, None) => 1,
            _ => 2,
        };
        let mut tags: Vec<Tag> = vec![
            (254, vec![u64::from(is_thumbnail)], true),
            (256, vec![width], false),
            (257, vec![height], false),
            (258, vec![8 * self.bytes_per_sample as u64; self.num_channels], false),
            (259, vec![self.compression as u64], false),
            (262, vec![photometric], false),
            (273, offsets, true),
            (277, vec![self.num_channels as u64], false),
            (278, vec![self.rows_per_strip as u64], false),
            (279, lengths, true),
            (284, vec![if self.is_planar { 2 } else { 1 }], false),
        ];
        tags.extend(self.orientation.map(|orientation| (274, vec![u64::from(orientation)], false)));
        tags.extend(self.palette.as_ref().map(|colors| (320, colors.iter().copied().map(u64::from).collect(), false)));
        tags.extend((self.num_channels == 4).then(|| (338, vec![2], false)));
        tags.extend(self.is_float.then(|| (339, vec![3; self.num_channels], false)));
        tags.sort();
        let mut entries = self.number(tags.len() as u64, if self.is_big_tiff { 8 } else { 2 });
        for (tag, values, is_long) in tags {
            let data: Vec<u8> =
                values.iter().flat_map(|value| self.number(*value, if is_long { 4 } else { 2 })).collect();
            entries.extend(self.number(tag.into(), 2));
            entries.extend(self.number(if is_long { 4 } else { 3 }, 2));
            entries.extend(self.number(values.len() as u64, self.offset_width()));
            if data.len() <= self.offset_width() {
                entries.extend(&data);
                entries.extend(vec![0; self.offset_width() - data.len()]);
            } else {
                entries.extend(self.number(file.len() as u64, self.offset_width()));
                file.extend(data);
            }
        }
        let at = self.number(file.len() as u64, self.offset_width());
        file.splice(link_at..link_at + self.offset_width(), at);
        file.extend(entries);
        let own_link_at = file.len();
        file.extend(vec![0; self.offset_width()]);
        own_link_at
    }

    fn strips(&self) -> Vec<Vec<u8>> {
        let pixel_bytes = self.num_channels * self.bytes_per_sample;
        let of_plane = |bytes: &[u8], width: usize| -> Vec<Vec<u8>> {
            bytes.chunks(self.rows_per_strip * self.size[0] as usize * width).map(<[u8]>::to_vec).collect()
        };
        if !self.is_planar {
            return of_plane(&self.samples, pixel_bytes);
        }
        let plane = |channel: usize| -> Vec<u8> {
            let start = channel * self.bytes_per_sample;
            let pixels = self.samples.chunks_exact(pixel_bytes);
            pixels.flat_map(|pixel| &pixel[start..start + self.bytes_per_sample]).copied().collect()
        };
        (0..self.num_channels).flat_map(|channel| of_plane(&plane(channel), self.bytes_per_sample)).collect()
    }
}

/// Encodes bytes in the format of a compression. No result is smaller than the bytes.
fn compressed(bytes: &[u8], compression: Compression) -> Vec<u8> {
    match compression {
        Compression::None => bytes.to_vec(),
        Compression::Deflate => zlib_stored(bytes),
        Compression::PackBits => bytes.chunks(128).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect(),
        Compression::Lzw => lzw(bytes),
    }
}

/// Codes of nine bits; the table is cleared before codes would become longer.
fn lzw(bytes: &[u8]) -> Vec<u8> {
    const CLEAR: u16 = 256;
    const END: u16 = 257;
    let runs = bytes.chunks(200).flat_map(|run| std::iter::once(CLEAR).chain(run.iter().copied().map(u16::from)));
    let (mut packed, mut bits, mut num_bits) = (Vec::new(), 0_u32, 0);
    for code in runs.chain([END]) {
        bits = bits << 9 | u32::from(code);
        num_bits += 9;
        while num_bits >= 8 {
            num_bits -= 8;
            packed.push((bits >> num_bits) as u8);
            bits &= (1 << num_bits) - 1;
        }
    }
    packed.push((bits << (8 - num_bits)) as u8);
    packed
}

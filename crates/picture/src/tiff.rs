//! Selects the main page of a TIFF, and applies palettes.
//!
//! Pages form a chain of directories. A reduced-size page (a thumbnail, which DNG, NEF and microscopes put first) is
//! marked by a bit, and the full-size page may be a subdirectory. `image` decodes only the first page, so the main page
//! is moved to the front.

use std::borrow::Cow;

use image::{DynamicImage, Rgb, RgbImage};

use crate::error::PictureError;

const NEW_SUBFILE_TYPE: u16 = 254;
const SUBFILE_TYPE: u16 = 255;
const BITS_PER_SAMPLE: u16 = 258;
const PHOTOMETRIC: u16 = 262;
const COLOR_MAP: u16 = 320;
const SUB_DIRECTORIES: u16 = 330;

/// Bits of `NEW_SUBFILE_TYPE`: reduced size, transparency mask.
const REDUCED: u64 = 1;
const MASK: u64 = 4;
/// `SUBFILE_TYPE` of a reduced-size page.
const OLD_REDUCED: u64 = 2;
/// Values of `PHOTOMETRIC`.
const BLACK_IS_ZERO: u16 = 1;
const PALETTE: u64 = 3;
const COLOR_FILTER_ARRAY: u64 = 32803;
const LINEAR_RAW: u64 = 34892;

/// First private tag; the decoder reads no private tags.
const FIRST_PRIVATE_TAG: u16 = 32768;
/// Maximum number of pages.
const MAX_PAGES: usize = 256;
/// Maximum number of tags of a page, and of values read of one tag.
const MAX_ENTRIES: u64 = 4096;
const MAX_VALUES: u64 = 3 << 16;

/// A TIFF whose first page is the main page.
pub(crate) struct FullPage<'a> {
    pub(crate) bytes: Cow<'a, [u8]>,
    /// Colours of the samples, if they are indices.
    pub(crate) palette: Option<Palette>,
}

/// Colours by index.
pub(crate) struct Palette(Vec<[u8; 3]>);

impl Palette {
    /// Converts a picture whose samples are colour indices.
    pub(crate) fn applied(&self, numbers: &DynamicImage) -> RgbImage {
        let numbers = numbers.to_luma8();
        let color = |number: u8| self.0.get(usize::from(number)).copied().unwrap_or_default();
        RgbImage::from_fn(numbers.width(), numbers.height(), |x, y| Rgb(color(numbers.get_pixel(x, y)[0])))
    }
}

/// Whether the bytes begin with a BigTIFF header, which has offsets of 64 bits.
pub(crate) fn is_big_tiff(bytes: &[u8]) -> bool {
    bytes.starts_with(b"II\x2b\0\x08\0\0\0") || bytes.starts_with(b"MM\0\x2b\0\x08\0\0")
}

/// Finds the single full-size page and moves it to the front.
///
/// # Errors
/// There are several full-size pages; the file is a raw photo; a palette does not have 8 bits; or the values of a tag
/// of the first or the main page, except a private tag, need more bytes than the file has. The decoder would allocate memory for
/// such values before reading them. Structures that cannot be parsed are left to the decoder.
pub(crate) fn full_page(bytes: &[u8]) -> Result<FullPage<'_>, PictureError> {
    let whole = FullPage { bytes: Cow::Borrowed(bytes), palette: None };
    let Some(file) = File::new(bytes) else { return Ok(whole) };
    if let Some(first) = file.first_page().and_then(|at| file.page(at)) {
        first.check_values(&file)?;
    }
    let Some(pages) = file.pages() else { return Ok(whole) };
    let unsupported = |found: String, remedy| PictureError::UnsupportedKind { format: "TIFF", found, remedy };
    let mut full = pages.iter().filter(|page| page.is_full(&file));
    let (page, further) = (full.next(), full.count());
    // Without a full-size page, the first page is used.
    let Some(page) = page.or(pages.first()) else { return Ok(whole) };
    page.check_values(&file)?;
    if further > 0 {
        let found = format!("{} full-size pages, none of which is marked as the picture", further + 1);
        return Err(unsupported(found, "save the page in a separate file"));
    }
    let photometric = page.number(&file, PHOTOMETRIC);
    if let Some(COLOR_FILTER_ARRAY | LINEAR_RAW) = photometric {
        return Err(unsupported("a raw photo".to_owned(), "develop it and export it as JPEG, PNG or TIFF"));
    }
    let is_first = file.first_page() == Some(page.at);
    if photometric != Some(PALETTE) {
        let bytes = if is_first { Cow::Borrowed(bytes) } else { Cow::Owned(file.with_first_page(page.at)) };
        return Ok(FullPage { bytes, palette: None });
    }
    let bits = page.number(&file, BITS_PER_SAMPLE).unwrap_or(1);
    let palette = page.palette(&file).filter(|_| bits == 8);
    let palette =
        palette.ok_or_else(|| unsupported(format!("a palette of {bits} bits"), "export it with 8 bits, or as RGB"))?;
    let mut patched = file.with_first_page(page.at);
    if let Some(entry) = page.entry(PHOTOMETRIC) {
        file.put_short(&mut patched, entry.value_at, BLACK_IS_ZERO);
    }
    Ok(FullPage { bytes: Cow::Owned(patched), palette: Some(palette) })
}

/// A file with its byte order and offset size.
struct File<'a> {
    bytes: &'a [u8],
    is_little_endian: bool,
    is_big: bool,
}

struct Page {
    /// Position of the page's directory in the file.
    at: u64,
    entries: Vec<Entry>,
    next: u64,
}

struct Entry {
    tag: u16,
    /// Bytes per value.
    width: usize,
    count: u64,
    /// Position of the values.
    value_at: u64,
}

impl<'a> File<'a> {
    fn new(bytes: &'a [u8]) -> Option<Self> {
        let is_little_endian = match bytes.get(..4)? {
            [b'I', b'I', 0x2a | 0x2b, 0] => true,
            [b'M', b'M', 0, 0x2a | 0x2b] => false,
            _ => return None,
        };
        Some(Self { bytes, is_little_endian, is_big: is_big_tiff(bytes) })
    }

    /// An unsigned number of `width` bytes.
    fn number(&self, at: u64, width: usize) -> Option<u64> {
        let at = usize::try_from(at).ok()?;
        let bytes = self.bytes.get(at..at.checked_add(width)?)?;
        let append = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        Some(match self.is_little_endian {
            true => bytes.iter().rev().fold(0, append),
            false => bytes.iter().fold(0, append),
        })
    }

    /// Size of an offset in bytes, and the position in the header of the first page's offset.
    fn offset_width(&self) -> (usize, u64) {
        if self.is_big { (8, 8) } else { (4, 4) }
    }

    fn first_page(&self) -> Option<u64> {
        let (width, at) = self.offset_width();
        self.number(at, width)
    }

    /// All pages of the chain, each followed by its subdirectories; `None` if the chain is broken, circular
    /// or too long.
    fn pages(&self) -> Option<Vec<Page>> {
        let mut pages: Vec<Page> = Vec::new();
        let mut at = self.first_page()?;
        while at != 0 {
            let page = self.page(at)?;
            let further = page.entry(SUB_DIRECTORIES);
            // The tag may have thousands of values, which may all lead to one directory.
            if further.is_some_and(|entry| entry.count > MAX_PAGES as u64) {
                return None;
            }
            let mut further = further.map(|entry| entry.values(self)).unwrap_or_default();
            at = page.next;
            pages.push(page);
            further.retain(|sub| *sub != 0 && pages.iter().all(|known| known.at != *sub));
            for sub in further {
                pages.push(self.page(sub)?);
            }
            // This check also ends a circular chain.
            if pages.len() > MAX_PAGES {
                return None;
            }
        }
        Some(pages)
    }

    fn page(&self, at: u64) -> Option<Page> {
        let (count_width, entry_bytes) = if self.is_big { (8, 20) } else { (2, 12) };
        let (offset_width, _) = self.offset_width();
        let count = self.number(at, count_width).filter(|count| *count <= MAX_ENTRIES)?;
        let first = at.checked_add(count_width as u64)?;
        let entry = |idx: u64| {
            let at = first + idx * entry_bytes;
            let width = match self.number(at + 2, 2)? {
                3 | 8 => 2,
                4 | 9 | 13 => 4,
                5 | 10 | 12 | 16..=18 => 8,
                _ => 1,
            };
            let count = self.number(at + 4, offset_width)?;
            let inline_at = at + 4 + offset_width as u64;
            let is_inline = count.checked_mul(width as u64)? <= offset_width as u64;
            let value_at = if is_inline { inline_at } else { self.number(inline_at, offset_width)? };
            Some(Entry { tag: self.number(at, 2)? as u16, width, count, value_at })
        };
        let entries = (0..count).map(entry).collect::<Option<_>>()?;
        Some(Page { at, entries, next: self.number(first + count * entry_bytes, offset_width)? })
    }

    /// A copy of the file with a different first page.
    fn with_first_page(&self, at: u64) -> Vec<u8> {
        let mut bytes = self.bytes.to_vec();
        let (width, place) = self.offset_width();
        let place = place as usize;
        let number = if self.is_little_endian { at.to_le_bytes() } else { at.to_be_bytes() };
        let number = if self.is_little_endian { &number[..width] } else { &number[8 - width..] };
        bytes[place..place + width].copy_from_slice(number);
        bytes
    }

    fn put_short(&self, bytes: &mut [u8], at: u64, value: u16) {
        let number = if self.is_little_endian { value.to_le_bytes() } else { value.to_be_bytes() };
        if let Some(place) = usize::try_from(at).ok().and_then(|at| bytes.get_mut(at..at + 2)) {
            place.copy_from_slice(&number);
        }
    }
}

impl Page {
    /// Checks that the values of each tag that the decoder reads can be in the file.
    fn check_values(&self, file: &File<'_>) -> Result<(), PictureError> {
        let Some(entry) = self.entries.iter().find(|entry| !entry.can_fit(file)) else { return Ok(()) };
        let reason = format!("tag {} has {} values, more than the file has bytes", entry.tag, entry.count);
        Err(PictureError::DamagedImage { format: "TIFF", reason })
    }

    fn entry(&self, tag: u16) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.tag == tag)
    }

    /// The first value of a tag.
    fn number(&self, file: &File<'_>, tag: u16) -> Option<u64> {
        let entry = self.entry(tag)?;
        file.number(entry.value_at, entry.width)
    }

    fn is_full(&self, file: &File<'_>) -> bool {
        let kind = self.number(file, NEW_SUBFILE_TYPE).unwrap_or(0);
        kind & (REDUCED | MASK) == 0 && self.number(file, SUBFILE_TYPE) != Some(OLD_REDUCED)
    }

    fn palette(&self, file: &File<'_>) -> Option<Palette> {
        let values = self.entry(COLOR_MAP)?.values(file);
        let count = values.len() / 3;
        // All red values, followed by green and blue, of 16 bits each.
        let color = |idx: usize| [0, 1, 2].map(|channel| (values[channel * count + idx] >> 8) as u8);
        (count > 0).then(|| Palette((0..count).map(color).collect()))
    }
}

impl Entry {
    fn can_fit(&self, file: &File<'_>) -> bool {
        let size = self.count.checked_mul(self.width as u64);
        self.tag >= FIRST_PRIVATE_TAG || size.is_some_and(|size| size <= file.bytes.len() as u64)
    }

    fn values(&self, file: &File<'_>) -> Vec<u64> {
        (0..self.count.min(MAX_VALUES))
            .map_while(|idx| file.number(self.value_at + idx * self.width as u64, self.width))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ImageLimits, decode_image};

    const ORIENTATION: u16 = 274;

    /// A page of a test TIFF: size, bits and photometric interpretation, samples, further tags with values of 16 bits.
    struct TestPage {
        size: [u16; 2],
        is_gray: bool,
        samples: Vec<u8>,
        tags: Vec<(u16, Vec<u16>)>,
    }

    fn rgb(size: [u16; 2], color: [u8; 3], subfile: u16) -> TestPage {
        let samples = color.repeat(usize::from(size[0]) * usize::from(size[1]));
        TestPage { size, is_gray: false, samples, tags: vec![(NEW_SUBFILE_TYPE, vec![subfile])] }
    }

    /// Makes a little-endian file, or BigTIFF in big-endian order.
    fn file(pages: &[TestPage], is_big: bool) -> Vec<u8> {
        let number = |value: u64, width: usize| {
            if is_big { value.to_be_bytes()[8 - width..].to_vec() } else { value.to_le_bytes()[..width].to_vec() }
        };
        let offset_width = if is_big { 8 } else { 4 };
        let mut bytes = if is_big { b"MM\0\x2b\0\x08\0\0".to_vec() } else { b"II\x2a\0".to_vec() };
        let mut link_at = bytes.len();
        bytes.extend(number(0, offset_width));
        for page in pages {
            let channels: u64 = if page.is_gray { 1 } else { 3 };
            let samples_at = bytes.len() as u64;
            bytes.extend(&page.samples);
            let mut tags: Vec<(u16, Vec<u64>, u16)> = vec![
                (256, vec![page.size[0].into()], 3),
                (257, vec![page.size[1].into()], 3),
                (BITS_PER_SAMPLE, vec![8; channels as usize], 3),
                (259, vec![1], 3),
                (PHOTOMETRIC, vec![if page.is_gray { 1 } else { 2 }], 3),
                (273, vec![samples_at], 4),
                (277, vec![channels], 3),
                (278, vec![page.size[1].into()], 3),
                (279, vec![page.samples.len() as u64], 4),
            ];
            for (tag, values) in &page.tags {
                tags.retain(|(known, ..)| known != tag);
                tags.push((*tag, values.iter().map(|value| u64::from(*value)).collect(), 3));
            }
            tags.sort();
            let mut entries = number(tags.len() as u64, if is_big { 8 } else { 2 });
            for (tag, values, kind) in tags {
                let data: Vec<u8> =
                    values.iter().flat_map(|value| number(*value, if kind == 3 { 2 } else { 4 })).collect();
                entries.extend(number(tag.into(), 2));
                entries.extend(number(kind.into(), 2));
                entries.extend(number(values.len() as u64, offset_width));
                if data.len() <= offset_width {
                    entries.extend(&data);
                    entries.extend(vec![0; offset_width - data.len()]);
                } else {
                    entries.extend(number(bytes.len() as u64, offset_width));
                    bytes.extend(data);
                }
            }
            let at = bytes.len() as u64;
            bytes.splice(link_at..link_at + offset_width, number(at, offset_width));
            bytes.extend(entries);
            link_at = bytes.len();
            bytes.extend(number(0, offset_width));
        }
        bytes
    }

    fn decoded(bytes: &[u8]) -> Result<RgbImage, PictureError> {
        decode_image(bytes, &ImageLimits::default())
    }

    #[test]
    fn a_tag_with_more_values_than_the_file_has_bytes_is_refused_before_memory_is_taken() {
        for is_big in [false, true] {
            let mut bytes = file(&[rgb([4, 3], [10, 20, 30], 0)], is_big);
            assert!(decoded(&bytes).is_ok());
            let strips = if is_big { [1, 17, 0, 4] } else { [17, 1, 4, 0] };
            let at = bytes.windows(4).position(|window| window == strips).unwrap() + 4;
            let count = 50_000_000_u64;
            let number = if is_big { count.to_be_bytes().to_vec() } else { count.to_le_bytes()[..4].to_vec() };
            bytes.splice(at..at + number.len(), number);
            let error = decoded(&bytes).unwrap_err().to_string();
            assert!(error.contains("tag 273 has 50000000 values"), "{error}");
            assert!(!crate::is_turned_by_exif(&bytes));
        }
    }

    #[test]
    fn the_page_in_full_size_is_read() {
        for is_big in [false, true] {
            let [small, large] = [rgb([4, 3], [9, 9, 9], 1), rgb([8, 6], [10, 20, 30], 0)];
            let picture = decoded(&file(&[small, large], is_big)).unwrap();
            assert_eq!((picture.dimensions(), picture.get_pixel(7, 5).0), ((8, 6), [10, 20, 30]), "big: {is_big}");
            let [large, small] = [rgb([8, 6], [10, 20, 30], 0), rgb([4, 3], [9, 9, 9], 1)];
            assert_eq!(decoded(&file(&[large, small], is_big)).unwrap().dimensions(), (8, 6));
        }
        // A thumbnail is used if there is no full-size page.
        assert_eq!(decoded(&file(&[rgb([4, 3], [9, 9, 9], 1)], false)).unwrap().dimensions(), (4, 3));
    }

    #[test]
    fn the_orientation_is_that_of_the_page_in_full_size() {
        // Orientation 6: rotate by 90° clockwise for viewing.
        let turned = |mut page: TestPage| {
            page.tags.push((ORIENTATION, vec![6]));
            page
        };
        let [small, large] = [|| rgb([4, 3], [9, 9, 9], 1), || rgb([8, 6], [10, 20, 30], 0)];
        for is_big in [false, true] {
            for (pages, size) in [([small(), turned(large())], (6, 8)), ([turned(small()), large()], (8, 6))] {
                let bytes = file(&pages, is_big);
                assert_eq!(decoded(&bytes).unwrap().dimensions(), size);
                assert_eq!(crate::is_turned_by_exif(&bytes), size == (6, 8));
            }
        }
    }

    #[test]
    fn several_full_pages_and_raw_photos_are_told() {
        let pages = [rgb([8, 6], [1, 2, 3], 0), rgb([8, 6], [4, 5, 6], 0)];
        let error = decoded(&file(&pages, false)).unwrap_err().to_string();
        assert!(error.contains("2 full-size pages") && error.contains("save the page"), "{error}");
        let mut raw = rgb([8, 6], [1, 2, 3], 0);
        raw.tags.push((PHOTOMETRIC, vec![COLOR_FILTER_ARRAY as u16]));
        let error = decoded(&file(&[rgb([4, 3], [9, 9, 9], 1), raw], false)).unwrap_err().to_string();
        assert!(error.contains("a raw photo") && error.contains("export"), "{error}");
    }

    #[test]
    fn a_palette_gives_its_colours() {
        let mut colors = vec![0_u16; 3 * 256];
        for (channel, value) in [200, 100, 50].into_iter().enumerate() {
            colors[256 * channel + 7] = value << 8;
        }
        let tags = vec![(COLOR_MAP, colors), (PHOTOMETRIC, vec![PALETTE as u16])];
        let page = TestPage { size: [5, 4], is_gray: true, samples: vec![7; 20], tags };
        for is_big in [false, true] {
            let picture = decoded(&file(std::slice::from_ref(&page), is_big)).unwrap();
            assert_eq!(picture.get_pixel(2, 2).0, [200, 100, 50], "big: {is_big}");
        }
    }

    #[test]
    fn a_longer_chain_than_the_limit_is_not_followed() {
        let thumbnails = |count: usize| {
            let mut pages: Vec<TestPage> = (0..count).map(|_| rgb([4, 3], [9, 9, 9], 1)).collect();
            pages.push(rgb([8, 6], [10, 20, 30], 0));
            decoded(&file(&pages, false)).unwrap().dimensions()
        };
        assert_eq!(thumbnails(MAX_PAGES - 1), (8, 6));
        assert_eq!(thumbnails(MAX_PAGES), (4, 3), "the first page is used");
    }

    /// A little-endian file that consists of one directory with these entries, at position 8.
    fn directory(entries: &[[u8; 12]]) -> Vec<u8> {
        let mut bytes = b"II\x2a\0\x08\0\0\0".to_vec();
        bytes.extend((entries.len() as u16).to_le_bytes());
        entries.iter().for_each(|entry| bytes.extend(entry));
        bytes.extend([0; 4]);
        bytes
    }

    fn entry(tag: u16, count: u32, value: u32) -> [u8; 12] {
        // Kind 4: numbers of 32 bits.
        let parts = [&tag.to_le_bytes()[..], &[4, 0], &count.to_le_bytes(), &value.to_le_bytes()];
        parts.concat().try_into().unwrap()
    }

    #[test]
    fn more_subdirectories_than_pages_are_not_read() {
        // All offsets, which follow the first directory, lead to one directory with many tags.
        let pages = |count: u32| {
            let mut bytes = directory(&[entry(SUB_DIRECTORIES, count, 26)]);
            bytes.extend((26 + 4 * count).to_le_bytes().repeat(count as usize));
            bytes.extend(&directory(&[entry(FIRST_PRIVATE_TAG, 1, 0); 100])[8..]);
            File::new(&bytes).unwrap().pages().map(|pages| pages.len())
        };
        let most = MAX_PAGES as u32;
        assert_eq!(pages(most - 1), Some(MAX_PAGES));
        assert_eq!(pages(most + 1), None);
        // The number of offsets decides, not the number of pages: here all offsets lead to the first directory, which
        // is not read again.
        let own = |count: u32| {
            let mut bytes = directory(&[entry(SUB_DIRECTORIES, count, 26)]);
            bytes.extend(8u32.to_le_bytes().repeat(count as usize));
            File::new(&bytes).unwrap().pages().map(|pages| pages.len())
        };
        assert_eq!((own(most), own(most + 1)), (Some(1), None));
    }

    #[test]
    fn a_tag_with_more_values_than_the_file_has_bytes_is_refused_in_each_page() {
        let pages = [rgb([4, 3], [9, 9, 9], REDUCED as u16), rgb([8, 6], [5, 5, 5], 0)];
        let whole = file(&pages, false);
        assert_eq!(decoded(&whole).unwrap().dimensions(), (8, 6));
        let pages: Vec<u64> = File::new(&whole).unwrap().pages().unwrap().iter().map(|page| page.at).collect();
        for at in pages {
            // The width, the page's second tag: the number of values follows the tag and the kind of its values.
            let count_at = at as usize + 2 + 12 + 4;
            let mut damaged = whole.clone();
            damaged[count_at..count_at + 4].copy_from_slice(&100_000_000u32.to_le_bytes());
            let told = decoded(&damaged).unwrap_err().to_string();
            assert!(told.contains("has 100000000 values, more than the file has bytes"), "{told}");
        }
    }

    #[test]
    fn numbers_of_32_bits_are_unsupported_and_not_damaged() {
        // One channel of floating-point numbers: sample format 3.
        let tags = vec![(BITS_PER_SAMPLE, vec![32]), (339, vec![3])];
        let page = TestPage { size: [4, 3], samples: vec![0; 4 * 4 * 3], is_gray: true, tags };
        let told = decoded(&file(&[page], false)).unwrap_err().to_string();
        assert!(told.starts_with("unsupported kind of TIFF image: ") && told.contains("8 bits per channel"), "{told}");
    }

    #[test]
    fn tags_of_a_page_and_values_of_a_tag_are_bounded() {
        let most = MAX_ENTRIES as usize;
        for (count, is_read) in [(most, true), (most + 1, false)] {
            let bytes = directory(&vec![entry(FIRST_PRIVATE_TAG, 1, 0); count]);
            assert_eq!(File::new(&bytes).unwrap().page(8).is_some(), is_read, "{count} tags");
        }
        let count = 2 * MAX_VALUES as u32;
        let mut bytes = directory(&[entry(SUB_DIRECTORIES, count, 26)]);
        bytes.extend(vec![0; 4 * count as usize]);
        let file = File::new(&bytes).unwrap();
        let values = file.page(8).unwrap().entry(SUB_DIRECTORIES).unwrap().values(&file);
        assert_eq!(values.len() as u64, MAX_VALUES);
    }

    #[test]
    fn a_chain_in_a_circle_ends() {
        let mut bytes = file(&[rgb([4, 3], [9, 9, 9], 0)], false);
        let first = bytes[4..8].to_vec();
        let end = bytes.len() - 4;
        bytes.splice(end.., first);
        assert!(decoded(&bytes).unwrap_err().to_string().contains("cycle"));
    }
}

//! The part of the zip format that torch uses: entries without compression, with checksums, including zip64.
//!
//! Entries are read in place and never unpacked to disk. A name that leads out of a folder is still rejected,
//! because no regular writer makes one.

use std::collections::BTreeMap;

use crate::error::{Result, WeightsError, printable};
use crate::source::{Scanner, Source, Span};

/// Maximum number of entries; a state dict has one for each tensor.
const MAX_ENTRIES: u64 = 100_000;
/// Maximum size of the list of entries, with about 100 bytes per entry.
const MAX_DIRECTORY_BYTES: u64 = 16 << 20;
/// Size of the end record with the longest comment.
const MAX_END_BYTES: u64 = 22 + 0xffff;
/// Bytes per step of a checksum.
const PIECE: usize = 1 << 20;

const END_RECORD: u32 = 0x0605_4b50;
const END_RECORD_64: u32 = 0x0606_4b50;
const END_LOCATOR_64: u32 = 0x0706_4b50;
const DIRECTORY_ENTRY: u32 = 0x0201_4b50;
const LOCAL_HEADER: u32 = 0x0403_4b50;

#[derive(Debug, Clone, Copy)]
struct Entry {
    header_offset: u64,
    size: u64,
    crc32: u32,
    is_stored: bool,
}

/// An archive's list of entries.
pub(crate) struct ZipArchive {
    entries: BTreeMap<String, Entry>,
}

fn damaged(expected: impl Into<String>, found: impl Into<String>) -> WeightsError {
    WeightsError::damaged("zip archive", expected, found)
}

/// Reads the little-endian fields of a record in memory, front to back.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        match self.0.split_first_chunk::<N>() {
            Some((field, rest)) => {
                self.0 = rest;
                Ok(*field)
            }
            None => Err(damaged("whole records", "one cut short")),
        }
    }

    fn u16(&mut self) -> Result<u16> {
        self.take().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Result<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn bytes(&mut self, len: usize) -> Result<&[u8]> {
        match self.0.split_at_checked(len) {
            Some((bytes, rest)) => {
                self.0 = rest;
                Ok(bytes)
            }
            None => Err(damaged("whole records", "one cut short")),
        }
    }
}

/// Reads the number of entries and the position of the directory.
fn find_directory(source: &mut Source) -> Result<(u64, Span)> {
    let tail_len = source.len().min(MAX_END_BYTES);
    let tail_at = source.len() - tail_len;
    let tail = source.read_span(Span { offset: tail_at, len: tail_len })?;
    let magic = END_RECORD.to_le_bytes();
    let Some(at) = tail.windows(4).rposition(|window| window == magic) else {
        return Err(damaged("an end record", "none: the file was cut short"));
    };
    let mut end = Fields(&tail[at + 4..]);
    end.bytes(6)?;
    let count = u64::from(end.u16()?);
    let (len, offset) = (u64::from(end.u32()?), u64::from(end.u32()?));
    let comment_len = end.u16()?;
    if end.0.len() != usize::from(comment_len) {
        let expected = format!("a comment of {comment_len} bytes at the end");
        return Err(damaged(expected, format!("{} bytes", end.0.len())));
    }
    // A locator before the end record points to the record with wide fields.
    let locator = at.checked_sub(20).map(|locator_at| Fields(&tail[locator_at..at]));
    if let Some(mut locator) = locator
        && locator.u32()? == END_LOCATOR_64
    {
        locator.bytes(4)?;
        let record_at = locator.u64()?;
        let record = source.read_span(Span { offset: record_at, len: 56 })?;
        let mut record = Fields(&record);
        if record.u32()? != END_RECORD_64 {
            return Err(damaged("a zip64 end record", "other bytes"));
        }
        record.bytes(28)?;
        let count = record.u64()?;
        let (len, offset) = (record.u64()?, record.u64()?);
        return Ok((count, Span { offset, len }));
    }
    Ok((count, Span { offset, len }))
}

/// Whether a name stays inside the folder to which it is unpacked.
fn is_inside(name: &str) -> bool {
    let absolute = name.starts_with('/') || name.contains('\\') || name.contains(':') || name.contains('\0');
    !absolute && name.split('/').all(|part| part != "..")
}

impl ZipArchive {
    /// Reads the list of entries.
    ///
    /// # Errors
    /// A truncated or altered archive; names that lead out of a folder; entries that are together larger than the file.
    pub fn read(source: &mut Source) -> Result<Self> {
        let (count, directory) = find_directory(source)?;
        if count > MAX_ENTRIES || directory.len > MAX_DIRECTORY_BYTES {
            let what = "entries of the zip archive".to_owned();
            return Err(WeightsError::TooLarge { what, most: MAX_ENTRIES, found: count.max(directory.len / 46) });
        }
        let directory = source.read_span(directory)?;
        let mut fields = Fields(&directory);
        let mut entries = BTreeMap::new();
        let mut total = 0u64;
        for _ in 0..count {
            let (name, entry) = read_entry(&mut fields)?;
            total = total.saturating_add(entry.size);
            if entries.insert(name.clone(), entry).is_some() {
                return Err(damaged("each name once", format!("{} twice", printable(&name))));
            }
        }
        // Overlapping entries would let a small file represent a large one.
        if total > source.len() {
            return Err(damaged(format!("entries of at most {} bytes", source.len()), format!("{total} bytes")));
        }
        Ok(Self { entries })
    }

    /// The one name that ends with `suffix`.
    pub fn only_name_ending_with(&self, suffix: &str) -> Result<&str> {
        let mut names = self.entries.keys().filter(|name| name.ends_with(suffix));
        match (names.next(), names.next()) {
            (Some(name), None) => Ok(name),
            (None, _) => Err(damaged(format!("an entry …{suffix}"), "none: not a torch checkpoint")),
            _ => Err(damaged(format!("one entry …{suffix}"), "several")),
        }
    }

    /// The position of an entry's bytes, after checking their checksum; `None` if there is no such entry.
    pub fn locate(&self, source: &mut Source, name: &str) -> Result<Option<Span>> {
        let Some(entry) = self.entries.get(name) else {
            return Ok(None);
        };
        if !entry.is_stored {
            return Err(damaged("entries stored as they are", format!("{} compressed", printable(name))));
        }
        let header = Span { offset: entry.header_offset, len: source.len().saturating_sub(entry.header_offset) };
        let mut scanner = Scanner::new(source, header)?;
        let fixed: [u8; 30] = scanner.take()?;
        let mut fields = Fields(&fixed);
        if fields.u32()? != LOCAL_HEADER {
            return Err(damaged(format!("a header in front of {}", printable(name)), "other bytes"));
        }
        fields.bytes(22)?;
        let (name_len, extra_len) = (fields.u16()?, fields.u16()?);
        scanner.skip(u64::from(name_len) + u64::from(extra_len))?;
        let span = scanner.skip(entry.size)?;

        let mut hasher = crc32fast::Hasher::new();
        source.read_pieces(span, PIECE, |piece| {
            hasher.update(piece);
            Ok(())
        })?;
        let found = hasher.finalize();
        if found != entry.crc32 {
            let expected = format!("checksum {:08x} of {}", entry.crc32, printable(name));
            return Err(damaged(expected, format!("{found:08x}: the file was altered")));
        }
        Ok(Some(span))
    }
}

fn read_entry(fields: &mut Fields) -> Result<(String, Entry)> {
    if fields.u32()? != DIRECTORY_ENTRY {
        return Err(damaged("an entry of the directory", "other bytes"));
    }
    fields.bytes(4)?;
    let (flags, method) = (fields.u16()?, fields.u16()?);
    fields.bytes(4)?;
    let crc32 = fields.u32()?;
    let (packed, unpacked) = (fields.u32()?, fields.u32()?);
    let (name_len, extra_len, comment_len) = (fields.u16()?, fields.u16()?, fields.u16()?);
    fields.bytes(8)?;
    let header_offset = fields.u32()?;
    let name = String::from_utf8_lossy(fields.bytes(name_len.into())?).into_owned();
    if !is_inside(&name) {
        return Err(damaged("names inside a folder", printable(&name)));
    }
    let mut extra = Fields(fields.bytes(extra_len.into())?);
    let [mut unpacked, mut packed, mut header_offset] = [unpacked, packed, header_offset].map(u64::from);
    while extra.0.len() >= 4 {
        let (kind, len) = (extra.u16()?, extra.u16()?);
        let mut wide = Fields(extra.bytes(len.into())?);
        if kind == 1 {
            // Wide fields exist only for narrow fields at their maximum, in this order.
            for field in [&mut unpacked, &mut packed, &mut header_offset] {
                if *field == u64::from(u32::MAX) {
                    *field = wide.u64()?;
                }
            }
        }
    }
    fields.bytes(comment_len.into())?;
    let is_encrypted = flags & 1 != 0;
    let is_stored = method == 0 && packed == unpacked && !is_encrypted;
    Ok((name, Entry { header_offset, size: unpacked, crc32, is_stored }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An archive of one stored entry, written by hand.
    fn archive(name: &str, content: &[u8]) -> Vec<u8> {
        let crc = crc32fast::hash(content).to_le_bytes();
        let size = (content.len() as u32).to_le_bytes();
        let name_len = (name.len() as u16).to_le_bytes();
        let mut file = Vec::new();
        file.extend(LOCAL_HEADER.to_le_bytes());
        file.extend([20, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        file.extend([crc, size, size].concat());
        file.extend([name_len, [0, 0]].concat());
        file.extend(name.as_bytes());
        file.extend(content);
        let directory_at = (file.len() as u32).to_le_bytes();
        file.extend(DIRECTORY_ENTRY.to_le_bytes());
        file.extend([20, 0, 20, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        file.extend([crc, size, size].concat());
        file.extend([name_len, [0, 0], [0, 0], [0, 0], [0, 0]].concat());
        file.extend([0; 8]);
        file.extend(name.as_bytes());
        let directory_len = (file.len() as u32 - u32::from_le_bytes(directory_at)).to_le_bytes();
        file.extend(END_RECORD.to_le_bytes());
        file.extend([0, 0, 0, 0, 1, 0, 1, 0]);
        file.extend([directory_len, directory_at].concat());
        file.extend([0, 0]);
        file
    }

    #[test]
    fn a_stored_entry_is_found_and_checked() {
        let bytes = archive("archive/data/0", b"weights");
        let mut source = Source::from_bytes(bytes.clone());
        let zip = ZipArchive::read(&mut source).unwrap();
        let span = zip.locate(&mut source, "archive/data/0").unwrap().unwrap();
        assert_eq!(source.read_span(span).unwrap(), b"weights");
        assert!(zip.locate(&mut source, "archive/data/1").unwrap().is_none());

        let mut flipped = bytes;
        flipped[span.offset as usize] ^= 1;
        let mut source = Source::from_bytes(flipped);
        let zip = ZipArchive::read(&mut source).unwrap();
        let error = zip.locate(&mut source, "archive/data/0").unwrap_err().to_string();
        assert!(error.contains("altered"), "{error}");
    }

    #[test]
    fn names_that_climb_out_are_refused() {
        for name in ["../data.pkl", "a/../../b", "/etc/passwd", "c:\\x", "a\\..\\b"] {
            let mut source = Source::from_bytes(archive(name, b"x"));
            let error = ZipArchive::read(&mut source).err().unwrap().to_string();
            assert!(error.contains("names inside a folder"), "{name}: {error}");
        }
        assert!(is_inside("archive/data..pkl"));
    }

    #[test]
    fn a_larger_directory_than_any_checkpoint_has_is_refused_before_it_is_read() {
        let refused = |count: u64, len: u64| {
            let mut file = END_RECORD_64.to_le_bytes().to_vec();
            file.extend([0; 28]);
            file.extend([count, len, 0].map(u64::to_le_bytes).concat());
            file.extend(END_LOCATOR_64.to_le_bytes());
            file.extend([0; 16]);
            file.extend(END_RECORD.to_le_bytes());
            file.extend([0; 18]);
            ZipArchive::read(&mut Source::from_bytes(file)).err().unwrap().to_string()
        };
        let error = refused(MAX_ENTRIES + 1, 0);
        assert!(error.contains("at most 100000, found 100001"), "{error}");
        let error = refused(1, MAX_DIRECTORY_BYTES + 1);
        assert!(error.contains("entries of the zip archive"), "{error}");
    }

    #[test]
    fn entries_that_are_together_larger_than_the_file_are_refused() {
        let mut file = archive("archive/data/0", b"weights");
        let directory = file.windows(4).position(|bytes| bytes == DIRECTORY_ENTRY.to_le_bytes()).unwrap();
        for size in [directory + 20, directory + 24] {
            file[size..size + 4].copy_from_slice(&10_000u32.to_le_bytes());
        }
        let error = ZipArchive::read(&mut Source::from_bytes(file)).err().unwrap().to_string();
        assert!(error.contains("entries of at most") && error.contains("10000 bytes"), "{error}");
    }

    #[test]
    fn an_archive_cut_anywhere_is_an_error() {
        let bytes = archive("archive/data/0", b"weights");
        for len in 0..bytes.len() {
            assert!(ZipArchive::read(&mut Source::from_bytes(bytes[..len].to_vec())).is_err(), "{len} bytes");
        }
    }
}

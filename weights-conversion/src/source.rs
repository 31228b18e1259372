//! Random access to a checkpoint's bytes without loading them: a tensor is a position in the file until it is written.

use std::fs::File;
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use crate::error::{Result, WeightsError};

/// A stretch of the file, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Span {
    /// First byte.
    pub offset: u64,
    /// Number of bytes.
    pub len: u64,
}

impl Span {
    /// The byte after the last one. Spans lie inside a file, so the sum cannot overflow.
    pub fn end(self) -> u64 {
        self.offset.saturating_add(self.len)
    }
}

trait ReadSeek: Read + Seek + Send {}
impl<T: Read + Seek + Send> ReadSeek for T {}

/// A checkpoint's bytes: a file, or bytes in memory.
pub struct Source {
    reader: Box<dyn ReadSeek>,
    len: u64,
}

impl Source {
    /// Opens a file, which outputs of this process then do not replace.
    ///
    /// # Errors
    /// A file that cannot be opened, or that has no length (a folder, a pipe).
    pub fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(WeightsError::io("open the checkpoint"))?;
        let metadata = file.metadata().map_err(WeightsError::io("ask for the checkpoint's size"))?;
        if !metadata.is_file() {
            let found = if metadata.is_dir() { "a folder" } else { "a pipe or a device" };
            return Err(WeightsError::NotACheckpoint { found: found.to_owned() });
        }
        sdg_files::keep(path);
        Ok(Self { reader: Box::new(file), len: metadata.len() })
    }

    /// Takes bytes in memory.
    pub fn from_bytes(bytes: impl AsRef<[u8]> + Send + 'static) -> Self {
        let len = bytes.as_ref().len() as u64;
        Self { reader: Box::new(Cursor::new(bytes)), len }
    }

    /// Number of bytes.
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Whether there are no bytes.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The whole file.
    pub(crate) fn whole(&self) -> Span {
        Span { offset: 0, len: self.len }
    }

    /// Fills `buffer` from `offset` on.
    pub(crate) fn read_at(&mut self, offset: u64, buffer: &mut [u8]) -> Result<()> {
        self.check(Span { offset, len: buffer.len() as u64 })?;
        let read = WeightsError::io("read the checkpoint");
        let sought = self.reader.seek(SeekFrom::Start(offset)).and_then(|_| self.reader.read_exact(buffer));
        sought.map_err(read)
    }

    /// Reads a span, after checking that the file contains it.
    pub(crate) fn read_span(&mut self, span: Span) -> Result<Vec<u8>> {
        self.check(span)?;
        let mut bytes = vec![0; span.len as usize];
        self.read_at(span.offset, &mut bytes)?;
        Ok(bytes)
    }

    /// Passes a span to `take` in pieces of at most `piece` bytes.
    pub(crate) fn read_pieces(
        &mut self,
        span: Span,
        piece: usize,
        mut take: impl FnMut(&[u8]) -> Result<()>,
    ) -> Result<()> {
        self.check(span)?;
        let mut buffer = vec![0; piece.min(span.len as usize)];
        let mut at = span.offset;
        while at < span.end() {
            let length = (span.end() - at).min(piece as u64) as usize;
            self.read_at(at, &mut buffer[..length])?;
            take(&buffer[..length])?;
            at += length as u64;
        }
        Ok(())
    }

    fn check(&self, span: Span) -> Result<()> {
        match span.offset.checked_add(span.len) {
            Some(end) if end <= self.len => Ok(()),
            _ => Err(WeightsError::damaged(
                "the file",
                format!("{} bytes from byte {} on", span.len, span.offset),
                format!("{} bytes in all", self.len),
            )),
        }
    }
}

/// Bytes read at once while scanning.
const WINDOW: usize = 16 << 10;

/// Reads a span of the file from front to back, skipping large parts.
pub(crate) struct Scanner<'a> {
    source: &'a mut Source,
    end: u64,
    position: u64,
    window: Vec<u8>,
    window_at: u64,
}

impl<'a> Scanner<'a> {
    pub fn new(source: &'a mut Source, span: Span) -> Result<Self> {
        source.check(span)?;
        Ok(Self { source, end: span.end(), position: span.offset, window: Vec::new(), window_at: span.offset })
    }

    /// The position of the next byte.
    pub fn position(&self) -> u64 {
        self.position
    }

    /// Number of remaining bytes.
    pub fn left(&self) -> u64 {
        self.end - self.position
    }

    /// Skips `len` bytes and returns their position.
    pub fn skip(&mut self, len: u64) -> Result<Span> {
        if len > self.left() {
            return Err(self.cut_short(len));
        }
        let span = Span { offset: self.position, len };
        self.position += len;
        Ok(span)
    }

    /// The next `N` bytes.
    pub fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let mut bytes = [0; N];
        self.fill(&mut bytes)?;
        Ok(bytes)
    }

    /// The next byte.
    pub fn byte(&mut self) -> Result<u8> {
        Ok(self.take::<1>()?[0])
    }

    /// Fills `bytes` with the next bytes.
    pub fn fill(&mut self, bytes: &mut [u8]) -> Result<()> {
        if bytes.len() as u64 > self.left() {
            return Err(self.cut_short(bytes.len() as u64));
        }
        if bytes.len() > WINDOW {
            self.source.read_at(self.position, bytes)?;
        } else {
            let inside = self.position >= self.window_at
                && self.position + bytes.len() as u64 <= self.window_at + self.window.len() as u64;
            if !inside {
                self.window.resize(self.left().min(WINDOW as u64) as usize, 0);
                self.window_at = self.position;
                self.source.read_at(self.position, &mut self.window)?;
            }
            let from = (self.position - self.window_at) as usize;
            bytes.copy_from_slice(&self.window[from..from + bytes.len()]);
        }
        self.position += bytes.len() as u64;
        Ok(())
    }

    fn cut_short(&self, wanted: u64) -> WeightsError {
        WeightsError::damaged(
            format!("byte {}", self.position),
            format!("{wanted} more bytes"),
            format!("{} before the end", self.left()),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scanning_goes_on_behind_what_was_skipped() {
        let bytes: Vec<u8> = (0..50_000u32).map(|i| (i % 251) as u8).collect();
        let mut source = Source::from_bytes(bytes.clone());
        let mut scanner = Scanner::new(&mut source, Span { offset: 3, len: 49_990 }).unwrap();
        assert_eq!(scanner.take::<2>().unwrap(), [3, 4]);
        assert_eq!(scanner.skip(40_000).unwrap(), Span { offset: 5, len: 40_000 });
        assert_eq!(scanner.byte().unwrap(), bytes[40_005]);
        let error = scanner.skip(10_000).unwrap_err().to_string();
        assert_eq!(error, "byte 40006: expected 10000 more bytes, found 9987 before the end");
    }

    #[test]
    fn no_memory_is_taken_for_what_is_not_there() {
        let mut source = Source::from_bytes(vec![0; 10]);
        assert!(source.read_span(Span { offset: 5, len: u64::MAX }).is_err());
        assert!(source.read_span(Span { offset: 5, len: 1 << 50 }).is_err());
        assert_eq!(source.read_span(Span { offset: 5, len: 5 }).unwrap().len(), 5);
    }
}

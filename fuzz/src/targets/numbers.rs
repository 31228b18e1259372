//! Reads successive numbers from an input.

/// The rest of an input; beyond its end, zeros are read.
pub(super) struct Numbers<'a>(pub(super) &'a [u8]);

impl Numbers<'_> {
    fn next<const N: usize>(&mut self) -> [u8; N] {
        let count = N.min(self.0.len());
        let mut bytes = [0; N];
        bytes[..count].copy_from_slice(&self.0[..count]);
        self.0 = &self.0[count..];
        bytes
    }

    pub(super) fn u8(&mut self) -> u8 {
        self.next::<1>()[0]
    }

    pub(super) fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.next())
    }

    pub(super) fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.next())
    }

    pub(super) fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.next())
    }

    pub(super) fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.next())
    }

    /// The next `count` bytes, or the rest if it is shorter.
    pub(super) fn bytes(&mut self, count: usize) -> Vec<u8> {
        let (taken, rest) = self.0.split_at(count.min(self.0.len()));
        self.0 = rest;
        taken.to_vec()
    }
}

//! An input as a list of decisions.

/// Gives bytes one after the other.
pub(crate) struct Cursor<'i>(pub(crate) &'i [u8]);

impl<'i> Cursor<'i> {
    /// The next byte.
    pub(crate) fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    /// The next byte, 0 at the end.
    pub(crate) fn some(&mut self) -> u8 {
        self.byte().unwrap_or_default()
    }

    /// The next eight bytes, 0 at the end.
    pub(crate) fn number(&mut self) -> u64 {
        u64::from_le_bytes(std::array::from_fn(|_| self.some()))
    }

    /// So many bytes, fewer at the end.
    pub(crate) fn bytes(&mut self, count: usize) -> &'i [u8] {
        let (bytes, rest) = self.0.split_at(count.min(self.0.len()));
        self.0 = rest;
        bytes
    }
}

//! The numbers of a body, as postcard writes them, read without going byte by byte.
//!
//! `None` stands for whatever postcard would refuse: bytes that are missing, a number that is too long or too large, a choice
//! that there is not.

use isotherm_correction::sample::LasingMode;

/// Highest bit of each byte: set where a number goes on behind it.
const GOES_ON: u64 = 0x8080_8080_8080_8080;

/// What is left of a body.
#[derive(Debug)]
pub(super) struct Body<'a> {
    bytes: &'a [u8],
}

impl<'a> Body<'a> {
    /// All of a body.
    pub(super) const fn new(bytes: &'a [u8]) -> Self {
        Self { bytes }
    }

    /// How many bytes are left.
    pub(super) const fn left(&self) -> usize {
        self.bytes.len()
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.bytes.split_first_chunk()?;
        self.bytes = rest;
        Some(*taken)
    }

    /// A number of up to ten bytes of seven bits, the lowest first, and how many bytes it had.
    #[inline]
    fn varint(&mut self) -> Option<(u64, u32)> {
        let (first, rest) = self.bytes.split_first()?;
        if *first < 0x80 {
            self.bytes = rest;
            return Some((u64::from(*first), 1));
        }
        let word = self.bytes.first_chunk().map_or(u64::MAX, |bytes| u64::from_le_bytes(*bytes));
        let ends = !word & GOES_ON;
        if ends == 0 {
            return self.long_varint();
        }
        let length = ends.trailing_zeros() / 8 + 1;
        // Up to the byte that ends it; then pairs of seven bits, of fourteen, of twenty-eight move together.
        let bits = word & (ends ^ (ends - 1)) & !GOES_ON;
        let bits = bits & 0x007f_007f_007f_007f | (bits & 0x7f00_7f00_7f00_7f00) >> 1;
        let bits = bits & 0x0000_3fff_0000_3fff | (bits & 0x3fff_0000_3fff_0000) >> 2;
        let bits = bits & 0x0fff_ffff | (bits & 0x0fff_ffff_0000_0000) >> 4;
        self.bytes = self.bytes.get(length as usize..)?;
        Some((bits, length))
    }

    /// Byte by byte: a number of more than eight bytes, or one near the end of the body.
    #[cold]
    fn long_varint(&mut self) -> Option<(u64, u32)> {
        let mut number = 0;
        for length in 1..=10 {
            let [byte] = self.take()?;
            number |= u64::from(byte & 0x7f) << (7 * (length - 1));
            if byte < 0x80 {
                // Of the tenth byte one bit is left.
                return (length < 10 || byte <= 1).then_some((number, length));
            }
        }
        None
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        self.varint().map(|(number, _)| number)
    }

    /// Of up to five bytes.
    pub(super) fn u32(&mut self) -> Option<u32> {
        let (number, length) = self.varint()?;
        u32::try_from(number).ok().filter(|_| length <= 5)
    }

    pub(super) fn i64(&mut self) -> Option<i64> {
        let folded = self.u64()?;
        Some((folded >> 1).cast_signed() ^ -(folded & 1).cast_signed())
    }

    pub(super) fn i32(&mut self) -> Option<i32> {
        let folded = self.u32()?;
        Some((folded >> 1).cast_signed() ^ -(folded & 1).cast_signed())
    }

    pub(super) fn f64(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }

    pub(super) fn bool(&mut self) -> Option<bool> {
        match self.take()? {
            [0] => Some(false),
            [1] => Some(true),
            _ => None,
        }
    }

    /// A lasing mode, or none.
    pub(super) fn mode(&mut self) -> Option<Option<LasingMode>> {
        if !self.bool()? {
            return Some(None);
        }
        match self.u32()? {
            0 => Some(Some(LasingMode::Plus)),
            1 => Some(Some(LasingMode::Minus)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What postcard and this reader make of the same bytes.
    fn both(bytes: &[u8]) {
        let words = format!("{bytes:02x?}");
        let mut body = Body::new(bytes);
        let number = body.u64().map(|number| (number, body.left()));
        let postcard = postcard::take_from_bytes::<u64>(bytes).ok().map(|(number, rest)| (number, rest.len()));
        assert_eq!(number, postcard, "u64 of {words}");
        let mut body = Body::new(bytes);
        let number = body.i32().map(|number| (number, body.left()));
        let postcard = postcard::take_from_bytes::<i32>(bytes).ok().map(|(number, rest)| (number, rest.len()));
        assert_eq!(number, postcard, "i32 of {words}");
        let mut body = Body::new(bytes);
        let number = body.i64().map(|number| (number, body.left()));
        let postcard = postcard::take_from_bytes::<i64>(bytes).ok().map(|(number, rest)| (number, rest.len()));
        assert_eq!(number, postcard, "i64 of {words}");
    }

    #[test]
    fn numbers_of_every_length_are_those_of_postcard() {
        for length in 0..13 {
            for last in [0, 1, 2, 0x0f, 0x10, 0x55, 0x7f, 0x80, 0xff] {
                for inner in [0x80, 0xff, 0xa5] {
                    for behind in 0..9 {
                        let mut bytes = vec![inner; length];
                        bytes.push(last);
                        bytes.extend([0x81, 0x7f, 0x00, 0xff].iter().cycle().take(behind));
                        both(&bytes);
                    }
                }
            }
        }
        both(&[]);
    }
}

//! The numbers of a body, as postcard writes them, read without going byte by byte.
//!
//! `None` stands for whatever postcard would refuse: bytes that are missing, a number that is too long or too large, a choice
//! that there is not.

use isotherm_correction::sample::LasingMode;

/// Highest bit of each byte: set where a number goes on behind it.
const GOES_ON: u64 = 0x8080_8080_8080_8080;

/// A body, and how far it has been read.
#[derive(Debug)]
pub(super) struct Body<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Body<'a> {
    /// All of a body.
    pub(super) const fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// How many bytes are left.
    pub(super) const fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    #[inline]
    fn byte(&mut self) -> Option<u8> {
        let byte = *self.bytes.get(self.at)?;
        self.at += 1;
        Some(byte)
    }

    #[inline]
    pub(super) fn u64(&mut self) -> Option<u64> {
        let begin = self.at;
        let first = self.byte()?;
        if first < 0x80 {
            return Some(first.into());
        }
        let (number, end) = many_bytes(self.bytes, begin)?;
        self.at = end;
        Some(number)
    }

    /// Of up to five bytes; counts have two mostly.
    #[inline]
    pub(super) fn u32(&mut self) -> Option<u32> {
        let begin = self.at;
        let first = self.byte()?;
        if first < 0x80 {
            return Some(first.into());
        }
        let second = self.byte()?;
        if second < 0x80 {
            return Some(u32::from(first & 0x7f) | u32::from(second) << 7);
        }
        let (number, end) = many_bytes(self.bytes, begin)?;
        self.at = end;
        u32::try_from(number).ok().filter(|_| end - begin <= 5)
    }

    #[inline]
    pub(super) fn i64(&mut self) -> Option<i64> {
        let folded = self.u64()?;
        Some((folded >> 1).cast_signed() ^ -(folded & 1).cast_signed())
    }

    #[inline]
    pub(super) fn i32(&mut self) -> Option<i32> {
        let folded = self.u32()?;
        Some((folded >> 1).cast_signed() ^ -(folded & 1).cast_signed())
    }

    #[inline]
    pub(super) fn f64(&mut self) -> Option<f64> {
        let bytes = self.bytes.get(self.at..)?.first_chunk()?;
        self.at += bytes.len();
        Some(f64::from_le_bytes(*bytes))
    }

    pub(super) fn str(&mut self) -> Option<&'a str> {
        let length = usize::try_from(self.u64()?).ok()?;
        let bytes = self.bytes.get(self.at..)?.get(..length)?;
        self.at += length;
        str::from_utf8(bytes).ok()
    }

    #[inline]
    pub(super) fn bool(&mut self) -> Option<bool> {
        match self.byte()? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }

    /// A lasing mode, or none, into `mode`.
    #[inline]
    pub(super) fn mode(&mut self, mode: &mut Option<LasingMode>) -> Option<()> {
        *mode = if self.bool()? {
            match self.u32()? {
                0 => Some(LasingMode::Plus),
                1 => Some(LasingMode::Minus),
                _ => return None,
            }
        } else {
            None
        };
        Some(())
    }
}

/// The number of up to ten bytes of seven bits, the lowest first, that begins at `begin`, and where it ends.
fn many_bytes(bytes: &[u8], begin: usize) -> Option<(u64, usize)> {
    let rest = bytes.get(begin..)?;
    let word = rest.first_chunk().map_or(u64::MAX, |bytes| u64::from_le_bytes(*bytes));
    let ends = !word & GOES_ON;
    if ends == 0 {
        return byte_by_byte(rest).map(|(number, length)| (number, begin + length));
    }
    let length = ends.trailing_zeros() / 8 + 1;
    // Up to the byte that ends it; then pairs of seven bits, of fourteen, of twenty-eight move together.
    let bits = word & (ends ^ (ends - 1)) & !GOES_ON;
    let bits = bits & 0x007f_007f_007f_007f | (bits & 0x7f00_7f00_7f00_7f00) >> 1;
    let bits = bits & 0x0000_3fff_0000_3fff | (bits & 0x3fff_0000_3fff_0000) >> 2;
    let bits = bits & 0x0fff_ffff | (bits & 0x0fff_ffff_0000_0000) >> 4;
    Some((bits, begin + length as usize))
}

/// A number of more than eight bytes, or one near the end of the body; and its length.
#[cold]
fn byte_by_byte(bytes: &[u8]) -> Option<(u64, usize)> {
    let mut number = 0;
    for (index, byte) in bytes.iter().enumerate().take(10) {
        number |= u64::from(byte & 0x7f) << (7 * index);
        if *byte < 0x80 {
            // Of the tenth byte one bit is left.
            return (index < 9 || *byte <= 1).then_some((number, index + 1));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What postcard and this reader make of the same bytes.
    fn both(bytes: &[u8]) {
        let words = format!("{bytes:02x?}");
        let mut body = Body::new(bytes);
        let number = body.u64().map(|number| (number, body.left()));
        let postcard =
            postcard::take_from_bytes::<u64>(bytes).ok().map(|(number, rest)| (number, rest.len()));
        assert_eq!(number, postcard, "u64 of {words}");
        let mut body = Body::new(bytes);
        let number = body.i32().map(|number| (number, body.left()));
        let postcard =
            postcard::take_from_bytes::<i32>(bytes).ok().map(|(number, rest)| (number, rest.len()));
        assert_eq!(number, postcard, "i32 of {words}");
        let mut body = Body::new(bytes);
        let number = body.i64().map(|number| (number, body.left()));
        let postcard =
            postcard::take_from_bytes::<i64>(bytes).ok().map(|(number, rest)| (number, rest.len()));
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

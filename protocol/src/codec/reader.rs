//! The numbers of a body, as postcard writes them, read without going byte by byte.
//!
//! `None` stands for whatever postcard would refuse: bytes that are missing, a number that is too long or too large, a choice
//! that there is not.

use isotherm_correction::sample::LasingMode;

use super::{CodecError, GOES_ON, WINDOW};

/// What is left of a body.
#[derive(Debug)]
pub(crate) struct Body<'a>(pub(crate) &'a [u8]);

/// A stretch of a body that has its full length always, so that no step in it has to ask whether a byte is there.
#[derive(Debug)]
pub struct Stretch<'a> {
    bytes: &'a [u8; WINDOW],
    /// How far it has been read. As a `u8` it never leaves the window, and 255 bytes are more than any part of a message has.
    at: u8,
}

impl<'a> Body<'a> {
    /// Reads a part of at most 255 bytes.
    ///
    /// Near the end the window is filled up with zeros; whoever has read of them has read a body that is cut off.
    #[inline]
    pub(crate) fn part<T>(&mut self, read: impl FnOnce(&mut Stretch<'_>) -> Option<T>) -> Option<T> {
        let mut filled;
        let bytes = if let Some(bytes) = self.0.first_chunk() {
            bytes
        } else {
            filled = [0; WINDOW];
            filled.get_mut(..self.0.len())?.copy_from_slice(self.0);
            &filled
        };
        let mut stretch = Stretch { bytes, at: 0 };
        let value = read(&mut stretch)?;
        self.0 = self.0.get(usize::from(stretch.at)..)?;
        Some(value)
    }

    /// How many bytes are left.
    pub(crate) fn left(&self) -> usize {
        self.0.len()
    }

    /// A body ends here.
    pub(crate) fn end(&self) -> Result<(), CodecError> {
        if self.0.is_empty() { Ok(()) } else { Err(CodecError::Trailing { count: self.left() }) }
    }

    /// A stated number of elements, at most `most`.
    pub(crate) fn length(&mut self, most: usize) -> Option<usize> {
        self.part(|part| part.length(most))
    }

    /// Reads a text.
    pub(crate) fn str(&mut self) -> Option<&'a str> {
        let length = self.length(self.0.len())?;
        let (text, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        str::from_utf8(text).ok()
    }
}

impl Stretch<'_> {
    #[inline]
    fn ahead<const N: usize>(&self) -> Option<[u8; N]> {
        self.bytes.get(usize::from(self.at)..)?.first_chunk().copied()
    }

    /// Up to ten bytes of seven bits each, the lowest first; the number, and how many bytes it has.
    #[inline]
    fn varint(&mut self) -> Option<(u64, u8)> {
        let word = u64::from_le_bytes(self.ahead()?);
        let (number, length) = if word & 0x8080 == 0x8080 {
            many_bytes(word, self.ahead::<10>()?)?
        } else {
            // One byte or two, as most numbers have, without asking which.
            let goes_on = word >> 7 & 1;
            let second = word >> 1 & 0x3f80 & goes_on.wrapping_neg();
            (word & 0x7f | second, if goes_on == 0 { 1 } else { 2 })
        };
        self.at = self.at.wrapping_add(length);
        Some((number, length))
    }

    #[inline]
    pub(crate) fn u64(&mut self) -> Option<u64> {
        self.varint().map(|(number, _)| number)
    }

    /// Of up to five bytes.
    #[inline]
    pub(crate) fn u32(&mut self) -> Option<u32> {
        let (number, length) = self.varint()?;
        u32::try_from(number).ok().filter(|_| length <= 5)
    }

    #[inline]
    pub(crate) fn i64(&mut self) -> Option<i64> {
        let folded = self.u64()?;
        Some((folded >> 1).cast_signed() ^ -(folded & 1).cast_signed())
    }

    #[inline]
    pub(crate) fn i32(&mut self) -> Option<i32> {
        let folded = self.u32()?;
        Some((folded >> 1).cast_signed() ^ -(folded & 1).cast_signed())
    }

    #[inline]
    pub(crate) fn f64(&mut self) -> Option<f64> {
        let bytes = self.ahead()?;
        self.at = self.at.wrapping_add(8);
        Some(f64::from_le_bytes(bytes))
    }

    #[inline]
    pub(crate) fn bool(&mut self) -> Option<bool> {
        let [byte] = self.ahead()?;
        self.at = self.at.wrapping_add(1);
        (byte <= 1).then_some(byte == 1)
    }

    /// A stated number of elements, at most `most`.
    #[inline]
    pub(crate) fn length(&mut self, most: usize) -> Option<usize> {
        usize::try_from(self.u64()?).ok().filter(|length| *length <= most)
    }

    /// A lasing mode, or none.
    #[inline]
    pub(crate) fn mode(&mut self) -> Option<Option<LasingMode>> {
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

/// A number of three bytes or more, of which `word` has the first eight.
#[inline]
fn many_bytes(word: u64, bytes: [u8; 10]) -> Option<(u64, u8)> {
    let ends = !word & GOES_ON;
    // Up to the byte that ends it; then pairs of seven bits, of fourteen, of twenty-eight move together.
    let bits = word & (ends ^ ends.wrapping_sub(1)) & !GOES_ON;
    let bits = bits & 0x007f_007f_007f_007f | (bits & 0x7f00_7f00_7f00_7f00) >> 1;
    let bits = bits & 0x0000_3fff_0000_3fff | (bits & 0x3fff_0000_3fff_0000) >> 2;
    let bits = bits & 0x0fff_ffff | (bits & 0x0fff_ffff_0000_0000) >> 4;
    if ends != 0 {
        return Some((bits, u8::try_from(ends.trailing_zeros() / 8 + 1).ok()?));
    }
    // Nanoseconds since 1970 have nine.
    let [.., ninth, tenth] = bytes;
    let bits = bits | u64::from(ninth & 0x7f) << 56;
    match (ninth < 0x80, tenth) {
        (true, _) => Some((bits, 9)),
        // Of the tenth byte one bit is left.
        (false, 0 | 1) => Some((bits | u64::from(tenth) << 63, 10)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What postcard and this reader make of the same bytes.
    fn both(bytes: &[u8]) {
        fn reads<T: PartialEq + std::fmt::Debug + for<'de> serde::Deserialize<'de>>(
            bytes: &[u8],
            read: impl FnOnce(&mut Stretch<'_>) -> Option<T>,
        ) {
            let mut body = Body(bytes);
            let number = body.part(read).map(|number| (number, body.0));
            assert_eq!(number, postcard::take_from_bytes(bytes).ok(), "{bytes:02x?}");
        }
        reads::<u64>(bytes, |part| part.u64());
        reads::<i64>(bytes, |part| part.i64());
        reads::<u32>(bytes, |part| part.u32());
        reads::<i32>(bytes, |part| part.i32());
        reads::<bool>(bytes, |part| part.bool());
        reads::<Option<LasingMode>>(bytes, |part| part.mode());
    }

    #[test]
    fn numbers_of_every_length_are_those_of_postcard() {
        for length in 0..13 {
            for last in [0, 1, 2, 0x0f, 0x10, 0x55, 0x7f, 0x80, 0xff] {
                for inner in [0x80, 0xff, 0xa5, 0x01] {
                    for behind in [0, 1, 2, 3, 8, WINDOW] {
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

    #[test]
    fn a_text_that_is_longer_than_what_is_left_is_refused() {
        assert_eq!(Body(&[3, b'a', b'b', b'c', 9]).str(), Some("abc"));
        assert_eq!(Body(&[3, b'a', b'b']).str(), None);
        assert_eq!(Body(&[1, 0xff]).str(), None, "no UTF-8");
    }
}

//! The numbers of a body, as postcard writes them, read without going byte by byte.
//!
//! `None` stands for whatever postcard would refuse: bytes that are missing, a number that is too long or too large, a choice
//! that there is not.

use isotherm_correction::sample::LasingMode;

use super::{CodecError, GOES_ON, MAX_TICKS, WINDOW};

/// A body, and how far it has been read.
#[derive(Debug)]
pub(crate) struct Body<'a> {
    bytes: &'a [u8],
    at: usize,
    /// The end of the body with anything behind it, once what is left is shorter than a window.
    tail: &'a mut Tail,
    tail_from: Option<usize>,
}

/// Room for the end of a body, used again for the next one: filling it with zeros each time costs more than a tick's numbers.
#[derive(Debug)]
pub(crate) struct Tail([u8; 2 * WINDOW]);

impl Default for Tail {
    fn default() -> Self {
        Self([0; 2 * WINDOW])
    }
}

/// A stretch of a body that has its full length always, so that no step in it has to ask whether a byte is there.
#[derive(Debug)]
pub struct Stretch<'a> {
    bytes: &'a [u8; WINDOW],
    /// How far it has been read. As a `u8` it never leaves the window, and 255 bytes are more than any part of a message has.
    at: u8,
}

impl<'a> Body<'a> {
    /// All of a body.
    pub(crate) fn new(bytes: &'a [u8], tail: &'a mut Tail) -> Self {
        Self { bytes, at: 0, tail, tail_from: None }
    }

    /// Reads a part of at most 255 bytes. Whoever has read beyond the end has read a body that is cut off.
    #[inline]
    pub(crate) fn part<T>(&mut self, read: impl FnOnce(&mut Stretch<'_>) -> Option<T>) -> Option<T> {
        let rest = self.bytes.get(self.at..)?;
        let window = if let Some(window) = rest.first_chunk() {
            window
        } else {
            let Tail(tail) = &mut *self.tail;
            let from = if let Some(from) = self.tail_from {
                from
            } else {
                tail.get_mut(..rest.len())?.copy_from_slice(rest);
                *self.tail_from.insert(self.at)
            };
            tail.get(self.at - from..)?.first_chunk()?
        };
        let mut stretch = Stretch { bytes: window, at: 0 };
        let value = read(&mut stretch)?;
        self.at += usize::from(stretch.at);
        (self.at <= self.bytes.len()).then_some(value)
    }

    /// How many bytes are left.
    pub(crate) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// A body ends here.
    pub(crate) fn ends(&self) -> Result<(), CodecError> {
        if self.left() == 0 { Ok(()) } else { Err(CodecError::Trailing { count: self.left() }) }
    }

    /// Whether what is left can be so many ticks of at least `fewest_bytes` each, whatever it says.
    pub(crate) fn can_hold(&self, count: usize, fewest_bytes: usize) -> Result<(), CodecError> {
        if count > MAX_TICKS {
            return Err(CodecError::Ticks { count });
        }
        if count <= self.left() / fewest_bytes { Ok(()) } else { Err(CodecError::Malformed) }
    }

    /// A stated number of elements, at most `most`.
    pub(crate) fn length(&mut self, most: usize) -> Option<usize> {
        self.part(|part| part.length(most))
    }

    /// Reads a text.
    pub(crate) fn str(&mut self) -> Option<&'a str> {
        let length = self.length(self.left())?;
        let text = self.bytes.get(self.at..)?.get(..length)?;
        self.at += length;
        str::from_utf8(text).ok()
    }
}

impl Stretch<'_> {
    #[inline]
    fn ahead<const N: usize>(&self) -> Option<[u8; N]> {
        self.bytes.get(usize::from(self.at)..)?.first_chunk().copied()
    }

    #[inline]
    fn pass(&mut self, bytes: u8) {
        self.at = self.at.wrapping_add(bytes);
    }

    /// A number of up to ten bytes of seven bits each, and how many bytes it has.
    #[inline]
    fn number(&mut self) -> Option<(u64, u8)> {
        let word = u16::from_le_bytes(self.ahead()?);
        if word & 0x8080 != 0x8080 {
            // One byte or two, as most have, without asking which.
            let goes_on = word >> 7 & 1;
            let length = if goes_on == 0 { 1 } else { 2 };
            self.pass(length);
            return Some(((word & 0x7f | word >> 1 & 0x3f80 & goes_on.wrapping_neg()).into(), length));
        }
        let [number @ .., ninth, tenth] = self.ahead::<10>()?;
        let (number, length) = long(u64::from_le_bytes(number), ninth, tenth);
        self.pass(length);
        (length > 0).then_some((number, length))
    }

    #[inline]
    pub(crate) fn u64(&mut self) -> Option<u64> {
        self.number().map(|(number, _)| number)
    }

    /// Of up to five bytes.
    #[inline]
    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.number().filter(|(_, length)| *length <= 5)?.0.try_into().ok()
    }

    /// Two numbers; where each has two bytes, as half-period counts mostly have, they move together.
    #[inline]
    pub(crate) fn two_i32(&mut self) -> Option<[i32; 2]> {
        let word = u32::from_le_bytes(self.ahead()?);
        if word & 0x8080_8080 != 0x0080_0080 {
            return Some([self.i32()?, self.i32()?]);
        }
        self.pass(4);
        let both = word & 0x007f_007f | word >> 1 & 0x3f80_3f80;
        Some([both & 0xffff, both >> 16].map(unfolded))
    }

    #[inline]
    pub(crate) fn i64(&mut self) -> Option<i64> {
        let folded = self.u64()?;
        Some((folded >> 1).cast_signed() ^ -(folded & 1).cast_signed())
    }

    #[inline]
    pub(crate) fn i32(&mut self) -> Option<i32> {
        self.u32().map(unfolded)
    }

    #[inline]
    pub(crate) fn f64(&mut self) -> Option<f64> {
        let bytes = self.ahead()?;
        self.pass(8);
        Some(f64::from_le_bytes(bytes))
    }

    #[inline]
    pub(crate) fn bool(&mut self) -> Option<bool> {
        let [byte] = self.ahead()?;
        self.pass(1);
        (byte <= 1).then_some(byte == 1)
    }

    /// Number of a variant: one byte, unless somebody has written it longer than it is.
    #[inline]
    pub(crate) fn variant(&mut self) -> Option<u32> {
        let [byte] = self.ahead()?;
        if byte >= 0x80 {
            return self.u32();
        }
        self.pass(1);
        Some(byte.into())
    }

    /// A stated number of elements, at most `most`; of a tick's it has one byte.
    #[inline]
    pub(crate) fn length(&mut self, most: usize) -> Option<usize> {
        let [byte] = self.ahead()?;
        let length = if byte < 0x80 {
            self.pass(1);
            byte.into()
        } else {
            usize::try_from(self.u64()?).ok()?
        };
        (length <= most).then_some(length)
    }

    /// A lasing mode, or none.
    #[inline]
    #[expect(clippy::option_option, reason = "no mode is one thing, a mode that there is not another")]
    pub(crate) fn mode(&mut self) -> Option<Option<LasingMode>> {
        if !self.bool()? {
            return Some(None);
        }
        match self.variant()? {
            0 => Some(Some(LasingMode::Plus)),
            1 => Some(Some(LasingMode::Minus)),
            _ => None,
        }
    }
}

/// A number whose bytes have seven bits each, the lowest first, and how many they are: 0 where they are none.
fn long(word: u64, ninth: u8, tenth: u8) -> (u64, u8) {
    let ends = !word & GOES_ON;
    // Up to the byte that ends it; then pairs of seven bits, of fourteen, of twenty-eight move together.
    let bits = word & (ends ^ ends.wrapping_sub(1)) & !GOES_ON;
    let bits = bits & 0x007f_007f_007f_007f | (bits & 0x7f00_7f00_7f00_7f00) >> 1;
    let bits = bits & 0x0000_3fff_0000_3fff | (bits & 0x3fff_0000_3fff_0000) >> 2;
    let bits = bits & 0x0fff_ffff | (bits & 0x0fff_ffff_0000_0000) >> 4;
    match (ends, ninth, tenth) {
        (1.., _, _) => {
            let [length, ..] = (ends.trailing_zeros() / 8 + 1).to_le_bytes();
            (bits, length)
        }
        // Nanoseconds since 1970 have nine.
        (0, ..0x80, _) => (bits | u64::from(ninth) << 56, 9),
        // Of the tenth byte one bit is left.
        (0, _, 0 | 1) => (bits | u64::from(ninth & 0x7f) << 56 | u64::from(tenth) << 63, 10),
        _ => (0, 0),
    }
}

/// From 0, −1, 1, −2 as 0, 1, 2, 3.
#[inline]
fn unfolded(folded: u32) -> i32 {
    (folded >> 1).cast_signed() ^ -(folded & 1).cast_signed()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What postcard and this reader make of the same bytes.
    #[expect(
        clippy::redundant_closure_for_method_calls,
        reason = "a method alone is not general enough in its lifetime"
    )]
    fn both(bytes: &[u8]) {
        fn reads<T: PartialEq + std::fmt::Debug + for<'de> serde::Deserialize<'de>>(
            bytes: &[u8],
            read: impl Fn(&mut Stretch<'_>) -> Option<T>,
        ) {
            let postcard = postcard::take_from_bytes(bytes).ok().map(|(number, rest)| (number, rest.len()));
            for behind in [0, 1, 0xff] {
                let mut tail = Tail([behind; 2 * WINDOW]);
                let mut body = Body::new(bytes, &mut tail);
                let number = body.part(&read).map(|number| (number, body.left()));
                assert_eq!(number, postcard, "{bytes:02x?}, {behind:02x} behind");
            }
        }
        reads::<u64>(bytes, |part| part.u64());
        reads::<i64>(bytes, |part| part.i64());
        reads::<u32>(bytes, |part| part.u32());
        reads::<i32>(bytes, |part| part.i32());
        reads::<[i32; 2]>(bytes, |part| part.two_i32());
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
        let mut tail = Tail::default();
        assert_eq!(Body::new(&[3, b'a', b'b', b'c', 9], &mut tail).str(), Some("abc"));
        assert_eq!(Body::new(&[3, b'a', b'b'], &mut tail).str(), None);
        assert_eq!(Body::new(&[1, 0xff], &mut tail).str(), None, "no UTF-8");
    }
}

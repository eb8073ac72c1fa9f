//! The numbers of a body, as postcard writes them, whole words at a time.

use isotherm_correction::sample::LasingMode;

use super::{GOES_ON, WINDOW};

/// Room at the end of a frame that has its full length always, so that no number in it has to ask whether it fits.
#[derive(Debug)]
pub struct Writer<'a> {
    room: &'a mut [u8; WINDOW],
    /// How far it has been written. As a `u8` it never leaves the window, and 255 bytes are more than any part of a message has.
    at: u8,
}

/// Most bytes of a number.
pub(crate) const MAX_NUMBER: usize = 10;

/// Appends a part of at most 255 bytes to a frame.
#[inline]
pub(crate) fn append(frame: &mut Vec<u8>, write: impl FnOnce(&mut Writer<'_>)) {
    let before = frame.len();
    frame.resize(before + WINDOW, 0);
    if let Some(room) = frame.last_chunk_mut() {
        let mut writer = Writer { room, at: 0 };
        write(&mut writer);
        let written = usize::from(writer.at);
        frame.truncate(before + written);
    }
}

/// Appends a text of any length.
pub(crate) fn append_text(frame: &mut Vec<u8>, text: &str) {
    append(frame, |to| to.length(text.len()));
    frame.extend_from_slice(text.as_bytes());
}

impl Writer<'_> {
    /// Writes bytes, of which the first `length` count.
    #[inline]
    fn put<const N: usize>(&mut self, bytes: [u8; N], length: u8) {
        let rest = self.room.get_mut(usize::from(self.at)..);
        if let Some(place) = rest.and_then(|rest| rest.first_chunk_mut()) {
            *place = bytes;
            self.at = self.at.wrapping_add(length);
        }
    }

    #[inline]
    pub(crate) fn byte(&mut self, byte: u8) {
        self.put([byte], 1);
    }

    #[inline]
    pub(crate) fn bytes(&mut self, bytes: [u8; 8]) {
        self.put(bytes, 8);
    }

    /// Seven bits per byte, the lowest first.
    #[inline]
    pub(crate) fn u64(&mut self, number: u64) {
        let [byte, .., highest] = number.to_le_bytes();
        if number < 0x80 {
            return self.byte(byte);
        }
        // Pairs of twenty-eight bits, of fourteen, of seven move apart together.
        let bits = number & 0x0fff_ffff | (number & 0x00ff_ffff_f000_0000) << 4;
        let bits = bits & 0x0000_3fff_0000_3fff | (bits & 0x0fff_c000_0fff_c000) << 2;
        let bits = bits & 0x007f_007f_007f_007f | (bits & 0x3f80_3f80_3f80_3f80) << 1;
        if highest == 0 {
            let [behind, ..] = (number.ilog2() / 7).to_le_bytes();
            self.put((bits | GOES_ON & ((1 << (8 * behind)) - 1)).to_le_bytes(), behind + 1);
        } else {
            // Nanoseconds since 1970 have nine bytes.
            self.bytes((bits | GOES_ON).to_le_bytes());
            let last = highest >> 7;
            self.put([highest & 0x7f | last << 7, last], 1 + last);
        }
    }

    #[inline]
    pub(crate) fn i64(&mut self, number: i64) {
        self.u64((number << 1 ^ number >> 63).cast_unsigned());
    }

    #[inline]
    pub(crate) fn i32(&mut self, number: i32) {
        self.u64((number << 1 ^ number >> 31).cast_unsigned().into());
    }

    /// Numbers as they are in memory.
    #[inline]
    pub(crate) fn f64s(&mut self, numbers: &[f64]) {
        for number in numbers {
            self.bytes(number.to_le_bytes());
        }
    }

    /// How many elements follow.
    #[inline]
    pub(crate) fn length(&mut self, length: usize) {
        self.u64(length as u64);
    }

    /// A lasing mode, or none.
    #[inline]
    pub(crate) fn mode(&mut self, mode: Option<LasingMode>) {
        match mode {
            None => self.byte(0),
            Some(LasingMode::Plus) => self.put([1, 0], 2),
            Some(LasingMode::Minus) => self.put([1, 1], 2),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_every_length_are_those_of_postcard() {
        let powers = (0..64).map(|power| 1_u64 << power);
        for number in powers.flat_map(|power| [power - 1, power, power | 1, power.wrapping_mul(255), !power])
        {
            let mut frame = vec![9];
            append(&mut frame, |to| to.u64(number));
            append(&mut frame, |to| to.i64(number.cast_signed()));
            let small = i32::from_le_bytes(*number.to_le_bytes().first_chunk().unwrap());
            append(&mut frame, |to| to.i32(small));
            let expected = postcard::to_allocvec(&(9_u8, number, number.cast_signed(), small)).unwrap();
            assert_eq!(frame, expected, "{number:#x}");
        }
    }

    #[test]
    fn modes_and_texts_are_those_of_postcard() {
        let mut frame = Vec::new();
        let modes = [None, Some(LasingMode::Plus), Some(LasingMode::Minus)];
        append(&mut frame, |to| modes.into_iter().for_each(|mode| to.mode(mode)));
        let text = "катушка ".repeat(40);
        append_text(&mut frame, &text);
        assert_eq!(frame, postcard::to_allocvec(&(modes, text)).unwrap());
    }
}

//! Chance that is the same in every run.

/// A stream of numbers that follows from its seed (splitmix64).
#[derive(Debug, Clone)]
pub struct Dice(u64);

impl Dice {
    /// Dice that fall the same way for the same seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Any number.
    pub fn number(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// A number below `sides`.
    ///
    /// # Panics
    /// Where `sides` is 0.
    pub fn below(&mut self, sides: u64) -> u64 {
        self.number() % sides
    }

    /// One of several.
    ///
    /// # Panics
    /// Where there is none.
    pub fn one_of<'a, T>(&mut self, choices: &'a [T]) -> &'a T {
        let sides = u64::try_from(choices.len()).expect("a short list");
        let index = usize::try_from(self.below(sides)).expect("below the length");
        choices.get(index).expect("below the length")
    }

    /// A number from −1 to 1.
    #[expect(clippy::cast_precision_loss, reason = "53 bits fit")]
    pub fn between_minus_one_and_one(&mut self) -> f64 {
        (self.number() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

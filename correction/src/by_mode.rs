//! What is kept for each lasing mode by itself.

use serde::{Deserialize, Serialize};

use crate::sample::LasingMode;

/// One value per lasing mode, and one for an instrument without modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ByMode<T> {
    /// Instrument without modes.
    pub without: T,
    /// Mode plus.
    pub plus: T,
    /// Mode minus.
    pub minus: T,
}

impl<T> ByMode<T> {
    /// That of a mode.
    pub fn get(&self, mode: Option<LasingMode>) -> &T {
        match mode {
            None => &self.without,
            Some(LasingMode::Plus) => &self.plus,
            Some(LasingMode::Minus) => &self.minus,
        }
    }

    /// That of a mode.
    pub(crate) fn get_mut(&mut self, mode: Option<LasingMode>) -> &mut T {
        match mode {
            None => &mut self.without,
            Some(LasingMode::Plus) => &mut self.plus,
            Some(LasingMode::Minus) => &mut self.minus,
        }
    }

    /// All of them, that of an instrument without modes first.
    pub(crate) fn each(&self) -> [&T; 3] {
        [&self.without, &self.plus, &self.minus]
    }

    /// The same of each.
    pub(crate) fn map<U>(&self, f: impl Fn(&T) -> U) -> ByMode<U> {
        ByMode { without: f(&self.without), plus: f(&self.plus), minus: f(&self.minus) }
    }
}

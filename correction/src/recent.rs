//! The last values of a kind: once there is no more room, the oldest makes it.

use core::ops::Deref;

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

/// At most `N` values; once there are as many, no longer in the order in which they came.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Recent<T, const N: usize> {
    values: ArrayVec<T, N>,
    oldest: usize,
}

impl<T, const N: usize> Recent<T, N> {
    pub(crate) fn push(&mut self, value: T) {
        if let Err(full) = self.values.try_push(value) {
            if let Some(oldest) = self.values.get_mut(self.oldest) {
                *oldest = full.element();
            }
            self.oldest = (self.oldest + 1) % N;
        }
    }
}

impl<T, const N: usize> Deref for Recent<T, N> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_value_makes_room() {
        let mut recent = Recent::<u8, 3>::default();
        (1..=3).for_each(|value| recent.push(value));
        assert_eq!(&*recent, &[1, 2, 3]);
        (4..=7).for_each(|value| recent.push(value));
        assert_eq!(&*recent, &[7, 5, 6]);
    }
}

//! Lists that most units never need: short, and without room until the first element.

use alloc::boxed::Box;
use core::ops::Deref;

use arrayvec::ArrayVec;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// At most `N` elements; their room is made when the first of them is put in, and then it stays. Written down as an
/// [`ArrayVec`] is.
#[derive(Debug, Clone)]
pub(crate) struct Later<T, const N: usize>(Option<Box<ArrayVec<T, N>>>);

impl<T, const N: usize> Later<T, N> {
    /// The list, to be changed; makes its room.
    pub(crate) fn room(&mut self) -> &mut ArrayVec<T, N> {
        self.0.get_or_insert_default()
    }

    /// Whether there is no element.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.as_deref().is_none_or(ArrayVec::is_empty)
    }

    /// Takes all elements out; the room stays.
    pub(crate) fn take(&mut self) -> ArrayVec<T, N> {
        self.0.as_deref_mut().map(core::mem::take).unwrap_or_default()
    }
}

impl<T, const N: usize> Default for Later<T, N> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T, const N: usize> Deref for Later<T, N> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        self.0.as_deref().map_or(&[], |list| list)
    }
}

impl<T: PartialEq, const N: usize> PartialEq for Later<T, N> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Serialize, const N: usize> Serialize for Later<T, N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        (**self).serialize(serializer)
    }
}

impl<'de, T: Deserialize<'de>, const N: usize> Deserialize<'de> for Later<T, N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let list = ArrayVec::deserialize(deserializer)?;
        Ok(Self((!list.is_empty()).then(|| Box::new(list))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_list_has_no_room_and_a_taken_one_keeps_it() {
        let mut list = Later::<u8, 3>::default();
        assert!(list.0.is_none() && list.is_empty() && list.take().is_empty() && list.0.is_none());
        list.room().push(7);
        assert_eq!(&*list, &[7]);
        assert_eq!(list.take().as_slice(), &[7]);
        assert!(list.0.is_some() && list.is_empty() && list == Later::default());
    }
}

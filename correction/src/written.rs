//! Serde forms of what serde has none for: arrays of any length, and what is shared behind an `Arc`.

/// An array, as a list.
pub(crate) mod array {
    use arrayvec::ArrayVec;
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer, T: Serialize, const N: usize>(
        array: &[T; N],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        array.as_slice().serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>, T: Deserialize<'de>, const N: usize>(
        deserializer: D,
    ) -> Result<[T; N], D::Error> {
        let elements = ArrayVec::<T, N>::deserialize(deserializer)?;
        let count = elements.len();
        elements.into_inner().map_err(|_| D::Error::custom(format_args!("{count} elements, must be {N}")))
    }
}

/// A calibration, whole: who reads it back has one of its own.
pub(crate) mod shared {
    use alloc::sync::Arc;

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::calibration::Calibration;

    pub(crate) fn serialize<S: Serializer>(
        calibration: &Arc<Calibration>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        calibration.as_ref().serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Arc<Calibration>, D::Error> {
        Calibration::deserialize(deserializer).map(Arc::new)
    }
}

//! Distributions of times in fixed memory.

use std::collections::BTreeMap;

use serde::Serialize;

/// Buckets of one octave: a value is known to better than 1/128 of itself.
const BUCKETS: u32 = 128;
/// log2 of it.
const BITS: u32 = BUCKETS.trailing_zeros();

/// How values are spread (ns).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Spread {
    /// How many there are.
    pub count: u64,
    /// The smallest.
    pub min_ns: u64,
    /// The median.
    pub p50_ns: u64,
    /// 99 of 100 are not above it.
    pub p99_ns: u64,
    /// The largest.
    pub max_ns: u64,
}

/// Values that are nearly equal.
#[derive(Debug, Clone, Copy, Default)]
struct Bucket {
    count: u64,
    /// Sum of what they exceed the bucket's lower end by.
    excess: u64,
}

/// A histogram of numbers of nanoseconds, with 128 buckets in each octave.
///
/// Each bucket knows the mean of its values, so that a value that all of them share comes out exactly. Octaves that do not
/// occur take no memory; all 58 together take 120 kB.
#[derive(Debug, Clone, Default)]
pub(super) struct Histogram {
    octaves: BTreeMap<u32, Vec<Bucket>>,
    count: u64,
    range: Option<[u64; 2]>,
}

impl Histogram {
    /// Enters a value.
    pub(super) fn add(&mut self, value: u64) {
        self.count += 1;
        self.range = Some(self.range.map_or([value; 2], |[min, max]| [min.min(value), max.max(value)]));
        let (octave, index) = place(value);
        let buckets = self.octaves.entry(octave).or_insert_with(|| vec![Bucket::default(); BUCKETS as usize]);
        if let Some(bucket) = buckets.get_mut(index) {
            bucket.count += 1;
            bucket.excess = bucket.excess.saturating_add(value - lower_end(octave, index));
        }
    }

    /// The value that `per_mille` of 1000 values do not exceed; 0 where there are none.
    pub(super) fn quantile(&self, per_mille: u64) -> u64 {
        let Some([min, max]) = self.range else { return 0 };
        let rank = (u128::from(self.count) * u128::from(per_mille)).div_ceil(1000).max(1);
        let mut passed = 0;
        for (&octave, buckets) in &self.octaves {
            for (index, bucket) in buckets.iter().enumerate() {
                passed += u128::from(bucket.count);
                if passed >= rank {
                    let mean = lower_end(octave, index) + bucket.excess / bucket.count.max(1);
                    return mean.clamp(min, max);
                }
            }
        }
        max
    }

    /// The median; `None` where there is no value.
    pub(super) fn median(&self) -> Option<u64> {
        self.range.map(|_| self.quantile(500))
    }

    /// How many values there are.
    pub(super) fn count(&self) -> u64 {
        self.count
    }

    /// What it comes to; `None` where there is no value.
    pub(super) fn spread(&self) -> Option<Spread> {
        let [min_ns, max_ns] = self.range?;
        let [p50_ns, p99_ns] = [500, 990].map(|per_mille| self.quantile(per_mille));
        Some(Spread { count: self.count, min_ns, p50_ns, p99_ns, max_ns })
    }
}

/// Octave and bucket of a value.
fn place(value: u64) -> (u32, usize) {
    let octave = (u64::BITS - value.leading_zeros()).saturating_sub(BITS);
    let scaled = value >> octave.saturating_sub(1);
    // Below the first octave the buckets are the values themselves; above, the leading one says nothing.
    let index = if octave == 0 { scaled } else { scaled - u64::from(BUCKETS) };
    (octave, usize::try_from(index).unwrap_or(0))
}

/// The smallest value of a bucket.
fn lower_end(octave: u32, index: usize) -> u64 {
    let index = index as u64;
    if octave == 0 { index } else { (index + u64::from(BUCKETS)) << (octave - 1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_has_a_bucket_that_begins_at_it_or_just_below() {
        let mut values = vec![0, 1, 127, 128, 129, 255, 256, 257, u64::MAX];
        values.extend((7..64).flat_map(|bit| [(1 << bit) - 1, 1 << bit, (1_u64 << bit) + 1]));
        for value in values {
            let (octave, index) = place(value);
            assert!(index < BUCKETS as usize, "{value}");
            let low = lower_end(octave, index);
            assert!(low <= value && value - low <= value / 128, "{value} {low}");
        }
    }

    #[test]
    fn quantiles_are_those_of_the_values() {
        let mut histogram = Histogram::default();
        assert_eq!(histogram.spread(), None);
        (0..1000).for_each(|_| histogram.add(5_000_000));
        let spread = histogram.spread().unwrap();
        assert_eq!(
            (spread.min_ns, spread.p50_ns, spread.p99_ns, spread.max_ns),
            (5_000_000, 5_000_000, 5_000_000, 5_000_000)
        );
        let mut histogram = Histogram::default();
        (1..=100_000).rev().for_each(|value| histogram.add(value * 10));
        for (per_mille, expected) in [(500, 500_000), (990, 990_000), (1000, 1_000_000)] {
            let got = histogram.quantile(per_mille);
            assert!(got.abs_diff(expected) <= expected / 100, "{per_mille}: {got}");
        }
    }

    #[test]
    fn memory_does_not_grow_with_the_number_of_values() {
        let mut histogram = Histogram::default();
        for bit in 0..64 {
            (0..1000).for_each(|value| histogram.add((1_u64 << bit).saturating_add(value)));
        }
        assert!(histogram.octaves.len() <= 58, "{}", histogram.octaves.len());
        assert!(histogram.octaves.values().all(|buckets| buckets.len() == 128));
    }
}

//! A histogram of latencies with a bounded relative error.

use isotherm_protocol::status::LatencyBucket;

/// Sub-buckets per power of two: a bucket is at most 1/16 of its lower bound wide.
const SUB_BUCKETS: u64 = 1 << SUB_BITS;
/// log₂ of it.
const SUB_BITS: u32 = 4;
/// One linear stretch below 16 ns, then sixteen buckets for each power of two up to 2⁶⁴ ns.
const BUCKETS: usize = ((u64::BITS - SUB_BITS + 1) as usize) << SUB_BITS;

/// Counts latencies in logarithmic buckets. Buckets are made for those powers of two in which there is a latency, when its
/// first one comes: a unit's latencies lie within some of the 61.
#[derive(Debug, Clone, Default)]
pub struct Histogram {
    /// In order.
    octaves: Vec<Octave>,
    total: u64,
    sum: u64,
    largest: u64,
}

/// The buckets of a power of two.
#[derive(Debug, Clone)]
struct Octave {
    number: usize,
    counts: [u64; 1 << SUB_BITS],
}

impl Histogram {
    /// Counts one latency (ns); whether it is the first.
    pub fn record(&mut self, ns: u64) -> bool {
        let bucket = bucket(ns);
        let (number, sub) = (bucket >> SUB_BITS, bucket % (1 << SUB_BITS));
        let place = self.octaves.binary_search_by_key(&number, |octave| octave.number);
        let place = place.unwrap_or_else(|place| {
            // There are few, and they stay.
            self.octaves.reserve_exact(1);
            self.octaves.insert(place, Octave { number, counts: [0; 1 << SUB_BITS] });
            place
        });
        if let Some(count) = self.octaves.get_mut(place).and_then(|octave| octave.counts.get_mut(sub)) {
            *count += 1;
        }
        self.total += 1;
        self.sum = self.sum.saturating_add(ns);
        self.largest = self.largest.max(ns);
        self.total == 1
    }

    /// Every bucket there is, in order, with its number.
    fn counts(&self) -> impl Iterator<Item = (u64, u64)> + '_ {
        self.octaves.iter().flat_map(|octave| {
            let counts = octave.counts.iter().enumerate();
            counts.map(|(sub, count)| (((octave.number << SUB_BITS) + sub) as u64, *count))
        })
    }

    /// How many were counted.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.total
    }

    /// Sum of all that were counted (ns).
    #[must_use]
    pub fn sum_ns(&self) -> u64 {
        self.sum
    }

    /// The buckets in which something was counted, by their largest latency.
    #[must_use]
    pub fn buckets(&self) -> Vec<LatencyBucket> {
        let counted = self.counts().filter(|(_, count)| *count > 0);
        counted.map(|(index, count)| LatencyBucket { up_to_ns: upper_bound(index), count }).collect()
    }

    /// The latency (ns) that the share `share` (0…1) of all counted ones does not exceed; 0 where nothing was counted.
    ///
    /// *Numerics*: never below the exact value, at most 1/16 above it.
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "a rank among fewer than 2⁵³ latencies; float-to-int saturates"
    )]
    pub fn quantile(&self, share: f64) -> u64 {
        let rank = ((self.total as f64 * share.clamp(0.0, 1.0)).ceil() as u64).max(1);
        let mut seen = 0;
        for (index, count) in self.counts() {
            seen += count;
            if seen >= rank {
                return upper_bound(index).min(self.largest);
            }
        }
        self.largest
    }
}

/// Index of the bucket that a latency falls in.
fn bucket(ns: u64) -> usize {
    if ns < SUB_BUCKETS {
        return usize::try_from(ns).unwrap_or(0);
    }
    let shift = ns.ilog2() - SUB_BITS;
    let sub = (ns >> shift) - SUB_BUCKETS;
    usize::try_from(u64::from(shift + 1) * SUB_BUCKETS + sub).unwrap_or(BUCKETS - 1)
}

/// Largest latency of a bucket.
fn upper_bound(index: u64) -> u64 {
    if index < SUB_BUCKETS {
        return index;
    }
    let shift = index / SUB_BUCKETS - 1;
    let lower = (SUB_BUCKETS + index % SUB_BUCKETS) << shift;
    lower + ((1 << shift) - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_latency_falls_in_a_bucket_that_ends_at_most_a_sixteenth_above_it() {
        let powers = (0..u64::BITS).flat_map(|bit| {
            let power = 1_u64 << bit;
            [power - 1, power, power | (power >> 1), power | (power >> 2) | 1]
        });
        for ns in powers.chain([u64::MAX]) {
            let index = bucket(ns);
            assert!(index < BUCKETS, "{ns}");
            let upper = upper_bound(index as u64);
            assert!(upper >= ns && upper - ns <= ns / SUB_BUCKETS, "{ns}: {upper}");
            assert!(index == 0 || upper_bound(index as u64 - 1) < ns, "{ns}");
        }
    }

    #[test]
    fn quantiles_of_a_known_set() {
        let mut histogram = Histogram::default();
        assert_eq!(histogram.quantile(0.5), 0);
        for us in 1..=1000 {
            histogram.record(us * 1000);
        }
        for (share, exact) in [(0.0, 1_000), (0.5, 500_000), (0.99, 990_000), (1.0, 1_000_000)] {
            let got = histogram.quantile(share);
            assert!(got >= exact && got <= exact + exact / 16, "{share}: {got}");
        }
        assert_eq!((histogram.total(), histogram.sum_ns()), (1000, 500_500_000));
        histogram.record(u64::MAX);
        assert_eq!(histogram.quantile(1.0), u64::MAX);
    }
}

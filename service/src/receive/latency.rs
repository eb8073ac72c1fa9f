//! A histogram of latencies with a bounded relative error.

use hdrhistogram::Histogram as Counts;
use isotherm_protocol::status::LatencyBucket;

/// Counts latencies in buckets, of which each is at most 1/16 of its lower bound wide. There are buckets up to the largest latency so
/// far: one that is larger makes more.
#[derive(Debug, Clone)]
pub struct Histogram {
    /// `None` never: one digit is a precision that can be had.
    counts: Option<Counts<u64>>,
    sum: u64,
    largest: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self { counts: Counts::new(1).ok(), sum: 0, largest: 0 }
    }
}

impl Histogram {
    /// Counts one latency (ns); whether it is the first.
    pub fn record(&mut self, ns: u64) -> bool {
        // The last bucket ends below the largest number that there is; no latency is near it.
        let ns = ns.min(u64::MAX >> 1);
        let _ = self.counts.as_mut().map(|counts| counts.record(ns));
        self.sum = self.sum.saturating_add(ns);
        self.largest = self.largest.max(ns);
        self.total() == 1
    }

    /// How many were counted.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.counts.as_ref().map_or(0, Counts::len)
    }

    /// Sum of all that were counted (ns).
    pub(crate) fn sum_ns(&self) -> u64 {
        self.sum
    }

    /// The buckets in which something was counted, by their largest latency.
    #[must_use]
    pub fn buckets(&self) -> Vec<LatencyBucket> {
        let counted = self.counts.iter().flat_map(Counts::iter_recorded);
        let bucket = counted.map(|bucket| LatencyBucket {
            up_to_ns: bucket.value_iterated_to(),
            count: bucket.count_since_last_iteration(),
        });
        bucket.collect()
    }

    /// The latency (ns) that the share `share` (0…1) of all counted ones does not exceed; 0 where nothing was counted.
    ///
    /// *Numerics*: never below the exact value, at most 1/16 above it.
    #[must_use]
    pub fn quantile(&self, share: f64) -> u64 {
        // A share of 0 would give the lower end of a bucket.
        let share = share.max(f64::MIN_POSITIVE);
        self.counts.as_ref().map_or(0, |counts| counts.value_at_quantile(share)).min(self.largest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_latency_falls_in_a_bucket_that_ends_at_most_a_sixteenth_above_it() {
        let powers = (0..u64::BITS - 1).flat_map(|bit| {
            let power = 1_u64 << bit;
            [power - 1, power, power | (power >> 1), power | (power >> 2) | 1]
        });
        for ns in powers.chain([u64::MAX >> 1]) {
            let mut histogram = Histogram::default();
            assert!(histogram.record(ns) && !histogram.record(ns));
            let [bucket] = histogram.buckets()[..] else { panic!("{ns}: {histogram:?}") };
            assert!(bucket.count == 2 && bucket.up_to_ns >= ns, "{ns}: {bucket:?}");
            assert!(bucket.up_to_ns - ns <= ns / 16, "{ns}: {bucket:?}");
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
        assert_eq!(histogram.quantile(1.0), u64::MAX >> 1);
    }
}

//! Pulse counter: turns an accumulated phase into counts and carries the fraction over.

/// One counter.
#[derive(Debug, Clone, Default)]
pub(crate) struct Counter {
    /// Part of a count that has not been put out yet; in [0, 1) where counts are whole.
    fraction: f64,
}

impl Counter {
    pub(crate) fn starting_at(fraction: f64) -> Self {
        Self { fraction }
    }

    /// Counts for a further `phase`, in counts: whole numbers where `quantised`, else the phase itself.
    pub(crate) fn count(&mut self, phase: f64, quantised: bool) -> f64 {
        if !quantised {
            return phase;
        }
        let total = self.fraction + phase;
        let whole = libm::floor(total);
        self.fraction = total - whole;
        whole
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_add_up_to_the_phase_within_one_count() {
        let mut counter = Counter::starting_at(0.3);
        let (mut counts, mut phase) = (0.0, 0.0);
        for index in 0..10_000 {
            let step = 40.0 * libm::sin(f64::from(index) * 0.37) - 0.123;
            counts += counter.count(step, true);
            phase += step;
            assert!((counts - phase).abs() < 1.0);
        }
    }
}

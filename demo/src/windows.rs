//! Rate errors, averaged over windows of event time.

use isotherm_correction::units::AngularRate;

/// Mean rate errors over one window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mean {
    /// Middle of the window after the start of the run (s).
    pub(crate) time_s: f64,
    /// Raw minus true rate about the case axes (rad/s).
    pub(crate) raw: [f64; 3],
    /// Corrected minus true rate about the case axes (rad/s).
    pub(crate) corrected: [f64; 3],
}

/// Which of the two errors.
pub(crate) type Stage = fn(&Mean) -> [f64; 3];
pub(crate) const RAW: Stage = |mean| mean.raw;
pub(crate) const CORRECTED: Stage = |mean| mean.corrected;

/// Root mean square over the three axes.
pub(crate) fn over_axes(error: [f64; 3]) -> f64 {
    (error.iter().map(|error| error * error).sum::<f64>() / 3.0).sqrt()
}

/// Sums the angle errors of the ticks into windows of equal length.
#[derive(Debug)]
pub(crate) struct Windows {
    length_s: f64,
    index: f64,
    duration_s: f64,
    raw: [f64; 3],
    corrected: [f64; 3],
    pub(crate) means: Vec<Mean>,
}

impl Windows {
    /// Windows of `length_s` (s), the first one from time zero on.
    pub(crate) fn new(length_s: f64) -> Self {
        Self { length_s, index: 0.0, duration_s: 0.0, raw: [0.0; 3], corrected: [0.0; 3], means: Vec::new() }
    }

    /// Adds the angle errors (rad) of the tick that ends at `end_s` and lasts `duration_s`.
    pub(crate) fn add(&mut self, end_s: f64, duration_s: f64, raw: [f64; 3], corrected: [f64; 3]) {
        let index = ((end_s - 0.5 * duration_s) / self.length_s).floor();
        if index > self.index {
            self.close();
            self.index = index;
        }
        self.duration_s += duration_s;
        for axis in 0..3 {
            self.raw[axis] += raw[axis];
            self.corrected[axis] += corrected[axis];
        }
    }

    /// Ends the last window.
    pub(crate) fn finish(mut self) -> Vec<Mean> {
        self.close();
        self.means
    }

    /// A window that is less than half full (at the end, or over a gap) says too little to stand beside the others.
    fn close(&mut self) {
        let duration_s = std::mem::take(&mut self.duration_s);
        let (raw, corrected) = (std::mem::take(&mut self.raw), std::mem::take(&mut self.corrected));
        if duration_s >= 0.5 * self.length_s {
            self.means.push(Mean {
                time_s: (self.index + 0.5) * self.length_s,
                raw: raw.map(|angle| angle / duration_s),
                corrected: corrected.map(|angle| angle / duration_s),
            });
        }
    }
}

/// Size of an error: root mean square and peak to peak (°/h).
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub(crate) struct Spread {
    pub(crate) rms_deg_per_h: f64,
    pub(crate) peak_to_peak_deg_per_h: f64,
}

impl Spread {
    fn of(errors: impl Iterator<Item = f64>) -> Self {
        let (mut count, mut squares, mut low, mut high) = (0.0, 0.0, f64::INFINITY, f64::NEG_INFINITY);
        for error in errors {
            count += 1.0;
            squares += error * error;
            low = low.min(error);
            high = high.max(error);
        }
        if count < 1.0 {
            return Self::default();
        }
        Self {
            rms_deg_per_h: deg_per_h((squares / count).sqrt()),
            peak_to_peak_deg_per_h: deg_per_h(high - low),
        }
    }

    /// About one axis.
    pub(crate) fn about(means: &[Mean], stage: Stage, axis: usize) -> Self {
        Self::of(means.iter().map(|mean| stage(mean)[axis]))
    }

    /// Root mean square over all three axes; peak to peak about the axis where it is largest.
    pub(crate) fn overall(means: &[Mean], stage: Stage) -> Self {
        let rms = Self::of(means.iter().map(|mean| over_axes(stage(mean)))).rms_deg_per_h;
        let axes = (0..3).map(|axis| Self::about(means, stage, axis).peak_to_peak_deg_per_h);
        Self { rms_deg_per_h: rms, peak_to_peak_deg_per_h: axes.fold(0.0, f64::max) }
    }
}

/// rad/s as °/h.
pub(crate) fn deg_per_h(rad_per_s: f64) -> f64 {
    AngularRate::from_rad_per_s(rad_per_s).as_deg_per_h()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rad_per_s(deg_per_h: f64) -> f64 {
        AngularRate::from_deg_per_h(deg_per_h).as_rad_per_s()
    }

    #[test]
    fn a_constant_error_is_its_own_rms_and_has_no_peak_to_peak() {
        let mut windows = Windows::new(1.0);
        for tick in 1..=1000 {
            let raw = [rad_per_s(3.0) * 0.005; 3];
            windows.add(f64::from(tick) * 0.005, 0.005, raw, [0.0; 3]);
        }
        let means = windows.finish();
        assert_eq!(means.len(), 5);
        assert!((means[1].time_s - 1.5).abs() < 1e-12);
        let raw = Spread::overall(&means, RAW);
        assert!((raw.rms_deg_per_h - 3.0).abs() < 1e-9 && raw.peak_to_peak_deg_per_h < 1e-9, "{raw:?}");
        assert_eq!(Spread::overall(&means, CORRECTED), Spread::default());
    }

    #[test]
    fn rms_is_over_all_axes_and_peak_to_peak_of_the_worst_one() {
        let mean = |raw: [f64; 3]| Mean { time_s: 0.0, raw: raw.map(rad_per_s), corrected: [0.0; 3] };
        let means = [mean([1.0, 2.0, 2.0]), mean([-1.0, -2.0, 2.0])];
        let raw = Spread::overall(&means, RAW);
        assert!((raw.rms_deg_per_h - 3.0_f64.sqrt()).abs() < 1e-9, "{raw:?}");
        assert!((raw.peak_to_peak_deg_per_h - 4.0).abs() < 1e-9, "{raw:?}");
        assert_eq!(Spread::overall(&[], RAW), Spread::default());
    }

    #[test]
    fn a_window_that_is_mostly_missing_is_left_out() {
        let mut windows = Windows::new(1.0);
        for tick in (1..=40).chain(80..=100) {
            windows.add(f64::from(tick) * 0.1, 0.1, [1.0; 3], [0.0; 3]);
        }
        let times: Vec<_> = windows.finish().iter().map(|mean| mean.time_s).collect();
        assert_eq!(times, [0.5, 1.5, 2.5, 3.5, 8.5, 9.5]);
    }
}

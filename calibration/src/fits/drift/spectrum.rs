//! Power spectral density of a log by Welch's method, and the lines that stand out of it.
//!
//! Segments under a Hann window, half overlapping, never across a gap. Two real segments go through one complex
//! transform: |Z(f)|² + |Z(−f)|² is twice the sum of their powers.

use crate::numbers::{percentile, real};
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Shortest segment (readings).
const SHORTEST: usize = 64;
/// Longest segment (readings).
const LONGEST: usize = 1 << 17;
/// Segments that a log is cut into where it is long enough, before overlap.
const SEGMENTS: usize = 8;
/// A line must be so unlikely in noise, over all frequencies together.
const FALSE_ALARM: f64 = 1e-4;
/// Half width of the neighbourhood that a line must stand out of (bins).
const NEIGHBOURHOOD: usize = 24;
/// Bins of the window's main lobe to either side, which belong to the line itself.
const LOBE: usize = 3;
/// Most lines that are told.
const MOST_LINES: usize = 8;

/// A one-sided power spectral density.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Distance of the frequencies (Hz); the first density belongs to the first multiple.
    pub step_hz: f64,
    /// Densities, in the square of the readings' unit of measure per Hz.
    pub density: Vec<f64>,
    /// Segments that were averaged.
    pub segments: usize,
}

/// A line.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Line {
    /// Frequency (Hz).
    pub frequency_hz: f64,
    /// Amplitude of the sine, in the readings' unit of measure.
    pub amplitude: f64,
    /// How far it stands out of its neighbourhood, as a ratio of densities.
    pub ratio: f64,
}

impl Spectrum {
    /// Of pieces without gaps, one reading every `tick_s`; `None` where no piece has 64 readings.
    pub fn of(pieces: &[&[f64]], mean: f64, tick_s: f64) -> Option<Self> {
        let longest = pieces.iter().map(|piece| piece.len()).max()?;
        if longest < SHORTEST {
            return None;
        }
        let mut length = SHORTEST;
        while length * 2 <= LONGEST && length * 2 * SEGMENTS <= longest {
            length *= 2;
        }
        let angle = |k: usize| std::f64::consts::TAU * real(k) / real(length);
        let window: Vec<f64> = (0..length).map(|k| 0.5 - 0.5 * libm::cos(angle(k))).collect();
        let power: f64 = window.iter().map(|w| w * w).sum();
        let fft = FftPlanner::new().plan_fft_forward(length);
        let mut scratch = vec![Complex::default(); fft.get_inplace_scratch_len()];
        let mut buffer = vec![Complex::default(); length];
        let mut sums = vec![0.0; length / 2];
        let starts =
            |piece: &[f64]| (0..=piece.len().saturating_sub(length)).step_by(length / 2).collect::<Vec<_>>();
        let fitting = pieces.iter().filter(|piece| piece.len() >= length);
        let segments: Vec<&[f64]> = fitting
            .flat_map(|piece| starts(piece).into_iter().filter_map(|start| piece.get(start..start + length)))
            .collect();
        for pair in segments.chunks(2) {
            let (one, other) = (pair.first().copied().unwrap_or(&[]), pair.get(1).copied().unwrap_or(&[]));
            for (k, (value, weight)) in buffer.iter_mut().zip(&window).enumerate() {
                let at = |segment: &[f64]| segment.get(k).map_or(0.0, |reading| (reading - mean) * weight);
                *value = Complex::new(at(one), at(other));
            }
            fft.process_with_scratch(&mut buffer, &mut scratch);
            for (k, sum) in sums.iter_mut().enumerate() {
                let up = buffer.get(k + 1).map_or(0.0, Complex::norm_sqr);
                let down = buffer.get(length - k - 1).map_or(0.0, Complex::norm_sqr);
                *sum += 0.5 * (up + down);
            }
        }
        let scale = 2.0 * tick_s / (power * real(segments.len()));
        let density = sums.into_iter().map(|sum| sum * scale).collect();
        Some(Self { step_hz: 1.0 / (real(length) * tick_s), density, segments: segments.len() })
    }

    /// Frequencies and densities.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.density.iter().enumerate().map(|(k, density)| (real(k + 1) * self.step_hz, *density))
    }

    /// Lines that stand out of their neighbourhoods, the strongest first.
    pub fn lines(&self) -> Vec<Line> {
        let count = self.density.len();
        // Half overlapping Hann segments: each new one brings about 0.95 of its own.
        let degrees = (2.0 * (1.0 + 0.9 * (real(self.segments) - 1.0))).max(2.0);
        let Ok(chi) = ChiSquared::new(degrees) else { return Vec::new() };
        let limit = chi.inverse_cdf(1.0 - FALSE_ALARM / real(count)) / chi.inverse_cdf(0.5);
        let mut lines = Vec::new();
        // Below the first lobe there is no neighbourhood, only the slope of slow drift.
        for k in LOBE + 1..count.saturating_sub(LOBE) {
            let Some(here) = self.density.get(k).copied() else { continue };
            let lobe = self.density.get(k - LOBE..=k + LOBE).unwrap_or(&[]);
            if lobe.iter().any(|other| *other > here) {
                continue;
            }
            let ratio = here / self.background(k);
            if ratio > limit {
                // The power of a sine of amplitude A is A²/2; the window spreads it over 1.5 bins.
                let power = (here - here / ratio) * 1.5 * self.step_hz;
                let frequency_hz = real(k + 1) * self.step_hz;
                lines.push(Line { frequency_hz, amplitude: (2.0 * power).sqrt(), ratio });
            }
        }
        lines.sort_by(|a, b| b.ratio.total_cmp(&a.ratio));
        lines.truncate(MOST_LINES);
        lines
    }

    /// Median density around a bin, without the line's own lobe; the larger of both sides, so that a slope is no line.
    fn background(&self, k: usize) -> f64 {
        let half = NEIGHBOURHOOD.min((k - LOBE).max(4));
        let side = |from: usize, to: usize| {
            let values = self.density.get(from..to.min(self.density.len())).unwrap_or(&[]);
            percentile(values.iter().copied(), 50)
        };
        let below = side(k.saturating_sub(half + LOBE), k.saturating_sub(LOBE));
        let above = side(k + LOBE + 1, k + LOBE + 1 + half);
        below.max(above).max(f64::MIN_POSITIVE)
    }
}

#[expect(clippy::cast_precision_loss, reason = "numbers of ticks of tests")]
#[cfg(test)]
mod tests {
    use super::*;

    /// White noise of unit variance, roughly normal.
    fn noise(count: usize) -> Vec<f64> {
        let mut state = 1_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..count).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
    }

    #[test]
    fn white_noise_has_its_density_and_no_lines() {
        let readings = noise(100_000);
        let spectrum = Spectrum::of(&[&readings], 0.0, 0.01).unwrap();
        let mean = spectrum.density.iter().sum::<f64>() / spectrum.density.len() as f64;
        // Variance 1 over 50 Hz.
        assert!((mean / 0.02 - 1.0).abs() < 0.03, "{mean}");
        assert_eq!(spectrum.lines(), []);
    }

    #[test]
    fn a_sine_is_found_where_it_is_and_as_large_as_it_is() {
        let mut readings = noise(100_000);
        for (k, reading) in readings.iter_mut().enumerate() {
            *reading += 0.3 * (std::f64::consts::TAU * 7.0 * k as f64 * 0.01).sin() + 5.0;
        }
        // A gap in the middle changes nothing.
        let (a, b) = readings.split_at(60_000);
        let spectrum = Spectrum::of(&[a, b], 5.0, 0.01).unwrap();
        let lines = spectrum.lines();
        assert_eq!(lines.len(), 1, "{lines:?}");
        assert!((lines[0].frequency_hz - 7.0).abs() <= spectrum.step_hz);
        assert!((lines[0].amplitude / 0.3 - 1.0).abs() < 0.2, "{lines:?}");
        assert_eq!(Spectrum::of(&[&readings[..63]], 0.0, 1.0), None);
    }
}

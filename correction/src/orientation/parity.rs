//! Parity residuals of a redundant set, and the sensor that explains them.

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use super::linear::{orthonormal_columns, parity_rows};
use super::{Orientation, SensorMask, masked};
use crate::later::Later;
use crate::sample::{MAX_PARITY, MAX_SENSORS, MIN_SENSORS};

/// The remaining parity vector without the suspect must be shorter than this fraction of the one without the
/// second-best suspect; otherwise the fault is detected but not isolated.
pub const ISOLATION_RATIO: f64 = 0.5;

/// Squared length of a parity column (before its weight) below which a sensor is not watched by the others, so that its removal
/// explains nothing.
const SMALLEST_COVER: f64 = 1e-6;

/// What the parity of one tick says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ParityVerdict {
    /// N − 3 residuals (the sensor's unit); none where the sensors have no redundancy.
    pub residuals: ArrayVec<f64, MAX_PARITY>,
    /// The parity vector is longer than the limit, or not finite.
    pub exceeded: bool,
    /// The sensor that has explained the excess for the stated number of ticks in a row: exclude it.
    pub exclude: Option<usize>,
}

/// Memory of the parity check of one kind of sensor.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ParityCheck {
    compiled: Option<Compiled>,
    /// Who is suspected, and for how many ticks in a row.
    suspect: Option<(usize, u32)>,
}

/// The parity matrix of one set of sensors at one temperature.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Compiled {
    mask: SensorMask,
    temperature_deg_c: f64,
    /// V·√W: N − 3 rows, V·√W·C = 0, V·Vᵀ = 1.
    matrix: Later<[f64; MAX_SENSORS], MAX_PARITY>,
}

impl ParityCheck {
    /// Judges one tick.
    ///
    /// `readings` are the sensors' mean rates or forces over the tick (rad/s or m/s²), one per sensor; those
    /// outside the mask are not looked at. The matrix is compiled anew only when `mask` or
    /// `temperature_deg_c` differ from the last call's, so pass the temperature of the last thermal update.
    ///
    /// With four usable sensors a fault is detected only; with five or more it can be isolated: sensor i is
    /// suspected where the parity vector without it, `|p|² − (p·v_i)²/|v_i|²`, is below the limit, the smallest
    /// of all, and below [`ISOLATION_RATIO`] times the second smallest. A suspect whose removal would leave
    /// axes that cannot be resolved is not excluded.
    pub fn check(
        &mut self,
        orientation: &Orientation,
        temperature_deg_c: f64,
        mask: SensorMask,
        readings: &[f64],
    ) -> ParityVerdict {
        let mask = mask
            .intersection(SensorMask::all(orientation.sensors))
            .intersection(SensorMask::all(readings.len()));
        self.compile(orientation, temperature_deg_c, mask);
        let mut verdict = ParityVerdict::default();
        let Some(compiled) = &self.compiled else {
            return verdict;
        };

        for row in compiled.matrix.iter() {
            let products = row.iter().zip(readings).enumerate();
            let used = products.filter(|(index, _)| mask.contains(*index));
            verdict.residuals.push(used.fold(0.0, |sum, (_, (v, s))| sum + v * s));
        }
        let Some(limit) = orientation.parity_limit else {
            return verdict;
        };
        let energy: f64 = verdict.residuals.iter().map(|p| p * p).sum();
        verdict.exceeded = energy.is_nan() || energy > limit * limit;
        let suspect = verdict.exceeded.then(|| {
            isolate(compiled, &orientation.root_weights, &verdict.residuals, (energy, limit * limit))
        });
        self.suspect = suspect.flatten().map(|index| match self.suspect {
            Some((same, ticks)) if same == index => (index, ticks.saturating_add(1)),
            _ => (index, 1),
        });
        if let Some((index, ticks)) = self.suspect
            && ticks >= orientation.parity_confirm_ticks
            && orientation.inverse(temperature_deg_c, mask.without(index)).is_some()
        {
            verdict.exclude = Some(index);
        }
        verdict
    }

    /// Makes the compiled matrix that of the given sensors and temperature.
    fn compile(&mut self, orientation: &Orientation, temperature_deg_c: f64, mask: SensorMask) {
        if let Some(compiled) = &self.compiled {
            // Bits, so that NaN (T_ref) is the same temperature as NaN.
            let same = compiled.temperature_deg_c.to_bits() == temperature_deg_c.to_bits();
            if same && compiled.mask == mask {
                return;
            }
            if compiled.mask != mask {
                self.suspect = None;
            }
        }
        let mut matrix = self.compiled.take().map(|before| before.matrix).unwrap_or_default();
        matrix.take();
        if mask.count() > MIN_SENSORS {
            let rows = masked(orientation.rows_at(temperature_deg_c), mask);
            if let Some((q, _)) = orthonormal_columns(&orientation.weighted(rows)) {
                *matrix.room() = parity_rows(&q, |index| mask.contains(index));
            }
            for row in matrix.room() {
                for (v, root_weight) in row.iter_mut().zip(&orientation.root_weights) {
                    *v *= root_weight;
                }
            }
        }
        self.compiled = Some(Compiled { mask, temperature_deg_c, matrix });
    }
}

/// The sensor whose removal explains the residuals, if there is exactly one; from their squared length and its limit.
fn isolate(
    compiled: &Compiled,
    root_weights: &[f64; MAX_SENSORS],
    residuals: &[f64],
    (energy, limit): (f64, f64),
) -> Option<usize> {
    // One residual is explained equally well by every sensor.
    if residuals.len() < 2 {
        return None;
    }
    let mut best: Option<(usize, f64)> = None;
    let mut second = f64::INFINITY;
    for (index, root_weight) in root_weights.iter().enumerate() {
        if !compiled.mask.contains(index) {
            continue;
        }
        let (mut along, mut cover) = (0.0, 0.0);
        for (row, p) in compiled.matrix.iter().zip(residuals) {
            along += row[index] * p;
            cover += row[index] * row[index];
        }
        if cover <= SMALLEST_COVER * root_weight * root_weight {
            continue;
        }
        let remaining = (energy - along * along / cover).max(0.0);
        match best {
            Some((_, smallest)) if remaining >= smallest => second = second.min(remaining),
            _ => {
                second = best.map_or(f64::INFINITY, |(_, smallest)| smallest);
                best = Some((index, remaining));
            }
        }
    }
    let (index, remaining) = best?;
    let clearly = remaining < ISOLATION_RATIO * ISOLATION_RATIO * second;
    (remaining <= limit && clearly).then_some(index)
}

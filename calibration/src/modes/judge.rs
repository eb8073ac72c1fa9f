//! Drift in running mode: what a navigator gets over whole reversal periods, bridged ticks and all.

use std::sync::Arc;

use isotherm_correction::sample::{CorrectedTick, SensorFlags, TickFlags};
use isotherm_correction::unit::Unit;
use isotherm_correction::units::AngularRate;
use isotherm_protocol::document::Sample;

use crate::error::Error;
use crate::report::Curve;
use crate::report::curve::channel_of;
use crate::run::{Run, Watch};
use crate::written::Written;

/// Means of a run's corrected rate over windows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Running {
    /// Middles of the windows since the beginning (s).
    pub time_s: Vec<f64>,
    /// Mean rates about the case axes (°/h); no number where ticks are missing, or a gyro is not valid.
    pub rate_deg_per_h: [Vec<f64>; 3],
    /// Temperatures that the axes' gyros follow, at the end of each window (°C).
    pub temperature_deg_c: [Vec<f64>; 3],
}

#[derive(Default)]
struct Window {
    begin_s: Option<f64>,
    length_s: f64,
    angle: [f64; 3],
    broken: bool,
}

impl Running {
    /// Corrects a run and averages what comes out.
    ///
    /// # Errors
    /// As [`Run::correct`].
    pub fn of(run: &Run, written: &Written, window_s: f64, watch: impl Watch) -> Result<Self, Error> {
        let channels = [0, 1, 2].map(|axis| channel_of(&written.document, true, axis));
        let mut running = Self::default();
        let mut window = Window::default();
        let mut first = None;
        run.correct(&written.loaded, watch, |tick, unit| {
            let begin = tick.end_time.as_ns().saturating_sub(tick.duration.as_ns());
            #[expect(clippy::cast_precision_loss, reason = "a run is far below 2⁵³ ns")]
            let since_s = (begin - *first.get_or_insert(begin)) as f64 * 1e-9;
            window.take(tick, since_s);
            if window.length_s > window_s - 0.5 * tick.duration.as_s() {
                running.close(&std::mem::take(&mut window), unit, &channels);
            }
        })?;
        Ok(running)
    }

    fn close(&mut self, window: &Window, unit: &Unit, channels: &[Option<String>; 3]) {
        let Some(begin_s) = window.begin_s else { return };
        self.time_s.push(begin_s + 0.5 * window.length_s);
        for (axis, wanted) in channels.iter().enumerate() {
            let rate = AngularRate::from_rad_per_s(window.angle[axis] / window.length_s).as_deg_per_h();
            self.rate_deg_per_h[axis].push(if window.broken { f64::NAN } else { rate });
            let own = unit.channels().find(|channel| wanted.as_deref() == Some(&*channel.name));
            let deg_c = own.and_then(|channel| channel.state).map_or(f64::NAN, |state| state.temperature);
            self.temperature_deg_c[axis].push(deg_c);
        }
    }
}

impl Window {
    fn take(&mut self, tick: &CorrectedTick, since_s: f64) {
        let bridged = tick.flags.contains(TickFlags::INTERPOLATED);
        let valid = tick.gyro_flags.iter().all(|flags| flags.contains(SensorFlags::VALID));
        self.broken |= (self.begin_s.is_some() && tick.missed > 0) || !(bridged || valid);
        self.begin_s.get_or_insert(since_s);
        self.length_s += tick.duration.as_s();
        self.angle.iter_mut().zip(tick.delta_angle).for_each(|(sum, angle)| *sum += angle);
    }
}

/// A run before and after, by case axis, less the Earth rate (°/h); where that is not known, each less its own mean.
///
/// # Errors
/// As [`Run::correct`].
pub fn judged<W: Watch>(
    run: &Run,
    sample: Sample,
    [before, after]: [&Written; 2],
    earth: Option<[f64; 3]>,
    window_s: f64,
    mut watch: impl FnMut() -> W,
) -> Result<Vec<Curve>, Error> {
    let before = Running::of(run, before, window_s, watch())?;
    let after = Running::of(run, after, window_s, watch())?;
    let time_s: Arc<[f64]> = after.time_s.as_slice().into();
    let less = |values: &[f64], axis: usize| -> Vec<f64> {
        let truth = earth.map_or_else(|| crate::means::Size::of(values).mean, |earth| earth[axis]);
        values.iter().map(|value| value - truth).collect()
    };
    let curve = |(axis, name): (usize, &str)| Curve {
        of: format!("gyro {name}"),
        measure: "°/h".to_owned(),
        run: run.name.clone(),
        sample,
        window_s,
        time_s: Arc::clone(&time_s),
        temperature_deg_c: after.temperature_deg_c[axis].clone(),
        before: less(&before.rate_deg_per_h[axis], axis),
        after: less(&after.rate_deg_per_h[axis], axis),
    };
    let with_values = |curve: &Curve| curve.after.iter().any(|value| value.is_finite());
    Ok(["x", "y", "z"].into_iter().enumerate().map(curve).filter(with_values).collect())
}

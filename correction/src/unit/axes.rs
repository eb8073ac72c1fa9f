//! Input axes to case axes, following temperature on a straight line.

use serde::{Deserialize, Serialize};

use crate::orientation::{Inverse, Orientation, ParityCheck, ParityVerdict, SensorMask};
use crate::thermal::Ramp;
use crate::units::{Span, Timestamp};

/// Memory of one kind of sensor's orientation.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Axes {
    /// Temperature that the orientation follows (°C); `share` of its way is the share between the inverses.
    temperature: Ramp<1>,
    target: f64,
    clamped: bool,
    /// Whether a temperature was read: the first one is not approached from the assumed one, but met.
    started: bool,
    mask: SensorMask,
    from: Option<Inverse>,
    to: Option<Inverse>,
    /// Sensors that the parity check has not excluded.
    included: SensorMask,
    parity: ParityCheck,
}

impl Axes {
    /// Starts at the assumed temperature (°C).
    pub(super) fn new(orientation: &Orientation, target: f64) -> Self {
        let mask = SensorMask::all(orientation.sensors());
        let inverse = orientation.inverse(target, mask);
        Self {
            temperature: Ramp::hold([target]),
            target,
            clamped: outside(orientation, target),
            started: false,
            mask,
            from: inverse,
            to: inverse,
            included: mask,
            parity: ParityCheck::new(),
        }
    }

    /// Turns towards the orientation at a new temperature (°C).
    pub(super) fn update(
        &mut self,
        orientation: &Orientation,
        temperature: f64,
        start: Timestamp,
        over: Span,
    ) {
        let over = if self.started { over } else { Span::ZERO };
        self.started = true;
        let now = self.at(start);
        self.to = orientation.inverse(temperature, self.mask);
        self.from = now.or(self.to);
        self.target = temperature;
        self.clamped = outside(orientation, temperature);
        self.temperature.turn(start, over, [temperature]);
        if over == Span::ZERO {
            self.settle();
        }
    }

    /// Arrives at once where it is heading, after a step of the producer's clock.
    pub(super) fn settle(&mut self) {
        self.temperature.settle();
        self.from = self.to;
    }

    /// Whether the temperature is outside the fitted range.
    pub(super) fn clamped(&self) -> bool {
        self.clamped
    }

    /// Sensors that the parity check has not excluded.
    pub(super) fn included(&self) -> SensorMask {
        self.included
    }

    /// Resolves case axes from the sensors of `mask`; `None` where they do not span the space.
    pub(super) fn resolve(
        &mut self,
        orientation: &Orientation,
        mask: SensorMask,
        readings: &[f64],
        time: Timestamp,
    ) -> Option<[f64; 3]> {
        if mask != self.mask {
            let [now] = self.temperature.at(time);
            self.mask = mask;
            // Both ends anew, from where the temperature is now, so that the change of sensors is all that steps.
            self.from = orientation.inverse(now, mask);
            self.to = orientation.inverse(self.target, mask);
        }
        let (from, to) = (self.from.as_ref()?, self.to.as_ref()?);
        Some(from.lerp_apply(to, self.temperature.share(time), readings))
    }

    /// The way that the inverse is on, and its ends; `None` while not every sensor takes part.
    pub(super) fn of_all(&self, orientation: &Orientation) -> Option<(&Ramp<1>, &Inverse, &Inverse)> {
        let (all, [from, to]) = (SensorMask::all(orientation.sensors()), [&self.from, &self.to]);
        let (from, to) = (from.as_ref()?, to.as_ref()?);
        let masks = [self.included, self.mask, from.mask(), to.mask()];
        masks.iter().all(|mask| *mask == all).then_some((&self.temperature, from, to))
    }

    /// Temperature that the orientation follows (°C).
    pub(super) fn temperature_deg_c(&self, time: Timestamp) -> f64 {
        let [now] = self.temperature.at(time);
        now
    }

    /// The inverse in use at `time` and the sensors that it takes.
    pub(super) fn in_use(&self, time: Timestamp) -> Option<(SensorMask, Inverse)> {
        self.at(time).map(|inverse| (self.mask, inverse))
    }

    /// Watches the parity residuals; excludes a sensor where they call for it.
    pub(super) fn watch(
        &mut self,
        orientation: &Orientation,
        mask: SensorMask,
        rates: &[f64],
    ) -> ParityVerdict {
        let verdict = self.parity.check(orientation, self.target, mask, rates);
        if let Some(sensor) = verdict.exclude {
            self.included = self.included.without(sensor);
        }
        verdict
    }

    fn at(&self, time: Timestamp) -> Option<Inverse> {
        let (from, to) = (self.from.as_ref()?, self.to.as_ref()?);
        Some(from.lerp(to, self.temperature.share(time)))
    }
}

/// Whether a temperature (°C) is outside the range over which the orientation was fitted.
fn outside(orientation: &Orientation, temperature: f64) -> bool {
    let [first, last] = orientation.range_deg_c();
    !(first..=last).contains(&temperature)
}

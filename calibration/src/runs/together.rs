//! One run through several calibrations at once, each corrected tick beside the raw one.

use std::collections::VecDeque;
use std::slice;

use isotherm_correction::sample::{CorrectedTick, GyroTick, OutputKind};
use isotherm_correction::unit::{Unit, UnitSettings};
use isotherm_log::offline::{Loaded, troubles};
use isotherm_log::text::LogEvent;
use isotherm_protocol::stream::UnitStream;

use super::series::Series;
use super::{Fed, Run, Troubles};
use crate::error::Error;

impl Run {
    /// Its raw ticks of all gyros, in the order of the log.
    ///
    /// # Errors
    /// [`Error::Log`] where the log cannot be read.
    pub fn gyro_ticks(&self, mut each: impl FnMut(OutputKind, &GyroTick)) -> Result<(), Error> {
        self.walk(|fed| {
            if let Fed::Event(LogEvent::Gyro { output, tick }) = fed {
                each(*output, tick);
            }
            Ok(())
        })
    }

    /// Corrects the run with several calibrations of the same channels and sensors at once, as `isotherm-replay correct --ignore-journal`
    /// does with each. `each` sees every raw gyro tick that was corrected, what each calibration made of it, and the unit of the first as
    /// it stands behind it. What each passed over comes back.
    ///
    /// # Errors
    /// [`Error::Log`] where the log cannot be read; [`Error::Refused`] where nothing comes out.
    pub fn correct_together(
        &self,
        loaded: &[Loaded],
        each: impl FnMut(&GyroTick, &[CorrectedTick], &Unit),
    ) -> Result<Vec<Troubles>, Error> {
        self.correct_beside(loaded, |_| (), each)
    }

    /// Corrects the run with a calibration, and gives its readings as columns beside, from one reading of the log. The columns end where
    /// [`Run::series`] would refuse them; the correction says what is wrong with the log.
    ///
    /// # Errors
    /// As [`Run::correct_together`]; the columns are there all the same.
    pub fn correct_with_series(
        &self,
        loaded: &Loaded,
        mut each: impl FnMut(&CorrectedTick),
    ) -> (Series, Result<Troubles, Error>) {
        let (mut series, mut takes) = (self.no_series(), true);
        let beside = |fed: &Fed<'_>| takes = takes && series.take(fed).is_ok();
        let ticks = |_: &GyroTick, ticks: &[CorrectedTick], _: &Unit| ticks.iter().for_each(&mut each);
        let troubles = self.correct_beside(slice::from_ref(loaded), beside, ticks);
        (series, troubles.map(|troubles| troubles.concat()))
    }

    fn correct_beside(
        &self,
        loaded: &[Loaded],
        mut beside: impl FnMut(&Fed<'_>),
        mut each: impl FnMut(&GyroTick, &[CorrectedTick], &Unit),
    ) -> Result<Vec<Troubles>, Error> {
        let Some(first) = loaded.first() else { return Ok(Vec::new()) };
        // A document of gyros alone is asked about gyros: their log may well have accelerometers.
        let has_accelerometers = first.calibration.accel_count() > 0;
        let (mut units, mut left_out) = (Together::new(loaded), 0);
        self.walk(|fed| {
            beside(&fed);
            match fed {
                fed if !has_accelerometers && fed.is_accel() => {}
                Fed::Event(event) => units.handle(&self.taken(&self.kept(event, &mut left_out))),
                Fed::Frame(input, frame) => units.units.iter_mut().for_each(|unit| {
                    // One that cannot be read is counted, and its ticks are a gap.
                    let _ = unit.receive(input, frame);
                }),
            }
            units.give_out(&mut each);
            Ok(())
        })?;
        units.units.iter_mut().for_each(UnitStream::flush);
        units.give_out(&mut each);
        units.units.iter().map(|unit| self.judge_troubles(units.count, troubles(unit, left_out))).collect()
    }
}

/// Units that are fed with the same readings.
struct Together {
    units: Vec<UnitStream>,
    raw: VecDeque<GyroTick>,
    corrected: Vec<VecDeque<CorrectedTick>>,
    count: u64,
}

impl Together {
    fn new(loaded: &[Loaded]) -> Self {
        let unit = |loaded: &Loaded| loaded.stream(UnitSettings::default());
        let corrected = vec![VecDeque::new(); loaded.len()];
        Self { units: loaded.iter().map(unit).collect(), raw: VecDeque::new(), corrected, count: 0 }
    }

    fn handle(&mut self, event: &LogEvent) {
        if let LogEvent::Gyro { tick, .. } = event {
            self.raw.push_back(tick.clone());
        }
        self.units.iter_mut().for_each(|unit| unit.handle(event.into()));
    }

    /// Gives out what all of them have.
    fn give_out(&mut self, mut each: impl FnMut(&GyroTick, &[CorrectedTick], &Unit)) {
        for (unit, ticks) in self.units.iter_mut().zip(&mut self.corrected) {
            ticks.extend(unit.take_ready());
        }
        while self.corrected.iter().all(|ticks| !ticks.is_empty()) {
            let ticks: Vec<CorrectedTick> =
                self.corrected.iter_mut().filter_map(VecDeque::pop_front).collect();
            let (Some(first), Some(unit)) = (ticks.first(), self.units.first()) else { return };
            let (sequence, end) = (first.sequence, first.end_time);
            let found = self.raw.iter().position(|raw| raw.sequence == sequence && raw.end_time == end);
            // Ticks before it were refused, or came too late.
            if let Some(raw) = found.and_then(|found| self.raw.drain(..=found).next_back()) {
                self.count += 1;
                each(&raw, &ticks, unit.unit());
            }
        }
    }
}

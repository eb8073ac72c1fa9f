//! The real logs as events, by the mappings that the project ships.

use std::path::{Path, PathBuf};
use std::slice;
use std::sync::Arc;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::sample::CorrectedTick;
use isotherm_correction::unit::Event;
use isotherm_log::error::Error;
use isotherm_log::mapping::Mapping;
use isotherm_log::text::{LogEvent, LogReader};

use crate::data::root;
use crate::drive;

/// A log of `../shared/data`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RealLog {
    /// Laser gyro, parked.
    RlgStatic,
    /// MEMS unit through a chamber cycle.
    ChamberMems,
}

impl RealLog {
    /// Its file.
    #[must_use]
    pub fn path(self, data: &Path) -> PathBuf {
        data.join(match self {
            Self::RlgStatic => "rlg-static/rlg-static.imu.gz",
            Self::ChamberMems => "chamber-mems/chamber.tsv",
        })
    }

    /// Its shipped mapping.
    #[must_use]
    pub fn mapping(self) -> PathBuf {
        root().join("config/mappings").join(match self {
            Self::RlgStatic => "rlg-static.toml",
            Self::ChamberMems => "chamber-mems.toml",
        })
    }
}

/// All events of a log in time order.
///
/// # Errors
/// What is wrong with its mapping or itself.
pub fn events(data: &Path, log: RealLog) -> Result<Vec<LogEvent>, Error> {
    let mapping = Mapping::load(&log.mapping())?;
    let reader = LogReader::open(&mapping, &[log.path(data)])?;
    Ok(reader.collect::<Result<_, _>>()?)
}

/// A log through a unit with a calibration.
#[must_use]
pub fn correct(calibration: &Arc<Calibration>, events: &[LogEvent]) -> Vec<CorrectedTick> {
    let mut unit = drive::unit(calibration);
    let mut out = Vec::new();
    let mut emit = |tick: &CorrectedTick| out.push(tick.clone());
    for event in events {
        let event = match event {
            LogEvent::Gyro { output, tick } => Event::Gyro { output: *output, ticks: slice::from_ref(tick) },
            LogEvent::Accel { output, tick } => {
                Event::Accel { output: *output, ticks: slice::from_ref(tick) }
            }
            LogEvent::Temperature(reading) => Event::Temperature(slice::from_ref(reading)),
        };
        unit.handle(event, &mut emit);
    }
    unit.handle(Event::Flush, &mut emit);
    out
}

//! The ready mappings against the logs that they are for, where the data is there.

use std::path::PathBuf;

use isotherm_correction::sample::OutputKind;
use isotherm_log::mapping::Mapping;
use isotherm_log::text::{LogEvent, LogReader};

/// The folder of the real logs: `ISOTHERM_DATA`, or `../shared/data` beside the workspace.
pub(crate) fn data(log: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("ISOTHERM_DATA")
        .map_or_else(|| crate::common::root().join("../shared/data"), PathBuf::from);
    let path = folder.join(log);
    if !path.exists() {
        println!("skipped: no data at {}", path.display());
        return None;
    }
    Some(path)
}

/// All events of a log, read by a ready mapping.
fn events(mapping: &str, log: PathBuf) -> Vec<LogEvent> {
    let mapping = Mapping::load(&crate::common::mapping(mapping)).unwrap();
    LogReader::open(&mapping, &[log]).unwrap().map(Result::unwrap).collect()
}

/// Number of gyro ticks, accelerometer ticks, temperature readings.
fn numbers(events: &[LogEvent]) -> (usize, usize, usize) {
    let gyro = events.iter().filter(|event| matches!(event, LogEvent::Gyro { .. })).count();
    let accel = events.iter().filter(|event| matches!(event, LogEvent::Accel { .. })).count();
    (gyro, accel, events.len() - gyro - accel)
}

#[test]
fn with_data_the_laser_gyro_log_has_all_ticks_and_its_mean_rates() {
    let Some(log) = data("rlg-static/rlg-static.imu.gz") else { return };
    let events = events("rlg-static.toml", log);
    assert_eq!(numbers(&events), (184_718, 184_718, 0));
    let mut counts = [0.0; 3];
    let mut next = 0;
    for event in &events {
        let LogEvent::Gyro { output, tick } = event else { continue };
        assert_eq!((*output, tick.sequence), (OutputKind::Counts, next));
        assert_eq!(tick.duration.as_ns(), 10_000_000);
        next += 1;
        if next <= 180_000 {
            counts.iter_mut().zip(&tick.readings).for_each(|(sum, reading)| *sum += reading);
        }
    }
    // 0.1″ per count over half an hour: one count is 1/18 000 °/h.
    let rates = counts.map(|sum| sum / 18_000.0);
    for (rate, expected) in rates.iter().zip([-12.265, 0.474, 8.354]) {
        assert!((rate - expected).abs() < 1e-3, "{rates:?}");
    }
}

#[test]
fn with_data_the_chamber_log_has_rates_forces_and_temperatures() {
    let Some(log) = data("chamber-mems/chamber.tsv") else { return };
    let events = events("chamber-mems.toml", log);
    assert_eq!(numbers(&events), (8400, 8400, 8400));
    let [
        LogEvent::Temperature(temperature),
        LogEvent::Accel { tick: accel, .. },
        LogEvent::Gyro { tick: gyro, .. },
    ] = &events[3..6]
    else {
        panic!("order of events: {:?}", &events[3..6]);
    };
    assert_eq!((temperature.channel.as_str(), temperature.raw), ("imu", 52.106_128_69));
    assert_eq!(accel.readings[2], -9.686_152_458);
    assert_eq!(gyro.readings[0], -0.070_696_279_41 * (std::f64::consts::PI / 180.0));
    assert_eq!((gyro.end_time.as_ns(), gyro.duration.as_ns()), (256_551_281_997_598_000, 505_630_000));
}

#[test]
fn with_data_the_tumble_log_joins_its_two_files() {
    let Some(log) = data("tumble-mems") else { return };
    let events = events("tumble-mems.toml", log);
    assert_eq!(numbers(&events), (51_175, 51_175, 0));
    for pair in events.chunks(2) {
        let [LogEvent::Accel { tick: accel, .. }, LogEvent::Gyro { tick: gyro, .. }] = pair else {
            panic!("not a pair: {pair:?}");
        };
        assert_eq!((accel.end_time, accel.sequence), (gyro.end_time, gyro.sequence));
    }
    let LogEvent::Accel { tick, .. } = &events[0] else { panic!("{:?}", events[0]) };
    assert_eq!(*tick.readings, [33108.0, 33329.0, 36429.0]);
    assert_eq!(tick.end_time.as_ns(), 29_840_000);
}

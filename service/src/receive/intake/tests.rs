use std::time::Duration;

use isotherm_correction::calibration::Calibration;
use isotherm_correction::sample::{GyroTick, OutputKind};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec::encode;
use isotherm_protocol::document::Document;
use isotherm_protocol::raw::GyroBatch;

use super::*;
use crate::receive::unit::Outlet;

fn gyro_frame(sequence: u64) -> Vec<u8> {
    let tick = GyroTick {
        sequence,
        end_time: Timestamp::from_ns(i64::try_from(sequence).unwrap() * 5_000_000),
        duration: Span::from_ms(5),
        readings: [1.0, 2.0, 3.0].into_iter().collect(),
        ..GyroTick::default()
    };
    encode(&GyroBatch { output: OutputKind::Counts, ticks: vec![tick] }).unwrap()
}

fn intake(max_units: usize, calibrated: &[&str]) -> Intake {
    with_outlets(max_units, calibrated, Box::new(|_| Ok(Box::new(|_| Ok(())))))
}

fn calibration() -> Arc<Calibration> {
    let text = include_str!("../../../../config/calibration/example-full.toml");
    Arc::new(Document::parse(text, None).unwrap().calibration)
}

fn with_outlets(max_units: usize, calibrated: &[&str], outlets: OutletMaker) -> Intake {
    let calibration = calibration();
    let mut calibrations = Calibrations::default();
    for serial in calibrated {
        calibrations.insert(UnitId::new(serial).unwrap(), Arc::clone(&calibration), [7; 8]);
    }
    Intake::new(Settings { max_units, ..Settings::default() }, calibrations, outlets)
}

fn units(intake: &Intake) -> Vec<String> {
    intake.each_unit(|actor| actor.id().to_string())
}

#[test]
fn what_belongs_to_no_unit_is_counted_and_makes_none() {
    let intake = intake(8, &[]);
    let frame = gyro_frame(0);
    let long = "x".repeat(65);
    let cases = [
        ("imu/U/raw/mag", Some(&frame[..]), "unknown_stream"),
        ("imu/U/raw/gyro", None, "deletions"),
        (&*format!("imu/{long}/raw/gyro"), Some(&frame[..]), "bad_serial"),
        ("imu/ü/raw/gyro", Some(&frame[..]), "bad_serial"),
        ("imu/U/raw/gyro", Some(&[][..]), "bad_frames_length"),
        ("imu/U/raw/accel", Some(&frame[..]), "bad_frames_kind"),
    ];
    for (key, payload, kind) in cases {
        let before = intake.totals().refused.get(kind).copied().unwrap_or(0);
        intake.receive(key, payload, Instant::now());
        assert_eq!(intake.totals().refused.get(kind), Some(&(before + 1)), "{key}");
    }
    assert!(units(&intake).is_empty());
    assert!(intake.receive("imu/U/raw/gyro", Some(&frame), Instant::now()), "a new unit's status is due");
    assert_eq!(units(&intake), ["U"]);
}

#[test]
fn rubbish_for_a_unit_with_a_calibration_is_that_units_rubbish() {
    let intake = intake(8, &["U"]);
    intake.receive("imu/U/raw/gyro", Some(&[1, 2]), Instant::now());
    assert_eq!(intake.totals().unit(&UnitId::new("U").unwrap()).bad, 1);
    assert!(intake.totals().refused.is_empty());
}

#[test]
fn strange_units_do_not_take_the_places_of_calibrated_ones() {
    let intake = intake(3, &["CAL-1", "CAL-2"]);
    for serial in ["A", "B", "C", "CAL-1", "CAL-2", "D"] {
        intake.receive(&format!("imu/{serial}/raw/gyro"), Some(&gyro_frame(0)), Instant::now());
    }
    assert_eq!(units(&intake), ["A", "CAL-1", "CAL-2"]);
    assert_eq!(intake.totals().refused.get("units_refused"), Some(&3));
}

#[test]
fn a_calibrated_unit_takes_the_place_of_a_strange_one_and_is_told_where_there_is_none() {
    let start = Instant::now();
    let intake = intake(2, &[]);
    let gyro = |unit: &str, ms| {
        let at = start + Duration::from_millis(ms);
        intake.receive(&format!("imu/{unit}/raw/gyro"), Some(&gyro_frame(ms)), at);
        units(&intake).join(" ")
    };
    let faults = || intake.awaited().into_iter().map(|fault| (fault.kind, fault.count)).collect::<Vec<_>>();
    assert_eq!([gyro("A", 0), gyro("B", 1)], ["A", "A B"]);
    let calibration = calibration();
    for serial in ["CAL-1", "CAL-2", "CAL-3"] {
        let id = UnitId::new(serial).unwrap();
        intake.calibrations.write().unwrap().insert(id, Arc::clone(&calibration), [7; 8]);
    }
    assert_eq!(faults(), [("awaited_units".to_owned(), 3)]);
    assert_eq!([gyro("A", 2), gyro("CAL-1", 3), gyro("CAL-2", 4)], ["A B", "A CAL-1", "CAL-1 CAL-2"]);
    assert_eq!([gyro("A", 5), gyro("CAL-3", 6)], ["CAL-1 CAL-2"; 2]);
    assert_eq!(faults(), [("refused_units".to_owned(), 1)]);
    intake.forget(&UnitId::new("CAL-1").unwrap());
    assert_eq!((gyro("CAL-3", 7), faults()), ("CAL-2 CAL-3".to_owned(), vec![]));
}

#[test]
fn what_zenoh_needs_of_a_calibrated_unit_is_there_before_it_appears() {
    let made = Arc::new(Mutex::new(Vec::new()));
    let noting = Arc::clone(&made);
    let outlets: OutletMaker = Box::new(move |unit| {
        noting.lock().unwrap().push(unit.to_string());
        let outlet: Outlet = Box::new(|_| Ok(()));
        if unit.as_str() == "CAL-2" { Err("the session is closed".into()) } else { Ok(outlet) }
    });
    let intake = with_outlets(3, &["CAL-1", "CAL-2", "CAL-3"], outlets);
    assert_eq!(intake.prepare(), 2);
    assert_eq!(*made.lock().unwrap(), ["CAL-1", "CAL-2", "CAL-3"]);
    for serial in ["CAL-1", "CAL-2"] {
        intake.receive(&format!("imu/{serial}/raw/gyro"), Some(&gyro_frame(0)), Instant::now());
    }
    assert_eq!(
        made.lock().unwrap()[3..],
        ["CAL-2"],
        "what could not be made is tried again, what was made is used"
    );
    assert_eq!(units(&intake), ["CAL-1"]);
}

#[test]
fn a_panic_costs_one_unit_its_memory_and_nothing_else() {
    let intake = intake(8, &[]);
    for serial in ["A", "B"] {
        intake.receive(&format!("imu/{serial}/raw/gyro"), Some(&gyro_frame(0)), Instant::now());
    }
    let reached = intake.each_unit(|actor| {
        assert_ne!(actor.id().as_str(), "A", "on purpose");
        actor.id().to_string()
    });
    assert_eq!(reached, ["B"]);
    for serial in ["A", "B"] {
        intake.receive(&format!("imu/{serial}/raw/gyro"), Some(&gyro_frame(1)), Instant::now());
    }
    let totals = intake.totals();
    let account = |serial: &str| (totals.units[serial].ticks_in, totals.units[serial].alarms);
    assert_eq!((account("A"), account("B")), ((2, 1), (2, 0)));
    let status = intake.status(&UnitId::new("A").unwrap(), "test").unwrap();
    assert!(status.last_fault.unwrap().contains("on purpose"));
}

#[test]
fn a_silent_unit_without_a_calibration_makes_room_for_another() {
    let intake = intake(3, &["KEPT"]);
    let start = Instant::now();
    let at = |s: u64| start + Duration::from_secs(s);
    let gyro = |unit: &str, sequence, now| {
        intake.receive(&format!("imu/{unit}/raw/gyro"), Some(&gyro_frame(sequence)), now);
    };
    gyro("JUNK", 0, at(0));
    gyro("LIVE", 0, at(0));
    // Rubbish is no sign of life.
    intake.receive("imu/JUNK/raw/gyro", Some(&[0; 40]), at(59));
    gyro("LIVE", 1, at(30));
    gyro("NEW", 0, at(59));
    assert_eq!(units(&intake), ["JUNK", "LIVE"], "not long enough, and one place is kept");
    gyro("NEW", 0, at(60));
    assert_eq!(units(&intake), ["LIVE", "NEW"]);
    gyro("KEPT", 0, at(61));
    gyro("ANOTHER", 0, at(90));
    assert_eq!(units(&intake), ["ANOTHER", "KEPT", "NEW"], "the one with a calibration stays");
}

#[test]
fn a_forgotten_unit_gives_out_what_it_held_and_begins_anew() {
    let given = Arc::new(Mutex::new(0));
    let out = Arc::clone(&given);
    let outlets: OutletMaker = Box::new(move |_| {
        let out = Arc::clone(&out);
        Ok(Box::new(move |_| {
            *lock(&out) += 1;
            Ok(())
        }))
    });
    let intake = with_outlets(2, &[], outlets);
    intake.receive("imu/U/raw/gyro", Some(&gyro_frame(0)), Instant::now());
    let unit = UnitId::new("U").unwrap();
    assert_eq!((*lock(&given), intake.has(&unit)), (0, true), "it waits for its accelerometers");
    intake.forget(&unit);
    assert_eq!((*lock(&given), intake.has(&unit)), (1, false));
    intake.receive("imu/U/raw/gyro", Some(&gyro_frame(7)), Instant::now());
    assert_eq!(intake.totals().unit(&unit).gaps, 0);
}

//! Logs that do not allow what is asked for: every one is refused, or warned of, in words that say what to do.

use isotherm_calibration::error::Error;
use isotherm_calibration::fits::thermal::{Fitted, Method, Settings, Terms, fit};
use isotherm_calibration::report::Report;
use isotherm_calibration::runs::Run;
use isotherm_calibration::validate::{JudgedLog, Wanted, validate};
use isotherm_correction::sample::{AccelTick, GyroTick, OutputKind, TemperatureReading};
use isotherm_correction::thermal::Feature;
use isotherm_correction::units::{Span, Timestamp};
use isotherm_log::offline::unit_id;
use isotherm_log::text::LogEvent;
use isotherm_protocol::document::{Curve, Document, GyroSensor, Shape, StatedTerm};

use crate::drift_generator::Normal;

/// A made-up unit: what one second of it reads.
struct Second {
    rates: [f64; 3],
    forces: [f64; 3],
    deg_c: f64,
}

/// 20 → −10 → 40 → 20 °C with holds, and biases that follow.
fn deg_c(second: u32) -> f64 {
    let t = f64::from(second);
    match second {
        0..600 => 20.0,
        600..1500 => 20.0 - (t - 600.0) / 30.0,
        1500..2400 => -10.0,
        2400..3900 => -10.0 + (t - 2400.0) / 30.0,
        3900..4800 => 40.0,
        _ => 40.0 - (t - 4800.0) / 30.0,
    }
}

fn usual(second: u32) -> Second {
    let t = deg_c(second);
    let noise = |k: u32| (f64::from((second * 7919 + k * 104_729) % 1000) / 1000.0 - 0.5) * 2e-6;
    let rate = 1e-5 * (t - 15.0) + 1e-7 * t * t;
    Second {
        rates: [rate + noise(1), -rate + noise(2), 0.5 * rate + noise(3)],
        forces: [0.01 * t * 0.01 + noise(4), 0.002 * t * 0.01 + noise(5), -9.81 - 0.001 * t + noise(6)],
        deg_c: t + noise(7),
    }
}

fn run(seconds: std::ops::Range<u32>, read: impl Fn(u32) -> Second) -> Run {
    run_of(events(seconds, read))
}

fn run_of(events: Vec<LogEvent>) -> Run {
    Run::of_events("made up".to_owned(), unit_id("UNIT").unwrap(), events)
}

fn events(seconds: impl IntoIterator<Item = u32>, read: impl Fn(u32) -> Second) -> Vec<LogEvent> {
    let mut events = Vec::new();
    for second in seconds {
        let sequence = u64::from(second);
        let Second { rates, forces, deg_c } = read(second);
        let end_time = Timestamp::from_ns(i64::from(second + 1) * 1_000_000_000);
        let duration = Span::from_s(1.0);
        let channel = isotherm_correction::sample::ChannelName::from("imu").unwrap();
        let time = Timestamp::from_ns(i64::from(second) * 1_000_000_000);
        events.push(LogEvent::Temperature(TemperatureReading { channel, time, raw: deg_c }));
        let readings = forces.into_iter().collect();
        events.push(LogEvent::Accel {
            output: OutputKind::Mean,
            tick: AccelTick { sequence, end_time, duration, readings },
        });
        let tick = GyroTick {
            sequence,
            end_time,
            duration,
            readings: rates.into_iter().collect(),
            ..GyroTick::default()
        };
        events.push(LogEvent::Gyro { output: OutputKind::Mean, tick });
    }
    events
}

/// The same with the temperature readings of some seconds only.
fn thermometer_at(kept: impl Fn(u32) -> bool) -> Run {
    let mut events = events(0..5400, usual);
    events.retain(|event| match event {
        LogEvent::Temperature(reading) => kept(u32::try_from(reading.time.as_ns() / 1_000_000_000).unwrap()),
        _ => true,
    });
    run_of(events)
}

fn tried(run: Run, method: Method) -> Result<Fitted, Error> {
    fit(None, (&[run], &[]), &Settings { method, ..super::usual() })
}

#[track_caller]
fn refused(run: Run) -> String {
    tried(run, Method::Joint).expect_err("must be refused").to_string() + "\n"
}

/// One sentence about each gyro and accelerometer.
fn verdicts(made: &Fitted) -> String {
    made.report.verdicts.iter().map(|verdict| verdict.words() + "\n").collect()
}

#[test]
fn a_sound_log_is_fitted() {
    let made = tried(run(0..5400, usual), Method::Joint).unwrap();
    assert!(made.report.accepted(), "{}", made.report.to_text());
    assert!(
        made.report.verdicts.iter().all(|verdict| verdict.factor().unwrap() > 5.0),
        "{}",
        made.report.to_text()
    );
    // Nothing but the fitted log has judged.
    let [told] = made.report.warnings.as_slice() else { panic!("{:?}", made.report.warnings) };
    insta::assert_snapshot!(format!("{told}\n{}", made.report.verdicts[0].reason));
}

#[test]
fn a_gyro_that_follows_little_of_temperature_is_told_where_nothing_else_judges() {
    let wandering = run(0..5400, |s| {
        let mut second = usual(s);
        second.rates[1] = 1e-5 * second.deg_c + 2.1e-4 * (f64::from(s) * 0.01).sin();
        second
    });
    let made = tried(wandering, Method::Joint).unwrap();
    assert!(made.report.accepted(), "{}", made.report.to_text());
    insta::assert_snapshot!(made.report.warnings.join("\n"));
}

#[test]
fn what_a_base_document_hides_is_told() {
    let mut base = tried(run(0..5400, usual), Method::Joint).unwrap().written.document;
    for gyro in &mut base.gyro.sensor {
        gyro.increment_weight_rad_per_rad = Some(4.848e-6);
    }
    base.accel = None;
    let made = fit(Some(&base), (&[run(0..5400, usual)], &[]), &super::usual()).unwrap();
    insta::assert_snapshot!(made.report.warnings.join("\n"));
}

#[test]
fn terms_of_the_base_document_go_where_they_are_fitted_anew_and_stay_without_a_channel() {
    let again = |base: &Document| {
        fit(Some(base), (&[run(0..5400, usual)], &[]), &super::usual()).unwrap().written.document
    };
    let base = tried(run(0..5400, usual), Method::Joint).unwrap().written.document;
    let constant = |value: f64| Curve::new(Shape::Constant { value });
    let mut with_rate = base.clone();
    for accel in with_rate.accel.iter_mut().flat_map(|accel| &mut accel.sensor) {
        accel.put(StatedTerm::new(Feature::ThermalRate, constant(0.5)));
    }
    let free = &mut with_rate.gyro.sensor[0];
    *free = GyroSensor {
        channel: None,
        increment_weight_rad_per_rad: free.increment_weight_rad_per_rad,
        ..GyroSensor::bare(&free.name)
    }
    .with(Feature::One, constant(3.0));
    let (plain, new) = (again(&base), again(&with_rate));
    assert_eq!(new.accel, plain.accel);
    assert_eq!(new.gyro.sensor[0], with_rate.gyro.sensor[0]);
}

#[test]
fn what_cannot_be_fitted_is_refused_with_what_to_do() {
    let mut late = events(0..5400, usual);
    for event in &mut late {
        if let LogEvent::Temperature(reading) = event {
            reading.time = Timestamp::from_ns(reading.time.as_ns() + 1_773_000_000_000_000_000);
        }
    }
    let mut told = refused(run_of(late));
    let constant = |s: u32| Second { deg_c: 20.0 + 1e-3 * f64::from(s % 7), ..usual(s) };
    told += &refused(run(0..3000, constant));
    // Volts of a thermometer, which nothing converts.
    told += &refused(run(0..5400, |s| Second { deg_c: 1.5 + 0.01 * usual(s).deg_c, ..usual(s) }));
    // The z accelerometer where a gyro should be.
    told += &refused(run(0..3000, |s| {
        let Second { mut rates, mut forces, deg_c } = usual(s);
        std::mem::swap(&mut rates[2], &mut forces[2]);
        Second { rates, forces, deg_c }
    }));
    let noise = |s: u32| Second { deg_c: 30.0 * f64::from((s * 7919) % 97) / 97.0, ..usual(s) };
    told += &refused(run(0..3000, noise));
    let in_g = |s: u32| Second { forces: usual(s).forces.map(|f| f / 9.81), ..usual(s) };
    told += &refused(run(0..5400, in_g));
    let degrees_as_radians = |s: u32| Second { rates: usual(s).rates.map(|r| r + 0.5), ..usual(s) };
    told += &refused(run(0..5400, degrees_as_radians));
    let kelvin_times_ten = |s: u32| Second { deg_c: 10.0 * (usual(s).deg_c + 273.15), ..usual(s) };
    told += &refused(run(0..5400, kelvin_times_ten));
    // No window is complete.
    let seconds: Vec<u32> = (0..5400).filter(|second| *second % 10 < 7).collect();
    told += &refused(run_at(&seconds));
    // The unit is turned in the middle.
    for degrees in [5.0_f64, 90.0] {
        told += &refused(run(0..5400, |s| {
            let mut second = usual(s);
            if s >= 3000 {
                let (sin, cos) = degrees.to_radians().sin_cos();
                let [x, y, z] = second.forces;
                second.forces = [x, y * cos - z * sin, y * sin + z * cos];
            }
            second
        }));
    }
    insta::assert_snapshot!(told);
}

#[test]
fn a_dead_sensor_is_refused_and_the_others_are_fitted() {
    let zero = run(0..5400, |s| {
        let mut second = usual(s);
        second.rates[1] = 0.0;
        second
    });
    let made = tried(zero, Method::Joint).unwrap();
    let of = |name: &str| made.report.verdicts.iter().find(|verdict| verdict.of == name).unwrap();
    assert_eq!(["gyro x", "gyro y", "gyro z"].map(|name| of(name).accepted), [true, false, true]);
    assert!(!made.written.document.gyro.sensor[1].terms.has(Feature::One));
    // No figures of what comes through the other axes.
    insta::assert_snapshot!(of("gyro y").words());
}

/// The usual log, of whose readings along x one in so many is no number, of the gyros or of the accelerometers.
fn without_some(every: u32, gyro: bool) -> Fitted {
    let read = |s: u32| {
        let mut second = usual(s);
        if s % every == 1 {
            let of_kind = if gyro { &mut second.rates } else { &mut second.forces };
            of_kind[0] = f64::NAN;
        }
        second
    };
    tried(run(0..5400, read), Method::Joint).unwrap()
}

#[test]
fn single_readings_that_are_no_numbers_take_nothing_from_a_fit() {
    let sound = tried(run(0..5400, usual), Method::Joint).unwrap();
    for gyro in [true, false] {
        let made = without_some(10, gyro);
        assert!(made.report.accepted(), "{}", made.report.to_text());
        for (own, of_sound) in made.report.verdicts.iter().zip(&sound.report.verdicts) {
            let [left, of_sound] = [own, of_sound].map(|verdict| verdict.deciding()[1].rms);
            assert!(left < 1.1 * of_sound, "{}: {left}, {of_sound}", own.of);
        }
    }
}

#[test]
fn what_has_too_few_numbers_is_refused_and_the_other_kind_is_fitted() {
    for gyro in [true, false] {
        let made = without_some(2, gyro);
        let accepted = made.report.verdicts.iter().map(|verdict| verdict.accepted);
        assert!(accepted.eq([!gyro, !gyro, !gyro, gyro, gyro, gyro]), "{}", made.report.to_text());
    }
    let mostly = run(0..5400, |s| {
        let mut second = usual(s);
        second.rates[0] = if s % 3 == 0 { second.rates[0] } else { f64::NAN };
        second
    });
    let made = tried(mostly, Method::Joint).unwrap();
    insta::assert_snapshot!(verdicts(&without_some(2, true)) + &verdicts(&made));
}

#[test]
fn a_step_of_a_bias_is_told() {
    let stepping = run(0..5400, |s| {
        let mut second = usual(s);
        second.rates[1] += if s < 3000 { 0.0 } else { 1e-3 };
        second
    });
    let made = tried(stepping, Method::Joint).unwrap();
    let sound = tried(run(0..5400, usual), Method::Joint).unwrap().report.warnings;
    let told = made.report.warnings.iter().filter(|words| !sound.contains(words));
    insta::assert_snapshot!(told.cloned().collect::<Vec<_>>().join("\n"));
}

#[test]
fn terms_that_are_kept_under_another_filter_are_told() {
    let zero = || {
        run(0..5400, |s| {
            let mut second = usual(s);
            second.rates[1] = 0.0;
            second
        })
    };
    let mut base = tried(run(0..5400, usual), Method::Joint).unwrap().written.document;
    let gain = Curve::new(Shape::Constant { value: 5.0 });
    base.gyro.sensor[1].put(StatedTerm::with_parameter(Feature::Lag, 300.0, gain));
    let old_s = base.temperature.filter.as_ref().unwrap().smoothing_s;
    let told = |smoothing_s: f64| {
        let settings = Settings { smoothing_s: Some(smoothing_s), ..super::usual() };
        let made = fit(Some(&base), (&[zero()], &[]), &settings).unwrap();
        let [new, old] = [&made.written.document, &base].map(|document| &document.gyro.sensor[1].terms);
        assert!(
            made.report.verdicts.iter().any(|verdict| verdict.accepted)
                && new.of(Feature::Lag).eq(old.of(Feature::Lag))
        );
        made.report.warnings
    };
    let usual = told(old_s);
    let more = told(old_s + 30.0).into_iter().filter(|words| !usual.contains(words));
    insta::assert_snapshot!(more.collect::<Vec<_>>().join("\n"));
}

#[test]
fn a_dead_accelerometer_is_refused_and_the_others_are_fitted() {
    // Gravity is what it would have felt.
    let zero = run(0..5400, |s| {
        let mut second = usual(s);
        second.forces[2] = 0.0;
        second
    });
    let made = tried(zero, Method::Joint).unwrap();
    let refused: Vec<_> = made.report.verdicts.iter().filter(|verdict| !verdict.accepted).collect();
    assert_eq!(refused.len(), 1, "{}", made.report.to_text());
    assert_eq!(refused[0].of, "accelerometer z");
    insta::assert_snapshot!(refused[0].reason);
}

#[test]
fn doubtful_logs_are_fitted_and_told_of() {
    let mut told = String::new();
    let mut tell = |run: Run| {
        let made = tried(run, Method::Joint).unwrap();
        told += &(made.report.warnings.join("\n") + "\n\n");
        made.report
    };
    // Degrees Fahrenheit.
    tell(run(0..5400, |s| Second { deg_c: 1.8 * (usual(s).deg_c + 30.0) + 32.0, ..usual(s) }));
    let seconds: Vec<u32> = (0..5400).filter(|second| !(2000..2200).contains(second)).collect();
    tell(run_at(&seconds));
    let some_are_no_numbers = tell(run(0..5400, |s| {
        let mut second = usual(s);
        if s % 500 == 250 {
            second.rates[0] = f64::NAN;
        }
        second
    }));
    assert!(some_are_no_numbers.accepted());
    // Down and up again, and gyro z follows something else than the thermometer.
    let made_up = |s: u32| {
        let t = f64::from(s);
        let deg_c = if s < 1500 { 40.0 - t / 30.0 } else { -10.0 + (t - 1500.0) / 30.0 };
        let mut second = usual(s);
        second.deg_c = deg_c + 2e-3 * (f64::from((s * 7919) % 1000) / 1000.0 - 0.5);
        second.rates[1] = 1e-5 * deg_c;
        second
    };
    tell(run(0..3000, made_up));
    insta::assert_snapshot!(told);
}

#[test]
fn one_direction_and_too_few_plateaus_are_told() {
    let upwards = || run(2400..3900, usual);
    let made = tried(upwards(), Method::Joint).unwrap();
    assert!(!follows_rates(&made));
    let sequential = tried(upwards(), Method::Sequential).unwrap();
    assert!(!sequential.report.verdicts.iter().any(|verdict| verdict.accepted));
    insta::assert_snapshot!(format!("{}\n{}", made.report.warnings.join("\n"), verdicts(&sequential)));
}

/// Whether a gyro has terms that a run in one direction cannot tell.
fn follows_rates(made: &Fitted) -> bool {
    let mut gyros = made.written.document.gyro.sensor.iter();
    gyros.any(|gyro| gyro.terms.has(Feature::Lag) || gyro.terms.has(Feature::ThermalRate))
}

#[test]
fn readings_every_ten_seconds_are_fitted() {
    // Time constants of the ladders that the readings cannot carry were all set to the shortest that they can.
    for method in [Method::Joint] {
        let made = tried(thermometer_at(|s| s % 10 == 0), method).unwrap();
        assert!(made.report.accepted(), "{}", made.report.to_text());
        for verdict in &made.report.verdicts {
            assert!(verdict.factor().unwrap() > 5.0, "{}", made.report.to_text());
        }
        let models = made.report.validation.as_ref().unwrap().rows.iter().flatten();
        let twice = models.clone().find(|cell| cell.contains("30, 30"));
        assert!(twice.is_none() && models.count() > 20, "{twice:?}");
    }
}

#[test]
fn a_first_reading_that_is_late_is_no_temperature_of_its_own() {
    let made = tried(thermometer_at(|s| s >= 45), Method::Joint).unwrap();
    assert!(made.report.accepted() && made.report.warnings.len() == 1, "{}", made.report.to_text());
    insta::assert_snapshot!(made.report.notes.join("\n"));
    // From 11.5 °C up.
    let mut upwards = events(3000..3900, usual);
    let late = Timestamp::from_ns(3_045_000_000_000);
    upwards.retain(|event| !matches!(event, LogEvent::Temperature(reading) if reading.time < late));
    let made = tried(run_of(upwards), Method::Joint).unwrap();
    assert!(!follows_rates(&made), "{:?}", made.report.warnings);
    let [low, high] = made.about.range_deg_c.unwrap();
    assert!((11.0..12.5).contains(&low) && (39.0..=40.5).contains(&high), "{low} {high}");
}

#[test]
fn an_axis_that_temperature_does_nothing_to_is_a_good_one() {
    let noise: Vec<f64> = Normal::new(5).white(5400, 1e-5);
    let flat = || {
        run(0..5400, |s| {
            let mut second = usual(s);
            second.rates[1] = noise[s as usize];
            second
        })
    };
    let of_y = |report: &Report| report.verdicts.iter().find(|one| one.of == "gyro y").unwrap().clone();
    let mut told = String::new();
    for method in [Method::Joint, Method::Sequential] {
        let made = tried(flat(), method).unwrap();
        let verdict = of_y(&made.report);
        assert!(verdict.accepted, "{method:?}: {}", verdict.words());
        told += &(verdict.reason + "\n");
        assert!(
            !made.written.document.gyro.sensor[1].terms.has(Feature::One) && made.report.refusals().is_none()
        );
    }
    // Whoever judges the document says the same.
    let written = tried(flat(), Method::Joint).unwrap().written;
    let log = JudgedLog::new(flat(), &written.document).unwrap();
    let report = validate(&written, &[log], Wanted { window_s: None, place: None }).unwrap();
    let verdict = of_y(&report);
    assert!(verdict.accepted, "{}", verdict.words());
    told += &(verdict.reason + "\n");
    // What moves with something else than temperature is none.
    let wandering = run(0..5400, |s| {
        let mut second = usual(s);
        second.rates[1] = noise[s as usize] + 1e-4 * (f64::from(s) * 0.01).sin();
        second
    });
    let verdict = of_y(&tried(wandering, Method::Joint).unwrap().report);
    assert!(!verdict.accepted, "{}", verdict.words());
    insta::assert_snapshot!(told + &verdict.reason);
}

#[test]
fn all_terms_are_the_largest_model() {
    let fitted = |terms: Terms| {
        let settings = Settings { terms, ..super::usual() };
        fit(None, (&[run(0..5400, usual)], &[]), &settings).unwrap()
    };
    let made = fitted(Terms::All);
    let count = |of: &str| made.report.coefficients.iter().filter(|c| c.name.starts_with(of)).count();
    // Degree 5, and the ladder with gains linear in temperature; gyros have T̈ beside it.
    assert_eq!((count("gyro x"), count("accelerometer x")), (5 + 2 * 6 + 1, 5 + 2 * 6));
}

#[test]
fn few_whole_windows_are_no_verdict() {
    // Three ticks of ten are missing but for some of the time.
    let whole = |second: &u32| (600..1500).contains(second) || (2400..3000).contains(second);
    let seconds: Vec<u32> = (0..5400).filter(|second| whole(second) || *second % 10 < 7).collect();
    let made = tried(run_at(&seconds), Method::Joint).unwrap();
    assert!(!made.report.accepted());
    insta::assert_snapshot!(verdicts(&made));
}

#[test]
fn ticks_that_no_corrector_takes_are_refused_by_their_length() {
    let events = |tick_s: u32| {
        let mut events = Vec::new();
        for (sequence, second) in (0..).zip((0..36_000).step_by(tick_s as usize)) {
            let Second { rates, deg_c, .. } = usual(second * 5400 / 36_000);
            let (time, duration) = (Span::from_s(f64::from(second)), Span::from_s(f64::from(tick_s)));
            let time = Timestamp::from_ns(time.as_ns());
            let channel = isotherm_correction::sample::ChannelName::from("imu").unwrap();
            events.push(LogEvent::Temperature(TemperatureReading { channel, time, raw: deg_c }));
            let readings = rates.into_iter().collect();
            let tick =
                GyroTick { sequence, end_time: time + duration, duration, readings, ..GyroTick::default() };
            events.push(LogEvent::Gyro { output: OutputKind::Mean, tick });
        }
        events
    };
    assert!(tried(run_of(events(10)), Method::Joint).is_ok());
    insta::assert_snapshot!(refused(run_of(events(30))));
}

/// A judging run beside one that is fitted.
fn judged(judge: Run) -> Result<Fitted, Error> {
    fit(None, (&[run(0..5400, usual)], &[judge]), &super::usual())
}

/// A second of another run of the same unit.
fn other(s: u32) -> Second {
    let mut second = usual(s);
    second.rates.iter_mut().for_each(|rate| *rate += 1e-6 * (f64::from(s * 31 % 17) / 17.0 - 0.5));
    second
}

#[test]
fn a_run_without_a_moving_temperature_does_not_judge() {
    let made = judged(run(0..5400, other)).unwrap();
    assert!(made.report.verdicts.iter().all(|verdict| verdict.out_of_sample.is_some()));
    let mut deaf = events(0..5400, other);
    deaf.retain(|event| !matches!(event, LogEvent::Temperature(_)));
    let mut told = String::new();
    for judge in [run_of(deaf), run(0..700, other)] {
        let made = judged(judge).unwrap();
        for verdict in &made.report.verdicts {
            assert!(verdict.out_of_sample.is_none() && verdict.accepted, "{}", verdict.words());
        }
        told += &(made.report.warnings.join("\n") + "\n" + &verdicts(&made));
    }
    insta::assert_snapshot!(told);
}

#[test]
fn a_frozen_thermometer_is_told() {
    let frozen = |from: u32| run(0..5400, move |s| Second { deg_c: usual(s.min(from)).deg_c, ..other(s) });
    let refused = [2000, 0].map(|from| tried(frozen(from), Method::Joint).unwrap_err().to_string());
    let mut told = refused.join("\n");
    // One that judges is told of.
    let report = judged(frozen(2000)).unwrap().report;
    let about = report.warnings.iter().filter(|words| words.contains("frozen"));
    about.for_each(|words| told.extend(["\n", words]));
    insta::assert_snapshot!(told);
    // Steps of half a degree are none.
    let coarse = |s: u32| Second { deg_c: (2.0 * usual(s).deg_c).round() / 2.0, ..usual(s) };
    assert!(tried(run(0..5400, coarse), Method::Joint).unwrap().report.accepted());
}

#[test]
fn readings_far_from_all_others_are_left_out_or_refused() {
    let spiked = |every: u32| {
        run(0..5400, move |s| {
            let mut second = usual(s);
            if s % every == 77 {
                second.rates[1] = 99_f64.to_radians();
            }
            second
        })
    };
    let (clean, some) =
        (tried(run(0..5400, usual), Method::Joint).unwrap(), tried(spiked(1000), Method::Joint).unwrap());
    let figures = |made: &Fitted| made.report.verdicts.iter().map(|v| v.in_sample[1].rms).collect::<Vec<_>>();
    for (a, b) in figures(&clean).into_iter().zip(figures(&some)) {
        assert!((a / b - 1.0).abs() < 0.1, "{a} {b}");
    }
    let mut told = some.report.warnings.join("\n") + "\n";
    told += &tried(spiked(80), Method::Joint).unwrap_err().to_string();
    insta::assert_snapshot!(told);
}

#[test]
fn a_judge_with_the_readings_of_the_fit_is_refused() {
    let Err(Error::Refused(reasons)) = judged(run(0..5400, usual)) else { panic!("refused") };
    insta::assert_snapshot!(reasons.join("\n"));
    // A part of it, too.
    assert!(matches!(judged(run(2400..5400, usual)), Err(Error::Refused(_))));
}

/// The seconds of a list only, without accelerometers.
fn run_at(seconds: &[u32]) -> Run {
    let events = events(seconds.iter().copied(), usual).into_iter();
    run_of(events.filter(|event| !matches!(event, LogEvent::Accel { .. })).collect())
}

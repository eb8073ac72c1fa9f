use super::*;

fn name(text: &str) -> ChannelName {
    ChannelName::from(text).unwrap_or_default()
}

#[test]
fn a_voltage_is_judged_by_its_worst_value_and_a_counter_by_its_increase() {
    let [voltage, counter] = [name("half_wave_x"), name("crc_errors")];
    let reported = |item, name, limits| Reported { item, name, limits, first: None, counts: None };
    let mut test = SelfTest {
        start: None,
        end: Timestamp::default(),
        ticks: 0,
        accel_ticks: 0,
        gyros: Sensors::new(),
        accels: Sensors::new(),
        reported: [
            reported(CheckItem::Voltage(voltage), voltage, [180.0, 220.0]),
            reported(CheckItem::Counter(counter), counter, [0.0, 2.0]),
        ]
        .into(),
    };
    let now = Timestamp::from_ns(100_000_000_000);
    let mut feed = |name, off_s, value| {
        let time = now + Span::from_s(20.0 + off_s) - Span::from_s(20.0);
        test.health(&HealthReading { name, time, value }, Some(now));
        [0, 1].map(|index| test.reported[index].result()).map(|result| (result.value, result.passed))
    };
    let nothing = (None, false);
    for off_s in [-10.1, 10.1] {
        assert_eq!(feed(voltage, off_s, 999.0), [nothing; 2], "of another time");
    }
    for value in [200.0, 221.5, 199.0] {
        feed(voltage, -10.0, value);
    }
    let worst = (Some(221.5), false);
    assert_eq!(feed(counter, 0.0, 70.0), [worst, nothing], "one reading is no increase");
    assert_eq!(feed(counter, 5.0, 71.0), [worst, (Some(1.0), true)]);
    assert_eq!(feed(counter, 10.0, 73.0), [worst, (Some(3.0), false)]);
    feed(name("something_else"), 0.0, 1e9);
}

#[test]
fn a_gyro_that_gives_one_and_the_same_value_for_long_is_dead() {
    let share = |reading: &dyn Fn(u32) -> f64| {
        let mut liveness = Liveness::default();
        for k in 0..2000 {
            let time = Timestamp::from_ns(i64::from(k) * 5_000_000);
            liveness.observe(reading(k), SensorFlags::VALID, k == 0, time);
        }
        liveness.result(CheckItem::Gyro(0), 2000)
    };
    assert!(share(&|k| f64::from(k % 2)).passed);
    // Changes twice a second: slow, but alive.
    assert!(share(&|k| f64::from(k / 100)).passed);
    let stuck = share(&|_| 7.0);
    assert!(!stuck.passed && stuck.value.is_some_and(|percent| percent < 15.0), "{stuck:?}");
    assert!(!share(&|_| f64::NAN).passed);
    assert!(!Liveness::default().result(CheckItem::Gyro(0), 0).passed, "no tick at all");
}

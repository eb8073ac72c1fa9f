use super::*;

fn name(text: &str) -> ChannelName {
    ChannelName::from(text).unwrap_or_default()
}

#[test]
fn a_voltage_is_judged_by_its_worst_value_and_a_counter_by_its_increase() {
    let [voltage, counter] = [name("half_wave_x"), name("crc_errors")];
    let reported = |item, name, limits| Reported { item, name, limits, values: None };
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
    let mut feed = |name, value| test.health(&HealthReading { name, time: Timestamp::default(), value });
    for value in [200.0, 221.5, 199.0] {
        feed(voltage, value);
    }
    for value in [70.0, 71.0, 73.0] {
        feed(counter, value);
    }
    feed(name("something_else"), 1e9);
    let [voltage, counter] = [0, 1].map(|index| test.reported[index].result());
    assert_eq!((voltage.value, voltage.passed), (Some(221.5), false));
    assert_eq!((counter.value, counter.passed), (Some(3.0), false));
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

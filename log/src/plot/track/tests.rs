//! Decimation loses no extreme, at any length and in any order.

use super::*;

/// A value that jumps about, with a few peaks.
fn value(index: i64) -> f64 {
    match index {
        123_456 => 1e6,
        777_777 => -1e6,
        _ => f64::from(u16::try_from(index.unsigned_abs() * 7919 % 1000).unwrap()),
    }
}

#[test]
fn every_extreme_and_the_mean_of_every_bin_are_those_of_its_ticks() {
    let mut track = Track::new(2, 1000);
    let ticks: Vec<_> =
        (0..1_000_000_i64).map(|index| (index * 5_000_000 + index % 3, value(index))).collect();
    for (time, value) in &ticks {
        track.push(*time, &[*value, -value], 0);
    }
    let origin = 1_000_000;
    let finished = track.finish(origin);
    let Some(Samples::Bins { first, width, min, max, mean }) = finished.samples(0, 2.0) else { panic!() };
    assert!((500..=1000).contains(&mean.len()), "{}", mean.len());
    let mut expected = vec![Vec::new(); mean.len()];
    for (time, value) in &ticks {
        let place = (seconds_of(time - origin) - first) / width;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small and positive")]
        expected[place.floor() as usize].push(2.0 * value);
    }
    for (index, values) in expected.iter().enumerate() {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert!((min[index], max[index]) == (low, high), "{index}");
        let sum: f64 = values.iter().sum();
        let count = f64::from(u32::try_from(values.len()).unwrap());
        let (got, expected) = (mean[index], sum / count);
        assert!((got - expected).abs() < 1e-9 * (1.0 + expected.abs()), "bin {index}: {got} {expected}");
    }
    assert!(max.contains(&2e6) && min.contains(&-2e6));
    let Some(Samples::Bins { min: turned, .. }) = finished.samples(1, 1.0) else { panic!() };
    assert!(turned.contains(&-1e6), "{turned:?}");
}

#[test]
fn few_ticks_stay_as_they_are_in_the_order_of_time() {
    let mut track = Track::new(1, 100);
    for time in [3_000_000_000, 1_000_000_000, 2_000_000_000] {
        track.push(time, &[seconds_of(time)], 4);
    }
    track.gap(2_500_000_000);
    let finished = track.finish(1_000_000_000);
    let Some(Samples::Points { x, y }) = finished.samples(0, 1.0) else { panic!() };
    assert_eq!(&*x, [0.0, 1.0, 1.5, 2.0]);
    assert!(y[2].is_nan());
    assert_eq!([y[0], y[1], y[3]].map(f64::to_bits), [1.0_f64, 2.0, 3.0].map(f64::to_bits));
    assert_eq!(finished.bits.0, [4, 4, 0, 4]);
}

#[test]
fn time_may_jump_far_and_back_without_growing() {
    let mut track = Track::new(1, 64);
    for (index, time) in [0, i64::MAX / 2, i64::MIN / 2, 5, -5].into_iter().cycle().take(10_000).enumerate() {
        track.push(time, &[1.0], u32::from(index == 7_000));
    }
    let finished = track.finish(0);
    assert_eq!(finished.occurred, 1);
    assert!(finished.bits.0.len() <= 64);
    assert!(finished.bits.0.contains(&1));
    let Some(Samples::Bins { mean, .. }) = finished.samples(0, 1.0) else { panic!() };
    assert_eq!(mean.iter().filter(|mean| mean.is_finite()).count(), 4, "{mean:?}");
}

#[test]
fn fewer_bins_on_request() {
    let mut track = Track::new(1, 1 << 12);
    (0..1 << 14).for_each(|index| track.push(index << 20, &[value(index)], 0));
    track.reduce(100);
    let Some(Samples::Bins { mean, .. }) = track.finish(0).samples(0, 1.0) else { panic!() };
    assert!((50..=100).contains(&mean.len()), "{}", mean.len());
}

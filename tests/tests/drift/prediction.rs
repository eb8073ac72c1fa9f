//! Hours without references, and what subtracting the estimate is worth.

use crate::bench::{Bench, DEG_PER_H, EARTH, GYROS, for_seeds, mean, table_1};

/// 002 calibrates its navigation system for 21 h, then goes without references.
const CALIBRATION_H: u32 = 21;

#[test]
fn without_references_the_error_grows_as_its_sigma_does() {
    const SEEDS: u64 = 60;
    let after_h = [0, 1, 3, 6, 12];
    // Per run and gyro: error and sigma at each of the times (rad/s).
    let runs = for_seeds(SEEDS, |seed| {
        let mut bench = Bench::sound(seed);
        bench.fed_hours(CALIBRATION_H);
        let mut gone = 0;
        after_h.map(|hours| {
            bench.blind_hours(hours - gone);
            gone = hours;
            let (estimates, errors) = (bench.estimates(), bench.errors());
            std::array::from_fn::<_, GYROS, _>(|i| (errors[i] * estimates[i].sigma, estimates[i].sigma))
        })
    });
    let mut before = 0.0;
    for (index, hours) in after_h.into_iter().enumerate() {
        let all = || runs.iter().flat_map(|run| run[index]);
        let (rms, count) = mean(all().map(|(error, _)| error * error));
        let sigma = mean(all().map(|(_, sigma)| sigma * sigma)).0;
        let normalised = mean(all().map(|(error, sigma)| (error / sigma).powi(2))).0;
        let of_initial = mean(runs.iter().map(|run| run[index][0].1)).0 / DEG_PER_H;
        println!(
            "{hours:2} h without references: error {:.5} °/h rms, sigma {:.5} °/h (gyro 0: {of_initial:.5})",
            rms.sqrt() / DEG_PER_H,
            sigma.sqrt() / DEG_PER_H
        );
        assert!((normalised - 1.0).abs() < 4.0 * (2.0 / count).sqrt(), "{hours} h: {normalised}");
        assert!(sigma.sqrt() > before, "it grows");
        before = sigma.sqrt();
    }
}

/// Corrected rate less the true one, mean over an hour, root mean square over the case axes (rad/s).
fn hour(bench: &mut Bench, fed: bool) -> f64 {
    let (mut angle, mut seconds) = ([0.0; 3], 0.0);
    for _ in 0..60 {
        bench.tick_on(&mut |tick| {
            seconds += tick.duration.as_s();
            for (sum, (got, rate)) in angle.iter_mut().zip(tick.delta_angle.iter().zip(EARTH)) {
                *sum += got - rate * tick.duration.as_s();
            }
        });
        if fed {
            let reference = bench.reference();
            bench.unit.handle(isotherm_correction::unit::Event::Reference(&reference), &mut |_| {});
        }
    }
    mean(angle.iter().map(|angle| (angle / seconds).powi(2))).0.sqrt()
}

#[test]
fn subtracting_the_estimate_takes_the_drift_out_of_the_corrected_rate() {
    // Per run: residual with the references on, and in the first, sixth and twelfth hour without; subtracted and not.
    let runs = for_seeds(40, |seed| {
        [false, true].map(|subtract| {
            let mut bench = Bench::new(seed, &table_1(), &table_1(), subtract);
            for _ in 1..CALIBRATION_H {
                hour(&mut bench, true);
            }
            let fed = hour(&mut bench, true);
            let blind: Vec<f64> = (0..12).map(|_| hour(&mut bench, false)).collect();
            [fed, blind[0], blind[5], blind[11]]
        })
    });
    let what = ["fed each minute", "first hour without", "sixth hour without", "twelfth hour without"];
    for (index, (what, least)) in what.into_iter().zip([60.0, 25.0, 10.0, 6.0]).enumerate() {
        let rms = |subtract: usize| mean(runs.iter().map(|run| run[subtract][index].powi(2))).0.sqrt();
        let (without, with) = (rms(0) / DEG_PER_H, rms(1) / DEG_PER_H);
        println!("{what}: {without:.5} °/h as it is, {with:.5} °/h subtracted: {:.1} times", without / with);
        assert!(without / with > least, "{what}: {without} {with}");
    }
}

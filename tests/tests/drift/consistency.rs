//! The filter believes neither too much nor too little: innovations, their whiteness, errors against their sigmas.

use isotherm_correction::drift::{MEAN_NIS_BOUNDS, Reference};
use isotherm_correction::unit::Event;

use crate::bench::{Bench, DEG_PER_H, GYROS, Noise, all_runs, for_seeds, mean, share, table_1};

const SEEDS: u64 = 60;
const HOURS: u32 = 24;

/// What one gyro said in one run.
struct Said {
    /// Normalised innovation of each update.
    innovations: Vec<f64>,
    /// Published mean of the last 60, taken each hour.
    means: Vec<f64>,
    /// Error of the estimate in its sigmas, each hour.
    errors: Vec<f64>,
    /// Error of the trend in its sigmas, each hour.
    trend_errors: Vec<f64>,
}

fn run(mut bench: Bench) -> [Said; GYROS] {
    let mut said = std::array::from_fn(|_| Said {
        innovations: Vec::new(),
        means: Vec::new(),
        errors: Vec::new(),
        trend_errors: Vec::new(),
    });
    for minute in 1..=60 * HOURS {
        bench.fed_minute();
        let (estimates, errors) = (bench.estimates(), bench.errors());
        for (i, said) in said.iter_mut().enumerate() {
            let estimate = estimates[i];
            said.innovations.extend(estimate.normalised_innovation);
            if minute % 60 == 1 && minute > 60 {
                assert_eq!(estimate.updates, u64::from(minute) - 1);
                said.means.push(estimate.mean_nis.unwrap());
                said.errors.push(errors[i]);
                said.trend_errors.push((estimate.trend - bench.truth[i].trend) / estimate.trend_sigma);
            }
        }
    }
    said
}

/// Largest distance of a share `p` from itself by chance: five sigmas.
fn chance(p: f64, count: f64) -> f64 {
    5.0 * (p * (1.0 - p) / count).sqrt()
}

#[test]
fn innovations_are_normal_white_and_of_the_stated_size() {
    let runs: Vec<Said> = for_seeds(SEEDS, |seed| run(Bench::sound(seed))).into_iter().flatten().collect();

    // Each by itself: χ² of one degree of freedom is beyond 3.841 once in twenty.
    let squares: Vec<f64> = runs.iter().flat_map(|said| said.innovations.iter().map(|v| v * v)).collect();
    let (beyond, count) = share(&squares, |square| square > 3.841_46);
    println!("beyond the 95 % bound: {:.3} % of {count}", 100.0 * beyond);
    assert!((beyond - 0.05).abs() < chance(0.05, count), "{beyond}");
    let whole = mean(squares.iter().copied()).0;
    println!("mean of all: {whole:.4}");
    assert!((whole - 1.0).abs() < 5.0 * (2.0 / count).sqrt(), "{whole}");

    // Each run as a whole: its mean times its length is χ² with as many degrees of freedom, nearly normal.
    let means: Vec<f64> = runs.iter().map(|said| mean(said.innovations.iter().map(|v| v * v)).0).collect();
    let length = f64::from(60 * HOURS - 1);
    let (inside, count) = share(&means, |mean| (mean - 1.0).abs() < 1.96 * (2.0 / length).sqrt());
    println!("runs whose mean is inside its 95 % bounds: {:.1} % of {count}", 100.0 * inside);
    assert!((inside - 0.95).abs() < chance(0.95, count), "{inside}");

    // What is published: bounds of 60 updates.
    let hours: Vec<f64> = runs.iter().flat_map(|said| said.means.iter().copied()).collect();
    let (inside, count) = share(&hours, |mean| (MEAN_NIS_BOUNDS[0]..MEAN_NIS_BOUNDS[1]).contains(&mean));
    println!("published means inside their 95 % bounds: {:.2} % of {count}", 100.0 * inside);
    assert!((inside - 0.95).abs() < chance(0.95, count), "{inside}");

    // White: no innovation tells the next ones.
    for lag in [1, 2, 5, 20, 60] {
        let correlation = |said: &Said| {
            let v = &said.innovations;
            mean(v.iter().zip(&v[lag..]).map(|(a, b)| a * b)).0 / mean(v.iter().map(|v| v * v)).0
        };
        let correlations: Vec<f64> = runs.iter().map(correlation).collect();
        let (inside, count) = share(&correlations, |c| c.abs() < 1.96 / (length - lag as f64).sqrt());
        let all = mean(correlations.iter().copied()).0;
        println!("lag {lag}: correlation {all:+.5}, inside 95 % bounds in {:.1} % of runs", 100.0 * inside);
        assert!(all.abs() < 5.0 / (length * count).sqrt(), "lag {lag}: {all}");
        assert!((inside - 0.95).abs() < chance(0.95, count), "lag {lag}: {inside}");
    }

    // Errors against the truth, hour by hour: hours of one run hang together, runs do not.
    for hour in [1, 3, 6, 12, 23] {
        let (drift, count) = mean(runs.iter().map(|said| said.errors[hour - 1].powi(2)));
        let trend = mean(runs.iter().map(|said| said.trend_errors[hour - 1].powi(2))).0;
        println!("after {hour} h: squared error {drift:.3} of its variance, trend {trend:.3}");
        let bound = 4.0 * (2.0 / count).sqrt();
        assert!((drift - 1.0).abs() < bound && (trend - 1.0).abs() < bound, "{hour} h: {drift}, {trend}");
    }
}

#[test]
fn a_wrong_angle_random_walk_shows_in_the_published_mean() {
    // The statistic is worth publishing: half or twice the noise leaves its bounds within the first hours.
    for (factor, low, high) in [(0.5, 1.8, 6.0), (2.0, 0.15, 0.45)] {
        let stated = table_1().map(|mut parts| {
            parts.angle_random_walk_rad_per_sqrt_s *= factor;
            parts
        });
        let mut bench = Bench::new(7, &table_1(), &stated, false);
        bench.fed_hours(3);
        for estimate in bench.estimates() {
            let mean = estimate.mean_nis.unwrap();
            assert!((low..high).contains(&mean), "noise stated {factor} of the true one: {mean}");
        }
    }
}

#[test]
fn one_set_of_parameters_serves_the_gyros_of_a_batch() {
    // 002 states one sigma and one range of correlation times over all runs beside those of each gyro.
    let runs = for_seeds(20, |seed| run(Bench::new(seed, &table_1(), &all_runs(), false)));
    for gyro in 0..GYROS {
        let squares = runs.iter().flat_map(|said| said[gyro].innovations.iter().map(|v| v * v));
        let errors = runs.iter().flat_map(|said| said[gyro].errors.iter().map(|error| error * error));
        let (innovation, error) = (mean(squares).0, mean(errors).0);
        println!("gyro {gyro}: mean squared innovation {innovation:.3}, error {error:.3}");
        assert!((0.95..1.05).contains(&innovation) && (0.5..1.7).contains(&error), "{innovation}, {error}");
    }
}

#[test]
fn an_aiding_source_is_weighed_by_its_own_sigma() {
    // Three times as uncertain as a minute of the gyro, about each axis.
    let sigma = 0.012 * DEG_PER_H;
    let runs = for_seeds(16, |seed| {
        let mut bench = Bench::sound(seed);
        let mut noise = Noise::new(1000 + seed);
        let mut squares = Vec::new();
        for _ in 0..60 * 12 {
            bench.tick_on(&mut |_| {});
            let mut reference = Reference { sigma, ..bench.reference() };
            reference.angular_rate = reference.angular_rate.map(|rate| rate + sigma * noise.normal());
            bench.unit.handle(Event::Reference(&reference), &mut |_| {});
            squares.extend(bench.estimates().iter().filter_map(|e| e.normalised_innovation).map(|v| v * v));
        }
        (squares, bench.errors().map(|error| error * error))
    });
    // The six gyros share three axes: half as many innovations are independent.
    let (innovation, count) = mean(runs.iter().flat_map(|(squares, _)| squares.iter().copied()));
    let error = mean(runs.iter().flat_map(|(_, errors)| *errors)).0;
    println!("mean squared innovation {innovation:.3}, error {error:.3}");
    assert!((innovation - 1.0).abs() < 5.0 * (4.0 / count).sqrt(), "{innovation}");
    assert!((0.5..1.6).contains(&error), "{error}");
}

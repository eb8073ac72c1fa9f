//! The walk through `[gyro]`.

use isotherm_correction::servo::{SETTLE_RANGE, TIME_CONSTANT_RANGE_S};
use isotherm_correction::thermal::MAX_LAGS;

use super::super::common::{name, name_opt};
use super::super::curve::{Curve, Quantity};
use super::super::measure::Unit;
use super::super::reader::{Reader, Table};
use super::super::types::{
    Branches, Drift, Gyro, GyroOutput, GyroParity, GyroSensor, Lag, Servo, ServoKind, Trend,
};
use super::super::values::Limits;
use super::{SENSORS, confirm_ticks, orientation};

/// Keys of a gyro that go with one output only.
const COUNTS_KEYS: [&str; 2] = ["increment_weight_arcsec_per_count", "input_limit_counts_per_tick"];
const MEAN_KEYS: [&str; 2] = ["increment_weight_rad_per_rad", "input_limit_deg_per_s"];

pub(super) fn gyro(r: &mut Reader<'_>, mut table: Table<'_>) -> Gyro {
    let outputs = [("counts", GyroOutput::Counts), ("mean", GyroOutput::Mean)];
    let output = table.choice(r, "output", &outputs);
    let sensors = table.tables(r, "sensor", SENSORS);
    let gyro = Gyro {
        output: output.unwrap_or(GyroOutput::Counts),
        sensor: sensors.into_iter().map(|table| sensor(r, table, output)).collect(),
        orientation: {
            let table = table.table(r, "orientation");
            orientation(r, table, parity)
        },
    };
    table.finish(r);
    gyro
}

fn sensor(r: &mut Reader<'_>, mut table: Table<'_>, output: Option<GyroOutput>) -> GyroSensor {
    let (weights, limits) = output_keys(r, &mut table, output);
    let sensor = GyroSensor {
        name: name(r, &mut table, "name"),
        channel: name_opt(r, &mut table, "channel"),
        increment_weight_arcsec_per_count: weights[0],
        increment_weight_rad_per_rad: weights[1],
        input_limit_counts_per_tick: limits[0],
        input_limit_deg_per_s: limits[1],
        increment_weight_error: curve_opt(r, &mut table, "increment_weight_error", Unit::Ppm),
        static_bias: curve_opt(r, &mut table, "static_bias", Unit::DegPerH),
        magnetic_bias: curve_opt(r, &mut table, "magnetic_bias", Unit::DegPerH),
        slow_meander: curve_opt(r, &mut table, "slow_meander", Unit::DegPerH),
        thermal_rate: branches_opt(r, &mut table, "thermal_rate", Unit::DegPerHPerDegCPerS),
        thermal_acceleration: branches_opt(r, &mut table, "thermal_acceleration", Unit::DegPerHPerDegCPerS2),
        lag: {
            let lags = table.tables(r, "lag", (0, MAX_LAGS));
            lags.into_iter().map(|table| lag(r, table)).collect()
        },
        trend: table.table_opt(r, "trend").map(|table| trend(r, table)),
        servo: table.table_opt(r, "servo").map(|table| servo(r, table)),
        drift: table.table_opt(r, "drift").map(|table| drift(r, table)),
    };
    table.finish(r);
    sensor
}

/// Increment weight and input limit for "counts" and for "mean": those of the other output are refused.
///
/// Where the output itself is wrong, any of them is taken.
fn output_keys(
    r: &mut Reader<'_>,
    table: &mut Table<'_>,
    output: Option<GyroOutput>,
) -> ([Option<f64>; 2], [Option<f64>; 2]) {
    let [counts_weight, counts_limit] = COUNTS_KEYS;
    let [mean_weight, mean_limit] = MEAN_KEYS;
    match output {
        Some(GyroOutput::Counts) => {
            for (key, instead) in [(mean_weight, counts_weight), (mean_limit, counts_limit)] {
                table.forbid(
                    r,
                    key,
                    &format!("goes with output = \"mean\", but the output is \"counts\": give `{instead}`"),
                );
            }
            let weight = weight(r, table, counts_weight, "counts");
            ([Some(weight), None], [table.number_opt(r, counts_limit, Limits::Positive), None])
        }
        Some(GyroOutput::Mean) => {
            for (key, instead) in [(counts_weight, mean_weight), (counts_limit, mean_limit)] {
                table.forbid(
                    r,
                    key,
                    &format!("goes with output = \"counts\", but the output is \"mean\": give `{instead}`"),
                );
            }
            let weight = weight(r, table, mean_weight, "mean");
            ([None, Some(weight)], [None, table.number_opt(r, mean_limit, Limits::Positive)])
        }
        None => (
            [counts_weight, mean_weight].map(|key| table.number_opt(r, key, Limits::NonZero)),
            [counts_limit, mean_limit].map(|key| table.number_opt(r, key, Limits::Positive)),
        ),
    }
}

/// The increment weight that goes with the output.
fn weight(r: &mut Reader<'_>, table: &mut Table<'_>, key: &'static str, output: &str) -> f64 {
    table.number_opt(r, key, Limits::NonZero).unwrap_or_else(|| {
        table.missing(r, key, &format!("is missing: output = \"{output}\" needs it, add `{key}`"));
        1.0
    })
}

fn curve_opt<Q: Quantity>(
    r: &mut Reader<'_>,
    table: &mut Table<'_>,
    key: &'static str,
    unit: Unit,
) -> Option<Curve<Q>> {
    table.table_opt(r, key).map(|table| Curve::read(r, table, unit))
}

fn branches_opt<Q: Quantity>(
    r: &mut Reader<'_>,
    table: &mut Table<'_>,
    key: &'static str,
    unit: Unit,
) -> Option<Branches<Curve<Q>>> {
    let mut table = table.table_opt(r, key)?;
    let (run_up, braking) = (table.table(r, "run_up"), table.table(r, "braking"));
    table.finish(r);
    Some(Branches { run_up: Curve::read(r, run_up, unit), braking: Curve::read(r, braking, unit) })
}

fn lag(r: &mut Reader<'_>, mut table: Table<'_>) -> Lag {
    let time_constant_s = table.number(r, "time_constant_s", Limits::Within(1e-3, 1e7));
    let gain = table.table(r, "gain");
    table.finish(r);
    Lag { time_constant_s, gain: Curve::read(r, gain, Unit::DegPerHPerDegCPerS) }
}

fn trend(r: &mut Reader<'_>, mut table: Table<'_>) -> Trend {
    let key = "coefficients_deg_per_h";
    let coefficients = table.numbers_opt(r, key, (1, 3), Limits::Any);
    let trend = Trend {
        coefficients_deg_per_h: table.need(r, key, coefficients, vec![0.0]),
        interval_h: table.pair(r, "interval_h", Limits::Within(0.0, 250_000.0)),
    };
    table.finish(r);
    trend
}

fn servo(r: &mut Reader<'_>, mut table: Table<'_>) -> Servo {
    let forms =
        [("measured", ServoKind::Measured), ("modelled", ServoKind::Modelled), ("fitted", ServoKind::Fitted)];
    let form = table.choice(r, "form", &forms).unwrap_or(ServoKind::Measured);
    let time_constant_s = table.number(r, "time_constant_s", within(TIME_CONSTANT_RANGE_S));
    let settle_time_constants = table.number_opt(r, "settle_time_constants", within(SETTLE_RANGE));
    let rest_frequency = table.table(r, "rest_frequency");
    table.finish(r);
    Servo {
        form,
        time_constant_s,
        rest_frequency: Curve::read(r, rest_frequency, Unit::Hz),
        settle_time_constants: settle_time_constants.unwrap_or_else(Servo::default_settling),
    }
}

/// Limits are round numbers in the document's units, and inside those of the core.
fn drift(r: &mut Reader<'_>, mut table: Table<'_>) -> Drift {
    let sigma = Limits::Within(0.0, 20_000.0);
    let correlation_time = Limits::Within(0.02, 250_000.0);
    let drift = Drift {
        sigma_deg_per_h: table.number(r, "sigma_deg_per_h", sigma),
        correlation_time_h: table.number(r, "correlation_time_h", correlation_time),
        trend_sigma_deg_per_h2: table.number(r, "trend_sigma_deg_per_h2", Limits::Within(0.0, 70_000.0)),
        trend_correlation_time_h: table.number(r, "trend_correlation_time_h", correlation_time),
        initial_sigma_deg_per_h: table.number(r, "initial_sigma_deg_per_h", Limits::Within(1e-6, 20_000.0)),
        angle_random_walk_deg_per_sqrt_h: table.number(
            r,
            "angle_random_walk_deg_per_sqrt_h",
            Limits::Within(1e-8, 3000.0),
        ),
    };
    table.finish(r);
    drift
}

fn within([low, high]: [f64; 2]) -> Limits {
    Limits::Within(low, high)
}

fn parity(r: &mut Reader<'_>, mut table: Table<'_>) -> GyroParity {
    let parity = GyroParity {
        limit_deg_per_h: table.number(r, "limit_deg_per_h", Limits::Positive),
        confirm_ticks: confirm_ticks(r, &mut table),
    };
    table.finish(r);
    parity
}

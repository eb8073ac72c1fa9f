//! The walk through `[accel]`.

use isotherm_correction::thermal::MAX_LAGS;

use super::super::common::{name, name_opt};
use super::super::curve::Curve;
use super::super::measure::Unit;
use super::super::reader::{Reader, Table};
use super::super::types::{Accel, AccelLag, AccelOutput, AccelParity, AccelSensor};
use super::super::values::Limits;
use super::{SENSORS, confirm_ticks, orientation};

/// Each output: its name in the file, its input-limit key and the units of scale factor and bias.
const OUTPUTS: [(AccelOutput, &str, &str, Unit, Unit); 3] = [
    (
        AccelOutput::Counts,
        "counts",
        "input_limit_counts_per_tick",
        Unit::CountsPerSPerMPerS2,
        Unit::CountsPerS,
    ),
    (AccelOutput::Volts, "V", "input_limit_v", Unit::VPerMPerS2, Unit::V),
    (
        AccelOutput::MetresPerSecondSquared,
        "m/s2",
        "input_limit_m_per_s2",
        Unit::MPerS2PerMPerS2,
        Unit::MPerS2,
    ),
];

pub(super) fn accel(r: &mut Reader<'_>, mut table: Table<'_>) -> Accel {
    let output = table.choice(r, "output", &OUTPUTS.map(|(output, name, ..)| (name, output)));
    let sensors = table.tables(r, "sensor", SENSORS);
    let accel = Accel {
        output: output.unwrap_or(AccelOutput::Counts),
        sensor: sensors.into_iter().map(|table| sensor(r, table, output)).collect(),
        orientation: {
            let table = table.table(r, "orientation");
            orientation(r, table, parity)
        },
    };
    table.finish(r);
    accel
}

fn sensor(r: &mut Reader<'_>, mut table: Table<'_>, output: Option<AccelOutput>) -> AccelSensor {
    let mut units = None;
    let mut limits = [None; 3];
    for (slot, (this, name, key, scale_factor, bias)) in limits.iter_mut().zip(OUTPUTS) {
        if output.is_none_or(|output| output == this) {
            *slot = table.number_opt(r, key, Limits::Positive);
        } else {
            table.forbid(r, key, &format!("goes with output = {name:?} only"));
        }
        if output == Some(this) {
            units = Some((scale_factor, bias));
        }
    }
    let [input_limit_counts_per_tick, input_limit_v, input_limit_m_per_s2] = limits;
    let name = name(r, &mut table, "name");
    let channel = name_opt(r, &mut table, "channel");
    let board_channel = name_opt(r, &mut table, "board_channel");
    let scale_factor = table.table(r, "scale_factor");
    let bias = table.table_opt(r, "bias");
    let lags = table.tables(r, "lag", (0, MAX_LAGS));
    let board_ratio_error = table.table_opt(r, "board_ratio_error");
    table.finish(r);

    // Without a valid output the units of these two are anybody's guess.
    let (scale_factor, bias) = match units {
        Some(_) => (scale_factor, bias),
        None => (scale_factor.into_stand_in(), bias.map(Table::into_stand_in)),
    };
    let stated = units.is_some();
    let (scale_factor_unit, bias_unit) = units.unwrap_or((Unit::CountsPerSPerMPerS2, Unit::CountsPerS));
    AccelSensor {
        name,
        channel,
        board_channel,
        input_limit_counts_per_tick,
        input_limit_v,
        input_limit_m_per_s2,
        scale_factor: Curve::read(r, scale_factor, scale_factor_unit),
        bias: bias.map(|table| Curve::read(r, table, bias_unit)),
        lag: lags.into_iter().map(|table| lag(r, table, bias_unit, stated)).collect(),
        board_ratio_error: board_ratio_error.map(|table| Curve::read(r, table, Unit::Ppm)),
    }
}

fn lag(r: &mut Reader<'_>, mut table: Table<'_>, bias: Unit, stated: bool) -> AccelLag {
    let time_constant_s = table.number(r, "time_constant_s", Limits::Within(1e-3, 1e7));
    let gain = table.table(r, "gain");
    table.finish(r);
    let unit = match bias {
        Unit::V => Unit::VPerDegCPerS,
        Unit::MPerS2 => Unit::MPerS2PerDegCPerS,
        _ => Unit::CountsPerSPerDegCPerS,
    };
    let gain = if stated { gain } else { gain.into_stand_in() };
    AccelLag { time_constant_s, gain: Curve::read(r, gain, unit) }
}

fn parity(r: &mut Reader<'_>, mut table: Table<'_>) -> AccelParity {
    let parity = AccelParity {
        limit_m_per_s2: table.number(r, "limit_m_per_s2", Limits::Positive),
        confirm_ticks: confirm_ticks(r, &mut table),
    };
    table.finish(r);
    parity
}

//! The walk through a document: every key is asked for here once, with its limits.

mod accel;
mod gyro;
mod origin;
mod self_test;

use isotherm_correction::reversal::{
    MAX_FIT_DEGREE, MAX_FIT_READINGS, MAX_PREDICT_DEGREE, MAX_TRANSITION_TICKS, TRANSITION_RANGE_S,
};
use isotherm_correction::sample::{MAX_SENSORS, MIN_SENSORS};

use super::common::{created, name, unit};
use super::reader::{Reader, Table};
use super::types::{
    Channel, Document, Filter, FitWindow, ModeReversal, Orientation, OrientationThermal, Temperature,
};
use super::values::Limits;
use super::{CURRENT_SCHEMA, MIN_SCHEMA};

/// As many entries as there can be sensors of a kind.
const SENSORS: (usize, usize) = (MIN_SENSORS, MAX_SENSORS);
/// Any range of temperatures (°C).
const TEMPERATURES: Limits = Limits::Within(-273.15, 1000.0);

/// Reads the whole document.
pub(super) fn document(r: &mut Reader<'_>, mut root: Table<'_>) -> Document {
    let document = Document {
        schema: root.whole(r, "schema", MIN_SCHEMA, CURRENT_SCHEMA),
        unit: unit(r, &mut root),
        created: created(r, &mut root),
        note: root.text_opt(r, "note", "a string", |_| true),
        origin: root.table_opt(r, "origin").map(|table| origin::origin(r, table)),
        temperature: {
            let table = root.table(r, "temperature");
            temperature(r, table)
        },
        gyro: {
            let table = root.table(r, "gyro");
            gyro::gyro(r, table)
        },
        accel: root.table_opt(r, "accel").map(|table| accel::accel(r, table)),
        mode_reversal: root.table_opt(r, "mode_reversal").map(|table| mode_reversal(r, table)),
        self_test: root.table_opt(r, "self_test").map(|table| self_test::self_test(r, table)),
    };
    root.finish(r);
    document
}

fn temperature(r: &mut Reader<'_>, mut table: Table<'_>) -> Temperature {
    let temperature = Temperature {
        assumed_deg_c: table.number(r, "assumed_deg_c", TEMPERATURES),
        filter: table.table_opt(r, "filter").map(|table| filter(r, table)),
        channel: {
            let tables = table.tables(r, "channel", (0, 32));
            tables.into_iter().map(|table| channel(r, table)).collect()
        },
    };
    table.finish(r);
    temperature
}

fn filter(r: &mut Reader<'_>, mut table: Table<'_>) -> Filter {
    let filter = Filter {
        grid_step_s: table.number(r, "grid_step_s", Limits::Within(1e-3, 3600.0)),
        smoothing_s: table.number(r, "smoothing_s", Limits::Within(0.0, 14_745_600.0)),
        derivative_step_s: table.number(r, "derivative_step_s", Limits::Within(0.0, 14_745_600.0)),
        stale_after_s: table.number(r, "stale_after_s", Limits::Within(1e-3, 3.6e7)),
        branch_dead_band_deg_c2_per_s3: table.number_opt(
            r,
            "branch_dead_band_deg_c2_per_s3",
            Limits::Positive,
        ),
    };
    table.finish(r);
    filter
}

fn channel(r: &mut Reader<'_>, mut table: Table<'_>) -> Channel {
    let channel = Channel {
        name: name(r, &mut table, "name"),
        conversion_deg_c: table
            .numbers_opt(r, "conversion_deg_c", (1, 8), Limits::Any)
            .unwrap_or_else(Channel::identity),
        range_deg_c: table.pair(r, "range_deg_c", TEMPERATURES),
        spike_limit_deg_c: table.number(r, "spike_limit_deg_c", Limits::Positive),
    };
    table.finish(r);
    channel
}

/// Reads an orientation; `parity` reads what is special to gyros or accelerometers.
fn orientation<P>(
    r: &mut Reader<'_>,
    mut table: Table<'_>,
    parity: impl FnOnce(&mut Reader<'_>, Table<'_>) -> P,
) -> Orientation<P> {
    let orientation = Orientation {
        rows: table.rows(r, "rows", SENSORS),
        weights: table.numbers_opt(r, "weights", SENSORS, Limits::Positive),
        thermal: table.table_opt(r, "thermal").map(|table| orientation_thermal(r, table)),
        parity: table.table_opt(r, "parity").map(|table| parity(r, table)),
    };
    table.finish(r);
    orientation
}

fn orientation_thermal(r: &mut Reader<'_>, mut table: Table<'_>) -> OrientationThermal {
    let thermal = OrientationThermal {
        channels: table.texts(r, "channels", (1, MAX_SENSORS)),
        reference_deg_c: table.number(r, "reference_deg_c", TEMPERATURES),
        range_deg_c: table.pair(r, "range_deg_c", TEMPERATURES),
        slopes_arcsec_per_deg_c: table.rows(r, "slopes_arcsec_per_deg_c", SENSORS),
    };
    table.finish(r);
    thermal
}

/// Ticks that confirm a parity failure.
fn confirm_ticks(r: &mut Reader<'_>, table: &mut Table<'_>) -> u32 {
    table.whole(r, "confirm_ticks", 1, 1_000_000)
}

fn mode_reversal(r: &mut Reader<'_>, mut table: Table<'_>) -> ModeReversal {
    let default = ModeReversal::default();
    let [shortest, longest] = TRANSITION_RANGE_S;
    let transition_s = table.number_opt(r, "transition_s", Limits::Within(shortest, longest));
    let transition_ticks = if transition_s.is_some() {
        let why = "says the same as `transition_s`: give one of the two";
        table.forbid(r, "transition_ticks", why);
        None
    } else {
        table.small_opt(r, "transition_ticks", 1, MAX_TRANSITION_TICKS).or(default.transition_ticks)
    };
    let windows = [("fixed", FitWindow::Fixed), ("adaptive", FitWindow::Adaptive)];
    let fit_window = table.choice_opt(r, "fit_window", &windows).unwrap_or(default.fit_window);
    let [before, after] = match fit_window {
        FitWindow::Fixed => [default.fit_readings_before, default.fit_readings_after],
        FitWindow::Adaptive => [MAX_FIT_READINGS; 2],
    };
    let mut small = |key, low, high, default| table.small_opt(r, key, low, high).unwrap_or(default);
    let reversal = ModeReversal {
        transition_ticks,
        transition_s,
        predict_readings: small("predict_readings", 1, MAX_FIT_READINGS, default.predict_readings),
        predict_degree: small("predict_degree", 0, MAX_PREDICT_DEGREE, default.predict_degree),
        fit_readings_before: small("fit_readings_before", 1, MAX_FIT_READINGS, before),
        fit_readings_after: small("fit_readings_after", 1, MAX_FIT_READINGS, after),
        fit_degree: small("fit_degree", 0, MAX_FIT_DEGREE, default.fit_degree),
        fit_window,
    };
    table.finish(r);
    reversal
}

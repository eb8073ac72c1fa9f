//! The walk through `[self_test]`.

use isotherm_correction::calibration::MAX_SELF_TEST_READINGS;

use super::super::common::name;
use super::super::reader::{Reader, Table};
use super::super::types::{SelfTest, SelfTestCounter, SelfTestVoltage};
use super::super::values::Limits;

/// As many entries as the core looks at.
const READINGS: (usize, usize) = (0, MAX_SELF_TEST_READINGS);
/// Increases up to this can be allowed.
const LARGEST_INCREASE: u32 = 1_000_000_000;

pub(super) fn self_test(r: &mut Reader<'_>, mut table: Table<'_>) -> SelfTest {
    let voltages = table.tables(r, "voltage", READINGS);
    let counters = table.tables(r, "counter", READINGS);
    table.finish(r);
    SelfTest {
        voltage: voltages.into_iter().map(|table| voltage(r, table)).collect(),
        counter: counters.into_iter().map(|table| counter(r, table)).collect(),
    }
}

fn voltage(r: &mut Reader<'_>, mut table: Table<'_>) -> SelfTestVoltage {
    let voltage =
        SelfTestVoltage { name: name(r, &mut table, "name"), range_v: table.pair(r, "range_v", Limits::Any) };
    table.finish(r);
    voltage
}

fn counter(r: &mut Reader<'_>, mut table: Table<'_>) -> SelfTestCounter {
    let counter = SelfTestCounter {
        name: name(r, &mut table, "name"),
        max_increase: table.whole(r, "max_increase", 0, LARGEST_INCREASE),
    };
    table.finish(r);
    counter
}

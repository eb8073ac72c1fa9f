//! Checks the limits of the self-test.

use super::super::defect::{DefectKind, Section};
use super::checker::{Checker, HUGE};
use crate::operation::SelfTestParts;
use crate::sample::ChannelName;

/// Most voltages, and most counters, that a self-test may look at.
pub const MAX_SELF_TEST_READINGS: usize = 32;

/// Every limit is one, and no name stands for two readings: both kinds come in on one topic.
pub(super) fn check_self_test(checker: &mut Checker, SelfTestParts { voltages, counters }: &SelfTestParts) {
    checker.at(Section::SelfTest).count("voltage", voltages.len(), 0, MAX_SELF_TEST_READINGS);
    checker.count("counter", counters.len(), 0, MAX_SELF_TEST_READINGS);
    let voltage_names =
        || voltages.iter().enumerate().map(|(i, voltage)| ("self_test.voltage", i, voltage.name));
    let counter_names =
        || counters.iter().enumerate().map(|(i, counter)| ("self_test.counter", i, counter.name));
    for (i, voltage) in voltages.iter().enumerate() {
        name(checker.at(Section::SelfTestVoltage(i)), voltage.name, voltage_names().take(i));
        checker.range("range_v", voltage.range_v, -HUGE, HUGE);
    }
    for (i, counter) in counters.iter().enumerate() {
        let earlier = voltage_names().chain(counter_names().take(i));
        name(checker.at(Section::SelfTestCounter(i)), counter.name, earlier);
        checker.within("max_increase", counter.max_increase, 0.0, HUGE);
    }
}

fn name(
    checker: &mut Checker,
    name: ChannelName,
    earlier: impl Iterator<Item = (&'static str, usize, ChannelName)>,
) {
    if name.is_empty() {
        checker.push("name", DefectKind::NoName);
    } else {
        checker.unique(name, earlier);
    }
}

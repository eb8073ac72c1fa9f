//! Checks the limits of the self-test.

use super::super::defect::{DefectKind, Section};
use super::checker::{Checker, HUGE};
use crate::operation::SelfTestParts;
use crate::sample::ChannelName;

/// Most voltages, and most counters, that a self-test may look at.
pub const MAX_SELF_TEST_READINGS: usize = 32;

/// Every limit is one, and no name stands for two readings: both kinds come in on one topic.
pub(super) fn check_self_test(checker: &mut Checker, parts: &SelfTestParts) {
    let (voltages, counters) = (&parts.voltages, &parts.counters);
    checker.count(Section::SelfTest, "voltages", voltages.len(), 0, MAX_SELF_TEST_READINGS);
    checker.count(Section::SelfTest, "counters", counters.len(), 0, MAX_SELF_TEST_READINGS);
    for (i, voltage) in voltages.iter().enumerate() {
        let section = Section::SelfTestVoltage(i);
        let other = voltages.iter().take(i).position(|earlier| earlier.name == voltage.name);
        name(checker, section, &voltage.name, other.map(|other| ("voltage", other)));
        checker.range(section, "range_v", voltage.range_v, -HUGE, HUGE);
    }
    for (i, counter) in counters.iter().enumerate() {
        let section = Section::SelfTestCounter(i);
        let voltage = voltages.iter().position(|earlier| earlier.name == counter.name);
        let other = counters.iter().take(i).position(|earlier| earlier.name == counter.name);
        let other = voltage.map(|other| ("voltage", other)).or(other.map(|other| ("counter", other)));
        name(checker, section, &counter.name, other);
        checker.within(section, "max_increase", counter.max_increase, 0.0, HUGE);
    }
}

fn name(checker: &mut Checker, section: Section, name: &ChannelName, other: Option<(&'static str, usize)>) {
    if name.is_empty() {
        checker.push(section, "name", DefectKind::NoName);
    } else if let Some((of, other)) = other {
        checker.push(section, "name", DefectKind::DuplicateName { of, other });
    }
}

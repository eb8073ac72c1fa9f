//! Collects everything that is wrong.

use alloc::vec::Vec;

use super::super::defect::{Defect, DefectKind, Section};

/// Collects defects.
pub(super) struct Checker {
    pub(super) defects: Vec<Defect>,
}

impl Checker {
    pub(super) fn push(&mut self, section: Section, field: &'static str, kind: DefectKind) {
        self.defects.push(Defect { section, field, kind });
    }

    pub(super) fn within(&mut self, section: Section, field: &'static str, value: f64, low: f64, high: f64) {
        if !(low..=high).contains(&value) {
            self.push(section, field, DefectKind::OutOfRange { value, low, high });
        }
    }

    pub(super) fn count(
        &mut self,
        section: Section,
        field: &'static str,
        count: usize,
        low: usize,
        high: usize,
    ) {
        if !(low..=high).contains(&count) {
            self.push(section, field, DefectKind::Count { count, low, high });
        }
    }

    /// A range that runs upwards and lies within limits.
    pub(super) fn range(
        &mut self,
        section: Section,
        field: &'static str,
        [from, to]: [f64; 2],
        low: f64,
        high: f64,
    ) {
        if from >= to {
            self.push(section, field, DefectKind::InvertedRange { low: from, high: to });
        }
        for end in [from, to] {
            self.within(section, field, end, low, high);
        }
    }

    pub(super) fn channel(
        &mut self,
        section: Section,
        field: &'static str,
        index: Option<usize>,
        channels: usize,
    ) {
        if let Some(index) = index
            && index >= channels
        {
            self.push(section, field, DefectKind::NoSuchChannel { index, channels });
        }
    }
}

/// Largest finite magnitude that a coefficient may have: far beyond any instrument, safe to multiply.
pub(super) const HUGE: f64 = 1e100;

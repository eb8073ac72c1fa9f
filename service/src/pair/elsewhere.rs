//! Instances of other groups: which units they take.

use std::collections::BTreeMap;
use std::sync::Mutex;

use isotherm_protocol::key::UnitId;
use isotherm_protocol::pair::PairReport;
use zenoh::key_expr::OwnedKeyExpr;

use crate::config::{chunks, includes};
use crate::receive::intake::lock;

/// What each takes, by instance; `None` where it has not said it yet.
#[derive(Debug, Default)]
pub(super) struct Elsewhere(Mutex<BTreeMap<String, Option<Vec<OwnedKeyExpr>>>>);

impl Elsewhere {
    /// One has come.
    pub(super) fn come(&self, instance: &str) {
        lock(&self.0).entry(instance.to_owned()).or_default();
    }

    /// One has said what it takes.
    pub(super) fn said(&self, report: &PairReport) {
        if let Some(takes) = lock(&self.0).get_mut(&report.member.instance) {
            *takes = Some(chunks(&report.takes));
        }
    }

    /// An instance, maybe one of them, has gone.
    pub(super) fn go(&self, instance: &str) {
        lock(&self.0).remove(instance);
    }

    /// Whether one of them takes a unit, or may.
    pub(super) fn may_take(&self, unit: &UnitId) -> bool {
        let may = |takes: &Option<Vec<_>>| takes.as_ref().is_none_or(|it| includes(it, unit.as_str()));
        lock(&self.0).values().any(may)
    }
}

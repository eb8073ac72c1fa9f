//! Who else is on the topics: publishers of another release or type are named, and those that leave make room.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use isotherm_bus::BusError;
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Sample, SampleKind};

use crate::interface::{IMU, Interface, NO_HASH, TEMPERATURE};
use crate::mapping::Mapping;
use crate::name::{self, Gid, Kind, Seen};

/// What is to be known of a publisher on one of the bridge's topics.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Finding {
    /// Its release has no hashes of types: none of its messages arrives.
    #[error(
        "its publisher is of ROS 2 humble, whose keys have no hash of the type: nothing is received from it; use \
         jazzy or later"
    )]
    Humble,
    /// Its type, or version of the type, is another one.
    #[error("its publisher has another type than the mapping's topic: nothing is received from it ({0})")]
    OtherType(String),
    /// It publishes where corrected messages go.
    #[error("it publishes on the topic of corrected messages: subscribers receive both")]
    OnOutput,
}

/// Topics that the bridge hears and speaks on.
#[derive(Debug, Clone)]
pub struct Topics {
    inputs: Vec<(String, Interface)>,
    outputs: Vec<String>,
    /// The bridge's own node.
    own: String,
}

impl Topics {
    /// Those of a mapping.
    #[must_use]
    pub fn of(mapping: &Mapping) -> Self {
        let units = mapping.units.iter();
        let imu = units.clone().map(|unit| (unit.raw.clone(), IMU));
        let temperatures = units.clone().flat_map(|unit| &unit.temperatures);
        let temperatures = temperatures.map(|temperature| (temperature.topic.clone(), TEMPERATURE));
        Self {
            inputs: imu.chain(temperatures).collect(),
            outputs: units.map(|unit| unit.corrected.clone()).collect(),
            own: format!("{}/{}", mapping.namespace.trim_end_matches('/'), mapping.node),
        }
    }

    /// What is to be known of something in the graph, if anything.
    #[must_use]
    pub fn judge(&self, seen: &Seen) -> Option<Finding> {
        let (Kind::Publisher, Some((topic, dds, hash))) = (seen.kind, &seen.topic) else { return None };
        if self.outputs.contains(topic) {
            return (seen.node != self.own).then_some(Finding::OnOutput);
        }
        let (_, interface) = self.inputs.iter().find(|(name, _)| name == topic)?;
        if dds != interface.dds {
            Some(Finding::OtherType(dds.clone()))
        } else if hash == NO_HASH {
            Some(Finding::Humble)
        } else {
            (hash != interface.hash).then(|| Finding::OtherType(format!("{dds} {hash}")))
        }
    }
}

/// Watches the graph for as long as the subscriber is kept. `left` hears of every publisher that leaves.
///
/// # Errors
/// [`BusError::Declare`].
pub async fn watch(
    session: &Session,
    domain: u32,
    topics: Topics,
    left: impl Fn(Gid) + Send + Sync + 'static,
) -> Result<Subscriber<()>, BusError> {
    let key = name::all_tokens(domain);
    // Each publisher is named once.
    let named: Mutex<BTreeSet<String>> = Mutex::default();
    let hear = move |sample: Sample| {
        let token = sample.key_expr().as_str();
        let Some(seen) = name::parse(token) else { return };
        if sample.kind() == SampleKind::Delete {
            if seen.kind == Kind::Publisher {
                left(name::gid(token));
            }
            return;
        }
        let Some(finding) = topics.judge(&seen) else { return };
        if named.lock().unwrap_or_else(PoisonError::into_inner).insert(token.to_owned()) {
            let (node, topic) = (seen.node, seen.topic.map_or_else(String::new, |(topic, ..)| topic));
            tracing::warn!(node, topic, "{finding}");
        }
    };
    let subscriber = session.liveliness().declare_subscriber(&key).history(true).callback(hear);
    subscriber.await.map_err(|source| BusError::Declare { key, source })
}

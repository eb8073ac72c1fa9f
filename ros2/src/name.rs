//! Names, keys and liveliness tokens of the graph of ROS 2 over Zenoh.

use twox_hash::XxHash3_128;

use crate::interface::Interface;
use crate::qos::Qos;

/// First part of every liveliness token.
const TOKENS: &str = "@ros2_lv";
/// What `/` becomes in a token, and what stands for the root.
const SLASH: &str = "%";
/// What names of topics, services and namespaces must look like: parts of letters, digits and single underscores, none of
/// which begins with a digit.
pub const PATTERN: &str = r"^(/_?[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*_?)+$";
/// The same in words.
pub const MUST_BE: &str = "a name with its leading slash, such as /imu/data: letters, digits and single underscores, no part beginning with a digit";

/// Names a publisher in what it sends: a hash of its token.
pub type Gid = [u8; 16];

/// Key of a topic's data, or of a service's requests.
#[must_use]
pub fn key(domain: u32, topic: &str, interface: Interface) -> String {
    let Interface { dds, hash, .. } = interface;
    format!("{domain}/{}/{dds}/{hash}", topic.trim_matches('/'))
}

/// Pattern of every token of a domain.
#[must_use]
pub fn all_tokens(domain: u32) -> String {
    format!("{TOKENS}/{domain}/**")
}

/// What a token is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// A node.
    Node,
    /// A publisher.
    Publisher,
    /// A subscription.
    Subscription,
    /// A service.
    Service,
    /// A client of a service.
    Client,
}

impl Kind {
    const ALL: [Self; 5] = [Self::Node, Self::Publisher, Self::Subscription, Self::Service, Self::Client];

    const fn chunk(self) -> &'static str {
        match self {
            Self::Node => "NN",
            Self::Publisher => "MP",
            Self::Subscription => "MS",
            Self::Service => "SS",
            Self::Client => "SC",
        }
    }
}

/// A node of the graph.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Node {
    /// `ROS_DOMAIN_ID`.
    pub domain: u32,
    /// Its session, as Zenoh shows it.
    pub session: String,
    /// `/`, or a name with a leading slash.
    pub namespace: String,
    /// Its name.
    pub name: String,
}

impl Node {
    /// Its number in its session: the only one.
    const NUMBER: u32 = 0;

    /// Its token.
    #[must_use]
    pub fn token(&self) -> String {
        self.part(Self::NUMBER, Kind::Node)
    }

    /// The token of something of it; `number` is unique in the session, from 1.
    #[must_use]
    pub fn endpoint(&self, number: u32, kind: Kind, topic: &str, interface: Interface, qos: Qos) -> String {
        let Interface { dds, hash, .. } = interface;
        format!("{}/{}/{dds}/{hash}/{qos}", self.part(number, kind), mangled(topic))
    }

    /// What all its tokens begin with. Enclaves belong to DDS security: the root.
    fn part(&self, number: u32, kind: Kind) -> String {
        let Self { domain, session, namespace, name } = self;
        let (own, kind, namespace) = (Self::NUMBER, kind.chunk(), mangled(namespace));
        format!("{TOKENS}/{domain}/{session}/{own}/{number}/{kind}/{SLASH}/{namespace}/{name}")
    }

    /// Name of a topic or service of it: `/namespace/node/…`.
    #[must_use]
    pub fn private(&self, name: &str) -> String {
        format!("{}/{}/{name}", self.namespace.trim_end_matches('/'), self.name)
    }
}

/// A name as tokens have it.
fn mangled(name: &str) -> String {
    name.replace('/', SLASH)
}

/// How data names the publisher that has a token.
#[must_use]
pub fn gid(token: &str) -> Gid {
    XxHash3_128::oneshot(token.as_bytes()).to_le_bytes()
}

/// What a token says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seen {
    /// What it is of.
    pub kind: Kind,
    /// Name of the node, with its namespace.
    pub node: String,
    /// Topic, type and hash of the type; not of a node.
    pub topic: Option<(String, String, String)>,
}

/// Reads a token; `None` for anything else. What follows the quality of service is passed over: releases add to it.
#[must_use]
pub fn parse(token: &str) -> Option<Seen> {
    let mut chunks = token.split('/');
    let (TOKENS, _domain, _session, _node, _number) =
        (chunks.next()?, chunks.next()?, chunks.next()?, chunks.next()?, chunks.next()?)
    else {
        return None;
    };
    let kind = chunks.next()?;
    let kind = Kind::ALL.into_iter().find(|known| known.chunk() == kind)?;
    let _enclave = chunks.next()?;
    let (namespace, name) = (plain(chunks.next()?), chunks.next()?);
    let node = format!("{}/{name}", namespace.trim_end_matches('/'));
    let topic = match kind {
        Kind::Node => None,
        _ => Some((plain(chunks.next()?), chunks.next()?.to_owned(), chunks.next()?.to_owned())),
    };
    Some(Seen { kind, node, topic })
}

/// A name from how tokens have it.
fn plain(chunk: &str) -> String {
    chunk.replace(SLASH, "/")
}

#[cfg(test)]
mod tests;

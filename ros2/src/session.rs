//! The session that ROS 2 sees: a peer of their router, or a router of its own.

use std::path::PathBuf;

use clap::Args;
use isotherm_bus::session::set;
use isotherm_bus::{BusError, SessionOptions, endpoint};
use zenoh::Config;

/// Where nodes look for the router.
pub const ROUTER: &str = "tcp/127.0.0.1:7447";
/// Where a peer listens for the others, which hear of it by gossip.
const ANY_PORT: &str = "tcp/127.0.0.1:0";
/// How long a connection may say nothing (ms), and how often it says something in that time: as nodes have it.
const LEASE_MS: u32 = 60_000;
const KEEP_ALIVE: u32 = 2;

/// Where the session connects and listens.
#[derive(Debug, Clone, Default, PartialEq, Eq, Args)]
pub struct RosOptions {
    /// Router of ROS 2 to connect to, repeatable (default: 127.0.0.1:7447 unless --listen or --zenoh-config is given)
    #[arg(long, value_name = "HOST:PORT", value_parser = endpoint)]
    pub connect: Vec<String>,
    /// Be the router of ROS 2, on this address, repeatable; port 0: chosen by the system
    #[arg(long, value_name = "HOST:PORT", value_parser = endpoint)]
    pub listen: Vec<String>,
    /// Zenoh configuration (JSON5) of the session with ROS 2
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    pub zenoh_config: Option<PathBuf>,
}

impl RosOptions {
    /// The configuration that these options stand for: a file's is taken as it is, but for endpoints given here.
    ///
    /// # Errors
    /// As [`SessionOptions::to_config`].
    pub fn to_config(&self) -> Result<Config, BusError> {
        let Self { connect, listen, zenoh_config: config } = self.clone();
        let own = config.is_none();
        let router = !listen.is_empty();
        let (connect, listen) = match (own, router) {
            (true, false) => {
                let connect = if connect.is_empty() { vec![ROUTER.to_owned()] } else { connect };
                (connect, vec![ANY_PORT.to_owned()])
            }
            _ => (connect, listen),
        };
        // A router that is not there yet is waited for, as nodes do.
        let options =
            SessionOptions { config, connect, listen, keeps_trying: true, ..SessionOptions::default() };
        let mut config = options.to_config()?;
        if own {
            set(&mut config, "mode", if router { "router" } else { "peer" })?;
            set(&mut config, "scouting/gossip/enabled", true)?;
            set(&mut config, "transport/link/tx/lease", LEASE_MS)?;
            set(&mut config, "transport/link/tx/keep_alive", KEEP_ALIVE)?;
            set(&mut config, "open/return_conditions/connect_scouted", false)?;
        }
        Ok(config)
    }
}

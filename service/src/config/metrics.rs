//! `[metrics]`: where Prometheus finds the service.

use std::net::SocketAddr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::units::{AddressText, As};

/// What the address must be.
pub(super) const LOOPBACK: &str =
    "an address and a port, such as \"127.0.0.1:9464\"; any but loopback needs allow_remote = true";

/// Where metrics and health are served over HTTP.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct MetricsSettings {
    /// Address and port (0: one of the system's choice); `None` for no HTTP at all.
    #[serde(with = "As::<AddressText>")]
    #[schemars(with = "Option<String>", extend("format" = "socket-address", "x-must-be" = LOOPBACK))]
    pub listen: Option<SocketAddr>,
    /// Whether other machines may reach it. Nobody is asked for a name there, and nothing is encrypted.
    pub allow_remote: bool,
}

impl MetricsSettings {
    /// Whether an address may be listened on.
    pub(crate) fn admits(&self, address: SocketAddr) -> bool {
        self.allow_remote || address.ip().to_canonical().is_loopback()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::Settings;

    fn read(text: &str) -> Result<MetricsSettings, Vec<String>> {
        let read = Settings::parse(text, Path::new("s.toml")).map(|settings| settings.metrics);
        read.map_err(|problems| problems.iter().map(ToString::to_string).collect())
    }

    #[test]
    fn nothing_is_served_unless_an_address_is_given() {
        assert_eq!(read(""), Ok(MetricsSettings { listen: None, allow_remote: false }));
        let listen = |text: &str| read(text).unwrap().listen.map(|address| address.to_string());
        assert_eq!(listen("[metrics]\nlisten = \"127.0.0.1:0\"").as_deref(), Some("127.0.0.1:0"));
        assert_eq!(listen("[metrics]\nlisten = \"[::1]:9464\"").as_deref(), Some("[::1]:9464"));
        assert_eq!(
            listen("[metrics]\nlisten = \"0.0.0.0:9464\"\nallow_remote = true").as_deref(),
            Some("0.0.0.0:9464")
        );
    }

    #[test]
    fn what_others_could_reach_is_refused_unless_it_is_allowed() {
        let wrong = [
            "listen = \"0.0.0.0:9464\"",
            "listen = \"192.0.2.1:9464\"",
            "listen = \"[::]:9464\"",
            "listen = \"127.0.0.1\"",
            "listen = \"localhost:9464\"",
            "listen = \"9464\"",
            "listen = \"\"",
            "listen = 9464",
            "port = 9464",
        ];
        let told = wrong.map(|key| read(&format!("[metrics]\n{key}")).unwrap_err().join("\n"));
        insta::assert_snapshot!(told.join("\n"));
    }
}

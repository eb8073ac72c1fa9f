//! `[metrics]`: where Prometheus finds the service.

use std::net::SocketAddr;

/// Where metrics and health are served over HTTP.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MetricsSettings {
    /// Address and port (0: one of the system's choice); `None` for no HTTP at all.
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
        for address in
            ["0.0.0.0:9464", "192.0.2.1:9464", "[::]:9464", "127.0.0.1", "localhost:9464", "9464", ""]
        {
            let problems = read(&format!("[metrics]\nlisten = \"{address}\"")).unwrap_err();
            assert_eq!(problems.len(), 1, "{address}");
            assert!(
                problems[0].starts_with(&format!("s.toml:2:10: metrics.listen: is \"{address}\""))
                    && problems[0].contains("127.0.0.1:9464")
                    && problems[0].contains("allow_remote"),
                "{problems:?}"
            );
        }
        assert!(read("[metrics]\nlisten = 9464").is_err());
        assert!(
            read("[metrics]\nport = 9464").unwrap_err()[0]
                .contains("keys not used here: listen, allow_remote")
        );
    }
}

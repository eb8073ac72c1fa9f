//! `[web]`: the console in the browser.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::units::{As, PathText};

/// The console in the browser, on the address of `[metrics]`.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct WebSettings {
    /// Whether it is served.
    pub enabled: bool,
    /// Whether it may change anything: swaps, rollbacks, commands.
    pub write: bool,
    /// Names beside loopback under which browsers may ask for it, without a port.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub hosts: Vec<String>,
    /// File of the token; `None` for `web-token` in the state folder, and a new one at each start where there is none.
    #[serde(with = "As::<PathText>")]
    #[schemars(with = "Option<String>", length(min = 1))]
    pub token_file: Option<PathBuf>,
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::Settings;

    fn read(text: &str) -> Result<Settings, Vec<String>> {
        let read = Settings::parse(text, Path::new("/etc/isotherm/s.toml"));
        read.map_err(|problems| problems.iter().map(ToString::to_string).collect())
    }

    #[test]
    fn it_is_off_and_writes_nothing_unless_it_is_asked_to() {
        let settings = read("").unwrap();
        assert_eq!((settings.web, settings.metrics.listen), (WebSettings::default(), None));
        let settings = read("[web]\nenabled = true").unwrap();
        assert!(settings.web.enabled && !settings.web.write);
        assert_eq!(settings.metrics.listen, Some("127.0.0.1:9464".parse().unwrap()), "loopback by default");
        let settings = read(
            "metrics = { listen = \"[::1]:0\" }\nweb = { enabled = true, write = true, token_file = \"t\" }",
        );
        let settings = settings.unwrap();
        assert_eq!(settings.metrics.listen, Some("[::1]:0".parse().unwrap()));
        assert_eq!(settings.web.token_file.as_deref(), Some(Path::new("/etc/isotherm/t")));
        assert!(settings.web.write);
    }

    #[test]
    fn a_host_is_a_name_without_a_port() {
        let hosts = read("[web]\nhosts = [\"bench.example\", \"10.0.0.7\"]").unwrap().web.hosts;
        assert_eq!(hosts, ["bench.example", "10.0.0.7"]);
        let told = ["bench:9464", "http://bench", "", "*", "a b", "user@bench"]
            .map(|host| read(&format!("[web]\nhosts = [\"{host}\"]")).unwrap_err().join("\n"));
        insta::assert_snapshot!(told.join("\n"));
    }
}

//! Settings of Zenoh that a chain is run with, to find out what they are worth.

use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde_json::{Map, Value, json};

use crate::error::Error;

/// Settings under a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Profile {
    /// What it is called.
    pub(crate) name: String,
    /// Value of the environment variable `ZENOH_RUNTIME`: threads of Zenoh's runtimes, in RON.
    pub(crate) runtime: Option<String>,
    /// Values of the Zenoh configuration that are other than the project's.
    settings: Vec<(String, Value)>,
}

/// Profiles that have a name.
const KNOWN: [(&str, &str); 6] = [
    ("default", ""),
    (
        "pool-1",
        "runtime=(rx: (worker_threads: 1), tx: (handover: rx), net: (handover: rx), acc: (handover: rx), app: (handover: rx))",
    ),
    (
        "pool-2",
        "runtime=(rx: (worker_threads: 2), tx: (handover: rx), net: (handover: rx), acc: (handover: rx), app: (handover: rx))",
    ),
    (
        "pool-4",
        "runtime=(rx: (worker_threads: 4), tx: (handover: rx), net: (handover: rx), acc: (handover: rx), app: (handover: rx))",
    ),
    ("rx-1", "runtime=(rx: (worker_threads: 1))"),
    ("batching-1ms", "transport/link/tx/queue/batching/time_limit=1"),
];

impl Profile {
    /// The project's own settings.
    pub(crate) fn own() -> Self {
        Self { name: "default".to_owned(), runtime: None, settings: Vec::new() }
    }

    /// The same, with other threads of Zenoh's runtimes.
    pub(crate) fn of_runtime(runtime: &str) -> Self {
        Self { name: "given".to_owned(), runtime: Some(runtime.to_owned()), ..Self::own() }
    }

    /// Writes the configuration file that it needs; `None` where the project's own will do.
    pub(crate) fn write(&self, folder: &Path) -> Result<Option<PathBuf>, Error> {
        if self.settings.is_empty() {
            return Ok(None);
        }
        let mut config = own_configuration();
        for (key, value) in &self.settings {
            set(&mut config, key, value.clone());
        }
        let path = folder.join("zenoh.json5");
        fs::write(&path, config.to_string()).map_err(|source| Error::file(&path, source))?;
        Ok(Some(path))
    }
}

impl FromStr for Profile {
    type Err = String;

    /// One that has a name, or `NAME;runtime=RON;key/of/zenoh=JSON`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, rest) = text.split_once(';').unwrap_or((text, ""));
        let known = KNOWN.iter().find(|(known, _)| *known == name);
        let values = match (known, rest) {
            (Some((_, values)), "") => *values,
            (None, "") => {
                let names: Vec<&str> = KNOWN.iter().map(|(name, _)| *name).collect();
                return Err(format!(
                    "is none of {}, nor NAME;runtime=RON;key/of/zenoh=JSON",
                    names.join(", ")
                ));
            }
            _ => rest,
        };
        let mut profile = Self { name: name.to_owned(), ..Self::own() };
        for pair in values.split(';').filter(|pair| !pair.is_empty()) {
            let (key, value) = pair.split_once('=').ok_or_else(|| format!("{pair:?} has no ="))?;
            if key == "runtime" {
                profile.runtime = Some(value.to_owned());
            } else {
                let value = serde_json::from_str(value).map_err(|error| format!("{key}: {error}"))?;
                profile.settings.push((key.to_owned(), value));
            }
        }
        Ok(profile)
    }
}

/// What a session of the project is configured like without a file.
fn own_configuration() -> Value {
    json!({
        "mode": "peer",
        "listen": { "endpoints": ["tcp/127.0.0.1:0"] },
        "connect": { "timeout_ms": 10_000, "exit_on_failure": true },
        "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
        "transport": { "link": { "tx": { "queue": { "batching": { "time_limit": 0 }, "size": { "real_time": 16 } } } } },
    })
}

/// Sets a value at a path such as `a/b/c`.
fn set(config: &mut Value, path: &str, value: Value) {
    let mut place = config;
    for name in path.split('/') {
        if !place.is_object() {
            *place = Value::Object(Map::new());
        }
        place = &mut place[name];
    }
    *place = value;
}

#[cfg(test)]
mod tests {
    use isotherm_bus::SessionOptions;

    use super::*;

    /// What of a Zenoh configuration the project sets.
    const KEYS: [&str; 8] = [
        "mode",
        "listen/endpoints",
        "connect/timeout_ms",
        "connect/exit_on_failure",
        "scouting/multicast/enabled",
        "scouting/gossip/enabled",
        "transport/link/tx/queue/batching",
        "transport/link/tx/queue/size",
    ];

    fn configuration(profile: &str) -> zenoh::Config {
        let folder = tempfile::tempdir().unwrap();
        let config = Profile::from_str(profile).unwrap().write(folder.path()).unwrap();
        SessionOptions { config, ..SessionOptions::default() }.to_config().unwrap()
    }

    #[test]
    fn only_what_a_profile_names_is_other_than_the_projects_own() {
        let own = configuration("default");
        let other =
            configuration("other;transport/link/tx/queue/size/real_time=8;queries_default_timeout=77");
        for key in KEYS {
            let (own, other) = (own.get_json(key).unwrap(), other.get_json(key).unwrap());
            if key.ends_with("size") {
                assert_eq!(other, own.replace("\"real_time\":16", "\"real_time\":8"));
            } else {
                assert_eq!(other, own, "{key}");
            }
        }
        assert_eq!(other.get_json("queries_default_timeout").unwrap(), "77");
    }

    #[test]
    fn every_known_profile_can_be_asked_for() {
        for (name, _) in KNOWN {
            let profile = Profile::from_str(name).unwrap();
            assert_eq!(profile.runtime.is_some() || !profile.settings.is_empty(), name != "default");
        }
        assert!(Profile::from_str("nothing").unwrap_err().contains("pool-2"));
        assert!(Profile::from_str("x;novalue").is_err());
    }
}

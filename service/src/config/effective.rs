//! The configuration as it holds, defaults included, as text that [`Settings::parse`] takes.

use super::Settings;

/// What is said before the text.
const NOTE: &str = "\
# The effective configuration, defaults included.
# Left out, because they may contain secrets: the Zenoh configuration file, and what follows a `#` or `?` in an endpoint.
";

impl Settings {
    /// The configuration as text, the version of the program as its first line; what may be secret is left out, and it is
    /// said what.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let head = concat!("# isotherm ", env!("CARGO_PKG_VERSION"), "\n");
        // Nothing in it that TOML has no form for.
        let body = toml::to_string(self).unwrap_or_else(|error| format!("# {error}\n"));
        format!("{head}{NOTE}\n{body}")
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn again(settings: &Settings) -> Settings {
        let text = settings.to_toml();
        Settings::parse(&text, Path::new("effective.toml"))
            .unwrap_or_else(|problems| panic!("{problems:?}\n{text}"))
    }

    #[test]
    fn what_is_written_is_read_back_as_the_same_settings() {
        assert_eq!(again(&Settings::default()), Settings::default());
        let text = r#"
            state = "state"
            calibrations = "calibration"
            strict_start = true
            initial_state = "standby"
            drift_estimate = "subtract"
            reference_delay_ms = 17
            uncalibrated = "hold"
            max_units = 3
            pairing_window_ms = 20
            temperature_delay_ms = 0
            tail_flush_ms = 70
            status_interval_ms = 200
            stop_timeout_ms = 900
            congestion = "block"
            folder = { settle_ms = 40, poll_s = 0.5 }
            swap = { max_age_days = 12, age = "refuse", max_jump_deg_per_h = 8.0, max_jump_mg = 2.0, jump = "warn", slew_ms = 5 }
            pre_launch = { duration_s = 61.5, max_imbalance = 0.5, min_time_per_mode_s = 31.0, min_good_share = 0.25 }
            navigation = { ticks = 4, coning_sculling = true }
            metrics = { listen = "127.0.0.1:0" }
            zenoh = { listen = ["tcp/127.0.0.1:0"], namespace = "site/a" }
        "#;
        let settings = Settings::parse(text, Path::new("/etc/isotherm/service.toml")).unwrap();
        assert_eq!(again(&settings), settings);
    }

    #[test]
    fn the_version_comes_first_and_no_secret_at_all() {
        let mut settings = Settings::default();
        settings.zenoh.session.connect =
            vec!["tls/192.0.2.1:7447?prio=1#connect_private_key_base64=c2VjcmV0".to_owned()];
        let text = settings.to_toml();
        insta::assert_snapshot!(text.replacen(env!("CARGO_PKG_VERSION"), "VERSION", 1));
    }
}

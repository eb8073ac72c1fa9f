//! The configuration as it holds, defaults included, as text that [`Settings::parse`] takes.

use std::path::Path;
use std::time::Duration;

use isotherm_bus::endpoint::address;
use isotherm_correction::unit::Uncalibrated;
use isotherm_correction::units::{AngularRate, Span, SpecificForce};
use isotherm_protocol::pair::Mode;
use zenoh::qos::CongestionControl;

use super::Settings;
use super::keys::{
    Congestion, DriftEstimate, FolderKeys, InitialState, Keys, MetricsKeys, ModeKey, NavigationKeys,
    PairKeys, PreLaunchKeys, SwapKeys, UncalibratedKey, WebKeys, ZenohKeys,
};

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
        let body = toml::to_string(&self.keys()).unwrap_or_else(|error| format!("# {error}\n"));
        format!("{head}{NOTE}\n{body}")
    }

    fn keys(&self) -> Keys {
        let Self { unit, pre_launch, swap, session, .. } = self;
        let limits = &pre_launch.limits;
        let deg_per_h = |rate| AngularRate::from_rad_per_s(rate).as_deg_per_h();
        let milli_g = |force| SpecificForce::from_m_per_s2(force).as_g() * 1e3;
        Keys {
            calibrations: self.calibrations.as_deref().map(text),
            strict_start: Some(self.strict_start),
            state: self.state.as_deref().map(text),
            initial_state: Some(if unit.in_standby { InitialState::Standby } else { InitialState::Running }),
            drift_estimate: Some(if unit.subtract_drift {
                DriftEstimate::Subtract
            } else {
                DriftEstimate::Publish
            }),
            reference_delay_ms: Some(span_ms(unit.reference_delay)),
            uncalibrated: Some(match unit.uncalibrated {
                Uncalibrated::PassThrough => UncalibratedKey::PassThrough,
                Uncalibrated::Hold => UncalibratedKey::Hold,
            }),
            max_units: u32::try_from(self.max_units).ok(),
            pairing_window_ms: Some(span_ms(unit.pairing_window)),
            temperature_delay_ms: Some(span_ms(unit.temperature_delay)),
            tail_flush_ms: Some(ms(self.tail_flush)),
            status_interval_ms: Some(ms(self.status_interval)),
            stop_timeout_ms: Some(ms(self.stop_timeout)),
            congestion: Some(match self.congestion {
                CongestionControl::Block => Congestion::Block,
                _ => Congestion::Drop,
            }),
            units: self.units.clone(),
            pair: PairKeys {
                name: self.pair.name.clone(),
                mode: Some(match self.pair.mode {
                    Mode::Standby => ModeKey::Standby,
                    Mode::Active => ModeKey::Active,
                }),
                priority: Some(self.pair.priority),
                takeover_ms: Some(ms(self.pair.takeover)),
                lease_ms: self.session.lease.map(ms),
            },
            folder: FolderKeys {
                settle_ms: Some(ms(self.folder.settle)),
                poll_s: Some(self.folder.poll.as_secs_f64()),
            },
            swap: SwapKeys {
                max_age_days: u32::try_from(swap.max_age.map_or(0, |age| age.as_secs() / super::swap::DAY_S))
                    .ok(),
                age: Some(swap.age),
                outside_range: Some(swap.outside_range),
                max_jump_deg_per_h: Some(swap.max_jump_rad_per_s.map_or(0.0, deg_per_h)),
                max_jump_mg: Some(swap.max_jump_m_per_s2.map_or(0.0, milli_g)),
                jump: Some(swap.jump),
                old_schema: Some(swap.old_schema),
                downgrade: Some(swap.downgrade),
                slew_ms: Some(span_ms(swap.slew)),
                require_signature: Some(swap.require_signature),
                trusted_keys: swap.trusted_keys.as_deref().map(text),
            },
            pre_launch: PreLaunchKeys {
                duration_s: Some(pre_launch.duration.as_s()),
                max_static_change_deg_per_h: Some(deg_per_h(limits.static_bias_change_rad_per_s)),
                max_magnetic_change_deg_per_h: Some(deg_per_h(limits.magnetic_bias_change_rad_per_s)),
                max_imbalance: Some(limits.mode_imbalance),
                min_time_per_mode_s: Some(limits.time_per_mode.as_s()),
                min_good_share: Some(limits.good_share),
            },
            navigation: NavigationKeys {
                ticks: Some(unit.navigation.ticks()),
                coning_sculling: Some(unit.navigation.coning_sculling()),
            },
            metrics: MetricsKeys {
                listen: self.metrics.listen.map(|address| address.to_string()),
                allow_remote: Some(self.metrics.allow_remote),
            },
            web: WebKeys {
                enabled: Some(self.web.enabled),
                write: Some(self.web.write),
                hosts: self.web.hosts.clone(),
                token_file: self.web.token_file.as_deref().map(text),
            },
            zenoh: ZenohKeys {
                config: session.config.as_deref().map(text),
                connect: session.connect.iter().map(|endpoint| address(endpoint).to_owned()).collect(),
                listen: session.listen.iter().map(|endpoint| address(endpoint).to_owned()).collect(),
                namespace: session.namespace.clone(),
                certified_names: Some(self.certified_names),
            },
        }
    }
}

fn text(path: &Path) -> String {
    path.display().to_string()
}

fn ms(duration: Duration) -> u32 {
    u32::try_from(duration.as_millis()).unwrap_or(u32::MAX)
}

fn span_ms(span: Span) -> u32 {
    u32::try_from(span.as_ns() / 1_000_000).unwrap_or_default()
}

#[cfg(test)]
mod tests {
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
        let read = again(&settings);
        let limits = |settings: &Settings| {
            let swap = &settings.swap;
            [swap.max_jump_rad_per_s.unwrap(), swap.max_jump_m_per_s2.unwrap()]
        };
        // Through °/h and mg and back: not to the last digit.
        for (got, expected) in limits(&read).into_iter().zip(limits(&settings)) {
            assert!((got / expected - 1.0).abs() < 1e-12, "{got} {expected}");
        }
        let [rate, force] = limits(&settings);
        let mut read = read;
        (read.swap.max_jump_rad_per_s, read.swap.max_jump_m_per_s2) = (Some(rate), Some(force));
        assert_eq!(read, settings);
    }

    #[test]
    fn the_version_comes_first_and_no_secret_at_all() {
        let mut settings = Settings::default();
        settings.session.connect =
            vec!["tls/192.0.2.1:7447?prio=1#connect_private_key_base64=c2VjcmV0".to_owned()];
        let text = settings.to_toml();
        assert!(text.starts_with(concat!("# isotherm ", env!("CARGO_PKG_VERSION"), "\n")), "{text}");
        assert!(text.contains("connect = [\"tls/192.0.2.1:7447\"]"), "{text}");
        assert!(!text.contains("c2VjcmV0") && text.contains("Left out"), "{text}");
    }
}

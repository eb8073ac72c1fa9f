use isotherm_correction::navigation::NavigationStep;
use isotherm_correction::prelaunch::PreLaunchLimits;
use isotherm_correction::unit::Uncalibrated;
use isotherm_correction::units::{AngularRate, Span, SpecificForce};

use isotherm_protocol::pair::Mode;

use super::*;

fn parse(text: &str) -> Result<Settings, Vec<String>> {
    let settings = Settings::parse(text, Path::new("service.toml"));
    settings.map_err(|problems| problems.iter().map(ToString::to_string).collect())
}

#[test]
fn an_empty_configuration_is_the_default() {
    assert_eq!(parse(""), Ok(Settings::default()));
    assert_eq!(parse("[navigation]\n[zenoh]\n"), Ok(Settings::default()));
}

/// Each key with a value that is not its default.
const EVERY_KEY: &str = r#"
calibrations = "units"
strict_start = true
max_units = 3
units = ["ZLG-*", "FOG-0001"]
pairing_window_ms = 20
temperature_delay_ms = 0
uncalibrated = "hold"
tail_flush_ms = 250
status_interval_ms = 200
stop_timeout_ms = 1_500
congestion = "block"
state = "state/of/this"
initial_state = "standby"
drift_estimate = "subtract"
reference_delay_ms = 200
folder = { settle_ms = 20, poll_s = 0.5 }
metrics = { listen = "0.0.0.0:9464", allow_remote = true }
[swap]
max_age_days = 10
age = "refuse"
outside_range = "refuse"
max_jump_deg_per_h = 3600
max_jump_mg = 0.5
jump = "warn"
old_schema = "refuse"
downgrade = "warn"
slew_ms = 1500
require_signature = true
trusted_keys = "units"
[pre_launch]
duration_s = 300
max_static_change_deg_per_h = 3600
max_magnetic_change_deg_per_h = 7200
max_imbalance = 0.5
min_time_per_mode_s = 30
min_good_share = 0.25
[navigation]
ticks = 4
coning_sculling = true
[pair]
name = "north"
mode = "active"
priority = 7
takeover_ms = 35
lease_ms = 400
other = "10.0.0.2:7447"
[zenoh]
config = "z.json5"
connect = ["tcp/127.0.0.1:1"]
listen = ["tcp/127.0.0.1:0"]
namespace = "site/a"
certified_names = true
"#;

#[test]
fn every_key_arrives_where_it_belongs() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("units")).unwrap();
    std::fs::write(folder.path().join("z.json5"), "{ mode: 'client' }").unwrap();
    let expected = Settings {
        calibrations: Some(folder.path().join("units")),
        strict_start: true,
        folder: FolderSettings { settle: Duration::from_millis(20), poll: Duration::from_millis(500) },
        state: Some(folder.path().join("state/of/this")),
        swap: SwapSettings {
            max_age: Some(Duration::from_secs(864_000)),
            age: Severity::Refuse,
            outside_range: Severity::Refuse,
            max_jump_rad_per_s: Some(AngularRate::from_deg_per_h(3600.0).as_rad_per_s()),
            max_jump_m_per_s2: Some(SpecificForce::from_g(5e-4).as_m_per_s2()),
            jump: Severity::Warn,
            old_schema: Severity::Refuse,
            downgrade: Severity::Warn,
            slew: Span::from_ms(1500),
            require_signature: true,
            trusted_keys: Some(folder.path().join("units")),
        },
        max_units: 3,
        pre_launch: PreLaunchSettings {
            duration: Span::from_s(300.0),
            place: None,
            limits: PreLaunchLimits {
                static_bias_change_rad_per_s: AngularRate::from_deg_per_h(3600.0).as_rad_per_s(),
                magnetic_bias_change_rad_per_s: AngularRate::from_deg_per_h(7200.0).as_rad_per_s(),
                mode_imbalance: 0.5,
                time_per_mode: Span::from_s(30.0),
                good_share: 0.25,
                ..PreLaunchLimits::default()
            },
        },
        unit: UnitSettings {
            pairing_window: Span::from_ms(20),
            temperature_delay: Span::ZERO,
            uncalibrated: Uncalibrated::Hold,
            in_standby: true,
            subtract_drift: true,
            reference_delay: Span::from_ms(200),
            navigation: NavigationStep::new(4, true).unwrap(),
        },
        tail_flush: Duration::from_millis(250),
        status_interval: Duration::from_millis(200),
        stop_timeout: Duration::from_millis(1500),
        congestion: CongestionControl::Block,
        units: vec!["ZLG-*".to_owned(), "FOG-0001".to_owned()],
        pair: PairSettings {
            name: Some("north".to_owned()),
            mode: Mode::Active,
            priority: 7,
            takeover: Duration::from_millis(35),
            lease: Some(Duration::from_millis(400)),
            other: Some("tcp/10.0.0.2:7447".to_owned()),
        },
        metrics: MetricsSettings { listen: Some("0.0.0.0:9464".parse().unwrap()), allow_remote: true },
        zenoh: ZenohSettings {
            certified_names: true,
            session: SessionOptions {
                config: Some(folder.path().join("z.json5")),
                connect: vec!["tcp/127.0.0.1:1".to_owned()],
                listen: vec!["tcp/127.0.0.1:0".to_owned()],
                namespace: Some("site/a".to_owned()),
                lease: Some(Duration::from_millis(400)),
                ..SessionOptions::default()
            },
        },
        ..Settings::default()
    };
    assert_eq!(Settings::parse(EVERY_KEY, &folder.path().join("service.toml")), Ok(expected));
}

#[test]
fn each_problem_names_its_place_its_value_and_its_limit() {
    let told = [
        "max_units = 0",
        "\n max_units = 16385",
        "units = [\"a/b\"]",
        "units = []",
        "[pair]\nname = \"a b\"",
        "max_units = 1.5",
        "max_units = -1",
        "[pair]\nother = \"a:70000\"",
        "[pair]\nother = \"a:7\"\n[zenoh]\nconnect = [\"tcp/a:7\"]",
        "[pair]\nother = \"a:7\"\n[zenoh]\nlisten = [\"tcp/a:7\"]",
        "pairing_window_ms = 0",
        "temperature_delay_ms = \"5\"",
        "tail_flush_ms = 9",
        "stop_timeout_ms = 99",
        "status_interval_ms = 60001",
        "strict_start = 1",
        "uncalibrated = \"drop\"",
        "initial_state = \"off\"",
        "[swap]\nage = \"no\"",
        "[swap]\nmax_jump_mg = -1",
        "[folder]\npoll_s = nan",
        "[swap]\nrequire_signature = true",
        "congestion = true",
        "navigation = 4",
        "[navigation]\nticks = 1001",
        "calibrations = 3",
        "calibrations = \"no/such\"",
        "[zenoh]\nconfig = \"no.json5\"",
        "[zenoh]\nlisten = \"tcp/x\"",
        "[zenoh]\nconnect = [1]",
        "[zenoh]\nnamespace = \"\"",
        "[zenoh]\nnamespace = \"/q\"",
        "[pre_launch]\nduration_s = 60\nmin_time_per_mode_s = 61",
        "state = \"Cargo.toml\"",
        "[web]\ntoken_file = \"src\"",
        "[navigation]\ntick = 1",
    ]
    .map(|text| {
        let problems = parse(text).unwrap_err();
        assert_eq!(problems.len(), 1, "{text}");
        problems.concat()
    });
    insta::assert_snapshot!(told.join("\n"));
}

#[test]
fn with_a_state_folder_the_folder_of_documents_may_be_missing() {
    let settings = parse("calibrations = \"no/such\"\nstate = \"state\"").unwrap();
    assert_eq!(settings.calibrations, Some(PathBuf::from("no/such")));
}

#[test]
fn all_problems_come_at_once_in_the_order_of_the_text() {
    let problems =
        parse("\"é\" = 1\nmax_units = 0\n[zenoh]\nlisten = 3\n[navigation]\nticks = 0\n").unwrap_err();
    let places: Vec<_> =
        problems.iter().map(|p| p.split(": ").take(2).collect::<Vec<_>>().join(" ")).collect();
    assert_eq!(
        places,
        [
            "service.toml:1:1 \"é\"",
            "service.toml:2:13 max_units",
            "service.toml:4:10 zenoh.listen",
            "service.toml:6:9 navigation.ticks"
        ]
    );
}

#[test]
fn everything_that_zenoh_does_not_take_is_told_in_its_place() {
    let problems =
        parse("[zenoh]\nnamespace = \"a//b\"\nlisten = [\"nowhere\", \"tcp/a:1\", \"x\"]\nconnect = [\"y\"]")
            .unwrap_err();
    insta::assert_snapshot!(problems.join("\n"));
}

#[test]
fn syntax_errors_stand_alone() {
    let wrong = ["max_units = \nstrict_start = 3", "max_units = 1\nmax_units = 0"];
    insta::assert_snapshot!(wrong.map(|text| parse(text).unwrap_err().join("\n")).join("\n\n"));
}

#[test]
fn a_configuration_of_nothing_but_errors_is_refused_at_once() {
    let broken = "=\n".repeat(1 << 19);
    let problems = Settings::parse(&broken, Path::new("s.toml")).unwrap_err();
    assert!(!problems.is_empty() && problems.len() <= 257, "{}", problems.len());
}

#[test]
fn where_signatures_are_required_an_older_document_is_refused_unless_it_is_said_otherwise() {
    let folder = tempfile::tempdir().unwrap();
    let downgrade = |keys: &str| {
        let text = format!("[swap]\ntrusted_keys = \".\"\n{keys}");
        Settings::parse(&text, &folder.path().join("service.toml")).unwrap().swap.downgrade
    };
    assert_eq!(downgrade(""), Severity::Warn);
    assert_eq!(downgrade("require_signature = true"), Severity::Refuse);
    assert_eq!(downgrade("require_signature = true\ndowngrade = \"warn\""), Severity::Warn);
}

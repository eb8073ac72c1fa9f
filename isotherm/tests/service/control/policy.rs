//! Age, temperature range, jump, signature: warned about or refused, as configured.

use std::time::Duration;

use isotherm_protocol::control::{SwapOptions, SwapOutcome};
use isotherm_protocol::digest::Digest;
use isotherm_protocol::signature::{Existing, PrivateKey, sign};
use isotherm_service::Settings;
use isotherm_service::config::Severity;

use super::stand::{Folders, Stand, UNIT, assert_accepted, assert_refused, document};

const PLAIN: SwapOptions = SwapOptions {
    by: String::new(),
    dry_run: false,
    schedule: isotherm_protocol::control::Schedule::NextTick,
    slew_s: None,
    any_serial: false,
    force: false,
};

/// A document that a policy speaks against: warned about, refused and forced, as configured.
async fn policy(set: impl Fn(&mut Settings, Severity), temperature_deg_c: f64, text: &str, words: &[&str]) {
    for severity in [Severity::Warn, Severity::Refuse] {
        let folders = Folders::new();
        let mut settings = folders.settings();
        set(&mut settings, severity);
        let mut stand = Stand::start(settings).await;
        stand.temperature_deg_c = temperature_deg_c;
        let before =
            document(UNIT, 1.0).replace("2026-01-05", "2999-01-01").replace("-10.0, 40.0", "-60.0, 90.0");
        let forced = SwapOptions { force: true, ..PLAIN };
        assert_accepted(&stand.swap(UNIT, &before, &forced).await, 1);
        stand.revisions(UNIT, 2000).await;
        let reply = stand.swap(UNIT, text, &PLAIN).await;
        let reply = if severity == Severity::Refuse {
            assert_refused(&reply, words);
            assert_refused(&reply, &["--force"]);
            stand.swap(UNIT, text, &forced).await
        } else {
            reply
        };
        assert_accepted(&reply, 2);
        let warnings: Vec<_> = reply.warnings.iter().map(ToString::to_string).collect();
        let warned = |warning: &&String| words.iter().all(|words| warning.contains(words));
        assert!(warnings.iter().any(|warning| warned(&warning)), "{words:?} in {warnings:#?}");
        assert_eq!(stand.revisions(UNIT, 20).await, [2]);
        stand.stop().await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn an_old_document_is_warned_about_or_refused() {
    let set = |settings: &mut Settings, severity| {
        settings.swap.max_age = Some(Duration::from_secs(30 * 86_400));
        settings.swap.age = severity;
    };
    let old = document(UNIT, 2.0).replace("2026-01-05", "2020-01-05");
    policy(set, 25.0, &old, &["created: ", "2020-01-05", " 30"]).await;
    let undated = document(UNIT, 2.0).replace("created = 2026-01-05\n", "");
    policy(set, 25.0, &undated, &["created: "]).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_document_older_than_the_one_in_force_is_warned_about_or_refused() {
    let set = |settings: &mut Settings, severity| settings.swap.downgrade = severity;
    let older = ["created: ", "2026-01-05", "2999-01-01T00:00:00"];
    policy(set, 25.0, &document(UNIT, 2.0), &older).await;
    let undated = document(UNIT, 2.0).replace("created = 2026-01-05\n", "");
    policy(set, 25.0, &undated, &["created: is missing"]).await;
    let unusable = document(UNIT, 2.0).replace("2026-01-05", "0000-01-01");
    policy(set, 25.0, &unusable, &["created: is 0000-01-01, which"]).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_document_that_was_fitted_elsewhere_is_warned_about_or_refused() {
    let set = |settings: &mut Settings, severity| settings.swap.outside_range = severity;
    policy(set, 55.0, &document(UNIT, 2.0), &["body", "55.00 °C", "-10 to 40 °C"]).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_jump_of_the_output_is_warned_about_or_refused() {
    let set = |settings: &mut Settings, severity| {
        // 2 °/h
        settings.swap.max_jump_rad_per_s = Some(2.0_f64.to_radians() / 3600.0);
        settings.swap.jump = severity;
    };
    let words = [
        "gyro.sensor[0].static_bias.coefficients_deg_per_h[0]: ",
        "rate about x",
        "-3.5000 °/h",
        "2",
        "bias of gyro[0]",
    ];
    policy(set, 25.0, &document(UNIT, 4.5), &words).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_changed_conversion_is_judged_by_what_it_makes_of_the_present_readings() {
    let folders = Folders::new();
    let mut settings = folders.settings();
    // 0.05 °/h
    settings.swap.max_jump_rad_per_s = Some(0.05_f64.to_radians() / 3600.0);
    settings.swap.outside_range = Severity::Refuse;
    let mut stand = Stand::start(settings).await;
    stand.temperature_deg_c = 31.0;
    let converted = |conversion: &str| {
        let channel = "name = \"body\"\n";
        document(UNIT, 1.0).replacen(channel, &format!("{channel}conversion_deg_c = {conversion}\n"), 1)
    };
    assert_accepted(&stand.swap(UNIT, &converted("[0.0, 1.0]"), &PLAIN).await, 1);
    stand.revisions(UNIT, 2000).await;
    // Beyond the sensor's range, beyond the fitted range; a jump by 0.01 °/h per °C: for good, and until the channel is read.
    let cases: [(&str, &[&str]); 5] = [
        ("[273.15, 1.0]", &["channel body", "304.15 °C", "-70 to 130 °C"]),
        ("[0.0, 0.0, 1.0]", &["channel body", "961.00 °C"]),
        ("[-50.0, 1.0]", &["channel body", "-19.00 °C", "-10 to 40 °C"]),
        ("[-20.0, 1.0]", &["about x", "+0.2000 °/h"]),
        ("[-0.5, 1.0]", &["about x", "+0.0600 °/h until body is read again"]),
    ];
    for (conversion, words) in cases {
        let reply = stand.swap(UNIT, &converted(conversion), &PLAIN).await;
        assert_refused(&reply, words);
        assert!(!reply.difference.unwrap().correction.is_empty(), "{conversion}");
    }
    let reply = stand.swap(UNIT, &converted("[-0.5, 1.0]"), &SwapOptions { force: true, ..PLAIN }).await;
    assert_accepted(&reply, 2);
    let warnings: Vec<_> = reply.warnings.iter().map(ToString::to_string).collect();
    assert!(warnings.iter().any(|it| it.contains("body (31.00 °C now, 30.50 °C then)")), "{warnings:#?}");
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_jump_of_a_unit_that_was_not_heard_is_judged_at_the_assumed_temperature() {
    let folders = Folders::new();
    let mut settings = folders.settings();
    // 2 °/h
    settings.swap.max_jump_rad_per_s = Some(2.0_f64.to_radians() / 3600.0);
    let stand = Stand::start(settings).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &PLAIN).await, 1);
    let far = document(UNIT, 4.5);
    for dry_run in [true, false] {
        let reply = stand.swap(UNIT, &far, &SwapOptions { dry_run, ..PLAIN }).await;
        assert_refused(&reply, &["-3.5000 °/h", "25 °C"]);
    }
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 2.5), &PLAIN).await, 2);
    stand.stop().await;
}

/// A service that asks for signatures, with the folder of the key that it trusts.
async fn signed_stand(folders: &Folders) -> (Stand, tempfile::TempDir, PrivateKey) {
    let keys = tempfile::tempdir().unwrap();
    let trusted = PrivateKey::from_seed(&[7; 32]);
    std::fs::write(keys.path().join("bench.pub"), trusted.public().to_pem().unwrap()).unwrap();
    let mut settings = folders.settings();
    settings.swap.require_signature = true;
    settings.swap.downgrade = Severity::Refuse;
    settings.swap.trusted_keys = Some(keys.path().to_owned());
    let mut stand = Stand::start(settings).await;
    stand.revisions(UNIT, 10).await;
    (stand, keys, trusted)
}

#[tokio::test(flavor = "multi_thread")]
async fn with_a_required_signature_an_unsigned_or_wrongly_signed_document_is_refused() {
    let folders = Folders::new();
    let (stand, keys, trusted) = signed_stand(&folders).await;

    let text = document(UNIT, 1.0);
    let signed = sign(&text, &trusted, Existing::Refuse).unwrap();
    let (stranger, id) = (PrivateKey::from_seed(&[8; 32]), |key: &PrivateKey| key.public().id().to_string());
    let foreign = sign(&text, &stranger, Existing::Refuse).unwrap();
    let changed = signed.replace("coefficients_deg_per_h = [1, ", "coefficients_deg_per_h = [1.5, ");
    assert_ne!(changed, signed);
    let force = SwapOptions { force: true, any_serial: true, ..PLAIN };
    for options in [PLAIN, force] {
        assert_refused(&stand.swap(UNIT, &text, &options).await, &["isotherm sign"]);
        assert_refused(&stand.swap(UNIT, &foreign, &options).await, &[&id(&stranger), "bench"]);
        assert_refused(&stand.swap(UNIT, &changed, &options).await, &[&id(&trusted), "bench"]);
    }
    assert_accepted(&stand.swap(UNIT, &signed, &PLAIN).await, 1);
    let second = sign(&document(UNIT, 2.0), &trusted, Existing::Refuse).unwrap();
    assert_accepted(&stand.swap(UNIT, &second, &PLAIN).await, 2);
    let reply = stand.command(UNIT, r#"{"command":"rollback"}"#).await;
    assert_eq!(reply.swap.unwrap().outcome, SwapOutcome::Accepted, "it was verified when it was accepted");

    // What was signed for one unit is not taken for another, and what was replaced does not come back but by a rollback.
    let foreign = sign(&document("ZLG-9", 3.0), &trusted, Existing::Refuse).unwrap();
    for options in [PLAIN, SwapOptions { force: true, any_serial: true, ..PLAIN }] {
        assert_refused(&stand.swap(UNIT, &foreign, &options).await, &["ZLG-9", "any_serial"]);
    }
    let newer =
        sign(&document(UNIT, 4.0).replace("2026-01-05", "2026-03-05"), &trusted, Existing::Refuse).unwrap();
    assert_accepted(&stand.swap(UNIT, &newer, &PLAIN).await, 4);
    assert_refused(&stand.swap(UNIT, &second, &PLAIN).await, &["created: ", "downgrade"]);
    let reply = stand.command(UNIT, r#"{"command":"rollback"}"#).await;
    assert_eq!(reply.swap.unwrap().outcome, SwapOutcome::Accepted, "somebody asks for it by its revision");

    // A key that is taken away no longer counts, at once.
    std::fs::remove_file(keys.path().join("bench.pub")).unwrap();
    let third = sign(&document(UNIT, 3.0), &trusted, Existing::Refuse).unwrap();
    assert_refused(&stand.swap(UNIT, &third, &PLAIN).await, &[&id(&trusted)]);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_rollback_to_an_overlaid_document_asks_for_the_signature_of_that_document() {
    let folders = Folders::new();
    let (stand, keys, trusted) = signed_stand(&folders).await;
    let base = sign(&document(UNIT, 1.0), &trusted, Existing::Refuse).unwrap();
    let overlay = format!(
        "schema = 1\noverlay_of = \"{}\"\nunit = \"{UNIT}\"\n\n[[gyro]]\nname = \"x\"\n\
         static_bias_change_deg_per_h = 0.031\nstatic_bias_sigma_deg_per_h = 0.004\n",
        Digest::of(base.as_bytes())
    );
    let overlay = sign(&overlay, &trusted, Existing::Refuse).unwrap();
    let other = sign(&document(UNIT, 2.0), &trusted, Existing::Refuse).unwrap();
    for (text, revision) in [(&base, 1), (&overlay, 2), (&other, 3)] {
        assert_accepted(&stand.swap(UNIT, text, &PLAIN).await, revision);
    }
    let back = r#"{"command":"rollback","revision":2}"#;
    assert_accepted(&stand.command(UNIT, back).await.swap.unwrap(), 4);
    assert_accepted(&stand.swap(UNIT, &other, &PLAIN).await, 5);
    std::fs::remove_file(keys.path().join("bench.pub")).unwrap();
    assert_refused(&stand.command(UNIT, back).await.swap.unwrap(), &[&trusted.public().id().to_string()]);
    stand.stop().await;
}

//! `isotherm keygen`, `isotherm sign` and `isotherm check --trusted-keys` at their boundary.

#![expect(clippy::unwrap_used, reason = "a test may panic, its helpers included")]

use std::fs::Permissions;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

const MARK: &str = "# isotherm-signature: ed25519 ";

/// A folder with keys, trusted keys and a document.
struct Place(TempDir);

impl Place {
    fn new() -> Self {
        let place = Self(TempDir::new().unwrap());
        std::fs::create_dir(place.path("trusted")).unwrap();
        std::fs::write(place.path("unit.toml"), document()).unwrap();
        place
    }

    /// With a signer whose key is trusted.
    fn with_signer(name: &str) -> Self {
        let place = Self::new();
        place.keygen(name);
        place.trust(name, name);
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    fn run(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_isotherm"));
        command.current_dir(self.0.path()).args(arguments).output().unwrap()
    }

    fn keygen(&self, name: &str) -> Value {
        let output = self.run(&["keygen", name, "--json"]);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        serde_json::from_slice(&output.stdout).unwrap()
    }

    fn trust(&self, key: &str, name: &str) {
        let public = self.path(&format!("{key}.pub"));
        std::fs::copy(public, self.path("trusted").join(format!("{name}.pub"))).unwrap();
    }

    fn mode(&self, name: &str) -> u32 {
        std::fs::metadata(self.path(name)).unwrap().permissions().mode() & 0o777
    }

    fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<_> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

fn document() -> String {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/calibration/ZLG-0001.toml");
    std::fs::read_to_string(shipped).unwrap()
}

fn words(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Exit code, standard output and standard error.
fn said(output: &Output) -> (Option<i32>, String, String) {
    (output.status.code(), words(&output.stdout), words(&output.stderr))
}

#[test]
fn a_document_signed_with_a_new_key_is_known_as_its_signers() {
    let place = Place::new();
    let made = place.keygen("bench-2");
    place.trust("bench-2", "Anna");
    let id = made["key_id"].as_str().unwrap();

    let (code, out, err) = said(&place.run(&["sign", "unit.toml", "--key", "bench-2.key"]));
    assert_eq!((code, err.as_str()), (Some(0), ""));
    let text = place.text("unit.toml");
    assert!(text.strip_prefix(&document()).unwrap().starts_with(&format!("{MARK}{id} ")));

    let (code, checked, err) = said(&place.run(&["check", "--trusted-keys", "trusted", "unit.toml"]));
    assert_eq!((code, err.as_str()), (Some(0), ""));
    // The digest is that of the signed text, the one that outputs will name.
    let digest = out.trim_end().rsplit(' ').next().unwrap();
    insta::assert_snapshot!(format!("{out}{checked}").replace(digest, "DIGEST").replace(id, "KEY-ID"));
}

#[test]
fn check_tells_unsigned_unverified_and_wrong_apart() {
    let place = Place::with_signer("anna");
    let check = |arguments: &[&str]| said(&place.run(&[&["check", "unit.toml"], arguments].concat()));
    let trusted = ["--trusted-keys", "trusted"];
    let (code, out, _) = check(&trusted);
    assert_eq!(code, Some(0));
    let digest = out.rsplit_once("sha256 ").unwrap().1.split(',').next().unwrap().to_owned();
    let mut told = out + &check(&[]).1;

    place.run(&["sign", "unit.toml", "--key", "anna.key"]);
    let signature = |arguments: &[&str]| {
        let (code, out, err) = check(&[&["--json"], arguments].concat());
        assert_eq!(code, Some(0), "{err}");
        serde_json::from_str::<Value>(&out).unwrap()["files"][0]["signature"].clone()
    };
    assert_eq!(signature(&[])["state"], "unverified");
    let signed_by = signature(&trusted);
    assert_eq!((&signed_by["state"], &signed_by["name"]), (&"signed".into(), &"anna".into()));

    let signed = place.text("unit.toml");
    for changed in [
        signed.replacen("schema = 1", "schema = 1 ", 1),
        signed.replace('\n', "\r\n"),
        format!("{signed}# ok\n"),
        format!("{signed}{signed}"),
    ] {
        place.write("unit.toml", &changed);
        let (code, out, err) = check(&trusted);
        assert_eq!((code, out.as_str()), (Some(78), ""), "{err}");
        told += &(err.lines().last().unwrap().to_owned() + "\n");
    }

    place.write("unit.toml", &signed);
    std::fs::remove_file(place.path("trusted/anna.pub")).unwrap();
    let bert = place.keygen("bert");
    place.trust("bert", "bert");
    let (code, _, err) = check(&trusted);
    assert_eq!(code, Some(78));
    let anna = signed.lines().last().unwrap().strip_prefix(MARK).unwrap().split(' ').next().unwrap();
    let told = (told + &err).replace(&digest, "DIGEST").replace(anna, "KEY-OF-ANNA");
    insta::assert_snapshot!(told.replace(bert["key_id"].as_str().unwrap(), "KEY-OF-BERT"));
}

#[test]
fn a_document_that_is_bad_is_not_signed_and_neither_are_those_beside_it() {
    let place = Place::with_signer("anna");
    place.write("bad.toml", "schema = 1\nunit = \"a b\"\n");
    let (code, out, err) = said(&place.run(&["sign", "unit.toml", "bad.toml", "--key", "anna.key"]));
    assert_eq!((code, out.as_str()), (Some(78), ""));
    insta::assert_snapshot!(err);
    assert_eq!(place.text("unit.toml"), document());
    for (name, bytes) in [("empty.toml", &b""[..]), ("binary.toml", b"\xff\0")] {
        std::fs::write(place.path(name), bytes).unwrap();
        assert_eq!(place.run(&["sign", name, "--key", "anna.key"]).status.code(), Some(78), "{name}");
        assert_eq!(std::fs::read(place.path(name)).unwrap(), bytes);
    }
}

#[test]
fn a_signature_is_replaced_only_when_told() {
    let place = Place::with_signer("anna");
    place.keygen("bert");
    place.trust("bert", "bert");
    place.run(&["sign", "unit.toml", "--key", "anna.key"]);
    let once = place.text("unit.toml");
    let (code, _, err) = said(&place.run(&["sign", "unit.toml", "--key", "bert.key"]));
    assert_eq!(code, Some(1));
    let key = once.lines().last().unwrap().strip_prefix(MARK).unwrap().split(' ').next().unwrap();
    insta::assert_snapshot!(err.replace(key, "KEY-ID"));
    assert_eq!(place.text("unit.toml"), once);

    assert_eq!(place.run(&["sign", "--overwrite", "unit.toml", "--key", "bert.key"]).status.code(), Some(0));
    assert_eq!(place.text("unit.toml").matches(MARK).count(), 1);
    let checked = place.run(&["check", "--json", "unit.toml", "--trusted-keys", "trusted"]);
    let checked: Value = serde_json::from_slice(&checked.stdout).unwrap();
    assert_eq!(checked["files"][0]["signature"]["name"], "bert");
}

#[test]
fn the_original_stays_where_an_output_is_named() {
    let place = Place::with_signer("anna");
    let output = place.run(&["sign", "unit.toml", "--key", "anna.key", "--out", "signed.toml", "--json"]);
    assert_eq!(output.status.code(), Some(0));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&report["signed"], &report["files"][0]["output"]), (&true.into(), &"signed.toml".into()));
    assert_eq!(report["files"][0]["digest"].as_str().unwrap().len(), 64);
    assert_eq!(place.text("unit.toml"), document());
    assert!(place.text("signed.toml").contains(MARK));

    let two = ["sign", "unit.toml", "signed.toml", "--key", "anna.key", "--out", "x.toml"];
    assert_eq!(place.run(&two).status.code(), Some(2), "one output for two documents");
    let (code, _, err) = said(&place.run(&["sign", "unit.toml", "--key", "anna.key", "--out", "no/x.toml"]));
    assert_eq!(code, Some(1));
    insta::assert_snapshot!(err);
    assert_eq!(place.run(&["sign", "unit.toml", "--key", "anna.key", "--out", "."]).status.code(), Some(2));

    let mut again = vec!["sign", "unit.toml", "--key", "anna.key", "--out", "signed.toml"];
    assert_eq!(place.run(&again).status.code(), Some(2), "a file that is there is not written over");
    again.push("--overwrite");
    assert_eq!(place.run(&again).status.code(), Some(0));
    let key = place.text("anna.key");
    again[5] = "anna.key";
    let (code, _, err) = said(&place.run(&again));
    assert_eq!((code, place.text("anna.key")), (Some(2), key));
    insta::assert_snapshot!(err, @"isotherm: anna.key is the private key: give another name");
    assert_eq!(place.names(), ["anna.key", "anna.pub", "signed.toml", "trusted", "unit.toml"]);
}

#[test]
fn signing_in_place_keeps_links_and_permissions_and_leaves_nothing_over() {
    let place = Place::with_signer("anna");
    std::fs::set_permissions(place.path("unit.toml"), Permissions::from_mode(0o640)).unwrap();
    symlink("unit.toml", place.path("active.toml")).unwrap();
    assert_eq!(place.run(&["sign", "active.toml", "--key", "anna.key"]).status.code(), Some(0));
    assert!(place.path("active.toml").is_symlink());
    assert!(place.text("unit.toml").contains(MARK));
    assert_eq!(place.mode("unit.toml"), 0o640);
    assert_eq!(place.names(), ["active.toml", "anna.key", "anna.pub", "trusted", "unit.toml"]);
}

#[test]
fn a_pair_of_keys_is_private_and_never_overwritten() {
    let place = Place::new();
    let (code, out, err) = said(&place.run(&["keygen", "v1.2"]));
    assert_eq!((code, err.as_str()), (Some(0), ""));
    assert!(out.contains("v1.2.key") && out.contains("v1.2.pub"), "{out}");
    assert_eq!(place.mode("v1.2.key"), 0o600);
    let (private, public) = (place.text("v1.2.key"), place.text("v1.2.pub"));
    let (code, _, err) = said(&place.run(&["keygen", "v1.2"]));
    assert_eq!(code, Some(1));
    assert!(err.contains("v1.2.key"), "{err}");
    std::fs::remove_file(place.path("v1.2.key")).unwrap();
    assert_eq!(place.run(&["keygen", "v1.2"]).status.code(), Some(1), "half a pair is in the way too");
    assert_eq!(place.names(), ["trusted", "unit.toml", "v1.2.pub"]);
    assert_eq!(place.text("v1.2.pub"), public);

    let other = place.keygen("other");
    assert_ne!(place.text("other.key"), private);
    assert!(other["fingerprint"].as_str().unwrap().starts_with(other["key_id"].as_str().unwrap()));
    for name in ["", "a/b", "..", "-x", "é"] {
        assert_eq!(place.run(&["keygen", "--", name]).status.code(), Some(2), "{name:?}");
    }
    let (code, _, err) = said(&place.run(&["keygen", "x", "--folder", "missing"]));
    assert_eq!(code, Some(1));
    assert!(err.contains("missing/x.key"), "{err}");
}

#[test]
fn openssl_reads_what_keygen_writes_and_the_other_way_round() {
    let openssl = |place: &Place, arguments: &[&str]| {
        Command::new("openssl").current_dir(place.0.path()).args(arguments).output()
    };
    let place = Place::with_signer("anna");
    let Ok(version) = openssl(&place, &["version"]) else {
        eprintln!("skipped: no openssl");
        return;
    };
    assert!(version.status.success());
    let public = openssl(&place, &["pkey", "-in", "anna.key", "-pubout"]).unwrap();
    assert!(public.status.success(), "{public:?}");
    assert_eq!(words(&public.stdout), place.text("anna.pub"));

    for arguments in [
        &["genpkey", "-algorithm", "ed25519", "-out", "theirs.key"][..],
        &["pkey", "-in", "theirs.key", "-pubout", "-out", "trusted/theirs.pub"],
    ] {
        assert!(openssl(&place, arguments).unwrap().status.success());
    }
    assert_eq!(place.run(&["sign", "unit.toml", "--key", "theirs.key"]).status.code(), Some(0));
    let checked = place.run(&["check", "--json", "unit.toml", "--trusted-keys", "trusted"]);
    let checked: Value = serde_json::from_slice(&checked.stdout).unwrap();
    assert_eq!(checked["files"][0]["signature"]["name"], "theirs");

    // The signature itself, by somebody else's arithmetic.
    let text = place.text("unit.toml");
    let (covered, line) = text.split_at(text.rfind(MARK).unwrap());
    place.write("message", &format!("isotherm calibration document v1\n{covered}"));
    place.write("signature.b64", line.trim_end().rsplit(' ').next().unwrap());
    let decoded =
        openssl(&place, &["base64", "-d", "-A", "-in", "signature.b64", "-out", "signature"]).unwrap();
    assert!(decoded.status.success());
    let verify = ["pkeyutl", "-verify", "-rawin", "-pubin", "-inkey", "trusted/theirs.pub"];
    let verified =
        openssl(&place, &[&verify[..], &["-in", "message", "-sigfile", "signature"]].concat()).unwrap();
    assert!(verified.status.success(), "{verified:?}");
}

#[test]
fn a_key_that_others_can_read_is_warned_about() {
    let place = Place::with_signer("anna");
    std::fs::set_permissions(place.path("anna.key"), Permissions::from_mode(0o644)).unwrap();
    let (code, _, err) = said(&place.run(&["sign", "unit.toml", "--key", "anna.key"]));
    assert_eq!(code, Some(0));
    let told = err;
    std::fs::set_permissions(place.path("trusted/anna.pub"), Permissions::from_mode(0o666)).unwrap();
    let (code, _, err) = said(&place.run(&["check", "unit.toml", "--trusted-keys", "trusted"]));
    assert_eq!(code, Some(0));
    insta::assert_snapshot!(told + &err);
}

#[test]
fn what_is_no_private_key_is_refused_by_name() {
    let place = Place::with_signer("anna");
    place.write("garbage.key", "-----BEGIN PRIVATE KEY-----\nAAAA\n-----END PRIVATE KEY-----\n");
    let mut told = String::new();
    for (key, code) in [("anna.pub", 78), ("garbage.key", 78), ("unit.toml", 78), ("missing.key", 1)] {
        let (exit, out, err) = said(&place.run(&["sign", "unit.toml", "--key", key]));
        assert_eq!((exit, out.as_str()), (Some(code), ""), "{key}");
        told += &err;
    }
    insta::assert_snapshot!(told);
    assert_eq!(place.text("unit.toml"), document());
}

#[test]
fn every_bad_file_among_the_trusted_keys_is_named() {
    let place = Place::new();
    let anna = place.keygen("anna");
    for name in ["anna", "anna-again"] {
        place.trust("anna", name);
    }
    place.write("trusted/secret.pub", &place.text("anna.key"));
    place.write("trusted/text.pub", "ssh-ed25519 AAAA\n");
    symlink("nowhere", place.path("trusted/gone.pub")).unwrap();
    place.write("trusted/.hidden.pub", "");
    place.write("trusted/README", "");
    let check = ["check", "unit.toml", "--trusted-keys", "trusted"];
    let (code, out, err) = said(&place.run(&check));
    assert_eq!((code, out.as_str()), (Some(78), ""));
    let told = err.replace(anna["key_id"].as_str().unwrap(), "KEY-ID");

    let (code, _, err) = said(&place.run(&["check", "unit.toml", "--trusted-keys", "missing"]));
    assert_eq!(code, Some(1));
    insta::assert_snapshot!(told + &err);
}

#[test]
fn what_is_doubtful_about_the_trusted_keys_is_told_by_check_and_at_the_start() {
    let place = Place::with_signer("bench");
    std::fs::copy(place.path("bench.key"), place.path("trusted").join("bench.pem")).unwrap();
    std::fs::create_dir(place.path("units")).unwrap();
    place.write("units/bad.toml", "schema = 1\n");
    let config = "calibrations = \"units\"\nstrict_start = true\n[swap]\ntrusted_keys = \"trusted\"\n";
    place.write("service.toml", config);
    let told = |output: &Output, end: &str| {
        let stderr = String::from_utf8_lossy(&output.stderr);
        let line = stderr.lines().find(|line| line.contains("bench.pem:1:1: "));
        assert!(line.is_some_and(|line| line.ends_with(end)), "{stderr}");
    };
    let output = place.run(&["check", "service.toml"]);
    assert_eq!(output.status.code(), Some(0));
    told(&output, "(warning)");
    told(&place.run(&["check", "--trusted-keys", "trusted", "unit.toml"]), "(warning)");
    // The bad document ends it, behind what it says of the keys.
    let output = place.run(&["serve", "--config", "service.toml", "--listen", "tcp/127.0.0.1:0"]);
    assert_eq!(output.status.code(), Some(78));
    told(&output, "could read it");

    // In the place of a public one it makes the folder bad.
    std::fs::rename(place.path("trusted/bench.pem"), place.path("trusted/other.pub")).unwrap();
    let output = place.run(&["check", "service.toml"]);
    assert_eq!(output.status.code(), Some(78));
    assert!(String::from_utf8_lossy(&output.stderr).contains("other.pub:1:1: "), "{output:?}");
    let output = place.run(&["serve", "--config", "service.toml", "--listen", "tcp/127.0.0.1:0"]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("other.pub:1:1: "), "{stderr}");

    // Without any of them, though one is asked for, the service would refuse every document.
    for key in ["bench", "other"] {
        std::fs::remove_file(place.path(&format!("trusted/{key}.pub"))).unwrap();
    }
    place.write("service.toml", &(config.to_owned() + "require_signature = true\n"));
    for command in
        [&["check", "service.toml"][..], &["serve", "--config", "service.toml", "--listen", "127.0.0.1:0"]]
    {
        let stderr = String::from_utf8_lossy(&place.run(command).stderr).into_owned();
        assert!(stderr.contains("trusted:1:1: has no *.pub"), "{stderr}");
    }
}

#[test]
fn a_file_name_forges_no_line_and_turns_no_text_round() {
    let place = Place::new();
    std::fs::create_dir(place.path("units")).unwrap();
    let name = "units/a\nERROR forged\u{202e}lmot.toml";
    place.write(name, "schema = 1\nnote = \"x\"\n");
    place.write("service.toml", "calibrations = \"units\"\nstrict_start = true\n");
    for format in ["human", "json"] {
        let serve =
            ["serve", "--config", "service.toml", "--listen", "tcp/127.0.0.1:0", "--log-format", format];
        for arguments in [&serve[..], &["check", "--kind", "calibration", name]] {
            let output = place.run(arguments);
            assert_eq!(output.status.code(), Some(78), "{output:?}");
            // In JSON a backslash is two.
            let stderr = String::from_utf8(output.stderr).unwrap().replace("\\\\", "\\");
            assert!(stderr.contains("\\nERROR forged\\u202elmot.toml"), "{stderr}");
            assert!(!stderr.contains('\u{202e}') && !stderr.contains("\nERROR forged"), "{stderr}");
        }
    }
}

#[test]
fn an_overlay_is_signed_as_a_document_is() {
    let place = Place::with_signer("bench");
    let overlay = format!(
        "schema = 1\noverlay_of = \"{}\"\nunit = \"ZLG-0001\"\n\n[[gyro]]\nname = \"x\"\n\
         static_bias_change_deg_per_h = 0.031\nstatic_bias_sigma_deg_per_h = 0.004\n",
        "27fb".repeat(16)
    );
    place.write("overlay.toml", &overlay);
    let output = place.run(&["sign", "overlay.toml", "--key", "bench.key"]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let signed = place.text("overlay.toml");
    assert!(signed.starts_with(&overlay) && signed.contains(MARK), "{signed}");
    let checked = place.run(&["check", "overlay.toml", "--trusted-keys", "trusted", "--json"]);
    assert_eq!(checked.status.code(), Some(0), "{checked:?}");

    place.write("bad.toml", &overlay.replace("name = \"x\"", "nam = \"x\""));
    assert_eq!(place.run(&["sign", "bad.toml", "--key", "bench.key"]).status.code(), Some(78));
}

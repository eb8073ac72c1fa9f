//! Sound by themselves and yet not to be taken: another serial, another base, another signer.

use std::path::{Path, PathBuf};

use isotherm_protocol::digest::Digest;
use isotherm_protocol::signature::{Existing, PrivateKey, sign};

use super::{Case, line_of};
use crate::documents::{BASE, base};

/// What only a query can carry.
pub(super) fn over_the_bus() -> Vec<Case> {
    let other = base("ZLG-0002");
    let digest = Digest::of(BASE.as_bytes());
    let overlay = |of: &str, unit: &str, gyro: &str| {
        format!(
            "schema = 1\noverlay_of = \"{of}\"\nunit = \"{unit}\"\n\n[[gyro]]\nname = \"{gyro}\"\n\
             static_bias_change_deg_per_h = 0.1\nstatic_bias_sigma_deg_per_h = 0.01\n"
        )
    };
    let (right, wrong) = (digest.to_string(), Digest::of(b"another").to_string());
    vec![
        Case::new("another serial", other.clone(), line_of(&other, "unit ="), "unit", "any_serial"),
        Case::new("overlay of another base", overlay(&wrong, "ZLG-0001", "x"), 2, "overlay_of", &right),
        Case::new("overlay of no digest", overlay("27fb", "ZLG-0001", "x"), 2, "overlay_of", "must be 64"),
        Case::new("overlay for another unit", overlay(&right, "ZLG-0002", "x"), 3, "unit", "ZLG-0001"),
        Case::new("overlay for another gyro", overlay(&right, "ZLG-0001", "w"), 6, "gyro[0].name", "x, y, z"),
        Case::new(
            "overlay without its sigma",
            overlay(&right, "ZLG-0001", "x").replace("static_bias_sigma_deg_per_h = 0.01\n", ""),
            5,
            "gyro[0].static_bias_sigma_deg_per_h",
            "is missing",
        ),
    ]
}

fn key(seed: u8) -> PrivateKey {
    PrivateKey::from_seed(&[seed; 32])
}

/// Makes a folder of trusted keys with one in it.
pub(super) fn trust(folder: &Path) -> PathBuf {
    std::fs::create_dir(folder).unwrap();
    std::fs::write(folder.join("ann.pub"), key(1).public().to_pem().unwrap()).unwrap();
    folder.to_owned()
}

/// The shipped document, signed by a trusted key.
pub(super) fn signed() -> String {
    sign(BASE, &key(1), Existing::Refuse).unwrap()
}

/// Signed by nobody, by a stranger, or not as it stands.
pub(super) fn badly_signed() -> Vec<Case> {
    let signed = signed();
    let last = signed.lines().count();
    let by_a_stranger = sign(BASE, &key(2), Existing::Refuse).unwrap();
    let line = signed.lines().last().unwrap().to_owned();
    let at_last = |name, text: String, says| Case::new(name, text, last, "", says);
    vec![
        Case::new("unsigned", BASE, 1, "", "is not signed, but require_signature is set"),
        at_last("signed by a stranger", by_a_stranger, "which is not trusted here; ann ("),
        at_last(
            "changed after signing",
            signed.replacen("1.94", "1.95", 1),
            "the text was changed after signing",
        ),
        at_last(
            "line ends changed after signing",
            signed.replace('\n', "\r\n"),
            "the text was changed after signing",
        ),
        at_last(
            "signature cut short",
            signed.trim_end()[..signed.trim_end().len() - 8].to_owned(),
            "signature",
        ),
        at_last("signature of another kind", signed.replace("ed25519", "rsa"), "is of kind"),
        Case::new("signed twice", format!("{signed}{line}\n"), last + 1, "", "is a second signature line"),
        Case::new(
            "more after the signature",
            format!("{signed}note = 1\n"),
            last + 1,
            "",
            "after the signature",
        ),
    ]
}

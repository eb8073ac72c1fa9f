//! What a signature holds for, and what it does not survive.

use ed25519_dalek::pkcs8::spki::der::pem::LineEnding;
use ed25519_dalek::pkcs8::{EncodePrivateKey, EncodePublicKey, KeypairBytes};
use ed25519_dalek::{SigningKey, VerifyingKey};
use proptest::prelude::*;

use super::*;
use crate::document::MAX_DOCUMENT_BYTES;

mod keys;

const TEXT: &str = "schema = 1\nunit = \"ZLG-0001\" # °C\n";

fn key(number: u8) -> PrivateKey {
    PrivateKey::from_seed(&[number; 32])
}

fn trusted(numbers: &[u8]) -> TrustedKeys {
    let mut trusted = TrustedKeys::default();
    for number in numbers {
        trusted.insert(&format!("signer-{number}"), key(*number).public()).unwrap();
    }
    trusted
}

fn signed(text: &str) -> String {
    sign(text, &key(1), Existing::Refuse).unwrap()
}

/// Place and words of what is wrong, where key 1 is trusted.
fn refused(text: &str) -> String {
    verify(text, &trusted(&[1])).unwrap_err().to_string()
}

fn is_by(text: &str, number: u8) -> bool {
    let expected = Verdict::Signed { key_id: key(number).public().id(), name: format!("signer-{number}") };
    verify(text, &trusted(&[number])) == Ok(expected)
}

#[test]
fn a_signed_text_is_the_text_and_one_more_line() {
    let text = signed(TEXT);
    let line = text.strip_prefix(TEXT).unwrap();
    assert!(line.starts_with(&format!("# isotherm-signature: ed25519 {} ", key(1).public().id())), "{line}");
    assert_eq!(line.matches('\n').count(), 1);
    assert!(line.ends_with("==\n"));
    assert!(is_by(&text, 1));
    let found = find(&text).unwrap().unwrap();
    assert_eq!((found.covered(), found.line(), found.key_id()), (TEXT, 3, key(1).public().id()));
}

#[test]
fn a_text_without_a_last_line_break_is_given_one() {
    assert_eq!(signed(TEXT.trim_end()), signed(TEXT));
    assert!(is_by(&signed(TEXT), 1));
    assert!(is_by(signed(TEXT).trim_end(), 1), "the signature's own line break may be missing");
}

#[test]
fn an_empty_text_is_unsigned_and_can_be_signed() {
    assert_eq!(verify("", &trusted(&[1])), Ok(Verdict::Unsigned));
    assert!(is_by(&signed(""), 1));
}

#[test]
fn a_text_without_a_signature_is_unsigned_whatever_its_comments_say() {
    for text in [
        TEXT,
        "\n\n",
        "# The isotherm-signature line stands below.\n",
        "# ed25519 AAAA==\n",
        "a = 1 # isotherm-signature: ed25519\n",
    ] {
        assert_eq!(verify(text, &TrustedKeys::default()), Ok(Verdict::Unsigned), "{text}");
    }
}

#[test]
fn the_bytes_that_are_signed_begin_with_the_domain() {
    let text = signed(TEXT);
    let line = text.lines().last().unwrap();
    let bytes = line.split(' ').next_back().unwrap();
    let bytes = <base64ct::Base64 as base64ct::Encoding>::decode_vec(bytes).unwrap();
    let signature = ed25519_dalek::Signature::from_slice(&bytes).unwrap();
    let verifying = SigningKey::from_bytes(&[1; 32]).verifying_key();
    assert!(verifying.verify_strict(&[DOMAIN, TEXT.as_bytes()].concat(), &signature).is_ok());
    assert!(verifying.verify_strict(TEXT.as_bytes(), &signature).is_err());
}

#[test]
fn no_flipped_bit_of_text_or_signature_goes_unnoticed() {
    let (text, trusted) = (signed(TEXT), trusted(&[1]));
    for index in 0..text.len() {
        for bit in 0..8 {
            let mut bytes = text.clone().into_bytes();
            bytes[index] ^= 1 << bit;
            // What is not UTF-8 is refused before anybody looks for a signature.
            let Ok(flipped) = String::from_utf8(bytes) else { continue };
            match verify(&flipped, &trusted) {
                Err(_) => {}
                Ok(Verdict::Unsigned) => panic!("byte {index} bit {bit}: taken for unsigned: {flipped}"),
                Ok(Verdict::Signed { .. }) => panic!("byte {index} bit {bit}: holds: {flipped}"),
            }
        }
    }
}

proptest! {
    #[test]
    fn any_text_can_be_signed_once(text in "\\PC*(\r?\n\\PC*){0,4}", number in 1_u8..9) {
        prop_assume!(find(&text) == Ok(None));
        let once = sign(&text, &key(number), Existing::Refuse).unwrap();
        prop_assert!(is_by(&once, number));
        prop_assert!(sign(&once, &key(9), Existing::Refuse).is_err());
        let again = sign(&once, &key(9), Existing::Replace).unwrap();
        prop_assert!(is_by(&again, 9));
        prop_assert_eq!(find(&once).unwrap().unwrap().covered(), find(&again).unwrap().unwrap().covered());
    }

    #[test]
    fn no_cut_or_pasted_piece_goes_unnoticed(from in 0_usize..160, to in 0_usize..160, paste in "\\PC{0,3}|\n") {
        let text = signed(TEXT);
        let (from, to) = (from.min(to), from.max(to));
        prop_assume!(to <= text.len() && text.is_char_boundary(from) && text.is_char_boundary(to));
        let changed = format!("{}{paste}{}", &text[..from], &text[to..]);
        // Nothing changed, or the line break that may be missing.
        prop_assume!(changed.trim_end_matches('\n') != text.trim_end_matches('\n') || changed.len() > text.len());
        let verdict = verify(&changed, &trusted(&[1]));
        let is_signed = matches!(verdict, Ok(Verdict::Signed { .. }));
        prop_assert!(!is_signed, "{changed}");
    }
}

#[test]
fn a_key_that_is_not_trusted_is_named_beside_those_that_are() {
    let many: Vec<u8> = (2..22).collect();
    let words =
        [&[][..], &[2], &many].map(|keys| verify(&signed(TEXT), &trusted(keys)).unwrap_err().to_string());
    insta::assert_snapshot!(words.join("\n"));
}

#[test]
fn a_signature_under_another_trusted_keys_name_does_not_hold() {
    let [one, two] = [1, 2].map(|number| key(number).public().id().to_string());
    insta::assert_snapshot!(verify(&signed(TEXT).replace(&one, &two), &trusted(&[1, 2])).unwrap_err());
}

#[test]
fn a_second_signature_line_is_refused() {
    let text = signed(TEXT);
    let line = text.lines().last().unwrap();
    let twice = [format!("{text}{line}\n"), format!("{line}\n{text}")];
    insta::assert_snapshot!(twice.map(|text| refused(&text)).join("\n"));
}

#[test]
fn nothing_may_be_put_behind_the_signature() {
    let text = signed(TEXT);
    let behind = ["drift = 1\n", "\n", "\n\n\n", " ", "\r\n", "# note"];
    insta::assert_snapshot!(behind.map(|more| refused(&format!("{text}{more}"))).join("\n"));
}

#[test]
fn converted_line_ends_are_called_so() {
    let text = signed(TEXT);
    let converted = text.replace('\n', "\r\n");
    let crlf = signed(&TEXT.replace('\n', "\r\n"));
    assert!(is_by(&crlf, 1), "a text that has CRLF when it is signed");
    let mixed = signed(&TEXT.replacen('\n', "\r\n", 1));
    let back = [crlf, mixed].map(|text| text.replace("\r\n", "\n"));
    // The last line's end is the first to get lost.
    let words = [&converted, converted.trim_end(), &back[0], &back[1]].map(refused);
    insta::assert_snapshot!(words.join("\n"));
}

#[test]
fn blanks_and_marks_that_programs_add_are_called_so() {
    let text = signed(TEXT);
    let changed =
        [format!("{}  \n", text.trim_end()), format!("\u{feff}{text}"), text.replace("= 1", "= 1 ")];
    insta::assert_snapshot!(changed.map(|text| refused(&text)).join("\n"));
}

#[test]
fn a_damaged_line_says_where_and_how() {
    let text = signed(TEXT);
    let bytes = text.split(' ').next_back().unwrap().trim_end();
    let id = key(1).public().id().to_string();
    let damaged = [
        text.replace("# iso", "#iso"),
        text.replace("isotherm-s", "Isotherm-S"),
        text.replace("isotherm-s", "isotherm-z"),
        text.replace(" ed25519 ", " ed448 "),
        text.replace(&id, &id.to_uppercase()),
        text.replace(&id, &id[1..]),
        text.replace(bytes, &bytes[4..]),
        text.replace(bytes, &bytes[..86]),
        text.replace(bytes, &format!("{bytes} x")),
        text.replace(bytes, ""),
    ];
    insta::assert_snapshot!(damaged.map(|text| refused(&text)).join("\n"));
}

#[test]
fn one_signature_has_one_form() {
    let text = signed(TEXT);
    // The last character before the padding carries two bits; the other four must be zero.
    let at = text.len() - "Q==\n".len();
    let others = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/".chars();
    let holding = others.filter(|c| {
        let changed = format!("{}{c}==\n", &text[..at]);
        is_by(&changed, 1)
    });
    assert_eq!(holding.count(), 1);
}

#[test]
fn a_signed_text_is_signed_anew_only_when_told() {
    let text = signed(TEXT);
    let error = sign(&text, &key(2), Existing::Refuse).unwrap_err();
    assert_eq!((error.line, error.wrong), (3, Wrong::Signed { key_id: key(1).public().id() }));
    let again = sign(&text, &key(2), Existing::Replace).unwrap();
    assert_eq!(again, sign(TEXT, &key(2), Existing::Refuse).unwrap());
    assert_eq!(sign(TEXT, &key(2), Existing::Replace).unwrap(), again, "nothing to replace");
    // What was appended to a signed document, or damaged its line, does not hinder a new signature.
    let appended = sign(&format!("{text}drift = 1\n"), &key(2), Existing::Replace).unwrap();
    assert_eq!(appended, sign(&format!("{TEXT}drift = 1\n"), &key(2), Existing::Refuse).unwrap());
    assert!(sign(&format!("{text}drift = 1\n"), &key(2), Existing::Refuse).is_err());
    assert!(is_by(&sign(&text.replace("# i", "#i"), &key(2), Existing::Replace).unwrap(), 2));
}

#[test]
fn the_longest_document_is_verified() {
    let text = signed(&"#\n".repeat(MAX_DOCUMENT_BYTES / 2 - 100));
    assert!(is_by(&text, 1));
    let error = verify(&text.replacen('#', "\n", 1), &trusted(&[1])).unwrap_err();
    assert!(matches!(error.wrong, Wrong::Changed { .. }), "{error}");
}

#[test]
fn an_error_becomes_a_problem_of_the_document() {
    let error = verify(&signed(TEXT), &TrustedKeys::default()).unwrap_err();
    let problem = error.problem(Some("a.toml"));
    assert_eq!((problem.line, problem.column, problem.key.as_str()), (3, 1, ""));
    assert_eq!(problem.to_string(), format!("a.toml:{error}"));
}

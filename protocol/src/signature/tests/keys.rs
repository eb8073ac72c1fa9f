//! Keys as text.

use super::*;

/// RFC 8410, section 10.1.
const RFC_PUBLIC: &str = "-----BEGIN PUBLIC KEY-----
MCowBQYDK2VwAyEAGb9ECWmEzf6FQbrBZ9w7lshQhqowtrbLDFw4rXAxZuE=
-----END PUBLIC KEY-----
";
/// RFC 8410, section 10.3.
const RFC_PRIVATE: &str = "-----BEGIN PRIVATE KEY-----
MC4CAQAwBQYDK2VwBCIEINTuctv5E1hK1bbY8fdp+K06/nwoy/HU++CXqI9EdVhC
-----END PRIVATE KEY-----
";
/// An elliptic-curve key (P-256).
const OTHER_ALGORITHM: &str = "-----BEGIN PUBLIC KEY-----
MFkwEwYHKoZIzj0CAQYIKoZIzj0DAQcDQgAEaxfR8uEsQkf4vOblY6RA8ncDfYEt
6zOg9KE5RdiYwpZP40Li/hp/m47n60p8D54WK84zV2sxXs7LtkBoN79R9Q==
-----END PUBLIC KEY-----
";

#[test]
fn the_keys_of_rfc_8410_are_read_and_written_alike() {
    let private = PrivateKey::from_pem(RFC_PRIVATE).unwrap();
    let public = PublicKey::from_pem(RFC_PUBLIC).unwrap();
    assert_eq!(private.public(), public);
    assert_eq!(private.to_pem().unwrap(), RFC_PRIVATE);
    assert_eq!(public.to_pem().unwrap(), RFC_PUBLIC);
}

#[test]
fn a_private_key_with_its_public_half_is_read() {
    let pair = KeypairBytes::from(&SigningKey::from_bytes(&[1; 32])).to_pkcs8_pem(LineEnding::LF).unwrap();
    assert_eq!(PrivateKey::from_pem(&pair).unwrap().public(), key(1).public());
    // And refused where the halves do not belong together.
    let wrong = KeypairBytes {
        secret_key: [1; 32],
        public_key: KeypairBytes::from(&SigningKey::from_bytes(&[2; 32])).public_key,
    };
    let wrong = wrong.to_pkcs8_pem(LineEnding::LF).unwrap();
    assert!(matches!(PrivateKey::from_pem(&wrong), Err(KeyError::Damaged)));
}

#[test]
fn a_key_is_read_with_crlf_and_with_words_around_it() {
    let expected = PublicKey::from_pem(RFC_PUBLIC).unwrap();
    for text in
        [RFC_PUBLIC.replace('\n', "\r\n"), format!("bench 2\n{RFC_PUBLIC}"), format!("\n\n{RFC_PUBLIC}\n \n")]
    {
        assert_eq!(PublicKey::from_pem(&text), Ok(expected.clone()), "{text:?}");
    }
}

#[test]
fn what_is_no_key_says_what_it_is() {
    let public = |text: &str| PublicKey::from_pem(text).unwrap_err().to_string();
    let private = |text: &str| PrivateKey::from_pem(text).unwrap_err().to_string();
    let words = [
        public(""),
        public("ssh-ed25519 AAAA bench"),
        public(&"-".repeat(99)),
        public("-----BEGIN"),
        public(RFC_PRIVATE),
        private(RFC_PUBLIC),
        private(&RFC_PRIVATE.replace("PRIVATE", "ENCRYPTED PRIVATE")),
        private("-----BEGIN OPENSSH PRIVATE KEY-----\n"),
        public(&RFC_PUBLIC.repeat(2)),
        public(OTHER_ALGORITHM),
        private(&OTHER_ALGORITHM.replace("PUBLIC", "PRIVATE")),
    ];
    insta::assert_snapshot!(words.join("\n"));
}

#[test]
fn garbage_in_a_block_is_refused() {
    for (from, to) in [
        ("MCow", ""),
        ("MCow", "!!!!"),
        ("MCow", "MCoww"),
        ("uE=", "u"),
        ("uE=\n-----END PUBLIC KEY-----", "uE="),
        ("-----END PUBLIC", "-----END PRIVATE"),
        ("ZuE=", "ZuE=\n\n"),
    ] {
        let text = RFC_PUBLIC.replace(from, to);
        assert!(matches!(PublicKey::from_pem(&text), Err(KeyError::Damaged)), "{text}");
    }
    // Half of the y-coordinates belong to no point of the curve.
    let no_point = (0..=255_u8).map(|byte| [byte; 32]).find(|bytes| VerifyingKey::from_bytes(bytes).is_err());
    let pem = spki_of(no_point.unwrap());
    assert!(matches!(PublicKey::from_pem(&pem), Err(KeyError::Damaged)));
}

#[test]
fn a_weak_public_key_is_refused() {
    // The neutral element: with it, a signature of nothing would hold for everything.
    let mut neutral = [0; 32];
    neutral[0] = 1;
    assert_eq!(PublicKey::from_pem(&spki_of(neutral)), Err(KeyError::Weak));
}

fn spki_of(bytes: [u8; 32]) -> String {
    ed25519_dalek::pkcs8::PublicKeyBytes(bytes).to_public_key_pem(LineEnding::LF).unwrap()
}

#[test]
fn a_key_is_called_by_the_head_of_its_fingerprint() {
    let public = PublicKey::from_pem(RFC_PUBLIC).unwrap();
    // openssl pkey -pubin -outform DER | tail -c 32 | sha256sum
    assert_eq!(public.fingerprint(), RFC_FINGERPRINT);
    assert_eq!(public.id().to_string(), RFC_FINGERPRINT[..16]);
    assert_eq!(RFC_FINGERPRINT[..16].parse(), Ok(public.id()));
    for wrong in
        ["", "0123456789abcde", "0123456789ABCDEF", "0123456789abcdef0", "+123456789abcdef", "éééééééé"]
    {
        assert_eq!(wrong.parse::<KeyId>(), Err(()), "{wrong}");
    }
    assert_eq!(serde_json::to_string(&public.id()).unwrap(), format!("\"{}\"", &RFC_FINGERPRINT[..16]));
}

const RFC_FINGERPRINT: &str = "e744c0791320c3285460eddb523f14c88d857ada46b97a5690d88cf978b9191f";

#[test]
fn a_private_key_does_not_show_itself() {
    let private = PrivateKey::from_pem(RFC_PRIVATE).unwrap();
    assert_eq!(format!("{private:?}"), format!("PrivateKey({})", private.public().id()));
}

#[test]
fn a_key_is_trusted_under_one_name() {
    let mut trusted = trusted(&[1, 2]);
    assert_eq!((trusted.len(), trusted.is_empty()), (2, false));
    let again = trusted.insert("somebody", key(2).public()).unwrap_err();
    assert_eq!(again, RivalKey::SameKey { key_id: key(2).public().id(), other: "signer-2".to_owned() });
    assert_eq!(trusted.len(), 2);
    assert_eq!(trusted.get(key(1).public().id()), Some(("signer-1", &key(1).public())));
    assert_eq!(trusted.get(key(3).public().id()), None);
}

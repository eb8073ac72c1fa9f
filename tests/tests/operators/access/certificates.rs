//! Certificates of a bench: an authority, the service's certificate, and one for each client.

use std::path::{Path, PathBuf};

use isotherm_bus::{SessionOptions, open};
use rcgen::{BasicConstraints, CertificateParams, DnType, IsCa, Issuer, KeyPair, KeyUsagePurpose};
use zenoh::Session;

/// Who signs certificates, and the folder that they are in, named as the shipped configuration has it.
pub(super) struct Authority {
    issuer: Issuer<'static, KeyPair>,
    folder: PathBuf,
}

/// Parameters of a certificate with this common name, good on loopback.
fn named(name: &str) -> CertificateParams {
    let mut params = CertificateParams::new(["127.0.0.1".to_owned()]).unwrap();
    params.distinguished_name.push(DnType::CommonName, name);
    params
}

impl Authority {
    /// Makes one in `folder/certificates`.
    pub(super) fn new(folder: &Path) -> Self {
        let folder = folder.join("certificates");
        std::fs::create_dir_all(&folder).unwrap();
        let mut params = named("bench CA");
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign];
        let key = KeyPair::generate().unwrap();
        std::fs::write(folder.join("ca.pem"), params.self_signed(&key).unwrap().pem()).unwrap();
        Self { issuer: Issuer::new(params, key), folder }
    }

    /// Makes a key and a certificate with this common name.
    pub(super) fn make(&self, name: &str) {
        let key = KeyPair::generate().unwrap();
        let certificate = named(name).signed_by(&key, &self.issuer).unwrap();
        std::fs::write(self.folder.join(format!("{name}.pem")), certificate.pem()).unwrap();
        std::fs::write(self.folder.join(format!("{name}.key")), key.serialize_pem()).unwrap();
    }

    /// Writes the configuration of a client, as `docs/operations.md` shows it; `None` for one that shows no certificate.
    pub(super) fn client(&self, name: Option<&str>, locator: &str) -> PathBuf {
        let file = |name: &str| self.folder.join(name).display().to_string();
        let mut tls = serde_json::json!({ "root_ca_certificate": file("ca.pem") });
        if let Some(name) = name {
            tls["enable_mtls"] = true.into();
            tls["connect_private_key"] = file(&format!("{name}.key")).into();
            tls["connect_certificate"] = file(&format!("{name}.pem")).into();
        }
        let config = serde_json::json!({
            "mode": "client",
            "connect": { "endpoints": [locator] },
            "scouting": { "multicast": { "enabled": false } },
            "transport": { "link": { "tls": tls } },
        });
        let path = self.folder.join(format!("{}.json5", name.unwrap_or("nobody")));
        std::fs::write(&path, config.to_string()).unwrap();
        path
    }

    /// A session of a client with this certificate.
    pub(super) async fn session(&self, name: &str, locator: &str) -> Session {
        let config = Some(self.client(Some(name), locator));
        open(&SessionOptions { config, ..SessionOptions::default() }).await.unwrap()
    }
}

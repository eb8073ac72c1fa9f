//! Who a session is by its certificate.

use x509_parser::pem::Pem;
use zenoh::Config;

/// Key of the file with the certificate that a session shows where it connects.
const CERTIFICATE: &str = "transport/link/tls/connect_certificate";
/// What stands above a certificate in that file.
const LABEL: &str = "CERTIFICATE";

/// Common name of the certificate that a session shows where it connects; `None` where there is none, or none that can be read.
pub(crate) fn common_name(config: &Config) -> Option<String> {
    let file: String = serde_json::from_str(&config.get_json(CERTIFICATE).ok()?).ok()?;
    let text = std::fs::read(file).ok()?;
    // The first: those behind it signed it.
    let pem = Pem::iter_from_buffer(&text).filter_map(Result::ok).find(|pem| pem.label == LABEL)?;
    let certificate = pem.parse_x509().ok()?;
    let name = certificate.subject().iter_common_name().next()?;
    name.as_str().ok().map(ToOwned::to_owned)
}

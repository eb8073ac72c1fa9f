//! The token that the console asks for, its file, and the command that prints it.

use std::fs;
use std::io::{self, ErrorKind};
use std::net::SocketAddr;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use clap::Args;
use isotherm_cli::{Exit, print, say};
use isotherm_protocol::digest::Digest;

use crate::ServiceError;
use crate::config::Settings;
use isotherm_document::file::{check_regular, create, read_bounded};

/// Its name in the state folder.
const FILE: &str = "web-token";
/// Random bytes of a token.
const BYTES: usize = 32;
/// Lengths that are taken (characters): one chosen by hand must not be guessed.
const LENGTHS: std::ops::RangeInclusive<usize> = 32..=256;

/// Arguments of `web`.
#[derive(Debug, Clone, Args)]
#[command(after_help = "\
Examples:
  isotherm web --config /etc/isotherm/service.toml
  isotherm web --state state --metrics 127.0.0.1:9464

Prints the address to open in a browser. The part after the # is the token: anyone who has it sees the console.")]
pub struct WebArgs {
    /// Service configuration (TOML)
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// State folder of the service (default: as configured)
    #[arg(long, value_name = "FOLDER")]
    pub state: Option<PathBuf>,
    /// Address of the console, as `serve --metrics` has it (default: as configured)
    #[arg(long, value_name = "HOST:PORT")]
    pub metrics: Option<SocketAddr>,
    /// Print JSON on stdout
    #[arg(long)]
    pub json: bool,
}

/// Prints where the console is.
#[must_use]
pub fn show(args: &WebArgs) -> Exit {
    match address(args) {
        Ok((url, token)) => {
            let text = if args.json {
                serde_json::json!({ "url": url, "token": token }).to_string()
            } else {
                format!("{url}#token={token}")
            };
            print(&(text + "\n"), Exit::Ok)
        }
        Err(error) => error.tell(),
    }
}

fn address(args: &WebArgs) -> Result<(String, String), ServiceError> {
    let mut settings = Settings::given(args.config.as_deref(), None, args.state.as_ref(), args.metrics)?;
    settings.web.enabled = true;
    settings.listen_for_web();
    let Some(file) = file(&settings) else {
        let words = "give --config or --state of the service; one that has neither a state folder nor [web] token_file writes \
                     its token to its log";
        return Err(ServiceError::Token {
            path: FILE.into(),
            source: io::Error::new(ErrorKind::InvalidData, words),
        });
    };
    let token = read(&file).map_err(|source| ServiceError::Token { path: file, source })?;
    if args.config.is_none() && args.metrics.is_none() {
        say("without --config or --metrics, the console's usual address is assumed");
    }
    let listen = settings.metrics.listen.map(reached).unwrap_or_default();
    Ok((format!("http://{listen}/"), token))
}

/// The address under which a browser on this machine reaches a listener.
fn reached(listen: SocketAddr) -> String {
    match (listen.port(), listen.ip().is_unspecified()) {
        // Which one the system has chosen, the service's line of --announce tells.
        (0, _) => format!("{}:PORT", listen.ip()),
        (port, true) => format!("127.0.0.1:{port}"),
        _ => listen.to_string(),
    }
}

/// The token of a service: that of its file, which is made where there is none.
///
/// # Errors
/// [`ServiceError::Token`].
pub(super) fn of_service(settings: &Settings) -> Result<String, ServiceError> {
    let Some(file) = file(settings) else {
        let token = made().map_err(|source| ServiceError::Token { path: FILE.into(), source })?;
        tracing::info!(
            "console in the browser, until the service ends: open /#token={token} at the address of the metrics"
        );
        return Ok(token);
    };
    let refused = |source| ServiceError::Token { path: file.clone(), source };
    if !file.try_exists().map_err(refused)? {
        let token = made().map_err(refused)?;
        if let Err(error) = create(&file, format!("{token}\n").as_bytes(), 0o600) {
            tracing::error!(
                "the token of the console cannot be written to {}: {error}; until the service ends: open /#token={token} at \
                 the address of the metrics",
                file.display()
            );
            return Ok(token);
        }
    }
    let token = read(&file).map_err(refused)?;
    let others = fs::metadata(&file).map_err(refused)?.permissions().mode() & 0o077;
    if others != 0 {
        tracing::warn!("others can read the token of the console: chmod 600 {}", file.display());
    }
    tracing::info!(
        "console in the browser at the address of the metrics; its token is in {}",
        file.display()
    );
    Ok(token)
}

/// Where the token is kept.
fn file(settings: &Settings) -> Option<PathBuf> {
    settings.web.token_file.clone().or_else(|| Some(settings.state.as_deref()?.join(FILE)))
}

/// A new token.
fn made() -> io::Result<String> {
    let mut bytes = [0; BYTES];
    getrandom::fill(&mut bytes).map_err(io::Error::other)?;
    Ok(Digest(bytes).to_string())
}

fn read(file: &Path) -> io::Result<String> {
    check_regular(file)?;
    let bytes = read_bounded(file)?;
    let token = String::from_utf8_lossy(&bytes).trim().to_owned();
    if LENGTHS.contains(&token.len())
        && token.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-_".contains(&byte))
    {
        return Ok(token);
    }
    let words = format!(
        "its {} characters are no token, which is {} to {} letters, digits, - or _; remove the file, and the service \
         makes a new one",
        token.chars().count(),
        LENGTHS.start(),
        LENGTHS.end()
    );
    Err(io::Error::new(ErrorKind::InvalidData, words))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(folder: &Path) -> Settings {
        Settings { state: Some(folder.to_owned()), ..Settings::default() }
    }

    #[test]
    fn a_token_is_made_once_for_its_owner_alone_and_printed_by_the_command() {
        let folder = tempfile::tempdir().unwrap();
        let token = of_service(&settings(folder.path())).unwrap();
        assert_eq!(token.len(), 64);
        let file = folder.path().join(FILE);
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
        assert_eq!(of_service(&settings(folder.path())).unwrap(), token, "it outlives a restart");
        let args =
            WebArgs { config: None, state: Some(folder.path().to_owned()), metrics: None, json: false };
        assert_eq!(address(&args).unwrap(), ("http://127.0.0.1:9464/".to_owned(), token));
    }

    #[test]
    fn a_file_that_holds_no_token_is_refused_and_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(FILE);
        for text in ["", "short\n", &"x y".repeat(20), &"x".repeat(300)] {
            fs::write(&file, text).unwrap();
            let error = of_service(&settings(folder.path())).unwrap_err();
            assert!(
                error.to_string().contains("web-token") && error.exit() == Exit::BadConfiguration,
                "{error}"
            );
            assert_eq!(fs::read_to_string(&file).unwrap(), text);
        }
        fs::write(&file, format!("  {}\n", "a-B_9".repeat(8))).unwrap();
        assert_eq!(of_service(&settings(folder.path())).unwrap(), "a-B_9".repeat(8));
    }

    #[test]
    fn where_nothing_is_kept_each_start_has_a_token_of_its_own() {
        let made = || of_service(&Settings::default()).unwrap();
        assert_ne!(made(), made());
        let args = WebArgs { config: None, state: None, metrics: None, json: false };
        assert!(address(&args).unwrap_err().to_string().contains("log"));
    }

    #[test]
    fn the_address_is_one_that_a_browser_can_open() {
        let of = |address: &str| reached(address.parse().unwrap());
        assert_eq!(of("0.0.0.0:9464"), "127.0.0.1:9464");
        assert_eq!((of("[::1]:80"), of("127.0.0.1:0")), ("[::1]:80".to_owned(), "127.0.0.1:PORT".to_owned()));
    }
}

//! The one way from a program to a service: what is said on the command line, else in the environment, else in the user's file,
//! else where a service listens by default.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use isotherm_document::{Form, Reader, element, file::text};
use schemars::JsonSchema;
use serde::Deserialize;
use zenoh::{Config, Session};

use crate::certificate::common_name;
use crate::endpoint::{DEFAULT_ENDPOINT, endpoint};
use crate::error::seconds;
use crate::session::{close, connected_to, endpoints, keep_trying, set};
use crate::{BoxFuture, BusError, SessionOptions, obstacle};

/// Environment variable that says where the service is: one endpoint, or several separated by commas.
pub const CONNECT_VARIABLE: &str = "ISOTHERM_CONNECT";

/// How long to wait before a session is opened again.
const AGAIN: Duration = Duration::from_millis(250);
/// How long an endpoint may take before it is looked whether something listens there at all.
const AT_ONCE: Duration = Duration::from_millis(100);
/// How long the other endpoints of several may take once one has answered.
const OTHERS: Duration = Duration::from_millis(500);
/// How long closing a session may take that nobody has answered.
const CLOSING: Duration = Duration::from_secs(1);

/// How to reach a service.
///
/// Where none of endpoint, listener and Zenoh configuration is given, [`CONNECT_VARIABLE`] says where the service is, else
/// [`user_file`], else it is at [`DEFAULT_ENDPOINT`].
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct ClientOptions {
    /// Address of the service or a router, repeatable (default: `ISOTHERM_CONNECT`, else `connect` of
    /// ~/.config/isotherm/client.toml, else 127.0.0.1:7447)
    #[cfg_attr(feature = "clap", arg(long, value_name = "HOST:PORT", value_parser = endpoint))]
    pub connect: Vec<String>,
    /// Address to listen on, repeatable
    #[cfg_attr(feature = "clap", arg(long, value_name = "HOST:PORT", value_parser = endpoint, hide_short_help = true))]
    pub listen: Vec<String>,
    /// Zenoh configuration (JSON5)
    #[cfg_attr(feature = "clap", arg(long, value_name = "FILE", hide_short_help = true))]
    pub zenoh_config: Option<PathBuf>,
    /// Zenoh namespace, a prefix of every key, e.g. site/a
    #[cfg_attr(feature = "clap", arg(long, value_name = "PREFIX", hide_short_help = true))]
    pub namespace: Option<String>,
}

/// How a client takes part in the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// It exchanges messages with those that it is connected to.
    Peer,
    /// It hears everything through the service or router that it is connected to. This needs exactly one endpoint; with others, with
    /// a listener or with a Zenoh configuration it is a [`Role::Peer`].
    Listener,
}

/// A way to reach a service, made from all that was said of it.
#[derive(Debug, Clone)]
pub struct Way {
    config: Config,
    /// Who says where it leads: the variable, or the user's file.
    said_by: Option<String>,
    name: Option<String>,
    /// Endpoints of which one is enough, as of a pair: the others are tried again meanwhile.
    any_of: Vec<String>,
}

/// What the options, the variable and the user's file say together, and who says where the service is, if it is neither the command line
/// nor the default.
type Stated = (SessionOptions, Option<String>);

/// What the file of a user may say.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
struct UserKeys {
    /// Endpoints of the service.
    connect: Vec<String>,
    /// A Zenoh configuration file; relative paths count from this file.
    #[schemars(length(min = 1))]
    zenoh_config: Option<String>,
    /// Prefix of every key.
    #[schemars(length(min = 1))]
    namespace: Option<String>,
}

static FORM: LazyLock<Form> = LazyLock::new(Form::of::<UserKeys>);

/// The user's file: `isotherm/client.toml` in `$XDG_CONFIG_HOME` or `~/.config`.
#[must_use]
pub fn user_file() -> Option<PathBuf> {
    let folder = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let folder = folder("XDG_CONFIG_HOME").or_else(|| Some(folder("HOME")?.join(".config")))?;
    Some(folder.join("isotherm/client.toml"))
}

impl ClientOptions {
    /// The way to the service.
    ///
    /// # Errors
    /// [`BusError::Endpoint`], [`BusError::UserFile`], [`BusError::Configuration`] and [`BusError::Option`].
    pub fn way(&self, role: Role) -> Result<Way, BusError> {
        let (mut options, said_by) = self.stated()?;
        if !says_where(&options) {
            options.connect = vec![DEFAULT_ENDPOINT.to_owned()];
        }
        Way::by((options, said_by), role)
    }

    /// The way for who needs no service: where nothing says where to connect, it is a peer on its own.
    ///
    /// # Errors
    /// As [`Self::way`].
    pub fn way_if_stated(&self, role: Role) -> Result<Way, BusError> {
        Way::by(self.stated()?, role)
    }

    fn stated(&self) -> Result<Stated, BusError> {
        self.resolved(std::env::var(CONNECT_VARIABLE).ok().as_deref(), user_file().as_deref())
    }

    fn resolved(&self, variable: Option<&str>, file: Option<&Path>) -> Result<Stated, BusError> {
        let mut options = SessionOptions {
            config: self.zenoh_config.clone(),
            connect: self.connect.clone(),
            listen: self.listen.clone(),
            namespace: self.namespace.clone(),
            lease: None,
            keeps_trying: false,
        };
        let mut said_by = None;
        let user = file.map_or(Ok(UserKeys::default()), read_user_file)?;
        let mut of_file = SessionOptions::default();
        if options.namespace.is_none() {
            options.namespace.clone_from(&user.namespace);
            of_file.namespace = user.namespace;
        }
        if !says_where(&options) {
            let endpoints = variable.unwrap_or_default().split(',').map(str::trim);
            for text in endpoints.filter(|text| !text.is_empty()) {
                let read = endpoint(text).map_err(|reason| BusError::Endpoint {
                    option: CONNECT_VARIABLE,
                    value: text.to_owned(),
                    reason,
                });
                options.connect.push(read?);
                said_by = Some(CONNECT_VARIABLE.to_owned());
            }
        }
        if let Some(file) = file
            && !says_where(&options)
        {
            options.connect = user.connect;
            options.config = user.zenoh_config.map(|path| file.parent().unwrap_or(Path::new("")).join(path));
            of_file.config.clone_from(&options.config);
            said_by = says_where(&options).then(|| file.display().to_string());
        }
        match (of_file.to_config(), file) {
            (Err(error), Some(file)) => Err(BusError::UserFile(vec![format!("{}: {error}", file.display())])),
            _ => Ok((options, said_by)),
        }
    }
}

/// Whether options say where the service is.
fn says_where(options: &SessionOptions) -> bool {
    options.config.is_some() || !options.connect.is_empty() || !options.listen.is_empty()
}

impl Way {
    fn by((options, said_by): Stated, role: Role) -> Result<Self, BusError> {
        let mut config = options.to_config()?;
        if role == Role::Listener
            && options.config.is_none()
            && options.connect.len() == 1
            && options.listen.is_empty()
        {
            as_client(&mut config)?;
        }
        let mut any_of = Vec::new();
        match options.connect.len() {
            0 => {}
            _ if options.config.is_some() => {}
            1 => once(&mut config)?,
            _ => {
                keep_trying(&mut config)?;
                any_of = endpoints(&config, "connect/endpoints");
            }
        }
        let name = common_name(&config);
        Ok(Self { config, said_by, name, any_of })
    }

    /// The way to one endpoint, as a client, with all else that a session's options say.
    ///
    /// # Errors
    /// As [`SessionOptions::to_config`].
    pub fn to(options: &SessionOptions, endpoint: &str) -> Result<Self, BusError> {
        let options =
            SessionOptions { connect: vec![endpoint.to_owned()], listen: Vec::new(), ..options.clone() };
        let mut config = options.to_config()?;
        as_client(&mut config)?;
        once(&mut config)?;
        Ok(Self { config, said_by: None, name: None, any_of: Vec::new() })
    }

    /// Endpoints at which the service is looked for, and who says so, in words.
    #[must_use]
    pub fn tried(&self) -> String {
        let tried = match endpoints(&self.config, "connect/endpoints") {
            tried if tried.is_empty() => endpoints(&self.config, "listen/endpoints"),
            tried => tried,
        };
        tried.join(", ") + &from(self.said_by.as_deref())
    }

    /// Common name of the certificate that is shown there; `None` without one.
    #[must_use]
    pub fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    /// Opens a session within the limit, again and again where nothing listens yet; what is waited for is said once.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub async fn open_patiently(&self, limit: Duration, say: impl Fn(&str)) -> Result<Session, BusError> {
        let deadline = Instant::now() + limit;
        let mut said = false;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            match self.open(left).await {
                Err(error @ BusError::Unreachable { .. }) if Instant::now() + AGAIN < deadline => {
                    if !std::mem::replace(&mut said, true) {
                        say(&format!("{error}; trying again for {}", seconds(limit)));
                    }
                    // Zenoh warns of every trial: there is none before something listens.
                    tokio::time::sleep(AGAIN).await;
                    while Instant::now() + AGAIN < deadline && !self.listens().await {
                        tokio::time::sleep(AGAIN).await;
                    }
                }
                opened => return opened,
            }
        }
    }

    /// Whether anything listens at one of its endpoints, or there are none.
    pub async fn listens(&self) -> bool {
        let endpoints = endpoints(&self.config, "connect/endpoints");
        let listens = tokio::task::spawn_blocking(move || {
            endpoints.is_empty() || endpoints.iter().any(|it| obstacle::listens(it))
        });
        listens.await.unwrap_or(true)
    }

    /// Whether one of several endpoints answers within the limit; the others get a moment to answer too.
    async fn is_connected(&self, session: &Session, limit: Duration) -> bool {
        let all = &self.any_of;
        if all.is_empty() {
            return true;
        }
        let mut count = connected_to(session, all, 1, limit.min(AT_ONCE)).await;
        if count == 0 {
            if !self.listens().await {
                return false;
            }
            count = connected_to(session, all, 1, limit).await;
        }
        count == all.len() || (count > 0 && connected_to(session, all, all.len(), OTHERS).await > 0)
    }

    /// Opens a session within the limit.
    ///
    /// # Errors
    /// [`BusError::Unreachable`] with what to do next, [`BusError::Listen`], or [`BusError::Open`] where the cause is not known.
    #[must_use]
    pub fn open(&self, limit: Duration) -> BoxFuture<'_, Result<Session, BusError>> {
        Box::pin(async move {
            obstacle::before(&self.config)?;
            let (config, started) = (self.config.clone(), Instant::now());
            // A task of its own: opening may hold its thread, and a timeout on the same one would not be heard.
            let opening = tokio::spawn(async move { zenoh::open(config).await });
            let source = match tokio::time::timeout(limit, opening).await {
                Ok(Ok(Ok(session))) => {
                    if self.is_connected(&session, limit.saturating_sub(started.elapsed())).await {
                        return Ok(session);
                    }
                    // Why nobody answers is what counts.
                    let _ = close(session, CLOSING).await;
                    not_connected(limit)
                }
                Ok(Ok(Err(source))) => source,
                Ok(Err(join)) => join.into(),
                Err(_) => not_connected(limit),
            };
            Err(obstacle::found(source, self.config.clone(), limit, self.said_by.clone()).await)
        })
    }
}

/// Makes a client of a peer.
fn as_client(config: &mut Config) -> Result<(), BusError> {
    set(config, "mode", "client")?;
    set(config, "listen/endpoints", Vec::<String>::new())
}

/// Has what does not answer reported at once, not after many trials.
fn once(config: &mut Config) -> Result<(), BusError> {
    set(config, "connect/timeout_ms", 0)
}

/// Nothing has answered.
fn not_connected(limit: Duration) -> zenoh::Error {
    format!("not connected within {}", seconds(limit)).into()
}

/// The words behind an endpoint that name who says it.
pub(crate) fn from(said_by: Option<&str>) -> String {
    said_by.map_or_else(String::new, |source| format!(" (from {source})"))
}

/// Reads the user's file; one that is not there says nothing.
fn read_user_file(path: &Path) -> Result<UserKeys, BusError> {
    let bad = |problems: &[isotherm_document::Problem]| {
        BusError::UserFile(problems.iter().map(ToString::to_string).collect())
    };
    let file = path.display().to_string();
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        // No folder on the way to it, either.
        Err(error)
            if matches!(error.kind(), std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory) =>
        {
            return Ok(UserKeys::default());
        }
        Err(error) => return Err(BusError::UserFile(vec![format!("{file}: cannot be read: {error}")])),
    };
    let text = text(&bytes, Some(&file)).map_err(|problems| bad(&problems))?;
    let mut reader = Reader::new(text, Some(&file));
    let mut keys: Option<UserKeys> = reader.read(&FORM);
    for (index, text) in keys.iter_mut().flat_map(|keys| &mut keys.connect).enumerate() {
        match endpoint(text) {
            Ok(read) => *text = read,
            Err(reason) => reader.report(&element("connect", index), format!("is {text:?}, {reason}")),
        }
    }
    reader.finish(keys).map_err(|problems| bad(&problems))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn connect(options: &ClientOptions, variable: Option<&str>, file: Option<&Path>) -> Vec<String> {
        options.resolved(variable, file).unwrap().0.connect
    }

    #[test]
    fn options_come_before_the_variable_before_the_file_before_the_default() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("client.toml");
        std::fs::write(&file, "connect = [\"c:3\"]\nnamespace = \"site/c\"\n").unwrap();
        let nothing = ClientOptions::default();
        let given = ClientOptions { connect: vec!["tcp/a:1".to_owned()], ..nothing.clone() };
        assert_eq!(connect(&given, Some("b:2"), Some(&file)), ["tcp/a:1"]);
        assert_eq!(connect(&nothing, Some("b:2, tls/d:4"), Some(&file)), ["tcp/b:2", "tls/d:4"]);
        assert_eq!(connect(&nothing, Some(""), Some(&file)), ["tcp/c:3"]);
        assert_eq!(connect(&nothing, None, Some(&folder.path().join("none/x"))), Vec::<String>::new());
        let tried = |way: Result<Way, BusError>| way.unwrap().tried();
        assert_eq!(tried(given.way(Role::Peer)), "tcp/a:1");
        assert_eq!(tried(given.way_if_stated(Role::Listener)), "tcp/a:1");
        let way = |variable, file| tried(Way::by(nothing.resolved(variable, file).unwrap(), Role::Peer));
        assert_eq!(way(Some("b:2,d:4"), Some(&*file)), "tcp/b:2, tcp/d:4 (from ISOTHERM_CONNECT)");
        assert_eq!(way(None, Some(&*file)), format!("tcp/c:3 (from {})", file.display()));
        let listens = ClientOptions { listen: vec!["tcp/a:1".to_owned()], ..nothing.clone() };
        assert_eq!(connect(&listens, Some("b:2"), Some(&file)), Vec::<String>::new());
        // The site does not depend on who says where the service is.
        let (options, _) = given.resolved(None, Some(&file)).unwrap();
        assert_eq!(options.namespace.as_deref(), Some("site/c"));
    }

    #[test]
    fn what_is_wrong_in_variable_and_file_is_said_with_its_place() {
        let nothing = ClientOptions::default();
        let mut told = vec![nothing.resolved(Some("a:1,nonsense"), None).unwrap_err().to_string()];
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("client.toml");
        for text in [
            "connect = [\"a:1\", \"a:70000\"]\nnamespaces = \"x\"\n",
            "namespace = \"a//b\"\n",
            "zenoh_config = \"none.json5\"\n",
        ] {
            std::fs::write(&file, text).unwrap();
            let error = nothing.resolved(None, Some(&file)).unwrap_err();
            assert!(error.is_configuration(), "{error}");
            told.push(error.to_string());
        }
        insta::assert_snapshot!(told.join("\n").replace(folder.path().to_str().unwrap(), "FOLDER"));
    }
}

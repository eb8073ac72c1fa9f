//! Two services for one stream, in processes of their own.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use isotherm_bus::inquiry::pair_reports;
use isotherm_bus::{SessionOptions, open};
use isotherm_protocol::pair::{PairReport, Role};
use zenoh::Session;

use crate::bench::LIMIT;
use crate::process::Service;
use crate::proxy::{Fault, Proxy, Switch};

/// Names of the two.
pub const NAMES: [&str; 2] = ["first", "second"];

/// The two instances; each is started anew at its own address.
#[derive(Debug)]
pub struct Pair {
    folder: PathBuf,
    /// `None` where it is dead.
    pub services: [Option<Service>; 2],
    addresses: [String; 2],
    extra: String,
    /// In front of the first, for the second alone, and in front of the second for everybody else.
    proxies: [Proxy; 2],
    switch: Switch,
}

impl Pair {
    /// Starts both, the second a standby; `extra` stands in both configurations.
    ///
    /// # Panics
    /// Where one does not start.
    #[must_use]
    pub fn start(folder: &Path, documents: &[(String, String)], extra: &str) -> Self {
        std::fs::create_dir_all(folder.join("documents")).expect("a folder");
        for (unit, text) in documents {
            std::fs::write(folder.join("documents").join(format!("{unit}.toml")), text).expect("written");
        }
        let free = || {
            let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
            format!("tcp/{}", listener.local_addr().expect("an address"))
        };
        let (addresses, switch) = ([free(), free()], Switch::default());
        let proxies = [0, 1].map(|index: usize| Proxy::start(&addresses[index], &switch));
        let (folder, extra) = (folder.to_owned(), extra.to_owned());
        let mut pair = Self { folder, services: [None, None], addresses, extra, proxies, switch };
        pair.restart(0);
        pair.restart(1);
        pair
    }

    /// Folder of an instance's state.
    #[must_use]
    pub fn state(&self, index: usize) -> PathBuf {
        self.folder.join(format!("state-{index}"))
    }

    /// Starts an instance that is dead.
    ///
    /// # Panics
    /// Where it does not start.
    pub fn restart(&mut self, index: usize) {
        let (own, other) = (&self.addresses[index], &self.proxies[1 - index].endpoint);
        let file = self.folder.join(format!("service-{index}.toml"));
        let zenoh = self.folder.join(format!("peer-{index}.json5"));
        // The second connects to the first.
        let connect = if index == 1 { format!("'{other}'") } else { String::new() };
        let other = if index == 1 { String::new() } else { format!("\nother = \"{other}\"") };
        let config = format!(
            "{{mode: 'peer', listen: {{endpoints: ['{own}']}}, connect: {{endpoints: [{connect}], timeout_ms: -1, \
             exit_on_failure: false}}, scouting: {{multicast: {{enabled: false}}, gossip: {{enabled: false}}}}, transport: \
             {{link: {{tx: {{queue: {{batching: {{time_limit: 0}}, size: {{real_time: 16}}}}}}}}}}}}"
        );
        std::fs::write(&zenoh, config).expect("written");
        let named = format!("[pair]\nlease_ms = 500\nname = \"{}\"{other}", NAMES[index]);
        let extra = self.extra.replace("[pair]", &named);
        let text = format!(
            "calibrations = \"documents\"\nstate = \"state-{index}\"\n{extra}\n[zenoh]\nconfig = \"peer-{index}.json5\"\n"
        );
        std::fs::write(&file, text).expect("written");
        let level = std::env::var("ISOTHERM_PAIR_LOG").unwrap_or_else(|_| "error".to_owned());
        let file = file.to_str().expect("a path");
        self.services[index] = Some(Service::start_as_configured(&["--log-level", &level, "--config", file]));
    }

    /// Ends an instance as a crash would.
    pub fn kill(&mut self, index: usize) {
        drop(self.services[index].take());
    }

    /// Sends a signal to an instance that is alive.
    ///
    /// # Panics
    /// Where it is not.
    pub fn signal(&self, index: usize, signal: &str) {
        self.services[index].as_ref().expect("it is alive").signal(signal);
    }

    /// Does something to all connections of the second instance.
    pub fn trouble(&self, fault: Fault) {
        self.switch.set(fault);
    }

    /// Where both are for everybody else.
    #[must_use]
    pub fn endpoints(&self) -> [String; 2] {
        [self.addresses[0].clone(), self.proxies[1].endpoint.clone()]
    }

    /// A session that is connected to both.
    ///
    /// # Panics
    /// Where it cannot be opened.
    pub async fn session(&self) -> Session {
        self.session_with(None).await
    }

    /// The same with a lease of its own.
    ///
    /// # Panics
    /// Where it cannot be opened.
    pub async fn session_with(&self, lease: Option<Duration>) -> Session {
        let connect = self.endpoints().into();
        let session =
            open(&SessionOptions { connect, lease, ..SessionOptions::default() }).await.expect("a session");
        let deadline = Instant::now() + LIMIT;
        while session.info().peers_zid().await.count() < 2 {
            assert!(Instant::now() < deadline, "connected to both");
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        session
    }
}

/// What every instance that answers says of itself.
///
/// # Panics
/// Where the question cannot be asked.
pub async fn reports(session: &Session) -> Vec<PairReport> {
    pair_reports(session, Duration::from_secs(1)).await.expect("asked")
}

/// Waits until of two instances one speaks for every unit and the other stands by.
///
/// # Panics
/// Where that does not come.
pub async fn until_paired(session: &Session, units: usize) {
    let is_pair = |reports: &[PairReport]| {
        let count =
            |role| reports.iter().flat_map(|report| &report.units).filter(|unit| unit.role == role).count();
        reports.len() == 2 && count(Role::Speaking) == units && count(Role::Standby) == units
    };
    until(session, is_pair).await;
}

/// Waits until an instance speaks for every unit.
///
/// # Panics
/// Where that does not come.
pub async fn until_speaks(session: &Session, index: usize, units: usize) {
    let speaks = |report: &PairReport| {
        let speaking = report.units.iter().filter(|unit| unit.role == Role::Speaking);
        report.member.name == NAMES[index] && speaking.count() == units
    };
    until(session, |reports| reports.iter().any(speaks)).await;
}

/// Waits until the instance that stands by has compared so many ticks of every unit.
///
/// # Panics
/// Where that does not come.
pub async fn until_compared(session: &Session, units: usize, ticks: u64) {
    let has = |reports: &[PairReport]| {
        let all = reports.iter().flat_map(|report| &report.units);
        all.filter(|unit| unit.role == Role::Standby && unit.ticks_compared >= ticks).count() == units
    };
    until(session, has).await;
}

/// Waits until what the instances say of themselves is as it should be.
///
/// # Panics
/// Where that does not come.
pub async fn until(session: &Session, is: impl Fn(&[PairReport]) -> bool) {
    let deadline = Instant::now() + LIMIT;
    loop {
        let reports = reports(session).await;
        if is(&reports) {
            return;
        }
        assert!(Instant::now() < deadline, "{reports:#?}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

/// Index of the instance that speaks for the first unit, by its name.
///
/// # Panics
/// Where none does.
pub async fn speaker(session: &Session) -> usize {
    let reports = reports(session).await;
    let speaks = |report: &&PairReport| report.units.first().is_some_and(|unit| unit.role == Role::Speaking);
    let speaking = reports.iter().find(speaks).unwrap_or_else(|| panic!("{reports:#?}"));
    NAMES.iter().position(|name| *name == speaking.member.name).expect("a name of the pair")
}

//! A service in this process with a folder of documents and a state folder, an operator and a consumer.

use std::path::PathBuf;
use std::time::Duration;

use isotherm_bus::{Consumer, SessionOptions, close, locators, open, presence};
use isotherm_service::{RunningService, Settings, Totals, start};
use isotherm_tests::bench::LIMIT;
use isotherm_tests::operator::Operator;
use tempfile::TempDir;
use zenoh::qos::CongestionControl;

/// Folders that outlive a service.
#[derive(Debug)]
pub(crate) struct Folders {
    whole: TempDir,
    /// Calibration documents.
    pub(crate) documents: PathBuf,
    /// State of the service.
    pub(crate) state: PathBuf,
}

impl Folders {
    /// Two folders, the first of them there and empty.
    pub(crate) fn new() -> Self {
        let whole = tempfile::tempdir().unwrap();
        let (documents, state) = (whole.path().join("documents"), whole.path().join("state"));
        std::fs::create_dir(&documents).unwrap();
        Self { whole, documents, state }
    }

    /// A place for anything else.
    pub(crate) fn beside(&self, name: &str) -> PathBuf {
        self.whole.path().join(name)
    }

    /// Writes a document beside its place and renames it.
    pub(crate) fn put(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let (file, partial) = (self.documents.join(name), self.documents.join("partial"));
        std::fs::write(&partial, bytes).unwrap();
        std::fs::rename(&partial, &file).unwrap();
        file
    }

    /// Both folders, a quick watch, and a service that waits rather than drop.
    pub(crate) fn settings(&self) -> Settings {
        let mut settings = Settings {
            calibrations: Some(self.documents.clone()),
            state: Some(self.state.clone()),
            congestion: CongestionControl::Block,
            ..Settings::default()
        };
        settings.folder.settle = Duration::from_millis(10);
        settings.folder.poll = Duration::from_millis(500);
        settings
    }
}

/// The service and those around it.
pub(crate) struct Stand {
    pub(crate) service: RunningService,
    pub(crate) operator: Operator,
    pub(crate) consumer: Consumer,
    /// Options with which a further session reaches the service.
    pub(crate) options: SessionOptions,
}

impl Stand {
    /// Starts it.
    pub(crate) async fn start(settings: Settings) -> Self {
        let session = open(&settings.zenoh.session).await.unwrap();
        let options = SessionOptions { connect: locators(&session), ..SessionOptions::default() };
        let service = start(settings, session).await.unwrap();
        let session = open(&options).await.unwrap();
        let consumer = Consumer::declare(&session, None).await.unwrap();
        presence::wait_for_service(&session, LIMIT).await.unwrap();
        Self { service, operator: Operator::new(session), consumer, options }
    }

    /// Stops it, in its time and without a loss.
    pub(crate) async fn stop(self) -> Totals {
        let totals = self.service.stop().await;
        assert!(!totals.lost(), "{totals:?}");
        close(self.operator.session().clone(), LIMIT).await.unwrap();
        totals
    }
}

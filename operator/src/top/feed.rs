//! What comes over the session: statuses, and who is there.

use std::time::Duration;

use isotherm_protocol::codec::{self, Message};
use isotherm_protocol::key;
use isotherm_protocol::pair::PairReport;
use isotherm_protocol::service_status::ServiceStatus;
use isotherm_protocol::status::Status;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio::task::JoinHandle;
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Sample, SampleKind};

use crate::ConsoleError;
use crate::client::Client;
use crate::status::or_none;

/// How often it is asked who speaks for which unit.
const PAIRS_INTERVAL: Duration = Duration::from_secs(1);

/// Something new.
#[derive(Debug)]
pub enum News {
    /// The status of a unit.
    Unit(Box<Status>),
    /// The status of a service instance.
    Service(Box<ServiceStatus>),
    /// A unit of this serial has come (`true`) or gone.
    UnitAlive(String, bool),
    /// So has a service instance.
    ServiceAlive(String, bool),
    /// What every service instance does for which unit.
    Pairs(Vec<PairReport>),
    /// A status that is not understood.
    NotUnderstood,
}

/// News that are not read yet: a session's own thread, which may be one that ticks come in on, reads nothing.
type Unread = Box<dyn FnOnce() -> News + Send>;

/// News as they come.
#[derive(Debug)]
pub struct Feed {
    news: UnboundedReceiver<Unread>,
    pairs: JoinHandle<()>,
    // Dropping them ends the subscriptions.
    _subscribers: [Subscriber<()>; 4],
}

impl Feed {
    /// Subscribes, and asks for what was said before.
    ///
    /// # Errors
    /// Where the session is closed, or nobody answers in time.
    pub async fn start(client: &Client) -> Result<Self, ConsoleError> {
        let (sender, news) = unbounded_channel();
        let units = frames(client, key::ALL_STATUS, &sender, |status| News::Unit(Box::new(status))).await?;
        let services =
            frames(client, key::ALL_SERVICE_STATUS, &sender, |status| News::Service(Box::new(status)))
                .await?;
        let units_alive =
            tokens(client, key::ALL_UNITS_ALIVE, &sender, key::parse_unit_alive, News::UnitAlive).await?;
        let services_alive =
            tokens(client, key::ALL_SERVICES_ALIVE, &sender, key::parse_service_alive, News::ServiceAlive)
                .await?;
        // Asked after the subscriptions, so that nothing is missed between the two.
        let (statuses, instances) = tokio::join!(client.statuses(), client.services());
        // The receiver is here.
        let known = or_none(instances)?.into_iter().map(|status| News::Service(Box::new(status)));
        let known = known.chain(statuses?.into_iter().map(|status| News::Unit(Box::new(status))));
        known.for_each(|news| drop(sender.send(Box::new(|| news))));
        let pairs = tokio::spawn(ask_pairs(client.clone(), sender));
        Ok(Self { news, pairs, _subscribers: [units, services, units_alive, services_alive] })
    }

    /// The next news; `None` once the session is gone.
    pub async fn next(&mut self) -> Option<News> {
        self.news.recv().await.map(|read| read())
    }

    /// News that have come already.
    pub fn next_now(&mut self) -> Option<News> {
        self.news.try_recv().ok().map(|read| read())
    }
}

impl Drop for Feed {
    fn drop(&mut self) {
        self.pairs.abort();
    }
}

/// Asks time and again who speaks for which unit.
async fn ask_pairs(client: Client, sender: UnboundedSender<Unread>) {
    loop {
        if let Ok(reports) = client.pairs().await
            && sender.send(Box::new(|| News::Pairs(reports))).is_err()
        {
            return;
        }
        tokio::time::sleep(PAIRS_INTERVAL).await;
    }
}

/// Subscribes to frames.
async fn frames<M: Message + 'static>(
    client: &Client,
    key: &str,
    sender: &UnboundedSender<Unread>,
    news: fn(M) -> News,
) -> Result<Subscriber<()>, ConsoleError> {
    let sender = sender.clone();
    let told = move |sample: Sample| {
        let frame = sample.payload().clone();
        let read = move || codec::decode(&frame.to_bytes()).map_or(News::NotUnderstood, news);
        // The receiver may be gone already.
        drop(sender.send(Box::new(read)));
    };
    client.session.declare_subscriber(key.to_owned()).callback(told).await.map_err(Client::declare(key))
}

/// Subscribes to tokens: those that stand are told of first.
async fn tokens(
    client: &Client,
    key: &str,
    sender: &UnboundedSender<Unread>,
    parse: fn(&str) -> Option<&str>,
    news: fn(String, bool) -> News,
) -> Result<Subscriber<()>, ConsoleError> {
    let sender = sender.clone();
    let told = move |sample: Sample| {
        if let Some(name) = parse(sample.key_expr().as_str()) {
            let news = news(name.to_owned(), sample.kind() == SampleKind::Put);
            drop(sender.send(Box::new(|| news)));
        }
    };
    let liveliness = client.session.liveliness();
    let subscriber = liveliness.declare_subscriber(key.to_owned()).history(true).callback(told);
    subscriber.await.map_err(Client::declare(key))
}

//! How fast the machine is at the moment: messages between two sessions, without a service. Where a latency rises and this rises with
//! it, the machine became slower.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use isotherm_bus::{SessionOptions, locators, open};
use tokio::task::JoinHandle;

const KEY: &str = "yardstick";
/// As long as a raw gyro tick's message.
const BYTES: usize = 200;

/// Messages on their way, at the interval of a tick.
#[derive(Debug)]
pub struct Yardstick {
    latencies: Arc<Mutex<Vec<Duration>>>,
    sending: JoinHandle<()>,
}

impl Yardstick {
    /// Opens both sessions and sends from here on.
    ///
    /// # Panics
    /// Where a session cannot be opened.
    #[must_use]
    pub async fn start(interval: Duration) -> Self {
        let receiver = open(&SessionOptions::default()).await.expect("a session on loopback");
        let options = SessionOptions { connect: locators(&receiver), ..SessionOptions::default() };
        let sender = open(&options).await.expect("connected");
        let latencies = Arc::new(Mutex::new(Vec::new()));
        let (begin, taken) = (Instant::now(), Arc::clone(&latencies));
        let subscriber = receiver.declare_subscriber(KEY).callback(move |sample| {
            let at = begin.elapsed();
            let sent = sample.payload().to_bytes().first_chunk().map(|bytes| u64::from_le_bytes(*bytes));
            let sent = Duration::from_nanos(sent.expect("the time of sending"));
            taken.lock().unwrap_or_else(PoisonError::into_inner).push(at.saturating_sub(sent));
        });
        let subscriber = subscriber.await.expect("declared");
        let sending = tokio::spawn(async move {
            let _receiving = (receiver, subscriber);
            let mut times = tokio::time::interval(interval);
            loop {
                times.tick().await;
                let mut bytes = [0; BYTES];
                let now = u64::try_from(begin.elapsed().as_nanos()).expect("centuries");
                bytes[..8].copy_from_slice(&now.to_le_bytes());
                sender.put(KEY, bytes.as_slice()).await.expect("sent");
            }
        });
        Self { latencies, sending }
    }

    /// From sending to receiving, since this was last asked, in ascending order.
    #[must_use]
    pub fn take_latencies(&self) -> Vec<Duration> {
        let mut all = std::mem::take(&mut *self.latencies.lock().unwrap_or_else(PoisonError::into_inner));
        all.sort_unstable();
        all
    }
}

impl Drop for Yardstick {
    fn drop(&mut self) {
        self.sending.abort();
    }
}

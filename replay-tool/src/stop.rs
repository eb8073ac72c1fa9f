//! Stop signals.

use std::future::poll_fn;
use std::task::Poll;

use tokio::signal::unix::{Signal, SignalKind, signal};

use crate::error::Error;

/// Signals that end what the program does in order.
#[derive(Debug)]
pub(crate) struct Stop(Vec<Signal>);

impl Stop {
    /// Listens; from the call on none of these signals ends the program by itself.
    pub(crate) fn on(kinds: &[SignalKind]) -> Result<Self, Error> {
        let listen = |kind: &SignalKind| signal(*kind).map_err(|source| Error::Runtime { source });
        Ok(Self(kinds.iter().map(listen).collect::<Result<_, _>>()?))
    }

    /// Ends with the next of them.
    pub(crate) async fn asked(&mut self) {
        poll_fn(|context| {
            let came = self.0.iter_mut().any(|signal| signal.poll_recv(context).is_ready());
            if came { Poll::Ready(()) } else { Poll::Pending }
        })
        .await;
    }
}

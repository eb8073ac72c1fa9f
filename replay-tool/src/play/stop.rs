//! Stop signals.

use tokio::signal::unix::{SignalKind, signal};

use crate::error::Error;

/// A future that ends with Ctrl-C or a stop signal. From the call on no such signal ends the program by itself.
pub(super) fn stop_asked() -> Result<impl Future<Output = ()>, Error> {
    let listen = |kind| signal(kind).map_err(|source| Error::Runtime { source });
    let (mut interrupt, mut terminate) = (listen(SignalKind::interrupt())?, listen(SignalKind::terminate())?);
    let mut hangup = listen(SignalKind::hangup())?;
    Ok(async move {
        tokio::select! {
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
            _ = hangup.recv() => {}
        }
    })
}

//! Stop signals.

use std::future::poll_fn;
use std::task::Poll;

use isotherm_cli::failed_lines;
use isotherm_log::file::remove_partials;
use tokio::runtime::Builder;
use tokio::signal::unix::{Signal, SignalKind, signal};

use crate::error::Error;

/// Signals that end what the program does in order.
#[derive(Debug)]
pub(crate) struct Stop(Vec<Signal>);

impl Stop {
    /// Listens; from the call on none of these signals ends the program by itself.
    pub(crate) fn on(kinds: &[SignalKind]) -> Result<Self, Error> {
        let listen = |kind: &SignalKind| signal(*kind).map_err(Error::Runtime);
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

/// From the call on, a stop signal ends the program and leaves nothing behind that is not whole.
pub(crate) fn without_traces() -> Result<(), Error> {
    let runtime = Builder::new_current_thread().enable_io().build();
    let runtime = runtime.map_err(Error::Runtime)?;
    let mut stop = {
        let _inside = runtime.enter();
        Stop::on(&[SignalKind::interrupt(), SignalKind::terminate()])?
    };
    std::thread::spawn(move || {
        runtime.block_on(stop.asked());
        remove_partials();
        let exit = failed_lines(&Error::Stopped, Error::Stopped.exit());
        std::process::exit(i32::from(exit as u8));
    });
    Ok(())
}

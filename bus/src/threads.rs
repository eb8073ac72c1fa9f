//! The threads on which Zenoh receives, and so on which every callback runs.

use zenoh_runtime::ZRuntime;

/// Has one of them do something as soon as it is free: it must not wait for anything.
///
/// Where all of them hang, it is never done. Zenoh shows these threads nowhere but in its crate `zenoh-runtime`.
pub fn on_receive_thread(work: impl FnOnce() + Send + 'static) {
    // Not waited for: whoever asks looks for what it did.
    drop(ZRuntime::RX.spawn(async { work() }));
}

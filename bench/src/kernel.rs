//! The state machine per tick, beside what an autopilot does per sample.

mod codec;
mod peer;
mod unit;

use serde::Serialize;

pub(crate) use codec::codec_cases;
pub(crate) use peer::Peer;
pub(crate) use unit::unit_cases;

use crate::error::Error;
use crate::rounds::interleaved;

/// Something that works through a number of ticks, again and again.
pub(crate) trait Kernel {
    /// What it is called.
    fn name(&self) -> &'static str;
    /// Ticks in one pass.
    fn ticks(&self) -> usize;
    /// Works through them once; what comes back depends on all results, so that none is left out.
    fn pass(&mut self) -> f64;
    /// Whether what it gives is right.
    fn check(&mut self) -> Result<(), Error>;
}

/// One row of the table.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Row {
    /// What was measured.
    pub(crate) name: &'static str,
    /// Nanoseconds per tick, median over the rounds.
    pub(crate) ns_per_tick: f64,
    /// Quartiles.
    pub(crate) quartiles_ns: [f64; 2],
    /// Over the autopilot's.
    pub(crate) ratio_to_peer: f64,
}

/// Every kernel; the first is the reference.
pub(crate) fn all() -> Result<Vec<Box<dyn Kernel>>, Error> {
    let mut kernels: Vec<Box<dyn Kernel>> = vec![Box::new(Peer::new())];
    kernels.extend(unit_cases()?.into_iter().map(|case| Box::new(case) as Box<dyn Kernel>));
    kernels.extend(codec_cases());
    Ok(kernels)
}

/// Checks every kernel, then times them in so many interleaved rounds.
pub(crate) fn measure(rounds: usize) -> Result<Vec<Row>, Error> {
    let mut kernels = all()?;
    kernels.iter_mut().try_for_each(|kernel| kernel.check())?;
    let times = interleaved(&mut kernels, rounds, |kernel| {
        std::hint::black_box(kernel.pass());
    });
    #[expect(clippy::cast_precision_loss, reason = "some ten thousand ticks")]
    let per_tick = |kernel: &dyn Kernel, seconds: f64| seconds * 1e9 / kernel.ticks() as f64;
    let mut rows = Vec::new();
    let mut peer = f64::NAN;
    for (kernel, times) in kernels.iter().zip(&times) {
        let ns_per_tick = per_tick(kernel.as_ref(), times.median_s());
        if rows.is_empty() {
            peer = ns_per_tick;
        }
        rows.push(Row {
            name: kernel.name(),
            ns_per_tick,
            quartiles_ns: [0.25, 0.75].map(|share| per_tick(kernel.as_ref(), times.quantile_s(share))),
            ratio_to_peer: ns_per_tick / peer,
        });
    }
    Ok(rows)
}

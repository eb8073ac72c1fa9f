//! The state machine per tick, beside what an autopilot does per sample.

mod codec;
mod peer;
mod stream;
mod unit;

use serde::Serialize;

use crate::error::Error;
use crate::rounds::{interleaved, quantile};

/// Something that works through a number of ticks, again and again.
pub trait Kernel {
    /// What it is called.
    fn name(&self) -> &str;
    /// Ticks in one pass.
    fn ticks(&self) -> usize;
    /// Works through them once; what comes back depends on all results, so that none is left out.
    fn pass(&mut self) -> f64;
    /// Whether what it gives is right.
    ///
    /// # Errors
    /// [`Error::Wrong`], with what is wrong.
    fn check(&mut self) -> Result<(), Error>;
}

/// One row of the table.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Row {
    /// What was measured.
    pub(crate) name: String,
    /// Nanoseconds per tick, median over the rounds.
    pub(crate) ns_per_tick: f64,
    /// Quartiles.
    pub(crate) quartiles_ns: [f64; 2],
    /// Over the autopilot's.
    pub(crate) ratio_to_peer: f64,
}

/// Makes a kernel, with all that it works on.
pub(crate) type Make = fn() -> Result<Box<dyn Kernel>, Error>;

/// Every kernel; the first is the reference.
pub(crate) const KERNELS: [Make; 17] = [
    || Ok(Box::new(peer::Peer::new())),
    || Ok(Box::new(unit::identity()?)),
    || Ok(Box::new(unit::steady()?)),
    || Ok(Box::new(unit::in_motion()?)),
    || Ok(Box::new(unit::zeeman()?)),
    || Ok(Box::new(unit::fibre_optic()?)),
    || Ok(Box::new(unit::skewed_six()?)),
    || Ok(Box::new(unit::coning_sculling()?)),
    || Ok(Box::new(codec::Decode::of(1)?)),
    || Ok(Box::new(codec::Decode::of(10)?)),
    || Ok(Box::new(codec::Decode::of(100)?)),
    || Ok(Box::new(codec::Encode::of(1)?)),
    || Ok(Box::new(codec::Encode::of(10)?)),
    || Ok(Box::new(codec::Encode::of(100)?)),
    || Ok(Box::new(stream::Stream::of(1)?)),
    || Ok(Box::new(stream::Stream::of(10)?)),
    || Ok(Box::new(stream::Stream::of(100)?)),
];

/// Makes every kernel, when its turn comes; the first is the reference. An error is a shipped document that does not hold.
pub fn kernels() -> impl Iterator<Item = Result<Box<dyn Kernel>, Error>> {
    KERNELS.iter().map(|make| make())
}

/// Checks every kernel, then times them in so many interleaved rounds.
pub(crate) fn measure(rounds: usize) -> Result<Vec<Row>, Error> {
    let mut kernels = kernels().collect::<Result<Vec<_>, _>>()?;
    kernels.iter_mut().try_for_each(|kernel| kernel.check())?;
    let times = interleaved(&mut kernels, rounds, |kernel| {
        std::hint::black_box(kernel.pass());
    });
    #[expect(clippy::cast_precision_loss, reason = "some ten thousand ticks")]
    let per_tick_ns = kernels.iter().zip(&times).map(|(kernel, times)| {
        [0.25, 0.5, 0.75].map(|share| quantile(times, share) * 1e9 / kernel.ticks() as f64)
    });
    let per_tick_ns: Vec<_> = per_tick_ns.collect();
    let peer = per_tick_ns.first().map_or(f64::NAN, |[_, median, _]| *median);
    let row = |(kernel, [low, ns_per_tick, high]): (Box<dyn Kernel>, [f64; 3])| Row {
        name: kernel.name().to_owned(),
        ns_per_tick,
        quartiles_ns: [low, high],
        ratio_to_peer: ns_per_tick / peer,
    };
    Ok(kernels.into_iter().zip(per_tick_ns).map(row).collect())
}

//! The sink: writes down what came when, and keeps the first ticks of every unit for the check.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use isotherm_bus::FirstWins;
use isotherm_protocol::codec;
use isotherm_protocol::corrected::CorrectedBatch;
use isotherm_protocol::key;
use serde::{Deserialize, Serialize};
use zenoh::Wait;
use zenoh::sample::Sample;

use super::{Plan, Ready, declare_keys, head, hear, open, say, wait_for_middle};
use crate::chain::Beside;
use crate::clock::now_ns;
use crate::error::Error;

/// What the sink reports.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Received {
    /// Messages behind the prelude.
    pub(crate) messages: u64,
    /// Ticks behind the prelude, each counted once.
    pub(crate) ticks: u64,
    /// Ticks that had been there before.
    pub(crate) duplicates: u64,
    /// Ticks that came behind a later one of their unit.
    pub(crate) disordered: u64,
    /// Messages that could not be read, or of units and ticks that there are not.
    pub(crate) strange: u64,
    /// When the first and the last message came (ns).
    pub(crate) between_ns: [u64; 2],
    /// Lowest number of different calibrations, less one, under which ticks of a unit came.
    pub(crate) fewest_changes: u64,
}

/// What is written while ticks come in.
struct Book {
    plan: Plan,
    account: Received,
    /// When each tick came: by unit, then by tick; 0 is never.
    came_ns: Vec<u64>,
    kept: Vec<Kept>,
    units: Vec<Unit>,
}

/// What is known of one unit.
#[derive(Debug, Clone, Default)]
struct Unit {
    next: u64,
    revision: u64,
    changes: u64,
    arbiter: FirstWins,
}

/// Writes down until everything has come, or nothing comes any more.
pub(crate) fn run(plan: &Plan) -> Result<(), Error> {
    let book = Arc::new(Mutex::new(Book {
        plan: plan.clone(),
        account: Received::default(),
        // Written to, so that the pages are there before the clock runs.
        came_ns: vec![1; plan.case.units * plan.ticks()],
        kept: Vec::new(),
        units: vec![Unit::default(); plan.case.units],
    }));
    lock(&book).came_ns.fill(0);
    let session = open(plan)?;
    // As a consumer does: the sink has to keep up with thousands of units.
    let _declared = declare_keys(&session, plan, |unit| [key::corrected(unit)])?;
    let writing = Arc::clone(&book);
    let subscriber = session
        .declare_subscriber(key::ALL_CORRECTED)
        .callback(move |sample| {
            let now = now_ns();
            lock(&writing).take(&sample, now);
        })
        .wait();
    let _subscriber = subscriber.map_err(Error::zenoh("sink"))?;
    wait_for_middle(&session)?;
    say(&Ready::default())?;
    let of_each = |messages: u64| messages * (plan.case.units * plan.case.batch) as u64;
    if hear().is_none() {
        return Ok(());
    }
    let prelude = of_each(plan.prelude as u64);
    wait_for(&book, prelude, PRELUDE_PATIENCE);
    let came = lock(&book).account.ticks;
    if came < prelude {
        let what = format!("{came} of the {prelude} ticks with which units appear came through");
        return Err(Error::Part { part: "sink", what });
    }
    lock(&book).begin();
    say(&Ready::default())?;
    // How many messages of each unit the source has sent behind the prelude.
    let Some(line) = hear() else { return Ok(()) };
    let sent: u64 = line.parse().unwrap_or(0);
    wait_for(&book, of_each(sent), PATIENCE);

    let mut book = lock(&book);
    let changes = book.units.iter().map(|unit| unit.changes).min();
    book.account.fewest_changes = changes.unwrap_or(0);
    plan.save("came.bin", &book.came_ns)?;
    plan.save("kept.bin", &book.kept)?;
    say(&book.account)
}

/// How long nothing may come behind the last tick.
const PATIENCE: Duration = Duration::from_secs(3);
/// How long nothing may come while thousands of units appear.
const PRELUDE_PATIENCE: Duration = Duration::from_secs(30);

/// Waits for so many ticks, at most as long as some come.
fn wait_for(book: &Mutex<Book>, ticks: u64, patience: Duration) {
    let mut seen = (0, Instant::now());
    loop {
        let now = lock(book).account.ticks;
        if now >= ticks || (now == seen.0 && seen.1.elapsed() > patience) {
            return;
        }
        if now != seen.0 {
            seen = (now, Instant::now());
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

impl Book {
    /// Begins the account anew; which ticks have come is kept.
    fn begin(&mut self) {
        let Received { duplicates, disordered, strange, .. } = self.account;
        self.account = Received { duplicates, disordered, strange, ..Received::default() };
    }

    /// Takes a message that came at a time; of a pair, if its ticks are used: the time is when that is known.
    fn take(&mut self, sample: &Sample, now: u64) {
        if self.plan.case.beside != Some(Beside::Standby) {
            return self.enter(sample, now);
        }
        let batch = codec::decode::<CorrectedBatch>(&sample.payload().to_bytes()).ok();
        let unit = head::unit_of(sample.key_expr().as_str()).and_then(|number| self.units.get_mut(number));
        if let (Some(batch), Some(unit)) = (batch, unit) {
            let won = batch.ticks.iter().filter(|tick| unit.arbiter.wins(tick)).count();
            // Both services put the same ticks into a message.
            if won == 0 {
                return;
            }
        }
        self.enter(sample, now_ns());
    }

    /// Enters a message that came at a time.
    fn enter(&mut self, sample: &Sample, now: u64) {
        let frame = sample.payload().to_bytes();
        let (all, keep) = (self.plan.ticks() as u64, self.plan.keep as u64);
        let account = &mut self.account;
        account.messages += 1;
        if account.between_ns[0] == 0 {
            account.between_ns[0] = now;
        }
        account.between_ns[1] = now;
        let head = head::read(self.plan.subject, &frame).filter(|head| head.first + head.ticks <= all);
        let number = head::unit_of(sample.key_expr().as_str());
        let unit = number.and_then(|number| self.units.get_mut(number));
        let (Some(head), Some(number), Some(unit)) = (head, number, unit) else {
            account.strange += 1;
            return;
        };
        if unit.revision != head.revision {
            unit.changes += u64::from(unit.next > 0);
            unit.revision = head.revision;
        }
        if unit.next > head.first {
            account.disordered += head.ticks;
        }
        unit.next = head.first + head.ticks;
        if head.first < keep {
            self.kept.push(Kept { unit: number, frame: frame.to_vec() });
        }
        for tick in head.first..head.first + head.ticks {
            let place = number as u64 * all + tick;
            let came = usize::try_from(place).ok().and_then(|place| self.came_ns.get_mut(place));
            match came {
                Some(came) if *came == 0 => {
                    *came = now;
                    account.ticks += 1;
                }
                _ => account.duplicates += 1,
            }
        }
    }
}

/// A frame that was kept.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Kept {
    /// Number of its unit.
    pub(crate) unit: usize,
    /// The frame.
    pub(crate) frame: Vec<u8>,
}

fn lock(book: &Mutex<Book>) -> MutexGuard<'_, Book> {
    book.lock().unwrap_or_else(PoisonError::into_inner)
}

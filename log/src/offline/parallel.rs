//! Several units of a recording at once: one thread reads, others correct, the caller's writes; or the caller's does all three.
//!
//! The recording is read in blocks of messages. Each unit belongs to one worker, which gets the unit's messages of every
//! block in recorded order; what the workers make of a block is put together again by unit before the next. So neither
//! the number of threads nor their timing reaches a result, and only a few blocks are in memory at a time.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use isotherm_protocol::key::UnitId;

use super::unit::{Form, Output, UnitPlan, UnitReport, UnitWork};
use crate::error::Error;
use crate::message::Message;
use crate::part::{LogFiles, Messages, Part};
use crate::progress::Progress;
use crate::source::LogReport;

/// Most messages in one block.
const BLOCK: usize = 1024;
/// A block ends when its frames have so many bytes: what waits between two threads stays in the processor's caches.
const BLOCK_BYTES: usize = 1 << 17;
/// Blocks between two threads.
const DEPTH: usize = 4;

/// How units are corrected.
#[derive(Debug, Clone, Copy)]
pub struct RunOptions {
    /// Threads that correct (≥ 1), and one more that reads; with one the caller's does everything. The results do not depend
    /// on it.
    pub threads: usize,
    /// What is made of corrected ticks.
    pub form: Form,
    /// Ticks that were made of messages received earlier are not given out (ns since 1970-01-01 UTC).
    pub from_ns: u64,
}

/// What has been made of one block: by the unit's place in the plans, in that order.
pub type Made = Vec<(usize, Output)>;

/// Messages of one block for one worker, by the unit's place in the plans.
type Job = Vec<(usize, Message)>;

/// Places of units in the plans.
type Places = BTreeMap<UnitId, usize>;

/// Corrects the units of a log; `each` takes what is made of them, block by block.
///
/// # Errors
/// Those of reading and of `each`.
pub fn correct(
    files: &LogFiles,
    part: &Part,
    plans: Vec<UnitPlan>,
    options: RunOptions,
    each: &mut dyn FnMut(Made, &Progress) -> Result<(), Error>,
) -> Result<(Vec<UnitReport>, LogReport), Error> {
    let workers = options.threads.clamp(1, plans.len().max(1));
    let places: Places = plans.iter().enumerate().map(|(place, plan)| (plan.id.clone(), place)).collect();
    let mut of_worker: Vec<Worker> = (0..workers).map(|_| Worker::default()).collect();
    for (place, plan) in plans.into_iter().enumerate() {
        let work = UnitWork::new(plan, options.form, options.from_ns);
        if let Some(worker) = of_worker.get_mut(place % workers) {
            worker.units.push((place, work));
        }
    }
    if options.threads <= 1 {
        return alone(files, part, &places, of_worker.pop().unwrap_or_default(), each);
    }
    thread::scope(|scope| {
        let (mut jobs, mut made, mut running) = (Vec::new(), Vec::new(), Vec::new());
        for worker in of_worker {
            let (job_sender, job_receiver) = sync_channel::<Job>(DEPTH);
            let (made_sender, made_receiver) = sync_channel::<Made>(DEPTH);
            jobs.push(job_sender);
            made.push(made_receiver);
            running.push(scope.spawn(move || work(worker, &job_receiver, &made_sender)));
        }
        let (progress_sender, progress_receiver) = sync_channel(1);
        let places = &places;
        let reading = scope.spawn(move || read(files, part, places, &jobs, &progress_sender));
        let taken = match progress_receiver.recv() {
            Ok(progress) => put_together(&made, &mut |block| each(block, &progress)),
            // It could not be opened: the reader says why.
            Err(_) => Ok(()),
        };
        // Whoever still waits to hand something over need not.
        drop(made);
        let report = joined(reading.join());
        let mut reports = Vec::new();
        for worker in running {
            reports.extend(joined(worker.join()));
        }
        taken?;
        reports.sort_by_key(|(place, _)| *place);
        Ok((reports.into_iter().map(|(_, report)| report).collect(), report?))
    })
}

/// What a thread has ended with; its panic is the caller's.
fn joined<T>(ended: thread::Result<T>) -> T {
    ended.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// Reads, corrects and gives out in one thread.
fn alone(
    files: &LogFiles,
    part: &Part,
    places: &Places,
    mut worker: Worker,
    each: &mut dyn FnMut(Made, &Progress) -> Result<(), Error>,
) -> Result<(Vec<UnitReport>, LogReport), Error> {
    let mut messages = files.open(part)?;
    let progress = messages.progress();
    // What was read before a log breaks off is given out, as it is with more threads.
    let end = loop {
        match block(&mut messages, places, 1) {
            Ok(jobs) if jobs.is_empty() => break Ok(()),
            Ok(jobs) => jobs.into_iter().try_for_each(|job| each(worker.take(job), &progress))?,
            Err(error) => break Err(error),
        }
    };
    each(worker.finish(), &progress)?;
    end?;
    Ok((worker.reports().map(|(_, report)| report).collect(), messages.report()))
}

/// Reads the log and hands each worker its messages.
fn read(
    files: &LogFiles,
    part: &Part,
    places: &Places,
    jobs: &[SyncSender<Job>],
    progress: &SyncSender<Progress>,
) -> Result<LogReport, Error> {
    let mut messages = files.open(part)?;
    // The caller waits for it.
    let _ = progress.send(messages.progress());
    loop {
        let block = block(&mut messages, places, jobs.len())?;
        if block.is_empty() {
            return Ok(messages.report());
        }
        for (job, worker) in block.into_iter().zip(jobs) {
            if worker.send(job).is_err() {
                // Nobody wants it any more.
                return Ok(messages.report());
            }
        }
    }
}

/// The next messages of the log, by worker; none at its end.
fn block(messages: &mut Messages, places: &Places, workers: usize) -> Result<Vec<Job>, Error> {
    let mut block: Vec<Job> = Vec::new();
    let mut bytes = 0;
    for _ in 0..BLOCK {
        let Some(message) = messages.next_message()? else { break };
        block.resize_with(workers, Job::new);
        bytes += message.frame.len();
        let place = message.topic.unit().and_then(|unit| places.get(unit)).copied();
        if let Some(place) = place
            && let Some(job) = block.get_mut(place % workers)
        {
            job.push((place, message));
        }
        if bytes >= BLOCK_BYTES {
            break;
        }
    }
    Ok(block)
}

/// Units that one thread corrects, by their place in the plans, in that order.
#[derive(Default)]
struct Worker {
    units: Vec<(usize, UnitWork)>,
}

impl Worker {
    /// Corrects the messages of a block.
    fn take(&mut self, job: Job) -> Made {
        for (place, message) in job {
            if let Ok(index) = self.units.binary_search_by_key(&place, |(place, _)| *place)
                && let Some((_, work)) = self.units.get_mut(index)
            {
                work.take(message);
            }
        }
        self.made()
    }

    /// What waits until nothing more comes.
    fn finish(&mut self) -> Made {
        for (_, work) in &mut self.units {
            work.finish();
        }
        self.made()
    }

    fn made(&mut self) -> Made {
        self.units.iter_mut().map(|(place, work)| (*place, work.output())).collect()
    }

    fn reports(self) -> impl Iterator<Item = (usize, UnitReport)> {
        self.units.into_iter().map(|(place, work)| (place, work.report()))
    }
}

/// Corrects what comes in for one worker.
fn work(mut worker: Worker, jobs: &Receiver<Job>, made: &SyncSender<Made>) -> Vec<(usize, UnitReport)> {
    for job in jobs {
        if made.send(worker.take(job)).is_err() {
            break;
        }
    }
    // Nobody may want it any more.
    let _ = made.send(worker.finish());
    worker.reports().collect()
}

/// Takes what every worker has made of a block, block after block.
fn put_together(
    made: &[Receiver<Made>],
    each: &mut dyn FnMut(Made) -> Result<(), Error>,
) -> Result<(), Error> {
    loop {
        let mut block = Made::new();
        for worker in made {
            let Ok(of_worker) = worker.recv() else { return Ok(()) };
            block.extend(of_worker);
        }
        block.sort_by_key(|(place, _)| *place);
        each(block)?;
    }
}

//! The subscriber: corrected batches in, an account per unit, progress on the terminal.

use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use isotherm_bus::{Consumer, Continuity};
use tokio::sync::mpsc::UnboundedReceiver;

use super::fleet::Member;
use super::score::{Score, Scored, SentBatch};
use super::windows::{deg_per_h, over_axes};

/// How long nothing may arrive after the last producer has ended before the rest counts as lost.
const PATIENCE: Duration = Duration::from_secs(5);

/// A batch that the unit of this index in the fleet is about to send.
pub(crate) type Feed = (usize, SentBatch);

/// What came of one unit.
#[derive(Debug)]
pub(crate) struct Watched {
    pub(crate) scored: Scored,
    pub(crate) continuity: Continuity,
}

/// Receives until everything sent has come back, or nothing more comes.
pub(crate) async fn watch(
    consumer: &mut Consumer,
    fleet: &[Member],
    mut feed: UnboundedReceiver<Feed>,
) -> Vec<Watched> {
    let mut tallies = Tally::all(fleet);
    let mut producing = true;
    loop {
        if !producing && tallies.iter().all(|tally| tally.is_complete(consumer)) {
            break;
        }
        tokio::select! {
            batch = consumer.next() => {
                let at = Instant::now();
                // A batch is announced before it is sent, so its announcement is here already.
                while let Ok((unit, sent)) = feed.try_recv() {
                    tallies[unit].score.send(sent);
                }
                let Some(batch) = batch else { break };
                if let Some(tally) = tallies.iter_mut().find(|tally| tally.member.id.as_str() == batch.unit) {
                    tally.score.receive(&batch, at);
                    tally.show(consumer);
                }
            }
            announced = feed.recv(), if producing => match announced {
                Some((unit, sent)) => tallies[unit].score.send(sent),
                None => producing = false,
            },
            () = tokio::time::sleep(PATIENCE), if !producing => break,
        }
    }
    tallies.into_iter().map(|tally| tally.finish(consumer)).collect()
}

/// One unit's account and its bar.
struct Tally<'a> {
    member: &'a Member,
    score: Score,
    bar: ProgressBar,
}

impl<'a> Tally<'a> {
    fn all(fleet: &'a [Member]) -> Vec<Self> {
        let bars = MultiProgress::new();
        let style = ProgressStyle::with_template("{prefix:21} {bar:8} {percent:>3} % {wide_msg}");
        let style = style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("━╸─");
        let tally = |member: &'a Member| {
            let bar = bars.add(ProgressBar::new(member.ticks).with_style(style.clone()));
            bar.set_prefix(format!("{} {}", member.id, member.kind.name));
            Tally { member, score: Score::new(member.kind.averaging_s), bar }
        };
        fleet.iter().map(tally).collect()
    }

    fn show(&self, consumer: &Consumer) {
        if self.bar.is_hidden() {
            return;
        }
        let out = consumer.continuity(&self.member.id).ticks;
        let error = self.score.windows.means.last().map_or_else(String::new, |mean| {
            let [raw, corrected] = [mean.raw, mean.corrected].map(|error| deg_per_h(over_axes(error)));
            format!(", raw {raw:.2} → {corrected:.2} °/h")
        });
        self.bar.set_position(out);
        self.bar.set_message(format!("in {} out {out}{error}", self.score.sent));
    }

    fn is_complete(&self, consumer: &Consumer) -> bool {
        let continuity = consumer.continuity(&self.member.id);
        continuity.ticks + continuity.announced_missing >= self.score.sent
    }

    fn finish(self, consumer: &Consumer) -> Watched {
        // The table says what the bars said, and more.
        self.bar.finish_and_clear();
        Watched { scored: self.score.finish(), continuity: consumer.continuity(&self.member.id) }
    }
}

//! Faults of a transport on purpose: delay, loss, duplication and reordering by chance, the same for the same seed.
//!
//! Everything is decided by the messages and their time in the log: no clock and no thread has a part in it. Every message
//! draws the same number of random numbers, whatever becomes of it, so that one more kind of fault leaves the choices of
//! the others as they are.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// Most later messages of its channel that go out before one that is held back.
const MOST_BEHIND: u64 = 4;

/// What happens to messages, and how often.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FaultOptions {
    /// Longest delay (ns); uniform between 0 and this. The order is kept.
    pub jitter_ns: u64,
    /// Share of messages that do not go out (0…1).
    pub loss: f64,
    /// Share of messages that go out twice (0…1).
    pub duplicate: f64,
    /// Share of messages that go out behind one to four later ones of their channel (0…1).
    pub reorder: f64,
}

impl FaultOptions {
    /// Whether nothing is to happen.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

/// A message that goes out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Departure<T> {
    /// When (ns of the log's time); never before the departure before it.
    pub at_ns: i64,
    /// The message.
    pub item: T,
    /// It has gone out before.
    pub again: bool,
    /// Later ones of its channel went out before it.
    pub held_back: bool,
}

/// The faults on the way of one unit's messages.
#[derive(Debug)]
pub struct Faults<T> {
    options: FaultOptions,
    generator: Pcg64Mcg,
    /// When the last message went out.
    last_ns: i64,
    held: Vec<Held<T>>,
}

/// A message that is held back.
#[derive(Debug)]
struct Held<T> {
    channel: usize,
    /// Messages of its channel that still go out before it.
    before: u64,
    item: T,
    again: bool,
}

impl<T: Clone> Faults<T> {
    /// Faults by a seed; each `stream` of the seed has random numbers of its own.
    #[must_use]
    pub fn new(options: FaultOptions, seed: u64, stream: u64) -> Self {
        // Neighbouring seeds and streams must not give neighbouring states.
        let mut scramble = Pcg64Mcg::seed_from_u64(seed ^ stream.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let generator = Pcg64Mcg::seed_from_u64(scramble.next_u64());
        Self { options, generator, last_ns: i64::MIN, held: Vec::new() }
    }

    /// Takes a message that would go out at `at_ns` on one of the unit's channels, and gives what goes out for it; false
    /// where the message is lost.
    pub fn pass(&mut self, channel: usize, at_ns: i64, item: T, out: &mut Vec<Departure<T>>) -> bool {
        let FaultOptions { jitter_ns, loss, duplicate, reorder } = self.options;
        let lost = self.chance(loss);
        let twice = self.chance(duplicate);
        let delay_ns = self.up_to(jitter_ns);
        let behind = [self.behind(reorder), self.behind(reorder)];
        if lost {
            return false;
        }
        let due = at_ns.saturating_add(i64::try_from(delay_ns).unwrap_or(i64::MAX));
        for (again, before) in [false, true].into_iter().zip(behind).take(1 + usize::from(twice)) {
            match before {
                Some(before) => self.held.push(Held { channel, before, item: item.clone(), again }),
                None => self.go_out(channel, due, item.clone(), again, out),
            }
        }
        true
    }

    /// Sends a message out, and behind it those that have waited for it.
    fn go_out(&mut self, channel: usize, due: i64, item: T, again: bool, out: &mut Vec<Departure<T>>) {
        // One link, one order: what is sent later arrives later.
        self.last_ns = self.last_ns.max(due);
        let at_ns = self.last_ns;
        out.push(Departure { at_ns, item, again, held_back: false });
        for held in self.held.iter_mut().filter(|held| held.channel == channel) {
            held.before -= 1;
        }
        let free = self.held.extract_if(.., |held| held.before == 0);
        out.extend(free.map(|Held { item, again, .. }| Departure { at_ns, item, again, held_back: true }));
    }

    /// Gives everything that is held back: nothing comes behind it.
    pub fn flush(&mut self, out: &mut Vec<Departure<T>>) {
        let at_ns = self.last_ns;
        let held = self.held.drain(..);
        out.extend(held.map(|Held { item, again, .. }| Departure { at_ns, item, again, held_back: true }));
    }

    /// Time begins anew, e.g. with another pass over the log. Whatever is held back is forgotten; the random numbers go on.
    pub fn begin_anew(&mut self) {
        self.last_ns = i64::MIN;
        self.held.clear();
    }

    /// A uniform number of 53 bits from 0 to less than 1 decides.
    fn chance(&mut self, share: f64) -> bool {
        #[expect(clippy::cast_precision_loss, reason = "53 bits are exact")]
        let uniform = (self.generator.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0);
        uniform < share
    }

    /// A uniform whole number from 0 to `most`.
    fn up_to(&mut self, most: u64) -> u64 {
        let product = u128::from(self.generator.next_u64()) * (u128::from(most) + 1);
        u64::try_from(product >> 64).unwrap_or(most)
    }

    /// How many messages go out before one that is held back; `None` where it is not.
    fn behind(&mut self, reorder: f64) -> Option<u64> {
        let (held, depth) = (self.chance(reorder), 1 + self.up_to(MOST_BEHIND - 1));
        held.then_some(depth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: FaultOptions = FaultOptions { jitter_ns: 20_000_000, loss: 0.1, duplicate: 0.1, reorder: 0.1 };

    /// What goes out of messages every 10 ms on two channels, and how many were lost.
    fn run(options: FaultOptions, seed: u64, stream: u64) -> (Vec<Departure<u32>>, u64) {
        let mut faults = Faults::new(options, seed, stream);
        let (mut out, mut lost) = (Vec::new(), 0);
        for number in 0..10_000 {
            let at_ns = i64::from(number) * 10_000_000;
            lost += u64::from(!faults.pass(number as usize % 2, at_ns, number, &mut out));
        }
        faults.flush(&mut out);
        (out, lost)
    }

    #[test]
    fn the_same_seed_gives_the_same_and_another_does_not() {
        assert_eq!(run(ALL, 7, 1), run(ALL, 7, 1));
        assert_ne!(run(ALL, 7, 1), run(ALL, 8, 1));
        assert_ne!(run(ALL, 7, 1), run(ALL, 7, 2));
    }

    #[test]
    fn each_kind_happens_as_often_as_asked_and_alone() {
        let none = FaultOptions::default();
        let numbers = |out: &[Departure<u32>]| out.iter().map(|it| it.item).collect::<Vec<_>>();
        let sorted = |out: &[Departure<u32>]| {
            let mut numbers = numbers(out);
            numbers.sort_unstable();
            numbers
        };
        let all: Vec<_> = (0..10_000).collect();
        let near = |count: usize| (900..1100).contains(&count);

        assert_eq!(numbers(&run(none, 3, 1).0), all);
        let (out, _) = run(FaultOptions { jitter_ns: 25_000_000, ..none }, 3, 1);
        assert_eq!(numbers(&out), all, "a delay keeps the order");
        let delays = out.iter().map(|it| it.at_ns - i64::from(it.item) * 10_000_000);
        let (least, most) = delays.fold((i64::MAX, 0), |(least, most), d| (least.min(d), most.max(d)));
        assert!(least < 1_000_000 && most > 24_000_000 && most <= 25_000_000, "{least} {most}");

        let (out, lost) = run(FaultOptions { loss: 0.1, ..none }, 3, 1);
        assert!(near(10_000 - out.len()) && out.len() as u64 + lost == 10_000, "{lost}");
        let (out, lost) = run(FaultOptions { duplicate: 0.1, ..none }, 3, 1);
        assert!(near(out.iter().filter(|it| it.again).count()) && lost == 0);
        let (out, lost) = run(FaultOptions { reorder: 0.1, ..none }, 3, 1);
        assert!(near(out.iter().filter(|it| it.held_back).count()) && lost == 0);
        assert_eq!(sorted(&out), all);
        assert!(out.is_sorted_by_key(|it| it.at_ns));
        let behind = |it: &&Departure<u32>| it.held_back;
        let late = out.iter().filter(behind).map(|it| it.at_ns / 10_000_000 - i64::from(it.item));
        assert!(late.clone().all(|steps| (0..=60).contains(&steps)), "{:?}", late.max());
    }

    #[test]
    fn one_kind_of_fault_leaves_the_choices_of_the_others() {
        let lost = |options| {
            let (out, _) = run(options, 5, 1);
            let there: std::collections::BTreeSet<_> = out.iter().map(|it| it.item).collect();
            (0..10_000).filter(|number| !there.contains(number)).collect::<Vec<_>>()
        };
        assert_eq!(lost(ALL), lost(FaultOptions { loss: 0.1, ..FaultOptions::default() }));
    }
}

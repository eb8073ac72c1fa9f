//! Copies of the frame that a memory has heard last.
//!
//! A line that doubles frames may bring one before a memory and the other behind it, and a recorder hears them in another order than the
//! service. Which of them the memory had heard shows only in the count of the next entry: until then the copies are set aside.

use std::collections::VecDeque;

use crate::key::Input;

use super::{Deed, Frame, NEAR_NS, Sequencer};
use crate::replay::notice::Notice;
use crate::replay::outline::Mark;

/// Frames that are set aside, by [`Input::index`].
#[derive(Debug, Default)]
pub(super) struct Copies {
    of: Option<Mark>,
    frames: [VecDeque<Frame>; Input::ALL.len()],
}

impl Copies {
    /// Sets a frame aside where it is a copy; gives it back where it is not.
    pub(super) fn keep(&mut self, input: usize, frame: Frame) -> Option<Frame> {
        let is_copy = self.of.as_ref().is_some_and(|mark| {
            let (heard, apart_ns) = (mark.heard[input], frame.received_ns.abs_diff(mark.received_ns));
            heard.frames > 0 && apart_ns <= NEAR_NS && frame.crc() == heard.crc
        });
        if !is_copy {
            return Some(frame);
        }
        self.frames[input].push_back(frame);
        None
    }
}

impl Sequencer {
    /// A stream begins behind a memory: of the frames that wait, those are set aside that are copies of what it has heard last, but for
    /// the one (its order less one is the cut) behind which the stream begins.
    pub(super) fn set_copies_aside(&mut self, mark: &Mark, cuts: &[u64; Input::ALL.len()]) {
        self.copies = Copies { of: Some(mark.clone()), ..Copies::default() };
        for (index, (waiting, cut)) in self.waiting.iter_mut().zip(cuts).enumerate() {
            let frames = std::mem::take(waiting);
            waiting.extend(frames.into_iter().filter_map(|frame| {
                if frame.order + 1 == *cut { Some(frame) } else { self.copies.keep(index, frame) }
            }));
        }
    }

    /// Whether frames that seem not to be recorded are copies that the service heard behind the memory: then they are given.
    pub(super) fn gives_copies(&mut self, notice: &Notice) -> bool {
        let Notice::NotRecorded { input, frames, .. } = notice else { return false };
        let index = input.index();
        let copies = &mut self.copies.frames[index];
        let Some(count) = usize::try_from(*frames).ok().filter(|count| *count <= copies.len()) else {
            return false;
        };
        let given = copies.drain(..count);
        self.out.extend(given.map(|frame| Deed::Frame {
            input: *input,
            received_ns: frame.received_ns,
            frame: frame.bytes,
        }));
        if let Some(standing) = &mut self.standing {
            standing.heard[index].frames += frames;
        }
        true
    }
}

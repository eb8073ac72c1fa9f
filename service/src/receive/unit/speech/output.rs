//! Frames that were kept go out.

use std::time::Instant;

use super::REPEATED;
use crate::receive::fault::FaultKind;
use crate::receive::unit::UnitActor;

impl UnitActor {
    /// An active instance publishes what its stream makes as soon as that has joined, and what it made until then: the other may have
    /// stood still meanwhile, and published nothing.
    pub(super) fn publish_owed(&mut self, now: Instant, active: bool) {
        let Some(following) = &mut self.speech.following else { return };
        following.also_out = active && following.follower.has_joined();
        if following.also_out {
            let owed = following.kept.due(now, REPEATED);
            self.publish_kept(owed);
        }
    }

    /// Publishes frames that were kept.
    pub(super) fn publish_kept(&mut self, frames: Vec<Vec<u8>>) {
        for frame in frames {
            if let Err(error) = (self.outlet)(frame) {
                self.fault(FaultKind::Unpublished, 1, || {
                    format!("corrected: {}", isotherm_bus::words(&error))
                });
            }
        }
    }
}

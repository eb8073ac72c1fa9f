//! Entries in words, and texts cut to what an entry may hold.

use std::fmt;

use super::{
    Acceptance, AuditEntry, AuditEvent, MAX_CARRIED, MAX_CHANGED, MAX_PROBLEMS, Refusal, Source, Withdrawn,
};
use crate::control::{MAX_BY, Schedule};
use crate::digest::{Digest, Digits};
use crate::escape::clipped;

/// Longest line of what has changed, in characters.
const MAX_CHANGE: usize = 160;
/// Longest problem, reason or command, in characters.
const MAX_TEXT: usize = 400;
/// Longest path, in characters: the longest entry carries [`MAX_CARRIED`] of them.
const MAX_PATH: usize = 1024;

impl AuditEntry {
    /// The entry with every text and list cut to what the audit file keeps, without control characters.
    #[must_use]
    pub fn bounded(mut self) -> Self {
        clip(&mut self.by, MAX_BY);
        if let Some(unit) = &mut self.unit {
            clip(unit, crate::key::MAX_UNIT_ID);
        }
        self.event = self.event.bounded();
        self
    }
}

impl AuditEvent {
    /// The event with every text and list cut to what the audit file keeps, without control characters: a hostile or
    /// wrong document cannot fill the disk, nor the screen of whoever reads the history.
    #[must_use]
    pub fn bounded(mut self) -> Self {
        match &mut self {
            Self::Accepted(accepted) => {
                clip_source(&mut accepted.source);
                let beyond = accepted.changed.len().saturating_sub(MAX_CHANGED);
                accepted.changed.truncate(MAX_CHANGED);
                accepted.changed.iter_mut().for_each(|line| clip(line, MAX_CHANGE));
                if beyond > 0 {
                    accepted.changed.push(format!("and {beyond} more"));
                }
            }
            Self::Refused(refused) => {
                clip_source(&mut refused.source);
                refused.count = refused.count.max(refused.problems.len() as u64);
                refused.problems.truncate(MAX_PROBLEMS);
                refused.problems.iter_mut().for_each(|problem| clip(problem, MAX_TEXT));
            }
            Self::Command(command) => {
                let texts = [&mut command.command, &mut command.state_before, &mut command.state_after];
                texts.into_iter().chain(&mut command.reason).for_each(|text| clip(text, MAX_TEXT));
            }
            Self::CarriedUnit(carried) => {
                let beyond = carried.sets.len().saturating_sub(MAX_CARRIED);
                carried.sets.drain(..beyond);
                carried.sets.iter_mut().for_each(|set| clip_source(&mut set.source));
            }
            Self::CarriedFile(carried) => clip(&mut carried.path, MAX_PATH),
            Self::InForce(_) | Self::Withdrawn(_) => {}
        }
        self
    }

    /// Name of the event, as in the JSON.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Accepted(_) => "accepted",
            Self::InForce(_) => "in-force",
            Self::Withdrawn(_) => "withdrawn",
            Self::Refused(_) => "refused",
            Self::Command(_) => "command",
            Self::CarriedUnit(_) => "carried-unit",
            Self::CarriedFile(_) => "carried-file",
        }
    }
}

/// Cuts a text to a number of characters, and shows control characters by their codes.
fn clip(text: &mut String, longest: usize) {
    *text = clipped(text, longest);
}

/// Cuts the path of a source.
fn clip_source(source: &mut Source) {
    match source {
        Source::Folder { path } | Source::Start { path } => clip(path, MAX_PATH),
        Source::Bus | Source::Rollback { .. } | Source::PreLaunch => {}
    }
}

impl fmt::Display for AuditEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.number, self.time)?;
        if let Some(unit) = &self.unit {
            write!(f, " {unit}")?;
        }
        write!(f, ": {}", self.event)?;
        if self.by.is_empty() { Ok(()) } else { write!(f, " (by {})", self.by) }
    }
}

impl fmt::Display for AuditEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Accepted(accepted) => accepted.fmt(f),
            Self::InForce(first) => {
                let (revision, sequence) = (first.revision, first.first_sequence);
                write!(f, "revision {revision} in force from tick {sequence} of series {}", first.series)
            }
            Self::Withdrawn(withdrawal) => {
                write!(f, "revision {} withdrawn: ", withdrawal.revision)?;
                match withdrawal.why {
                    Withdrawn::Superseded { by_revision } => {
                        write!(f, "replaced by revision {by_revision}")
                    }
                    Withdrawn::Cancelled => f.write_str("called off"),
                }
            }
            Self::Refused(refused) => refused.fmt(f),
            Self::Command(command) => {
                let verdict = if command.accepted { "accepted" } else { "refused" };
                write!(f, "command {} {verdict}, ", command.command)?;
                if command.state_before == command.state_after {
                    write!(f, "{} as before", command.state_after)?;
                } else {
                    write!(f, "{} to {}", command.state_before, command.state_after)?;
                }
                command.reason.iter().try_for_each(|reason| write!(f, ": {reason}"))
            }
            Self::CarriedUnit(carried) => match carried.sets.last() {
                Some(set) => write!(f, "carried over: revision {} of {}", set.revision, short(&set.digest)),
                None => {
                    write!(f, "carried over: no calibration, {} revisions so far", carried.highest_revision)
                }
            },
            Self::CarriedFile(carried) => {
                let refused = if carried.refused { ", refused" } else { "" };
                write!(f, "{} was seen as {}{refused}", carried.path, short(&carried.digest))
            }
        }
    }
}

impl fmt::Display for Acceptance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "revision {} accepted from {}: {}", self.revision, self.source, short(&self.digest))?;
        if let Some(overlay) = &self.overlay {
            write!(f, " with overlay {}", short(overlay))?;
        }
        match self.schedule {
            Schedule::NextTick => {}
            Schedule::Sequence(sequence) => write!(f, ", from tick {sequence} on")?,
            Schedule::TimeNs(time_ns) => write!(f, ", from {time_ns} ns on")?,
        }
        if self.slew_ms > 0 {
            write!(f, ", over {} ms", self.slew_ms)?;
        }
        Ok(())
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} from {} refused", short(&self.digest), self.source)?;
        if let Some(first) = self.problems.first() {
            write!(f, ": {first}")?;
        }
        match self.count.saturating_sub(1) {
            0 => Ok(()),
            beyond => write!(f, " (and {beyond} more)"),
        }
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Folder { path } => write!(f, "folder ({path})"),
            Self::Bus => f.write_str("bus"),
            Self::Rollback { to } => write!(f, "rollback (to revision {to})"),
            Self::PreLaunch => f.write_str("pre-launch calibration"),
            Self::Start { path } => write!(f, "start ({path})"),
        }
    }
}

/// The first eight digits of a digest, as screens show it.
fn short(digest: &Digest) -> Digits<'_> {
    Digits(digest.0.get(..4).unwrap_or_default())
}

//! The ticks around one mode switch, to be looked at closely.

use std::collections::VecDeque;

use super::score::SentTick;

/// Ticks shown before the switch command.
const BEFORE: usize = 16;
/// Ticks shown from the switch command on.
const AFTER: usize = 32;

/// One tick, and the corrected angle increments about the case axes (rad).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tick {
    pub(crate) sent: SentTick,
    pub(crate) corrected: [f64; 3],
    pub(crate) interpolated: bool,
}

/// One switch with the ticks around it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Switch {
    pub(crate) ticks: Vec<Tick>,
    /// End of the last tick before the command, i.e. the time of the command (s of event time).
    pub(crate) command_s: f64,
}

/// Keeps the switch with the most interpolated ticks, the earliest of them.
#[derive(Debug, Default)]
pub(crate) struct SwitchWatch {
    before: VecDeque<Tick>,
    open: Option<Switch>,
    best: Option<Switch>,
}

impl SwitchWatch {
    pub(crate) fn push(&mut self, tick: Tick) {
        match &mut self.open {
            Some(open) => open.ticks.push(tick),
            None if tick.sent.switch_command && self.before.len() == BEFORE => {
                let command_s = self.before.back().map_or(tick.sent.end_s, |last| last.sent.end_s);
                let ticks = self.before.iter().copied().chain([tick]).collect();
                self.open = Some(Switch { ticks, command_s });
            }
            None => {}
        }
        if self.open.as_ref().is_some_and(|open| open.ticks.len() >= BEFORE + AFTER) {
            let full = self.open.take();
            if interpolated(full.as_ref()) > interpolated(self.best.as_ref()) {
                self.best = full;
            }
        }
        if self.before.len() == BEFORE {
            self.before.pop_front();
        }
        self.before.push_back(tick);
    }

    pub(crate) fn finish(self) -> Option<Switch> {
        self.best
    }
}

fn interpolated(switch: Option<&Switch>) -> usize {
    switch.map_or(0, |switch| switch.ticks.iter().filter(|tick| tick.interpolated).count())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_switch_with_the_most_interpolated_ticks_is_kept() {
        let mut watch = SwitchWatch::default();
        for index in 0_u32..1000 {
            let since = index % 100;
            let interpolated = since < if (200..500).contains(&index) { 3 } else { 2 };
            let end_s = f64::from(index + 1);
            let sent = SentTick {
                sequence: index.into(),
                end_s,
                duration_s: 1.0,
                raw: [0.0; 3],
                truth: [0.0; 3],
                switch_command: since == 0,
            };
            watch.push(Tick { sent, corrected: [0.0; 3], interpolated });
        }
        let switch = watch.finish().unwrap();
        assert_eq!(switch.ticks.len(), BEFORE + AFTER);
        assert!((switch.command_s - 200.0).abs() < 1e-12);
        assert!(switch.ticks[BEFORE].sent.switch_command && switch.ticks[BEFORE].interpolated);
    }
}

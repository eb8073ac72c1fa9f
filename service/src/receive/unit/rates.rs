//! How much comes in, between two looks.

use std::time::Instant;

use isotherm_protocol::status::{Counter, InputRates};

/// Counters of what comes in, in the order of [`InputRates`].
const COUNTERS: [&str; 3] = ["gyro_ticks_in", "accel_ticks_in", "temperature_readings_in"];

/// Measures rates from counters.
#[derive(Debug)]
pub(super) struct Rates {
    messages: u64,
    last: (Instant, [u64; 4]),
    measured: InputRates,
}

impl Rates {
    pub(super) fn new(now: Instant) -> Self {
        Self { messages: 0, last: (now, [0; 4]), measured: InputRates::default() }
    }

    /// A message has come.
    pub(super) fn message(&mut self) {
        self.messages += 1;
    }

    /// Measures anew: the rates since the last time this was called.
    #[expect(clippy::cast_precision_loss, reason = "fewer than 2⁵³ messages")]
    pub(super) fn measure(&mut self, now: Instant, counters: &[Counter]) {
        let value = |name: &str| {
            counters.iter().find(|counter| counter.name == name).map_or(0, |counter| counter.value)
        };
        let [gyro, accel, temperature] = COUNTERS.map(value);
        let counts = [gyro, accel, temperature, self.messages];
        let (then, before) = std::mem::replace(&mut self.last, (now, counts));
        let elapsed_s = now.saturating_duration_since(then).as_secs_f64();
        if elapsed_s <= 0.0 {
            return;
        }
        let mut per_s =
            counts.iter().zip(before).map(|(now, then)| now.saturating_sub(then) as f64 / elapsed_s);
        let mut next = || per_s.next().unwrap_or_default();
        self.measured = InputRates {
            gyro_ticks_per_s: next(),
            accel_ticks_per_s: next(),
            temperature_readings_per_s: next(),
            messages_per_s: next(),
        };
    }

    /// The rates of the last interval that was measured.
    pub(super) fn rates(&self) -> InputRates {
        self.measured
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn rates_are_those_since_the_last_look() {
        let start = Instant::now();
        let mut rates = Rates::new(start);
        let counters = |value| [Counter { name: "gyro_ticks_in".to_owned(), value }];
        (0..50).for_each(|_| rates.message());
        rates.measure(start + Duration::from_millis(500), &counters(100));
        assert_eq!((rates.rates().gyro_ticks_per_s, rates.rates().messages_per_s), (200.0, 100.0));
        rates.measure(start + Duration::from_millis(1500), &counters(110));
        assert_eq!((rates.rates().gyro_ticks_per_s, rates.rates().messages_per_s), (10.0, 0.0));
    }
}

//! A simulated unit on the raw topics.

use isotherm_bus::{Producer, ProducerOptions};
use isotherm_correction::sample::OutputKind;
use isotherm_protocol::key::UnitId;
use isotherm_simulator::{Scenario, Simulation, Step};
use zenoh::Session;

/// Plays a scenario, as many ticks at a time as it is asked for.
#[derive(Debug)]
pub struct Player {
    producer: Producer,
    simulation: Simulation,
    output: OutputKind,
    accel_output: Option<OutputKind>,
}

impl Player {
    /// Declares the raw topics of the scenario's unit.
    ///
    /// # Panics
    /// Where nobody subscribes to them, or the scenario is wrong.
    pub async fn declare(session: &Session, scenario: &Scenario, options: ProducerOptions) -> Self {
        let unit = UnitId::new(&scenario.unit).expect("a serial");
        Self {
            producer: Producer::declare(session, &unit, options).await.expect("the service subscribes"),
            simulation: Simulation::new(scenario).expect("a sound scenario"),
            output: scenario.instrument.gyros.output_kind(),
            accel_output: scenario.instrument.accel_output_kind(),
        }
    }

    /// Sends the next ticks; those of a batch that is not full yet wait for [`Player::flush`].
    ///
    /// # Panics
    /// At the scenario's end, or where the service falls silent.
    pub async fn play(&mut self, ticks: u64) {
        for _ in 0..ticks {
            let Step { gyro, accel, temperatures, .. } =
                self.simulation.next().expect("the scenario is long enough");
            self.producer.temperatures(&temperatures).await.expect("sent");
            if let (Some(output), Some(tick)) = (self.accel_output, accel) {
                self.producer.accel(output, tick).await.expect("sent");
            }
            self.producer.gyro(self.output, gyro).await.expect("sent");
        }
    }

    /// Sends what waits for a full batch.
    ///
    /// # Panics
    /// Where the service falls silent.
    pub async fn flush(&mut self) {
        self.producer.flush().await.expect("sent");
    }

    /// Waits until everything sent has come back, where the options have it counted.
    ///
    /// # Panics
    /// Where it does not.
    pub async fn drain(&mut self) {
        self.producer.drain().await.expect("everything comes back");
    }
}

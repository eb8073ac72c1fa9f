//! A unit as the service has it: what it publishes, corrected frames and journal.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use isotherm_correction::operation::Command;
use isotherm_correction::unit::UnitSettings;
use isotherm_correction::units::Span;
use isotherm_protocol::codec::decode;
use isotherm_protocol::control::Schedule;
use isotherm_protocol::document::Document;
use isotherm_protocol::history::Source;
use isotherm_protocol::journal::{Joiner, JournalEntry, JournalEvent};
use isotherm_protocol::key::{self, UnitId};
use isotherm_protocol::stream::Label;
use isotherm_service::Settings;
use isotherm_service::control::change::Change;
use isotherm_service::control::compressed::Compressed;
use isotherm_service::control::document;
use isotherm_service::control::revision::{Calibrations, Revision};
use isotherm_service::receive::intake::Intake;
use isotherm_service::receive::unit::{Journal, Outlet, UnitActor};
use isotherm_tests::lives::{FULL_CHANNELS, full, place, pre_launch};
use isotherm_tests::script::{Accels, Scenario, Script, Step, UNIT};

use crate::plain::told;
use crate::recording::{Recording, hex};

const EXAMPLE: &str = include_str!("../../src/inputs/example-0001.toml");

/// What was published, in order.
enum Published {
    Corrected(Vec<u8>),
    Journal(Vec<u8>),
}

type Tape = Arc<Mutex<Vec<Published>>>;

/// An intake whose only clock is the one it is given.
fn intake(tape: &Tape) -> Intake {
    let corrected = Arc::clone(tape);
    let outlets = Box::new(move |_: &UnitId| {
        let tape = Arc::clone(&corrected);
        let outlet: Outlet = Box::new(move |frame| {
            tape.lock().unwrap().push(Published::Corrected(frame));
            Ok(())
        });
        Ok(outlet)
    });
    let tape = Arc::clone(tape);
    let outlet = Arc::new(move |_: &UnitId, frame: Vec<u8>| {
        tape.lock().unwrap().push(Published::Journal(frame));
        Ok(())
    });
    let journal = Journal { instance: "a1".into(), outlet };
    Intake::new(Settings::default(), Calibrations::default(), outlets).journaling_to(journal)
}

/// Has the service do what a scenario says. A self-test or a pre-launch calibration that gets no more ticks ends by the
/// clock, with what waits.
pub(crate) fn record(scenario: &Scenario) -> Recording {
    let (mut recording, tape) = (Recording::default(), Tape::default());
    let (intake, unit, mut joiner) = (intake(&tape), UnitId::new(UNIT).unwrap(), Joiner::new());
    let now = Instant::now();
    for (index, step) in scenario.steps.iter().enumerate() {
        match step {
            Step::Frame(input, frame) => {
                intake.receive(&key::input(&unit, *input), Some(frame), now);
            }
            Step::Event(event) => {
                let said = intake.each_unit(|actor| act(actor, event, now)).concat();
                recording.entry(format!("step {index}: {said}"));
            }
            Step::Give(_) => panic!("a service is given documents"),
        }
        for published in tape.lock().unwrap().drain(..) {
            match published {
                Published::Corrected(frame) => recording.frame(&frame),
                Published::Journal(frame) => journal(&frame, &mut joiner, &mut recording),
            }
        }
    }
    recording
}

fn act(actor: &mut UnitActor, event: &JournalEvent, now: Instant) -> String {
    match event {
        JournalEvent::Changed { revision, at, slew_ns, document, overlay, .. } => {
            let text = document.as_deref().unwrap();
            let parsed = Document::parse(text, None).unwrap();
            let label = Label { overlay: *overlay, ..Label::of(&parsed.document, parsed.digest, "") };
            let (calibration, text) = (Arc::new(parsed.calibration), Compressed::new(text.as_bytes()));
            let document = Arc::new(document::Document::new(calibration, label, text));
            let next = Revision::new(revision.counter, document, &Source::Bus);
            let change = Change { next: Arc::new(next), at: *at, slew: Span::from_ns(*slew_ns) };
            format!(
                "replaces {:?}, waiting {:?}",
                actor.change(change),
                actor.waiting().map(|(counter, _)| counter)
            )
        }
        JournalEvent::Commanded { command, .. } => match actor.command(command) {
            Ok(state) => state.to_string(),
            Err(refusal) => refusal.to_string(),
        },
        JournalEvent::Flushed => {
            actor.flush();
            "flushed".to_owned()
        }
        JournalEvent::SelfTestExpired | JournalEvent::PreLaunchEnded => {
            actor.tend(now + Duration::from_secs(3600));
            "an hour later".to_owned()
        }
        JournalEvent::Began { .. } => {
            actor.reset("told to");
            "alarm".to_owned()
        }
        JournalEvent::Memory { .. } | JournalEvent::Ended => panic!("not to be acted"),
    }
}

/// What a journal's frame holds: all of it but the memory, whose form may change.
fn journal(frame: &[u8], joiner: &mut Joiner, recording: &mut Recording) {
    let entry: Option<JournalEntry> = joiner.join(decode(frame).unwrap()).unwrap();
    match entry {
        Some(JournalEntry { number, event: JournalEvent::Memory { document, pending, .. }, .. }) => {
            recording.entry(format!("journal {number}: memory beside {document:?} and {pending:?}"));
        }
        Some(JournalEntry { number, heard, event, .. }) => {
            let heard = heard.map(|heard| format!("{} {:x}", heard.frames, heard.crc)).join(" ");
            recording.entry(format!("journal {number}: {} behind {heard}: {}", event.name(), hex(frame)));
        }
        None => recording.entry(format!("journal: part of an entry: {}", hex(frame))),
    }
}

/// The example with another note: another digest, and the same calibration but for what is replaced.
fn example(note: &str) -> String {
    EXAMPLE.replace("Every key once", note)
}

/// Documents at once, later and slewed; commands; silences; an alarm; mishaps in between.
pub(crate) fn service_and_its_journal() -> Scenario {
    let mut script = Script::new(141, &full(), &FULL_CHANNELS);
    script.steps.clear();
    (script.batch, script.switches, script.mishaps) = (3, 80, 2);
    script.ticks(60);
    script.document(EXAMPLE, Schedule::NextTick, Span::ZERO);
    script.ticks(150);
    script.document(&example("Once more"), Schedule::Sequence(script.next + 40), Span::from_ms(200));
    script.document(&example("Twice more"), Schedule::Sequence(script.next + 60), Span::from_ms(200));
    script.command(Command::Standby, true);
    script.ticks(30);
    script.command(Command::Run { reversal: None }, true);
    script.ticks(150);
    script.document(&example("Thrice more"), Schedule::TimeNs(script.now_ns + 200_000_000), Span::ZERO);
    script.reference();
    script.ticks(120);
    script.command(Command::Rest(place()), true);
    script.command(Command::Abort, false);
    script.accels = Accels::Lost(100);
    script.ticks(6);
    script.event(JournalEvent::Flushed);
    script.event(JournalEvent::Flushed);
    script.accels = Accels::Before;
    script.restart();
    script.ticks(60);
    script.command(Command::Standby, true);
    script.command(Command::SelfTest, true);
    script.ticks(30);
    script.event(JournalEvent::SelfTestExpired);
    script.command(pre_launch(Span::from_ms(65_000)), true);
    script.ticks(30);
    script.event(JournalEvent::PreLaunchEnded);
    script.command(Command::Run { reversal: Some(false) }, true);
    script.ticks(60);
    script.document(&example("Again"), Schedule::Sequence(script.next + 100), Span::ZERO);
    let settings = UnitSettings::default();
    script.event(JournalEvent::Began { settings, highest_revision: 0 });
    script.ticks(160);
    told(script)
}

/// The same events as a stream carries them out that follows a journal.
pub(crate) fn stream_that_follows_a_journal() -> Scenario {
    let mut scenario = service_and_its_journal();
    scenario.steps.push(Step::Event(JournalEvent::Ended));
    scenario
}

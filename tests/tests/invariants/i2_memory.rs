//! I2 over a memory: a stream that is written down at any moment, read back and gone on with gives the same bits as one
//! that was not.

use isotherm_correction::operation::State;
use isotherm_protocol::stream::{InForce, Label, MemoryError, UnitStream};
use isotherm_tests::dice::Dice;
use isotherm_tests::lives;
use isotherm_tests::script::{Scenario, Step};
use proptest::prelude::*;

/// Everything that a stream gives: frames as they go out, first outputs of revisions, the memory at the end.
#[derive(PartialEq)]
struct Given {
    frames: Vec<Vec<u8>>,
    in_force: Vec<InForce>,
    memory: Vec<u8>,
}

/// Takes the steps; writes the stream down and reads it back before each step that `cut` says.
fn run(scenario: &Scenario, mut cut: impl FnMut(usize, &UnitStream) -> bool) -> Given {
    let mut stream = scenario.stream();
    let (mut frames, mut in_force) = (Vec::new(), Vec::new());
    for (index, step) in scenario.steps.iter().enumerate() {
        if cut(index, &stream) {
            let memory = stream.memory();
            stream = UnitStream::from_memory(&memory).unwrap();
            assert!(stream.memory() == memory, "{}: nothing is lost on the way", scenario.name);
        }
        match step {
            // A bad frame is part of what happens.
            Step::Frame(input, frame) => drop(stream.receive(*input, frame)),
            Step::Event(event) => stream.carry_out(event).unwrap(),
            Step::Give(change) => {
                let _ = stream.schedule(change.clone(), Label::default());
            }
        }
        let mut frame = Vec::new();
        // Some outputs wait in the stream over the next cut.
        while !index.is_multiple_of(3) && stream.next_frame(&mut frame).is_some() {
            frames.push(frame.clone());
        }
        in_force.extend(std::iter::from_fn(|| stream.take_in_force()));
    }
    let mut frame = Vec::new();
    while stream.next_frame(&mut frame).is_some() {
        frames.push(frame.clone());
    }
    Given { frames, in_force, memory: stream.memory() }
}

/// Compares a run with cuts with one without, and sees to it that the cuts met what the scenario is about.
fn holds(scenario: &Scenario, cuts: usize, seed: u64) {
    let plain = run(scenario, |_, _| false);
    assert!(plain.frames.len() > 20, "{}: it gives something out", scenario.name);
    let mut dice = Dice::new(seed);
    let steps = scenario.steps.len() as u64;
    let places: std::collections::BTreeSet<u64> = (0..cuts).map(|_| dice.below(steps)).collect();
    let mut met = vec![false; scenario.meets.len()];
    let cut = run(scenario, |index, stream| {
        let cut = places.contains(&(index as u64));
        if cut {
            for (met, (_, meets)) in met.iter_mut().zip(&scenario.meets) {
                *met |= meets(stream);
            }
        }
        cut
    });
    let differs = plain.frames.iter().zip(&cut.frames).position(|(a, b)| a != b);
    assert!(plain == cut, "{}, seed {seed}: differs from frame {differs:?} on", scenario.name);
    for (met, (what, _)) in met.into_iter().zip(&scenario.meets) {
        assert!(met, "{}: no cut has met it {what}", scenario.name);
    }
}

#[test]
fn i2_a_stream_that_was_written_down_goes_on_to_the_same_bits() {
    for scenario in lives::all() {
        for seed in 0..3 {
            holds(&scenario, 250, seed);
        }
    }
}

#[test]
fn i2_a_stream_that_is_written_down_before_every_step_gives_the_same_bits() {
    let scenario = lives::anything(1, 400);
    let plain = run(&scenario, |_, _| false);
    assert!(run(&scenario, |_, _| true) == plain);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn i2_whatever_happens_a_memory_changes_no_bit(seed in any::<u64>()) {
        holds(&lives::anything(seed, 300), 60, seed);
    }
}

#[test]
fn a_memory_of_another_version_and_a_damaged_one_are_refused_with_words() {
    let scenario = lives::anything(1, 100);
    let memory = run(&scenario, |_, _| false).memory;
    let read = UnitStream::from_memory(&memory).unwrap();
    assert_ne!(read.unit().state(), State::PreLaunchCalibration);
    for length in [0, 3, 4, 40, memory.len() - 1] {
        assert!(UnitStream::from_memory(&memory[..length]).is_err(), "{length} bytes");
    }
    let mut dice = Dice::new(5);
    for _ in 0..200 {
        let mut damaged = memory.clone();
        let place = usize::try_from(dice.below(memory.len() as u64)).unwrap();
        damaged[place] ^= 1 << dice.below(8);
        assert!(matches!(UnitStream::from_memory(&damaged), Err(MemoryError::Checksum { .. })));
    }
}

//! When and how fast a swap takes effect.

use isotherm_protocol::control::{Schedule, SwapOptions, SwapOutcome};
use isotherm_protocol::history::{AuditEvent, Withdrawn};

use super::stand::{Folders, Stand, TICK_NS, UNIT, assert_accepted, document};

fn at(schedule: Schedule) -> SwapOptions {
    SwapOptions { schedule, ..SwapOptions::default() }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_swap_waits_for_its_tick_or_its_time() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &SwapOptions::default()).await, 1);
    stand.revisions(UNIT, 10).await;

    let reply = stand.swap(UNIT, &document(UNIT, 2.0), &at(Schedule::Sequence(30))).await;
    assert_accepted(&reply, 2);
    let status = stand.status(UNIT);
    assert_eq!(status.calibration.unwrap().revision.counter, 1);
    let pending = status.pending.unwrap();
    assert_eq!((pending.revision.counter, pending.schedule), (2, Schedule::Sequence(30)));
    let ticks = stand.run_unit(UNIT, 40).await;
    assert!(ticks.iter().all(|(revision, tick)| (*revision == 2) == (tick.sequence >= 30)));

    let reply = stand.swap(UNIT, &document(UNIT, 3.0), &at(Schedule::TimeNs(71 * TICK_NS))).await;
    assert_accepted(&reply, 3);
    let ticks = stand.run_unit(UNIT, 40).await;
    assert!(ticks.iter().all(|(revision, tick)| (*revision == 3) == (tick.sequence >= 70)));
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_swap_that_waits_is_withdrawn_by_the_next_one() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &SwapOptions::default()).await, 1);
    stand.revisions(UNIT, 10).await;
    let later = at(Schedule::Sequence(1000));
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 2.0), &later).await, 2);
    let reply = stand.swap(UNIT, &document(UNIT, 2.0), &later).await;
    assert_eq!(reply.outcome, SwapOutcome::Unchanged, "it waits already");
    // The same document, but now: that is another swap.
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 2.0), &SwapOptions::default()).await, 3);
    let why = stand
        .until(UNIT, |event| match event {
            AuditEvent::Withdrawn(withdrawal) if withdrawal.revision == 2 => Some(withdrawal.why),
            _ => None,
        })
        .await;
    assert_eq!(why, Withdrawn::Superseded { by_revision: 3 });
    assert_eq!(stand.revisions(UNIT, 10).await, [3]);
    stand.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_slewed_swap_moves_from_the_old_output_to_the_new_without_a_jump() {
    let folders = Folders::new();
    let mut stand = Stand::start(folders.settings()).await;
    assert_accepted(&stand.swap(UNIT, &document(UNIT, 1.0), &SwapOptions::default()).await, 1);
    let before = stand.run_unit(UNIT, 40).await.last().unwrap().1.clone();
    let slewed = SwapOptions { slew_s: Some(0.5), ..SwapOptions::default() };
    let reply = stand.swap(UNIT, &document(UNIT, 101.0), &slewed).await;
    assert_accepted(&reply, 2);
    assert!((reply.slew_s - 0.5).abs() < 1e-9);
    let ticks = stand.run_unit(UNIT, 200).await;
    let whole = 100.0_f64.to_radians() / 3600.0 * 0.005;
    let mut last = before.delta_angle[0];
    for (revision, tick) in &ticks {
        assert_eq!(*revision, 2);
        let step = (tick.delta_angle[0] - last).abs();
        assert!(step < 0.02 * whole, "tick {}: {step} of {whole}", tick.sequence);
        last = tick.delta_angle[0];
    }
    assert!((before.delta_angle[0] - last - whole).abs() < 0.01 * whole);
    stand.stop().await;
}

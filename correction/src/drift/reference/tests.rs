use alloc::string::ToString;

use super::*;

fn reference(start_s: u32, end_s: u32) -> Reference {
    let at = |s| Timestamp::from_ns(i64::from(s) * 1_000_000_000);
    Reference { start: at(start_s), end: at(end_s), angular_rate: [1e-5, 2e-5, 3e-5], sigma: 1e-8 }
}

#[test]
fn what_is_wrong_with_a_reference_by_itself_is_said_with_its_value() {
    assert_eq!(reference(0, 60).check(), Ok(()));
    assert_eq!(reference(0, 1).check(), Ok(()));
    let said = |start_s, end_s| reference(start_s, end_s).check().unwrap_err().to_string();
    assert_eq!(said(0, 121), "the span is 121.000 s, at most 120 s are kept");
    assert_eq!(said(7, 7), "the span is 0.000 s, at least 1 s are needed");
    assert_eq!(said(60, 0), "the span is -60.000 s, at least 1 s are needed");
    let broken = [
        Reference { angular_rate: [0.0, f64::NAN, 0.0], ..reference(0, 60) },
        Reference { angular_rate: [0.0, 0.0, f64::INFINITY], ..reference(0, 60) },
        Reference { angular_rate: [-1001.0, 0.0, 0.0], ..reference(0, 60) },
        Reference { sigma: f64::NAN, ..reference(0, 60) },
        Reference { sigma: -1e-9, ..reference(0, 60) },
        Reference { sigma: 1.1, ..reference(0, 60) },
    ];
    for reference in broken {
        assert_eq!(reference.check(), Err(ReferenceRefusal::NotPlausible), "{reference:?}");
    }
}

#[test]
fn references_leave_in_the_order_of_their_time_whatever_the_order_of_arrival() {
    let mut all = [reference(0, 60), reference(60, 120), reference(30, 120), reference(120, 180)];
    let mut twin = all[1];
    twin.angular_rate[2] += 1e-9;
    let leave = |arrived: &[Reference]| {
        let mut waiting = Waiting::default();
        for reference in arrived {
            assert_eq!(waiting.push(reference), None);
        }
        let mut left = alloc::vec::Vec::new();
        while let Some(reference) = waiting.pop_if(|_| true) {
            left.push(reference);
        }
        left
    };
    let forwards = leave(&[all[0], all[1], twin, all[2], all[3]]);
    all.reverse();
    assert_eq!(leave(&[all[0], twin, all[1], all[2], all[3]]), forwards);
    assert!(forwards.is_sorted_by_key(|reference| reference.end));
}

#[test]
fn the_one_furthest_in_the_future_makes_room() {
    let mut waiting = Waiting::default();
    let broken = reference(2_000_000_000, 2_000_000_060);
    assert_eq!(waiting.push(&broken), None);
    for k in 1..16 {
        assert_eq!(waiting.push(&reference(60 * k, 60 * k + 60)), None);
    }
    assert_eq!(waiting.push(&reference(0, 60)), Some(broken));
    let later = reference(6000, 6060);
    assert_eq!(waiting.push(&later), Some(later));
    assert_eq!(waiting.references.len(), MAX_WAITING_REFERENCES);
}

#[test]
fn every_refusal_has_a_counter_of_its_own() {
    let refusals = [
        ReferenceRefusal::NoDrift,
        ReferenceRefusal::NotPlausible,
        ReferenceRefusal::TooShort { got_s: 0.0, min_s: 1.0 },
        ReferenceRefusal::TooLong { got_s: 200.0, max_s: 120.0 },
        ReferenceRefusal::TooMany,
        ReferenceRefusal::TooOld,
        ReferenceRefusal::Overlap,
        ReferenceRefusal::Gap,
        ReferenceRefusal::Gated,
        ReferenceRefusal::Restarted,
    ];
    let mut counters = ReferenceCounters::default();
    for (n, refusal) in refusals.into_iter().enumerate() {
        counters.refuse(refusal);
        assert_eq!(counters.iter().filter(|(_, count)| *count == 1).count(), n + 1, "{refusal}");
    }
}

//! Floods, turns and the end.

use super::*;
use isotherm_protocol::corrected::Revision;
use isotherm_protocol::stream::InForce;

fn unit(serial: &str) -> UnitId {
    UnitId::new(serial).unwrap()
}

fn of(serial: &str) -> Lane {
    Lane::Unit(unit(serial))
}

/// A request that is known by its unit.
fn request(serial: &str) -> Message {
    let revision = Revision::default();
    let first = InForce { revision, series: 0, sequence: 0, end_time_ns: 0 };
    Message::Notice(unit(serial), Notice::InForce(first))
}

/// Whose requests come out, in their order.
fn served(queue: &Inbox) -> Vec<String> {
    let mut order = Vec::new();
    while let Ok(Some(Message::Notice(unit, _))) = queue.take(Duration::ZERO) {
        order.push(unit.to_string());
    }
    order
}

#[test]
fn a_flood_for_one_unit_or_for_invented_ones_makes_no_other_wait() {
    let queue = Inbox::default();
    queue.know([unit("A"), unit("B")].iter());
    let mut refused = 0;
    for n in 0..1500 {
        refused += usize::from(queue.push(of("A"), request("A"), 1 << 20).is_err());
        let invented = format!("X{n}");
        refused += usize::from(queue.push(of(&invented), request(&invented), 1 << 20).is_err());
    }
    assert_eq!(refused, 3000 - 16, "eight megabytes of each lane");
    queue.push(of("B"), request("B"), 1 << 20).unwrap();
    queue.push(Lane::Several, request("all"), 10).unwrap();
    queue.tell(request("own")).unwrap();
    let order = served(&queue);
    assert_eq!(order.len(), 19);
    for serial in ["A", "B", "all", "own"] {
        assert!(order[..5].contains(&serial.to_owned()), "{serial} in {order:?}");
    }
    assert_eq!(order[5..].iter().filter(|serial| *serial == "A").count(), 7, "in turn with the others");
}

#[test]
fn what_waits_is_finished_and_nothing_more_is_taken() {
    let queue = Inbox::default();
    queue.push(of("A"), request("A"), 0).unwrap();
    queue.stop();
    assert_eq!(queue.push(of("A"), request("A"), 0).unwrap_err().1, Refused::Ended);
    queue.tell(request("own")).unwrap();
    assert_eq!(served(&queue), ["own", "A"]);
    assert_eq!(queue.take(Duration::ZERO).unwrap_err(), Stopped);
    queue.end();
    queue.tell_in_turn(request("own"));
    assert!(queue.tell(request("own")).is_err());
}

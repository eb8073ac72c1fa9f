//! The fourth generation, byte by byte: corrected batches with standard errors.
//!
//! If a test here fails, do not change the test: the change to the messages makes readers in the field fail. Make a new version
//! instead (`protocol/src/version.rs` has the policy) and leave this file as it is.

use isotherm_correction::sample::{CorrectedTick, LasingMode, SensorFlags, TickFlags};
use isotherm_correction::sigma::{Causes, Sigma};
use isotherm_correction::units::{Span, Timestamp};
use isotherm_protocol::codec::{decode, encode};
use isotherm_protocol::corrected::{AppliedTemperature, CorrectedBatch, Revision, SigmaRun, are_same};

use super::bytes;

mod frames;

pub(super) use frames::FRAMES;

fn tick(index: u8) -> CorrectedTick {
    let lost = index == 1;
    let flags =
        |valid| (0..3).map(|_| if valid { SensorFlags::VALID } else { SensorFlags::empty() }).collect();
    let noise = if lost { [0.0; 3] } else { [2e-6, 2.5e-6, 2e-6] };
    let clamping = if index == 2 { [f64::NAN; 3] } else { [0.0; 3] };
    let angle = Causes {
        noise,
        restoration: if lost { [5e-6, 6e-6, 5e-6] } else { [0.0; 3] },
        calibration: [1e-9, 0.5e-9, 1e-9],
        clamping,
    };
    let velocity = Causes { noise: [1e-5, 1e-5, 1.5e-5], calibration: [f64::NAN; 3], ..Causes::default() };
    CorrectedTick {
        sequence: 1000 + u64::from(index),
        end_time: Timestamp::from_ns(5_000_000 * (i64::from(index) + 1)),
        duration: Span::from_ns(5_000_000),
        ticks: 1,
        missed: 0,
        delta_angle: [3.5e-7, -1.25e-5, 2e-6],
        delta_velocity: [0.0, 0.0, 0.049],
        mode: Some(if index == 0 { LasingMode::Plus } else { LasingMode::Minus }),
        flags: if lost { TickFlags::INTERPOLATED } else { TickFlags::empty() },
        gyro_flags: flags(!lost),
        accel_flags: flags(true),
        gyro_parity: [].into_iter().collect(),
        accel_parity: [].into_iter().collect(),
        revision: 3,
        series: 0,
        sigma: Some(Box::new(Sigma { angle, velocity })),
    }
}

#[test]
fn corrected_with_standard_errors() {
    let ticks: Vec<_> = (0..3).map(tick).collect();
    let body = AppliedTemperature {
        channel: "body".try_into().expect("a short name"),
        temperature_deg_c: 25.125,
        rate_deg_c_per_s: -0.0166,
    };
    let batch = CorrectedBatch {
        unit: "ZLG-0042".to_owned(),
        series: 0,
        revision: Revision { counter: 3, digest: [0x01, 0x23, 0x45, 0x67, 0x89, 0xab, 0xcd, 0xef] },
        temperatures: [body].into_iter().collect(),
        sigmas: SigmaRun::of(&ticks),
        ticks,
    };
    assert_eq!(batch.sigmas.iter().map(|run| run.from_tick).collect::<Vec<_>>(), [0, 1, 2]);
    let (name, hex) = FRAMES[0];
    let frozen = bytes(hex);
    assert_eq!(encode(&batch).expect("a batch"), frozen, "{name} is written");
    let read: CorrectedBatch = decode(&frozen).expect("a good frame");
    assert_eq!(read.sigmas, batch.sigmas);
    assert!(read.ticks.iter().zip(&batch.ticks).all(|(read, tick)| are_same(read, tick)), "{name} is read");
}

#[test]
fn ticks_alike_share_their_standard_errors() {
    let first = tick(0);
    let alike = CorrectedTick { sequence: 1001, ..first.clone() };
    let runs = SigmaRun::of([&first, &alike, &tick(2)]);
    assert_eq!(runs.iter().map(|run| run.from_tick).collect::<Vec<_>>(), [0, 2]);
    let other = CorrectedTick { sigma: tick(1).sigma, ..first.clone() };
    assert!(are_same(&first, &first.clone()) && !are_same(&first, &other));
}

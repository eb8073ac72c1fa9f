use super::*;

const TICK_S: f64 = 0.005;

fn unit() -> Zeeman {
    let crate::instrument::Gyros::Zeeman(zeeman) = crate::presets::zeeman_rest(1).instrument.gyros else {
        panic!("the preset is a Zeeman unit")
    };
    zeeman
}

fn state(unit: &Zeeman) -> ZeemanState {
    ZeemanState::new(unit, &unit.gyros[0], 1, 0, 0.25, unit.gyros[0].reference_deg_c)
}

fn phase(mode: LasingMode) -> Phase {
    Phase { mode, ..Phase::UNSWITCHED }
}

#[test]
fn the_mode_turns_the_sign_of_the_magnetic_drift_only() {
    let unit = unit();
    let gyro = unit.gyros[0];
    let mut state = state(&unit);
    let plus = state.tick([0.0; 2], TICK_S, 0.0, phase(LasingMode::Plus)).drift_rad_per_s;
    let minus = state.tick([0.0; 2], TICK_S, 0.0, phase(LasingMode::Minus)).drift_rad_per_s;
    assert!((0.5 * (plus - minus) - gyro.bias_magnetic_rad_per_s[0]).abs() < 1e-18);
    let meander = gyro.meander_rad_per_s[0] + gyro.meander_rad_per_s[1] * (gyro.reference_deg_c - 25.0);
    assert!((0.5 * (plus + minus) - gyro.bias_nonmagnetic_rad_per_s[0] - meander).abs() < 1e-18);
}

#[test]
fn whole_counts_keep_the_accumulated_phase_within_one_count() {
    let exact = Zeeman { quantised: false, ..unit() };
    let quantised = Zeeman { quantised: true, ..unit() };
    let (mut exact, mut quantised) = (state(&exact), state(&quantised));
    let mut difference = 0.0_f64;
    for tick in 0..20_000 {
        let halves = [1e-4 * libm::sin(0.01 * f64::from(tick)), 3e-5];
        let phase = phase(LasingMode::Plus);
        let whole = quantised.tick(halves, TICK_S, 0.0, phase);
        assert!(libm::fabs(whole.counts - libm::round(whole.counts)) < 1e-12);
        assert_eq!(whole.halves.positive + whole.halves.negative, super::whole(whole.counts));
        difference += whole.counts - exact.tick(halves, TICK_S, 0.0, phase).counts;
        assert!(difference.abs() < 1.0, "tick {tick}: {difference}");
    }
}

/// Integrates the dithered counter numerically from the perimeter's miss and compares each tick, and the formula
/// of the correction model, `ΔΩ_i = ±K·(Δt/2τ)·(f_i − f0)`, good to the next order in Δt/τ: for electronics that invert the
/// field with the mode and for such that do not.
#[test]
fn the_servo_transient_is_what_numerical_integration_gives() {
    for (turns, mode, sign) in [
        (false, LasingMode::Plus, 1.0),
        (false, LasingMode::Minus, 1.0),
        (true, LasingMode::Plus, 1.0),
        (true, LasingMode::Minus, -1.0),
    ] {
        let mut unit = Zeeman { quantised: false, ..unit() };
        unit.reversal.dither_turns_with_mode = turns;
        transient_is_as_integrated(&unit, mode, sign);
    }
}

/// `first` is the sign of the dither in the first half of a tick.
fn transient_is_as_integrated(unit: &Zeeman, mode: LasingMode, first: f64) {
    let mut state = state(unit);
    let gyro = unit.gyros[0];
    let reversal = unit.reversal;
    let mut largest = 0.0_f64;
    for tick in 0..40_u32 {
        let phase = Phase { servo_starts: tick == 0, ..phase(mode) };
        let result = state.tick([0.0; 2], TICK_S, 0.0, phase);
        let loss = state.dither_loss;
        let frequency = |time_s: f64| {
            let miss_share = libm::exp(-time_s / reversal.servo_time_constant_s);
            gyro.dither_hz[0] * (1.0 - loss * miss_share * miss_share)
        };
        let count = 2000_u32;
        let part_s = 0.5 * TICK_S / f64::from(count);
        let begin_s = f64::from(tick) * TICK_S;
        let half = |from_s: f64| {
            (0..count).map(|part| frequency(from_s + (f64::from(part) + 0.5) * part_s) * part_s).sum::<f64>()
        };
        let (one, other) = (first * half(begin_s), first * half(begin_s + 0.5 * TICK_S));
        let numerical = gyro.scale_rad_per_count * (one - other) / TICK_S;
        assert!((result.transient_rad_per_s - numerical).abs() < 1e-10, "tick {tick}");
        // Its own drift apart, the counts are those of the halves.
        let drift = 0.5 * result.drift_rad_per_s * TICK_S / gyro.scale_rad_per_count;
        let counted = [result.halves.positive, result.halves.negative].map(|half| f64::from(half) - drift);
        assert!(
            (counted[0] - one).abs() < 1.5 && (counted[1] + other).abs() < 1.5,
            "{counted:?}, {one}, {other}"
        );
        let measured_hz = first * (one + other) / TICK_S;
        let model = first * gyro.scale_rad_per_count * TICK_S / (2.0 * reversal.servo_time_constant_s)
            * (measured_hz - gyro.dither_hz[0]);
        assert!(
            (model - numerical).abs() < 0.01 * numerical.abs() + 1e-12,
            "tick {tick}: {model} {numerical}"
        );
        largest = largest.max(numerical.abs());
    }
    assert!(largest > 1e-6, "the transient is there: {largest}");
}

#[test]
fn lost_ticks_carry_nothing_of_the_input() {
    let unit = unit();
    let lost = Phase { lost: true, ..phase(LasingMode::Plus) };
    let mut still = state(&unit);
    let mut turning = state(&unit);
    for _ in 0..10 {
        let counts = still.tick([0.0; 2], TICK_S, 0.0, lost).counts;
        assert!((counts - turning.tick([1e-3; 2], TICK_S, 0.0, lost).counts).abs() < 1e-12);
    }
}

#[test]
fn lock_in_bends_the_scale_where_the_rate_comes_near_the_dither() {
    let mut unit = Zeeman { quantised: false, ..unit() };
    let gyro = &mut unit.gyros[0];
    (gyro.bias_nonmagnetic_rad_per_s, gyro.bias_magnetic_rad_per_s) = ([0.0; 3], [0.0; 3]);
    (gyro.meander_rad_per_s, gyro.noise) = ([0.0; 2], GyroNoise::default());
    gyro.lock_in_rad_per_s = 0.2_f64.to_radians();
    let (k, lock_in) = (gyro.scale_rad_per_count, gyro.lock_in_rad_per_s);
    let dither = k * gyro.dither_hz[0];
    let read = |rate: f64| {
        let counts = state(&unit).tick([0.5 * rate * TICK_S; 2], TICK_S, 0.0, phase(LasingMode::Plus)).counts;
        k * counts / TICK_S
    };
    for share in [0.01, 0.5, 0.9, 1.1, 3.0] {
        let rate = share * dither;
        // Adler's equation ψ̇ = R − Ω_L·sin ψ, integrated over many turns in either half period.
        let half = |rate: f64| {
            let (steps, turns) = (4000, 30.0);
            let step = turns * 2.0 * core::f64::consts::PI / rate.abs() / f64::from(steps);
            let slope = |psi: f64| rate - lock_in * libm::sin(psi);
            let mut psi = 0.0_f64;
            // Whole turns only: the time that each takes is the same.
            let (mut time, mut turned) = (0.0, 0.0);
            for _ in 0..10 * steps {
                let k1 = slope(psi);
                let k2 = slope(psi + 0.5 * step * k1);
                let k3 = slope(psi + 0.5 * step * k2);
                let k4 = slope(psi + step * k3);
                let next = psi + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
                time += step;
                psi = next;
                turned = psi;
            }
            turned / time
        };
        let expected = 0.5 * (half(rate + dither) + half(rate - dither));
        // A part of a turn is left over in the integration: at most Ω_L of a rate over 300 turns.
        assert!((read(rate) - expected).abs() < 1e-3 * lock_in, "{share}: {} {expected}", read(rate));
    }
    // Without dither nothing is counted below the lock-in rate.
    unit.gyros[0].dither_hz = [0.0; 3];
    let still = state(&unit).tick([0.4 * lock_in * TICK_S; 2], TICK_S, 0.0, phase(LasingMode::Plus));
    assert!(still.counts.abs() < 1e-12);
}

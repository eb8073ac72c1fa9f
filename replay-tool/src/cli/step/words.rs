//! One event of a state machine in words.

use std::fmt::Write as _;

use isotherm_log::replica::stepper::{Step, What};

/// What happened, and what it did.
pub(super) fn step(step: &Step) -> String {
    let mut text = format!("#{} {}\n", step.number, what(&step.what));
    let mut line = |name: &str, words: String| {
        if !words.is_empty() {
            let _ = writeln!(text, "    {name:<12} {words}");
        }
    };
    let revision = match (step.revision, step.pending) {
        (0, None) => "uncalibrated".to_owned(),
        (0, Some(pending)) => format!("uncalibrated, {pending} waits"),
        (revision, None) => format!("revision {revision}"),
        (revision, Some(pending)) => format!("revision {revision}, {pending} waits"),
    };
    let waiting = match step.waiting_ticks {
        0 => String::new(),
        1 => ", 1 tick waits".to_owned(),
        count => format!(", {count} ticks wait"),
    };
    line("state", format!("{}, {revision}{waiting}", step.state.unwrap_or("no stream yet")));
    for tick in &step.out {
        let vector = |vector: &[f64; 3]| vector.map(|value| format!("{value:?}")).join(" ");
        let missed =
            if tick.missed > 0 { format!(", {} missed before it", tick.missed) } else { String::new() };
        let mode = tick.mode.map(|mode| format!(", mode {mode:+}")).unwrap_or_default();
        let flags = if tick.flags.is_empty() { String::new() } else { format!(", {}", tick.flags.join(" ")) };
        let head = format!("tick {} (revision {}{mode}{missed}{flags})", tick.sequence, tick.revision);
        line("out", head);
        line("", format!("Δθ {} rad", vector(&tick.delta_angle_rad)));
        line("", format!("Δv {} m/s", vector(&tick.delta_velocity_m_per_s)));
    }
    // What was applied, where anything was: to a tick, or to what a journal's entry leads to.
    let applied = !step.out.is_empty() || matches!(step.what, What::Entry { .. });
    for channel in step.temperatures.iter().filter(|_| applied) {
        let state = match (channel.stale, channel.warming_up) {
            (true, _) => ", stale",
            (false, true) => ", warming up",
            (false, false) => "",
        };
        let value = match (channel.temperature_deg_c, channel.rate_deg_c_per_s) {
            (Some(temperature), Some(rate)) => format!("{temperature:.4} °C, {:+.4} °C/min", rate * 60.0),
            _ => "no reading yet".to_owned(),
        };
        line("temperature", format!("{} {value}{state}", channel.channel));
    }
    let axes = |values: [f64; 3], unit_of_measure: &str| {
        let [x, y, z] = values;
        format!("x {x:.6}  y {y:.6}  z {z:.6} {unit_of_measure}")
    };
    line("bias", step.bias_deg_per_h.filter(|_| applied).map(|bias| axes(bias, "°/h")).unwrap_or_default());
    line("", step.bias_mg.filter(|_| applied).map(|bias| axes(bias, "mg")).unwrap_or_default());
    let counters: Vec<_> = step
        .counters
        .iter()
        .map(|counter| format!("{} +{} = {}", counter.name, counter.by, counter.to))
        .collect();
    line("counters", counters.join(", "));
    text
}

fn what(what: &What) -> String {
    match what {
        What::Frame { input, bad: Some(bad), .. } => format!("{input} frame that cannot be read: {bad}"),
        What::Frame { input, first_sequence, ticks, from_ns, to_ns, .. } => {
            let sequences = match first_sequence {
                Some(first) if *ticks > 1 => format!(" {first} to {}", first + *ticks as u64 - 1),
                Some(first) => format!(" {first}"),
                None => String::new(),
            };
            let times = match (from_ns, to_ns) {
                (Some(from), Some(to)) if from != to => format!(", {from} to {to} ns"),
                (Some(at), _) => format!(", {at} ns"),
                _ => String::new(),
            };
            format!("{input}{sequences}{times}")
        }
        What::Entry { words, left_out: true, .. } => format!("journal, {words} (left out)"),
        What::Entry { words, .. } => format!("journal, {words}"),
        What::Notice { words } => format!("warning: {words}"),
        What::Flushed => "end of the log: waiting ticks are released".to_owned(),
    }
}

//! One line a service instance, and how many units are in which state.

use isotherm_cli::grouped;
use isotherm_protocol::pair::PairReport;
use isotherm_protocol::service_status::{FolderState, ServiceStatus};
use isotherm_protocol::status::State;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::figure::{fit, of, since, width};
use super::pairs::name;
use super::remark::Level;
use super::{Unit, state_word, tone};

/// Bad documents that are named; more of them are counted.
const NAMED: usize = 3;

/// The lines of all instances; `gone` says of which nobody answers any more.
#[must_use]
pub fn services(
    (services, gone): (&[ServiceStatus], &[String]),
    instances: &[PairReport],
    columns: usize,
) -> Vec<Line<'static>> {
    let lines = services.iter().flat_map(|service| {
        let is_gone = gone.contains(&service.instance);
        let mut lines = vec![line(service, &name(instances, &service.instance), is_gone, columns)];
        if !is_gone {
            lines.extend(troubles(service, columns));
        }
        lines
    });
    lines.collect()
}

/// One instance: what does not fit is left out, the least important first.
fn line(service: &ServiceStatus, name: &str, gone: bool, columns: usize) -> Line<'static> {
    let uptime = std::time::Duration::try_from_secs_f64(service.uptime_s.max(0.0)).unwrap_or_default();
    let uptime = if gone { "gone".to_owned() } else { format!("up {}", since(uptime)) };
    // With the weight of each: the larger, the sooner it is left out.
    let mut parts = vec![
        (0, format!("service {name}")),
        (2, format!("version {}", service.version)),
        (0, uptime),
        (1, of(service.units.len(), "unit")),
        (3, format!("swaps {}, refused {}", grouped(service.swaps_accepted), grouped(service.swaps_refused))),
    ];
    if let Some(pid) = service.pid {
        parts.push((6, format!("pid {pid}")));
    }
    if let Some(folder) = &service.calibrations {
        let state = match folder.state {
            FolderState::Watching => "watched",
            FolderState::Polling => "polled",
            FolderState::Gone => "gone",
        };
        parts.push((4, format!("calibrations {} ({state})", folder.path)));
    }
    match &service.store {
        Some(store) => {
            let entries = match store.audit_entries {
                1 => "1 audit entry".to_owned(),
                entries => format!("{} audit entries", grouped(entries)),
            };
            parts.push((5, format!("state {} ({entries})", store.path)));
        }
        None => parts.push((5, "no state folder".to_owned())),
    }
    let total = |parts: &[(u8, String)]| parts.iter().map(|(_, part)| width(part) + 2).sum::<usize>();
    while total(&parts) > columns + 2 {
        let least = parts.iter().enumerate().filter(|(_, (weight, _))| *weight > 0);
        let Some((index, _)) = least.max_by_key(|(_, (weight, _))| *weight) else { break };
        parts.remove(index);
    }
    let words: Vec<String> = parts.into_iter().map(|(_, part)| part).collect();
    let style = if gone { tone::DIM } else { tone::PLAIN };
    Line::from(Span::styled(fit(&words.join("  "), columns), style))
}

/// What is wrong with an instance, in lines of their own.
fn troubles(service: &ServiceStatus, columns: usize) -> Vec<Line<'static>> {
    let mut troubles: Vec<(String, Style)> = Vec::new();
    if let Some(folder) = &service.calibrations {
        let reason = folder.reason.as_deref().unwrap_or("it cannot be read");
        match folder.state {
            FolderState::Gone => troubles.push((
                format!("! calibrations {}: {reason}; calibrations in force stay", folder.path),
                tone::FAULT,
            )),
            FolderState::Polling => {
                troubles.push((format!("  calibrations are polled: {reason}"), tone::DIM));
            }
            FolderState::Watching => {}
        }
    }
    for fault in &service.faults {
        let words = format!("  {} {}×: {}", fault.kind.replace('_', " "), grouped(fault.count), fault.first);
        troubles.push((words, tone::PLAIN));
    }
    for bad in service.bad_documents.iter().take(NAMED) {
        let more = bad.problems.saturating_sub(1);
        let more = if more > 0 { format!(" (and {more} more)") } else { String::new() };
        // Most problems name their file themselves.
        let file = if bad.problem.starts_with(&bad.file) { String::new() } else { format!("{}: ", bad.file) };
        troubles.push((format!("▲ {file}{}{more}", bad.problem), tone::WARNING));
    }
    let unnamed = service.bad_documents.len().saturating_sub(NAMED);
    if unnamed > 0 {
        troubles.push((format!("▲ and {} refused", of(unnamed, "more document")), tone::WARNING));
    }
    let line = |(words, style): (String, Style)| Line::from(Span::styled(fit(&words, columns), style));
    troubles.into_iter().map(line).collect()
}

/// "8 units  ! 1 faulty  ▲ 2 warned  6 running, 2 standby".
pub fn tally(units: &[Unit<'_>], columns: usize) -> Line<'static> {
    let mut line = Line::from(of(units.len(), "unit"));
    let levels: Vec<Level> = units.iter().map(Unit::level).collect();
    for (level, word) in [(Level::Fault, "faulty"), (Level::Warning, "warned"), (Level::Gone, "gone")] {
        let count = levels.iter().filter(|seen| **seen == level).count();
        if count > 0 {
            line.push_span("  ");
            let words = format!("{} {count} {word}", level.mark(State::Standby).0);
            line.push_span(Span::styled(words, level.style()));
        }
    }
    let states = [
        State::RunningWithReversal,
        State::RunningWithoutReversal,
        State::Standby,
        State::SelfTest,
        State::PreLaunchCalibration,
    ];
    let counts = states.into_iter().filter_map(|state| {
        let is_in = |unit: &&Unit<'_>| unit.gone.is_none() && unit.status.state == state;
        let count = units.iter().filter(is_in).count();
        (count > 0).then(|| format!("{count} {}", state_word(state)))
    });
    let counts: Vec<_> = counts.collect();
    if !counts.is_empty() {
        line.push_span(fit(&format!("  {}", counts.join(", ")), columns.saturating_sub(line.width())));
    }
    line
}

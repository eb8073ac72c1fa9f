//! The latency that the service adds, as figures and bars.

use isotherm_cli::grouped;
use isotherm_protocol::status::{Latency, LatencyBucket};
use ratatui::text::{Line, Span};

use super::super::chart::bar;
use super::super::figure::{latency, width};
use super::super::tone;
use super::Section;

/// Widest that a bar may be.
const WIDEST: usize = 40;
/// Most bars; where there would be more, each stands for more latencies.
const MOST: usize = 14;

/// Percentiles, and the histogram.
pub(super) fn section(added: &Latency, columns: usize) -> Section {
    let mut section = Section::new("Latency added by the service");
    if added.max_ns == 0 && added.p99_ns == 0 {
        return section;
    }
    let mut figures = vec![("p50", added.p50_ns), ("p99", added.p99_ns)];
    // A service before 0.1.0 knows no more.
    if added.max_ns > 0 {
        figures.extend([("p99.9", added.p999_ns), ("largest", added.max_ns)]);
    }
    let mut line = Line::from("  ");
    for (name, ns) in figures {
        line.push_span(Span::styled(format!("{name} "), tone::DIM));
        line.push_span(format!("{}   ", latency(ns)));
    }
    section.lines.push(line);
    section.lines.extend(bars(&added.buckets, columns));
    section
}

/// A line for each stretch of latencies from the first to the last that occurred.
fn bars(buckets: &[LatencyBucket], columns: usize) -> Vec<Line<'static>> {
    let bounds = |factors: &'static [u64]| {
        (0..19)
            .flat_map(move |power| factors.iter().map(move |factor| factor.saturating_mul(10_u64.pow(power))))
    };
    let fine = stretches(buckets, bounds(&[1, 2, 5]));
    let stretches = if fine.len() > MOST { stretches(buckets, bounds(&[1])) } else { fine };
    let total: u64 = buckets.iter().map(|bucket| bucket.count).sum();
    let largest = stretches.iter().map(|(_, count)| *count).max().unwrap_or(0);
    let count_width = stretches.iter().map(|(_, count)| width(&grouped(*count))).max().unwrap_or(0);
    let bounds = stretches.iter().map(|(up_to_ns, _)| width(&bound(*up_to_ns)));
    let bound_width = bounds.max().unwrap_or(0);
    let room = columns.saturating_sub(2 + bound_width + 2 + 2 + 7 + 2 + count_width).min(WIDEST);
    let line = |(up_to_ns, count): (u64, u64)| {
        let percent = share(count, total) * 100.0;
        let full = bar(share(count, largest), room);
        let blanks = " ".repeat(room.saturating_sub(width(&full)));
        let up_to = bound(up_to_ns);
        let numbers = format!("  {percent:>6.2}%  {:>count_width$}", grouped(count));
        Line::from_iter([
            Span::raw(format!("  {up_to:>bound_width$}  ")),
            Span::styled(full, tone::GOOD),
            Span::raw(blanks + &numbers),
        ])
    };
    stretches.into_iter().map(line).collect()
}

/// A bound of a stretch: 1, 2 or 5 of something.
fn bound(ns: u64) -> String {
    match ns {
        ns if ns >= 1_000_000_000 => format!("≤ {} s", ns / 1_000_000_000),
        ns if ns >= 1_000_000 => format!("≤ {} ms", ns / 1_000_000),
        ns if ns >= 1_000 => format!("≤ {} µs", ns / 1_000),
        ns => format!("≤ {ns} ns"),
    }
}

/// How many latencies lie in each stretch between two bounds, by its upper one; without the empty ones at both ends.
fn stretches(buckets: &[LatencyBucket], bounds: impl Iterator<Item = u64>) -> Vec<(u64, u64)> {
    let mut left = buckets.iter().peekable();
    let mut stretches = Vec::new();
    for bound in bounds.chain([u64::MAX]) {
        let mut count = 0;
        while let Some(bucket) = left.next_if(|bucket| bucket.up_to_ns <= bound) {
            count += bucket.count;
        }
        if count > 0 || !stretches.is_empty() {
            stretches.push((bound, count));
        }
        if left.peek().is_none() {
            break;
        }
    }
    stretches
}

#[expect(clippy::cast_precision_loss, reason = "a share, shown with four digits")]
fn share(part: u64, whole: u64) -> f64 {
    if whole == 0 { 0.0 } else { part as f64 / whole as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_latency_stands_in_one_stretch_and_ends_are_not_empty() {
        let bucket = |up_to_ns, count| LatencyBucket { up_to_ns, count };
        let buckets = [bucket(9_727, 5), bucket(9_999, 7), bucket(10_239, 1), bucket(118_783, 2)];
        let found =
            stretches(&buckets, [1_000, 10_000, 20_000, 50_000, 100_000, 200_000, 500_000].into_iter());
        assert_eq!(found, [(10_000, 12), (20_000, 1), (50_000, 0), (100_000, 0), (200_000, 2)]);
        assert_eq!(stretches(&[bucket(u64::MAX, 3)], [1].into_iter()), [(u64::MAX, 3)]);
        assert_eq!(stretches(&[], [1].into_iter()), []);
    }

    #[test]
    fn bars_fit_and_are_few() {
        let buckets: Vec<_> =
            (0..60).map(|bit| LatencyBucket { up_to_ns: 1 << bit, count: bit + 1 }).collect();
        for columns in [10, 40, 80, 160] {
            let lines = bars(&buckets, columns);
            assert!(lines.len() <= 20, "{}", lines.len());
            assert!(columns < 40 || lines.iter().all(|line| line.width() <= columns));
        }
    }
}

//! Bars and lines made of characters.

/// A bar of `share` (0…1) of `width` columns, an eighth of a column fine. Any share above zero is seen.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "a few hundred columns; a share is clamped, and no number is none"
)]
pub(super) fn bar(share: f64, width: usize) -> String {
    const PARTS: [&str; 8] = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];
    let eighths = (share.clamp(0.0, 1.0) * width as f64 * 8.0).round() as usize;
    let eighths = if share > 0.0 { eighths.max(1) } else { eighths };
    "█".repeat(eighths / 8) + PARTS.get(eighths % 8).copied().unwrap_or_default()
}

/// Values over time in at most `width` characters, each the mean of its share of them; the newest stands at the right.
///
/// The height reaches from the smallest to the largest value, but over no less than `least_span`, so that noise does
/// not look like a change. Values that are not finite leave a blank.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "eight levels of a quotient within 0…1"
)]
pub(super) fn spark(values: &[f64], width: usize, least_span: f64) -> String {
    const LEVELS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    if values.is_empty() || width == 0 {
        return String::new();
    }
    let columns = width.min(values.len());
    let means: Vec<f64> = (0..columns)
        .map(|column| {
            let [start, end] = [column, column + 1].map(|edge| edge * values.len() / columns);
            let share = values.get(start..end).unwrap_or_default();
            share.iter().sum::<f64>() / share.len() as f64
        })
        .collect();
    let finite = || means.iter().copied().filter(|mean| mean.is_finite());
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
    let span = (high - low).max(least_span);
    // Where the least span is the larger one, the values lie in its middle.
    let low = (low + high - span) / 2.0;
    let level = |mean: f64| LEVELS.get(((mean - low) / span * 7.999) as usize).copied().unwrap_or('█');
    means.into_iter().map(|mean| if mean.is_finite() { level(mean) } else { ' ' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_are_as_long_as_their_share() {
        assert_eq!([0.0, 1e-9, 0.5, 1.0, 7.0].map(|share| bar(share, 4)), ["", "▏", "██", "████", "████"]);
        assert_eq!(bar(f64::NAN, 4), "");
    }

    #[test]
    fn a_line_shows_what_rises_and_flattens_what_does_not_matter() {
        let rising: Vec<f64> = (0..80).map(f64::from).collect();
        assert_eq!(spark(&rising, 8, 1.0), "▁▂▃▄▅▆▇█");
        assert_eq!(spark(&[20.0, 20.01, 19.99], 8, 1.0), "▄▅▄");
        assert_eq!(spark(&[1.0, f64::NAN, 3.0], 3, 1.0), "▁ █");
        assert_eq!(spark(&[f64::NAN], 3, 1.0), " ");
        assert_eq!((spark(&[], 8, 1.0), spark(&[1.0], 0, 1.0)), (String::new(), String::new()));
    }
}

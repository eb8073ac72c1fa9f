//! Figures as text: digits, tables.

use crate::numbers::ends;
use comfy_table::CellAlignment;

/// Most significant digits of a figure among others: more are in `--json`.
const MOST_DIGITS: f64 = 8.0;

/// Three significant digits.
pub fn short(value: f64) -> String {
    significant(value, 3.0)
}

/// So many significant digits (3…[`MOST_DIGITS`]).
fn significant(value: f64, digits: f64) -> String {
    let size = value.abs();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and 11")]
    let whole = |number: f64| number.clamp(0.0, 11.0) as usize;
    if size == 0.0 {
        "0".to_owned()
    } else if !size.is_finite() {
        format!("{value}")
    } else if !(1e-3..1e5).contains(&size) {
        format!("{value:.*e}", whole(digits - 1.0))
    } else {
        // 9.996 has its first digit before the point, 10.0 that is said of it has two there.
        let said: f64 = format!("{size:.*e}", whole(digits - 1.0)).parse().unwrap_or(size);
        format!("{value:.*}", whole(digits - 1.0 - libm::floor(libm::log10(said))))
    }
}

/// So many places behind the point, an exponent where only zeros would stand before it; zero has no sign.
pub fn fixed(value: f64, places: usize) -> String {
    if value.abs() >= 1e16 {
        return short(value);
    }
    let words = format!("{value:.places$}");
    match words.strip_prefix('-') {
        Some(size) if size.bytes().all(|byte| matches!(byte, b'0' | b'.')) => size.to_owned(),
        _ => words,
    }
}

/// Six significant digits, without the zeros at the end: what people state, such as g or a coefficient.
pub fn six(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    if value != 0.0 && !(1e-4..1e7).contains(&value.abs()) {
        format!("{rounded:e}")
    } else {
        format!("{rounded}")
    }
}

/// Numbers that are read beside each other: three significant digits, and as many more as give the distance from the smallest to
/// the largest `digits`. Those that are all the same have up to six.
pub fn alike(values: &[f64], digits: f64) -> Vec<String> {
    let [low, high] = ends(values.iter().copied().filter(|value| value.is_finite()));
    let size = low.abs().max(high.abs());
    let distance = high - low;
    if distance.is_nan() || distance <= 1e-9 * size {
        return values.iter().copied().map(six).collect();
    }
    let decimals = digits - 1.0 - libm::floor(libm::log10(distance));
    let word = |value: &f64| {
        let own = libm::floor(libm::log10(value.abs())) + 1.0 + decimals;
        significant(*value, if own > 3.0 { own.min(MOST_DIGITS) } else { 3.0 })
    };
    values.iter().map(word).collect()
}

/// A cell of a table; a dash where nothing is known.
pub fn or_dash(cell: Option<String>) -> String {
    cell.unwrap_or_else(|| "–".to_owned())
}

/// A count and what is counted: "1 gap", "3 gaps".
pub fn counted(count: usize, one: &str, several: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}

/// A power as a superscript; nothing for the first.
pub fn superscript(power: usize) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    if power == 1 {
        return String::new();
    }
    power.to_string().bytes().filter_map(|digit| DIGITS.get(usize::from(digit - b'0')).copied()).collect()
}

/// A unit of measure per power of a degree: "°/h", "°/h/°C", "°/h/°C²".
pub fn per_deg_c(unit: &str, power: usize) -> String {
    if power == 0 { unit.to_owned() } else { format!("{unit}/°C{}", superscript(power)) }
}

/// A number with its limits, to as many digits as tell them apart.
pub fn within(value: f64, [low, high]: [f64; 2]) -> String {
    let words = alike(&[value, low, high], 2.0);
    match words.as_slice() {
        [value, low, high] => format!("{value} ({low}…{high})"),
        _ => String::new(),
    }
}

/// A table with its columns one below the other, those that hold figures aligned to the right.
pub fn table(table: &isotherm_pages::Table) -> String {
    let mut text = isotherm_cli::table(&table.head, &table.rows, ..0);
    for (index, column) in text.column_iter_mut().enumerate().skip(1) {
        let figure = |row: &Vec<String>| {
            row.get(index).is_none_or(|cell| {
                let begins = cell.chars().next().is_none_or(|c| c.is_ascii_digit() || "-−+(–".contains(c));
                begins && !cell.contains('·')
            })
        };
        if table.rows.iter().all(figure) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    text.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_as_many_digits_as_they_are_read_for() {
        assert_eq!(
            [1.678, 0.17, 12345.6, 1.2e-5, 0.0, -0.0, 9.996, -0.99961].map(short),
            ["1.68", "0.170", "12346", "1.20e-5", "0", "0", "10.0", "-1.00"]
        );
        assert_eq!(
            [9.815_708_729_443_966, 9.8154, 20.0, -2.5e-7].map(six),
            ["9.81571", "9.8154", "20", "-2.5e-7"]
        );
        // The limits of an interval are told apart, wide ones as ever.
        assert_eq!(within(0.150_21, [0.149_82, 0.150_6]), "0.15021 (0.14982…0.15060)");
        assert_eq!(within(41.2, [25.7, 101.3]), "41.2 (25.7…101)");
        // A scale factor over temperature, and a bias.
        assert_eq!(alike(&[0.998_7, 1.000_1, 1.011_2], 3.0), ["0.9987", "1.0001", "1.0112"]);
        assert_eq!(alike(&[167.0, 24.9, 9.85, 390.2], 3.0), ["167", "24.9", "9.85", "390"]);
        assert_eq!(alike(&[1.002_24, 1.002_24], 3.0), ["1.00224"; 2]);
        assert_eq!(alike(&[0.0, 0.0, f64::NAN], 3.0), ["0", "0", "NaN"]);
    }

    #[test]
    fn zero_has_no_sign() {
        assert_eq!(
            [-0.0004, -0.0006, 0.0, -12.3456].map(|x| fixed(x, 3)),
            ["0.000", "-0.001", "0.000", "-12.346"]
        );
    }

    #[test]
    fn numbers_are_written_as_people_do() {
        let words =
            [(-0.001, 2), (-0.016, 2), (1.0, 1), (1e300, 1)].map(|(value, places)| fixed(value, places));
        assert_eq!(words, ["0.00", "-0.02", "1.0", "1.00e300"]);
        assert_eq!(
            [counted(1, "pose", "poses"), counted(0, "pose", "poses"), counted(12, "pose", "poses")],
            ["1 pose", "0 poses", "12 poses"]
        );
    }

    #[test]
    fn one_is_no_plural() {
        assert_eq!([0, 1, 2].map(|count| counted(count, "gap", "gaps")), ["0 gaps", "1 gap", "2 gaps"]);
    }

    #[test]
    fn powers_are_written_one_way() {
        assert_eq!([0, 1, 2, 12].map(|power| per_deg_c("Hz", power)), ["Hz", "Hz/°C", "Hz/°C²", "Hz/°C¹²"]);
    }
}

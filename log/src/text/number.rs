//! Numbers in cells, read exactly.

/// Most digits of a time; 10³⁰ is far beyond 64 bits of nanoseconds.
const MOST_DIGITS: usize = 30;

/// A decimal number in the shortest way that gives the nearest double; `nan` and `inf` too.
pub(super) fn float(cell: &[u8], decimal_mark: u8) -> Option<f64> {
    if decimal_mark == b'.' {
        return std::str::from_utf8(cell).ok()?.parse().ok();
    }
    let mut copy = [0; 64];
    let copy = copy.get_mut(..cell.len())?;
    for (to, from) in copy.iter_mut().zip(cell) {
        *to = match *from {
            b'.' => return None,
            byte if byte == decimal_mark => b'.',
            byte => byte,
        };
    }
    std::str::from_utf8(copy).ok()?.parse().ok()
}

/// A whole number of 32 bits, also when it is written with a point or an exponent.
pub(super) fn count(cell: &[u8], decimal_mark: u8) -> Option<i32> {
    if let Some(integer) = integer(cell) {
        return i32::try_from(integer).ok();
    }
    let number = float(cell, decimal_mark)?;
    let whole = number.trunc();
    #[expect(clippy::float_cmp, reason = "exactness is the question")]
    let fits = whole == number && whole >= f64::from(i32::MIN) && whole <= f64::from(i32::MAX);
    #[expect(clippy::cast_possible_truncation, reason = "checked to be whole and to fit")]
    fits.then_some(whole as i32)
}

/// A plain whole number with an optional sign.
fn integer(cell: &[u8]) -> Option<i64> {
    let (negative, digits) = sign(cell);
    if digits.is_empty() || digits.len() > 18 {
        return None;
    }
    let mut number = 0i64;
    for digit in digits {
        if !digit.is_ascii_digit() {
            return None;
        }
        number = number * 10 + i64::from(digit - b'0');
    }
    Some(if negative { -number } else { number })
}

/// A whole number from 0.
pub(super) fn natural(cell: &[u8]) -> Option<u64> {
    std::str::from_utf8(cell).ok()?.parse().ok()
}

/// A whole number from 0, decimal or hexadecimal with `0x`.
pub(super) fn word(cell: &[u8]) -> Option<u64> {
    let text = std::str::from_utf8(cell).ok()?;
    match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        Some(digits) => u64::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

/// A time in ns, exactly as written and rounded to the nearest where it has more digits; its unit is
/// `factor` · 10^`exponent` ns.
pub(super) fn time_ns(cell: &[u8], (factor, exponent): (u8, i32), decimal_mark: u8) -> Option<i64> {
    let (negative, digits) = sign(cell);
    let split = digits.iter().position(|byte| byte.eq_ignore_ascii_case(&b'e'));
    let (mantissa, power) = match split.and_then(|at| digits.split_at_checked(at)) {
        Some((mantissa, power)) => (mantissa, integer(power.get(1..)?)?),
        None => (digits, 0),
    };
    let (mut number, mut places, mut seen, mut point) = (0i128, 0i64, 0, false);
    for byte in mantissa {
        match *byte {
            digit @ b'0'..=b'9' if seen < MOST_DIGITS => {
                number = number * 10 + i128::from(digit - b'0');
                seen += usize::from(number != 0);
                places += i64::from(point);
            }
            mark if mark == decimal_mark && !point => point = true,
            _ => return None,
        }
    }
    if mantissa.len() == usize::from(point) {
        return None;
    }
    let shift = i32::try_from(power.saturating_sub(places)).ok()?.checked_add(exponent)?;
    let scale = 10i128.checked_pow(shift.unsigned_abs());
    // 30 digits and two more fit.
    number *= i128::from(factor);
    let nanoseconds = match (shift >= 0, scale) {
        (true, Some(scale)) => number.checked_mul(scale)?,
        (true, None) if number == 0 => 0,
        (true, None) => return None,
        (false, Some(scale)) => (number + scale / 2) / scale,
        (false, None) => 0,
    };
    i64::try_from(if negative { -nanoseconds } else { nanoseconds }).ok()
}

/// Takes a sign off.
fn sign(cell: &[u8]) -> (bool, &[u8]) {
    match cell.split_first() {
        Some((b'-', rest)) => (true, rest),
        Some((b'+', rest)) => (false, rest),
        _ => (false, cell),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_exact() {
        let table: &[(&str, i32, Option<i64>)] = &[
            ("256551281491968", 3, Some(256_551_281_491_968_000)),
            ("   ", 0, None),
            ("2.9840000e-02", 9, Some(29_840_000)),
            ("5.1171800e+02", 9, Some(511_718_000_000)),
            ("1700000000.123456789", 9, Some(1_700_000_000_123_456_789)),
            ("-0.0000000015", 9, Some(-2)),
            ("0.0000000004", 9, Some(0)),
            ("9223372036854775807", 0, Some(i64::MAX)),
            ("9223372036854775808", 0, None),
            ("1e300", 9, None),
            ("0e300", 9, Some(0)),
            ("1e-300", 9, Some(0)),
            ("nan", 9, None),
            ("1.2.3", 9, None),
            (".", 9, None),
            ("", 9, None),
            ("e5", 9, None),
            ("1e", 9, None),
            (".5", 9, Some(500_000_000)),
        ];
        for (cell, exponent, expected) in table {
            assert_eq!(time_ns(cell.as_bytes(), (1, *exponent), b'.'), *expected, "{cell}");
        }
        assert_eq!(time_ns(b"0.000166666667", (6, 10), b'.'), Some(10_000_000));
        assert_eq!(time_ns(b"1.5", (36, 11), b'.'), Some(5_400_000_000_000));
        assert_eq!(time_ns(b"1,5", (1, 9), b','), Some(1_500_000_000));
    }

    #[test]
    fn status_words_are_decimal_or_hexadecimal() {
        assert_eq!(
            ["12", "0x1F", "0X0", "-1", "0x"].map(|cell| word(cell.as_bytes())),
            [Some(12), Some(31), Some(0), None, None]
        );
    }

    #[test]
    fn counts_are_whole() {
        let table: &[(&str, Option<i32>)] = &[
            ("-7", Some(-7)),
            ("+80", Some(80)),
            ("3.3108000e+04", Some(33108)),
            ("80.5", None),
            ("2147483647", Some(i32::MAX)),
            ("2147483648", None),
            ("nan", None),
            ("", None),
            ("1x", None),
        ];
        for (cell, expected) in table {
            assert_eq!(count(cell.as_bytes(), b'.'), *expected, "{cell}");
        }
    }

    #[test]
    fn decimal_commas_and_no_thousands() {
        assert_eq!(float(b"-1,25e-3", b','), Some(-1.25e-3));
        assert_eq!(float(b"1.250,5", b','), None);
        assert_eq!(float(b"1,250.5", b'.'), None);
        assert_eq!(float(b"0.1", b'.'), Some(0.1));
        assert!(float(b"NaN", b'.').is_some_and(f64::is_nan));
    }
}

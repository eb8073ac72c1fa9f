//! Units of measure as headers spell them.

use super::NUMBER_UNITS;
use super::names::Kind;

/// As the mapping spells it, and how much of it a reading of 1 is.
pub(super) type Unit = (&'static str, f64);

/// Each part of a unit as it is read, and its other spellings.
const SPELLINGS: [(&str, &[&str]); 16] = [
    ("deg", &["degrees", "degree", "grad", "°", "º", "˚"]),
    ("u", &["micro", "µ", "μ"]),
    ("m", &["milli"]),
    ("2", &["²"]),
    ("", &["per"]),
    ("s", &["seconds", "second", "sec"]),
    ("min", &["minutes", "minute", "mins"]),
    ("h", &["hours", "hour", "hrs", "hr"]),
    ("degs", &["degps"]),
    ("degh", &["degph"]),
    ("rads", &["radps"]),
    ("ms2", &["mps2"]),
    ("degc", &["celsius"]),
    ("degf", &["fahrenheit"]),
    ("k", &["kelvin"]),
    ("v", &["volt"]),
];

/// A unit in small letters, without points, strokes and brackets.
fn plain(text: &str) -> String {
    let left_out = |c: &char| c.is_whitespace() || matches!(c, '.' | '(' | ')' | '/' | '^' | '*' | '·' | '_');
    let text: String = text.to_lowercase().chars().filter(|c| !left_out(c)).collect();
    let spellings =
        SPELLINGS.iter().flat_map(|(plain, others)| others.iter().map(move |other| (other, plain)));
    spellings.fold(text, |text, (spelling, plain)| text.replace(spelling, plain))
}

/// The unit that a text is.
pub(super) fn unit(kind: Kind, increment: bool, text: &str) -> Option<Unit> {
    let text = plain(text);
    let raw = matches!(text.as_str(), "lsb" | "count" | "counts" | "raw" | "adc" | "digit" | "digits");
    if raw {
        return raw_unit(kind, increment, text == "counts");
    }
    // Of sensors, thousandths and millionths have no unit of their own.
    let is_sensor = matches!(kind, Kind::Gyro | Kind::Accel);
    let prefixes = [("m", 1e-3), ("u", 1e-6)].into_iter().filter(|_| is_sensor);
    known(kind, increment, &text).or_else(|| {
        prefixes.into_iter().find_map(|(prefix, scale)| {
            let (unit, of_unit) = known(kind, increment, text.strip_prefix(prefix)?)?;
            Some((unit, scale * of_unit))
        })
    })
}

fn raw_unit(kind: Kind, increment: bool, counts: bool) -> Option<Unit> {
    let unit = match kind {
        Kind::Gyro | Kind::Accel if counts => "counts",
        Kind::Gyro | Kind::Accel if increment => "raw_per_tick",
        Kind::Gyro | Kind::Accel | Kind::Temperature => "raw",
        Kind::Time | Kind::Counter => return None,
    };
    Some((unit, 1.0))
}

fn known(kind: Kind, increment: bool, plain: &str) -> Option<Unit> {
    let (unit, scale) = match (kind, plain) {
        (Kind::Gyro, "deg") if increment => ("deg", 1.0),
        (Kind::Gyro, "rad") if increment => ("rad", 1.0),
        (Kind::Gyro, "as" | "\"" | "″") if increment => ("arcsec", 1.0),
        // No rate is measured in it.
        (Kind::Gyro, "arcs") => ("arcsec", 1.0),
        (Kind::Accel, "ms" | "ms-1") if increment => ("m_per_s", 1.0),
        (Kind::Gyro | Kind::Accel, _) if increment => return None,
        (Kind::Gyro, "degs" | "degs-1" | "dps") => ("deg_per_s", 1.0),
        (Kind::Gyro, "degmin" | "degmin-1" | "dpm") => ("deg_per_s", 1.0 / 60.0),
        (Kind::Gyro, "rpm") => ("deg_per_s", 6.0),
        (Kind::Gyro, "degh" | "degh-1" | "dph" | "arcss" | "arcss-1" | "\"s" | "″s") => ("deg_per_h", 1.0),
        (Kind::Gyro, "rads" | "rads-1") => ("rad_per_s", 1.0),
        (Kind::Accel, "ms2" | "ms-2" | "mss") => ("m_per_s2", 1.0),
        (Kind::Accel, "gal" | "cms2" | "cms-2") => ("m_per_s2", 0.01),
        (Kind::Accel, "fts2" | "fts-2") => ("m_per_s2", 0.3048),
        (Kind::Accel, "g" | "gs") => ("g", 1.0),
        (Kind::Accel, "mg") => ("mg", 1.0),
        (Kind::Accel | Kind::Temperature, "v") => ("volt", 1.0),
        (Kind::Time, word) => (*NUMBER_UNITS.iter().find(|unit| **unit == word)?, 1.0),
        (Kind::Temperature, "degc" | "c") => ("deg_c", 1.0),
        (Kind::Temperature, "degf" | "f") => ("deg_f", 1.0),
        (Kind::Temperature, "k") => ("kelvin", 1.0),
        _ => return None,
    };
    Some((unit, scale))
}

/// The unit that the parts of a name have after the first, such as `deg`, `h` of `gx_deg_h`; and how many parts name the quantity: those
/// before a unit at the end, but raw readings are a quantity of their own.
pub(super) fn named(kind: Kind, increment: bool, parts: &[String]) -> Option<(Unit, usize)> {
    let places = (1..=4).rev().flat_map(|length| (1..parts.len()).rev().map(move |start| (start, length)));
    let found = places.into_iter().find_map(|(start, length)| {
        let text = parts.get(start..start + length)?.concat();
        let at_end = start + length == parts.len();
        // A letter is a unit at the end alone.
        let found = unit(kind, increment, &text).filter(|_| at_end || text.len() > 1)?;
        let is_raw = matches!(found.0, "raw" | "raw_per_tick" | "counts");
        Some((found, if at_end && !is_raw { start } else { parts.len() }))
    });
    let has = |word: &str| parts.iter().any(|part| part == word);
    let pair = |pair: [&str; 2]| parts.windows(2).any(|parts| parts == pair);
    let ends = |word: &str| parts.last().is_some_and(|last| last == word);
    let whole = |unit| Some(((unit, 1.0), parts.len()));
    found.or_else(|| match kind {
        _ if has("raw") || has("lsb") || has("out") => Some((raw_unit(kind, increment, false)?, parts.len())),
        Kind::Gyro if !increment && (ends("rad") || pair(["angular", "velocity"])) => whole("rad_per_s"),
        Kind::Gyro if !increment && ends("deg") => whole("deg_per_s"),
        Kind::Accel if has("linear") && has("acceleration") && has("field") => whole("m_per_s2"),
        _ => None,
    })
}

/// The quantity that is measured in a unit of angular rate, specific force or temperature.
pub(super) fn kind_of(text: &str) -> Option<Kind> {
    let is = |kind: &Kind| {
        unit(*kind, false, text)
            .is_some_and(|(unit, _)| !matches!(unit, "raw" | "counts" | "volt" | "arcsec"))
    };
    [Kind::Gyro, Kind::Accel, Kind::Temperature].into_iter().find(is)
}

/// Whether a cell is a unit of measure, and nothing else.
pub(super) fn is_unit(text: &str) -> bool {
    let known = |kind| unit(kind, false, text).is_some_and(|(unit, _)| unit != "raw");
    !text.is_empty() && [Kind::Time, Kind::Gyro, Kind::Accel, Kind::Temperature].into_iter().any(known)
}

#[cfg(test)]
mod tests {
    use super::super::names::meaning;
    use super::*;

    #[test]
    fn a_unit_is_known_however_a_header_spells_it() {
        for (name, expected) in [
            ("G_x [mdps]", Some(("deg_per_s", Some(1e-3)))),
            ("gx_mdps", Some(("deg_per_s", Some(1e-3)))),
            ("gx [mrad/s]", Some(("rad_per_s", Some(1e-3)))),
            ("gx_mrad_s", Some(("rad_per_s", Some(1e-3)))),
            ("gx [µrad/s]", Some(("rad_per_s", Some(1e-6)))),
            ("gx_deg_h", Some(("deg_per_h", None))),
            ("gx_deg_per_hour", Some(("deg_per_h", None))),
            ("gx (°/h)", Some(("deg_per_h", None))),
            ("gx [°/min]", Some(("deg_per_s", Some(1.0 / 60.0)))),
            ("gx_arcsec_s", Some(("deg_per_h", None))),
            ("gx [arcsec]", Some(("arcsec", None))),
            ("gx_deg_s", Some(("deg_per_s", None))),
            ("gyro_deg_x", Some(("deg_per_s", None))),
            ("ax [ug]", Some(("g", Some(1e-6)))),
            ("ax_ug", Some(("g", Some(1e-6)))),
            ("ax [mg]", Some(("mg", None))),
            ("ax_gal", Some(("m_per_s2", Some(0.01)))),
            ("ax [mGal]", Some(("m_per_s2", Some(1e-5)))),
            ("ax [mm/s²]", Some(("m_per_s2", Some(1e-3)))),
            ("ax [m/s2]", Some(("m_per_s2", None))),
            ("ax_m_s2", Some(("m_per_s2", None))),
            ("ax_mps2", Some(("m_per_s2", None))),
            ("accel_x_m_per_s2", Some(("m_per_s2", None))),
            ("time_min", Some(("min", None))),
            ("t [h]", Some(("h", None))),
            ("time_usec", Some(("us", None))),
            ("temp_F", Some(("deg_f", None))),
            ("temp [°F]", Some(("deg_f", None))),
            ("tempC", Some(("deg_c", None))),
            ("T_case_degF", Some(("deg_f", None))),
            ("ax [kPa]", None),
            ("gx [furlong]", None),
            ("time [ticks]", None),
        ] {
            let meaning = meaning(name, None).unwrap();
            assert_eq!(meaning.unit.map(|unit| (unit, meaning.scale)), expected, "{name}");
            assert_eq!(meaning.unknown.is_some(), expected.is_none(), "{name}");
        }
        for unit in ["ms", "m/(s^2)", "deg/s", "mdps", "degC"] {
            assert!(is_unit(unit), "{unit}");
        }
        for word in ["", "-", "time", "Gyro_X", "1.5"] {
            assert!(!is_unit(word), "{word}");
        }
    }
}

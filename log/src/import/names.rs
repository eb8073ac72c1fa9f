//! What a column holds, by its name.

use super::words::parts;

/// A quantity that a log may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    Time,
    Counter,
    /// Angular rate, or an increment of angle.
    Gyro,
    /// Specific force, or an increment of velocity.
    Accel,
    Temperature,
}

/// What a name says.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Meaning {
    pub(super) kind: Kind,
    /// 0, 1, 2 for x, y, z.
    pub(super) axis: Option<usize>,
    /// The name without axis and unit, by which columns belong together.
    pub(super) stem: String,
    /// Increments over the tick.
    pub(super) increment: bool,
    /// As the mapping spells it.
    pub(super) unit: Option<&'static str>,
    /// How much of that unit a reading of 1 is, where it is not one: 0.001 of °/s where the column says mdps.
    pub(super) scale: Option<f64>,
    /// Of several that hold the same, the least is taken.
    pub(super) rank: u8,
}

/// The name before its unit, and the unit in brackets at its end. A bracket with a number is an index.
fn bracketed(name: &str) -> (&str, Option<&str>) {
    let name = name.trim();
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some((head, tail)) = name.strip_suffix(close).and_then(|rest| rest.rsplit_once(open))
            && !head.is_empty()
            && !tail.trim().chars().all(|c| c.is_ascii_digit())
        {
            return (head.trim(), Some(tail.trim()));
        }
    }
    (name, None)
}

const GYROS: [&str; 9] = ["gyro", "gyr", "gyros", "gyroscope", "omega", "w", "g", "angrate", "rate"];
/// Those that say enough without an axis.
const GYROS_ALONE: [&str; 4] = ["gyro", "gyros", "gyroscope", "angrate"];
const ACCELS: [&str; 9] =
    ["accel", "acc", "accl", "acceleration", "accelerometer", "accelerometers", "acel", "a", "f"];
/// Parts that are of no sensor's reading.
const OTHERS: [&str; 22] = [
    "mag",
    "euler",
    "quat",
    "covariance",
    "status",
    "clipping",
    "dt",
    "integral",
    "bias",
    "range",
    "free",
    "valid",
    "relative",
    "std",
    "sigma",
    "orientation",
    "mat",
    "gravity",
    "error",
    "sat",
    "lat",
    "lon",
];

/// What a name means, with its unit from brackets, from a row of units, or from its own parts.
pub(super) fn meaning(name: &str, of_row: Option<&str>) -> Option<Meaning> {
    let (bare, own) = bracketed(name);
    let mut parts = parts(bare);
    let axis = take_axis(&mut parts);
    let has = |words: &[&str]| parts.iter().any(|part| words.contains(&part.as_str()));
    let pair = |first: &str, second: &str| {
        parts.windows(2).any(|pair| pair[0] == first && pair[1].starts_with(second))
    };
    let stated =
        own.or(of_row.map(|text| text.trim_matches(['(', ')', '[', ']']))).filter(|text| !text.is_empty());
    let temperature = parts.iter().any(|part| part.starts_with("temp") || part.starts_with("thermo"));
    let angle = pair("delta", "angle")
        || pair("d", "theta")
        || has(&["dtheta", "deltang", "dang", "deltaangle"])
        || pair("delta", "theta");
    let velocity =
        pair("delta", "vel") || pair("vel", "inc") || has(&["dvel", "deltvel", "deltavel", "velinc"]);
    // In steps of 100 µs, which no mapping has: Xsens counts its packets beside it.
    let fine = has(&["fine"]);
    let (kind, increment) = if fine {
        return None;
    } else if temperature {
        (Kind::Temperature, false)
    } else if parts == ["value"] && axis == Some(0) {
        // LabVIEW's X_Value: the time, whatever the columns beside it are.
        (Kind::Time, false)
    } else if has(&OTHERS) {
        return None;
    } else if angle && axis.is_some() {
        (Kind::Gyro, true)
    } else if velocity && axis.is_some() {
        (Kind::Accel, true)
    } else if axis.is_some() && (has(&GYROS) || has(&["angular"]) && has(&["vel", "velocity"])) {
        (Kind::Gyro, false)
    } else if axis.is_some() && has(&ACCELS) || axis.is_some() && pair("specific", "force") {
        (Kind::Accel, false)
    } else if axis.is_some() {
        return None;
    } else if parts.iter().any(|part| {
        part.contains("count") || part.contains("cntr") || part == "cnt" || part.starts_with("seq")
    }) || pair("packet", "num")
        || pair("sample", "n")
        || pair("data", "set")
        || matches!(parts.as_slice(), [one] if matches!(one.as_str(), "packet" | "index" | "idx" | "sample" | "no" | "n"))
    {
        (Kind::Counter, false)
    } else if parts.iter().any(|part| part.contains("time") || part == "stamp" || part == "sow")
        || matches!(parts.as_slice(), [one] if one == "t")
        || has(&["tow"])
    {
        (Kind::Time, false)
    } else if has(&GYROS_ALONE) {
        (Kind::Gyro, false)
    } else {
        return None;
    };
    let (unit, scale) = scaled_unit(kind, increment, stated, &parts);
    let mut rank = u8::from(unit.is_none()) * 4;
    rank += u8::from(has(&["raw", "lsb"])) * 8 + u8::from(has(&["linear"])) * 2 + u8::from(increment) * 2;
    if kind == Kind::Time {
        // Of several clocks: the sensor's own, then any, then those of weeks and of the computer that wrote.
        rank += u8::from(has(&["utc", "pc", "host", "week", "gps", "sow", "tow", "to"])) * 8;
        rank += u8::from(!has(&["startup", "timestamp", "stamp", "sensor"])) * 2;
        rank += u8::from(has(&["header", "mag", "baro"]));
    }
    let stem = parts.join(" ");
    let axis = axis.filter(|_| kind != Kind::Time);
    Some(Meaning { kind, axis, stem, increment, unit, scale, rank })
}

/// Whether a cell is a unit of measure, and nothing else.
pub(super) fn is_unit(text: &str) -> bool {
    let known = |kind| scaled_unit(kind, false, Some(text), &[]).0.is_some_and(|unit| unit != "raw");
    !text.is_empty() && [Kind::Time, Kind::Gyro, Kind::Accel, Kind::Temperature].into_iter().any(known)
}

/// The unit, as the mapping spells it, and the factor from a reading to it, where that is not 1: of sensors, thousandths and millionths
/// have no unit of their own.
fn scaled_unit(
    kind: Kind,
    increment: bool,
    stated: Option<&str>,
    parts: &[String],
) -> (Option<&'static str>, Option<f64>) {
    let plain = unit(kind, increment, stated, parts);
    let stated =
        stated.map(str::trim).filter(|_| plain.is_none() && matches!(kind, Kind::Gyro | Kind::Accel));
    let prefixes = [("m", 1e-3), ("u", 1e-6), ("µ", 1e-6), ("μ", 1e-6)];
    let scaled = prefixes.into_iter().find_map(|(prefix, scale)| {
        let unit = unit(kind, increment, Some(stated?.strip_prefix(prefix)?), parts)?;
        Some((Some(unit), Some(scale)))
    });
    scaled.unwrap_or((plain, None))
}

/// Takes the axis out of a name: a part x, y, z, or 0, 1, 2 at its end, or the last letter of a known word.
fn take_axis(parts: &mut Vec<String>) -> Option<usize> {
    let letter = |text: &str| ["x", "y", "z"].iter().position(|axis| *axis == text);
    if parts.iter().any(|part| part == "rate")
        && let Some(at) = parts.iter().position(|part| ["roll", "pitch", "yaw"].contains(&part.as_str()))
    {
        let name = parts.remove(at);
        return ["roll", "pitch", "yaw"].iter().position(|axis| *axis == name);
    }
    if let Some(at) = parts.iter().rposition(|part| letter(part).is_some()) {
        return letter(&parts.remove(at));
    }
    let last = parts.last()?.clone();
    if let Ok(index) = last.parse::<usize>() {
        parts.pop();
        return Some(index).filter(|index| *index < 3);
    }
    for part in parts.iter_mut() {
        let Some((at, _)) = part.char_indices().last() else { continue };
        let (stem, end) = part.split_at(at);
        if letter(end).is_some()
            && (GYROS.contains(&stem)
                || ACCELS.contains(&stem)
                || ["dtheta", "dvel", "deltang"].contains(&stem))
        {
            let axis = letter(end);
            *part = stem.to_owned();
            return axis;
        }
    }
    None
}

/// The unit, as the mapping spells it.
fn unit(kind: Kind, increment: bool, stated: Option<&str>, parts: &[String]) -> Option<&'static str> {
    let text: String = stated
        .unwrap_or_default()
        .to_lowercase()
        .chars()
        .filter(|c| !c.is_whitespace() && !matches!(c, '.' | '(' | ')'))
        .collect();
    let text = text
        .replace("degrees", "deg")
        .replace("degree", "deg")
        .replace("grad", "deg")
        .replace(['°', 'º', '˚'], "deg");
    let text = text.replace("seconds", "s").replace("second", "s").replace("sec", "s");
    let text = text
        .replace("^-1", "-1")
        .replace("^-2", "-2")
        .replace("^2", "2")
        .replace('²', "2")
        .replace("µ", "u")
        .replace('μ', "u");
    let has = |word: &str| parts.iter().any(|part| part == word);
    let raw = matches!(text.as_str(), "lsb" | "count" | "counts" | "raw" | "adc" | "digit")
        || text.is_empty() && (has("raw") || has("lsb") || has("out"));
    match kind {
        Kind::Gyro if increment => match text.as_str() {
            "deg" => Some("deg"),
            "rad" => Some("rad"),
            "arcs" | "as" | "\"" | "arcsec" => Some("arcsec"),
            "counts" => Some("counts"),
            _ if raw => Some("raw_per_tick"),
            _ => None,
        },
        Kind::Gyro => match text.as_str() {
            "deg/s" | "degs-1" | "dps" => Some("deg_per_s"),
            "rad/s" | "rads-1" => Some("rad_per_s"),
            "deg/h" | "deg/hr" | "degh-1" => Some("deg_per_h"),
            "counts" => Some("counts"),
            _ if raw => Some("raw"),
            "" if has("dps") || has("deg") => Some("deg_per_s"),
            "" if has("rad") || parts.windows(2).any(|pair| pair == ["angular", "velocity"]) => {
                Some("rad_per_s")
            }
            _ => None,
        },
        Kind::Accel if increment => match text.as_str() {
            "m/s" | "ms-1" => Some("m_per_s"),
            "counts" => Some("counts"),
            _ if raw => Some("raw_per_tick"),
            _ => None,
        },
        Kind::Accel => match text.as_str() {
            "m/s2" | "ms-2" | "m/s/s" | "ms2" => Some("m_per_s2"),
            "g" | "gs" => Some("g"),
            "mg" => Some("mg"),
            "v" | "volt" => Some("volt"),
            "counts" => Some("counts"),
            _ if raw => Some("raw"),
            "" if has("ms") || parts.windows(2).any(|pair| pair[0] == "m" && pair[1] == "s") => {
                Some("m_per_s2")
            }
            "" if has("linear") && has("acceleration") && has("field") => Some("m_per_s2"),
            _ => None,
        },
        Kind::Time => match text.as_str() {
            "ns" => Some("ns"),
            "us" => Some("us"),
            "ms" => Some("ms"),
            "s" => Some("s"),
            _ => ["ns", "us", "ms", "s"]
                .into_iter()
                .find(|word| parts.len() > 1 && parts.last().is_some_and(|last| last == word)),
        },
        Kind::Temperature => match text.as_str() {
            "degc" | "c" | "celsius" => Some("deg_c"),
            "k" | "kelvin" => Some("kelvin"),
            "v" | "volt" => Some("volt"),
            "" | "-" | "deg" if !raw => None,
            // °F and all else is for the document to convert.
            _ => Some("raw"),
        },
        Kind::Counter => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Kind::{Accel, Counter, Gyro, Temperature, Time};

    #[test]
    fn names_of_many_makers_say_what_they_hold() {
        type Case = (&'static str, Option<&'static str>, Option<(Kind, Option<usize>, Option<&'static str>)>);
        let cases: [Case; 60] = [
            ("Drehrate X [°/s]", None, Some((Gyro, Some(0), Some("deg_per_s")))),
            ("Drehraten_z [Grad/s]", None, Some((Gyro, Some(2), Some("deg_per_s")))),
            ("Drehrate", None, Some((Gyro, None, None))),
            ("Nickrate [º/s]", None, Some((Gyro, Some(1), Some("deg_per_s")))),
            ("Yaw Rate (deg/second)", None, Some((Gyro, Some(2), Some("deg_per_s")))),
            ("Vitesse angulaire x (rad/s)", None, Some((Gyro, Some(0), Some("rad_per_s")))),
            ("Velocidad angular y", None, Some((Gyro, Some(1), None))),
            ("Accélération z (m/s²)", None, Some((Accel, Some(2), Some("m_per_s2")))),
            ("Temps [s]", None, Some((Time, None, Some("s")))),
            ("Zähler", None, Some((Counter, None, None))),
            ("角速度X(°/s)", None, Some((Gyro, Some(0), Some("deg_per_s")))),
            ("gyro count", None, Some((Counter, None, None))),
            ("Gyr_X", None, Some((Gyro, Some(0), None))),
            ("Acc_Z", None, Some((Accel, Some(2), None))),
            ("UnCompGyroY [rad/s]", None, Some((Gyro, Some(1), Some("rad_per_s")))),
            ("UnCompMagX [Gauss]", None, None),
            ("UnCompAccX [m/s^2]", None, Some((Accel, Some(0), Some("m_per_s2")))),
            ("Temperature [Celsius]", None, Some((Temperature, None, Some("deg_c")))),
            ("gyro_rad[2]", None, Some((Gyro, Some(2), Some("rad_per_s")))),
            ("accelerometer_m_s2[0]", None, Some((Accel, Some(0), Some("m_per_s2")))),
            ("gyro_integral_dt", None, None),
            ("accelerometer_timestamp_relative", None, None),
            ("w_RS_S_x [rad s^-1]", None, Some((Gyro, Some(0), Some("rad_per_s")))),
            ("a_RS_S_y [m s^-2]", None, Some((Accel, Some(1), Some("m_per_s2")))),
            ("#timestamp [ns]", None, Some((Time, None, Some("ns")))),
            ("Gyroscope X (deg/s)", None, Some((Gyro, Some(0), Some("deg_per_s")))),
            ("Accelerometer Z (g)", None, Some((Accel, Some(2), Some("g")))),
            ("Gyroscope Y (lsb)", None, Some((Gyro, Some(1), Some("raw")))),
            ("accelX", Some("(m.s^-2)"), Some((Accel, Some(0), Some("m_per_s2")))),
            ("gyroZ", Some("(deg.s^-1)"), Some((Gyro, Some(2), Some("deg_per_s")))),
            ("temperature", Some("(degC)"), Some((Temperature, None, Some("deg_c")))),
            ("status", Some("(na)"), None),
            ("timestamp", Some("(us)"), Some((Time, None, Some("us")))),
            ("X_GYRO_OUT", None, Some((Gyro, Some(0), Some("raw")))),
            ("X_ACCL_OUT", None, Some((Accel, Some(0), Some("raw")))),
            ("TEMP_OUT", None, Some((Temperature, None, Some("raw")))),
            ("DATA_CNTR", None, Some((Counter, None, None))),
            ("X_DELTANG", None, Some((Gyro, Some(0), None))),
            ("Gyro_DPS_X", None, Some((Gyro, Some(0), Some("deg_per_s")))),
            ("Gyr_Raw_X", None, Some((Gyro, Some(0), Some("raw")))),
            ("Acc_ms2_X", None, Some((Accel, Some(0), Some("m_per_s2")))),
            ("Accel Range", None, None),
            ("Data set", None, Some((Counter, None, None))),
            ("field.angular_velocity.x", None, Some((Gyro, Some(0), Some("rad_per_s")))),
            ("field.angular_velocity_covariance0", None, None),
            ("field.linear_acceleration.z", None, Some((Accel, Some(2), Some("m_per_s2")))),
            ("%time", None, Some((Time, None, None))),
            ("gx", None, Some((Gyro, Some(0), None))),
            ("ay [mg]", None, Some((Accel, Some(1), Some("mg")))),
            ("dTheta::X [deg]", None, Some((Gyro, Some(0), Some("deg")))),
            ("deltaVelY [m/s]", None, Some((Accel, Some(1), Some("m_per_s")))),
            ("PacketCounter", None, Some((Counter, None, None))),
            ("Packet Number", None, Some((Counter, None, None))),
            ("imu_Timestamp[sec]", None, Some((Time, None, Some("s")))),
            ("Gyro X [°/s]", None, Some((Gyro, Some(0), Some("deg_per_s")))),
            ("time_ms", None, Some((Time, None, Some("ms")))),
            ("X_Value", None, Some((Time, None, None))),
            ("temp [F]", None, Some((Temperature, None, Some("raw")))),
            ("Temperature", None, Some((Temperature, None, None))),
            ("Accel_LN_X_CAL", Some("m/(s^2)"), Some((Accel, Some(0), Some("m_per_s2")))),
        ];
        for (name, row, expected) in cases {
            let found = meaning(name, row).map(|found| (found.kind, found.axis, found.unit));
            assert_eq!(found, expected, "{name}");
        }
    }

    #[test]
    fn thousandths_and_millionths_are_a_scale() {
        let scaled = |name| meaning(name, None).map(|found| (found.unit, found.scale));
        for (name, unit, scale) in [
            ("G_x [mdps]", "deg_per_s", Some(1e-3)),
            ("gx [mrad/s]", "rad_per_s", Some(1e-3)),
            ("gx [µrad/s]", "rad_per_s", Some(1e-6)),
            ("ax [ug]", "g", Some(1e-6)),
            ("ax [mg]", "mg", None),
            ("ax [m/s2]", "m_per_s2", None),
        ] {
            assert_eq!(scaled(name), Some((Some(unit), scale)), "{name}");
        }
        for unit in ["ms", "m/(s^2)", "deg/s", "mdps", "degC"] {
            assert!(is_unit(unit), "{unit}");
        }
        for word in ["", "-", "time", "Gyro_X", "1.5"] {
            assert!(!is_unit(word), "{word}");
        }
    }

    #[test]
    fn three_axes_share_a_stem_and_other_quantities_do_not() {
        let stem = |name| meaning(name, None).unwrap().stem;
        assert_eq!(stem("Gyr_X"), stem("Gyr_Z"));
        assert_eq!(stem("gyrox"), stem("gyroz"));
        assert_ne!(stem("Gyr_Raw_X"), stem("Gyro_DPS_X"));
    }
}

//! What a column holds, by its name.

use super::units::{kind_of, named, unit};
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
    /// What stands in the unit's place and is no unit that is known here.
    pub(super) unknown: Option<String>,
    /// Of several that hold the same, the least is taken.
    pub(super) rank: u8,
}

/// The name before its unit, and the unit at its end: in brackets, or after a slash between spaces. A bracket with a number is an index.
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
    name.split_once(" / ").map_or((name, None), |(head, tail)| (head.trim(), Some(tail.trim())))
}

/// Added to the rank of what is known by its unit alone.
const BY_UNIT: u8 = 32;

const GYROS: [&str; 9] = ["gyro", "gyr", "gyros", "gyroscope", "omega", "w", "g", "angrate", "rate"];
/// Those that say enough without an axis.
const GYROS_ALONE: [&str; 4] = ["gyro", "gyros", "gyroscope", "angrate"];
const ACCELS: [&str; 9] =
    ["accel", "acc", "accl", "acceleration", "accelerometer", "accelerometers", "acel", "a", "f"];
/// Parts that are of no sensor's reading.
const OTHERS: &str = "mag euler quat covariance status clipping dt integral bias range free valid relative std sigma \
    orientation mat gravity error sat lat lon";

/// What a name means, with its unit from brackets, from a row of units, or from its own parts.
pub(super) fn meaning(name: &str, of_row: Option<&str>) -> Option<Meaning> {
    let (bare, own) = bracketed(name);
    let mut parts = parts(bare);
    let stated = own.or(of_row.map(|text| text.trim_matches(['(', ')', '[', ']'])));
    let stated = stated.filter(|text| text.chars().any(|c| c.is_alphabetic() || "°\"″%".contains(c)));
    // "T_case_degC", "temp_dC", "T_block_K": the unit is the name's end.
    let is_scale = |text: &str| matches!(text, "c" | "f" | "k");
    let at_end = match parts.as_slice() {
        _ if stated.is_some() => None,
        [_, .., deg, scale] if deg == "deg" && is_scale(scale) => Some((2, format!("deg{scale}"))),
        [_, .., part, c] if (part == "d" || part == "m") && bare.ends_with(&format!("{part}C")) => {
            Some((2, format!("{part}{}", c.to_uppercase())))
        }
        [t, .., scale] if t == "t" && bare.starts_with('T') && is_scale(scale) => Some((1, scale.clone())),
        _ => None,
    };
    let (of_end, at_end) = at_end.unzip();
    parts.truncate(parts.len() - of_end.unwrap_or(0));
    let stated = stated.or(at_end.as_deref());
    let by_unit = stated.and_then(kind_of);
    let axis = take_axis(&mut parts, by_unit);
    let has = |words: &[&str]| parts.iter().any(|part| words.contains(&part.as_str()));
    let pair = |first: &str, second: &str| {
        parts.windows(2).any(|pair| pair[0] == first && pair[1].starts_with(second))
    };
    let temperature = parts.iter().any(|part| part.starts_with("temp") || part.starts_with("thermo"))
        || axis.is_none() && by_unit == Some(Kind::Temperature);
    let angle = pair("delta", "angle")
        || pair("d", "theta")
        || has(&["dtheta", "deltang", "dang", "deltaangle"])
        || pair("delta", "theta");
    let velocity =
        pair("delta", "vel") || pair("vel", "inc") || has(&["dv", "dvel", "deltvel", "deltavel", "velinc"]);
    // In steps of 100 µs, which no mapping has: Xsens counts its packets beside it.
    let fine = has(&["fine"]);
    let (kind, increment) = if fine {
        return None;
    } else if temperature {
        (Kind::Temperature, false)
    } else if parts == ["value"] && axis == Some(0) {
        // LabVIEW's X_Value: the time, whatever the columns beside it are.
        (Kind::Time, false)
    } else if OTHERS.split(' ').any(|other| has(&[other])) {
        return None;
    } else if angle && axis.is_some() {
        (Kind::Gyro, true)
    } else if velocity && axis.is_some() {
        (Kind::Accel, true)
    } else if axis.is_some() && has(&ACCELS) && parts.last().is_some_and(|last| last == "g") {
        // The last part is the unit.
        (Kind::Accel, false)
    } else if axis.is_some() && (has(&GYROS) || has(&["angular"]) && has(&["vel", "velocity"])) {
        (Kind::Gyro, false)
    } else if axis.is_some() && has(&ACCELS) || axis.is_some() && pair("specific", "force") {
        (Kind::Accel, false)
    } else if let (Some(kind @ (Kind::Gyro | Kind::Accel)), Some(_)) = (by_unit, axis) {
        (kind, false)
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
        || matches!(parts.as_slice(), [one, rest @ ..] if one == "t" && (rest.is_empty() || named(Kind::Time, false, &parts).is_some()))
        || has(&["tow"])
    {
        (Kind::Time, false)
    } else if has(&GYROS_ALONE) {
        (Kind::Gyro, false)
    } else {
        return None;
    };
    let by_name = || named(kind, increment, &parts);
    let found = stated.and_then(|text| Some((unit(kind, increment, text)?, parts.len()))).or_else(by_name);
    let ends = found.map_or(parts.len(), |(_, ends)| ends);
    let found = found.map(|(unit, _)| unit);
    let unknown = stated.filter(|_| found.is_none()).map(ToOwned::to_owned);
    let mut rank = u8::from(found.is_none()) * 4;
    let known = match kind {
        Kind::Gyro => increment || has(&GYROS) || has(&["angular"]),
        Kind::Accel => increment || has(&ACCELS) || pair("specific", "force"),
        _ => true,
    };
    rank += u8::from(!known) * BY_UNIT;
    rank += u8::from(has(&["raw", "lsb"])) * 8 + u8::from(has(&["linear"])) * 2 + u8::from(increment) * 2;
    if kind == Kind::Time {
        // Of several clocks: the sensor's own, then any, then those of weeks and of the computer that wrote.
        rank += u8::from(has(&["utc", "pc", "host", "week", "gps", "sow", "tow", "to"])) * 8;
        rank += u8::from(!has(&["startup", "timestamp", "stamp", "sensor"])) * 2;
        rank += u8::from(has(&["header", "mag", "baro"]));
    }
    let mut stem = parts[..ends].join(" ");
    if ends < parts.len() && kind != Kind::Temperature {
        // Each axis may have its own unit; readings without one are others.
        stem += " unit";
    }
    let axis = axis.filter(|axis| is_sensor(Some(kind)) || *axis < 3 && kind != Kind::Time);
    let scale = found.map(|(_, scale)| scale).filter(|scale| (scale - 1.0).abs() > f64::EPSILON);
    let unit = found.map(|(unit, _)| unit);
    Some(Meaning { kind, axis, stem, increment, unit, scale, unknown, rank })
}

/// Whether a column is a gyro's, by its name.
pub(super) fn is_gyro(name: &str) -> bool {
    meaning(name, None).is_some_and(|meaning| meaning.kind == Kind::Gyro)
}

/// The quantity by the unit that a column's name states.
pub(super) fn kind_by_unit(name: &str, of_row: Option<&str>) -> Option<Kind> {
    kind_of(bracketed(name).1.or(of_row)?)
}

fn is_sensor(kind: Option<Kind>) -> bool {
    matches!(kind, Some(Kind::Gyro | Kind::Accel))
}

/// Takes the axis out of a name: a part x, y, z, or 0, 1, 2 at its end, or the last letter of a known word. Where the unit is one of
/// sensors, a number may be 3, for those that count from 1, and the axis the second of any two letters; of rates, p, q, r alone.
fn take_axis(parts: &mut Vec<String>, by_unit: Option<Kind>) -> Option<usize> {
    let letter = |text: &str| ["x", "y", "z"].iter().position(|axis| *axis == text);
    if let ([one], Some(Kind::Gyro)) = (parts.as_mut_slice(), by_unit)
        && let Some(axis) = ["p", "q", "r"].iter().position(|axis| axis == one)
    {
        "rate".clone_into(one);
        return Some(axis);
    }
    if parts.iter().any(|part| part == "rate" || part == "gyro")
        && let Some(at) = parts.iter().position(|part| ["roll", "pitch", "yaw"].contains(&part.as_str()))
    {
        let name = parts.remove(at);
        return ["roll", "pitch", "yaw"].iter().position(|axis| *axis == name);
    }
    if let Some(at) = parts.iter().rposition(|part| letter(part).is_some()) {
        return letter(&parts.remove(at));
    }
    let last = parts.last()?.clone();
    // "ax_m_s2" ends with its unit.
    let squared =
        parts.iter().rev().nth(1).is_some_and(|before| ["s", "ms", "mps"].contains(&before.as_str()));
    if let Some(index) = last.parse::<usize>().ok().filter(|_| !squared) {
        parts.pop();
        return Some(index).filter(|index| *index < 3 + usize::from(is_sensor(by_unit)));
    }
    for part in parts.iter_mut() {
        let Some((at, _)) = part.char_indices().last() else { continue };
        let (stem, end) = part.split_at(at);
        if letter(end).is_some()
            && (GYROS.contains(&stem)
                || ACCELS.contains(&stem)
                || is_sensor(by_unit) && stem.chars().count() == 1
                || ["dtheta", "dv", "dvel", "deltang"].contains(&stem))
        {
            let axis = letter(end);
            *part = stem.to_owned();
            return axis;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use Kind::{Accel, Counter, Gyro, Temperature, Time};

    #[test]
    fn names_of_many_makers_say_what_they_hold() {
        type Case = (&'static str, Option<&'static str>, Option<(Kind, Option<usize>, Option<&'static str>)>);
        let cases: [Case; 78] = [
            ("nx(g)", None, Some((Accel, Some(0), Some("g")))),
            ("wz(dps)", None, Some((Gyro, Some(2), Some("deg_per_s")))),
            ("tboard (°C)", None, Some((Temperature, None, Some("deg_c")))),
            ("fx_g", None, Some((Accel, Some(0), Some("g")))),
            ("omega_y_dps", None, Some((Gyro, Some(1), Some("deg_per_s")))),
            ("T_case_degC", None, Some((Temperature, None, Some("deg_c")))),
            ("T_block_K", None, Some((Temperature, None, Some("kelvin")))),
            ("temp_dC", None, Some((Temperature, None, None))),
            ("dv_x [m/s]", None, Some((Accel, Some(0), Some("m_per_s")))),
            ("dvz", None, Some((Accel, Some(2), None))),
            ("q [deg/s]", None, Some((Gyro, Some(1), Some("deg_per_s")))),
            ("q", None, None),
            ("Acceleration Z / g", None, Some((Accel, Some(2), Some("g")))),
            ("Temperature / °C", None, Some((Temperature, None, Some("deg_c")))),
            ("Drehrate Nick [°/s]", None, Some((Gyro, Some(1), Some("deg_per_s")))),
            ("Beschl. längs [g]", None, None),
            ("max [g]", None, None),
            ("Vbat (V)", None, None),
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
            ("temp [F]", None, Some((Temperature, None, Some("deg_f")))),
            ("Temperature", None, Some((Temperature, None, None))),
            ("Accel_LN_X_CAL", Some("m/(s^2)"), Some((Accel, Some(0), Some("m_per_s2")))),
        ];
        for (name, row, expected) in cases {
            let found = meaning(name, row).map(|found| (found.kind, found.axis, found.unit));
            assert_eq!(found, expected, "{name}");
        }
    }

    #[test]
    fn three_axes_share_a_stem_and_other_quantities_do_not() {
        let stem = |name| meaning(name, None).unwrap().stem;
        assert_eq!(stem("Gyr_X"), stem("Gyr_Z"));
        assert_eq!(stem("gyrox"), stem("gyroz"));
        assert_ne!(stem("Gyr_Raw_X"), stem("Gyro_DPS_X"));
        assert_eq!(stem("gx_deg_h"), stem("gz_mrad_s"));
        assert_ne!(stem("gx_deg_h"), stem("gx"));
    }
}

//! Names of columns as words.

/// How words of other languages begin, and what they are here.
const WORDS: [(&str, &str); 40] = [
    ("drehrate", "gyro"),
    ("drehgeschw", "gyro"),
    ("winkelgeschw", "gyro"),
    ("kreisel", "gyro"),
    ("gyroskop", "gyro"),
    ("giroscop", "gyro"),
    ("角速度", "gyro"),
    ("rollrate", "gyrox"),
    ("nickrate", "gyroy"),
    ("gierrate", "gyroz"),
    ("beschl", "acceleration"),
    ("accélér", "acceleration"),
    ("accelerazion", "acceleration"),
    ("aceler", "acceleration"),
    ("加速度", "acceleration"),
    ("温度", "temperature"),
    ("zeit", "time"),
    ("zeitstempel", "timestamp"),
    ("uhrzeit", "time"),
    ("messzeit", "time"),
    ("temps", "time"),
    ("tempo", "time"),
    ("tiempo", "time"),
    ("heure", "time"),
    ("hora", "time"),
    ("tijd", "time"),
    ("时间", "time"),
    ("時間", "time"),
    ("時刻", "time"),
    ("zähler", "counter"),
    ("zaehler", "counter"),
    ("compteur", "counter"),
    ("contador", "counter"),
    ("contatore", "counter"),
    ("序号", "counter"),
    ("angulaire", "angular"),
    ("angolare", "angular"),
    ("lineare", "linear"),
    ("vitesse", "velocity"),
    ("velocid", "velocity"),
];

/// Letters of words that stand for themselves alone.
const LONGEST_SHORT: usize = 5;

/// Parts of a name in small letters and in English: at what is no letter or digit, and before capitals.
pub(super) fn parts(name: &str) -> Vec<String> {
    let mut parts: Vec<String> = vec![String::new()];
    let mut before = ' ';
    for c in name.chars() {
        let starts =
            c.is_uppercase() && before.is_lowercase() || c.is_ascii_digit() != before.is_ascii_digit();
        if !c.is_alphanumeric() || starts {
            parts.push(String::new());
        }
        if c.is_alphanumeric()
            && let Some(last) = parts.last_mut()
        {
            last.extend(c.to_lowercase());
        }
        before = c;
    }
    parts.retain(|part| !part.is_empty());
    for part in &mut parts {
        let is_axis = |rest: &str| ["x", "y", "z"].contains(&rest);
        let word = WORDS.iter().find_map(|(begin, word)| {
            let rest = part.strip_prefix(begin)?;
            // The short ones could be the beginning of anything.
            let whole = rest.is_empty() || is_axis(rest);
            (whole || begin.chars().count() > LONGEST_SHORT).then_some((rest, word))
        });
        if let Some((rest, word)) = word {
            *part = format!("{word}{}", if is_axis(rest) { rest } else { "" });
        }
    }
    parts
}

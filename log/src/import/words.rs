//! Names of columns as words.

/// How words of other languages begin, and what they are here.
const WORDS: [(&str, &[&str]); 15] = [
    ("gyro", &["drehrate", "drehgeschw", "winkelgeschw", "kreisel", "gyroskop", "giroscop", "角速度"]),
    ("gyrox", &["rollrate"]),
    ("gyroy", &["nickrate"]),
    ("gyroz", &["gierrate"]),
    ("pitch", &["nick"]),
    ("yaw", &["gier"]),
    ("acceleration", &["beschl", "accélér", "accelerazion", "aceler", "加速度"]),
    ("temperature", &["温度"]),
    ("time", &["zeit", "uhrzeit", "messzeit", "temps", "tempo", "tiempo", "heure", "hora", "tijd"]),
    ("time", &["时间", "時間", "時刻"]),
    ("timestamp", &["zeitstempel"]),
    ("counter", &["zähler", "zaehler", "compteur", "contador", "contatore", "序号"]),
    ("angular", &["angulaire", "angolare"]),
    ("linear", &["lineare"]),
    ("velocity", &["vitesse", "velocid"]),
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
        let words = WORDS.iter().flat_map(|(word, others)| others.iter().map(move |begin| (*begin, word)));
        let word = words.into_iter().find_map(|(begin, word)| {
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

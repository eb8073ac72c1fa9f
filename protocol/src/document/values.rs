//! Values of a table: numbers, texts, lists, choices and tables within it.
//!
//! `…_opt` gives `None` where the key is not there; the plain form reports it as missing. Both report a value
//! that is wrong and go on with a stand-in inside the limits.

use std::borrow::Cow;

use toml::de::DeValue;

use super::reader::{Reader, Table, Value, element, without_indices};

/// Largest magnitude of any number: far beyond any instrument, safe to multiply.
pub(crate) const HUGE: f64 = 1e100;

/// What a number may be.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Limits {
    /// Any finite number.
    Any,
    /// Above zero.
    Positive,
    /// Anything but zero.
    NonZero,
    /// From the first to the second.
    Within(f64, f64),
}

impl Limits {
    fn allow(self, value: f64) -> bool {
        value.abs() <= HUGE
            && match self {
                Self::Any => true,
                Self::Positive => value > 0.0,
                Self::NonZero => value.abs() > 0.0,
                Self::Within(low, high) => (low..=high).contains(&value),
            }
    }

    /// What a value must be that is not allowed.
    fn describe(self, value: Option<f64>) -> String {
        if let (Self::Positive | Self::NonZero, Some(value)) = (self, value)
            && value.is_finite()
            && value.abs() > HUGE
        {
            return format!("a number up to {HUGE:e} in magnitude");
        }
        match self {
            Self::Any => format!("a finite number up to {HUGE:e} in magnitude"),
            Self::Positive => "a number above 0".into(),
            Self::NonZero => "a number other than 0".into(),
            Self::Within(low, high) => format!("a number from {low} to {high}"),
        }
    }

    fn stand_in(self) -> f64 {
        match self {
            Self::Within(low, high) if !(low..=high).contains(&1.0) => low,
            _ => 1.0,
        }
    }
}

/// The number that a value states, whole or not; `None` for any other type.
fn as_number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(integer) => {
            let text = integer.as_str();
            #[expect(
                clippy::cast_precision_loss,
                reason = "an integer beyond 2⁵³ is rounded like any other literal"
            )]
            let whole = i64::from_str_radix(text, integer.radix()).ok().map(|whole| whole as f64);
            whole.or_else(|| text.parse().ok())
        }
        _ => None,
    }
}

/// A value as a number within its limits.
pub(crate) fn number(reader: &mut Reader<'_>, path: &str, value: &Value<'_>, limits: Limits) -> f64 {
    let found = as_number(value.get_ref());
    match found {
        Some(number) if limits.allow(number) => number,
        _ => {
            reader.refuse(path, value, &limits.describe(found));
            limits.stand_in()
        }
    }
}

/// A value as a list of `low` to `high` items.
fn list<T>(
    reader: &mut Reader<'_>,
    path: &str,
    value: &Value<'_>,
    (low, high): (usize, usize),
    mut item: impl FnMut(&mut Reader<'_>, &str, &Value<'_>) -> T,
) -> Vec<T> {
    let Some(array) = value.get_ref().as_array() else {
        reader.refuse(path, value, "an array");
        return Vec::new();
    };
    if !(low..=high).contains(&array.len()) {
        let count = if low == high { low.to_string() } else { format!("{low} to {high}") };
        reader.report_at(value.span().start, path, format!("has {} entries, must have {count}", array.len()));
        reader.damage(path);
    }
    let items = array.iter().enumerate().take(high);
    items.map(|(i, value)| item(reader, &element(path, i), value)).collect()
}

/// A value as a list of exactly `N` numbers.
fn fixed<const N: usize>(reader: &mut Reader<'_>, path: &str, value: &Value<'_>, limits: Limits) -> [f64; N] {
    let numbers = list(reader, path, value, (N, N), |r, path, value| number(r, path, value, limits));
    std::array::from_fn(|i| numbers.get(i).copied().unwrap_or(limits.stand_in()))
}

type Key = Cow<'static, str>;

impl Table<'_> {
    pub(crate) fn number_opt(
        &mut self,
        r: &mut Reader<'_>,
        key: impl Into<Key>,
        limits: Limits,
    ) -> Option<f64> {
        let key = key.into();
        let path = self.path_of(&key);
        self.take(r, key).map(|value| number(r, &path, value, limits))
    }

    pub(crate) fn number(&mut self, r: &mut Reader<'_>, key: impl Into<Key>, limits: Limits) -> f64 {
        let key = key.into();
        let value = self.number_opt(r, key.clone(), limits);
        self.need(r, &key, value, limits.stand_in())
    }

    pub(crate) fn whole_opt(
        &mut self,
        r: &mut Reader<'_>,
        key: &'static str,
        low: u32,
        high: u32,
    ) -> Option<u32> {
        let value = self.take(r, key)?;
        let whole = match value.get_ref() {
            DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok(),
            _ => None,
        };
        let whole =
            whole.and_then(|whole| u32::try_from(whole).ok()).filter(|whole| (low..=high).contains(whole));
        Some(whole.unwrap_or_else(|| {
            r.refuse(&self.path_of(key), value, &format!("a whole number from {low} to {high}"));
            low
        }))
    }

    pub(crate) fn whole(&mut self, r: &mut Reader<'_>, key: &'static str, low: u32, high: u32) -> u32 {
        let value = self.whole_opt(r, key, low, high);
        self.need(r, key, value, low)
    }

    pub(crate) fn small_opt(
        &mut self,
        r: &mut Reader<'_>,
        key: &'static str,
        low: u8,
        high: u8,
    ) -> Option<u8> {
        self.whole_opt(r, key, low.into(), high.into()).map(|whole| u8::try_from(whole).unwrap_or(low))
    }

    pub(crate) fn text_opt(
        &mut self,
        r: &mut Reader<'_>,
        key: &'static str,
        must_be: &str,
        allow: impl Fn(&str) -> bool,
    ) -> Option<String> {
        let value = self.take(r, key)?;
        let text = value.get_ref().as_str().filter(|text| allow(text));
        if text.is_none() {
            r.refuse(&self.path_of(key), value, must_be);
        }
        Some(text.unwrap_or_default().into())
    }

    pub(crate) fn text(
        &mut self,
        r: &mut Reader<'_>,
        key: &'static str,
        must_be: &str,
        allow: impl Fn(&str) -> bool,
    ) -> String {
        let value = self.text_opt(r, key, must_be, allow);
        self.need(r, key, value, String::new())
    }

    pub(crate) fn choice<T: Copy>(
        &mut self,
        r: &mut Reader<'_>,
        key: &'static str,
        choices: &[(&str, T)],
    ) -> Option<T> {
        let Some(value) = self.take(r, key) else {
            self.need(r, key, None, ());
            return None;
        };
        let text = value.get_ref().as_str();
        let chosen = choices.iter().find(|(name, _)| text == Some(name));
        if chosen.is_none() {
            let names: Vec<_> = choices.iter().map(|(name, _)| format!("{name:?}")).collect();
            r.refuse(&self.path_of(key), value, &format!("one of {}", names.join(", ")));
        }
        chosen.map(|(_, choice)| *choice)
    }

    pub(crate) fn texts(
        &mut self,
        r: &mut Reader<'_>,
        key: &'static str,
        count: (usize, usize),
    ) -> Vec<String> {
        let path = self.path_of(key);
        let texts = self.take(r, key).map(|value| {
            list(r, &path, value, count, |r, path, value| {
                let text = value.get_ref().as_str();
                if text.is_none() {
                    r.refuse(path, value, "a string");
                }
                text.unwrap_or_default().to_owned()
            })
        });
        self.need(r, key, texts, Vec::new())
    }

    pub(crate) fn numbers_opt(
        &mut self,
        r: &mut Reader<'_>,
        key: impl Into<Key>,
        count: (usize, usize),
        limits: Limits,
    ) -> Option<Vec<f64>> {
        let key = key.into();
        let path = self.path_of(&key);
        let value = self.take(r, key)?;
        Some(list(r, &path, value, count, |r, path, value| number(r, path, value, limits)))
    }

    pub(crate) fn pair_opt(
        &mut self,
        r: &mut Reader<'_>,
        key: impl Into<Key>,
        limits: Limits,
    ) -> Option<[f64; 2]> {
        let key = key.into();
        let path = self.path_of(&key);
        let [low, high] = self.take(r, key).map(|value| fixed(r, &path, value, limits))?;
        if low >= high {
            r.report(&path, format!("runs from {low} to {high}: the first must be below the second"));
            r.damage(&path);
        }
        Some(if r.is_damaged(&path) { [limits.stand_in(), limits.stand_in() + 1.0] } else { [low, high] })
    }

    /// Exactly `N` numbers in any order.
    pub(crate) fn fixed_opt<const N: usize>(
        &mut self,
        r: &mut Reader<'_>,
        key: &'static str,
        limits: Limits,
    ) -> Option<[f64; N]> {
        let path = self.path_of(key);
        self.take(r, key).map(|value| fixed(r, &path, value, limits))
    }

    /// A time in whole nanoseconds.
    pub(crate) fn time_ns(&mut self, r: &mut Reader<'_>, key: &'static str) -> i64 {
        let time = self.take(r, key).map(|value| {
            let whole = match value.get_ref() {
                DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok(),
                _ => None,
            };
            if whole.is_none() {
                r.refuse(&self.path_of(key), value, "a whole number of nanoseconds from -2^63 to 2^63 - 1");
            }
            whole.unwrap_or_default()
        });
        self.need(r, key, time, 0)
    }

    pub(crate) fn pair(&mut self, r: &mut Reader<'_>, key: impl Into<Key>, limits: Limits) -> [f64; 2] {
        let key = key.into();
        let value = self.pair_opt(r, key.clone(), limits);
        self.need(r, &key, value, [0.0, 1.0])
    }

    pub(crate) fn rows<const N: usize>(
        &mut self,
        r: &mut Reader<'_>,
        key: impl Into<Key>,
        count: (usize, usize),
    ) -> Vec<[f64; N]> {
        let key = key.into();
        let path = self.path_of(&key);
        let rows = self
            .take(r, key.clone())
            .map(|value| list(r, &path, value, count, |r, path, value| fixed(r, path, value, Limits::Any)));
        self.need(r, &key, rows, Vec::new())
    }

    pub(crate) fn table_opt(&mut self, r: &mut Reader<'_>, key: &'static str) -> Option<Self> {
        let path = self.path_of(key);
        self.take(r, key).map(|value| Self::of(r, path, value))
    }

    pub(crate) fn table(&mut self, r: &mut Reader<'_>, key: &'static str) -> Self {
        let table = self.table_opt(r, key);
        let stand_in = Self::stand_in(self.path_of(key));
        self.need(r, key, table, stand_in)
    }

    /// The `low` to `high` tables of an array; may be left out only where `low` is 0.
    pub(crate) fn tables(
        &mut self,
        r: &mut Reader<'_>,
        key: &'static str,
        (low, high): (usize, usize),
    ) -> Vec<Self> {
        let path = self.path_of(key);
        let header = format!("write `[[{}]]` above each", without_indices(&path));
        let Some(value) = self.take(r, key) else {
            if low > 0 {
                self.missing(r, key, &format!("is missing: {header} of {low} to {high}"));
            }
            return Vec::new();
        };
        let Some(array) = value.get_ref().as_array() else {
            r.refuse(&path, value, &format!("an array of tables: {header}"));
            return Vec::new();
        };
        if !(low..=high).contains(&array.len()) {
            r.report(&path, format!("has {} entries, must have {low} to {high}", array.len()));
            r.damage(&path);
        }
        let tables = array.iter().enumerate().take(high);
        tables.map(|(i, value)| Self::of(r, element(&path, i), value)).collect()
    }
}

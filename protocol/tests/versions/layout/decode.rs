//! A reader of frames that knows the layout and nothing else.

use serde_json::{Map, Value, json};

use super::file::{Content, Form, Layout};

/// Why a frame is refused; what it is in detail is no matter here.
type Refused = String;

/// The message of a frame on a key of `kind`, as JSON.
pub(super) fn decode(layout: &Layout, kind: u8, frame: &[u8]) -> Result<Value, Refused> {
    let kind = layout.kind(kind);
    if !(layout.limits["frame_bytes_least"]..=layout.limits["frame_bytes"]).contains(&frame.len()) {
        return Err("length".into());
    }
    let (covered, checksum) = frame.split_at(frame.len() - 4);
    if covered[0] != kind.number {
        return Err("kind".into());
    }
    let body =
        usize::from(covered[1]).checked_sub(1).and_then(|index| kind.bodies.get(index)).ok_or("version")?;
    if crc32fast::hash(covered).to_le_bytes() != checksum {
        return Err("checksum".into());
    }
    let mut reader = Reader { layout, bytes: &covered[2..] };
    let message = reader.named(layout.named(body))?;
    if !reader.bytes.is_empty() {
        return Err("left over".into());
    }
    kind.rules.iter().try_for_each(|rule| check(rule, &message))?;
    Ok(message)
}

/// Checks a rule of the layout.
fn check(rule: &str, message: &Value) -> Result<(), Refused> {
    let holds = match rule {
        "alike" => alike(&message["ticks"]),
        "per_channel" => {
            let channels = length(&message["channels"]);
            list(&message["ticks"]).iter().all(|tick| length(&tick["raw"]) == channels)
        }
        "span" => {
            let sigma = message["sigma_rad_per_s"].as_f64().is_some_and(|sigma| sigma >= 0.0);
            let rate = list(&message["angular_rate_rad_per_s"]).iter().all(Value::is_number);
            sigma && rate && message["end_ns"].as_i64() > message["start_ns"].as_i64()
        }
        "part" => {
            let (part, parts) = (message["part"].as_u64(), message["parts"].as_u64());
            part < parts && parts <= Some(64)
        }
        _ => panic!("no rule {rule}"),
    };
    if holds { Ok(()) } else { Err(rule.to_owned()) }
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn length(value: &Value) -> usize {
    list(value).len()
}

fn alike(ticks: &Value) -> bool {
    let shape = |tick: &Value| {
        let (variant, values) =
            tick["readings"].as_object().and_then(|readings| readings.iter().next()).expect("one");
        (variant.clone(), length(values))
    };
    let first = shape(&ticks[0]);
    list(ticks)
        .iter()
        .all(|tick| shape(tick) == first && [0, first.1].contains(&length(&tick["half_periods"])))
}

struct Reader<'a> {
    layout: &'a Layout,
    bytes: &'a [u8],
}

impl Reader<'_> {
    fn take(&mut self, count: usize) -> Result<&[u8], Refused> {
        let (taken, rest) = self.bytes.split_at_checked(count).ok_or("too short")?;
        self.bytes = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, Refused> {
        self.take(1).map(|taken| taken[0])
    }

    fn varint(&mut self, bits: u32) -> Result<u64, Refused> {
        let mut value = 0_u128;
        for index in 0..bits.div_ceil(7) {
            let byte = self.byte()?;
            value |= u128::from(byte & 0x7f) << (7 * index);
            if byte < 0x80 {
                return if value >> bits == 0 {
                    Ok(u64::try_from(value).expect("64 bits"))
                } else {
                    Err("too large".into())
                };
            }
        }
        Err("too long".into())
    }

    fn count(&mut self, least: usize, most: usize) -> Result<usize, Refused> {
        let count = usize::try_from(self.varint(64)?).map_err(|_| "too many")?;
        if (least..=most).contains(&count) { Ok(count) } else { Err(format!("{count} elements")) }
    }

    fn values(&mut self, form: &Form, count: usize) -> Result<Value, Refused> {
        (0..count).map(|_| self.value(form)).collect::<Result<Vec<_>, _>>().map(Value::Array)
    }

    fn value(&mut self, form: &Form) -> Result<Value, Refused> {
        Ok(match form {
            Form::Byte => json!(self.byte()?),
            Form::Bool => match self.byte()? {
                value @ 0..=1 => json!(value == 1),
                _ => return Err("bool".into()),
            },
            Form::Unsigned(bits) => json!(self.varint(*bits)?),
            Form::Signed(bits) => {
                let value = self.varint(*bits)?;
                json!((value >> 1).cast_signed() ^ -(value & 1).cast_signed())
            }
            Form::F64 => json!(f64::from_le_bytes(self.take(8)?.try_into().expect("eight"))),
            Form::Text(most) => {
                let count = self.count(0, most.unwrap_or(usize::MAX))?;
                json!(std::str::from_utf8(self.take(count)?).map_err(|_| "not UTF-8")?)
            }
            Form::Digest(count) => json!(
                self.take(*count)?.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
            ),
            Form::Array(item, count) => self.values(item, *count)?,
            Form::List { item, least, most } => {
                let count = self.count(*least, *most)?;
                self.values(item, count)?
            }
            Form::Option(item) => match self.byte()? {
                0 => Value::Null,
                1 => self.value(item)?,
                _ => return Err("option".into()),
            },
            Form::Named(index) => self.named(*index)?,
        })
    }

    fn named(&mut self, index: usize) -> Result<Value, Refused> {
        let layout = self.layout;
        match &layout.types[index].content {
            Content::Struct(_) => {
                let mut message = Map::new();
                for (name, form) in layout.types[index].fields() {
                    message.insert(name.to_owned(), self.value(form)?);
                }
                Ok(Value::Object(message))
            }
            Content::Enum(variants) => {
                let number = usize::try_from(self.varint(32)?).expect("32 bits");
                let variant = variants.get(number).ok_or("no such variant")?;
                Ok(match &variant.content {
                    None => json!(variant.name),
                    Some(form) => json!({ variant.name.as_str(): self.value(form)? }),
                })
            }
        }
    }
}

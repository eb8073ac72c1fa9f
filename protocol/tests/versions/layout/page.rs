//! The tables of `docs/wire.md`.

use std::fmt::Write;

use super::file::{Content, Form, Layout, Type};

/// Longest names and types for which columns are made; what is longer pushes its line out.
const COLUMNS: [usize; 2] = [24, 26];

/// Every generated region of the page with its text.
pub(super) fn regions(layout: &Layout) -> Vec<(String, String)> {
    let mut regions = vec![("kinds".to_owned(), kinds(layout))];
    for named in &layout.types {
        let Some(page) = &named.page else { continue };
        if regions.iter().all(|(region, _)| region != page) {
            regions.push((page.clone(), tables(layout, page)));
        }
    }
    for flags in &layout.flags {
        let list = flags.bits.iter().enumerate().fold(String::new(), |text, (bit, [name, meaning])| {
            text + &format!("- {bit} `{name}`: {meaning}\n")
        });
        regions.push((flags.page.clone(), list));
    }
    regions
}

fn kinds(layout: &Layout) -> String {
    let mut text = "| kind | message | key | direction | versions |\n|---|---|---|---|---|\n".to_owned();
    for kind in &layout.kinds {
        let (number, versions) = (kind.number, kind.bodies.len());
        let (message, key, direction) = (&kind.message, &kind.key, &kind.direction);
        writeln!(text, "| {number} | {message} | `{key}` | {direction} | 1 to {versions} |").expect("memory");
    }
    text
}

/// The tables of one section.
fn tables(layout: &Layout, page: &str) -> String {
    let mut text = String::new();
    for named in layout.types.iter().filter(|named| named.page.as_deref() == Some(page)) {
        if text.is_empty() {
            text.push_str("```text\n");
        } else if named.name.ends_with("_batch") {
            text.push('\n');
        }
        let meaning = named.meaning.as_ref().map(|meaning| format!(": {meaning}")).unwrap_or_default();
        writeln!(text, "{}{meaning}", title(&named.name)).expect("memory");
        for row in rows(layout, named) {
            let [name, form, meaning] = row;
            let [first, second] = COLUMNS;
            writeln!(text, "{}", format!("  {name:first$} {form:second$} {meaning}").trim_end())
                .expect("memory");
        }
    }
    text + "```\n"
}

/// A name as words, with a capital.
fn title(name: &str) -> String {
    let words = name.replace('_', " ");
    words[..1].to_uppercase() + &words[1..]
}

/// Name, type and meaning of each line of a type.
fn rows(layout: &Layout, named: &Type) -> Vec<[String; 3]> {
    match &named.content {
        Content::Struct(lines) => lines
            .iter()
            .map(|line| {
                let (form, variants) = shown(layout, &line.form);
                let meaning = [variants, line.meaning.clone()].into_iter().filter(|part| !part.is_empty());
                [line.names.join(", "), form, meaning.collect::<Vec<_>>().join("; ")]
            })
            .collect(),
        Content::Enum(variants) => variants
            .iter()
            .enumerate()
            .map(|(number, variant)| {
                let form = variant.content.as_ref().map(|form| shown(layout, form).0).unwrap_or_default();
                [format!("{number} {}", variant.name), form, variant.meaning.clone()]
            })
            .collect(),
    }
}

/// A form in words, and the variants of an enum that is shown where it is used.
fn shown(layout: &Layout, form: &Form) -> (String, String) {
    let plain = |text: String| (text, String::new());
    match form {
        Form::Byte => plain("u8".into()),
        Form::Bool => plain("bool".into()),
        Form::Unsigned(bits) => plain(format!("u{bits}")),
        Form::Signed(bits) => plain(format!("i{bits}")),
        Form::F64 => plain("f64".into()),
        Form::Text(None) => plain("string".into()),
        Form::Text(Some(most)) => plain(format!("string ≤ {most}")),
        Form::Digest(count) => plain(format!("u8×{count}")),
        Form::Array(item, count) => plain(format!("{}×{count}", shown(layout, item).0)),
        Form::List { item, least, most } => plain(format!("[{}] {least}…{most}", shown(layout, item).0)),
        Form::Option(item) => {
            let (item, variants) = shown(layout, item);
            (
                if item.contains('×') && !item.starts_with('(') { format!("({item})?") } else { item + "?" },
                variants,
            )
        }
        Form::Named(index) => {
            let named = &layout.types[*index];
            match &named.content {
                Content::Struct(lines) if named.inline => {
                    let fields = lines
                        .iter()
                        .map(|line| format!("{} {}", line.names.join(", "), shown(layout, &line.form).0));
                    plain(format!("({})", fields.collect::<Vec<_>>().join(", ")))
                }
                Content::Enum(variants) if named.inline => {
                    let variant = |(number, variant): (usize, &super::file::Variant)| {
                        let content =
                            variant.content.as_ref().map(|form| format!(" {}", shown(layout, form).0));
                        format!("{number} \"{}\"{}", variant.name, content.unwrap_or_default())
                    };
                    ("enum".into(), variants.iter().enumerate().map(variant).collect::<Vec<_>>().join(" "))
                }
                _ => plain(named.name.replace('_', " ")),
            }
        }
    }
}

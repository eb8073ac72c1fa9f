//! The layout as C: the functions that write what a producer sends, and those that read frames.

use std::fmt::Write;

use super::c::{Place, constant, identifier, is_plain, members, place};
use super::file::{Form, Layout, Type};

/// Types that a producer writes.
const WRITTEN: &[&str] =
    &["gyro_tick", "accelerometer_tick", "temperature_tick", "health_reading", "rate_reference"];

/// Writers of those types and of what they hold.
pub(super) fn writers(layout: &Layout, order: &[usize]) -> String {
    let mut text = String::new();
    let mut written = Vec::<usize>::new();
    for name in WRITTEN {
        add_with_parts(layout, layout.named(name), &mut written);
    }
    for &index in order.iter().filter(|index| written.contains(index)) {
        writer(layout, &layout.types[index], &mut text);
    }
    text
}

fn add_with_parts(layout: &Layout, index: usize, written: &mut Vec<usize>) {
    written.push(index);
    for (_, form) in members(&layout.types[index]) {
        let mut form = form;
        while let Form::Array(item, _) | Form::List { item, .. } | Form::Option(item) = form {
            form = item;
        }
        if let Form::Named(part) = form {
            add_with_parts(layout, *part, written);
        }
    }
}

/// Statements that write a value.
fn write(layout: &Layout, from: &str, form: &Form, text: &mut String) {
    let each = |item: &Form, count: &str| {
        let mut inner = String::new();
        write(layout, &format!("{from}[i]"), item, &mut inner);
        format!(
            "    for (uint32_t i = 0; i < {count}; ++i) {{\n    {}    }}\n",
            inner.replace("\n    ", "\n        ")
        )
    };
    match (place(layout, form), form) {
        (Place::Scalar(name), _) => writeln!(text, "    isotherm_put_{name}(w, {from});").expect("memory"),
        (Place::Array(count), Form::Array(item, _)) => text.push_str(&each(item, &count.to_string())),
        (Place::View, Form::Text(most)) => {
            let most = most.unwrap_or(layout.limits["frame_bytes"]);
            writeln!(text, "    isotherm_put_text(w, {most}u, {from});").expect("memory");
        }
        (Place::List(most), Form::List { item, .. }) => {
            writeln!(text, "    isotherm_put_count(w, {most}u, {from}_count);").expect("memory");
            text.push_str(&each(item, &format!("{from}_count && w->ok")));
        }
        (Place::Option, Form::Option(item)) => {
            let has = from.replacen("->", "->has_", 1);
            let mut inner = String::new();
            write(layout, from, item, &mut inner);
            writeln!(text, "    isotherm_put_bool(w, {has});\n    if ({has}) {{\n    {inner}    }}")
                .expect("memory");
        }
        (Place::Named(index), _) => {
            writeln!(text, "    isotherm_write_{}(w, &{from});", layout.types[index].name).expect("memory");
        }
        _ => unreachable!("{form:?} is not written"),
    }
}

fn writer(layout: &Layout, named: &Type, text: &mut String) {
    let name = &named.name;
    writeln!(
        text,
        "\nstatic inline void isotherm_write_{name}(isotherm_writer *w, const isotherm_{name} *v) {{"
    )
    .expect("memory");
    if is_plain(named) {
        writeln!(text, "    isotherm_put_variant(w, {}u, (uint32_t)*v);\n}}", named.variants().len())
            .expect("memory");
        return;
    }
    if !named.variants().is_empty() {
        writeln!(text, "    isotherm_put_variant(w, {}u, (uint32_t)v->variant);", named.variants().len())
            .expect("memory");
    }
    for (field, form) in named.fields() {
        write(layout, &format!("v->{}", identifier(field)), form, text);
    }
    for (number, variant) in named.variants().iter().enumerate() {
        let Some(form) = &variant.content else { continue };
        let mut inner = String::new();
        write(layout, &format!("v->{}", identifier(&variant.name)), form, &mut inner);
        writeln!(
            text,
            "    if ((uint32_t)v->variant == {number}u) {{\n    {}\n    }}",
            inner.trim_end().replace("\n    ", "\n        ")
        )
        .expect("memory");
    }
    text.push_str("}\n");
}

/// One function for each version of each kind, which reads a frame.
pub(super) fn frames(layout: &Layout) -> String {
    let mut text = String::new();
    for kind in &layout.kinds {
        for (version, body) in (1..).zip(&kind.bodies) {
            let rules = kind
                .rules
                .iter()
                .map(|rule| format!("    if (!isotherm_rule_{rule}_{body}(o)) return ISOTHERM_RULE;\n"));
            writeln!(
                text,
                "\n/* Version {version} of kind {}; what `o` holds after an error means nothing. */\n\
                 static inline isotherm_result isotherm_decode_{body}(const uint8_t *frame, size_t length, isotherm_{body} *o) {{\n    \
                 isotherm_cursor c;\n    \
                 const isotherm_result opened = isotherm_open(frame, length, ISOTHERM_KIND_{}, {version}u, &c);\n    \
                 if (opened != ISOTHERM_OK) return opened;\n    \
                 if (!isotherm_read_{body}(&c, o)) return ISOTHERM_BODY;\n    \
                 if (c.at != c.end) return ISOTHERM_LEFT_OVER;\n{}    \
                 return ISOTHERM_OK;\n}}",
                kind.number,
                constant(&kind.name),
                rules.collect::<String>()
            )
            .expect("memory");
        }
    }
    text.trim_start().to_owned()
}

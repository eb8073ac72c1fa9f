//! A printer of decoded messages as JSON, in C: what `clients/c/tests/vectors.c` shows of each frame.

use std::fmt::Write;

use super::c::{Place, identifier, is_plain, members, ordered, place};
use super::file::{Form, Layout, Type};

/// The printers of all types, and `print_frame`, which decodes and prints.
pub(super) fn printer(layout: &Layout) -> String {
    let mut text = String::new();
    for index in ordered(layout) {
        named(layout, &layout.types[index], &mut text);
    }
    text.push_str(
        "\nstatic isotherm_result print_frame(unsigned kind, const uint8_t *frame, size_t length) {\n",
    );
    text.push_str("    const unsigned version = isotherm_version(frame, length);\n");
    for kind in &layout.kinds {
        for (version, body) in (1..).zip(&kind.bodies) {
            let last = version == kind.bodies.len();
            let chosen = if last { String::new() } else { format!(" && version == {version}u") };
            writeln!(
                text,
                "    if (kind == {}u{chosen}) {{\n        static isotherm_{body} message;\n        \
                 const isotherm_result result = isotherm_decode_{body}(frame, length, &message);\n        \
                 if (result == ISOTHERM_OK) print_{body}(&message);\n        return result;\n    }}",
                kind.number
            )
            .expect("memory");
        }
    }
    text + "    return ISOTHERM_KIND;\n}\n"
}

fn named(layout: &Layout, named: &Type, text: &mut String) {
    let name = &named.name;
    writeln!(text, "\nstatic void print_{name}(const isotherm_{name} *v) {{").expect("memory");
    if named.variants().is_empty() {
        for (index, (field, form)) in named.fields().into_iter().enumerate() {
            let opening = if index == 0 { "{" } else { "," };
            writeln!(text, "    printf(\"{opening}\\\"{field}\\\":\");").expect("memory");
            value(layout, &format!("v->{}", identifier(field)), form, text);
        }
        text.push_str("    printf(\"}\");\n");
    }
    let tag = if is_plain(named) { "*v" } else { "v->variant" };
    for (number, variant) in named.variants().iter().enumerate() {
        writeln!(text, "    if ((unsigned){tag} == {number}u) {{").expect("memory");
        match &variant.content {
            None => writeln!(text, "    printf(\"\\\"{}\\\"\");", variant.name).expect("memory"),
            Some(form) => {
                writeln!(text, "    printf(\"{{\\\"{}\\\":\");", variant.name).expect("memory");
                value(layout, &format!("v->{}", identifier(&variant.name)), form, text);
                text.push_str("    printf(\"}\");\n");
            }
        }
        text.push_str("    }\n");
    }
    assert!(!members(named).is_empty() || is_plain(named), "{name} has something to print");
    text.push_str("}\n");
}

fn value(layout: &Layout, from: &str, form: &Form, text: &mut String) {
    let each = |item: &Form, count: &str| {
        let mut inner = String::new();
        value(layout, &format!("{from}[i]"), item, &mut inner);
        format!(
            "    printf(\"[\");\n    for (uint32_t i = 0; i < {count}; ++i) {{\n    if (i) printf(\",\");\n{inner}    }}\n    printf(\"]\");\n"
        )
    };
    match (place(layout, form), form) {
        (Place::Scalar(name), _) => writeln!(text, "    print_{name}({from});").expect("memory"),
        (Place::Digest(count), _) => writeln!(text, "    print_digest({from}, {count});").expect("memory"),
        (Place::View, Form::Text(_)) => writeln!(text, "    print_text({from});").expect("memory"),
        (Place::View, _) => writeln!(text, "    print_bytes({from});").expect("memory"),
        (Place::Array(count), Form::Array(item, _)) => text.push_str(&each(item, &count.to_string())),
        (Place::List(_), Form::List { item, .. }) => text.push_str(&each(item, &format!("{from}_count"))),
        (Place::Walked, Form::List { item, .. }) => {
            let (c_type, function) = match item.as_ref() {
                Form::Named(index) => (layout.types[*index].name.clone(), layout.types[*index].name.clone()),
                Form::Text(_) => ("view".to_owned(), "text".to_owned()),
                other => unreachable!("a list of {other:?} is not walked"),
            };
            let mut inner = String::new();
            value(layout, "item", item, &mut inner);
            writeln!(
                text,
                "    {{\n    isotherm_list list = {from};\n    isotherm_{c_type} item;\n    printf(\"[\");\n    \
                 for (uint32_t i = 0; isotherm_next_{function}(&list, &item); ++i) {{\n    if (i) printf(\",\");\n{inner}    }}\n    \
                 printf(\"]\");\n    if (list.count != 0 || list.at != list.end) abort();\n    }}"
            )
            .expect("memory");
        }
        (Place::Option, Form::Option(item)) => {
            let mut inner = String::new();
            value(layout, from, item, &mut inner);
            let has = from.replacen("->", "->has_", 1);
            writeln!(text, "    if ({has}) {{\n{inner}    }} else {{\n    printf(\"null\");\n    }}")
                .expect("memory");
        }
        (Place::Named(index), _) => {
            writeln!(text, "    print_{}(&{from});", layout.types[index].name).expect("memory");
        }
        _ => unreachable!("{form:?}"),
    }
}

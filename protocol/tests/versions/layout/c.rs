//! The layout as C: constants, structures, and the functions that read them.

use std::fmt::Write;

use super::c_writer::writers;
use super::file::{Form, Layout, Type};

/// Most elements of a list that stands in its structure; longer ones are walked.
const MOST_IN_PLACE: usize = 16;
/// Most values of an element of such a list.
const MOST_VALUES: usize = 3;
/// How a value stands in C.
#[derive(PartialEq)]
pub(super) enum Place {
    Scalar(&'static str),
    Digest(usize),
    Array(usize),
    /// In the structure, with a count.
    List(usize),
    /// Bytes of the frame.
    View,
    /// Elements of the frame, to be walked.
    Walked,
    Option,
    Named(usize),
}

pub(super) fn place(layout: &Layout, form: &Form) -> Place {
    match form {
        Form::Byte => Place::Scalar("u8"),
        Form::Bool => Place::Scalar("bool"),
        Form::Unsigned(16) => Place::Scalar("u16"),
        Form::Unsigned(32) => Place::Scalar("u32"),
        Form::Unsigned(_) => Place::Scalar("u64"),
        Form::Signed(32) => Place::Scalar("i32"),
        Form::Signed(_) => Place::Scalar("i64"),
        Form::F64 => Place::Scalar("real"),
        Form::Text(_) => Place::View,
        Form::Digest(count) => Place::Digest(*count),
        Form::Array(_, count) => Place::Array(*count),
        Form::List { item, most, .. } if *most <= MOST_IN_PLACE && small(layout, item) => Place::List(*most),
        Form::List { item, .. } if **item == Form::Byte => Place::View,
        Form::List { .. } => Place::Walked,
        Form::Option(_) => Place::Option,
        Form::Named(index) => Place::Named(*index),
    }
}

/// Whether a list may hold it in place.
fn small(layout: &Layout, form: &Form) -> bool {
    let plain =
        |form: &Form| matches!(place(layout, form), Place::Scalar(_)) || matches!(form, Form::Text(_));
    match form {
        Form::Named(index) => {
            let fields = layout.types[*index].fields();
            (1..=MOST_VALUES).contains(&fields.len()) && fields.iter().all(|(_, form)| plain(form))
        }
        form => plain(form),
    }
}

/// A name in C.
pub(super) fn identifier(name: &str) -> String {
    name.to_lowercase().replace(['-', ' '], "_")
}

pub(super) fn constant(name: &str) -> String {
    identifier(name).to_uppercase()
}

/// Whether an enum is one of C's: no variant has content.
pub(super) fn is_plain(named: &Type) -> bool {
    named.fields().is_empty() && named.variants().iter().all(|variant| variant.content.is_none())
}

/// Members of a structure: fields, or variants with content.
pub(super) fn members(named: &Type) -> Vec<(String, &Form)> {
    let fields = named.fields().into_iter().map(|(name, form)| (identifier(name), form));
    let variants = named.variants().iter();
    let contents =
        variants.filter_map(|variant| Some((identifier(&variant.name), variant.content.as_ref()?)));
    fields.chain(contents).collect()
}

/// Types in an order in which each comes after those that it holds.
pub(super) fn ordered(layout: &Layout) -> Vec<usize> {
    fn visit(layout: &Layout, form: &Form, order: &mut Vec<usize>) {
        match form {
            Form::Array(item, _) | Form::List { item, .. } | Form::Option(item) => visit(layout, item, order),
            Form::Named(index) if !order.contains(index) => {
                for (_, form) in members(&layout.types[*index]) {
                    visit(layout, form, order);
                }
                order.push(*index);
            }
            _ => {}
        }
    }
    let mut order = Vec::new();
    (0..layout.types.len()).for_each(|index| visit(layout, &Form::Named(index), &mut order));
    order
}

/// Constants, structures, readers and writers.
pub(super) fn types(layout: &Layout) -> String {
    let mut text = String::new();
    for (name, limit) in &layout.limits {
        writeln!(text, "#define ISOTHERM_MAX_{} {limit}u", constant(name)).expect("memory");
    }
    text = text.replace("MAX_FRAME_BYTES_LEAST", "MIN_FRAME_BYTES");
    text.push('\n');
    for kind in &layout.kinds {
        writeln!(text, "#define ISOTHERM_KIND_{} {}u", constant(&kind.name), kind.number).expect("memory");
    }
    for flags in &layout.flags {
        text.push('\n');
        for (bit, [name, meaning]) in flags.bits.iter().enumerate() {
            let prefix = constant(&flags.name);
            writeln!(text, "/* {meaning} */\n#define ISOTHERM_{prefix}_{name} (1u << {bit})")
                .expect("memory");
        }
    }
    let order = ordered(layout);
    for &index in &order {
        structure(layout, &layout.types[index], &mut text);
    }
    for &index in &order {
        reader(layout, &layout.types[index], &mut text);
        let is_walked = |form: &Form| matches!(form, Form::List { item, .. } if **item == Form::Named(index));
        let lists = layout.types.iter().flat_map(|named| members(named).into_iter().map(|(_, form)| form));
        if lists.filter(|form| is_walked(form)).any(|form| place(layout, form) == Place::Walked) {
            next(&layout.types[index].name, &mut text);
        }
    }
    text.push_str(&writers(layout, &order));
    text
}

/// Type of a value in C.
fn c_type(layout: &Layout, form: &Form) -> String {
    match place(layout, form) {
        Place::Scalar("real") => "isotherm_real".into(),
        Place::Scalar("bool") => "bool".into(),
        Place::Scalar(name) => format!("{}int{}_t", if name.starts_with('u') { "u" } else { "" }, &name[1..]),
        Place::View => "isotherm_view".into(),
        Place::Walked => "isotherm_list".into(),
        Place::Named(index) => format!("isotherm_{}", layout.types[index].name),
        _ => unreachable!("{form:?} has no type of its own"),
    }
}

fn declare(layout: &Layout, name: &str, form: &Form, text: &mut String) {
    match (place(layout, form), form) {
        (Place::Digest(count), _) => writeln!(text, "    uint8_t {name}[{count}];"),
        (Place::Array(count), Form::Array(item, _)) => {
            writeln!(text, "    {} {name}[{count}];", c_type(layout, item))
        }
        (Place::List(most), Form::List { item, .. }) => {
            writeln!(text, "    uint32_t {name}_count;\n    {} {name}[{most}];", c_type(layout, item))
        }
        (Place::Option, Form::Option(item)) => {
            writeln!(text, "    bool has_{name};").expect("memory");
            declare(layout, name, item, text);
            Ok(())
        }
        _ => writeln!(text, "    {} {name};", c_type(layout, form)),
    }
    .expect("memory");
}

fn structure(layout: &Layout, named: &Type, text: &mut String) {
    let name = &named.name;
    text.push('\n');
    if !named.variants().is_empty() {
        let prefix = constant(name);
        let variants = named.variants().iter();
        let variants = variants.map(|variant| format!("    ISOTHERM_{prefix}_{}", constant(&variant.name)));
        let tag = if is_plain(named) { name.clone() } else { format!("{name}_variant") };
        let variants = variants.collect::<Vec<_>>().join(",\n");
        writeln!(text, "typedef enum {{\n{variants}\n}} isotherm_{tag};").expect("memory");
        if is_plain(named) {
            return;
        }
    }
    text.push_str("typedef struct {\n");
    if !named.variants().is_empty() {
        writeln!(text, "    isotherm_{name}_variant variant;").expect("memory");
    }
    for (member, form) in members(named) {
        declare(layout, &member, form, text);
    }
    writeln!(text, "}} isotherm_{name};").expect("memory");
}

/// Statements that read a value into `to`.
fn read(layout: &Layout, to: &str, form: &Form, text: &mut String) {
    let get = |call: String| format!("    if (!{call}) return false;\n");
    let each = |item: &Form, count: &str| {
        let mut inner = String::new();
        read(layout, &format!("{to}[i]"), item, &mut inner);
        format!(
            "    for (uint32_t i = 0; i < {count}; ++i) {{\n    {}    }}\n",
            inner.replace("\n    ", "\n        ")
        )
    };
    match (place(layout, form), form) {
        (Place::Scalar(name), _) => text.push_str(&get(format!("isotherm_get_{name}(c, &{to})"))),
        (Place::Digest(count), _) => text.push_str(&get(format!("isotherm_get_bytes(c, {count}, {to})"))),
        (Place::Array(count), Form::Array(item, _)) => text.push_str(&each(item, &count.to_string())),
        (Place::View, Form::Text(most)) => {
            let most = most.unwrap_or(layout.limits["frame_bytes"]);
            text.push_str(&get(format!("isotherm_get_text(c, {most}u, &{to})")));
        }
        (Place::View, Form::List { least, most, .. }) => {
            text.push_str(&get(format!("isotherm_get_view(c, {least}u, {most}u, &{to})")));
        }
        (Place::List(_), Form::List { item, least, most }) => {
            text.push_str(&get(format!("isotherm_get_count(c, {least}u, {most}u, &{to}_count)")));
            text.push_str(&each(item, &format!("{to}_count")));
        }
        (Place::Walked, Form::List { item, least, most }) => {
            text.push_str(&get(format!("isotherm_get_count(c, {least}u, {most}u, &{to}.count)")));
            let mut inner = String::new();
            read(layout, "item", item, &mut inner);
            writeln!(
                text,
                "    {to}.at = c->at;\n    for (uint32_t i = 0; i < {to}.count; ++i) {{\n        {} item;\n    {inner}    }}\n    {to}.end = c->at;",
                c_type(layout, item)
            )
            .expect("memory");
        }
        (Place::Option, Form::Option(item)) => {
            let has = to.replacen("->", "->has_", 1);
            text.push_str(&get(format!("isotherm_get_bool(c, &{has})")));
            let mut inner = String::new();
            read(layout, to, item, &mut inner);
            writeln!(
                text,
                "    if ({has}) {{\n    {}\n    }}",
                inner.trim_end().replace("\n    ", "\n        ")
            )
            .expect("memory");
        }
        (Place::Named(index), _) => {
            text.push_str(&get(format!("isotherm_read_{}(c, &{to})", layout.types[index].name)));
        }
        _ => unreachable!("{form:?}"),
    }
}

fn reader(layout: &Layout, named: &Type, text: &mut String) {
    let name = &named.name;
    writeln!(text, "\nstatic inline bool isotherm_read_{name}(isotherm_cursor *c, isotherm_{name} *o) {{")
        .expect("memory");
    let variants = named.variants();
    if !variants.is_empty() {
        let count = variants.len();
        writeln!(text, "    uint32_t variant = 0;\n    if (!isotherm_get_u32(c, &variant) || variant >= {count}u) return false;").expect("memory");
        if is_plain(named) {
            writeln!(text, "    *o = (isotherm_{name})variant;\n    return true;\n}}").expect("memory");
            return;
        }
    }
    text.push_str("    memset(o, 0, sizeof *o);\n");
    if variants.is_empty() {
        for (field, form) in named.fields() {
            read(layout, &format!("o->{}", identifier(field)), form, text);
        }
    } else {
        writeln!(text, "    o->variant = (isotherm_{name}_variant)variant;").expect("memory");
        for (number, variant) in variants.iter().enumerate() {
            let Some(form) = &variant.content else { continue };
            let mut inner = String::new();
            read(layout, &format!("o->{}", identifier(&variant.name)), form, &mut inner);
            writeln!(
                text,
                "    if (variant == {number}u) {{\n    {}\n    }}",
                inner.trim_end().replace("\n    ", "\n        ")
            )
            .expect("memory");
        }
    }
    text.push_str("    return true;\n}\n");
}

/// Walks the elements of a list.
fn next(name: &str, text: &mut String) {
    writeln!(
        text,
        "\nstatic inline bool isotherm_next_{name}(isotherm_list *list, isotherm_{name} *item) {{\n    \
         isotherm_cursor c = {{list->at, list->end}};\n    \
         if (list->count == 0 || !isotherm_read_{name}(&c, item)) return false;\n    \
         list->at = c.at;\n    --list->count;\n    return true;\n}}"
    )
    .expect("memory");
}

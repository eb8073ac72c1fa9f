//! The layout as a module of the Python package, as types for TypeScript, and as constants for the console.

use std::fmt::Write;

use super::file::{Content, Form, Layout};

/// `clients/python/src/isotherm/_layout.py`.
pub(super) fn module(layout: &Layout) -> String {
    let mut text = "\"\"\"Layout of the wire messages.\n\nGenerated from protocol/layout.toml; change that file, not this one.\n\"\"\"\n\n\
                    from __future__ import annotations\n\nfrom typing import Any\n\n"
        .to_owned();
    for (name, limit) in &layout.limits {
        writeln!(text, "{} = {limit}", name.to_uppercase()).expect("memory");
    }
    text.push('\n');
    for kind in &layout.kinds {
        writeln!(text, "{} = {}", kind.name.to_uppercase(), kind.number).expect("memory");
    }
    text.push_str(
        "\n# Kind: key, types of its versions from 1, rules.\n\
                   KINDS: dict[int, tuple[str, tuple[str, ...], tuple[str, ...]]] = {\n",
    );
    for kind in &layout.kinds {
        let (bodies, rules) = (tuple(&kind.bodies), tuple(&kind.rules));
        writeln!(text, "    {}: ({:?}, {bodies}, {rules}),", kind.number, kind.key).expect("memory");
    }
    text.push_str("}\n");
    for flags in &layout.flags {
        let bits = flags.bits.iter().enumerate();
        writeln!(text, "\n{}_FLAGS: dict[str, int] = {{", flags.name.to_uppercase()).expect("memory");
        for (bit, [name, _]) in bits {
            writeln!(text, "    {name:?}: 1 << {bit},").expect("memory");
        }
        text.push_str("}\n");
    }
    text.push_str(
        "\n# Type: fields (name, form) of a struct, or variants (name, form or None) of an enum.\n",
    );
    for (word, is_struct) in [("STRUCTS", true), ("ENUMS", false)] {
        writeln!(text, "{word}: dict[str, tuple[tuple[str, Any], ...]] = {{").expect("memory");
        for named in
            layout.types.iter().filter(|named| matches!(named.content, Content::Struct(_)) == is_struct)
        {
            writeln!(text, "    {:?}: (", named.name).expect("memory");
            for (name, form) in named.fields() {
                writeln!(text, "        ({name:?}, {}),", python(layout, form)).expect("memory");
            }
            for variant in named.variants() {
                let form = variant.content.as_ref().map_or("None".to_owned(), |form| python(layout, form));
                writeln!(text, "        ({:?}, {form}),", variant.name).expect("memory");
            }
            text.push_str("    ),\n");
        }
        text.push_str("}\n");
    }
    text
}

fn tuple(names: &[String]) -> String {
    names.iter().fold("(".to_owned(), |text, name| text + &format!("{name:?}, ")).trim_end().to_owned() + ")"
}

/// A form as the package reads it.
fn python(layout: &Layout, form: &Form) -> String {
    match form {
        Form::Byte => "\"u8\"".into(),
        Form::Bool => "\"bool\"".into(),
        Form::Unsigned(bits) => format!("\"u{bits}\""),
        Form::Signed(bits) => format!("\"i{bits}\""),
        Form::F64 => "\"f64\"".into(),
        Form::Text(most) => format!("(\"string\", {})", most.unwrap_or(layout.limits["frame_bytes"])),
        Form::Digest(count) => format!("(\"digest\", {count})"),
        Form::Array(item, count) => format!("(\"array\", {}, {count})", python(layout, item)),
        Form::List { item, least, most } => format!("(\"list\", {}, {least}, {most})", python(layout, item)),
        Form::Option(item) => format!("(\"option\", {})", python(layout, item)),
        Form::Named(index) => format!("(\"named\", {:?})", layout.types[*index].name),
    }
}

/// `clients/typescript/isotherm.ts`: what `isotherm status --json` and a console show.
pub(super) fn typescript(layout: &Layout) -> String {
    let mut text =
        "// Messages as JSON: numbers that are not finite are null, digests are hexadecimal digits. JSON.parse rounds whole numbers\n\
                    // beyond 2^53.\n\
                    // Generated from protocol/layout.toml; change that file, not this one.\n"
            .to_owned();
    for flags in &layout.flags {
        writeln!(text, "\nexport const {}Flags = {{", flags.name).expect("memory");
        for (bit, [name, meaning]) in flags.bits.iter().enumerate() {
            writeln!(text, "  /** {meaning} */\n  {name}: {},", 1_u32 << bit).expect("memory");
        }
        text.push_str("} as const;\n");
    }
    for named in &layout.types {
        let name = camel(&named.name);
        match &named.content {
            Content::Struct(lines) => {
                writeln!(text, "\nexport interface {name} {{").expect("memory");
                for line in lines {
                    for field in &line.names {
                        if !line.meaning.is_empty() {
                            writeln!(text, "  /** {} */", line.meaning).expect("memory");
                        }
                        writeln!(text, "  {field}: {};", script(layout, &line.form)).expect("memory");
                    }
                }
                text.push_str("}\n");
            }
            Content::Enum(variants) => {
                let variants = variants.iter().map(|variant| match &variant.content {
                    None => format!("{:?}", variant.name),
                    Some(form) => format!("{{ {:?}: {} }}", variant.name, script(layout, form)),
                });
                writeln!(text, "\nexport type {name} = {};", variants.collect::<Vec<_>>().join(" | "))
                    .expect("memory");
            }
        }
    }
    text
}

/// Bits by name, for the script of the console: lines of JavaScript.
pub(super) fn flags_of_the_console(layout: &Layout) -> String {
    let mut text = String::new();
    for flags in layout.flags.iter().filter(|flags| flags.name == "sensor") {
        let bits = flags.bits.iter().enumerate();
        let bits = bits.map(|(bit, [name, _])| format!("{name}: {}", 1_u32 << bit)).collect::<Vec<_>>();
        writeln!(text, "const {}_FLAGS = {{ {} }};", flags.name.to_uppercase(), bits.join(", "))
            .expect("memory");
    }
    text
}

fn camel(name: &str) -> String {
    name.split('_').map(|word| word[..1].to_uppercase() + &word[1..]).collect()
}

fn script(layout: &Layout, form: &Form) -> String {
    match form {
        Form::Bool => "boolean".into(),
        Form::Byte | Form::Unsigned(_) | Form::Signed(_) => "number".into(),
        Form::F64 => "number | null".into(),
        Form::Text(_) | Form::Digest(_) => "string".into(),
        Form::Array(item, _) | Form::List { item, .. } => format!("Array<{}>", script(layout, item)),
        Form::Option(item) if **item == Form::F64 => script(layout, item),
        Form::Option(item) => format!("{} | null", script(layout, item)),
        Form::Named(index) => camel(&layout.types[*index].name),
    }
}

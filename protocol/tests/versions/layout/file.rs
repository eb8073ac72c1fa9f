//! `protocol/layout.toml`, read.

use std::collections::BTreeMap;

use serde::Deserialize;

const FILE: &str = include_str!("../../../layout.toml");

/// The file as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    limits: BTreeMap<String, usize>,
    kind: Vec<Kind>,
    #[serde(rename = "type")]
    types: Vec<WrittenType>,
    flags: Vec<Flags>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenType {
    name: String,
    page: Option<String>,
    meaning: Option<String>,
    #[serde(default)]
    inline: bool,
    fields: Option<Vec<[String; 3]>>,
    variants: Option<Vec<[String; 3]>>,
}

/// A kind of message.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Kind {
    pub(super) number: u8,
    pub(super) name: String,
    /// Its name on the page, perhaps a link.
    pub(super) message: String,
    pub(super) key: String,
    pub(super) direction: String,
    /// Type of the body, by version from 1.
    pub(super) bodies: Vec<String>,
    /// What the types cannot say.
    #[serde(default)]
    pub(super) rules: Vec<String>,
}

/// Names and meanings of bits, from bit 0.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Flags {
    pub(super) name: String,
    pub(super) page: String,
    pub(super) bits: Vec<[String; 2]>,
}

/// Form of a value.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Form {
    Byte,
    Bool,
    /// Of so many bits.
    Unsigned(u32),
    Signed(u32),
    F64,
    /// Of at most so many bytes.
    Text(Option<usize>),
    Digest(usize),
    Array(Box<Form>, usize),
    List {
        item: Box<Form>,
        least: usize,
        most: usize,
    },
    Option(Box<Form>),
    /// Index in [`Layout::types`].
    Named(usize),
}

/// One line of a table: names that share a form.
pub(super) struct Line {
    pub(super) names: Vec<String>,
    pub(super) form: Form,
    pub(super) meaning: String,
}

pub(super) struct Variant {
    pub(super) name: String,
    pub(super) content: Option<Form>,
    pub(super) meaning: String,
}

pub(super) enum Content {
    Struct(Vec<Line>),
    Enum(Vec<Variant>),
}

/// A named type.
pub(super) struct Type {
    pub(super) name: String,
    pub(super) page: Option<String>,
    pub(super) meaning: Option<String>,
    pub(super) inline: bool,
    pub(super) content: Content,
}

impl Type {
    /// Every field with its form; none of an enum.
    pub(super) fn fields(&self) -> Vec<(&str, &Form)> {
        let Content::Struct(lines) = &self.content else { return Vec::new() };
        lines.iter().flat_map(|line| line.names.iter().map(move |name| (name.as_str(), &line.form))).collect()
    }

    /// Its variants; none of a struct.
    pub(super) fn variants(&self) -> &[Variant] {
        match &self.content {
            Content::Enum(variants) => variants,
            Content::Struct(_) => &[],
        }
    }
}

/// The layout of every message.
pub(super) struct Layout {
    pub(super) limits: BTreeMap<String, usize>,
    pub(super) kinds: Vec<Kind>,
    pub(super) types: Vec<Type>,
    pub(super) flags: Vec<Flags>,
}

impl Layout {
    pub(super) fn load() -> Self {
        let written: Written = toml::from_str(FILE).unwrap_or_else(|error| panic!("layout.toml: {error}"));
        let names: Vec<_> = written.types.iter().map(|written| written.name.clone()).collect();
        let reader = Reader { names: &names, limits: &written.limits };
        let types = written.types.iter().map(|written| reader.read(written)).collect();
        Self { limits: written.limits, kinds: written.kind, types, flags: written.flags }
    }

    /// A type by its name.
    pub(super) fn named(&self, name: &str) -> usize {
        let found = self.types.iter().position(|named| named.name == name);
        found.unwrap_or_else(|| panic!("layout.toml: there is no type {name}"))
    }

    /// A kind by its number.
    pub(super) fn kind(&self, number: u8) -> &Kind {
        self.kinds.iter().find(|kind| kind.number == number).expect("a kind of the layout")
    }
}

/// Reads forms.
struct Reader<'a> {
    names: &'a [String],
    limits: &'a BTreeMap<String, usize>,
}

impl Reader<'_> {
    fn read(&self, written: &WrittenType) -> Type {
        let content = match (&written.fields, &written.variants) {
            (Some(fields), None) => Content::Struct(fields.iter().map(|field| self.line(field)).collect()),
            (None, Some(variants)) => {
                Content::Enum(variants.iter().map(|variant| self.variant(variant)).collect())
            }
            _ => panic!("layout.toml: {} must have fields or variants", written.name),
        };
        let WrittenType { name, page, meaning, inline, .. } = written;
        Type { name: name.clone(), page: page.clone(), meaning: meaning.clone(), inline: *inline, content }
    }

    fn line(&self, [names, form, meaning]: &[String; 3]) -> Line {
        let names = names.split(", ").map(str::to_owned).collect();
        Line { names, form: self.form(form), meaning: meaning.clone() }
    }

    fn variant(&self, [name, content, meaning]: &[String; 3]) -> Variant {
        let content = (!content.is_empty()).then(|| self.form(content));
        Variant { name: name.clone(), content, meaning: meaning.clone() }
    }

    fn limit(&self, text: &str) -> usize {
        text.parse()
            .ok()
            .or_else(|| self.limits.get(text).copied())
            .unwrap_or_else(|| panic!("layout.toml: no limit {text}"))
    }

    fn form(&self, text: &str) -> Form {
        let argument = |head: &str| text.strip_prefix(head)?.strip_suffix(')').map(|limit| self.limit(limit));
        if let Some(item) = text.strip_suffix('?') {
            return Form::Option(Box::new(self.form(item)));
        }
        if let Some((item, count)) = text.rsplit_once('*') {
            return Form::Array(Box::new(self.form(item)), self.limit(count));
        }
        if let Some((item, range)) =
            text.strip_prefix('[').and_then(|text| text.strip_suffix(']')?.rsplit_once("; "))
        {
            let (least, most) = range.split_once("..").unwrap_or(("0", range));
            let (least, most) = (self.limit(least), self.limit(most));
            return Form::List { item: Box::new(self.form(item)), least, most };
        }
        match text {
            "u8" => Form::Byte,
            "bool" => Form::Bool,
            "u16" => Form::Unsigned(16),
            "u32" => Form::Unsigned(32),
            "u64" => Form::Unsigned(64),
            "i32" => Form::Signed(32),
            "i64" => Form::Signed(64),
            "f64" => Form::F64,
            "string" => Form::Text(None),
            _ => argument("string(")
                .map(|most| Form::Text(Some(most)))
                .or_else(|| argument("digest(").map(Form::Digest))
                .unwrap_or_else(|| {
                    let named = self.names.iter().position(|name| name == text);
                    Form::Named(named.unwrap_or_else(|| panic!("layout.toml: there is no type {text}")))
                }),
        }
    }
}

//! A document as a tree of texts in the order in which it is written.

use std::collections::BTreeSet;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::super::Document;

/// Keys of a table in the order of the text.
pub(super) type Table = Vec<(String, Node)>;

/// What stands at a key.
#[derive(Debug, PartialEq)]
pub(super) enum Node {
    /// A number, text, date or truth, as TOML writes it.
    Leaf(String),
    /// An array.
    List(Vec<Node>),
    /// A table.
    Table(Table),
}

impl Node {
    /// The text of a leaf.
    pub(super) fn leaf(&self) -> Option<&str> {
        match self {
            Self::Leaf(text) => Some(text),
            Self::List(_) | Self::Table(_) => None,
        }
    }
}

/// The tree of a document; empty for one that TOML cannot state, which no reader has let through.
pub(super) fn of(document: &Document) -> Table {
    let text = document.to_toml().unwrap_or_default();
    DeTable::parse(&text).map(|root| table(&text, root.get_ref())).unwrap_or_default()
}

fn table(text: &str, entries: &DeTable<'_>) -> Table {
    let mut entries: Vec<_> = entries.iter().collect();
    // The parser keeps the keys sorted by name; a table's header is where its own keys are.
    entries.sort_by_key(|(key, _)| key.span().start);
    entries.into_iter().map(|(key, value)| (key.get_ref().to_string(), node(text, value))).collect()
}

fn node(text: &str, value: &Spanned<DeValue<'_>>) -> Node {
    match value.get_ref() {
        DeValue::Table(entries) => Node::Table(table(text, entries)),
        DeValue::Array(items) => Node::List(items.iter().map(|item| node(text, item)).collect()),
        _ => Node::Leaf(text.get(value.span()).unwrap_or_default().to_owned()),
    }
}

/// Names of a list's entries, where each is a table with a `name` that no other of them has.
pub(super) fn names(list: &[Node]) -> Option<Vec<&str>> {
    fn name(node: &Node) -> Option<&str> {
        let Node::Table(entries) = node else { return None };
        entries.iter().find(|(key, _)| key == "name")?.1.leaf()
    }
    let names: Vec<_> = list.iter().map(name).collect::<Option<_>>()?;
    let mut seen = BTreeSet::new();
    names.iter().all(|name| seen.insert(*name)).then_some(names)
}

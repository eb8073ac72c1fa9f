//! What differs between two documents: entry by entry, whatever their comments, order and layout.
//!
//! Both are written in the same form first, with their defaults filled in, so that only what they state is compared.

mod tree;
mod words;

use super::Document;
use crate::control::DocumentChange;
use tree::{Node, Table};

/// Tables whose entries say nothing about the correction: they come last.
const ABOUT: [&str; 3] = ["created", "note", "origin"];
/// Lists whose order is that of the raw readings.
const ORDERED: [&str; 2] = ["gyro.sensor", "accel.sensor"];

/// Every entry that differs, in the order of the document, what is only for readers last.
///
/// Entries of a list whose members all have names of their own (sensors, channels) are matched by name; a key's index
/// is that in `after`, or in `before` for what is gone. Where sensors have changed places, which decides over the raw
/// readings they take, one more entry says so.
#[must_use]
pub fn difference(before: &Document, after: &Document) -> Vec<DocumentChange> {
    let mut changes = Vec::new();
    tables("", &tree::of(before), &tree::of(after), &mut changes);
    let about = |change: &DocumentChange| {
        let rest = ABOUT.iter().find_map(|key| change.key.strip_prefix(key));
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
    };
    changes.sort_by_key(about);
    changes
}

/// Sections of `before` that `after` does not have: tables, and entries of lists of tables where there are fewer; curves, and what is
/// only for readers, left out. Each as its header stands in a document, such as `[accel]` or `[[gyro.sensor]] "z"`.
///
/// A document of which only the beginning was written may be a whole one by itself, for a unit of gyros only: what it lost is
/// the sign of it.
#[must_use]
pub fn lost_sections(before: &Document, after: &Document) -> Vec<String> {
    let mut lost = Vec::new();
    lost_tables("", &tree::of(before), &tree::of(after), &mut lost);
    lost
}

fn lost_tables(path: &str, before: &Table, after: &Table, lost: &mut Vec<String>) {
    for (key, node) in before {
        let path = isotherm_document::join(path, key);
        let other = after.iter().find(|(name, _)| name == key).map(|(_, node)| node);
        match (node, other) {
            (Node::Table(old), _) if ABOUT.contains(&&*path) || is_curve(old) => {}
            (Node::Table(old), Some(Node::Table(new))) => lost_tables(&path, old, new, lost),
            (Node::Table(_), _) => lost.push(format!("[{path}]")),
            (Node::List(old), Some(Node::List(new))) => lost_entries(&path, old, new, lost),
            (Node::List(old), _) => lost_entries(&path, old, &[], lost),
            (Node::Leaf(_), _) => {}
        }
    }
}

/// Sections of a list of tables that another one does not have: entries that are missing, and what is missing in the others.
fn lost_entries(path: &str, before: &[Node], after: &[Node], lost: &mut Vec<String>) {
    let names = tree::names(before).zip(tree::names(after));
    for (index, node) in before.iter().enumerate() {
        let Node::Table(old) = node else { continue };
        let name = names.as_ref().and_then(|(names, _)| names.get(index));
        let place = match (&names, name) {
            (Some((_, others)), Some(name)) => others.iter().position(|other| other == name),
            _ => Some(index),
        };
        match place.and_then(|place| after.get(place)) {
            Some(Node::Table(new)) => lost_tables(path, old, new, lost),
            // Where there are as many as before it has another name, no more.
            _ if after.len() >= before.len() => {}
            _ => lost.push(name.map_or_else(|| format!("[[{path}]]"), |name| format!("[[{path}]] {name}"))),
        }
    }
}

/// Whether a table states a curve, which is an entry and no section.
fn is_curve(table: &Table) -> bool {
    table.iter().any(|(key, _)| key == "kind")
}

/// Compares two tables: the keys of the later one in its order, then those that are gone.
fn tables(path: &str, before: &Table, after: &Table, changes: &mut Vec<DocumentChange>) {
    let path_of = |key: &str| isotherm_document::join(path, key);
    for (key, node) in after {
        let old = before.iter().find(|(name, _)| name == key).map(|(_, node)| node);
        nodes(&path_of(key), old, Some(node), changes);
    }
    for (key, node) in before.iter().filter(|(key, _)| after.iter().all(|(name, _)| name != key)) {
        nodes(&path_of(key), Some(node), None, changes);
    }
}

/// Compares what stands at one path; `None` where nothing does.
fn nodes(path: &str, before: Option<&Node>, after: Option<&Node>, changes: &mut Vec<DocumentChange>) {
    const EMPTY: &Table = &Table::new();
    match (before, after) {
        (Some(Node::Leaf(old)), Some(Node::Leaf(new))) if old == new => {}
        (None | Some(Node::Leaf(_)), None | Some(Node::Leaf(_))) => {
            let text = |node: Option<&Node>| node.and_then(Node::leaf).map(str::to_owned);
            changes.push(DocumentChange { key: path.to_owned(), before: text(before), after: text(after) });
        }
        (Some(Node::List(old)), Some(Node::List(new))) => lists(path, old, new, changes),
        (Some(Node::Table(old)), Some(Node::Table(new))) => tables(path, old, new, changes),
        // Of another kind: all of the one is gone, all of the other is new.
        (Some(_), Some(_)) => {
            nodes(path, before, None, changes);
            nodes(path, None, after, changes);
        }
        (Some(Node::Table(old)), None) => tables(path, old, EMPTY, changes),
        (None, Some(Node::Table(new))) => tables(path, EMPTY, new, changes),
        (Some(Node::List(old)), None) => lists(path, old, &[], changes),
        (None, Some(Node::List(new))) => lists(path, &[], new, changes),
    }
}

/// Compares two lists, by name where every entry has one of its own.
fn lists(path: &str, before: &[Node], after: &[Node], changes: &mut Vec<DocumentChange>) {
    let element = |index| isotherm_document::element(path, index);
    let (Some(old_names), Some(new_names)) = (tree::names(before), tree::names(after)) else {
        for index in 0..before.len().max(after.len()) {
            nodes(&element(index), before.get(index), after.get(index), changes);
        }
        return;
    };
    let kept = |names: &[&str], among: &[&str]| -> Vec<String> {
        names.iter().filter(|name| among.contains(name)).map(|name| (*name).to_owned()).collect()
    };
    let (old_order, new_order) = (kept(&old_names, &new_names), kept(&new_names, &old_names));
    if ORDERED.contains(&path) && old_order != new_order {
        let order = |names: &[&str]| Some(format!("[{}]", names.join(", ")));
        let (before, after) = (order(&old_names), order(&new_names));
        changes.push(DocumentChange { key: path.to_owned(), before, after });
    }
    for (index, (name, node)) in new_names.iter().zip(after).enumerate() {
        let old = old_names.iter().position(|old| old == name).and_then(|old| before.get(old));
        nodes(&element(index), old, Some(node), changes);
    }
    let gone = old_names.iter().zip(before).enumerate();
    for (index, (_, node)) in gone.filter(|(_, (name, _))| !new_names.contains(name)) {
        nodes(&element(index), Some(node), None, changes);
    }
}

#[cfg(test)]
mod tests;

//! What was done, in words and as JSON.

use std::collections::BTreeSet;

use serde_json::{Value as Json, json};

use super::Merged;
use crate::report::Sheet;

impl Merged {
    /// What was done, as text.
    #[must_use]
    pub fn sheet(&self, name: &str) -> Sheet {
        let documents: BTreeSet<&String> = self.taken.iter().map(|(_, from)| from).collect();
        let mut sheet = Sheet {
            title: format!("Merge of {name}"),
            headline: format!(
                "{name}: {} sections of {} documents, no conflict{}.",
                self.taken.len(),
                documents.len(),
                if self.gone.is_empty() { String::new() } else { format!(", {} left out", self.gone.len()) }
            ),
            ..Sheet::default()
        };
        sheet.notes = self.warnings.iter().map(|warning| format!("warning: {warning}")).collect();
        let row = |(key, from): &(String, String)| vec![key.clone(), from.clone()];
        sheet.table("Taken", &["section", "from"], self.taken.iter().map(row).collect());
        sheet.table(
            "Left out, because the part does without",
            &["section", "by"],
            self.gone.iter().map(row).collect(),
        );
        sheet
    }

    /// What was done, as JSON.
    #[must_use]
    pub fn to_json(&self, name: &str) -> Json {
        let map = |pairs: &[(String, String)]| -> serde_json::Map<String, Json> {
            pairs.iter().map(|(key, from)| (key.clone(), json!(from))).collect()
        };
        json!({
            "verdict": self.sheet(name).headline,
            "taken": map(&self.taken),
            "left_out": map(&self.gone),
            "warnings": self.warnings,
        })
    }
}

//! The report as JSON.

use isotherm_pages::Table;
use isotherm_protocol::document::Sample;
use serde_json::{Value, json};

use super::verdict::Verdict;
use super::{Curve, Report};
use crate::numbers::Size;

impl Report {
    /// Everything but the curves themselves, of which the sizes are there.
    pub fn to_json(&self) -> Value {
        let curve = |curve: &Curve| {
            json!({
                "of": curve.of,
                "measure": curve.measure,
                "run": curve.run,
                "sample": if curve.sample == Sample::In { "in" } else { "out" },
                "sizes": sizes(curve.sizes()),
            })
        };
        let further = |(heading, rows): &(String, Table)| (heading.clone(), of_table(rows));
        let mut value = json!({
            "title": self.title,
            "unit": self.unit,
            "verdict": self.headline(),
            "accepted": self.accepted(),
            "verdicts": self.verdicts.iter().map(Verdict::to_json).collect::<Vec<_>>(),
            "warnings": self.warnings,
            "notes": self.notes,
            "coefficients": self.coefficients,
            "validation": self.validation.as_ref().map(of_table),
            "residuals": self.residuals.iter().map(curve).collect::<Vec<_>>(),
            "tables": self.tables.iter().map(further).collect::<serde_json::Map<_, _>>(),
        });
        if let (Value::Object(all), Value::Object(besides)) = (&mut value, &self.figures) {
            all.extend(besides.clone());
        }
        value
    }
}

impl Verdict {
    /// As JSON.
    pub fn to_json(&self) -> Value {
        json!({
            "of": self.of,
            "measure": self.measure,
            "words": self.words(),
            "accepted": self.accepted,
            "reason": self.reason,
            "times_smaller": self.factor(),
            "in_sample": sizes(self.in_sample),
            "out_of_sample": self.out_of_sample.map(sizes),
        })
    }
}

fn sizes([before, after]: [Size; 2]) -> Value {
    json!({ "before": before, "after": after })
}

fn of_table(table: &Table) -> Value {
    json!({ "head": table.head, "rows": table.rows })
}

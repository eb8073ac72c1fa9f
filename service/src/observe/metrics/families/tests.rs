use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use isotherm_correction::unit::UnitSettings;
use isotherm_protocol::key::UnitId;
use isotherm_protocol::stream::UnitStream;

use super::*;
use crate::receive::fault::FaultKind;

impl Family {
    /// As it stands on the page.
    fn whole_name(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!("_{}", self.unit) };
        let total = if matches!(self.kind, Type::Counter) { "_total" } else { "" };
        format!("{}{unit}{total}", self.name)
    }

    /// An item of the list, with the labels that not every metric of a unit has.
    fn item(&self) -> String {
        let labels: Vec<_> = self.labels.iter().map(|label| format!("`{label}`")).collect();
        let labels = if labels.is_empty() { String::new() } else { format!(" ({})", labels.join(", ")) };
        format!("- `{}`{labels}: {}\n", self.whole_name(), self.help)
    }
}

fn docs(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs").join(name)
}

#[test]
fn the_page_of_the_metrics_has_every_one_and_no_other() {
    // Counters stand in `docs/wire.md`, in the same words.
    let list: String = service::FAMILIES.iter().chain(unit::FAMILIES).map(Family::item).collect();
    let file = docs("metrics.md");
    let page = std::fs::read_to_string(&file).unwrap();
    let (begin, end) = ("<!-- metrics -->\n", "<!-- end of metrics -->\n");
    let (before, rest) = page.split_once(begin).unwrap();
    let (present, behind) = rest.split_once(end).unwrap();
    if std::env::var_os("ISOTHERM_BLESS").is_some() {
        std::fs::write(&file, [before, begin, &list, end, behind].concat()).unwrap();
    } else {
        assert!(present == list, "docs/metrics.md is not what the code says: run with ISOTHERM_BLESS=1");
    }
}

#[test]
fn the_alert_rules_name_metrics_that_exist() {
    let file = docs("../config/prometheus-rules.yml");
    let rules = std::fs::read_to_string(&file).unwrap();
    let names: Vec<_> = all().map(Family::whole_name).collect();
    let told: BTreeSet<_> = rules
        .split(|c: char| !c.is_ascii_lowercase() && c != '_')
        .filter(|word| word.starts_with("isotherm_"))
        .map(|word| word.strip_suffix("_bucket").unwrap_or(word))
        .collect();
    assert!(told.len() > 5, "{told:?}");
    for name in told {
        assert!(names.iter().any(|known| known == name), "{name} is no metric");
    }
}

#[test]
fn every_name_is_there_once_and_well_formed() {
    let names: Vec<_> = all().map(Family::whole_name).collect();
    assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), names.len());
    for family in all() {
        let name = family.whole_name();
        assert!(
            name.starts_with("isotherm_") && name.chars().all(|c| c.is_ascii_lowercase() || c == '_'),
            "{name}"
        );
        assert!(
            !family.help.is_empty() && !family.help.contains(['\n', '\\']) && !family.help.ends_with('.'),
            "{name}"
        );
        assert!(!family.name.ends_with("_total"), "{name}");
    }
}

#[test]
fn every_counter_of_a_unit_has_its_metric_with_the_words_of_the_wire() {
    let stream = UnitStream::new(UnitId::new("U").unwrap(), UnitSettings::default());
    let names: Vec<_> = stream.counters().into_iter().map(|c| format!("isotherm_unit_{}", c.name)).collect();
    let metrics: Vec<_> = counters::FAMILIES.iter().map(|family| family.name).collect();
    assert_eq!(metrics, names);
    let wire = std::fs::read_to_string(docs("wire.md")).unwrap().to_lowercase();
    for family in counters::FAMILIES {
        let item =
            format!("- `{}`: {}\n", &family.name["isotherm_unit_".len()..], family.help.to_lowercase());
        assert!(wire.contains(&item), "docs/wire.md does not say {item}");
    }
    for kind in FaultKind::ALL {
        assert!(!names.contains(&format!("isotherm_unit_{}", kind.name())), "{} is a fault", kind.name());
    }
}

//! What is generated from the types and committed: the schemas and the lists of keys.

use std::collections::BTreeSet;
use std::path::PathBuf;

use super::super::schema;
use super::reference::{curve_forms, keys_of, regions};
use crate::overlay::overlay_schema;

/// A committed file.
fn path(path: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "..", path].iter().collect()
}

/// Compares a committed file with what the types give; `ISOTHERM_BLESS=1` writes it anew.
#[track_caller]
fn compare(file: &str, expected: &str) {
    let path = path(file);
    if std::env::var_os("ISOTHERM_BLESS").is_some() {
        std::fs::write(&path, expected).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == expected,
        "{} is not what the types give: run the tests with ISOTHERM_BLESS=1",
        path.display()
    );
}

#[test]
fn the_schema_is_that_of_the_types() {
    compare("config/calibration.schema.json", &(serde_json::to_string_pretty(&schema()).unwrap() + "\n"));
}

#[test]
fn the_schema_of_the_overlay_is_that_of_the_types() {
    let schema = serde_json::to_string_pretty(&overlay_schema()).unwrap();
    compare("config/overlay.schema.json", &(schema + "\n"));
}

#[test]
fn the_lists_of_keys_are_those_of_the_types() {
    const PAGE: &str = "docs/calibration-document.md";
    let mut page = std::fs::read_to_string(path(PAGE)).unwrap();
    for (region, text) in regions() {
        let (begin, end) = (format!("<!-- {region} -->\n"), format!("<!-- end of {region} -->\n"));
        let (before, rest) = page.split_once(&begin).expect("the region begins");
        let (_, after) = rest.split_once(&end).expect("the region ends");
        page = [before, &begin, &text, "\n", &end, after].concat();
    }
    compare(PAGE, &page);
}

/// The page states the keys of curves in general; these are all that there are.
#[test]
fn the_keys_of_every_curve_have_the_form_that_the_page_states() {
    let schema = schema();
    let forms = curve_forms(&schema);
    let suffixes = |stem: &str| -> BTreeSet<String> {
        let keys = forms.iter().copied().flat_map(keys_of).filter_map(|(key, _)| key.strip_prefix(stem));
        keys.map(str::to_owned).collect()
    };
    let (units, arguments) = (suffixes("value_"), suffixes("reference_"));
    assert_eq!(
        arguments.iter().map(String::as_str).collect::<Vec<_>>(),
        ["deg_c", "deg_c_per_s", "deg_c_per_s2", "deg_per_s"]
    );
    for form in forms {
        let keys: Vec<_> = keys_of(form).map(|(key, _)| key).collect();
        let [_, keys @ ..] = keys.as_slice() else { panic!("a form without a kind") };
        let stated = units.iter().any(|u| {
            keys == [format!("value_{u}")]
                || keys == [format!("knots_{u}")]
                || arguments.iter().any(|a| {
                    keys == [format!("reference_{a}"), format!("coefficients_{u}"), format!("range_{a}")]
                        || keys == [format!("knots_{u}_over_{a}")]
                })
        });
        assert!(stated, "{keys:?}");
    }
}

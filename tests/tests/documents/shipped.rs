//! Every shipped document.

use isotherm_protocol::document::Document;
use isotherm_simulator::presets::{
    fibre_optic_chamber, mems_chamber, training_profile, zeeman_rest, zeeman_sine,
};
use isotherm_tests::data::root;

use crate::parsed;

#[test]
fn every_shipped_document_is_valid_without_a_doubt() {
    let mut units = Vec::new();
    for entry in std::fs::read_dir(root().join("config/calibration")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let parsed = parsed(&name);
        let warnings: Vec<_> = parsed.warnings.iter().map(ToString::to_string).collect();
        assert!(warnings.is_empty(), "{}", warnings.join("\n"));
        units.push(parsed.document.unit);
    }
    units.sort();
    let count = units.len();
    units.dedup();
    assert_eq!(units.len(), count, "one document per unit: {units:?}");
    for unit in ["CHAMBER-MEMS", "FOG-0001", "MEMS-0001", "RLG-STATIC", "ZLG-0001"] {
        assert!(units.iter().any(|name| name == unit), "{unit}");
    }
}

#[test]
fn the_simulated_units_have_the_serials_of_their_presets() {
    let presets =
        [zeeman_rest(1), zeeman_sine(1), fibre_optic_chamber(1, training_profile()), mems_chamber(1)];
    for scenario in presets {
        let document: Document = parsed(&format!("{}.toml", scenario.unit)).document;
        assert_eq!(document.unit, scenario.unit);
    }
}

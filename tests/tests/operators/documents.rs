//! Documents of a simulated laser unit: valid ones that differ, and invalid ones.

use isotherm_tests::dice::Dice;

/// The document of the simulated unit.
pub(crate) const BASE: &str = include_str!("../../../config/calibration/ZLG-0001.toml");
/// Its serial.
pub(crate) const BASE_UNIT: &str = "ZLG-0001";

/// The numbers that change from document to document: what stands before each, the number, how far it goes.
const NUMBERS: [(&str, &str, f64); 9] = [
    ("coefficients_deg_per_h = [", "0.41", 0.2),
    ("coefficients_deg_per_h = [", "-0.28", 0.2),
    ("coefficients_deg_per_h = [", "0.15", 0.2),
    ("coefficients_deg_per_h = [", "2.3", 0.3),
    ("coefficients_deg_per_h = [", "-1.7", 0.3),
    ("coefficients_deg_per_h = [", "3.1", 0.3),
    ("increment_weight_arcsec_per_count = ", "1.97", 1e-4),
    ("coefficients_counts_per_s = [", "1551.95139575", 5.0),
    ("coefficients_counts_per_s_per_m_per_s2 = [", "51700.0", 20.0),
];

/// What changes beside numbers, now and then: something of the memory of a unit hangs on each.
const FORMS: [(&str, &str); 5] = [
    ("smoothing_s = 3.0", "smoothing_s = 5.0"),
    ("derivative_step_s = 1.0", "derivative_step_s = 2.0"),
    ("time_constant_s = 0.04", "time_constant_s = 0.05"),
    ("fit_degree = 2", "fit_degree = 1"),
    ("channel = \"gyro1\"", "channel = \"gyro0\""),
];

/// What makes a document invalid.
const FAULTS: [(&str, &str); 8] = [
    ("increment_weight_arcsec_per_count = 1.97", "increment_weight_arcsec_per_count = nan"),
    ("smoothing_s", "smoothign_s"),
    ("grid_step_s = 1.0", "grid_step_s = 1.0\ngrid_step_s = 2.0"),
    ("rows = [[0.99999997475", "rows = [[0.9"),
    ("schema = 1", "schema = 9"),
    ("range_deg_c = [-70.0, 130.0]", "range_deg_c = [130.0, -70.0]"),
    ("channel = \"gyro2\"", "channel = \"gyro9\""),
    ("predict_degree = 1", "predict_degree = \"one\""),
];

/// The document for another serial.
pub(crate) fn base(unit: &str) -> String {
    BASE.replace(&format!("unit = \"{BASE_UNIT}\""), &format!("unit = \"{unit}\""))
}

/// A valid document for a unit, other than every one before.
pub(crate) fn valid(unit: &str, dice: &mut Dice) -> String {
    let mut text = base(unit);
    for (before, number, spread) in NUMBERS {
        let value: f64 = number.parse().unwrap();
        let from = format!("{before}{number}");
        assert!(text.contains(&from), "{from:?} is not in the document");
        let value = value + spread * dice.between_minus_one_and_one();
        text = text.replacen(&from, &format!("{before}{value:?}"), 1);
    }
    if dice.below(8) == 0 {
        let (from, to) = dice.one_of(&FORMS);
        assert!(text.contains(from), "{from:?} is not in the document");
        text = text.replace(from, to);
    }
    text
}

/// An invalid document for a unit, other than every one before; it may be no text at all.
pub(crate) fn invalid(unit: &str, dice: &mut Dice) -> Vec<u8> {
    let text = base(unit);
    let mut bytes = format!("# {:x}\n", dice.number()).into_bytes();
    match dice.below(12) {
        0 => {}
        1 => bytes.extend([0xff, 0xfe, b'a', 0]),
        // Without an orientation of the gyros, wherever it ends before that.
        2 | 3 => {
            let end = text.find("[gyro.orientation]").unwrap();
            let cut = usize::try_from(dice.below(end as u64)).unwrap();
            bytes.extend(&text.as_bytes()[..cut]);
        }
        _ => {
            let (from, to) = dice.one_of(&FAULTS);
            assert!(text.contains(from), "{from:?} is not in the document");
            bytes.extend(text.replacen(from, to, 1).into_bytes());
        }
    }
    bytes
}

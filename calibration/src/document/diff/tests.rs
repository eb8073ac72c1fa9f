use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{Curve, Document, Shape, StatedTerm, Trend};

use super::*;

const ARCSEC: f64 = std::f64::consts::PI / 180.0 / 3600.0;

fn written(change: impl FnOnce(&mut Document)) -> Written {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/MEMS-0001.toml");
    let mut document = Written::read(path.as_ref()).unwrap().document;
    change(&mut document);
    Written::of(&document).unwrap()
}

/// States standard errors of the axes of accelerometer x.
fn sigma(document: &mut Document, arcsec: f64) {
    let mut details = Table::new();
    let mut sigmas = Sigmas::default();
    sigmas.put(("accel", "x", "axis_arcsec"), vec![0.0, arcsec, arcsec]);
    sigmas.write(&mut details);
    document.origin.get_or_insert_default().details = Some(details);
}

fn turn(document: &mut Document, arcsec: f64) {
    let row = &mut document.accel.as_mut().unwrap().orientation.rows[0];
    row[1] += arcsec * ARCSEC;
}

#[test]
fn an_axis_that_was_knocked_is_told_beside_its_uncertainty() {
    let before = written(|document| sigma(document, 3.0));
    let told = [30.0, -6.0].map(|by: f64| {
        let after = written(|document| {
            sigma(document, 4.0);
            turn(document, by);
        });
        let changes = changes([&before, &after], None).unwrap();
        let axis = changes.axes.iter().find(|axis| axis.of == "accelerometer x").unwrap();
        assert!((axis.change_arcsec[1] - by).abs() < 0.05, "{axis:?}");
        assert!((axis.turned_arcsec - by.abs()).abs() < 0.05, "{axis:?}");
        assert!((axis.sigma_arcsec[1] - 5.0).abs() < 1e-9);
        assert!((axis.turned_sigma_arcsec.unwrap() - 5.0).abs() < 0.05);
        assert!((axis.significance.unwrap() - by.abs() / 5.0).abs() < 0.05);
        assert_eq!(changes.turned().len(), usize::from(by > 0.0));
        changes.sheet().whole_text()
    });
    insta::assert_snapshot!(told.join("\n"));
}

#[test]
fn without_stated_errors_those_of_the_stand_hold() {
    let (before, after) = (written(|_| ()), written(|document| turn(document, 60.0)));
    let unknown = changes([&before, &after], None).unwrap();
    insta::assert_snapshot!(unknown.sheet().headline());
    assert_eq!(unknown.axes[3].significance, None);
    let stand = changes([&before, &after], Some(12.0)).unwrap();
    assert!((stand.axes[3].significance.unwrap() - 60.0 / (12.0 * 2.0_f64.sqrt())).abs() < 0.01);
}

#[test]
fn biases_and_scale_factors_change_over_temperature() {
    let before = written(|document| {
        document.gyro.sensor[1].set(Feature::One, Curve::new(Shape::Constant { value: 1.0 }));
    });
    let after = written(|document| {
        let (reference, range) = (document.temperature.assumed_deg_c, [-20.0, 60.0]);
        let shape = Shape::Polynomial { reference, coefficients: vec![3.0, 0.1], range };
        document.gyro.sensor[1].set(Feature::One, Curve::new(shape));
        let scale = &mut document.accel.as_mut().unwrap().sensor[2].scale_factor;
        let per_million = match scale.shape() {
            Shape::Constant { value } => value * 1e-4,
            Shape::Polynomial { coefficients, .. } => coefficients[0] * 1e-4,
            _ => unreachable!(),
        };
        *scale = scale.plus(per_million);
    });
    let changes = changes([&before, &after], None).unwrap();
    let of = |name: &str| changes.values.iter().find(|value| value.of == name).unwrap();
    let bias = of("gyro y bias");
    let away = changes.reference_deg_c - after.document.temperature.assumed_deg_c;
    assert!((bias.at_reference - 2.0 - 0.1 * away).abs() < 1e-9, "{bias:?}");
    let span = bias.change[POINTS - 1] - bias.change[0];
    let range = changes.temperature_deg_c[POINTS - 1] - changes.temperature_deg_c[0];
    assert!((span - 0.1 * range.min(80.0)).abs() < 1e-6, "{span} {range}");
    assert!((of("accelerometer z scale factor").at_reference - 100.0).abs() < 0.1);
    assert!(changes.values.iter().all(|value| value.of != "gyro x bias"), "{:?}", changes.values);
    assert!(changes.entries.iter().any(|entry| entry.key.starts_with("gyro.sensor[1].static_bias")));
    assert!(changes.sheet().to_html().contains(&bias.of));
}

#[test]
fn terms_that_no_number_shows_are_named() {
    let constant = |value: f64| Curve::new(Shape::Constant { value });
    let after = written(|document| {
        let gyro = &mut document.gyro.sensor[1];
        gyro.put(StatedTerm::new(Feature::ForceZ, constant(2.0)));
        gyro.trend = Some(Trend { coefficients_deg_per_h: vec![0.0, 0.1], interval_h: [0.0, 10.0] });
        for accel in &mut document.accel.as_mut().unwrap().sensor {
            accel.put(StatedTerm::new(Feature::ThermalRate, constant(0.5)));
        }
    });
    insta::assert_snapshot!(changes([&written(|_| ()), &after], None).unwrap().in_brief());
}

#[test]
fn equal_documents_are_told_as_such() {
    let one = written(|_| ());
    let changes = changes([&one, &one], None).unwrap();
    insta::assert_snapshot!(changes.sheet().headline());
    assert!(changes.values.is_empty() && changes.axes.iter().all(|axis| axis.turned_arcsec == 0.0));
}

#[test]
fn standard_errors_grow_away_from_the_temperature_that_a_curve_is_given_about() {
    let about = |reference: f64| {
        written(|document| {
            let range = [-20.0, 60.0];
            let bias = Shape::Polynomial { reference, coefficients: vec![reference, 0.1], range };
            let accel = document.accel.as_mut().unwrap();
            accel.orientation.thermal = Some(OrientationThermal {
                channels: vec![document.temperature.channel[0].name.clone()],
                reference_deg_c: reference,
                range_deg_c: range,
                slopes_arcsec_per_deg_c: vec![[0.0, 1.0, 0.0]; accel.sensor.len()],
                hysteresis: Vec::new(),
            });
            document.gyro.sensor[0].set(Feature::One, Curve::new(bias));
            let (mut details, mut sigmas) = (Table::new(), Sigmas::default());
            sigmas.put(("accel", "x", "axis_arcsec"), vec![0.0, 3.0, 4.0]);
            sigmas.put(("gyro", "x", "static_bias"), vec![0.6, 0.01]);
            sigmas.write(&mut details);
            document.origin.get_or_insert_default().details = Some(details);
        })
    };
    let sigmas = |before: f64| {
        let changes = changes([&about(before), &about(20.0)], None).unwrap();
        assert!((changes.reference_deg_c - 20.0).abs() < 1e-12);
        let bias = changes.values.iter().find(|value| value.of == "gyro x bias");
        let axis = changes.axes.iter().find(|axis| axis.of == "accelerometer x").unwrap();
        (bias.map(|bias| bias.sigma.unwrap()), axis.sigma_arcsec)
    };
    // Eighty degrees further a slope known to 0.01 °/h per °C adds 0.8 °/h; of the axes' slopes no error is known.
    let (bias, axis) = sigmas(-60.0);
    assert!((bias.unwrap() - 1.36_f64.sqrt()).abs() < 1e-9, "{bias:?}");
    assert!(axis.iter().all(|sigma| sigma.abs() < 1e-12), "{axis:?}");
    let (_, axis) = sigmas(20.0);
    assert!((axis[1] - 18.0_f64.sqrt()).abs() < 1e-9, "{axis:?}");
}

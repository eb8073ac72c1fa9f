use isotherm_correction::thermal::Feature;
use isotherm_protocol::document::{Curve, GyroOutput, Shape, StatedTerm};

use super::*;
use crate::document::reweigh;
use crate::report::Sigmas;

fn named(name: &str, change: impl FnOnce(&mut Document)) -> Written {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../config/calibration/MEMS-0001.toml");
    let mut document = Written::read(path.as_ref()).unwrap().document;
    for gyro in &mut document.gyro.sensor {
        let thermal = [Feature::ThermalRate, Feature::ThermalAcceleration, Feature::Lag];
        gyro.terms.retain(|feature| !thermal.contains(&feature));
    }
    change(&mut document);
    Written { name: name.into(), ..Written::of(&document).unwrap() }
}

fn constant(value: f64) -> Curve {
    Curve::new(Shape::Constant { value })
}

fn bias(value: f64) -> impl FnOnce(&mut Document) {
    move |document| document.gyro.sensor[0].set(Feature::One, constant(value))
}

/// The same with a drift with acceleration.
fn drifts(value: f64) -> impl FnOnce(&mut Document) {
    move |document| {
        bias(value)(document);
        document.gyro.sensor[0].set(Feature::ForceX, constant(0.1 * value));
    }
}

fn from<'a>(merged: &'a Merged, key: &str) -> &'a str {
    merged.taken.iter().find(|(taken, _)| taken == key).map_or("", |(_, from)| from)
}

#[test]
fn what_the_readings_stand_for_is_told_in_words_of_documents() {
    let mut counts = named("counts.toml", |_| ());
    counts.document.gyro.output = GyroOutput::Counts;
    insta::assert_snapshot!(same_unit(&named("base.toml", |_| ()), &[counts]).unwrap_err());
}

#[test]
fn parts_made_from_one_base_go_together() {
    let base = named("base.toml", |_| ());
    let thermal = named("thermal.toml", |document| {
        bias(7.0)(document);
        document.origin.get_or_insert_default().method = Some("joint".into());
    });
    let positions = named("positions.toml", |document| {
        document.accel.as_mut().unwrap().orientation.rows[0] = [1.0, 1e-5, 0.0];
        let mut details = toml::Table::new();
        let mut sigmas = Sigmas::default();
        sigmas.put(("accel", "x", "axis_arcsec"), vec![0.0, 4.0, 4.0]);
        sigmas.put(("gyro", "x", "static_bias"), vec![9.0]);
        document.gyro.sensor[1].set(Feature::ForceX, constant(3.0));
        sigmas.put(("gyro", "y", "acceleration_sensitive_drift.x"), vec![0.1]);
        sigmas.write(&mut details);
        document.origin.get_or_insert_default().details = Some(details);
    });
    let merged = merge(&base, &[thermal.clone(), positions.clone()], &[]).unwrap();
    let document = &merged.written.document;
    assert_eq!(
        document.gyro.sensor[0].terms.curve(Feature::One),
        thermal.document.gyro.sensor[0].terms.curve(Feature::One)
    );
    assert_eq!(
        document.accel.as_ref().unwrap().orientation,
        positions.document.accel.as_ref().unwrap().orientation
    );
    assert_eq!(from(&merged, "gyro.sensor.x.static_bias"), "thermal.toml");
    assert_eq!(from(&merged, "accel.orientation.rows"), "positions.toml");
    assert_eq!(from(&merged, "gyro.sensor.y.static_bias"), "base.toml");
    let origin = document.origin.as_ref().unwrap();
    let parts = origin.details.as_ref().unwrap()["parts"].as_table().unwrap();
    assert_eq!(parts["thermal.toml"]["method"].as_str(), Some("joint"));
    let created = &parts["thermal.toml"]["created"];
    assert!(created.is_datetime() && created.to_string() == thermal.document.created.unwrap().to_string());
    assert_eq!(parts.len(), 3);
    // Standard errors follow what was taken, and nothing else.
    let sigmas = Sigmas::of(document);
    assert_eq!(sigmas.get("accel", "x", "axis_arcsec"), Some([0.0, 4.0, 4.0].as_slice()));
    assert_eq!(sigmas.get("gyro", "x", "static_bias"), None);
    assert_eq!(sigmas.get("gyro", "y", "acceleration_sensitive_drift.x"), Some([0.1].as_slice()));
    // All of the base that nobody touched is there as it was.
    let mut back = document.clone();
    back.origin.clone_from(&base.document.origin);
    bias(7.0)(&mut back);
    let mut expected = base.document.clone();
    bias(7.0)(&mut expected);
    expected.accel.as_mut().unwrap().orientation.rows[0] = [1.0, 1e-5, 0.0];
    expected.gyro.sensor[1].set(Feature::ForceX, constant(3.0));
    assert_eq!(back, expected);
}

#[test]
fn the_same_key_made_twice_is_a_conflict_until_someone_decides() {
    let base = named("base.toml", |_| ());
    let parts = [named("a.toml", bias(7.0)), named("b.toml", bias(8.0))];
    let Err(Error::Refused(conflicts)) = merge(&base, &parts, &[]) else { panic!("a conflict") };
    let turned = |document: &mut Document| document.gyro.orientation.rows[0] = [1.0, 1e-5, 0.0];
    let back = |document: &mut Document| document.gyro.orientation.rows[0] = [1.0, -1e-5, 0.0];
    let axes = [named("a.toml", turned), named("b.toml", back)];
    let Err(Error::Refused(of_axes)) = merge(&base, &axes, &[]) else { panic!("a conflict") };
    insta::assert_snapshot!([conflicts, of_axes].concat().join("\n"));
    let take = |from: &str| Take { key: "gyro.sensor.x".into(), from: from.into() };
    let merged = merge(&base, &parts, &[take("b.toml")]).unwrap();
    assert_eq!(from(&merged, "gyro.sensor.x.static_bias"), "b.toml");
    let merged = merge(&base, &parts, &[take("base.toml")]).unwrap();
    assert_eq!(merged.written.document.gyro, base.document.gyro);
    assert!(matches!(merge(&base, &parts, &[take("c.toml")]), Err(Error::Usage(_))));
    // Of what the chosen part has not changed it says what the base says.
    let heavier = |document: &mut Document| document.gyro.sensor[0].increment_weight_rad_per_rad = Some(1.1);
    let parts = [named("a.toml", bias(7.0)), named("b.toml", heavier)];
    let merged = merge(&base, &parts, &[take("a.toml")]).unwrap();
    assert_eq!(merged.written.document.gyro, parts[0].document.gyro);
    // What both made alike is no conflict.
    let alike = [named("a.toml", bias(7.0)), named("b.toml", bias(7.0))];
    assert!(merge(&base, &alike, &[]).is_ok());
}

#[test]
fn a_term_that_takes_the_place_of_another_takes_it_away_and_a_missing_one_is_kept() {
    let rate = |document: &mut Document| {
        let branches = [constant(3.0), constant(2.0)];
        document.gyro.sensor[0].put(StatedTerm::branched(Feature::ThermalRate, branches));
        if let Some(filter) = &mut document.temperature.filter {
            filter.branch_dead_band_deg_c2_per_s3 = Some(1e-8);
        }
    };
    let base = named("base.toml", rate);
    let lags = named("lag.toml", |document| {
        if let Some(filter) = &mut document.temperature.filter {
            filter.branch_dead_band_deg_c2_per_s3 = Some(1e-8);
        }
        document.gyro.sensor[0].put(StatedTerm::with_parameter(Feature::Lag, 300.0, constant(5.0)));
    });
    let merged = merge(&base, std::slice::from_ref(&lags), &[]).unwrap();
    assert_eq!(merged.gone, [("gyro.sensor.x.thermal_rate".to_owned(), "lag.toml".to_owned())]);
    assert!(!merged.written.document.gyro.sensor[0].terms.has(Feature::ThermalRate));
    let without = named("positions.toml", |document| {
        rate(document);
        document.gyro.sensor[0].terms.remove(Feature::ThermalRate);
    });
    let merged = merge(&base, &[without], &[]).unwrap();
    assert!(merged.written.document.gyro.sensor[0].terms.has(Feature::ThermalRate));
    insta::assert_snapshot!(merged.sheet("new.toml").whole_text());
}

#[test]
fn what_does_not_go_together_is_refused_by_key() {
    let base = named("base.toml", |document| {
        document.gyro.sensor[1].put(StatedTerm::with_parameter(Feature::Lag, 300.0, constant(5.0)));
    });
    let other = named("other.toml", |document| {
        document.unit = "MEMS-0002".into();
        document.gyro.sensor[2].name = "w".into();
    });
    let filter = named("filter.toml", |document| {
        document.gyro.sensor[1].put(StatedTerm::with_parameter(Feature::Lag, 300.0, constant(5.0)));
        document.temperature.filter.as_mut().unwrap().smoothing_s += 1.0;
        bias(7.0)(document);
    });
    let reasons = [other, filter].map(|part| {
        let Err(Error::Refused(reasons)) = merge(&base, &[part], &[]) else { panic!("refused") };
        reasons.join("\n")
    });
    insta::assert_snapshot!(reasons.join("\n\n"));
}

#[test]
fn a_part_made_from_its_log_alone_gives_what_it_found_and_nothing_else() {
    let base = named("base.toml", |document| {
        document.temperature.assumed_deg_c = 21.0;
        document.gyro.orientation.thermal = None;
        document.gyro.sensor[1].put(StatedTerm::with_parameter(Feature::Lag, 300.0, constant(5.0)));
    });
    let part = named("part.toml", |document| {
        let Document { unit, gyro, accel, temperature, .. } = &document;
        let mut filter = temperature.filter.clone();
        filter.as_mut().unwrap().smoothing_s += 1.0;
        let temperature = Temperature { assumed_deg_c: ASSUMED_DEG_C, filter, ..temperature.clone() };
        let output = accel.as_ref().map(|accel| accel.output);
        *document = plain(unit, gyro.output, temperature, output);
        document.gyro.orientation.rows[0] = [1.0, 1e-5, 0.0];
        let details = toml::Table::from_iter([(BASE.to_owned(), "".into())]);
        document.origin.get_or_insert_default().details = Some(details);
    });
    let merged = merge(&base, &[part], &[]).unwrap();
    let taken = merged.taken.iter().filter(|(_, from)| from == "part.toml").map(|(key, _)| key.as_str());
    assert_eq!(taken.collect::<Vec<_>>(), ["gyro.orientation.rows"]);
}

#[test]
fn what_a_parts_own_base_never_had_is_a_conflict() {
    let base = named("base.toml", |document| {
        document.gyro.sensor[0].put(StatedTerm::with_parameter(Feature::Lag, 300.0, constant(5.0)));
    });
    let part = |made_from: &str| {
        named("part.toml", |document| {
            bias(7.0)(document);
            let details = toml::Table::from_iter([(BASE.to_owned(), made_from.into())]);
            document.origin.get_or_insert_default().details = Some(details);
        })
    };
    let gone = [("gyro.sensor.x.lag".to_owned(), "part.toml".to_owned())];
    assert_eq!(merge(&base, &[part(&digest_of(&base))], &[]).unwrap().gone, gone);
    let mut told = Vec::new();
    for other in ["0123456789abcdef", ""] {
        let Err(Error::Refused(conflicts)) = merge(&base, &[part(other)], &[]) else { panic!("a conflict") };
        told.extend(conflicts);
        let take = |from: &str| [Take { key: "gyro.sensor.x.lag".into(), from: from.into() }];
        assert!(merge(&base, &[part(other)], &take("base.toml")).unwrap().gone.is_empty());
        assert_eq!(merge(&base, &[part(other)], &take("part.toml")).unwrap().gone, gone);
    }
    insta::assert_snapshot!(told.join("\n"));
}

#[test]
fn a_part_of_a_document_that_is_not_given_takes_nothing_back_without_a_word() {
    let of = |name: &str, value: f64, digest: &str| {
        named(name, |document| {
            bias(value)(document);
            let details = toml::Table::from_iter([(BASE.to_owned(), digest.into())]);
            document.origin.get_or_insert_default().details = Some(details);
        })
    };
    let [rates, positions] =
        [of("rates.toml", 7.0, "0123456789abcdef"), of("positions.toml", 8.0, "0123456789abcdef")];
    let Err(Error::Refused(told)) = merge(&rates, std::slice::from_ref(&positions), &[]) else {
        panic!("a conflict")
    };
    let later = of("later.toml", 9.0, "00000000000000ff");
    let warned = merge(&rates, &[later], &[]).unwrap().warnings;
    insta::assert_snapshot!([told, warned].concat().join("\n"));
    let take = [Take { key: "gyro.sensor.x".into(), from: "rates.toml".into() }];
    assert!(merge(&rates, &[positions], &take).is_ok());
}

#[test]
fn a_bias_goes_with_the_weight_that_is_taken() {
    let base = named("base.toml", drifts(100.0));
    let weight = base.document.gyro.sensor[0].increment_weight_rad_per_rad.unwrap();
    let heavier = |document: &mut Document| {
        drifts(100.0)(document);
        reweigh(&mut document.gyro.sensor[0], 1.01 * weight);
    };
    let before = |document: &mut Document| {
        heavier(document);
        drifts(100.0)(document);
    };
    let thermal = named("thermal.toml", drifts(200.0));
    let of_thermal = |document: &mut Document| {
        drifts(200.0)(document);
        reweigh(&mut document.gyro.sensor[0], 1.01 * weight);
    };
    for (rates, others, wanted) in [
        (named("rates.toml", heavier), Some(&thermal), 202.0),
        (named("rates.toml", of_thermal), Some(&thermal), 202.0),
        (named("rates.toml", heavier), None, 101.0),
        // A part that took the bias as it was.
        (named("rates.toml", before), None, 101.0),
    ] {
        let parts: Vec<Written> = others.into_iter().cloned().chain([rates]).collect();
        let merged = merge(&base, &parts, &[]).unwrap();
        let gyro = &merged.written.document.gyro.sensor[0];
        let value = gyro.terms.curve(Feature::One).unwrap().shape().at(20.0).unwrap();
        let by_force = gyro.terms.curve(Feature::ForceX).unwrap().shape().at(20.0).unwrap();
        assert!((value / wanted - 1.0).abs() < 1e-9 && (by_force / value - 0.1).abs() < 1e-9, "{value}");
        assert_eq!((merged.notes.len(), merged.warnings.len()), (1, 0), "{:?}", merged.notes);
    }
}

#[test]
fn a_choice_of_a_key_that_nobody_has_is_refused_with_those_that_are_there() {
    let base = named("base.toml", |_| ());
    let part = named("a.toml", bias(7.0));
    let told = ["accel.orientation.rowz", "gyro.sensor.x.static_bais", "giro"].map(|key| {
        let take = Take { key: key.into(), from: "base.toml".into() };
        merge(&base, std::slice::from_ref(&part), &[take]).unwrap_err().to_string()
    });
    insta::assert_snapshot!(told.join("\n"));
}

#[test]
fn accelerometers_that_the_base_has_not_keep_their_order() {
    let base = named("base.toml", |document| document.accel = None);
    let part = named("part.toml", |document| {
        let sensors = document.accel.iter_mut().flat_map(|accel| &mut accel.sensor);
        sensors.zip(["c", "b", "a"]).for_each(|(sensor, name)| sensor.name = name.into());
    });
    let merged = merge(&base, std::slice::from_ref(&part), &[]).unwrap();
    assert_eq!(merged.written.document.accel, part.document.accel);
}

#[test]
fn the_terms_of_a_sensor_with_a_dot_in_its_name_go_together() {
    for (key, of) in [
        ("gyro.sensor.g.x.lag", "gyro.sensor.g.x bias"),
        ("gyro.sensor.g.x.increment_weight_over_rate", "gyro.sensor.g.x weight"),
        ("accel.sensor.1.5g.scale_factor", "accel.sensor.1.5g output"),
        ("accel.orientation.rows", "accel.orientation axes"),
        ("gyro.sensor.g.x.channel", "gyro.sensor.g.x.channel"),
    ] {
        assert_eq!(group(key), of);
    }
}

#[test]
fn an_output_of_two_fits_is_warned_of_and_a_weight_has_the_error_of_its_document() {
    let weighed = |weight: f64, ppm: f64| {
        move |document: &mut Document| {
            let gyro = &mut document.gyro.sensor[0];
            gyro.increment_weight_rad_per_rad = Some(weight);
            gyro.increment_weight_over_rate = None;
            gyro.set(Feature::RateMagnitude, constant(30.0));
            let (mut details, mut sigmas) = (toml::Table::new(), Sigmas::default());
            sigmas.put(("gyro", "x", "increment_weight_ppm"), vec![ppm]);
            sigmas.write(&mut details);
            document.origin.get_or_insert_default().details = Some(details);
        }
    };
    let base = named("base.toml", weighed(1.0, 5.0));
    let merged = merge(&base, &[named("rates.toml", weighed(1.0016, 50.0))], &[]).unwrap();
    let sigmas = Sigmas::of(&merged.written.document);
    assert_eq!(sigmas.get("gyro", "x", "increment_weight_ppm"), Some([50.0].as_slice()));

    let accel = |change: fn(&mut AccelSensor)| {
        move |document: &mut Document| change(&mut document.accel.as_mut().unwrap().sensor[0])
    };
    let plain = named("base.toml", |_| ());
    let positions =
        named("positions.toml", accel(|sensor| sensor.scale_factor = sensor.scale_factor.plus(1e-3)));
    let thermal = named("thermal.toml", accel(|sensor| sensor.set(Feature::One, constant(0.02))));
    let warnings = merge(&plain, &[positions, thermal], &[]).unwrap().warnings;
    insta::assert_snapshot!(warnings.join("\n"));
}

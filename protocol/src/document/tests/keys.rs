//! The keys, limits and forms of curves that the schema states are those that are read.

use serde_json::Value as Json;
use toml::Value;

use super::super::{Document, schema};
use super::units::unit_of_key;
use super::{FULL, OTHER, accept, refuse};

/// A key of the schema.
struct Key {
    /// Path without indices.
    path: String,
    property: Json,
    required: bool,
}

/// The definition behind a reference.
fn resolve<'s>(root: &'s Json, node: &'s Json) -> &'s Json {
    let only = node.get("allOf").and_then(|all| all.get(0)).unwrap_or(node);
    match only.get("$ref").and_then(Json::as_str) {
        Some(path) => root.pointer(path.trim_start_matches('#')).unwrap(),
        None => node,
    }
}

/// Every key of the schema; those within curves and free tables are left out.
fn keys_of_schema() -> Vec<Key> {
    fn collect(root: &Json, node: &Json, path: &str, keys: &mut Vec<Key>) {
        let required: Vec<_> =
            node["required"].as_array().into_iter().flatten().filter_map(Json::as_str).collect();
        for (key, property) in node["properties"].as_object().into_iter().flatten() {
            let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            let inner = resolve(root, property.get("items").unwrap_or(property));
            collect(root, inner, &path, keys);
            let required = required.contains(&key.as_str());
            keys.push(Key { path, property: property.clone(), required });
        }
    }
    let root = schema();
    let mut keys = Vec::new();
    collect(&root, &root, "", &mut keys);
    keys
}

/// Whether a key is that of a curve.
fn is_curve(key: &Key) -> bool {
    resolve(&schema(), &key.property)
        .get("title")
        .and_then(Json::as_str)
        .is_some_and(|t| t.starts_with("Curve of"))
}

/// The values that stand at a path (indices left out) in a document, as paths with indices.
fn places(root: &toml::Table, path: &str) -> Vec<Vec<Step>> {
    fn descend(value: &Value, keys: &[&str], steps: &mut Vec<Step>, found: &mut Vec<Vec<Step>>) {
        match (value, keys) {
            (_, []) => found.push(steps.clone()),
            (Value::Array(items), _) => {
                for (i, item) in items.iter().enumerate() {
                    steps.push(Step::Index(i));
                    descend(item, keys, steps, found);
                    steps.pop();
                }
            }
            (Value::Table(table), [key, rest @ ..]) => {
                if let Some(inner) = table.get(*key) {
                    steps.push(Step::Key((*key).into()));
                    descend(inner, rest, steps, found);
                    steps.pop();
                }
            }
            _ => {}
        }
    }
    let mut found = Vec::new();
    descend(&Value::Table(root.clone()), &path.split('.').collect::<Vec<_>>(), &mut Vec::new(), &mut found);
    found
}

#[derive(Clone)]
enum Step {
    Key(String),
    Index(usize),
}

/// A document with one value changed (or removed), and the dotted path of that value.
fn changed(root: &toml::Table, steps: &[Step], value: Option<Value>) -> (String, String) {
    let mut document = Value::Table(root.clone());
    let (last, before) = steps.split_last().unwrap();
    let mut node = &mut document;
    let mut path = String::new();
    for step in before {
        (node, path) = match step {
            Step::Key(key) => (&mut node[key.as_str()], format!("{path}.{key}")),
            Step::Index(i) => (&mut node[*i], format!("{path}[{i}]")),
        };
    }
    let Step::Key(key) = last else { panic!("the last step is a key") };
    let table = node.as_table_mut().unwrap();
    match value {
        Some(value) => table.insert(key.clone(), value),
        None => table.remove(key),
    };
    (toml::to_string(&document).unwrap(), format!("{path}.{key}").trim_start_matches('.').to_owned())
}

/// Asserts that a document has a problem with a key, or with a part of it.
#[track_caller]
fn must_refuse(text: &str, path: &str, why: &str) {
    let problems = refuse(text);
    let found = problems.iter().any(|problem| problem.key.starts_with(path));
    assert!(found, "{path}: {why}\n{}", super::listed(&problems));
}

/// Whether a message is that of a limit on a number.
fn ranged(message: &str) -> bool {
    ["must be a number", "must be a whole number"].iter().any(|phrase| message.contains(phrase))
}

/// Runs over every place where a key stands in the two documents.
fn everywhere(key: &Key, mut visit: impl FnMut(&toml::Table, &[Step])) {
    let mut visited = 0;
    for text in [FULL, OTHER] {
        let root: toml::Table = text.parse().unwrap();
        // Some of a kind is as good as all.
        for steps in places(&root, &key.path).iter().take(2) {
            visit(&root, steps);
            visited += 1;
        }
    }
    // The full document uses every key but those of other outputs.
    let only_elsewhere = ["accel.sensor.input_limit_m_per_s2"];
    assert!(
        visited > 0 || only_elsewhere.contains(&key.path.as_str()),
        "{} is in neither document",
        key.path
    );
}

#[test]
fn what_the_schema_requires_is_required() {
    for key in keys_of_schema() {
        everywhere(&key, |root, steps| {
            let (text, path) = changed(root, steps, None);
            if key.required {
                must_refuse(&text, &path, "is required");
            } else if let Err(problems) = Document::parse(&text, None) {
                // Optional by itself; another key may need it, and then says so.
                let insisted = problems.iter().any(|p| p.key == path && !p.message.contains("need"));
                assert!(!insisted, "{path}:\n{}", super::listed(&problems));
            }
        });
    }
}

#[test]
fn the_types_of_the_schema_are_enforced() {
    for key in keys_of_schema() {
        everywhere(&key, |root, steps| {
            let (text, path) = changed(root, steps, Some(Value::Boolean(true)));
            must_refuse(&text, &path, "is no boolean");
        });
    }
}

#[test]
fn the_limits_of_the_schema_are_enforced_and_allowed() {
    let mut tried = 0;
    for key in keys_of_schema() {
        let bound = |name: &str| key.property.get(name).and_then(Json::as_f64);
        let whole = key.property.get("type").is_some_and(|name| name == "integer");
        #[expect(clippy::cast_possible_truncation, reason = "limits of whole numbers are small")]
        let number = |value: f64| if whole { Value::Integer(value as i64) } else { Value::Float(value) };
        let step = |limit: f64| if whole { 1.0 } else { 1e-6 * limit.abs().max(1e-3) };
        let mut outside = Vec::new();
        outside.extend(bound("minimum").map(|low| low - step(low)));
        outside.extend(bound("maximum").map(|high| high + step(high)));
        outside.extend(bound("exclusiveMinimum"));
        outside.extend(key.property.pointer("/not/const").and_then(Json::as_f64));
        let inside = [bound("minimum"), bound("maximum")];
        everywhere(&key, |root, steps| {
            for value in &outside {
                let (text, path) = changed(root, steps, Some(number(*value)));
                must_refuse(&text, &path, &format!("{value} is outside"));
                tried += 1;
            }
            for value in inside.into_iter().flatten() {
                let (text, path) = changed(root, steps, Some(number(value)));
                let problems = Document::parse(&text, None).err().unwrap_or_default();
                // The walk allows it; what other keys make of it is another matter.
                let refused = problems.iter().any(|problem| problem.key == path && ranged(&problem.message));
                assert!(!refused, "{path}: {value} is inside\n{}", super::listed(&problems));
            }
            let counts = ["minItems", "maxItems"].map(|name| key.property.get(name).and_then(Json::as_u64));
            if let [Some(low), _] | [None, Some(low)] = counts {
                let (text, path) = changed(root, steps, Some(Value::Array(Vec::new())));
                if counts[0].is_some_and(|low| low > 0) {
                    must_refuse(&text, &path, &format!("fewer than {low}"));
                }
            }
            if let Some(high) = counts[1] {
                let many = usize::try_from(high).unwrap() + 1;
                let item = places(root, &key.path).first().map(|_| Value::Float(0.5)).unwrap();
                let (text, path) = changed(root, steps, Some(Value::Array(vec![item; many])));
                must_refuse(&text, &path, &format!("more than {high}"));
            }
        });
    }
    assert!(tried > 60, "{tried}");
}

#[test]
fn every_number_names_its_unit() {
    // Ratios, weights, direction cosines and versions have none, and a counter counts what it counts; residuals have
    // theirs in `measure`.
    let without = [
        "schema",
        "gyro.orientation.rows",
        "gyro.orientation.weights",
        "accel.orientation.rows",
        "accel.orientation.weights",
        "self_test.counter.max_increase",
        "auxiliary.conversion",
        "auxiliary.range",
        "auxiliary.spike_limit",
        "gyro.sensor.regressor.reference",
        "accel.sensor.regressor.reference",
    ];
    for key in keys_of_schema() {
        let numeric = |node: &Json| matches!(node["type"].as_str(), Some("number" | "integer"));
        let items = &key.property["items"];
        let is_number = numeric(&key.property) || numeric(items) || numeric(&items["items"]);
        let exempt = without.contains(&key.path.as_str()) || key.path.starts_with("origin.residual.");
        if is_number && !exempt {
            assert!(unit_of_key(&key.path).is_some(), "{} does not end with a unit", key.path);
        }
    }
}

#[test]
fn every_form_of_every_curve_in_the_schema_is_read() {
    let root = schema();
    let mut forms = 0;
    for key in keys_of_schema().iter().filter(|key| is_curve(key)) {
        for form in resolve(&root, &key.property)["oneOf"].as_array().unwrap() {
            let mut curve = toml::Table::new();
            for (name, property) in form["properties"].as_object().unwrap() {
                let knots =
                    || (0..3).map(|i| Value::Array(vec![Value::Integer(i), Value::Integer(2 + i)])).collect();
                curve.insert(
                    name.clone(),
                    match (property.get("const"), name.split('_').next()) {
                        (Some(kind), _) => Value::String(kind.as_str().unwrap().into()),
                        (_, Some("range")) => Value::Array(vec![Value::Integer(-40), Value::Integer(70)]),
                        (_, Some("coefficients")) => Value::Array(vec![Value::Integer(2)]),
                        (_, Some("knots")) => Value::Array(knots()),
                        _ => Value::Integer(3),
                    },
                );
            }
            forms += 1;
            // Of a branched coefficient both curves change, so that they keep one argument.
            let mut read = 0;
            let counting = OTHER.replace("input_limit_v = 10\n", "").replace("\"V\"", "\"counts\"");
            let counting = counting.replace("_v", "_counts_per_s");
            let measuring = OTHER.replace("\"V\"", "\"m/s2\"").replace("_v", "_m_per_s2");
            for text in [FULL, OTHER, &measuring, &counting] {
                let document: toml::Table = text.parse().unwrap();
                let Some(steps) = places(&document, &key.path).into_iter().next() else { continue };
                let (mut text, _) = changed(&document, &steps, Some(Value::Table(curve.clone())));
                for (one, both) in [("run_up", "braking"), ("braking", "run_up")] {
                    if key.path.ends_with(one) {
                        let (document, mut steps) = (text.parse().unwrap(), steps.clone());
                        steps.pop();
                        steps.push(Step::Key(both.into()));
                        text = changed(&document, &steps, Some(Value::Table(curve.clone()))).0;
                    }
                }
                match Document::parse(&text, None) {
                    Ok(_) => read += 1,
                    Err(problems) => assert!(
                        problems.iter().any(|problem| problem.message.contains("output needs")),
                        "{}: {form}\n{}",
                        key.path,
                        super::listed(&problems)
                    ),
                }
            }
            assert!(read > 0, "{}: {form}", key.path);
        }
    }
    assert!(forms > 40, "{forms}");
    accept(FULL);
}

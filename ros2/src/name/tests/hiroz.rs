//! The frozen tokens by the rules of another implementation: `hiroz-protocol` 0.2 (`ZettaScale`), as its source and tests state them
//! (`format/rmw_zenoh.rs`, `tests/key_expr.rs`, `tests/qos.rs`). Its code does not run here: it would bring a second build of Zenoh.

use serde_json::Value;

use crate::name::{Kind, parse};

/// Quality of service: reliable, volatile, messages kept (`None`: all). What is left out or 0 is the system's default; its depth is 10.
fn qos(text: &str) -> Option<(bool, bool, Option<u32>)> {
    let mut parts = text.split(':');
    let (reliability, durability, history) = (parts.next()?, parts.next()?, parts.next()?);
    let (kind, depth) = history.split_once(',').unwrap_or((history, ""));
    let kept = match kind {
        "" | "0" | "1" => Some(match depth {
            "" | "0" => 10,
            depth => depth.parse().ok()?,
        }),
        "2" => None,
        _ => return None,
    };
    Some((reliability != "2", durability != "1", kept))
}

/// Chunks behind the prefix, a `%` read back as the `/` that it stands for; of a node 8, of an endpoint 12.
fn chunks(token: &str) -> Vec<String> {
    token.strip_prefix("@ros2_lv/").unwrap().split('/').map(|chunk| chunk.replace('%', "/")).collect()
}

#[test]
fn its_own_cases_of_quality_are_read_as_it_reads_them() {
    let usual = Some((true, true, Some(10)));
    for (text, expected) in [
        ("::,:,:,:,,", usual),
        ("::1,:,:,:,,", usual),
        ("::,10:,:,:,,", usual),
        ("0:0:0,0:,:,:,,", usual),
        ("::2,:,:,:,,", Some((true, true, None))),
        ("1:1:,5:,:,:,,", Some((true, false, Some(5)))),
        ("2::,1:,:,:,,", Some((false, true, Some(1)))),
        ("::3,1:,:,:,,", None),
        ("::1,-1:,:,:,,", None),
    ] {
        assert_eq!(qos(text), expected, "{text}");
    }
}

#[test]
fn every_frozen_token_says_by_its_rules_what_was_meant() {
    let vectors: Value = serde_json::from_str(include_str!("../../../vectors.json")).unwrap();
    for node in vectors["nodes"].as_array().unwrap() {
        let text = |value: &Value| value.as_str().unwrap().to_owned();
        let (domain, session) = (node["domain"].to_string(), text(&node["session"]));
        let (namespace, name) = (text(&node["namespace"]), text(&node["name"]));
        let own = chunks(&text(&node["token"]));
        assert_eq!(own, [&domain, &session, &own[2], &own[2], "NN", "/", &namespace, &name]);
        for endpoint in node["endpoints"].as_array().unwrap() {
            let kind = match endpoint["kind"].as_str().unwrap() {
                "PUBLISHER" => "MP",
                "SUBSCRIPTION" => "MS",
                _ => "SS",
            };
            let [topic, dds, hash] = ["topic", "dds", "hash"].map(|field| text(&endpoint[field]));
            let (number, quality) = (endpoint["number"].to_string(), text(&endpoint["qos"]));
            let token = chunks(&text(&endpoint["token"]));
            let head = [&domain, &session, &own[2], &number, kind, "/", &namespace, &name];
            assert_eq!(token[..8], head);
            assert_eq!(token[8..], [&*topic, &*dds, &*hash, &*quality]);
            // A data key keeps the slashes that a token replaces.
            assert_eq!(text(&endpoint["key"]), format!("{domain}/{}/{dds}/{hash}", topic.trim_matches('/')));
            let expected = match &*topic {
                "/imu/data" => (true, true, None),
                "/diagnostics" => (true, true, Some(1)),
                "/imu/data_raw" | "/imu/temperature" => (false, true, Some(5)),
                _ => (true, true, Some(10)),
            };
            assert_eq!(qos(&quality), Some(expected), "{topic}");
        }
    }
}

/// One that its authors took from a running `rmw_zenoh_cpp`.
#[test]
fn a_token_of_a_running_node_is_read() {
    let hash = format!("RIHS01_{}", "0".repeat(64));
    let token = format!(
        "@ros2_lv/123/1234567890abcdef1234567890abcdef/1/2/MP/%/%/res_gateway/%res%statuslight%autonomy/\
         frost_msgs%msg%StatuslightRpdo1/{hash}/::,:,:,:,,:"
    );
    let seen = parse(&token).unwrap();
    assert_eq!((seen.kind, &*seen.node), (Kind::Publisher, "/res_gateway"));
    let (topic, _, of) = seen.topic.unwrap();
    assert_eq!((&*topic, of), ("/res/statuslight/autonomy", hash));
}

//! Faults on purpose: the same for the same seed, and an account that adds up.

use serde_json::Value;

use super::{Listener, begin, in_time, service, simulated, summary};
use isotherm_tests::bench::LIMIT;

/// All kinds at once, one log as three units.
const FAULTS: [&str; 15] = [
    "--speed",
    "max",
    "--batch",
    "5",
    "--copies",
    "3",
    "--jitter-ms",
    "30",
    "--loss",
    "0.05",
    "--duplicate",
    "0.05",
    "--reorder",
    "0.05",
    "--seed",
];

#[tokio::test(flavor = "multi_thread")]
async fn the_same_seed_gives_the_same_messages_to_the_byte() {
    let folder = tempfile::tempdir().unwrap();
    let [log, mapping] = simulated(folder.path(), "mems-chamber", 60);
    let mut heard = Vec::new();
    for (seed, speed) in [("7", "max"), ("7", "30"), ("8", "max")] {
        let mut arguments = vec![log.as_str(), "-m", &mapping, "-u", "MEMS-0001", "--series", "1"];
        arguments.extend(FAULTS);
        arguments.push(seed);
        arguments[8] = speed;
        assert_eq!(arguments[7], "--speed");
        heard.push(Listener::new().await.play(&arguments).await.1);
    }
    assert!(heard[0].len() > 5000);
    assert!(heard[0] == heard[1], "at another speed, the same messages in the same order");
    assert!(heard[0] != heard[2], "another seed");
    let of = |copy: &str| -> Vec<_> {
        let own = heard[0].iter().filter(|(key, _)| key.contains(copy));
        own.map(|(key, frame)| (key.replace(copy, ""), frame.clone())).collect()
    };
    let [first, second, third] = ["MEMS-0001-001", "MEMS-0001-002", "MEMS-0001-003"];
    assert!(of(first) != of(second) && of(second) != of(third), "each unit has faults of its own");
}

#[tokio::test(flavor = "multi_thread")]
async fn the_account_adds_up_for_every_unit() {
    let folder = tempfile::tempdir().unwrap();
    let [log, mapping] = simulated(folder.path(), "mems-chamber", 60);
    let service = service();
    let locator = service.locator.clone();
    for pass in ["--loop=1", "--loop=2"] {
        let mut arguments: Vec<_> = ["-m", &mapping, &log, "-u", "M", "--connect", &locator, "--json", pass]
            .into_iter()
            .chain(FAULTS)
            .chain(["11"])
            .map(str::to_owned)
            .collect();
        arguments.push("--wait=20".to_owned());
        let output = in_time(LIMIT, move || {
            let arguments: Vec<_> = arguments.iter().map(String::as_str).collect();
            begin(&arguments).wait_with_output().unwrap()
        });
        let summary = summary(&output.await, 0);
        let units = summary["units"].as_array().unwrap();
        assert_eq!(units.len(), 3, "{summary}");
        for unit in units {
            let count = |name: &str| unit[name].as_u64().unwrap_or_else(|| panic!("{name}: {unit}"));
            let kinds = ["messages_withheld", "messages_sent_again", "messages_held_back"];
            assert!(kinds.iter().all(|kind| count(kind) > 50), "{unit}");
            assert_eq!((count("ticks_lost"), count("ticks_under_way"), count("ticks_duplicated")), (0, 0, 0));
            assert_eq!(count("ticks_sent"), count("ticks_acknowledged") + count("ticks_late"), "{unit}");
            // Nobody announces what is missing before the first tick of a run or behind its last.
            let missing = count("ticks_not_sent") + count("ticks_late");
            assert!(missing.abs_diff(count("ticks_announced_missing")) <= 10, "{unit}");
            let runs = if pass == "--loop=2" { 2 } else { 1 };
            assert_eq!((count("runs"), count("ticks_sent") + count("ticks_withheld")), (runs, runs * 6000));
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn delay_alone_keeps_every_tick() {
    let folder = tempfile::tempdir().unwrap();
    let [log, mapping] = simulated(folder.path(), "mems-chamber", 20);
    let service = service();
    let arguments =
        ["-m", &mapping, "-u", "J", "--connect", &service.locator, "--json", "--jitter-ms", "400"]
            .map(str::to_owned);
    let output = in_time(LIMIT, move || {
        let arguments: Vec<_> = arguments.iter().map(String::as_str).chain(["--speed", "20", &log]).collect();
        begin(&arguments).wait_with_output().unwrap()
    });
    let summary = summary(&output.await, 0);
    assert_eq!(
        (&summary["ticks_acknowledged"], &summary["ticks_late"]),
        (&Value::from(2000), &Value::from(0))
    );
}

//! I2 over real sessions: what the service publishes equals the offline correction of the same log to the bit, at any
//! speed and in batches of any size.

use std::path::Path;
use std::sync::Arc;

use isotherm_protocol::codec;
use isotherm_protocol::corrected::{CorrectedBatch, CorrectedTick, are_same};
use isotherm_protocol::document::Document;
use isotherm_tests::bench::Bench;
use isotherm_tests::data::root;
use isotherm_tests::process;

const UNIT: &str = "ZLG-0001";

/// Part of the log (s) and speed: at 1× a slice is enough.
const RUNS: [(f64, &str); 3] = [(3.0, "1"), (60.0, "50"), (150.0, "max")];
const BATCHES: [u64; 3] = [1, 7, 64];

/// The ticks of a file of frames, each behind its length (u32, little-endian).
fn ticks_of(file: &Path) -> Vec<CorrectedTick> {
    let bytes = std::fs::read(file).expect("the file is there");
    let mut rest = bytes.as_slice();
    let mut ticks = Vec::new();
    while let Some((length, behind)) = rest.split_first_chunk::<4>() {
        let (frame, behind) = behind.split_at(u32::from_le_bytes(*length) as usize);
        ticks.extend(codec::decode::<CorrectedBatch>(frame).expect("a good frame").ticks);
        rest = behind;
    }
    ticks
}

#[tokio::test(flavor = "multi_thread")]
async fn i2_online_equals_offline_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().expect("a path in UTF-8").to_owned();
    let (log, mapping, corrected) = (path("log.csv"), path("log.mapping.toml"), path("corrected.wire"));
    let document = root().join("config/calibration/ZLG-0001.toml");
    let text = std::fs::read_to_string(&document).unwrap();
    let calibration = Arc::new(Document::parse(&text, None).expect("a shipped document").calibration);
    let document = document.to_str().unwrap();
    // Accelerometers, temperatures, mode switches: everything whose moment could matter.
    process::run_well(
        "isotherm-replay",
        &["simulate", "--preset", "zeeman-sine", "--duration", "150", "--out", &log],
    );

    for (seconds, speed) in RUNS {
        let seconds = seconds.to_string();
        process::run_well(
            "isotherm-replay",
            &["correct", &log, "--mapping", &mapping, "--calibration", document, "--duration", &seconds]
                .into_iter()
                .chain(["--format", "wire", "--out", &corrected, "--overwrite"])
                .collect::<Vec<_>>(),
        );
        let offline = ticks_of(Path::new(&corrected));
        assert!(!offline.is_empty());
        for batch in BATCHES {
            let mut bench = Bench::start(&[(UNIT, Arc::clone(&calibration))]).await;
            let locator = bench.options.connect[0].clone();
            let batch = batch.to_string();
            let arguments = ["play", &log, "--mapping", &mapping, "--unit", UNIT, "--connect", &locator]
                .into_iter()
                .chain(["--duration", &seconds, "--speed", speed, "--batch", &batch])
                .map(ToOwned::to_owned)
                .collect::<Vec<_>>();
            let player = tokio::task::spawn_blocking(move || {
                process::run_well(
                    "isotherm-replay",
                    &arguments.iter().map(String::as_str).collect::<Vec<_>>(),
                )
            });
            let online = bench.receive(UNIT, offline.len() as u64).await;
            player.await.unwrap();
            let (_, rest) = bench.stop().await;
            assert!(rest.is_empty(), "{speed}×, batches of {batch}: {} ticks too many", rest.len());
            let different =
                online.iter().zip(&offline).position(|(online, offline)| !are_same(online, offline));
            assert_eq!(different, None, "{speed}×, batches of {batch}: first different tick");
            assert_eq!(online.len(), offline.len());
        }
    }
}

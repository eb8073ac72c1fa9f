//! Everything for a fault report, as one file.

use std::io;
use std::time::{Instant, SystemTime};

use flate2::Compression;
use flate2::write::GzEncoder;
use isotherm_protocol::key::{self, UnitId};

use super::Web;
use isotherm_operator::page::{self, tone};
use isotherm_operator::status::{Report, unix_ms};
use isotherm_operator::worst_first;

/// Latest entries of a unit's history that go in.
const ENTRIES: usize = 1000;
/// Columns of the overview.
const COLUMNS: usize = 240;

/// What stands in it, for whoever opens it.
const README: &str = "\
Fault report of isotherm, made by its console in the browser.

summary.txt            the lines of `isotherm status`, worst first
status.json            all of it: services and units, as `isotherm status --json`
service/ID.toml        effective configuration, defaults included; secrets of the Zenoh configuration left out
unit/SERIAL/calibration.toml   document in force
unit/SERIAL/history.json       what was done to the unit, as `isotherm history --all --json`
missing.txt            what could not be read, if anything

Not in it: the service's log (for example: journalctl -u isotherm), and recordings (isotherm-replay record).
Names of operators and paths of files are in it unchanged.
";

impl Web {
    /// The file for these units, all of them where none is named: tar, packed with gzip.
    pub(super) async fn bundle(&self, unit: Option<&str>) -> io::Result<Vec<u8>> {
        let (summary, report) = self.report(unit);
        let mut files =
            vec![("README.txt".to_owned(), README.to_owned()), ("summary.txt".to_owned(), summary)];
        let mut missing = String::new();
        let mut ask = async |name: String, key: String, parameters: &str| match self
            .client
            .text(&key, parameters, None)
            .await
        {
            Ok(text) => files.push((name, text)),
            Err(error) => missing.extend([&*name, ": ", &error.to_string(), "\n"]),
        };
        for service in &report.services {
            let (name, key) =
                (format!("service/{}.toml", service.instance), key::configuration(&service.instance));
            ask(name, key, "").await;
        }
        let serials: std::collections::BTreeSet<_> = report.units.iter().map(|status| &status.unit).collect();
        for unit in serials.into_iter().filter_map(|serial| UnitId::new(serial).ok()) {
            ask(format!("unit/{unit}/calibration.toml"), key::calibration(&unit), "").await;
            ask(format!("unit/{unit}/history.json"), key::history(&unit), &format!("limit={ENTRIES}")).await;
        }
        files.push(("status.json".to_owned(), report.to_json()));
        if !missing.is_empty() {
            files.push(("missing.txt".to_owned(), missing));
        }
        // Megabytes of text for hundreds of units: not on a thread where others wait.
        let packed = tokio::task::spawn_blocking(move || pack(&files)).await;
        packed.map_err(io::Error::other)?
    }

    /// Lines and statuses of these units, and of the services.
    fn report(&self, unit: Option<&str>) -> (String, Report) {
        let fleet = self.fleet();
        let (services, gone) = fleet.services();
        let mut units = worst_first(self.seen(&fleet, Instant::now(), unix_ms()));
        units.retain(|it| unit.is_none_or(|unit| unit == it.status.unit));
        let lines = page::overview((&services, &gone), &fleet.pairs, &units, COLUMNS);
        let units = units.iter().map(|it| it.status.clone()).collect();
        (tone::text(&lines, false), Report { services, units, instances: fleet.pairs.clone() })
    }
}

/// Files in a folder of their own, as tar and gzip.
fn pack(files: &[(String, String)]) -> io::Result<Vec<u8>> {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    let mut archive = tar::Builder::new(GzEncoder::new(Vec::new(), Compression::default()));
    for (name, text) in files {
        let mut header = tar::Header::new_gnu();
        header.set_size(text.len() as u64);
        header.set_mode(0o644);
        header.set_mtime(since.as_secs());
        archive.append_data(&mut header, format!("isotherm-report/{name}"), text.as_bytes())?;
    }
    archive.into_inner()?.finish()
}

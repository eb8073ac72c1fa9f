//! The figures of the other benches as tables and plots.

mod page;
mod plot;
mod tables;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::error::Error;
use crate::{chain, scale};

/// Arguments of `report`.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct ReportArgs {
    /// Folder with kernel.json, chain.json, profiles.json and scale.json; what is not there is left as it is on the page
    #[arg(long, value_name = "FOLDER")]
    from: PathBuf,
    /// Page whose tables are written anew, between its markers
    #[arg(long, value_name = "FILE", default_value = "target/performance/performance.md")]
    page: PathBuf,
    /// Folder of the plots
    #[arg(long, value_name = "FOLDER", default_value = "target/performance")]
    plots: PathBuf,
}

/// A row of the kernel bench.
#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Kernel {
    name: String,
    ns_per_tick: f64,
    ratio_to_peer: f64,
}

/// Writes tables and plots; what was written.
pub(crate) fn write(args: &ReportArgs) -> Result<String, Error> {
    let kernel: Option<Vec<Kernel>> = read(&args.from.join("kernel.json"))?;
    let [chain, profiles]: [Option<chain::Report>; 2] =
        [read(&args.from.join("chain.json"))?, read(&args.from.join("profiles.json"))?];
    let scale: Option<scale::Report> = read(&args.from.join("scale.json"))?;

    let mut sections: Vec<(&str, String)> = Vec::new();
    if let Some(kernel) = &kernel {
        sections.push(("kernel", tables::kernel(kernel)));
    }
    if let Some(chain) = &chain {
        sections.push(("chain", tables::machine(&chain.machine, &chain.skipped)));
        sections.push(("latency", tables::latency(&chain.rows)));
        sections.push(("swaps", tables::swaps(&chain.rows)));
        sections.push(("throughput", tables::throughput(&chain.rows)));
    }
    if let Some(profiles) = &profiles {
        sections.push(("profiles", tables::profiles(&profiles.rows)));
    }
    if let Some(scale) = &scale {
        sections.push(("scale", tables::machine(&scale.machine, &scale.skipped)));
        sections.push(("units", tables::units(&scale.units, &scale.zenoh, &scale.growth)));
        sections.push(("rated", tables::rated(&scale.rated)));
        sections.extend(scale.offline.as_ref().map(|offline| ("offline", tables::offline(offline))));
    }
    let page = fs::read_to_string(&args.page).map_err(|source| Error::file(&args.page, source))?;
    let written =
        page::fill(&page, &sections).map_err(|what| Error::Invalid { path: args.page.clone(), what })?;
    fs::write(&args.page, written).map_err(|source| Error::file(&args.page, source))?;

    fs::create_dir_all(&args.plots).map_err(|source| Error::file(&args.plots, source))?;
    let mut plots = Vec::new();
    if let Some(chain) = &chain {
        plots.push(("latency.svg", plot::latency(&chain.rows)));
    }
    if let Some(scale) = &scale {
        plots.push(("units.svg", plot::units(&scale.units)));
    }
    let mut words = format!("{}: {} tables\n", args.page.display(), sections.len());
    for (name, svg) in plots {
        let path = args.plots.join(name);
        let svg = svg.map_err(|what| Error::Invalid { path: path.clone(), what })?;
        fs::write(&path, svg).map_err(|source| Error::file(&path, source))?;
        let _ = writeln!(words, "{}", path.display());
    }
    Ok(words)
}

/// Reads figures; `None` where there is no such file.
fn read<T: DeserializeOwned>(path: &Path) -> Result<Option<T>, Error> {
    if !path.is_file() {
        return Ok(None);
    }
    let text = fs::read_to_string(path).map_err(|source| Error::file(path, source))?;
    serde_json::from_str(&text)
        .map(Some)
        .map_err(|error| Error::Invalid { path: path.to_owned(), what: error.to_string() })
}

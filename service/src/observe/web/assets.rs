//! Page, style and scripts, in the program: nothing is loaded from anywhere else.

use std::sync::LazyLock;

use isotherm_pages::CHART_SCRIPT;

/// A file that browsers ask for.
#[derive(Debug)]
pub(super) struct Asset {
    pub(super) path: &'static str,
    pub(super) kind: &'static str,
    pub(super) text: String,
}

/// The console's own parts of the script.
const PARTS: [&str; 10] = [
    include_str!("page/ask.js"),
    include_str!("page/figures.js"),
    include_str!("page/parts.js"),
    include_str!("page/units.js"),
    include_str!("page/charts.js"),
    include_str!("page/sheet.js"),
    include_str!("page/change.js"),
    include_str!("page/command.js"),
    include_str!("page/history.js"),
    include_str!("page/main.js"),
];

/// The whole script. The charts are those of plots (`docs/adr/0020-zoomable-plots.md`): one engine for both.
static SCRIPT: LazyLock<String> =
    LazyLock::new(|| ["\"use strict\";\n"].into_iter().chain(CHART_SCRIPT).chain(PARTS).collect());

/// All of them.
static ASSETS: LazyLock<[Asset; 4]> = LazyLock::new(|| {
    let asset = |path, kind, text: &str| Asset { path, kind, text: bare(text) };
    [
        asset("/", "text/html; charset=utf-8", include_str!("page/index.html")),
        asset("/web/console.css", "text/css; charset=utf-8", include_str!("page/style.css")),
        asset("/web/console.js", "text/javascript; charset=utf-8", &SCRIPT),
        asset("/web/icon.svg", "image/svg+xml", include_str!("page/icon.svg")),
    ]
});

/// The file of a path.
pub(super) fn find(path: &str) -> Option<&'static Asset> {
    ASSETS.iter().find(|asset| asset.path == path)
}

/// A text without indentation and without lines that are comments: browsers have no use for either.
fn bare(text: &str) -> String {
    let comment = |line: &str| line.starts_with("//") || (line.starts_with("/*") && line.ends_with("*/"));
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty() && !comment(line));
    lines.flat_map(|line| [line, "\n"]).collect()
}

#[cfg(test)]
mod tests;

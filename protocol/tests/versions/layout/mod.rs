//! `protocol/layout.toml`: the layout agrees with the codec, and what is generated from it is what is committed.

mod agree;
mod c;
mod c_client;
mod c_printer;
mod c_writer;
mod decode;
mod file;
mod page;
mod python;

use std::path::PathBuf;

use file::Layout;

/// A file of the project.
fn path(path: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "..", path].iter().collect()
}

/// Compares a committed file with what the layout gives; `ISOTHERM_BLESS=1` writes it anew.
#[track_caller]
fn compare(file: &str, expected: &str) {
    let path = path(file);
    if std::env::var_os("ISOTHERM_BLESS").is_some() {
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(&path, expected).expect("it can be written");
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == expected,
        "{file} is not what protocol/layout.toml gives: run the test with ISOTHERM_BLESS=1"
    );
}

/// Replaces the text between the lines `begin` and `end` of each region.
#[track_caller]
fn compare_regions(file: &str, regions: &[(String, String)], line: impl Fn(&str) -> String) {
    let mut text = std::fs::read_to_string(path(file)).expect("the file is there");
    for (region, expected) in regions {
        let (begin, end) = (line(region), line(&format!("end of {region}")));
        let (before, rest) = text.split_once(&begin).unwrap_or_else(|| panic!("{file}: no line {begin}"));
        let (_, after) = rest.split_once(&end).unwrap_or_else(|| panic!("{file}: no line {end}"));
        text = [before, &begin, expected, &end, after].concat();
    }
    compare(file, &text);
}

#[test]
fn the_tables_of_the_page_are_those_of_the_layout() {
    compare_regions("docs/wire.md", &page::regions(&Layout::load()), |region| format!("<!-- {region} -->\n"));
}

#[test]
fn the_header_is_that_of_the_layout() {
    let layout = Layout::load();
    let regions = [("types", c::types(&layout)), ("frames", c_writer::frames(&layout))];
    let regions = regions.map(|(region, text)| (region.to_owned(), text));
    compare_regions("clients/c/isotherm.h", &regions, |region| format!("/* generated: {region} */\n"));
}

#[test]
fn the_modules_of_other_languages_are_those_of_the_layout() {
    let layout = Layout::load();
    compare("clients/python/src/isotherm/_layout.py", &python::module(&layout));
    compare("clients/typescript/isotherm.ts", &python::typescript(&layout));
    let regions = [("flags".to_owned(), python::flags_of_the_console(&layout))];
    compare_regions("service/src/observe/web/page/sheet.js", &regions, |region| {
        format!("// generated from protocol/layout.toml: {region}\n")
    });
}

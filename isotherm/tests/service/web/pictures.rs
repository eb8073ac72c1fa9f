//! Pictures of the page, to be looked at: 1, 8 and 200 units, wide and narrow, light and dark.

use std::path::PathBuf;

use super::browser::{Browser, find};
use super::stage::{Kind, Stage};
use crate::control::stand::document;

const SIZES: [(u32, u32); 2] = [(1280, 900), (400, 860)];

fn units(number: usize) -> Vec<(String, Kind)> {
    let kind = |at: usize| match (number, at) {
        (_, 0) => Kind::Laser,
        (1, _) => Kind::Fine,
        (8, 5) | (_, 17) => Kind::Broken,
        (_, 3 | 60 | 61) => Kind::Hot,
        (_, 6 | 120) => Kind::Strange,
        (_, 7 | 33) => Kind::Silent,
        _ => Kind::Fine,
    };
    (0..number).map(|at| (format!("ZLG-{:04}", at + 1), kind(at))).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn of_every_size_and_colour() {
    let (Some(folder), Some(program)) = (std::env::var_os("ISOTHERM_PICTURES").map(PathBuf::from), find())
    else {
        eprintln!("skipped: pictures are made with `just console-pictures`");
        return;
    };
    std::fs::create_dir_all(&folder).unwrap();
    for number in [1, 8, 200] {
        let mut stage = Stage::start(&units(number)).await;
        let mut page = Browser::start(&program);
        page.open(&stage.address());
        page.until(&format!("document.querySelectorAll('table.units tbody tr').length === {number}"));
        if number > 1 {
            page.until(
                "document.querySelector('tr.fault') && document.querySelectorAll('tr.warning').length > 2",
            );
        }
        let every = |page: &mut Browser, name: &str, whole: bool| {
            for (width, height) in SIZES {
                for dark in [false, true] {
                    page.window(width, height, dark);
                    // Drawn anew at this size.
                    page.value("new Promise(done => setTimeout(done, 700))");
                    let scheme = if dark { "dark" } else { "light" };
                    page.picture(&folder.join(format!("{name}-{width}-{scheme}.png")), whole);
                }
            }
        };
        every(&mut page, &format!("units-{number}"), false);
        if number == 8 {
            page.value("location.hash = '#/unit/ZLG-0001'");
            page.until("document.querySelector('.live tbody tr')");
            page.value("new Promise(done => setTimeout(done, 20000))");
            every(&mut page, "unit", true);
            page.value("location.hash = '#/unit/ZLG-0004'");
            page.until("document.querySelector('.remarks li.warning')");
            page.press("Swap…");
            page.write("Text", &document("ZLG-0004", 4.25));
            page.write("Your name", "ann");
            page.press("Show the difference");
            page.until("document.querySelector('.difference')");
            every(&mut page, "swap", false);
            page.press("×");
            stage.start_second();
            page.value("location.hash = '#/unit/ZLG-0002'");
            page.until("document.querySelectorAll('.pairs tbody tr').length === 2 && document.querySelector('.pairs').textContent.includes('standby')");
            every(&mut page, "pair", false);
        }
        page.is_content(&stage.origin());
    }
}

//! The recipes of `docs/operations.md`, run as they are written, in one shell; what the page shows is what comes out.
//!
//! `ISOTHERM_BLESS=1` writes what has come out into the page, where it differs; then shorten by hand what is long: `…`
//! stands for anything within a line, a line of `…` for any lines.

mod page;
mod shell;

use std::time::Instant;

use isotherm_tests::data::root;

use page::{Page, differs};
use shell::Shell;

#[test]
fn every_recipe_of_the_operations_page_does_what_the_page_shows() {
    let file = root().join("docs/operations.md");
    let mut page = Page::read(&file);
    let mut shell = Shell::start();
    let mut wrong = Vec::new();
    for recipe in &mut page.recipes {
        let begun = Instant::now();
        let came = shell.run(&recipe.commands);
        println!("line {}: {:.1} s", recipe.line, begun.elapsed().as_secs_f64());
        let Some(shown) = &mut recipe.shown else { continue };
        if let Some(why) = differs(shown, &came) {
            wrong.push(format!("line {}: {why}\n--- shown\n{shown}--- came\n{came}", recipe.line));
            *shown = came;
        }
    }
    shell.end();
    assert!(page.recipes.len() > 30, "{} recipes", page.recipes.len());
    if std::env::var_os("ISOTHERM_BLESS").is_some() {
        page.write(&file);
    } else {
        assert!(wrong.is_empty(), "{}\n{}", file.display(), wrong.join("\n"));
    }
}

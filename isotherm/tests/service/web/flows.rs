//! What operators do, in a real browser.

use std::io::Write;

use super::browser::{Browser, find};
use super::stage::{Kind, Stage};
use crate::control::stand::{UNIT, document};

/// Text of the page, of an element or of all.
fn text_of(selector: &str) -> String {
    format!("(document.querySelector('{selector}')?.textContent ?? '')")
}

fn has(selector: &str, words: &str) -> String {
    format!("{}.includes({})", text_of(selector), serde_json::json!(words))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn an_operator_opens_swaps_is_refused_rolls_back_commands_and_loses_the_connection() {
    let Some(program) = find() else {
        // Past the capture of the test's output: it is to be read.
        let words = "skipped: console in the browser: no chromium (Debian: apt install chromium) nor ISOTHERM_BROWSER";
        let _ = writeln!(std::io::stderr(), "{words}");
        return;
    };
    let units =
        [(UNIT.to_owned(), Kind::Fine), ("HOT-1".to_owned(), Kind::Hot), ("NEW-1".to_owned(), Kind::Strange)];
    let mut stage = Stage::start(&units).await;
    let mut page = Browser::start(&program);
    page.window(1280, 800, false);

    // Without the token nothing is seen; with it, all units, those that need somebody first.
    page.open(&stage.origin());
    page.until(&has("main", "The console asks for the token"));
    page.write("Token", "this-is-not-the-token-of-the-service");
    page.press("Open");
    page.until(&has("main", "The token is not the service"));
    page.open("about:blank");
    page.open(&stage.address());
    page.until("document.querySelectorAll('table.units tbody tr').length === 3");
    page.until(&has("tr.warning .why", "calibrated to 40"));
    page.until(&format!(
        "document.querySelector('table.units tbody tr:last-child th').textContent === '{UNIT}'"
    ));
    page.until(&has("#link", "Live"));
    assert_eq!(page.value("location.hash"), "#/", "the token is out of the address bar");
    page.value("document.querySelector('input[type=search]').value = 'hot'; document.querySelector('input[type=search]').dispatchEvent(new Event('input'))");
    page.until("document.querySelectorAll('table.units tbody tr').length === 1");
    page.value("document.querySelector('input[type=search]').value = ''; document.querySelector('input[type=search]').dispatchEvent(new Event('input'))");

    // Keys: down to the last unit, and into it.
    page.until("document.querySelectorAll('table.units tbody tr').length === 3");
    for _ in 0..3 {
        page.value("document.dispatchEvent(new KeyboardEvent('keydown', { key: 'j', bubbles: true }))");
    }
    assert_eq!(page.value("document.activeElement.textContent"), UNIT);
    page.value("document.activeElement.click()");
    page.until(&has("h1", UNIT));
    page.until(&has(".live tbody tr td:last-child", "+0.9"));
    page.until("document.querySelector('.live canvas').getContext('2d').getImageData(0, 0, 800, 90).data.some(byte => byte)");
    page.until(&has(".temperatures tbody", "body"));
    page.until(&has(".history tbody", "accepted"));

    looks_at_what_was_written_meanwhile(&mut page);

    // Swap: the difference first, then in force.
    page.press("Swap…");
    page.write("Text", &document(UNIT, 4.25));
    page.press("Show the difference");
    page.until(&has(".outcome", "Would be accepted"));
    page.until(&has(".difference", "4.25"));
    page.press("Put in force");
    page.until(&has("dialog .answer", "Enter your name"));
    page.write("Your name", "ann");
    assert!(
        page.value(&text_of("dialog .line code"))
            .as_str()
            .unwrap()
            .starts_with("isotherm swap ZLG-7 ZLG-7.toml --by ann --connect tcp/")
    );
    page.press("Put in force");
    page.until(&has(".outcome", "Accepted as revision 2"));
    page.press("×");
    page.until(&has(".calibration .facts", "revision 2"));
    page.until(&has(".history tbody tr", "ann"));

    // Refused: every problem with its place, and nothing to press.
    page.press("Swap…");
    page.write("Text", &document(UNIT, 4.5).replace("grid_step_s = 1.0", "grid_step_s = -1.0"));
    page.press("Show the difference");
    page.until(&has(".outcome", "Refused. Revision 2 stays in force."));
    page.until(&has(".problems", "grid_step_s: is -1"));
    page.until("[...document.querySelectorAll('dialog button')].find(b => b.textContent === 'Put in force').disabled");
    // Another serial's document, and what is said of it.
    page.write("Text", &document("HOT-1", 4.5));
    page.until("!document.querySelector('dialog .outcome')");
    page.press("Show the difference");
    page.until(&has(".problems", "any_serial"));
    page.press("×");

    // Back to the one before.
    page.press("Roll back…");
    page.until(&has(".outcome", "Would be accepted"));
    page.press("Put in force");
    page.until(&has(".outcome", "Accepted as revision 3"));
    page.press("×");
    page.until(&has(".calibration .facts", "revision 3"));

    // Commands: what the state takes; a stop is asked for twice.
    page.until("[...document.querySelectorAll('.commands button')].find(b => b.textContent === 'Self-test').disabled");
    page.press("Standby");
    page.press("Really?");
    page.until(&has(".pill", "standby"));
    page.until(&has(".commands .answer", "standby"));
    page.until("![...document.querySelectorAll('.commands button')].find(b => b.textContent === 'Self-test').disabled");
    assert!(
        page.value(&text_of(".commands .line code"))
            .as_str()
            .unwrap()
            .starts_with("isotherm command ZLG-7 standby --by ann")
    );
    page.press("Run");
    page.until(&has(".pill", "running"));

    loses_the_connection(&mut stage, &mut page);

    // A second service of the pair: which of them speaks is shown for the unit and in the list.
    stage.start_second();
    page.until(&has("#troubles", "south · publishes 0 units"));
    page.value(&format!("location.hash = '#/unit/{UNIT}'"));
    page.until(&has(".pairs tbody", "speaking"));
    page.until(&has(".pairs tbody", "standby"));

    // What the other side wrote is text, and no part of the page.
    page.value("location.hash = '#/unit/' + encodeURIComponent('<img src=x onerror=alert(1)>')");
    page.until(&has("h1", "<img src=x onerror=alert(1)>"));
    assert_eq!(page.value("document.querySelectorAll('main img').length"), 0);
    page.is_content(&stage.origin());
}

/// What is written while the service is asked has to be looked at by itself.
fn looks_at_what_was_written_meanwhile(page: &mut Browser) {
    page.press("Swap…");
    page.write("Text", &document(UNIT, 4.25));
    page.value("window.own = fetch; window.fetch = (...of) => new Promise(done => setTimeout(done, 700)).then(() => own(...of)); 0");
    page.press("Show the difference");
    page.write("Text", &document(UNIT, 4.5));
    page.until(&has("dialog .answer", "show the difference again"));
    assert_eq!(
        page.value("[...document.querySelectorAll('dialog button')].find(b => b.textContent === 'Put in force').disabled"),
        true
    );
    page.value("window.fetch = own; 0");
    page.press("×");
}

/// The connection goes and comes back; so does what was in force.
fn loses_the_connection(stage: &mut Stage, page: &mut Browser) {
    stage.stop_service();
    page.until(&has("#link", "Connection lost"));
    page.until("document.body.classList.contains('lost')");
    stage.start_service();
    page.until(&has("#link", "Live"));
    page.until(&has(".calibration .facts", "revision 3"));
    page.until(&format!("{} && !document.querySelector('.live .hint').textContent", has(".pill", "running")));
    page.value("document.dispatchEvent(new KeyboardEvent('keydown', { key: 'u', bubbles: true }))");
    page.until("document.querySelectorAll('table.units tbody tr').length >= 2");
    page.until("document.querySelector('tr.warning th')");
}

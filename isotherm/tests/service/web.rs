//! The console in the browser.
//!
//! `requests`: who is answered what, over plain HTTP, and every way round it that comes to mind. `flows`: what operators do, in a
//! headless Chromium (`ISOTHERM_BROWSER`, else `chromium` in the path); it says so and passes where there is none.
//! `pictures`: the page in every size and colour, where `ISOTHERM_PICTURES` names a folder for them.

mod browser;
mod flows;
mod pictures;
mod requests;
mod stage;

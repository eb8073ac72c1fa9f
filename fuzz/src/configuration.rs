//! The configuration of the service.

use std::path::Path;

use isotherm_service::config::Settings;

use crate::said::listed;

/// What is taken is written as text that is taken too, and says the same.
pub fn configuration(input: &[u8]) {
    let Ok(text) = str::from_utf8(input) else { return };
    let path = Path::new("/nowhere/service.toml");
    match Settings::parse(text, path) {
        Err(problems) => listed(&problems),
        Ok(settings) => {
            let written = settings.to_toml();
            let again = Settings::parse(&written, path).unwrap_or_else(|problems| {
                listed(&problems);
                unreachable!("what is written can be read: {problems:?}\n{written}")
            });
            assert_eq!(again.to_toml(), written);
        }
    }
}

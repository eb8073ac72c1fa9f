//! The page by itself: how large it is, what it asks for, whether it can be read.

use super::*;

/// Everything that a browser is given, in bytes.
const MOST_BYTES: usize = 100_000;

fn text(path: &str) -> &'static str {
    &find(path).unwrap().text
}

#[test]
fn all_of_it_has_less_than_a_hundred_kilobytes() {
    let bytes: usize = ASSETS.iter().map(|asset| asset.text.len()).sum();
    assert!(bytes <= MOST_BYTES, "{bytes}");
}

#[test]
fn it_asks_for_nothing_that_is_not_in_the_program_and_runs_under_its_policy() {
    for asset in ASSETS.iter() {
        // The name of a form of file is no address.
        let text = asset.text.replace("http://www.w3.org/2000/svg", "");
        let outside = [
            "http:",
            "https:",
            "//cdn",
            "@import",
            "url(",
            "import(",
            "eval(",
            "new Function",
            "innerHTML",
            "outerHTML",
            "insertAdjacentHTML",
            "document.write",
            "style=",
            "onclick=\"",
            "javascript:",
            "srcdoc",
        ];
        for outside in outside {
            assert!(!text.contains(outside), "{outside} in {}", asset.path);
        }
    }
    let page = text("/");
    for part in page.split(['"', '\'']).filter(|part| part.starts_with('/') && part.len() > 1) {
        assert!(find(part).is_some(), "{part} is not served");
    }
    assert_eq!(
        page.matches("<script").count(),
        page.matches("<script src=\"/web/").count(),
        "none in the page itself"
    );
    assert!(!page.contains("<style"));
}

#[test]
fn a_text_without_comments_and_indentation_says_the_same() {
    assert_eq!(bare("// a\n/** b */\n\n  let x = 1; // c\n/* d\n e */\n"), "let x = 1; // c\n/* d\ne */\n");
    assert!(!text("/web/console.js").contains('`'), "a text over several lines would lose its indentation");
}

/// Colours of one scheme, by name.
fn colours(block: &str) -> Vec<(&str, [f64; 3])> {
    let declared = block.split(';').filter_map(|part| part.trim().split_once(": #"));
    let colours = declared.filter_map(|(name, digits)| {
        let byte = |at: usize| Some(f64::from(u8::from_str_radix(digits.get(at..at + 2)?, 16).ok()?) / 255.0);
        Some((name.trim().strip_prefix("--")?, [byte(0)?, byte(2)?, byte(4)?]))
    });
    colours.collect()
}

/// Contrast of two colours by WCAG 2.2: (L₁ + 0.05)/(L₂ + 0.05) of the relative luminances.
fn contrast(a: [f64; 3], b: [f64; 3]) -> f64 {
    let luminance = |colour: [f64; 3]| {
        let linear = colour.map(|c| if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) });
        0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    };
    let (a, b) = (luminance(a), luminance(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

#[test]
fn every_text_and_curve_can_be_told_from_its_ground_in_both_schemes() {
    let style = include_str!("../page/style.css");
    let blocks: Vec<_> = style.split(":root {").skip(1).map(|rest| rest.split('}').next().unwrap()).collect();
    assert_eq!(blocks.len(), 2, "light and dark");
    for block in blocks {
        let colours = colours(block);
        let of = |name: &str| {
            colours.iter().find(|(known, _)| *known == name).unwrap_or_else(|| panic!("{name}")).1
        };
        // Text, AA: 4.5. Curves and marks: 3.
        let grounds = ["paper", "ground", "band", "fault-band", "warning-band"];
        let text =
            ["ink", "faint", "accent", "good", "warning", "fault"].map(|name| (name, &grounds[..], 4.5));
        let curves = ["raw", "corrected", "first", "second", "third", "fourth", "fifth", "sixth"];
        let curves = curves.map(|name| (name, &grounds[..1], 4.5));
        let button = [("on-accent", &["accent"][..], 4.5)];
        for (name, grounds, least) in text.into_iter().chain(curves).chain(button) {
            for ground in grounds {
                let found = contrast(of(name), of(ground));
                assert!(found >= least, "{name} on {ground}: {found:.2}");
            }
        }
    }
    let [black, white] = [[0.0; 3], [1.0; 3]];
    assert!((contrast(black, white) - 21.0).abs() < 1e-9 && (contrast(white, white) - 1.0).abs() < 1e-9);
}

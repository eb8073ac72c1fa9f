//! A page with tables between markers.

/// The page with what stands between the markers of each section replaced: `<!-- figures: NAME -->` and `<!-- end -->`, each on
/// a line of its own.
pub(super) fn fill(page: &str, sections: &[(&str, String)]) -> Result<String, String> {
    let mut page = page.to_owned();
    for (name, table) in sections {
        let begin = format!("<!-- figures: {name} -->\n");
        let (before, rest) =
            page.split_once(&begin).ok_or_else(|| format!("has no line {}", begin.trim_end()))?;
        let (_, after) = rest
            .split_once("<!-- end -->\n")
            .ok_or_else(|| format!("figures {name} have no <!-- end -->"))?;
        page = format!("{before}{begin}\n{}\n\n<!-- end -->\n{after}", table.trim());
    }
    Ok(page)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_between_the_markers_changes() {
        let page = "a\n<!-- figures: x -->\nold\n<!-- end -->\nb\n<!-- figures: y -->\n<!-- end -->\nc\n";
        let filled = fill(page, &[("y", "new".to_owned())]).unwrap();
        let expected =
            "a\n<!-- figures: x -->\nold\n<!-- end -->\nb\n<!-- figures: y -->\n\nnew\n\n<!-- end -->\nc\n";
        assert_eq!(filled, expected);
        assert_eq!(fill(&filled, &[("y", "new\n".to_owned())]).unwrap(), filled);
        assert!(fill(page, &[("z", String::new())]).unwrap_err().contains("figures: z"));
        assert!(fill("<!-- figures: x -->\n", &[("x", String::new())]).is_err());
    }
}

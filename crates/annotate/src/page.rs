//! The page's own files, compiled in: it fetches nothing from elsewhere and needs no build step.

/// The page's HTML document.
pub const INDEX: &str = include_str!("../page/index.html");

const SCRIPT: &str = "text/javascript; charset=utf-8";
const ICON: &str = "image/svg+xml";
const STYLE: &str = "text/css; charset=utf-8";

/// Name, media type and text of every other file. They stand flat under `/page/`.
const FILES: &[(&str, &str, &str)] = &[
    ("page.css", STYLE, include_str!("../page/page.css")),
    ("icon.svg", ICON, include_str!("../page/icon.svg")),
    ("api.js", SCRIPT, include_str!("../page/api.js")),
    ("buttons.js", SCRIPT, include_str!("../page/buttons.js")),
    ("editing.js", SCRIPT, include_str!("../page/editing.js")),
    ("geometry.js", SCRIPT, include_str!("../page/geometry.js")),
    ("gestures.js", SCRIPT, include_str!("../page/gestures.js")),
    ("keyboard.js", SCRIPT, include_str!("../page/keyboard.js")),
    ("live.js", SCRIPT, include_str!("../page/live.js")),
    ("main.js", SCRIPT, include_str!("../page/main.js")),
    ("mark_panel.js", SCRIPT, include_str!("../page/mark_panel.js")),
    ("overlay.js", SCRIPT, include_str!("../page/overlay.js")),
    ("region.js", SCRIPT, include_str!("../page/region.js")),
    ("server_end.js", SCRIPT, include_str!("../page/server_end.js")),
    ("samples.js", SCRIPT, include_str!("../page/samples.js")),
    ("store.js", SCRIPT, include_str!("../page/store.js")),
    ("symmetry.js", SCRIPT, include_str!("../page/symmetry.js")),
    ("strip.js", SCRIPT, include_str!("../page/strip.js")),
    ("tabs.js", SCRIPT, include_str!("../page/tabs.js")),
    ("teach.js", SCRIPT, include_str!("../page/teach.js")),
    ("toast.js", SCRIPT, include_str!("../page/toast.js")),
    ("try.js", SCRIPT, include_str!("../page/try.js")),
    ("versions.js", SCRIPT, include_str!("../page/versions.js")),
    ("view.js", SCRIPT, include_str!("../page/view.js")),
];

/// A file by its name, with its media type.
pub fn file(name: &str) -> Option<(&'static str, &'static str)> {
    FILES.iter().find(|(known, ..)| *known == name).map(|&(_, media_type, text)| (media_type, text))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Issue 47: the page stays below 190 KB.
    const MAX_BYTES: usize = 190_000;

    #[test]
    fn the_page_is_small() {
        let bytes = INDEX.len() + FILES.iter().map(|(.., text)| text.len()).sum::<usize>();
        assert!(bytes < MAX_BYTES, "{bytes} bytes");
    }

    /// The values of a property of this name in the page's CSS, and of those that begin with it.
    fn values(property: &str) -> Vec<&'static str> {
        let css = FILES.iter().find(|(name, ..)| *name == "page.css").unwrap().2;
        let declarations = css.split(['{', '}', ';']).filter_map(|declaration| declaration.split_once(": "));
        let named = declarations.filter(|(name, _)| {
            let name = name.trim();
            name == property || name.strip_prefix(property).is_some_and(|rest| rest.starts_with('-'))
        });
        named.map(|(_, value)| value).collect()
    }

    #[test]
    fn sizes_and_spaces_are_those_of_the_style() {
        const SPACES_PX: [i32; 7] = [2, 4, 8, 12, 16, 24, 40];
        for size in values("font-size") {
            assert!(size.starts_with("var(--"), "font-size: {size}");
        }
        for value in ["gap", "padding", "margin"].into_iter().flat_map(values) {
            for px in value.split([' ', '(', ')', ',']).filter_map(|word| word.strip_suffix("px")) {
                let px: i32 = px.parse().unwrap();
                assert!(SPACES_PX.contains(&px.abs()), "a space of {px} px: {value}");
            }
        }
    }

    #[test]
    fn every_file_that_the_page_asks_for_is_there_and_none_beside() {
        let texts = || FILES.iter().map(|&(.., text)| text).chain([INDEX]);
        for (name, ..) in FILES {
            let (imported, linked) = (format!("\"./{name}\""), format!("\"/page/{name}\""));
            assert!(texts().any(|text| text.contains(&imported) || text.contains(&linked)), "nobody asks for {name}");
        }
        for text in texts() {
            for line in text.lines().filter(|line| line.starts_with("import ")) {
                let name = line.rsplit("\"./").next().and_then(|rest| rest.strip_suffix("\";"));
                assert!(name.is_some_and(|name| file(name).is_some()), "no file for: {line}");
            }
        }
    }

    #[test]
    fn the_page_fetches_nothing_from_elsewhere() {
        for text in FILES.iter().map(|&(.., text)| text).chain([INDEX]) {
            let foreign = text.replace("http://www.w3.org/2000/svg", "");
            assert!(!foreign.contains("http:") && !foreign.contains("https:"));
        }
    }
}

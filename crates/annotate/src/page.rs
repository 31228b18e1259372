//! The page's files, compiled in: the page loads nothing from other servers and needs no build step.
//!
//! They are sent without indentation, comment-only lines and most spaces around signs, which saves a sixth. Line numbers
//! are kept, so that messages in the browser refer to lines of the files in page/.

/// The page's HTML document, as in page/.
const INDEX: &str = include_str!("../page/index.html");

const SCRIPT: &str = "text/javascript; charset=utf-8";
const ICON: &str = "image/svg+xml";
const STYLE: &str = "text/css; charset=utf-8";

/// Name, media type and text of every other file. They are all directly under `/page/`.
const FILES: &[(&str, &str, &str)] = &[
    ("page.css", STYLE, include_str!("../page/page.css")),
    ("icon.svg", ICON, include_str!("../page/icon.svg")),
    ("api.js", SCRIPT, include_str!("../page/api.js")),
    ("changes.js", SCRIPT, include_str!("../page/changes.js")),
    ("editing.js", SCRIPT, include_str!("../page/editing.js")),
    ("elements.js", SCRIPT, include_str!("../page/elements.js")),
    ("export.js", SCRIPT, include_str!("../page/export.js")),
    ("folder.js", SCRIPT, include_str!("../page/folder.js")),
    ("geometry.js", SCRIPT, include_str!("../page/geometry.js")),
    ("gestures.js", SCRIPT, include_str!("../page/gestures.js")),
    ("helps.js", SCRIPT, include_str!("../page/helps.js")),
    ("keyboard.js", SCRIPT, include_str!("../page/keyboard.js")),
    ("live.js", SCRIPT, include_str!("../page/live.js")),
    ("main.js", SCRIPT, include_str!("../page/main.js")),
    ("mark_panel.js", SCRIPT, include_str!("../page/mark_panel.js")),
    ("narrow.js", SCRIPT, include_str!("../page/narrow.js")),
    ("overlay.js", SCRIPT, include_str!("../page/overlay.js")),
    ("part_settings.js", SCRIPT, include_str!("../page/part_settings.js")),
    ("region.js", SCRIPT, include_str!("../page/region.js")),
    ("server_end.js", SCRIPT, include_str!("../page/server_end.js")),
    ("samples.js", SCRIPT, include_str!("../page/samples.js")),
    ("store.js", SCRIPT, include_str!("../page/store.js")),
    ("start.js", SCRIPT, include_str!("../page/start.js")),
    ("symmetry.js", SCRIPT, include_str!("../page/symmetry.js")),
    ("strip.js", SCRIPT, include_str!("../page/strip.js")),
    ("tabs.js", SCRIPT, include_str!("../page/tabs.js")),
    ("teach.js", SCRIPT, include_str!("../page/teach.js")),
    ("toast.js", SCRIPT, include_str!("../page/toast.js")),
    ("try.js", SCRIPT, include_str!("../page/try.js")),
    ("versions.js", SCRIPT, include_str!("../page/versions.js")),
    ("view.js", SCRIPT, include_str!("../page/view.js")),
    ("words.js", SCRIPT, include_str!("../page/words.js")),
];

/// The page's HTML document, as sent.
pub fn index() -> String {
    lean(INDEX)
}

/// The text of a file, as sent, with its media type.
pub fn file(name: &str) -> Option<(&'static str, String)> {
    let &(_, media_type, text) = FILES.iter().find(|(known, ..)| *known == name)?;
    let text = lean(text);
    let sent = match media_type {
        STYLE => without_spaces(&text),
        SCRIPT => text.split_inclusive('\n').map(without_spaces_of_code).collect(),
        _ => text,
    };
    Some((media_type, sent))
}

/// A line of JavaScript without the spaces around signs. A line with a string, a regular expression or a comment is left
/// as it is.
fn without_spaces_of_code(line: &str) -> String {
    if line.contains(['"', '\'', '`', '/']) {
        return line.to_owned();
    }
    // Not + and -, which would become ++ and --.
    let signs = ["=>", "===", "!==", ">=", "<=", "&&", "||", "??", "?", ":", "=", "<", ">", "*", "{", "}", ","];
    signs.iter().fold(line.to_owned(), |code, sign| {
        [format!(" {sign} "), format!(" {sign}"), format!("{sign} ")]
            .iter()
            .fold(code, |code, spaced| code.replace(spaced.as_str(), sign))
    })
}

/// CSS without the spaces and line ends that it does not need; strings of the page's CSS contain none of these.
fn without_spaces(css: &str) -> String {
    let mut css = css.replace("; }", "}").replace(" { ", "{").replace("; ", ";").replace(": ", ":");
    for end in ["{", "}", ";", ","] {
        css = css.replace(&format!("{end}\n"), end);
    }
    css
}

/// A file without indentation and comment lines.
fn lean(text: &str) -> String {
    let mut lean = String::with_capacity(text.len());
    let mut is_comment = false;
    for line in text.lines() {
        let line = line.trim_start();
        let begins = ["/*", "<!--"].iter().any(|begin| line.starts_with(begin));
        let ends = ["*/", "-->"].iter().any(|end| line.trim_end().ends_with(end));
        if !(is_comment || begins || line.starts_with("//")) {
            lean.push_str(line);
        }
        is_comment = (is_comment || begins) && !ends;
        lean.push('\n');
    }
    lean
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The limit of issue 47: the page is smaller than 190 KB.
    const MAX_BYTES: usize = 190_000;

    #[test]
    fn the_page_is_small() {
        let bytes = index().len() + FILES.iter().map(|(name, ..)| file(name).unwrap().1.len()).sum::<usize>();
        assert!(bytes < MAX_BYTES, "{bytes} bytes");
    }

    #[test]
    fn what_is_sent_has_all_lines_but_comments() {
        let text = "// About.\n  /** Two\n   * lines. */\nconst a = 1; // kept\n    b(`//`);\n<!-- no -->\n";
        assert_eq!(lean(text), "\n\n\nconst a = 1; // kept\nb(`//`);\n\n");
        assert_eq!(without_spaces("a,\nb c { d: e; f: g; }\n"), "a,b c{d:e;f:g}");
        let code = "if (a === b && c >= 1) { x += y ? -1 : d + +e; } else return { f, g: [...h] };\n";
        let shorter = "if (a===b&&c>=1){x +=y?-1:d + +e;}else return{f,g:[...h]};\n";
        assert_eq!(without_spaces_of_code(code), shorter);
        assert_eq!(without_spaces_of_code("const a = \"b = c\";"), "const a = \"b = c\";");
        for text in FILES.iter().map(|&(.., text)| text).chain([INDEX]) {
            assert_eq!(lean(text).lines().count(), text.lines().count());
            // A template literal over several lines, or code after the end of a comment, would be changed.
            for line in text.lines() {
                assert!(line.matches('`').count() % 2 == 0, "a template over several lines: {line}");
                let after = line.split_once("*/").map_or("", |(_, after)| after);
                assert!(
                    after.trim().is_empty() || !line.trim_start().starts_with("/*"),
                    "code after a comment: {line}"
                );
            }
        }
    }

    /// The values of all properties in the page's CSS whose name begins with `property`.
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

    /// Reports use the same style as the page.
    const REPORT_CSS: &str = include_str!("../../report/src/page.css");

    #[test]
    fn reports_have_the_page_s_colours_types_and_spaces() {
        const SHARED: [&str; 13] = [
            "paper",
            "raised",
            "ink",
            "soft",
            "rule",
            "accent",
            "good",
            "good-wash",
            "bad",
            "bad-wash",
            "warning",
            "warning-wash",
            "wash",
        ];
        let css = FILES.iter().find(|(name, ..)| *name == "page.css").unwrap().2;
        let value = |css: &'static str, name: &str| {
            let (_, rest) = css.split_once(&format!("--{name}:")).unwrap_or_else(|| panic!("--{name}"));
            rest.split([';', '}']).next().unwrap().trim().replace(", ", ",")
        };
        let (light, dark) = REPORT_CSS.split_once("prefers-color-scheme:dark").unwrap();
        let whole = |color: String| match color.as_str() {
            "#fff" => "#ffffff".to_owned(),
            _ => color,
        };
        for name in SHARED {
            let of_report = format!("light-dark({},{})", whole(value(light, name)), whole(value(dark, name)));
            assert_eq!(value(css, name), of_report, "--{name}");
        }
        for name in ["sans", "mono"] {
            assert_eq!(value(css, name), value(light, name), "--{name}");
        }
        // Documents also have larger headings and wider margins.
        const SIZES: [&str; 6] = [".8125rem", ".9375rem", "1.0625rem", "1.25rem", "13px", "14px"];
        const SPACES_PX: [i32; 8] = [2, 4, 8, 12, 16, 24, 40, 64];
        let on_screen = REPORT_CSS.split("@page").next().unwrap();
        for declaration in on_screen.split(['{', '}', ';', '\n']) {
            let Some((name, value)) = declaration.split_once(':') else { continue };
            if name == "font-size" {
                assert!(SIZES.contains(&value) || value.starts_with("clamp("), "font-size: {value}");
            }
            if ["gap", "padding", "margin"].iter().any(|kind| name.starts_with(kind) || name.ends_with("-gap")) {
                for px in value.split(' ').filter_map(|word| word.strip_suffix("px")) {
                    let px: i32 = px.parse().unwrap();
                    assert!(SPACES_PX.contains(&px.abs()), "a space of {px} px: {declaration}");
                }
            }
        }
    }

    #[test]
    fn every_file_that_the_page_asks_for_is_there_and_none_beside() {
        let texts = || FILES.iter().map(|&(.., text)| text).chain([INDEX]);
        for (name, ..) in FILES {
            let (imported, linked) = (format!("\"./{name}\""), format!("\"/page/{name}\""));
            assert!(texts().any(|text| text.contains(&imported) || text.contains(&linked)), "no file uses {name}");
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

//! The page's own files: built in, and served from a folder while they are worked on.

use crate::report::page;

/// A file of the page.
pub(super) struct Asset {
    /// Its media type, for the header `Content-Type`.
    pub(super) kind: &'static str,
    pub(super) text: String,
}

const JAVASCRIPT: &str = "text/javascript; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";

/// Name, media type, text.
const FILES: [(&str, &str, &str); 13] = [
    (
        "",
        "text/html; charset=utf-8",
        include_str!("web/index.html"),
    ),
    ("icon.svg", "image/svg+xml", include_str!("web/icon.svg")),
    ("lab.css", CSS, include_str!("web/lab.css")),
    ("lab.js", JAVASCRIPT, include_str!("web/lab.js")),
    ("talk.js", JAVASCRIPT, include_str!("web/talk.js")),
    ("stage.js", JAVASCRIPT, include_str!("web/stage.js")),
    ("rail.js", JAVASCRIPT, include_str!("web/rail.js")),
    ("models.js", JAVASCRIPT, include_str!("web/models.js")),
    ("draft.js", JAVASCRIPT, include_str!("web/draft.js")),
    ("long.js", JAVASCRIPT, include_str!("web/long.js")),
    ("history.js", JAVASCRIPT, include_str!("web/history.js")),
    ("live.js", JAVASCRIPT, include_str!("web/live.js")),
    (
        "live-plots.js",
        JAVASCRIPT,
        include_str!("web/live-plots.js"),
    ),
];

/// A file by its name; the page itself has none.
pub(super) fn asset(name: &str) -> Option<Asset> {
    match name {
        "report.js" => {
            return Some(Asset {
                kind: JAVASCRIPT,
                text: page::scripts(),
            });
        }
        "report.css" => {
            return Some(Asset {
                kind: CSS,
                text: page::styles(),
            });
        }
        _ => {}
    }
    let (name, kind, text) = FILES.iter().find(|(n, ..)| *n == name)?;
    Some(Asset {
        kind,
        text: changed(name).unwrap_or_else(|| (*text).into()),
    })
}

/// The file as it lies in the folder that JOINTWATCH_LAB_FILES names: for work on the page, in
/// debug builds.
#[cfg(debug_assertions)]
fn changed(name: &str) -> Option<String> {
    let folder = std::env::var_os("JOINTWATCH_LAB_FILES")?;
    let name = if name.is_empty() { "index.html" } else { name };
    std::fs::read_to_string(std::path::Path::new(&folder).join(name)).ok()
}

#[cfg(not(debug_assertions))]
fn changed(_: &str) -> Option<String> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_says_its_subject_and_makes_no_markup_from_text() {
        for (name, kind, text) in FILES {
            assert!(text.len() < 40_000 && text.lines().count() <= 500, "{name}");
            if kind == JAVASCRIPT {
                assert!(
                    text.starts_with("// "),
                    "{name}: a first line says the subject"
                );
                assert!(
                    !text.contains("innerHTML") && !text.contains("eval("),
                    "{name}"
                );
            }
        }
        assert!(asset("report.js").is_some() && asset("../mod.rs").is_none());
    }

    #[test]
    fn the_page_asks_for_nothing_that_is_not_served() {
        let page = asset("").unwrap().text;
        let named = page.split(['"', '\'']).filter(|w| w.starts_with("lab/"));
        let mut seen = 0;
        for name in named {
            assert!(asset(&name[4..]).is_some(), "{name}");
            seen += 1;
        }
        assert!(seen >= 5, "{seen}");
    }
}

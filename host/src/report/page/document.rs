//! The page as one HTML file: styles, scripts and data in it, and a policy that lets nothing else
//! in or out.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest, Sha256};

/// Style sheets, uPlot's before the page's own.
const STYLES: [&str; 2] = [
    include_str!("web/uplot/uPlot.min.css"),
    include_str!("web/style.css"),
];

/// Scripts in the order in which they need each other; they draw nothing until told to.
const SCRIPTS: [&str; 15] = [
    include_str!("web/uplot/uPlot.iife.min.js"),
    include_str!("web/elements.js"),
    include_str!("web/quantities.js"),
    include_str!("web/state.js"),
    include_str!("web/canvas.js"),
    include_str!("web/summary.js"),
    include_str!("web/model.js"),
    include_str!("web/time.js"),
    include_str!("web/loops.js"),
    include_str!("web/plane.js"),
    include_str!("web/residual.js"),
    include_str!("web/candidates.js"),
    include_str!("web/response.js"),
    include_str!("web/handling.js"),
    include_str!("web/page.js"),
];

/// What draws the page of a file.
const START: &str = include_str!("web/start.js");

/// uPlot's licence, which goes where uPlot goes.
const LICENCE: &str = include_str!("web/uplot/LICENSE");

/// All styles of the page.
pub(crate) fn styles() -> String {
    STYLES.join("\n")
}

/// All scripts of the page but the one that draws the file.
pub(crate) fn scripts() -> String {
    format!("\"use strict\";\n{}", SCRIPTS.join("\n"))
}

/// The page: its title, its answer in a sentence, and [`super::Contents`] as JSON.
pub(crate) fn document(title: &str, answer: &str, data: &str) -> String {
    let style = styles();
    let script = format!("{}\n{START}", scripts());
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src '{}'; style-src '{}'; \
         base-uri 'none'; form-action 'none'\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{} – Jointwatch report</title>\n<style>{style}</style>\n</head>\n<body>\n\
         <noscript><p>{}</p><p>The plots of this report are drawn by scripts in this file, which this browser does not run.\
         </p></noscript>\n<main id=\"page\"></main>\n\
         <script id=\"contents\" type=\"application/json\">{}</script>\n<!-- The file holds uPlot.\n{LICENCE}-->\n\
         <script>{script}</script>\n</body>\n</html>\n",
        hash(&script),
        hash(&style),
        escaped(title),
        escaped(answer),
        inert(data),
    )
}

/// A source of the policy: exactly this text may run or style.
fn hash(text: &str) -> String {
    format!("sha256-{}", STANDARD.encode(Sha256::digest(text)))
}

/// Text as it may stand between tags.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// JSON that can end no element: `<`, `>` and `&` as escapes.
fn inert(json: &str) -> String {
    json.replace('<', "\\u003c")
        .replace('>', "\\u003e")
        .replace('&', "\\u0026")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_built_in_is_small_and_plain() {
        let size: usize = STYLES.iter().chain(&SCRIPTS).map(|s| s.len()).sum();
        println!("{size} bytes of styles and scripts");
        assert!(size <= 150_000, "{size}");
        for script in SCRIPTS[1..].iter().chain([&START]) {
            assert!(script.starts_with("// "), "a first line says the subject");
            assert!(!script.contains("innerHTML") && !script.contains("</"));
        }
        assert!(LICENCE.contains("Permission is hereby granted") && !LICENCE.contains("--"));
    }

    #[test]
    fn names_from_files_stay_names() {
        let hostile = "</script><script>alert(1)</script>&\"";
        assert!(!inert(hostile).contains('<'));
        assert_eq!(
            escaped(hostile),
            "&lt;/script&gt;&lt;script&gt;alert(1)&lt;/script&gt;&amp;&quot;"
        );
        let json = serde_json::to_string(hostile).unwrap();
        let back: String = serde_json::from_str(&inert(&json)).unwrap();
        assert_eq!(back, hostile);
    }
}

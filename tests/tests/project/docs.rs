//! The book in docs/, README and CHANGELOG: links that resolve, sentences that end, a length that
//! somebody reads, the field's words.

use jointwatch_tests::program::workspace;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// No sentence outside the lab notebook has more words.
const MAX_SENTENCE: usize = 40;
/// README and the book without the lab notebook have no more words.
const MAX_WORDS: usize = 25_000;
/// Phrases that a handbook's index does not have, with what to write instead where it is not plain.
const BANNED: [(&str, &str); 24] = [
    ("nobody has its equation", "no data sheet gives the force"),
    ("tells the whole story", "runs a demo"),
    (
        "cannot support the model draw a warning",
        "it warns, with figures",
    ),
    ("not learnt from", "validation records"),
    ("drowns in", "is below its noise floor"),
    ("stand in a wrong valley", "be in a local minimum"),
    ("line of the mains", "mains hum"),
    ("lines of the mains", "mains hum"),
    (
        "are taken out as they were",
        "is subtracted with its last amplitude and phase",
    ),
    ("two looks at", "two reads of"),
    ("with a point", "no f64 arithmetic"),
    ("what a sample takes", "instructions per sample"),
    ("what moves, what rests", "state, remainder"),
    ("spoilt", "invalidated"),
    ("its pointer", "its phasor"),
    ("the same moment", "the same instant"),
    ("courses", "time histories"),
    ("stands beside the model", "is a nuisance regressor"),
    ("swings in time", "varies in time"),
    ("swings 16.7 times", "varies at 16.7 Hz"),
    ("that was brought", "the input"),
    ("do not order a new motor", "say what the figure means"),
    ("gets there", "decides"),
    ("by and large", "approximately"),
];

fn markdown_below(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            markdown_below(&path, found);
        } else if path.extension().is_some_and(|e| e == "md") {
            found.push(path);
        }
    }
}

/// README, CHANGELOG and every page of the book, each with its text.
fn pages() -> Vec<(PathBuf, String)> {
    let mut paths = vec![
        workspace().join("README.md"),
        workspace().join("CHANGELOG.md"),
    ];
    markdown_below(&workspace().join("docs"), &mut paths);
    paths.sort();
    let read = |path: PathBuf| {
        let text = fs::read_to_string(&path).unwrap();
        (path, text)
    };
    paths.into_iter().map(read).collect()
}

fn in_notebook(path: &Path) -> bool {
    path.starts_with(workspace().join("docs/notebook"))
}

/// A page without its fenced code.
fn without_code(text: &str) -> String {
    let mut inside = false;
    let mut kept = String::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            inside = !inside;
            kept.push('\n');
        } else if !inside {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    kept
}

/// Tokens that hold a letter; a span of code is one word.
fn words(text: &str) -> usize {
    let mut plain = String::new();
    for (number, part) in text.split('`').enumerate() {
        plain.push_str(if number % 2 == 1 { " code " } else { part });
    }
    let tokens = plain.split_whitespace();
    tokens
        .filter(|token| token.chars().any(char::is_alphabetic))
        .count()
}

/// Paragraphs, list items, headings and table cells, each as one line.
fn passages(text: &str) -> Vec<String> {
    let mut passages = vec![String::new()];
    for line in without_code(text).lines() {
        let line = line.trim();
        let number = line.split_once(". ").map_or("", |(number, _)| number);
        let item = line.starts_with("- ")
            || line.starts_with("* ")
            || (!number.is_empty() && number.chars().all(|c| c.is_ascii_digit()));
        if let Some(row) = line.strip_prefix('|') {
            passages.extend(row.split('|').map(str::to_owned));
            passages.push(String::new());
        } else if line.is_empty() || line.starts_with('#') || item {
            passages.push(format!("{line} "));
        } else {
            let last = passages.last_mut().unwrap();
            last.push_str(line);
            last.push(' ');
        }
    }
    passages
}

/// Sentences with more words than allowed.
fn long_sentences(text: &str) -> Vec<String> {
    let mut long = Vec::new();
    for passage in passages(text) {
        let mut sentence = String::new();
        let mut rest = passage.chars().peekable();
        while let Some(c) = rest.next() {
            sentence.push(c);
            let ends = matches!(c, '.' | '?' | '!' | ':' | ';')
                && rest.peek().is_none_or(|next| next.is_whitespace());
            // A colon or semicolon joins two thoughts; only what ends a sentence ends it here.
            if ends && matches!(c, '.' | '?' | '!') || rest.peek().is_none() {
                if words(&sentence) > MAX_SENTENCE {
                    long.push(sentence.trim().to_owned());
                }
                sentence.clear();
            }
        }
    }
    long
}

/// The targets of the links and pictures of a page that are not addresses of the web.
fn links(text: &str) -> Vec<String> {
    let text = without_code(text);
    let targets = text.match_indices("](").map(|(at, mark)| {
        let rest = &text[at + mark.len()..];
        rest[..rest.find(')').unwrap_or(rest.len())].to_owned()
    });
    targets.filter(|t| !t.contains("://")).collect()
}

/// What a heading is called in a link: lower case, blanks as hyphens, nothing but letters, digits,
/// hyphens and underscores.
fn anchor(heading: &str) -> String {
    let text = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = text.chars().filter_map(|c| match c {
        ' ' => Some('-'),
        c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c),
        _ => None,
    });
    kept.collect()
}

/// The path with its `..` resolved.
fn normal(path: &Path) -> PathBuf {
    let mut normal = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                normal.pop();
            }
            part => normal.push(part),
        }
    }
    normal
}

/// Why a link of a page does not resolve; none when it does.
fn broken(page: &Path, text: &str, target: &str) -> Option<String> {
    let (file, fragment) = target.split_once('#').unwrap_or((target, ""));
    let path = if file.is_empty() {
        page.to_path_buf()
    } else {
        normal(&page.parent().unwrap().join(file))
    };
    if !path.exists() {
        return Some(format!("{target}: there is no {}", path.display()));
    }
    // The book holds the pages and pictures of its folder alone.
    let book = workspace().join("docs");
    if page.starts_with(&book) && !path.starts_with(&book) {
        return Some(format!(
            "{target}: leads out of the book; name the file as code"
        ));
    }
    if fragment.is_empty() {
        return None;
    }
    let linked = if file.is_empty() {
        text.to_owned()
    } else {
        fs::read_to_string(&path).unwrap_or_default()
    };
    let headings = without_code(&linked);
    let mut headings = headings.lines().filter(|line| line.starts_with('#'));
    let found = headings.any(|heading| anchor(heading) == fragment);
    (!found).then(|| format!("{target}: no heading with this name"))
}

/// All complaints of all pages as one text.
fn complaints(of: impl Fn(&Path, &str) -> Vec<String>) -> String {
    let mut all = String::new();
    for (path, text) in pages() {
        for complaint in of(&path, &text) {
            let name = path.strip_prefix(workspace()).unwrap().display();
            all.push_str(&format!("{name}: {complaint}\n"));
        }
    }
    all
}

#[test]
fn every_link_resolves() {
    let all = complaints(|path, text| {
        let all = links(text).into_iter();
        all.filter_map(|target| broken(path, text, &target))
            .collect()
    });
    assert!(all.is_empty(), "{all}");
}

#[test]
fn every_page_is_in_the_summary_once() {
    let docs = workspace().join("docs");
    let summary = fs::read_to_string(docs.join("SUMMARY.md")).unwrap();
    let listed = links(&summary);
    let set: BTreeSet<PathBuf> = listed.iter().map(|l| docs.join(l)).collect();
    assert_eq!(set.len(), listed.len(), "a page is listed twice");
    let mut there = Vec::new();
    markdown_below(&docs, &mut there);
    let there: BTreeSet<PathBuf> = there
        .into_iter()
        .filter(|p| *p != docs.join("SUMMARY.md"))
        .collect();
    assert_eq!(set, there);
}

#[test]
fn no_sentence_is_too_long() {
    let all = complaints(|path, text| {
        if in_notebook(path) {
            return Vec::new();
        }
        long_sentences(text)
    });
    assert!(all.is_empty(), "more than {MAX_SENTENCE} words:\n{all}");
}

#[test]
fn the_book_is_short_enough_to_be_read() {
    let mut total = 0;
    for (path, text) in pages() {
        if in_notebook(&path) || path.ends_with("CHANGELOG.md") {
            continue;
        }
        let count = words(&without_code(&text));
        println!("{count:6} {}", path.display());
        total += count;
    }
    println!("{total:6} in all");
    assert!(total <= MAX_WORDS, "{total} words, at most {MAX_WORDS}");
}

#[test]
fn the_words_are_those_of_the_field() {
    let all = complaints(|_, text| {
        let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
        let text = text.to_lowercase();
        let found = BANNED.iter().filter(|(banned, _)| text.contains(banned));
        found
            .map(|(banned, instead)| format!("{banned:?}: write {instead:?}"))
            .collect()
    });
    assert!(all.is_empty(), "{all}");
}

#[test]
fn the_checks_see_what_they_are_for() {
    let long = vec!["word"; MAX_SENTENCE + 1].join(" ");
    assert_eq!(long_sentences(&format!("Short. {long}. Short.")).len(), 1);
    assert_eq!(long_sentences(&format!("- {long}\n- {long}")).len(), 2);
    let wrapped = long.replacen(' ', "\n", 20);
    assert_eq!(long_sentences(&wrapped).len(), 1);
    assert!(long_sentences(&format!("```\n{long}\n```")).is_empty());
    let short = vec!["word"; MAX_SENTENCE].join(" ");
    assert!(long_sentences(&format!("{short}. {short}.")).is_empty());

    assert_eq!(words("two `a b c` | 12 |"), 2);
    let page = workspace().join("docs/index.md");
    let text = "# A heading, with `code`\n[a](index.md) [b](#a-heading-with-code)";
    let of = |target: &str| broken(&page, text, target);
    assert_eq!(links(text).len(), 2);
    assert!(links(text).iter().all(|target| of(target).is_none()));
    assert!(of("nowhere.md").is_some() && of("#nothing").is_some());
    assert!(of("reference/study.md#nothing").is_some());
    assert!(of("../README.md").is_some());
}

#[test]
fn files_and_constants_that_pages_name_exist() {
    let root = workspace();
    let folders = [
        "host/",
        "shared/",
        "firmware/",
        "tests/",
        "docs/",
        ".cargo/",
    ];
    let mut sources = String::new();
    for folder in ["host", "shared", "firmware", "tests", ".cargo"] {
        gather_sources(&root.join(folder), &mut sources);
    }
    let is_missing = |span: &&str| {
        let path = folders.iter().any(|folder| span.starts_with(folder))
            && !span.contains(|c: char| c.is_whitespace() || "<>*{…".contains(c));
        let of_constants = |c: char| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_';
        let constant = span.contains('_') && span.chars().all(of_constants);
        (path && !root.join(span).exists()) || (constant && !sources.contains(*span))
    };
    let all = complaints(|_, text| {
        let text = without_code(text);
        let spans = text.split('`').skip(1).step_by(2);
        let missing = spans.filter(is_missing);
        missing.map(|span| format!("`{span}` is nowhere")).collect()
    });
    assert!(all.is_empty(), "{all}");
}

/// Every source file under a folder, one after the other.
fn gather_sources(folder: &Path, into: &mut String) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() && name != "target" && name != "node_modules" {
            gather_sources(&path, into);
        } else if [".rs", ".toml", ".py", ".x", ".h", ".sh"]
            .iter()
            .any(|end| name.ends_with(end))
        {
            into.push_str(&fs::read_to_string(&path).unwrap());
        }
    }
}

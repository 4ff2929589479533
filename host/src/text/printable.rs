//! Text that a terminal takes for text: what a file or a line holds is shown, and never obeyed.

use std::fmt::Write;

/// Characters of one message; what a hostile file makes longer is cut out of its middle.
const LONGEST: usize = 4000;

/// Whether a character does something to a terminal, or to the order in which the others are shown.
fn is_command(c: char) -> bool {
    c.is_control() && !matches!(c, '\n' | '\t')
        || matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// The text with escapes for such characters.
pub(crate) fn escaped(text: &str) -> String {
    let mut all = String::with_capacity(text.len());
    for c in text.chars() {
        if is_command(c) {
            let _ = write!(all, "{}", c.escape_unicode());
        } else {
            all.push(c);
        }
    }
    all
}

/// The same of what is one line.
pub(crate) fn line(text: &str) -> String {
    escaped(text).replace(['\n', '\t'], " ")
}

/// The same of a message, of which no more is left than a person reads.
pub(crate) fn message(text: &str) -> String {
    let length = text.chars().count();
    if length <= LONGEST {
        return escaped(text);
    }
    let (head, tail) = (LONGEST * 3 / 4, LONGEST / 4);
    let begin: String = text.chars().take(head).collect();
    let end: String = text.chars().skip(length - tail).collect();
    let left_out = length - head - tail;
    escaped(&format!("{begin} [{left_out} characters left out] {end}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_shown_and_long_messages_are_cut() {
        assert_eq!(escaped("r\u{e4}d, \u{b5}m\n\t3"), "r\u{e4}d, \u{b5}m\n\t3");
        assert_eq!(
            escaped("\u{1b}[2Jx\r\u{202e}"),
            "\\u{1b}[2Jx\\u{d}\\u{202e}"
        );
        assert_eq!(line("a\nb\tc\r"), "a b c\\u{d}");
        let long = "0,".repeat(1_000_000);
        let short = message(&long);
        assert!(short.chars().count() < LONGEST + 60, "{}", short.len());
        assert!(short.contains("characters left out") && short.starts_with("0,"));
        assert_eq!(message("as it is"), "as it is");
    }
}

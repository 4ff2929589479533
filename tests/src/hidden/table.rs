//! The table that a campaign prints: a line per hidden effect, sums, and the cases that went wrong.

use super::catalogue::SUBJECTS;
use super::judge::{Expected, Judgement};
use jointwatch::paper::Spread;
use std::fmt::Write as _;

/// Something that holds of a judgement or not.
type Question = fn(&Judgement) -> bool;

/// The middle of the numbers that are finite; nothing of none.
fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    Spread::of(values.filter(|v| v.is_finite())).map(|spread| spread.median)
}

fn count(of: &[&Judgement], what: impl Fn(&Judgement) -> bool) -> usize {
    of.iter().filter(|j| what(j)).count()
}

/// A share in percent, or a dash where there is nothing to share.
fn percent(part: usize, whole: usize) -> String {
    if whole == 0 {
        "–".into()
    } else {
        format!("{:.1} %", 100.0 * part as f64 / whole as f64)
    }
}

fn number(value: Option<f64>) -> String {
    value.map_or("–".into(), |v| format!("{v:.2}"))
}

fn line(name: &str, of: &[&Judgement]) -> String {
    let seconds = of.iter().map(|j| j.identify_s + j.diagnose_s).sum::<f64>() / of.len() as f64;
    format!(
        "| {name} | {} | {} | {} | {} | {} | {} | {} | {} | {seconds:.1} |",
        of.len(),
        count(of, |j| j.right),
        count(of, |j| j.right_or_equivalent),
        count(of, |j| j.in_first_two),
        count(of, |j| j.in_first_two_or_equivalent),
        count(of, |j| j.unknown),
        number(median(of.iter().filter_map(|j| j.error_drop))),
        number(median(of.iter().filter_map(|j| j.error_over_floor))),
    )
}

/// What was said with which probability, and how often it was so.
fn calibration(of: &[&Judgement]) -> String {
    let single = of.iter().flat_map(|j| j.stated.clone()).collect();
    let groups = of.iter().filter_map(|j| j.of_group).collect();
    calibrated("stated probabilities", single)
        + &calibrated("the same of groups that cannot be told apart", groups)
}

fn calibrated(of_what: &str, stated: Vec<(f64, bool)>) -> String {
    let mut text = format!("{of_what}:");
    let mut off = 0.0;
    for [low, high] in [[0.01, 0.1], [0.1, 0.5], [0.5, 0.9], [0.9, 1.01]] {
        let inside = stated.iter().filter(|(p, _)| (low..high).contains(p));
        let (count, said, held) = inside.fold((0, 0.0, 0), |(n, p, h), (chance, is)| {
            (n + 1, p + chance, h + usize::from(*is))
        });
        off += (said - held as f64).abs();
        let mean = percent_of(said, count);
        let _ = write!(
            text,
            " {count} of {mean} on average, {} so;",
            percent(held, count)
        );
    }
    let _ = writeln!(text, " error {}", percent_of(off, stated.len()));
    text
}

fn percent_of(sum: f64, count: usize) -> String {
    if count == 0 {
        "–".into()
    } else {
        format!("{:.1} %", 100.0 * sum / count as f64)
    }
}

/// The table in Markdown, the sums below it, and the failures; cases in the order of their numbers.
pub fn report(judged: &[(usize, Judgement)], seed: u64) -> String {
    let mut text = String::from(
        "| hidden | cases | first | or equivalent | in first two | or equivalent | unknown | error drop | after/floor | s/case |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
    );
    let all: Vec<&Judgement> = judged.iter().map(|(_, j)| j).collect();
    let mut names: Vec<&str> = all.iter().map(|j| j.subject.as_str()).collect();
    let place = |name: &str| SUBJECTS.iter().position(|s| s.name == name);
    names.sort_by_key(|name| (*name != "none", place(name), *name));
    names.dedup();
    let pairs = names.iter().any(|n| n.contains(" + "));
    if pairs {
        let _ = writeln!(text, "{}", line("two effects", &all));
    } else {
        for name in names {
            let of: Vec<&Judgement> = all.iter().filter(|j| j.subject == name).copied().collect();
            let _ = writeln!(text, "{}", line(name, &of));
        }
    }
    let of = |expected: Expected| -> Vec<&Judgement> {
        let kind = |j: &&&Judgement| j.expected == Some(expected);
        all.iter().filter(kind).copied().collect()
    };
    let (healthy, outside, known) = (
        of(Expected::Nothing),
        of(Expected::Unknown),
        of(Expected::Effect),
    );
    let sums: [(&str, &[&Judgement], Question); 10] = [
        ("known effects, right first", &known, |j| j.right),
        ("known effects, right or equivalent first", &known, |j| {
            j.right_or_equivalent
        }),
        (
            "known effects, right or told as not to be told apart",
            &known,
            |j| j.in_told_group,
        ),
        ("known effects, right in the first two", &known, |j| {
            j.in_first_two
        }),
        (
            "known effects, right or equivalent in the first two",
            &known,
            |j| j.in_first_two_or_equivalent,
        ),
        ("known effects called unknown", &known, |j| j.unknown),
        ("known effects not noticed", &known, |j| {
            !j.unknown && !j.effect
        }),
        ("healthy joints, false alarms", &healthy, |j| !j.right),
        ("outsiders called unknown", &outside, |j| j.unknown),
        ("outsiders given a known name", &outside, |j| j.effect),
    ];
    let _ = writeln!(text);
    for (name, of, what) in sums {
        let n = count(of, what);
        let _ = writeln!(
            text,
            "{name}: {n} of {} ({})",
            of.len(),
            percent(n, of.len())
        );
    }
    let _ = write!(text, "{}", calibration(&all));
    let after = median(known.iter().filter_map(|j| j.error_over_floor));
    let _ = writeln!(
        text,
        "error after adding over noise floor, median of known effects: {}",
        number(after)
    );
    let slowest = all.iter().map(|j| j.diagnose_s).fold(0.0, f64::max);
    let typical = median(all.iter().map(|j| j.diagnose_s));
    let _ = writeln!(
        text,
        "diagnose on one thread: median {} s, slowest {slowest:.1} s",
        number(typical)
    );
    let wrong: Vec<_> = judged.iter().filter(|(_, j)| !j.right).collect();
    if !wrong.is_empty() {
        let _ = writeln!(
            text,
            "\nNot right ({}; again with --seed {seed} --case K and the same other options):",
            wrong.len()
        );
    }
    for (case, j) in wrong {
        let mark = if j.right_or_equivalent {
            " (equivalent)"
        } else if j.in_told_group {
            " (told as alike)"
        } else if j.in_first_two {
            " (second)"
        } else {
            ""
        };
        let _ = writeln!(text, "  case {case}: {}: {}{mark}", j.case, j.said);
    }
    text
}

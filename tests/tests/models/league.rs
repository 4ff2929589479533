//! The table of docs/notebook/league.md is the one that the program gives, to a percent.

use jointwatch_tests::program::workspace;
use jointwatch_tests::public::league::{
    Figure, MARKS, emps, hysteretic, silverbox, table, with_table,
};
use std::fs;

/// The cells of the page's row about a figure.
fn row(what: &str) -> Vec<String> {
    let page = fs::read_to_string(workspace().join("docs/notebook/league.md")).unwrap();
    let found = page
        .lines()
        .find(|line| line.starts_with(&format!("| {what} |")));
    let found = found.unwrap_or_else(|| panic!("the page has no row about {what}"));
    let cells = found.trim_matches('|').split('|');
    cells.map(|cell| cell.trim().to_owned()).collect()
}

fn agree(figures: &[Figure]) {
    for figure in figures {
        let stated = row(figure.what);
        println!("{}: stated {stated:?}, seen {figure:?}", figure.what);
        let seen = [Some(figure.equation), figure.simulation];
        for (stated, seen) in stated[4..6].iter().zip(seen) {
            match seen {
                None => assert_eq!(stated, "none"),
                Some(seen) if !seen.is_finite() => assert_eq!(stated, "diverges"),
                Some(seen) => {
                    let stated: f64 = stated.parse().unwrap();
                    assert!((stated - seen).abs() <= 0.01 * seen, "{}", figure.what);
                }
            }
        }
        assert_eq!(stated[6], figure.model);
    }
}

#[test]
fn the_positioning_axis_does_as_the_page_says() {
    agree(&emps(&|_| ()).unwrap());
}

#[test]
#[ignore = "takes minutes: `cargo test --release -p jointwatch-tests --test models league:: -- --ignored`"]
fn the_oscillator_does_as_the_page_says() {
    agree(&silverbox(&|_| ()).unwrap());
}

#[test]
#[ignore = "takes minutes: `cargo test --release -p jointwatch-tests --test models league:: -- --ignored`"]
fn the_hysteretic_oscillator_does_as_the_page_says() {
    agree(&hysteretic(&|_| ()).unwrap());
}

#[test]
fn a_table_replaces_only_what_stands_between_the_marks() {
    let page = format!("before\n{}\nold\n{}\nafter\n", MARKS[0], MARKS[1]);
    let new = with_table(&page, MARKS, &table(&[])).unwrap();
    assert!(new.starts_with("before\n") && new.ends_with("\nafter\n") && !new.contains("old"));
    assert!(with_table("no marks", MARKS, "").is_err());
}

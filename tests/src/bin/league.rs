//! The public league: official splits of nonlinearbenchmark.org beside published results.
//!
//! `cargo run --release -p jointwatch-tests --bin league` prints the table and writes it into
//! docs/notebook/league.md. Sets that are not there are skipped, and then the page stays as it is.

use jointwatch_tests::program::workspace;
use jointwatch_tests::public::league::{MARKS, emps, hysteretic, silverbox, table, with_table};
use std::fs;

fn main() -> Result<(), String> {
    let told = |what: &str| eprintln!("{what}");
    let sets = [emps(&told)?, silverbox(&told)?, hysteretic(&told)?];
    let complete = sets.iter().all(|figures| !figures.is_empty());
    let text = table(&sets.concat());
    println!("{text}");
    if !complete {
        eprintln!("docs/notebook/league.md stays as it is: a set is missing");
        return Ok(());
    }
    let path = workspace().join("docs/notebook/league.md");
    let page = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    fs::write(&path, with_table(&page, MARKS, &text)?)
        .map_err(|e| format!("{}: {e}", path.display()))
}

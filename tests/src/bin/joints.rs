//! Public measurements of real joints, diagnosed and completed.
//!
//! `cargo run --release -p jointwatch-tests --bin joints` prints the table and writes it into
//! docs/notebook/joints.md. Sets that are not there are skipped, and then the page stays as it is.

use jointwatch_tests::program::workspace;
use jointwatch_tests::public::joints::{COUNT, MARKS, outcomes, table};
use jointwatch_tests::public::league::with_table;
use std::fs;

fn main() -> Result<(), String> {
    let outcomes = outcomes(&|set| eprintln!("{set}"))?;
    let text = table(&outcomes);
    println!("{text}");
    if outcomes.len() < COUNT {
        eprintln!("docs/notebook/joints.md stays as it is: a set is missing");
        return Ok(());
    }
    let path = workspace().join("docs/notebook/joints.md");
    let page = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let page = with_table(&page, MARKS, &text)?;
    fs::write(&path, page).map_err(|e| format!("{}: {e}", path.display()))
}

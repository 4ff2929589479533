//! Puts faults into a copy of the device's crates, one after the other, and reports those that no
//! test notices.
//!
//! `cargo run --release -p jointwatch-tests --bin faults -- [--quick] [--only WORDS]`

use clap::Parser;
use jointwatch_tests::faults::{Copy, Outcome, list};
use std::process::ExitCode;
use std::time::Instant;

/// Puts the faults of tests/faults.toml into a copy of the device's crates and runs their fast
/// tests.
#[derive(Parser)]
#[command(max_term_width = 110)]
struct Asked {
    /// Only the few that tests/run tries.
    #[arg(long)]
    quick: bool,
    /// Only those whose name or file has these words.
    #[arg(long, value_name = "WORDS")]
    only: Option<String>,
}

fn main() -> Result<ExitCode, String> {
    let asked = Asked::parse();
    let copy = Copy::make()?;
    copy.passes_untouched()
        .map_err(|said| format!("the tests fail without any fault:\n{said}"))?;
    let (mut tried, mut unexplained) = (0, 0);
    for fault in list()? {
        let named = |words: &String| fault.name.contains(words) || fault.file.contains(words);
        let named = asked.only.as_ref().is_none_or(named);
        if !named || asked.quick && !fault.quick {
            continue;
        }
        let begun = Instant::now();
        let outcome = copy.attempt(&fault)?;
        tried += 1;
        let words = match (&outcome, &fault.equivalent) {
            (Outcome::Noticed, None) => "noticed".to_string(),
            (Outcome::Survived, Some(why)) => format!("equivalent: {why}"),
            (Outcome::Noticed, Some(_)) => "NOTICED, but listed as equivalent".to_string(),
            (Outcome::Survived, None) => "SURVIVED".to_string(),
            (Outcome::Stale(why), _) => format!("STALE: {why}"),
        };
        let as_wanted = matches!(
            (&outcome, &fault.equivalent),
            (Outcome::Noticed, None) | (Outcome::Survived, Some(_))
        );
        unexplained += u32::from(!as_wanted);
        println!(
            "{words}: {} ({:.0} s)",
            fault.name,
            begun.elapsed().as_secs_f64()
        );
    }
    println!("{tried} faults, {unexplained} unexplained");
    Ok(if unexplained == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

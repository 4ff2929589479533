//! How often `diagnose` names what was hidden in a joint, over many simulated studies.
//!
//! `cargo run --release -p jointwatch-tests --bin hidden_effects -- --cases N --seed S
//! [--tolerances] [--two]`; `--help` tells the rest.

use clap::Parser;
use clap::builder::PossibleValuesParser;
use jointwatch_tests::hidden::cases::{Case, Options};
use jointwatch_tests::hidden::catalogue::{BY_NAME, SUBJECTS, without_law};
use jointwatch_tests::hidden::judge::{Judgement, Truth, diagnose_folder};
use jointwatch_tests::hidden::machine::MachineCase;
use jointwatch_tests::hidden::{study, table};
use jointwatch_tests::program;
use rayon::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};

/// Hides an effect in simulated joints, diagnoses them from their files alone, and prints how often
/// it was named.
#[derive(Parser)]
#[command(max_term_width = 110)]
struct Asked {
    /// How many studies to draw.
    #[arg(long, value_name = "N", default_value_t = 100)]
    cases: usize,
    /// What they are drawn from: the same seed draws the same studies.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Instruments as they are: gains, zeros and inertias a little wrong, rounded contacts, 1/f
    /// noise.
    #[arg(long)]
    tolerances: bool,
    /// Hide two effects in each joint.
    #[arg(long)]
    two: bool,
    /// Joints in a testing machine: imposed motion, displacement and force alone, other rates,
    /// sizes and drives.
    #[arg(long, conflicts_with_all = ["tolerances", "two"])]
    machine: bool,
    /// Hide this one in every joint.
    #[arg(long, value_name = "EFFECT", value_parser = PossibleValuesParser::new(hideable()))]
    only: Option<String>,
    /// This case alone, whatever --cases says.
    #[arg(long, value_name = "K")]
    case: Option<usize>,
    /// Cases that are judged side by side; one per core when left out.
    #[arg(long, value_name = "T", default_value_t = 0, hide_default_value = true)]
    threads: usize,
    /// Keep the studies, their truth and what was found in this folder.
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
    /// Write the studies and do not diagnose them.
    #[arg(long, requires = "keep")]
    write_only: bool,
}

impl Asked {
    fn options(&self) -> Options {
        Options {
            seed: self.seed,
            tolerances: self.tolerances,
            two: self.two,
            only: self.only.clone(),
        }
    }

    fn numbers(&self) -> Vec<usize> {
        self.case
            .map_or_else(|| (0..self.cases).collect(), |case| vec![case])
    }
}

/// Names of what can be hidden.
fn hideable() -> Vec<&'static str> {
    let subjects = SUBJECTS.iter().chain(&BY_NAME);
    let subjects = subjects.map(|subject| subject.name);
    ["none", "outsiders"].into_iter().chain(subjects).collect()
}

/// Draws a case and writes it into a folder.
fn written(asked: &Asked, number: usize, folder: &Path) -> Result<Truth, String> {
    let in_words = |e: std::io::Error| format!("case {number} cannot be written: {e}");
    fs::create_dir_all(folder).map_err(in_words)?;
    if asked.machine {
        let drawn = MachineCase::draw(asked.seed, number, asked.only.as_deref())?;
        drawn.write(folder).map_err(in_words)?;
        return Ok(drawn.truth());
    }
    let drawn = Case::draw(&asked.options(), number)?;
    study::write(&drawn, folder).map_err(in_words)?;
    if asked.keep.is_some() {
        study::write_truth(&drawn, folder).map_err(in_words)?;
    }
    Ok(Truth::of(&drawn))
}

/// Draws, writes and judges one case.
fn case(asked: &Asked, number: usize, scratch: &Path) -> Result<Judgement, String> {
    let folder = asked
        .keep
        .as_deref()
        .unwrap_or(scratch)
        .join(format!("case-{number:04}"));
    let truth = written(asked, number, &folder)?;
    if asked.write_only {
        println!("case {number}: {}", truth.case);
        return Ok(Judgement::default());
    }
    let judgement = diagnose_folder(&truth, &folder);
    if asked.keep.is_none() {
        fs::remove_dir_all(&folder)
            .map_err(|e| format!("case {number} cannot be cleared away: {e}"))?;
    }
    let mark = if judgement.right { "right" } else { "NOT  " };
    println!(
        "{mark} case {number}: {}: {}",
        judgement.case, judgement.said
    );
    Ok(judgement)
}

fn main() -> Result<(), String> {
    let asked = Asked::parse();
    if !asked.write_only {
        program::jointwatch();
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(asked.threads)
        .build_global()
        .map_err(|e| format!("threads cannot be started: {e}"))?;
    let scratch = tempfile::tempdir().map_err(|e| format!("no temporary folder: {e}"))?;
    // A case that cannot be made is no verdict: it is said, left out of the table, and the others
    // go on.
    let judged: Vec<(usize, Judgement)> = asked
        .numbers()
        .into_par_iter()
        .filter_map(|number| match case(&asked, number, scratch.path()) {
            Ok(judgement) => Some((number, judgement)),
            Err(message) => {
                eprintln!("left out: {message}");
                None
            }
        })
        .collect();
    if !asked.write_only {
        println!(
            "\n{} cases, seed {}{}{}{}\n",
            judged.len(),
            asked.seed,
            if asked.tolerances {
                ", with instrument tolerances"
            } else {
                ""
            },
            if asked.machine {
                ", in a testing machine"
            } else {
                ""
            },
            if asked.two {
                ", two effects at once"
            } else {
                ""
            },
        );
        println!("{}", table::report(&judged, asked.seed));
        println!(
            "without a law here, never hidden: {}",
            without_law().join(", ")
        );
    }
    Ok(())
}

//! How often `diagnose` names what was hidden in a joint, over many simulated studies.
//!
//! `cargo run --release -p jointwatch-tests --bin hidden_effects -- --cases N --seed S [--tolerances] [--two]
//! [--only EFFECT] [--case K] [--threads T] [--keep DIR] [--write-only]`

use jointwatch_tests::hidden::cases::{Case, Options};
use jointwatch_tests::hidden::catalogue::{SUBJECTS, Subject};
use jointwatch_tests::hidden::judge::{Judgement, describe, diagnose};
use jointwatch_tests::hidden::{study, table};
use jointwatch_tests::program;
use rayon::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// What was asked for.
struct Request {
    options: Options,
    cases: Vec<usize>,
    threads: usize,
    keep: Option<PathBuf>,
    write_only: bool,
}

fn number<T: FromStr>(name: &str, value: &str) -> Result<T, String> {
    value
        .parse()
        .map_err(|_| format!("{name} {value} is no number"))
}

fn request() -> Result<Request, String> {
    let mut asked = Request {
        options: Options {
            seed: 1,
            ..Default::default()
        },
        cases: (0..100).collect(),
        threads: 0,
        keep: None,
        write_only: false,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        match name.as_str() {
            "--tolerances" => asked.options.tolerances = true,
            "--two" => asked.options.two = true,
            "--write-only" => asked.write_only = true,
            "--cases" | "--seed" | "--case" | "--threads" | "--keep" | "--only" => {
                let value = arguments.next().ok_or(format!("{name} needs a value"))?;
                match name.as_str() {
                    "--cases" => asked.cases = (0..number(&name, &value)?).collect(),
                    "--case" => asked.cases = vec![number(&name, &value)?],
                    "--seed" => asked.options.seed = number(&name, &value)?,
                    "--threads" => asked.threads = number(&name, &value)?,
                    "--keep" => asked.keep = Some(value.into()),
                    _ => asked.options.only = Some(value),
                }
            }
            _ => {
                return Err(format!(
                    "{name} is not known: give --cases N, --seed S, --tolerances, --two, --only EFFECT, --case K, --threads T, --keep DIR or --write-only"
                ));
            }
        }
    }
    if let Some(name) = asked.options.only.as_deref() {
        let names: Vec<&str> = SUBJECTS.iter().map(|s| s.name).collect();
        if name != "none" && Subject::named(name).is_none() {
            return Err(format!(
                "{name} cannot be hidden: give none, {}",
                names.join(", ")
            ));
        }
    }
    if asked.write_only && asked.keep.is_none() {
        return Err("--write-only needs --keep DIR to write to".into());
    }
    Ok(asked)
}

/// Draws, writes and judges one case.
fn case(asked: &Request, number: usize, scratch: &Path) -> Result<Judgement, String> {
    let drawn = Case::draw(&asked.options, number)?;
    let in_words = |e: std::io::Error| format!("case {number} cannot be written: {e}");
    let folder = asked
        .keep
        .as_deref()
        .unwrap_or(scratch)
        .join(format!("case-{number:04}"));
    if asked.write_only {
        fs::create_dir_all(&folder).map_err(in_words)?;
        study::write(&drawn, &folder).map_err(in_words)?;
        study::write_truth(&drawn, &folder).map_err(in_words)?;
        println!("case {number}: {}", describe(&drawn));
        return Ok(Judgement::default());
    }
    let judgement = diagnose(&drawn, &folder, asked.keep.is_some()).map_err(in_words)?;
    if asked.keep.is_none() {
        fs::remove_dir_all(&folder).map_err(in_words)?;
    }
    let mark = if judgement.right { "right" } else { "NOT  " };
    println!(
        "{mark} case {number}: {}: {}",
        judgement.case, judgement.said
    );
    Ok(judgement)
}

fn main() -> Result<(), String> {
    let asked = request()?;
    if !asked.write_only {
        program::jointwatch();
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(asked.threads)
        .build_global()
        .map_err(|e| format!("threads cannot be started: {e}"))?;
    let scratch = tempfile::tempdir().map_err(|e| format!("no temporary folder: {e}"))?;
    // A case that cannot be made is no verdict: it is said, left out of the table, and the others go on.
    let judged: Vec<(usize, Judgement)> = asked
        .cases
        .par_iter()
        .filter_map(|&number| match case(&asked, number, scratch.path()) {
            Ok(judgement) => Some((number, judgement)),
            Err(message) => {
                eprintln!("left out: {message}");
                None
            }
        })
        .collect();
    if !asked.write_only {
        println!(
            "\n{} cases, seed {}{}{}\n",
            judged.len(),
            asked.options.seed,
            if asked.options.tolerances {
                ", with instrument tolerances"
            } else {
                ""
            },
            if asked.options.two {
                ", two effects at once"
            } else {
                ""
            },
        );
        println!("{}", table::report(&judged, asked.options.seed));
    }
    Ok(())
}

//! Says which effect a model lacks, adds it and prints the errors before and after:
//! `cargo run --release --example diagnose -- study.toml model.json`

use jointwatch::{Model, Result, Study, Verdict};
use std::path::Path;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [study, model] = arguments.as_slice() else {
        return Err(jointwatch::Error::usage(
            "say which study.toml and which model.json to look at",
        ));
    };
    let study = Study::read(Path::new(study))?;
    let model = Model::read(Path::new(model))?;
    let diagnosis = jointwatch::diagnose(&study, &model)?;
    if diagnosis.verdict != Verdict::Effect {
        println!("nothing to add: {:?}", diagnosis.verdict);
        return Ok(());
    }
    let missing: Vec<String> = diagnosis
        .found
        .iter()
        .map(|found| format!("{}@{}", found.effect, found.axis))
        .collect();
    let added = jointwatch::add(&study, &model, &missing)?;
    for (before, after) in added.errors.before.iter().zip(&added.errors.after) {
        println!(
            "{}: NMSE {:.3} % before, {:.3} % with {}",
            before.axis,
            before.nmse_percent,
            after.nmse_percent,
            missing.join(", ")
        );
    }
    Ok(())
}

//! Learns a physical model from a study, prints its errors and writes it: `cargo run --release
//! --example identify -- study.toml model.json`

use jointwatch::{Kind, Result, Study};
use std::path::Path;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [study, model] = arguments.as_slice() else {
        return Err(jointwatch::Error::usage(
            "say which study.toml to learn from and which model.json to write",
        ));
    };
    let study = Study::read(Path::new(study))?;
    let learnt = jointwatch::identify(&study, Kind::Physical)?;
    for term in &learnt.effects {
        for parameter in &term.parameters {
            println!(
                "{} {}: {:.6e} {}",
                term.name(),
                parameter.name,
                parameter.value,
                parameter.unit
            );
        }
    }
    for error in &learnt.validation {
        println!(
            "{}: validation NMSE {:.3} %",
            error.axis, error.nmse_percent
        );
    }
    learnt.write(Path::new(model))
}

//! How often the monitor would raise a false alarm: healthy joints watched for hours, and the tail of how far its sums went.
//!
//! `cargo run --release -p jointwatch-tests --bin monitor_campaign -- --hours 20 --seed 100 [--rigs 5]`

use jointwatch_tests::false_alarms::{Campaign, report};
use jointwatch_tests::watched::Learnt;

fn main() -> Result<(), String> {
    let (mut hours, mut seed, mut rigs) = (20.0, 100, 5);
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        let value = arguments.next().ok_or(format!("{name} needs a value"))?;
        let wrong = || format!("{name} {value} is no number that can be used");
        match name.as_str() {
            "--hours" => {
                hours = value.parse().map_err(|_| wrong())?;
                if !(0.1..=10_000.0).contains(&hours) {
                    return Err(wrong());
                }
            }
            "--seed" => seed = value.parse().map_err(|_| wrong())?,
            "--rigs" => {
                rigs = value.parse().map_err(|_| wrong())?;
                if !(1..=1000).contains(&rigs) {
                    return Err(wrong());
                }
            }
            _ => {
                return Err(format!(
                    "{name} is not known: give --hours H, --seed S or --rigs N"
                ));
            }
        }
    }
    for learnt in [Learnt::Physical, Learnt::Polynomial] {
        let campaign = Campaign::run(learnt, seed, rigs, 0.5 * hours)?;
        println!("{}", report(&campaign));
    }
    Ok(())
}

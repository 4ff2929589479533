//! How often the 95 % intervals of a physical model cover the truth, over many simulated rigs.
//!
//! `cargo run --release -p jointwatch-tests --bin coverage -- --seeds 100 [--snr-db 60]`

use jointwatch_tests::coverage::{Coverage, report};

fn main() -> Result<(), String> {
    let mut seeds = 100;
    let mut snr_db = Some(60.0);
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        let value = arguments.next().ok_or(format!("{name} needs a value"))?;
        let wrong = |_| format!("{name} {value} is no number");
        match name.as_str() {
            "--seeds" => {
                seeds = value
                    .parse()
                    .map_err(|_| format!("{name} {value} is no number"))?
            }
            "--snr-db" if value == "none" => snr_db = None,
            "--snr-db" => snr_db = Some(value.parse().map_err(wrong)?),
            _ => {
                return Err(format!(
                    "{name} is not known: give --seeds N or --snr-db D|none"
                ));
            }
        }
    }
    let coverage = Coverage::of(0..seeds, snr_db)?;
    println!("{}", report(&coverage));
    Ok(())
}

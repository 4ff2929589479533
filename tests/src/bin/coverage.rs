//! How often the 95 % intervals of a physical model cover the truth, over many simulated rigs.
//!
//! `cargo run --release -p jointwatch-tests --bin coverage -- --seeds 100 [--snr-db 60]`

use clap::Parser;
use jointwatch_tests::coverage::{Coverage, report};

/// Learns physical models of simulated rigs and prints how often their 95 % intervals cover the
/// truth.
#[derive(Parser)]
#[command(max_term_width = 110)]
struct Asked {
    /// How many rigs, one per seed from 0.
    #[arg(long, value_name = "N", default_value_t = 100)]
    seeds: u64,
    /// Noise of the sensors below their channels' RMS in dB, or none.
    #[arg(long, value_name = "DB", default_value = "60", value_parser = noise)]
    snr_db: Noise,
}

/// In dB; nothing for sensors without noise.
#[derive(Clone)]
struct Noise(Option<f64>);

fn noise(text: &str) -> Result<Noise, String> {
    match text {
        "none" => Ok(Noise(None)),
        _ => {
            let number = text.parse().map_err(|_| "give a number of dB, or none");
            number.map(|db| Noise(Some(db))).map_err(String::from)
        }
    }
}

fn main() -> Result<(), String> {
    let asked = Asked::parse();
    let (seeds, snr_db) = (asked.seeds, asked.snr_db.0);
    let coverage = Coverage::of(0..seeds, snr_db)?;
    println!("{}", report(&coverage));
    Ok(())
}

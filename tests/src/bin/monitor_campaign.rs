//! How often the monitor would raise a false alarm, and how soon it sees a joint that changed.
//!
//! `cargo run --release -p jointwatch-tests --bin monitor_campaign -- --hours 20 --seed 100 [--rigs 5]`: healthy joints watched for
//! hours, and the tail of how far the sums went. With `--detect` instead of `--hours H`: every change by 10 % of the RMS force
//! on every rig, under every drive.

use jointwatch::sim::RigParameters;
use jointwatch_tests::detection::detect;
use jointwatch_tests::false_alarms::{Campaign, WANTED_HOURS, report};
use jointwatch_tests::watched::{Learnt, Subject};

/// Models, and within how many seconds a change is to be seen with them.
const MODELS: [(Learnt, f64); 2] = [(Learnt::Physical, 2.0), (Learnt::Polynomial, 10.0)];

fn main() -> Result<(), String> {
    let (mut hours, mut seed, mut rigs, mut detects) = (20.0, 100, 5, false);
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        if name == "--detect" {
            detects = true;
            continue;
        }
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
                    "{name} is not known: give --hours H, --detect, --seed S or --rigs N"
                ));
            }
        }
    }
    for (learnt, within_s) in MODELS {
        if detects {
            detection(learnt, seed, rigs, within_s);
        } else {
            let campaign = Campaign::run(learnt, seed, rigs, 0.5 * hours)?;
            println!("{}", report(&campaign));
        }
    }
    Ok(())
}

/// Prints every change that was not seen in time, and how long the others took; of every seed the default rig and one drawn anew.
fn detection(learnt: Learnt, seed: u64, rigs: usize, within_s: f64) {
    let (mut times, mut missed, mut all) = (Vec::new(), 0, 0);
    for seed in (seed..).take(rigs) {
        for (rig, parameters) in [
            ("default rig", RigParameters::default()),
            ("rig drawn anew", RigParameters::draw(seed)),
        ] {
            let subject = match Subject::new(learnt, parameters, seed, WANTED_HOURS) {
                Ok(subject) => subject,
                Err(why) => {
                    println!("{learnt:?}, {rig}, seed {seed}: passed over, {why}");
                    continue;
                }
            };
            for watched in detect(&subject, 0.1, within_s, seed) {
                all += 1;
                if !watched.is_found_within(within_s) {
                    missed += 1;
                    println!("{learnt:?}, {rig}, seed {seed}: {}", watched.told());
                } else if let Some((time, _)) = watched.alarm() {
                    times.push(time);
                }
            }
        }
    }
    times.sort_by(f64::total_cmp);
    let at = |part: f64| {
        let place = (part * times.len() as f64) as usize;
        times.get(place.min(times.len().saturating_sub(1)))
    };
    println!(
        "{learnt:?} models, seeds from {seed} on: {missed} of {all} changes not seen within {within_s} s; half of the others within \
         {:.2?} s, nine tenths within {:.2?} s, the last after {:.2?} s",
        at(0.5),
        at(0.9),
        at(1.0)
    );
}

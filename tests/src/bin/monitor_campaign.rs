//! How often the monitor would raise a false alarm, and how soon it sees a joint that changed.
//!
//! `cargo run --release -p jointwatch-tests --bin monitor_campaign -- --hours 20 --seed 100 [--rigs
//! 5]`: healthy joints watched for hours, and the bound on false alarms that the increments of the
//! monitor's sums allow. With `--detect` instead of `--hours H`: every change by 10 % of the RMS
//! force on every rig, under every drive. With `--drifts`: what slow drifts of the joint and its
//! instruments make of the monitor. With `--curves`: how soon a gross change is found over its
//! size, −100 to +100 % of the force, of the stiffness or the damping alone, and a seizure, before
//! and after power-on, on either axis and on both, at the same motion and at the one that follows.

use clap::Parser;
use jointwatch::simulate::RigParameters;
use jointwatch_shared::monitor::Onset;
use jointwatch_tests::monitor::curves::{Change, curves, documented_s};
use jointwatch_tests::monitor::detection::detect;
use jointwatch_tests::monitor::drifts::{Fleet, Motion, Quantity, Said, line};
use jointwatch_tests::monitor::false_alarms::{Campaign, WANTED_HOURS, report};
use jointwatch_tests::monitor::watched::{Learnt, Subject};

/// Models, and within how many seconds a change is to be seen with them.
const MODELS: [(Learnt, f64); 2] = [(Learnt::Physical, 2.0), (Learnt::Polynomial, 10.0)];

/// Watches simulated healthy joints and prints how rare a false alarm is, or changes joints and
/// prints how soon it is seen.
#[derive(Parser)]
#[command(max_term_width = 110)]
struct Asked {
    /// Hours that healthy joints are watched, half of them with either kind of model.
    #[arg(long, value_name = "H", default_value_t = 20.0, value_parser = hours)]
    hours: f64,
    /// Every change by 10 % of the RMS force on every rig, under every drive, instead.
    #[arg(long, conflicts_with = "hours")]
    detect: bool,
    /// How soon a gross change is found over its size, instead.
    #[arg(long, conflicts_with_all = ["hours", "detect"])]
    curves: bool,
    /// What slow drifts of stiffness, gain, zero and temperature make of limits that allow for
    /// none and for 2 %, and `--hours` of drifts by up to 2 %, instead.
    #[arg(long, conflicts_with_all = ["detect", "curves"])]
    drifts: bool,
    /// What the first rig is drawn from; the others from the numbers after it.
    #[arg(long, value_name = "S", default_value_t = 100)]
    seed: u64,
    /// How many rigs are drawn, each from a seed of its own.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=1000))]
    rigs: u16,
}

fn hours(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(hours) if (0.1..=10_000.0).contains(&hours) => Ok(hours),
        _ => Err("give hours from 0.1 to 10000".into()),
    }
}

fn main() -> Result<(), String> {
    let asked = Asked::parse();
    let rigs = usize::from(asked.rigs);
    for (learnt, within_s) in MODELS {
        if asked.drifts {
            drifts(learnt, asked.seed, rigs, 0.5 * asked.hours)?;
        } else if asked.curves {
            sizes(learnt, asked.seed, rigs);
        } else if asked.detect {
            detection(learnt, asked.seed, rigs, within_s);
        } else {
            let campaign = Campaign::run(learnt, asked.seed, rigs, 0.5 * asked.hours)?;
            println!("{}", report(&campaign));
        }
    }
    Ok(())
}

/// Sizes of a drift, as a part of what drifts.
const DRIFTS: [f64; 4] = [0.01, 0.02, 0.03, 0.05];
/// What limits allow for.
const ALLOWED: [f64; 2] = [0.0, 0.02];

/// A line per drift: what limits for no drift and for one of 2 % say of it; then hours of small
/// drifts.
fn drifts(learnt: Learnt, seed: u64, rigs: usize, hours: f64) -> Result<(), String> {
    let fleet = Fleet::new(learnt, seed, rigs, &ALLOWED, WANTED_HOURS)?;
    let seeds: Vec<u64> = fleet.rigs.iter().map(|(seed, _)| *seed).collect();
    println!("{learnt:?} models, rigs of seeds {seeds:?}");
    let print = |what: String, said: Vec<Vec<Said>>| {
        for (allowed, said) in ALLOWED.iter().zip(said) {
            let percent = 100.0 * allowed;
            println!("  {what}; limits for {percent} %: {}", line(&said));
        }
    };
    let none = fleet.curve(Quantity::Gain, 0.0);
    for (place, motion) in Motion::ALL.iter().enumerate() {
        let own = |said: &Vec<Said>| {
            said.iter()
                .skip(place)
                .step_by(Motion::ALL.len())
                .copied()
                .collect()
        };
        print(
            format!("no drift, {motion:?}"),
            none.iter().map(own).collect(),
        );
    }
    for quantity in Quantity::ALL {
        for size in DRIFTS {
            let what = format!("{quantity:?} by ±{} %", 100.0 * size);
            print(what, fleet.curve(quantity, size));
        }
    }
    let (hours, said) = fleet.hours(hours, 0.02);
    print(format!("{hours:.1} hours of drifts by up to 2 %"), said);
    Ok(())
}

/// Prints every change that was not seen in time, and how long the others took; of every seed the
/// default rig and one drawn anew.
fn detection(learnt: Learnt, seed: u64, rigs: usize, within_s: f64) {
    let (mut times, mut missed, mut slow, mut all) = (Vec::new(), 0, 0, 0);
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
                } else if let Some((time, verdict)) = watched.alarm() {
                    times.push(time);
                    slow += usize::from(verdict.onset() == Onset::Slow);
                }
            }
        }
    }
    println!(
        "{learnt:?} models, seeds from {seed} on: {missed} of {all} changes not seen within {within_s} s; of the others {}; {slow} told \
         as slow",
        soon(times)
    );
}

/// How soon changes were found, for a person to read.
fn soon(mut times: Vec<f64>) -> String {
    times.sort_by(f64::total_cmp);
    let at = |part: f64| {
        let place = (part * times.len().saturating_sub(1) as f64).round() as usize;
        times.get(place).copied().unwrap_or(f64::NAN)
    };
    let [half, nine_tenths, last] = [0.5, 0.9, 1.0].map(at);
    format!(
        "half within {half:.2} s, nine tenths within {nine_tenths:.2} s, the last after {last:.2} s"
    )
}

/// A line per change: how many were found in time, how soon, how long an axis that changed was
/// called healthy, and what was said wrongly.
fn sizes(learnt: Learnt, seed: u64, rigs: usize) {
    let within_s = documented_s(learnt);
    let (mut losses, mut in_time_of_them) = (0, 0);
    let (mut subjects, changes) = (Vec::new(), Change::all().collect::<Vec<_>>());
    for seed in (seed..).take(rigs) {
        match Subject::new(learnt, RigParameters::draw(seed), seed, WANTED_HOURS) {
            Ok(subject) => subjects.push((seed, subject)),
            Err(why) => println!("{learnt:?}, rig drawn anew, seed {seed}: passed over, {why}"),
        }
    }
    for change in changes {
        // Where it was well before the power came on, and where it was not.
        let (mut times, mut healthy) = ([Vec::new(), Vec::new()], [0.0_f64; 2]);
        let (mut all, mut wrong) = (0, Vec::new());
        for (seed, subject) in &subjects {
            for found in curves(subject, &[change], within_s + 2.0, *seed) {
                all += 1;
                let place = usize::from(found.before_power_on);
                healthy[place] = healthy[place].max(found.healthy_after(0.0, within_s + 2.0));
                let is_loss = change.is_loss();
                losses += usize::from(is_loss);
                match found.found_after() {
                    Some(time) if found.is_in_time(learnt) => {
                        in_time_of_them += usize::from(is_loss);
                        times[place].push(time);
                    }
                    _ => wrong.push(format!("seed {seed}, not in time: {}", found.told())),
                }
                wrong.extend(found.wrong().map(|what| format!("seed {seed}, {what}")));
            }
        }
        if all == 0 {
            // On none of these rigs is it large enough to be tried.
            continue;
        }
        let in_time = times[0].len() + times[1].len();
        let [running, before] = times.map(soon);
        println!(
            "{learnt:?}, {change:?}: {in_time} of {all} in the documented time; {running}; changed before power-on: {before}; called healthy for \
             {:.2} s at most, changed before power-on {:.2} s",
            healthy[0], healthy[1]
        );
        for what in wrong {
            println!("  {what}");
        }
    }
    println!(
        "{learnt:?}: {in_time_of_them} of {losses} losses of 30 % or more and seizures within {within_s} s"
    );
}

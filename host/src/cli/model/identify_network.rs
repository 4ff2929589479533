//! `jointwatch identify --model network`: its options, its progress, Ctrl-C, and what it says about
//! a training.

use crate::cli::console::Console;
use crate::fit::identify::{self, Identified, Training};
use crate::fit::network::{
    LeftOut, MAX_NEURONS, NetworkOptions, NetworkProgress, Neurons, SizeCurve, TrainingObserver,
};
use crate::model::ModelAxis;
use crate::study::Study;
use crate::study::series::mean;
use crate::text::error::{Error, Result};
use crate::text::table::Table;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Options that only a network has.
#[derive(Args)]
pub(super) struct NetworkArguments {
    /// Neurons of a network's hidden layer, or "auto": as many as leaving out one training record
    /// at a time asks for [default: 40].
    #[arg(long, value_name = "N|auto", value_parser = neurons)]
    neurons: Option<Neurons>,
    /// Trainings of a network from different random weights, of which the best is kept [default:
    /// 5].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    restarts: Option<u16>,
    /// Seed of a network's first weights [default: 1].
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
}

fn neurons(text: &str) -> std::result::Result<Neurons, String> {
    if text == "auto" {
        return Ok(Neurons::Auto);
    }
    match text.parse() {
        Ok(value) if (1..=MAX_NEURONS).contains(&value) => Ok(Neurons::Fixed(value)),
        _ => Err(format!("a number from 1 to {MAX_NEURONS}, or auto")),
    }
}

impl NetworkArguments {
    /// Refuses those that were given for another kind of model.
    pub(super) fn refuse(&self, model: &str) -> Result<()> {
        let given = [
            ("--neurons", self.neurons.is_some()),
            ("--restarts", self.restarts.is_some()),
            ("--seed", self.seed.is_some()),
        ];
        match given.into_iter().find(|(_, given)| *given) {
            Some((option, _)) => Err(Error::usage(format!(
                "{option} is an option of --model network and says nothing about --model {model}; leave it out"
            ))),
            None => Ok(()),
        }
    }

    /// Trains, showing how far it is; Ctrl-C ends the training and keeps what there is.
    ///
    /// `input` as in [`NetworkOptions`].
    pub(super) fn train(
        &self,
        study: &Study,
        input: Option<String>,
        working: &ProgressBar,
    ) -> Result<Identified> {
        let default = NetworkOptions::default();
        let options = NetworkOptions {
            neurons: self.neurons.unwrap_or(default.neurons),
            restarts: self.restarts.map_or(default.restarts, usize::from),
            seed: self.seed.unwrap_or(default.seed),
            input,
            ..default
        };
        end_by_ctrl_c()?;
        let shown = Shown::new(working);
        identify::network(
            study,
            &options,
            &TrainingObserver {
                progress: &|progress| shown.tell(progress),
                stop: &INTERRUPTED,
            },
        )
    }
}

/// Set by Ctrl-C; a signal's handler reaches nothing else.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// From here on the first Ctrl-C asks the training to end, the second ends the program.
fn end_by_ctrl_c() -> Result<()> {
    ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            // As a shell counts a program that SIGINT ended.
            std::process::exit(130);
        }
    })
    .map_err(|e| Error::failed(format!("Ctrl-C could not be listened for ({e})")))
}

/// The line on standard error while networks are trained side by side.
struct Shown<'a> {
    bar: &'a ProgressBar,
    begun: Instant,
    /// How much of each training is done, and whether those are trials of sizes.
    shares: Mutex<(bool, Vec<f64>)>,
}

/// Parts that the bar is divided into.
const PARTS: f64 = 1000.0;

impl<'a> Shown<'a> {
    fn new(bar: &'a ProgressBar) -> Self {
        bar.set_length(PARTS as u64);
        if let Ok(style) = ProgressStyle::with_template("{spinner} [{bar:24}] {msg}") {
            bar.set_style(style.progress_chars("=> "));
        }
        Self {
            bar,
            begun: Instant::now(),
            shares: Mutex::new((false, Vec::new())),
        }
    }

    fn tell(&self, progress: &NetworkProgress) {
        let mut guard = self.shares.lock().unwrap_or_else(PoisonError::into_inner);
        let (choosing, shares) = &mut *guard;
        if *choosing != progress.choosing_size || shares.len() != progress.trainings {
            *choosing = progress.choosing_size;
            *shares = vec![0.0; progress.trainings];
        }
        shares[progress.training] = progress.share_done;
        let done = mean(shares);
        self.bar.set_position((PARTS * done) as u64);
        self.bar
            .set_message(line(progress, done, self.begun.elapsed().as_secs_f64()));
    }
}

/// One training's state, and the time that all of them take at most from here on.
fn line(progress: &NetworkProgress, done: f64, elapsed_s: f64) -> String {
    let left = elapsed_s * (1.0 - done) / done.max(1e-6);
    format!(
        "{}{} neurons, training {} of {}, stage {} of {}, step {}, error {:.3} %, at most {left:.0} s left",
        if progress.choosing_size {
            "choosing the size: "
        } else {
            ""
        },
        progress.neurons,
        progress.training + 1,
        progress.trainings,
        progress.stage + 1,
        progress.stages,
        progress.step + 1,
        progress.training_nmse_percent
    )
}

/// Prints how the training went.
pub(super) fn report(console: &Console, axes: &[ModelAxis], training: &Training) -> Result<()> {
    let fit = &training.fit;
    if let Some(curve) = &fit.size_curve {
        console.say(size_table(curve, axes, fit.network.neurons()))?;
    }
    let best = &fit.restarts[fit.best];
    console.say(format!(
        "\nNetwork {}-{}-{}, trained on {} rows, best of {} restarts by evidence:",
        fit.network.inputs.len(),
        fit.network.neurons(),
        fit.network.outputs.len(),
        fit.rows,
        fit.restarts.len()
    ))?;
    let mut heading = vec!["restart".to_string(), "seed".into()];
    heading.extend(
        axes.iter()
            .map(|axis| format!("training NMSE {}", axis.name)),
    );
    heading.extend(
        [
            "effective parameters",
            "log evidence",
            "CPU",
            "why it ended",
        ]
        .map(String::from),
    );
    let heading: Vec<&str> = heading.iter().map(String::as_str).collect();
    let mut table = Table::new(&heading);
    for (index, restart) in fit.restarts.iter().enumerate() {
        let kept = if index == fit.best { " kept" } else { "" };
        let mut row = vec![format!("{}{kept}", index + 1), restart.seed.to_string()];
        row.extend(
            restart
                .training_nmse_percent
                .iter()
                .map(|e| format!("{e:.4} %")),
        );
        row.push(format!("{:.1}", restart.effective_parameters));
        row.push(format!("{:.0}", restart.log_evidence));
        row.push(format!("{:.2} s", restart.cpu_s));
        row.push(restart.stop.to_string());
        table.row(row);
    }
    console.say(table.to_string())?;
    if fit.begun_anew > 0 {
        console.say(format!(
            "Values that are not finite came up {} times; those trainings were begun anew from another seed.",
            fit.begun_anew
        ))?;
    }
    console.say(format!(
        "Restart {} is kept: {:.1} effective parameters of {} weights and biases; {}.",
        fit.best + 1,
        best.effective_parameters,
        fit.network.parameters(),
        best.stop
    ))?;
    console.say(training.agreement(axes))
}

/// The errors of all sizes that were tried.
fn size_table(curve: &SizeCurve, axes: &[ModelAxis], chosen: usize) -> String {
    let mut heading = vec!["neurons".to_string()];
    heading.extend(
        axes.iter()
            .map(|axis| format!("held-out NMSE {}", axis.name)),
    );
    heading.push(String::new());
    let heading: Vec<&str> = heading.iter().map(String::as_str).collect();
    let mut table = Table::new(&heading);
    for size in &curve.sizes {
        let mut row = vec![size.neurons.to_string()];
        row.extend(
            size.held_out_nmse_percent
                .iter()
                .map(|e| format!("{e:.3} %")),
        );
        row.push(if size.neurons == chosen { "chosen" } else { "" }.into());
        table.row(row);
    }
    let how = match curve.left_out {
        LeftOut::Records => "leaving out one training record at a time",
        LeftOut::Stretches => {
            "leaving out a third of the only training record at a time, since there is no other record to leave out"
        }
    };
    format!("\nNumber of neurons, {how} (geometric means):\n{table}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_says_stage_step_error_and_time_left() {
        let progress = NetworkProgress {
            training: 1,
            trainings: 5,
            choosing_size: false,
            neurons: 40,
            stage: 2,
            stages: 6,
            step: 3,
            rows: 3721,
            training_nmse_percent: 0.0664,
            share_done: 0.5,
        };
        assert_eq!(
            line(&progress, 0.25, 2.0),
            "40 neurons, training 2 of 5, stage 3 of 6, step 4, error 0.066 %, at most 6 s left"
        );
    }
}

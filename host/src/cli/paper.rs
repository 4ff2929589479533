//! `jointwatch paper`: the page that holds Jointwatch against the paper it comes from.

use super::console::Console;
use crate::paper::{self, Denominator, PaperOptions, ratios};
use crate::text::error::Result;
use clap::Args;
use std::path::PathBuf;

/// Options of `jointwatch paper`.
#[derive(Args)]
pub(crate) struct Paper {
    /// The folder for the page, paper.md, and its figures, paper/*.svg.
    #[arg(long, value_name = "DIR", default_value = "jointwatch-paper")]
    out: PathBuf,
    /// Simulated studies over which median and range are taken.
    #[arg(long, value_name = "N", default_value_t = PaperOptions::default().seeds, value_parser = clap::value_parser!(u64).range(1..=100))]
    seeds: u64,
    /// Trainings of each network from different random weights, of which the best is kept.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u8).range(1..=50))]
    restarts: u8,
    /// The folder that holds the measured joints' folders, emps and brfd; the folder data in that
    /// of the environment variable JOINTWATCH_DATA, or ../shared/data, when left out.
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
}

impl Paper {
    pub(super) fn run(self, console: &Console) -> Result<()> {
        paper::check_folder(&self.out)?;
        let options = PaperOptions {
            seeds: self.seeds,
            restarts: self.restarts.into(),
            data: self.data,
        };
        let working = console.working("simulating");
        let paper = paper::paper(&options, &|doing| working.set_message(doing.to_owned()))?;
        working.finish_and_clear();
        paper.write(&self.out)?;
        let runs = &paper.results.perfect;
        let plain = Denominator::Plain;
        let error = |axis| ratios::error_ratio(runs, plain, axis, ratios::Band::Whole);
        let spread = |ratio: Option<paper::Spread>| ratio.map_or("none".into(), |r| r.to_string());
        console.say(format!(
            "Network against plain least squares, median (range) over {} noise-free studies:\n\
             validation error {} times lower on x and {} times on phi (the paper: {});\n\
             one training {} times as long (the paper: {}).",
            runs.len(),
            spread(error(0)),
            spread(error(1)),
            ratios::PAPERS_ERROR_RATIO,
            spread(ratios::time_ratio(runs, plain, ratios::Share::One)),
            ratios::PAPERS_TIME_RATIO,
        ))?;
        for joint in &paper.results.measured {
            if let Some(reason) = &joint.left_out {
                console.say(format!("Note: {reason}."))?;
            }
        }
        console.say(format!(
            "The page is {}, with {} figures beside it.",
            self.out.join("paper.md").display(),
            paper.figures.len()
        ))?;
        console.json(&paper.results)
    }
}

//! The paper reproduced: its figures and its two headline ratios, as a page with drawings.
//!
//! [`paper`] computes everything first; [`Paper::write`] then leaves the page and its figures
//! behind. What the page says in numbers is formatted from [`Results`], so that text and figures
//! cannot disagree.

mod cost;
mod figures;
mod measured;
mod network;
mod page;
mod polynomials;
pub mod ratios;
mod results;
mod simulated;
mod spread;

pub use crate::report::Drawing;
pub use measured::{MeasuredFit, MeasuredJoint};
pub use polynomials::Denominator;
pub use results::{PaperOptions, Results};
pub use simulated::{BothOnlyRun, Drawn, Sensors};
pub use spread::Spread;

use crate::text::error::{Error, Result};
use crate::text::output;
use std::path::Path;

/// The page and its figures.
pub struct Paper {
    /// Every figure that the page states.
    pub results: Results,
    /// The page, in Markdown.
    pub page: String,
    /// Its figures; they belong into the folder `paper` beside the page.
    pub figures: Vec<Drawing>,
}

/// Simulates, learns, measures and draws everything.
///
/// `progress` is told what is being done.
///
/// # Errors
/// [`crate::text::error::Kind::Usage`] for no seeds or no restarts;
/// [`crate::text::error::Kind::Data`] when measured logs are there but cannot be used.
pub fn paper(options: &PaperOptions, progress: &dyn Fn(&str)) -> Result<Paper> {
    if options.seeds == 0 || options.restarts == 0 {
        return Err(Error::usage(
            "the page needs one seed and one training of each network at the least",
        ));
    }
    // First, because logs can be bad and simulations cannot.
    let (mut measured, mut drawings) = (Vec::new(), Vec::new());
    for source in &measured::SOURCES {
        progress(&format!("measured joint: {}", source.folder));
        let section = measured::section(source, options.data.as_deref(), options.restarts)?;
        drawings.extend(section.drawings);
        measured.push(section.joint);
    }
    let mut drawn = None;
    let (mut perfect, mut rig) = (Vec::new(), Vec::new());
    for seed in 1..=options.seeds {
        for (sensors, runs, words) in [
            (Sensors::Perfect, &mut perfect, "noise-free"),
            (Sensors::Rig, &mut rig, "as logged"),
        ] {
            progress(&format!(
                "seed {seed} of {}, {words}: polynomials and network",
                options.seeds
            ));
            let (run, learnt) = simulated::learn(sensors, seed, options.restarts)?;
            runs.push(run);
            if drawn.is_none() {
                drawings.extend(learnt.drawings()?);
                drawn = Some(learnt.errors());
            }
        }
    }
    let mut both_only = Vec::new();
    for seed in 1..=options.seeds {
        progress(&format!(
            "seed {seed} of {}: the record with both axes driven, alone",
            options.seeds
        ));
        both_only.push(simulated::learn_from_both_only(seed, options.restarts)?);
    }
    let drawn = drawn.ok_or_else(|| Error::failed("no study was simulated"))?;
    let results = Results {
        restarts: options.restarts,
        drawn,
        perfect,
        rig,
        both_only,
        measured,
    };
    Ok(Paper {
        page: page::page(&results),
        results,
        figures: drawings,
    })
}

/// Refuses a folder that cannot be made because a file is in its way, before anything is computed
/// for it.
///
/// # Errors
/// [`crate::text::error::Kind::Failed`] with the file's path.
pub fn check_folder(out: &Path) -> Result<()> {
    match out.ancestors().find(|folder| folder.exists()) {
        Some(file) if !file.is_dir() => Err(Error::failed(format!(
            "{}: the page cannot go into {}, because this is a file; try another --out",
            file.display(),
            out.display()
        ))),
        _ => Ok(()),
    }
}

impl Paper {
    /// Writes `paper.md` into a folder, which is made when it is missing, and the figures into its
    /// folder `paper`.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Failed`] when a folder cannot be made or a file not be written.
    pub fn write(&self, out: &Path) -> Result<()> {
        let figures = out.join("paper");
        std::fs::create_dir_all(&figures).map_err(|e| {
            Error::failed(format!(
                "{}: the folder could not be made ({e}); try another --out",
                figures.display()
            ))
        })?;
        for drawing in &self.figures {
            output::write_whole(&figures.join(&drawing.file), drawing.svg.as_bytes())?;
        }
        // Last, so that a page is never there without its figures.
        output::write_whole(&out.join("paper.md"), self.page.as_bytes())
    }
}

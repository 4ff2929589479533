//! The public league: official splits of nonlinearbenchmark.org, learnt with the library's own
//! calls and simulated.
//!
//! Every kind of model that may be chosen is learnt and refined on training rows alone, and the one
//! whose refinement left least on the last fifth of these rows is taken. The records for testing
//! are read after that, once.

use super::bouc_wen;
use crate::program::measurements;
use jointwatch::fit::identify::{self, physical};
use jointwatch::fit::polynomial::{Method, PolynomialOptions};
use jointwatch::model::file::ModelFile;
use jointwatch::simulate::refine::{Refined, refine};
use jointwatch::simulate::respond::{Options, respond};
use jointwatch::study::{Role, Study};
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// What stands before and after the table in docs/notebook/league.md.
pub const MARKS: [&str; 2] = ["<!-- league: begin -->", "<!-- league: end -->"];

/// One figure of the league.
#[derive(Clone, Debug)]
pub struct Figure {
    /// The set and what was measured on it.
    pub what: &'static str,
    /// The unit of the figures.
    pub unit: &'static str,
    /// The best published result that is known to us; none where there is none.
    pub published: Option<f64>,
    /// What is aimed at.
    pub aim: f64,
    /// By the fit to the equation of motion.
    pub equation: f64,
    /// After refinement by simulation; none for an error of the equation of motion.
    pub simulation: Option<f64>,
    /// Name of the candidate that was learnt.
    pub model: String,
}

/// A record: its file and its rows.
type Rows = (&'static str, Option<[usize; 2]>);

/// A kind of model that may be chosen.
enum Candidate {
    /// A sum of effects.
    Effects(&'static str),
    /// A polynomial with these highest exponents.
    Polynomial([u8; 2]),
}

/// Where the records of a set come from.
enum Source {
    /// Files in a folder of measurements.
    Measured(&'static str, &'static [&'static str]),
    /// Written by a simulation of published equations.
    Simulated(fn(&Path) -> Result<(), String>),
}

/// A set of the league.
struct Set {
    name: &'static str,
    source: Source,
    /// Everything of study.toml before the records.
    head: &'static str,
    training: Rows,
    tests: &'static [Rows],
    candidates: &'static [Candidate],
}

const EMPS: Set = Set {
    name: "EMPS",
    source: Source::Measured("data/emps", &["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"]),
    head: "time = \"t\"\nsample_rate_hz = 1000.0\nband_hz = 20.0\n[[axis]]\nname = \"x\"\nkind = \"translation\"\n\
           displacement = \"qm\"\nforce = { column = \"vir\", scale = 35.15065188248547 }\n",
    training: ("DATA_EMPS.mat", None),
    tests: &[("DATA_EMPS_PULSES.mat", None)],
    candidates: &[
        Candidate::Effects(r#""viscous@x", "coulomb@x", "preload@x""#),
        Candidate::Effects(r#""viscous_by_direction@x", "coulomb_by_direction@x""#),
        Candidate::Effects(r#""viscous_by_direction@x", "coulomb_by_direction@x", "preload@x""#),
    ],
};

const SILVERBOX: Set = Set {
    name: "Silverbox",
    source: Source::Measured("data/silverbox", &["SNLS80mV.mat"]),
    head: "sample_rate_hz = 610.3515625\nband_hz = 180.0\n[[axis]]\nname = \"x\"\nkind = \"translation\"\n\
           displacement = \"V2\"\nforce = \"V1\"\n",
    training: ("SNLS80mV.mat", Some([40_650, 105_712])),
    tests: &[
        ("SNLS80mV.mat", Some([105_712, 127_400])),
        ("SNLS80mV.mat", Some([100, 40_575])),
        ("SNLS80mV.mat", Some([100, 32_100])),
    ],
    candidates: &[
        Candidate::Effects(r#""stiffness@x", "viscous@x", "preload@x", "cubic_hardening@x""#),
        Candidate::Polynomial([3, 1]),
        Candidate::Polynomial([3, 3]),
    ],
};

const BOUC_WEN: Set = Set {
    name: "Bouc-Wen",
    source: Source::Simulated(bouc_wen::records),
    head: "time = \"t\"\nsample_rate_hz = 750.0\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"y\"\n\
           force = \"u\"\n",
    training: (bouc_wen::TRAINING, None),
    tests: &[(bouc_wen::TESTS[0], None), (bouc_wen::TESTS[1], None)],
    candidates: &[
        Candidate::Effects(r#""stiffness@x", "viscous@x", "bouc_wen@x""#),
        Candidate::Effects(r#""stiffness@x", "viscous@x", "bouc_wen_hardening@x""#),
    ],
};

impl Source {
    /// Puts the files into a folder; false where the measurements are not there.
    fn put(&self, into: &Path) -> Result<bool, String> {
        match self {
            Self::Simulated(records) => records(into)?,
            Self::Measured(folder, files) => {
                let Some(data) = measurements(folder) else {
                    return Ok(false);
                };
                for file in *files {
                    fs::copy(data.join(file), into.join(file))
                        .map_err(|e| format!("{}: {e}", data.join(file).display()))?;
                }
            }
        }
        Ok(true)
    }
}

impl Candidate {
    fn name(&self) -> String {
        match self {
            Self::Effects(terms) => terms.replace('"', "`"),
            Self::Polynomial([m, n]) => format!("polynomial, `--order {m},{n}`"),
        }
    }
}

/// A record of study.toml.
fn record((file, rows): Rows, role: &str) -> String {
    let rows = rows.map_or(String::new(), |[from, to]| {
        format!("rows = [{from}, {to}]\n")
    });
    format!("[[record]]\nfile = \"{file}\"\nrole = \"{role}\"\n{rows}")
}

/// The study with its training record and these others.
fn study(folder: &Path, set: &Set, candidate: &Candidate, tests: &[Rows]) -> Result<Study, String> {
    let mut text = format!("name = \"league\"\n{}", set.head);
    text += &record(set.training, "train");
    for test in tests {
        text += &record(*test, "validate");
    }
    if let Candidate::Effects(terms) = candidate {
        let _ = writeln!(text, "[base]\nterms = [{terms}]");
    }
    fs::write(folder.join("study.toml"), text).map_err(|e| e.to_string())?;
    Study::read(folder).map_err(|e| e.to_string())
}

/// Both fits of one kind of model.
fn learnt(study: &Study, candidate: &Candidate) -> Result<(ModelFile, Refined), String> {
    let equation = match candidate {
        Candidate::Effects(_) => physical(study),
        Candidate::Polynomial(orders) => {
            let options = PolynomialOptions {
                orders: Some(orders.to_vec()),
                method: Method::Ridge,
                ..PolynomialOptions::default()
            };
            identify::polynomial(study, &options, &|_| ())
        }
    };
    let equation = equation.map_err(|e| e.to_string())?.model;
    let refined = refine(study, &equation, &|_| ()).map_err(|e| e.to_string())?;
    Ok((equation, refined))
}

/// The chosen kind of model of a set, with both fits, and its test study.
struct Chosen {
    name: String,
    equation: ModelFile,
    refined: ModelFile,
    study: Study,
}

impl Chosen {
    /// Learns every candidate, takes the best on held-out training rows, then opens the test
    /// records.
    fn of(set: &Set, told: &dyn Fn(&str)) -> Result<Option<Self>, String> {
        let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
        if !set.source.put(folder.path())? {
            return Ok(None);
        }
        let mut best: Option<(f64, &Candidate, ModelFile, ModelFile)> = None;
        for candidate in set.candidates {
            let training = study(folder.path(), set, candidate, &[])?;
            let (equation, refined) = learnt(&training, candidate)?;
            let [before, after] = refined.refinement.held_out;
            told(&format!(
                "{}: {} leaves {:.4} % of the RMS displacement on held-out training rows, {:.4} % after refinement; stretches of {:?} s",
                set.name,
                candidate.name(),
                100.0 * before,
                100.0 * after,
                refined.refinement.stretch_s
            ));
            if best.as_ref().is_none_or(|(least, ..)| after < *least) {
                best = Some((after, candidate, equation, refined.model));
            }
        }
        let Some((_, candidate, equation, refined)) = best else {
            return Ok(None);
        };
        Ok(Some(Self {
            name: candidate.name(),
            equation,
            refined,
            study: study(folder.path(), set, candidate, set.tests)?,
        }))
    }

    /// RMS error of the simulated displacement on every test record, with both fits, SI.
    fn simulated(&self) -> Result<Vec<[f64; 2]>, String> {
        let run = |model: &ModelFile| -> Result<Vec<f64>, String> {
            let response = respond(&self.study, model, &Options::default());
            let records = response.map_err(|e| e.to_string())?.records.into_iter();
            let tests = records.filter(|record| record.role == Role::Validate);
            let error = |figures: &jointwatch::simulate::respond::AxisResponse| {
                figures.rms_displacement * (0.01 * figures.displacement_nmse_percent).sqrt()
            };
            // What diverges has no error that could stand beside others.
            Ok(tests
                .map(|record| match record.diverged.is_empty() {
                    true => record.axes.values().map(error).fold(0.0, f64::max),
                    false => f64::INFINITY,
                })
                .collect())
        };
        let pairs = run(&self.equation)?.into_iter().zip(run(&self.refined)?);
        Ok(pairs.map(|(a, b)| [a, b]).collect())
    }
}

/// A row of the table: what was measured, the best published, and the aim.
type Row = (&'static str, Option<f64>, f64);

impl Chosen {
    /// The simulated displacement of every test record, in a unit of which so many are one of SI.
    fn figures(&self, unit: &'static str, scale: f64, rows: &[Row]) -> Result<Vec<Figure>, String> {
        let rows = rows.iter().zip(self.simulated()?);
        let figure = |(&(what, published, aim), [before, after]): (&Row, [f64; 2])| Figure {
            what,
            unit,
            published,
            aim,
            equation: scale * before,
            simulation: Some(scale * after),
            model: self.name.clone(),
        };
        Ok(rows.map(figure).collect())
    }
}

/// The positioning axis; nothing where its files are not there.
///
/// # Errors
/// One sentence when a file cannot be read or nothing can be learnt from it.
pub fn emps(told: &dyn Fn(&str)) -> Result<Vec<Figure>, String> {
    let Some(chosen) = Chosen::of(&EMPS, told)? else {
        return Ok(Vec::new());
    };
    let row = ("EMPS, test record, simulated displacement", Some(2.64), 4.7);
    let mut figures = chosen.figures("mm RMS", 1e3, &[row])?;
    // The same fit once more, for its errors on both records.
    let fit = physical(&chosen.study).map_err(|e| e.to_string())?.model;
    let errors = [
        (
            "EMPS, training record, equation error",
            0.058,
            &fit.verification,
        ),
        ("EMPS, test record, equation error", 0.124, &fit.validation),
    ];
    for (what, published, errors) in errors {
        figures.push(Figure {
            what,
            unit: "% NMSE",
            published: Some(published),
            aim: published,
            equation: errors.first().map_or(f64::NAN, |e| e.nmse_percent),
            simulation: None,
            model: chosen.name.clone(),
        });
    }
    Ok(figures)
}

/// The electronic oscillator; nothing where its file is not there.
///
/// # Errors
/// As [`emps`].
pub fn silverbox(told: &dyn Fn(&str)) -> Result<Vec<Figure>, String> {
    let Some(chosen) = Chosen::of(&SILVERBOX, told)? else {
        return Ok(Vec::new());
    };
    let rows = [
        ("Silverbox, multisine", Some(0.301), 0.5),
        ("Silverbox, full arrow", Some(0.60), 0.6),
        ("Silverbox, arrow without extrapolation", Some(0.259), 0.4),
    ];
    chosen.figures("mV RMS", 1e3, &rows)
}

/// The simulated hysteretic oscillator.
///
/// # Errors
/// As [`emps`].
pub fn hysteretic(told: &dyn Fn(&str)) -> Result<Vec<Figure>, String> {
    let Some(chosen) = Chosen::of(&BOUC_WEN, told)? else {
        return Ok(Vec::new());
    };
    let rows = [
        ("Bouc–Wen, multisine", Some(7.5), 3.0),
        ("Bouc–Wen, sine sweep", None, 1.0),
    ];
    chosen.figures("µm RMS", 1e6, &rows)
}

/// Figures as the page has them: three significant digits.
pub(crate) fn digits(value: f64) -> String {
    if !value.is_finite() {
        return "diverges".into();
    }
    let places = (2 - value.abs().max(1e-9).log10().floor() as i32).max(0) as usize;
    format!("{value:.places$}")
}

/// The table of the page.
pub fn table(figures: &[Figure]) -> String {
    let mut text = String::from(
        "| set | unit | best published | aim | fit to the equation | refined by simulation | model |\n|---|---|--:|--:|--:|--:|---|\n",
    );
    for figure in figures {
        let published = figure.published.map_or("none".into(), |p| p.to_string());
        let simulation = figure.simulation.map_or("none".into(), digits);
        let _ = writeln!(
            text,
            "| {} | {} | {published} | {} | {} | {simulation} | {} |",
            figure.what,
            figure.unit,
            figure.aim,
            digits(figure.equation),
            figure.model
        );
    }
    text
}

/// A page with another table between two marks.
///
/// # Errors
/// One sentence when the marks are not there.
pub fn with_table(page: &str, marks: [&str; 2], table: &str) -> Result<String, String> {
    let missing = || format!("the page has no {} and {}", marks[0], marks[1]);
    let (before, rest) = page.split_once(marks[0]).ok_or_else(missing)?;
    let (_, after) = rest.split_once(marks[1]).ok_or_else(missing)?;
    Ok(format!(
        "{before}{}\n\n{table}\n{}{after}",
        marks[0], marks[1]
    ))
}

//! `jointwatch identify`: learn a model from the training records of a study.

use super::accumulate;
use super::identify_network::{self, NetworkArguments};
use super::merge;
use crate::assess::compare;
use crate::cli::console::Console;
use crate::cli::report::Report;
use crate::fit::identify::{self, Identified, from_sums};
use crate::fit::polynomial::{Method, PolynomialOptions};
use crate::model::file::ModelFile;
use crate::model::values;
use crate::report::page::Asked;
use crate::simulate::refine::{self, Refinement};
use crate::study::Study;
use crate::text::error::{Error, Result};
use crate::text::output;
use crate::text::table::{Table, sample_rate};
use clap::{Args, ValueEnum};
use indicatif::ProgressBar;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Which kind of model.
#[derive(Clone, Copy, ValueEnum)]
enum Kind {
    /// Powers and products of the states: 256 terms per axis for two axes, 16 for one.
    Polynomial,
    /// A layer of tanh neurons that all axes share, trained from several random starts; Ctrl-C
    /// keeps the best weights so far.
    Network,
    /// A sum of physical effects, those of the study's [base] terms, with a value, unit and
    /// interval for every parameter.
    Physical,
}

/// How the coefficients are found.
#[derive(Clone, Copy, ValueEnum)]
enum Fit {
    /// Ridge, its weight chosen by cross-validation over contiguous blocks of every record.
    Ridge,
    /// Plain least squares, as in the paper.
    LeastSquares,
    /// Few terms of total degree up to 6, chosen by orthogonal forward selection and the same
    /// cross-validation.
    Select,
}

/// What a model is made to fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Criterion {
    /// The equation of motion at the measured states.
    Equation,
    /// The measured motion: refines a physical model or a polynomial until the motion that
    /// `respond` simulates fits.
    Simulation,
}

/// What `--json` holds: the model, and what a refinement came to.
#[derive(Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    model: &'a ModelFile,
    #[serde(skip_serializing_if = "Option::is_none")]
    simulation: Option<&'a Refinement>,
}

/// Options of `jointwatch identify`.
#[derive(Args)]
pub(crate) struct Identify {
    /// The study: its study.toml, or the folder that holds it; may be left out with --from.
    study: Option<PathBuf>,
    /// Learn from sums that `accumulate` or `merge` wrote; a study beside them is what the errors
    /// are measured on.
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
    /// Which kind of model to learn.
    #[arg(long, value_enum)]
    model: Kind,
    /// How to find the coefficients of a polynomial [default: ridge].
    #[arg(long, value_enum)]
    fit: Option<Fit>,
    /// Highest exponent of each state in a polynomial, 0 to 3: m,n,o,p for two axes (x, velocity
    /// of x, phi, velocity of phi), m,n for one, m,n,o with an input; 3 each when left out.
    #[arg(long, value_name = "M,N[,O[,P]]", value_delimiter = ',', value_parser = clap::value_parser!(u8).range(0..=3))]
    order: Option<Vec<u8>>,
    /// The input of the study that a polynomial or a network of one axis takes as its third state,
    /// or none; the study's only one when left out.
    #[arg(long, value_name = "NAME")]
    input: Option<String>,
    /// What the model is made to fit.
    #[arg(long, value_enum, default_value_t = Criterion::Equation)]
    criterion: Criterion,
    #[command(flatten)]
    network: NetworkArguments,
    /// Where to write the model.
    #[arg(short, long, value_name = "FILE", default_value = "model.json")]
    output: PathBuf,
    #[command(flatten)]
    page: Report,
}

impl Identify {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        match self.model {
            Kind::Polynomial => self.network.refuse("polynomial")?,
            Kind::Network => {
                self.refuse_polynomial_options("network")?;
                if self.criterion == Criterion::Simulation {
                    return Err(refine::refuse_network());
                }
            }
            Kind::Physical => {
                self.network.refuse("physical")?;
                self.refuse_polynomial_options("physical")?;
                if let Some(input) = &self.input {
                    return Err(Error::usage(format!(
                        "--input is for --model polynomial and network; the effects of a physical model say themselves what they follow: \
                         \"effect*{input}@axis\""
                    )));
                }
            }
        }
        let study = match (&self.from, &self.study) {
            (Some(sums), _) => return self.run_from(console, sums),
            (None, Some(study)) => study,
            (None, None) => {
                return Err(Error::usage(
                    "there is nothing to learn from; name a study, or sums with --from",
                ));
            }
        };
        let working = console.working("reading the records");
        let study = Study::read(study)?;
        self.page.check(console, Some(&self.output), &study)?;
        let identified = match self.model {
            Kind::Polynomial => self.fit_polynomial(&study, &working)?,
            Kind::Network => self.network.train(&study, self.input.clone(), &working)?,
            Kind::Physical => {
                working.set_message("fitting the effects");
                identify::physical(&study)?
            }
        };
        let (identified, refinement) = match self.criterion {
            Criterion::Equation => (identified, None),
            Criterion::Simulation => {
                let told = |what: &str| working.set_message(what.to_owned());
                let refined = refine::refine(&study, &identified.model, &told)?;
                let kept = refined.refinement.kept;
                let identified = if kept {
                    identified.replaced(refined.model)
                } else {
                    identified
                };
                (identified, Some(refined.refinement))
            }
        };
        let page = self.page.page(Asked::of_model(&study, &identified.model))?;
        working.finish_and_clear();
        identified.model.write(&self.output)?;
        console.say_first_checks(&study)?;
        report(console, &study, &identified)?;
        if let Some(refinement) = &refinement {
            say_refinement(console, refinement, &study)?;
        }
        console.say(format!("\nModel written to {}.", self.output.display()))?;
        self.page.write(console, page)?;
        console.json(&Printed {
            model: &identified.model,
            simulation: refinement.as_ref(),
        })
    }

    /// Learns from sums, with the errors on a study's records where one is given.
    fn run_from(&self, console: &Console, sums: &Path) -> Result<()> {
        if self.criterion == Criterion::Simulation {
            return Err(Error::usage(
                "--criterion simulation needs records, which sums are not; leave out --from",
            ));
        }
        if self.input.is_some() {
            return Err(Error::usage(
                "sums hold the motion and no input; leave out --input, or learn from the records without --from",
            ));
        }
        output::check(&self.output)?;
        let part = merge::read(sums)?;
        let study = self.study.as_deref().map(Study::read).transpose()?;
        let written: Vec<&Path> = [self.output.as_path()]
            .into_iter()
            .chain(self.page.outputs())
            .collect();
        match &study {
            Some(study) => console.check_outputs(&written, study)?,
            None if written.len() > 1 => {
                return Err(Error::usage(
                    "--report draws records; name a study beside --from",
                ));
            }
            None => {}
        }
        let identified = match self.model {
            Kind::Polynomial => {
                from_sums::polynomial(&part, &self.polynomial_options(), study.as_ref())?
            }
            Kind::Physical => from_sums::physical(&part, study.as_ref())?,
            Kind::Network => {
                return Err(Error::usage(
                    "a network is trained on records and not on sums; leave out --from, or learn a polynomial",
                ));
            }
        };
        let page = match &study {
            Some(study) => self.page.page(Asked::of_model(study, &identified.model))?,
            None => None,
        };
        identified.model.write(&self.output)?;
        accumulate::say(console, &part)?;
        report_model(console, &identified)?;
        console.say(format!("\nModel written to {}.", self.output.display()))?;
        self.page.write(console, page)?;
        console.json(&identified.model)
    }

    fn refuse_polynomial_options(&self, model: &str) -> Result<()> {
        let given = [
            ("--fit", self.fit.is_some()),
            ("--order", self.order.is_some()),
        ];
        match given.into_iter().find(|(_, given)| *given) {
            Some((option, _)) => Err(Error::usage(format!(
                "{option} is an option of --model polynomial and says nothing about --model {model}; leave it out"
            ))),
            None => Ok(()),
        }
    }

    fn fit_polynomial(&self, study: &Study, working: &ProgressBar) -> Result<Identified> {
        working.set_message("fitting the polynomial");
        identify::polynomial(study, &self.polynomial_options(), &|done| {
            working.set_message(format!("fitting the polynomial, {:.0} %", 100.0 * done));
        })
    }

    fn polynomial_options(&self) -> PolynomialOptions {
        PolynomialOptions {
            orders: self.order.clone(),
            input: self.input.clone(),
            method: match self.fit {
                None | Some(Fit::Ridge) => Method::Ridge,
                Some(Fit::LeastSquares) => Method::LeastSquares,
                Some(Fit::Select) => Method::Select,
            },
        }
    }
}

/// Prints both errors before and after; what speaks against a refinement that was kept is among the
/// model's warnings.
fn say_refinement(console: &Console, refinement: &Refinement, study: &Study) -> Result<()> {
    console.say(format!("\n{}", refine::in_words(refinement, study)))?;
    if !refinement.kept {
        console.say_notes(&refinement.notes)?;
    }
    Ok(())
}

/// A clause as a sentence.
fn sentence(clause: &str) -> String {
    let mut letters = clause.chars();
    let first = letters
        .next()
        .map(|c| c.to_uppercase().to_string())
        .unwrap_or_default();
    format!("{first}{}.", letters.as_str())
}

/// Prints what was read, what was learnt, and what to be wary of.
fn report(console: &Console, study: &Study, identified: &Identified) -> Result<()> {
    let model = &identified.model;
    let trained = study
        .records
        .iter()
        .filter(|r| r.role == crate::study::Role::Train);
    let rows: usize = trained.clone().map(|r| r.rows).sum();
    let records = match trained.count() {
        1 => "1 training record".to_string(),
        count => format!("{count} training records"),
    };
    console.say(format!(
        "Study '{}': {records}, {rows} rows{}.\n{}",
        study.name,
        match study.quasi_static {
            true => String::new(),
            false => format!(" at {}", sample_rate(study.sample_rate_hz)),
        },
        sentence(&model.filters.reason)
    ))?;
    console.say_notes(&study.notes)?;
    report_model(console, identified)
}

/// Prints what was learnt, and what to be wary of.
fn report_model(console: &Console, identified: &Identified) -> Result<()> {
    let model = &identified.model;
    super::say_inertias(console, model, |axis| identified.inertia_error(axis))?;
    match &identified.training {
        Some(training) => identify_network::report(console, &model.axes, training)?,
        None if model.effects.is_empty() => report_polynomial(console, identified)?,
        None => console.say(format!(
            "\nPhysical model, a sum of {} effects:\n{}",
            model.effects.len(),
            values::table(&model.effects)
        ))?,
    }
    if !model.verification.is_empty() {
        compare::say_summary(
            &model.verification,
            "Verification (training records)",
            |text| console.say(text),
        )?;
    }
    if model.validation.is_empty() {
        console.say(
            "Validation: there is no record with role = \"validate\", so nothing says how well this model does on \
             motions it has not seen.",
        )?;
    } else {
        compare::say_summary(&model.validation, "Validation (other records)", |text| {
            console.say(text)
        })?;
    }
    console.say_warnings(&model.warnings)
}

/// Prints how the coefficients were found, and the equations that are short enough to read.
fn report_polynomial(console: &Console, identified: &Identified) -> Result<()> {
    let model = &identified.model;
    let mut table = Table::new(&[
        "axis",
        "terms",
        "ridge",
        "effective parameters",
        "cross-validation NMSE",
    ]);
    for fit in &model.fits {
        table.row(vec![
            fit.axis.clone(),
            fit.terms.to_string(),
            if fit.ridge > 0.0 {
                format!("{:.1e}", fit.ridge)
            } else {
                "none".into()
            },
            format!("{:.1}", fit.effective_parameters),
            fit.cross_validation_nmse_percent
                .map_or("none".into(), |nmse| format!("{nmse:.3} %")),
        ]);
    }
    console.say(format!("\nPolynomial, {} fit:\n{table}", model.fit))?;
    for equation in identified.equations() {
        console.say(equation)?;
    }
    Ok(())
}

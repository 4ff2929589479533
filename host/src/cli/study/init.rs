//! `jointwatch init`: from logs to a study.toml that explains itself.

use super::survey;
use crate::cli::console::Console;
use crate::study::draft::{self, Draft, UserChoices};
use crate::study::joined::PLUS;
use crate::study::survey::Survey;
use crate::study::{Study, mistakes};
use crate::text::error::{Error, Result};
use crate::text::output;
use crate::text::table::short;
use clap::Args;
use std::io::{BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

/// Options of `jointwatch init`.
#[derive(Args)]
pub(crate) struct Init {
    /// The logs of one rig, one file per run, in any format that can be read.
    #[arg(required = true)]
    logs: Vec<PathBuf>,
    /// Ask nothing: take every guess and mark it "# guessed".
    #[arg(long)]
    yes: bool,
    /// Say which column is what: ROLE is time (time=none: a quasi-static log), displacement,
    /// velocity, acceleration or force (force=0: none is applied, as in a free decay or on a
    /// shaken base); may be given several times.
    #[arg(long = "column", value_name = "ROLE=COLUMN", value_parser = role)]
    columns: Vec<(String, String)>,
    /// Samples per second, where no column counts the time.
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Inertia of the body, kg or kg·m²; identified from the data when left out.
    #[arg(long, value_name = "KG")]
    inertia: Option<f64>,
    /// Where to write the study.
    #[arg(short, long, value_name = "FILE", default_value = "study.toml")]
    output: PathBuf,
}

/// The roles that a column can be given.
const ROLES: [&str; 5] = ["time", "displacement", "velocity", "acceleration", "force"];

fn role(text: &str) -> std::result::Result<(String, String), String> {
    match text.split_once('=') {
        Some((role, column)) if ROLES.contains(&role) => Ok((role.into(), column.into())),
        _ => Err(format!(
            "write ROLE=COLUMN, with a role of {}",
            ROLES.join(", ")
        )),
    }
}

impl Init {
    pub(crate) fn run(self, console: &Console) -> Result<()> {
        if self.output.exists() {
            return Err(Error::usage(format!(
                "{} exists already; name another file with -o, or remove it first",
                self.output.display()
            )));
        }
        output::check(&self.output)?;
        let ask = !self.yes;
        if ask && !std::io::stdin().is_terminal() {
            return Err(Error::usage(
                "there is no terminal to ask on; give --yes to take the guesses, which the file marks \"# guessed\"",
            ));
        }
        self.check_values()?;
        let to_file = !output::is_standard(&self.output);
        if !to_file && console.json_file().is_some() {
            return Err(Error::usage(
                "-o - writes the study to standard output, so that --json has no study to tell of; name a file with -o",
            ));
        }
        let working = console.working("reading the logs");
        let logs: Vec<&Path> = self.logs.iter().map(PathBuf::as_path).collect();
        let surveys = match self.is_free() {
            // Free decays are runs of one channel each.
            true => logs
                .iter()
                .map(|log| Survey::of(log))
                .collect::<Result<_>>()?,
            false => Survey::of_all(&logs)?,
        };
        working.finish_and_clear();
        for survey in surveys.iter().filter(|_| to_file) {
            console.say(survey::in_words(survey, false))?;
        }
        let mut said = UserChoices {
            columns: self.columns.clone(),
            sample_rate_hz: self.rate,
            inertia: self.inertia,
        };
        if ask {
            ask_columns(&surveys[0], &mut said)?;
        }
        let mut draft = draft::draft(&surveys, &said)?;
        let folder = output::folder_of(&self.output).to_owned();
        name_files(&mut draft, &folder);
        if ask && said.inertia.is_none() {
            ask_inertia(&mut draft)?;
        }
        output::write_whole(&self.output, draft::text(&draft).as_bytes())?;
        if !to_file {
            return Ok(());
        }
        // What is wrong with the study now would be met by the next command; it is said here.
        let study = Study::read(&self.output).map_err(|mut error| {
            // A file that no command takes would be in the way of the next try.
            let _ = std::fs::remove_file(&self.output);
            error
                .sentence
                .push_str(&format!("; {} was not written", self.output.display()));
            error
        })?;
        self.report(console, &draft, &study)
    }

    /// Whether nothing is applied in the logs.
    fn is_free(&self) -> bool {
        self.columns.contains(&("force".to_owned(), "0".to_owned()))
    }

    /// Refuses what is no rate and no inertia, and what cannot hold at once.
    fn check_values(&self) -> Result<()> {
        let rate = self.rate.filter(|rate| !(rate.is_finite() && *rate > 0.0));
        let inertia = self.inertia.filter(|m| !(m.is_finite() && *m >= 0.0));
        if let Some(value) = rate {
            return Err(Error::usage(format!(
                "--rate {value}: a rate is a number above 0, in Hz"
            )));
        }
        if let Some(value) = inertia {
            return Err(Error::usage(format!(
                "--inertia {value}: an inertia is a number above 0, or 0 where the force is the joint's own"
            )));
        }
        let said = |role: &str| self.columns.iter().find(|(own, _)| own == role);
        let named = |role| said(role).map(|(role, column)| format!("--column {role}={column}"));
        let time = named("time");
        // Without time only the path counts.
        let timeless = time.clone().filter(|time| time.ends_with("=none"));
        let pairs = [
            (self.rate.map(|rate| format!("--rate {rate}")), time),
            (named("velocity"), timeless.clone()),
            (named("acceleration"), timeless),
        ];
        match pairs.into_iter().find_map(|(a, b)| a.zip(b)) {
            None => Ok(()),
            Some((a, b)) => Err(Error::usage(format!(
                "{a} and {b} contradict each other; leave one of them out"
            ))),
        }
    }

    fn report(&self, console: &Console, draft: &Draft, study: &Study) -> Result<()> {
        for finding in &draft.findings {
            console.say(format!("Guessed: {finding}."))?;
        }
        console.say(format!(
            "\n{} written; what was guessed is marked in it.",
            self.output.display()
        ))?;
        console.say_notes(&study.notes)?;
        let found = mistakes::check(study);
        for sentence in &found {
            console.say(format!("Check: {sentence}."))?;
        }
        console.say(format!(
            "Next: jointwatch identify {} --model physical",
            self.output.display()
        ))?;
        console.json(&serde_json::json!({
            "study": self.output,
            "sample_rate_hz": study.sample_rate_hz,
            "guessed": draft.findings,
            "notes": study.notes,
            "checks": found,
        }))
    }
}

/// Files as study.toml names them: relative to its folder, with the folder's name as the study's.
fn name_files(draft: &mut Draft, folder: &Path) {
    let whole = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let folder = whole(folder);
    for record in &mut draft.records {
        let parts: Vec<&str> = match Path::new(&record.file).exists() {
            true => vec![&record.file],
            false => record.file.split(PLUS).collect(),
        };
        let relative = parts.iter().map(|part| {
            let path = whole(Path::new(part));
            let relative = path.strip_prefix(&folder).unwrap_or(&path);
            // Forward slashes work everywhere.
            relative.to_string_lossy().replace('\\', "/")
        });
        record.file = relative.collect::<Vec<_>>().join(PLUS);
    }
    if let Some(name) = folder.file_name() {
        draft.name = name.to_string_lossy().into_owned();
    }
}

/// Asks for what names and units do not tell.
fn ask_columns(survey: &Survey, said: &mut UserChoices) -> Result<()> {
    let names: Vec<&str> = survey.columns.iter().map(|c| c.name.as_str()).collect();
    let time = survey.time.as_ref().map(|t| t.column.clone());
    for (role, guess) in [
        ("time", time),
        ("force", survey.likeliest("force")),
        ("displacement", survey.likeliest("displacement")),
    ] {
        if said.columns.iter().any(|(r, _)| r == role) || guess.is_some() {
            continue;
        }
        if role == "time" && (said.sample_rate_hz.is_some() || survey.rate.is_some()) {
            continue;
        }
        let none = match role {
            "force" => "; 0 where none is applied",
            _ => "",
        };
        let answer = ask(&format!(
            "Which column is the {role}? ({}{none}) ",
            names.join(", ")
        ))?;
        if role == "time" && answer.parse::<f64>().is_ok_and(|rate| rate > 0.0) {
            said.sample_rate_hz = answer.parse().ok();
        } else if !answer.is_empty() {
            said.columns.push((role.to_owned(), answer));
        }
    }
    Ok(())
}

/// Asks for the inertia, which only the user can know; Enter leaves it to be identified.
fn ask_inertia(draft: &mut Draft) -> Result<()> {
    for axis in &mut draft.axes {
        if axis.inertia.is_some() {
            continue;
        }
        let seen = axis.inertia_seen.map_or(String::new(), |m| {
            format!("the logs say about {}; ", short(m))
        });
        let answer = ask(&format!(
            "Inertia of axis {} in {}? ({seen}Enter: identify it) ",
            axis.name,
            axis.kind.inertia_unit()
        ))?;
        if !answer.is_empty() {
            let value: f64 = answer
                .replace(',', ".")
                .parse()
                .map_err(|_| Error::usage(format!("{answer:?} is not a number; start again")))?;
            axis.inertia = Some(value);
        }
    }
    Ok(())
}

/// One line from the terminal.
fn ask(question: &str) -> Result<String> {
    let failed = |e: std::io::Error| {
        Error::failed(format!("the terminal could not be used ({e}); give --yes"))
    };
    let mut out = std::io::stderr().lock();
    write!(out, "{question}")
        .and_then(|()| out.flush())
        .map_err(failed)?;
    let mut line = String::new();
    std::io::stdin()
        .lock()
        .read_line(&mut line)
        .map_err(failed)?;
    Ok(line.trim().to_owned())
}

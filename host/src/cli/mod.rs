//! The command line: its subcommands, its global options, its exit codes.

mod console;
mod demo;
mod device;
mod effects;
mod examples;
mod lab;
mod model;
mod outputs;
mod paper;
mod plots;
mod progress_lines;
mod report;
mod study;
mod terminal;

use crate::text::error::{Error, Result};
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use console::Console;
use device::{capture, emulate, export, keygen, monitor, order, replay, sign, study_from, upload};
use model::{accumulate, add, changed, compare, diagnose, identify, merge, respond};
use std::path::PathBuf;
use std::process::ExitCode;
use study::{init, inspect, select, simulate};

/// Learn a mechanical joint's restoring force from rig logs, compare the model with measurements,
/// and export it for a microcontroller.
///
/// Exit codes: 0 done; 1 could not be done; 2 wrong use; 3 bad data; 4 what --fail-on names was
/// found.
#[derive(Parser)]
#[command(name = "jointwatch", version, max_term_width = 110)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    global: Global,
}

#[derive(Args)]
struct Global {
    /// Write what was found as JSON to this file; - for standard output, in place of the text.
    #[arg(long, global = true, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Say nothing but errors.
    #[arg(long, global = true)]
    quiet: bool,
    /// Threads to compute with; one per core when left out.
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Progress as lines on standard error.
    #[arg(long, global = true, hide = true)]
    progress_lines: bool,
}

#[derive(Subcommand)]
enum Command {
    /// Run a 10-second demo: a simulated rig with one effect hidden in its joint, which the tool
    /// then finds, up to the firmware on an emulated microcontroller.
    Demo(demo::Demo),
    /// Simulate a rig with a nonlinear joint and write its study: study.toml, records, and the
    /// truth beside them.
    Simulate(simulate::Simulate),
    /// Write a study.toml for your logs: guesses columns, units, rate, signs and roles, and
    /// explains every key.
    Init(init::Init),
    /// Learn a model from the training records of a study.
    Identify(identify::Identify),
    /// Sum records into a part: parts of any records merge exactly, and `identify --from` makes a
    /// model of them.
    Accumulate(accumulate::Accumulate),
    /// Add up parts that `accumulate` wrote; any order and any partition gives the same bytes.
    Merge(merge::Merge),
    /// Make a smaller study of many records: segments that cover state space, amplitude and time,
    /// the same ones in any order.
    Select(select::Select),
    /// Compare a model with the records of a study, verification and validation apart, and say
    /// where it fails.
    Compare(compare::Compare),
    /// Say which physical effect a model lacks, how sure that is, and where it fails; or that
    /// nothing is missing, that it is something unknown, or that the data are at fault.
    Diagnose(diagnose::Diagnose),
    /// Say what is different in a joint since its model was made: parameters, effects, and the old
    /// model's error then and now.
    Changed(changed::Change),
    /// Add physical effects to a model, find all values anew, and show the errors before and after.
    Add(add::Add),
    /// List the physical effects, or explain one: equation, parameters, what its absence looks
    /// like, its loop.
    Effects(effects::Effects),
    /// Turn a model into the blob that the device evaluates.
    Export(export::Export),
    /// Show what a log, a model or a blob holds.
    Inspect(inspect::Inspect),
    /// Run the device's integer code on the records of a study, from raw counts on.
    Replay(replay::Replay),
    /// Run the firmware itself under QEMU, its sensor chips fed with the records of a study, and
    /// compare every bit with replay; or, with --serve, let it run on and on for `monitor
    /// --tcp`.
    Emulate(emulate::Emulate),
    /// Show what a device says, from its serial port, a TCP address or a file that holds it: on a
    /// terminal as a screen with state, plots and sensors, else as a line per message.
    ///
    /// Ends with the file, with --seconds, with q or Ctrl-C, and then says how many messages were
    /// lost or damaged. With --json FILE every message is a line of JSON, written as it comes;
    /// --json - prints those in place of the text.
    Monitor(monitor::Monitor),
    /// Fetch the counts that a device keeps from before and after its alarm, as a file for
    /// study-from.
    Capture(capture::Capture),
    /// Turn what a device sent into records and a study.toml, lost frames into gaps.
    StudyFrom(study_from::StudyFrom),
    /// Put a model in place of the joint, integrate the equation of motion for a record's drive,
    /// and compare the motions.
    Respond(respond::Respond),
    /// Open a local page on which the whole loop is done with a mouse: read a log, identify,
    /// compare, see what is missing, add it, undo, export.
    Lab(lab::Lab),
    /// Hold the tool against the paper it comes from: its figures and its two headline ratios,
    /// computed anew, as a page.
    Paper(paper::Paper),
    /// Make a pair of keys: one to sign models with, one to build into the firmware.
    Keygen(keygen::Keygen),
    /// Have a device restart, go back, acknowledge or revoke a key, signed.
    Order(order::Order),
    /// Sign a blob, so that a device takes it.
    Sign(sign::Sign),
    /// Put a signed model onto a device, over its serial port.
    Upload(upload::Upload),
    /// Explain every key of study.toml, or print its JSON Schema for an editor.
    Study(terminal::StudyKeys),
    /// Write what a shell needs to complete commands and options, to standard output.
    Completions(terminal::Completions),
    /// Write man pages of the program and of each command into a folder.
    Manual(terminal::Manual),
}

/// The whole command line, with examples in every help.
fn command_line() -> clap::Command {
    examples::with_examples(Cli::command())
}

impl Cli {
    /// Reads the command line of this process, with examples in every help; ends the process where
    /// it is wrong or asks for help.
    pub fn from_command_line() -> Self {
        let mut command = command_line();
        let matches = command.get_matches_mut();
        if let Some((name, typed)) = matches.subcommand()
            && let Some(subcommand) = command.find_subcommand(name)
            && let Err(e) = outputs::refuse_overwriting(subcommand, typed)
        {
            eprintln!("jointwatch: {}", e.line());
            std::process::exit(e.exit_code().into());
        }
        Self::from_arg_matches(&matches).unwrap_or_else(|e| e.exit())
    }
}

/// Runs the subcommand that was given.
fn perform(command: Command, console: &Console) -> Result<()> {
    match command {
        Command::Demo(command) => command.run(console, run_words),
        Command::Simulate(command) => command.run(console),
        Command::Init(command) => command.run(console),
        Command::Identify(command) => command.run(console),
        Command::Accumulate(command) => command.run(console),
        Command::Merge(command) => command.run(console),
        Command::Select(command) => command.run(console),
        Command::Compare(command) => command.run(console),
        Command::Diagnose(command) => command.run(console),
        Command::Changed(command) => command.run(console),
        Command::Add(command) => command.run(console),
        Command::Effects(command) => command.run(console),
        Command::Export(command) => command.run(console),
        Command::Inspect(command) => command.run(console),
        Command::Replay(command) => command.run(console),
        Command::Emulate(command) => command.run(console),
        Command::Monitor(command) => command.run(console),
        Command::Capture(command) => command.run(console),
        Command::StudyFrom(command) => command.run(console),
        Command::Keygen(command) => command.run(console),
        Command::Order(command) => command.run(console),
        Command::Sign(command) => command.run(console),
        Command::Upload(command) => command.run(console),
        Command::Study(command) => command.run(console),
        Command::Completions(completions) => completions.run(console, command_line()),
        Command::Manual(manual) => manual.run(console, command_line()),
        Command::Lab(command) => command.run(console),
        Command::Respond(command) => command.run(console),
        Command::Paper(command) => command.run(console),
    }
}

/// Runs a command given as words, as a user would type them.
fn run_words(words: &[&str], quiet: bool) -> Result<()> {
    let words = std::iter::once(&"jointwatch").chain(words);
    let cli = Cli::try_parse_from(words).map_err(|e| Error::usage(e.kind().to_string()))?;
    perform(cli.command, &Console::new(cli.global.json, quiet))
}

/// Runs one command and reports its failure as one sentence on standard error.
pub fn run(cli: Cli) -> ExitCode {
    if let Some(threads) = cli.global.threads
        && let Err(e) = rayon::ThreadPoolBuilder::new()
            .num_threads(threads as usize)
            .build_global()
    {
        eprintln!("jointwatch: {threads} threads could not be started ({e})");
        return ExitCode::from(1);
    }
    let console = Console::new(cli.global.json, cli.global.quiet)
        .with_progress_lines(cli.global.progress_lines);
    let done = perform(cli.command, &console);
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("jointwatch: {}", e.line());
            ExitCode::from(e.exit_code())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::examples::EXAMPLES;
    use super::{Cli, command_line};
    use clap::CommandFactory;

    #[test]
    fn every_command_has_two_examples_that_can_be_typed() {
        let commands: Vec<String> = Cli::command()
            .get_subcommands()
            .map(|c| c.get_name().to_owned())
            .collect();
        let named: Vec<&str> = EXAMPLES.iter().map(|(name, _)| *name).collect();
        for name in &commands {
            assert!(named.contains(&name.as_str()), "{name} has no examples");
        }
        assert_eq!(commands.len(), named.len());
        for (name, lines) in EXAMPLES {
            for line in lines {
                let words: Vec<&str> = line.split(' ').collect();
                assert_eq!(words[1], name, "{line}");
                command_line()
                    .try_get_matches_from(words)
                    .unwrap_or_else(|e| panic!("{line}: {e}"));
            }
        }
    }
}

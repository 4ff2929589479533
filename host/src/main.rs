//! The command line of Jointwatch: `jointwatch SUBCOMMAND`.

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    jointwatch::cli::run(jointwatch::cli::Cli::parse())
}

//! The command line of Jointwatch: `jointwatch SUBCOMMAND`.

use std::process::ExitCode;

fn main() -> ExitCode {
    jointwatch::cli::run(jointwatch::cli::Cli::from_command_line())
}

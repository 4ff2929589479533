//! The images that run on the device: which board they are for, and how they are found or built.

use crate::text::error::{Error, Result};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A processor that an image is made for, and the machine of QEMU that has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Board {
    /// STM32F405, a Cortex-M4F; QEMU's `netduinoplus2`.
    Stm32f405,
    /// nRF51822, a Cortex-M0, for the self-test only; QEMU's `microbit`.
    Microbit,
}

impl Board {
    /// The name of QEMU's machine.
    pub fn machine(self) -> &'static str {
        match self {
            Board::Stm32f405 => "netduinoplus2",
            Board::Microbit => "microbit",
        }
    }

    /// The name of the compiler's target.
    pub fn target(self) -> &'static str {
        match self {
            Board::Stm32f405 => "thumbv7em-none-eabihf",
            Board::Microbit => "thumbv6m-none-eabi",
        }
    }

    /// The feature of the firmware's package.
    fn feature(self) -> &'static str {
        match self {
            Board::Stm32f405 => "stm32f405",
            Board::Microbit => "microbit",
        }
    }

    /// Whether QEMU gives it a timer that counts single instructions.
    pub(super) fn counts_instructions(self) -> bool {
        self == Board::Stm32f405
    }
}

/// The environment variable that names a self-test image built beforehand, for use away from the
/// source.
const SELFTEST: &str = "JOINTWATCH_SELFTEST";

/// The self-test image of `board`: built from the source, or for the STM32F405 the file that
/// `JOINTWATCH_SELFTEST` names.
///
/// # Errors
/// As [`build`].
pub fn selftest(board: Board) -> Result<PathBuf> {
    match std::env::var_os(SELFTEST) {
        Some(file) if board == Board::Stm32f405 => Ok(file.into()),
        _ => build(board, "selftest"),
    }
}

/// The environment variable that names an image for `emulate` that was built beforehand.
const EMULATED: &str = "JOINTWATCH_EMULATED";

/// The image that is flashed, but with sensor chips, serial line and sampling clock behind two
/// pipes of the host: built from the source, or the file that `JOINTWATCH_EMULATED` names.
///
/// # Errors
/// As [`build`].
pub fn emulated() -> Result<PathBuf> {
    match std::env::var_os(EMULATED) {
        Some(file) => Ok(file.into()),
        None => build(Board::Stm32f405, "jointwatch-link"),
    }
}

/// Builds one image of the firmware with cargo, as it is flashed, and gives the path of its ELF
/// file.
///
/// `image` is `jointwatch`, `jointwatch-link` or `selftest`. Takes no time when it is built
/// already.
///
/// # Errors
/// When the source is not where this program was built from, when the compiler's target for the
/// device is not installed, and when the build fails.
pub fn build(board: Board, image: &str) -> Result<PathBuf> {
    // The image for tests has its chips and its line behind two files.
    let feature = match image {
        "jointwatch-link" => "semihosting-link",
        _ => board.feature(),
    };
    let workspace = workspace()?;
    // Set when cargo runs this program or its tests; it then is the cargo of the same toolchain.
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| OsString::from("cargo"));
    let output = Command::new(&cargo)
        .current_dir(workspace)
        .args(["build", "--quiet", "--profile", "device", "-p", "jointwatch-firmware"])
        .args(["--target", board.target(), "--features", feature])
        .args(["--bin", image, "--message-format", "json"])
        // Flags meant for this computer's processor would not suit the device's.
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .stdin(Stdio::null())
        .output()
        .map_err(|why| {
            Error::failed(format!(
                "the firmware cannot be built because cargo does not start ({why}): put cargo on the search path, \
                 or set {SELFTEST} to a self-test image"
            ))
        })?;
    let messages = String::from_utf8_lossy(&output.stdout);
    if output.status.success() {
        executable(&messages).ok_or_else(|| {
            Error::failed(format!(
                "cargo built the firmware's {image}, but does not say where"
            ))
        })
    } else {
        let complaints = String::from_utf8_lossy(&output.stderr);
        Err(Error::failed(refusal(
            board,
            &format!("{messages}\n{complaints}"),
        )))
    }
}

/// The folder of the workspace that this program was built from.
fn workspace() -> Result<&'static Path> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package
        .parent()
        .filter(|workspace| workspace.join("firmware/Cargo.toml").is_file())
        .ok_or_else(|| {
            Error::failed(format!(
                "the firmware's source is no longer where this program was built: set {SELFTEST} to a self-test image"
            ))
        })
}

/// The path of the program in cargo's JSON messages, one per line.
fn executable(messages: &str) -> Option<PathBuf> {
    messages
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .find_map(|message| message.get("executable")?.as_str().map(PathBuf::from))
}

/// Why the build failed, as a sentence.
fn refusal(board: Board, said: &str) -> String {
    let target = board.target();
    if said.contains("target may not be installed") || said.contains("can't find crate for `core`")
    {
        return format!(
            "the firmware cannot be built because the compiler lacks its target: run `rustup target add {target}`"
        );
    }
    // The compiler's errors come as JSON, cargo's own as text.
    let compilers = said.lines().find_map(|line| {
        let value = serde_json::from_str::<serde_json::Value>(line).ok()?;
        let message = value.get("message")?;
        let error = message.get("level")?.as_str()? == "error";
        error.then(|| message.get("message")?.as_str().map(str::to_owned))?
    });
    let cargos = || {
        let line = said.lines().find(|line| line.starts_with("error"));
        line.map(str::to_owned)
    };
    let why = compilers
        .or_else(cargos)
        .unwrap_or_else(|| "cargo gives no reason".to_owned());
    format!("the firmware for {target} does not build: {why}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_target_says_what_to_run() {
        let said = r#"{"reason":"compiler-message","message":{"level":"error","message":"can't find crate for `core`"}}"#;
        let sentence = refusal(Board::Microbit, said);
        assert!(
            sentence.ends_with("run `rustup target add thumbv6m-none-eabi`"),
            "{sentence}"
        );
    }

    #[test]
    fn other_failures_quote_the_compiler_or_cargo() {
        let said = r#"{"message":{"level":"warning","message":"w"}}
{"message":{"level":"error","message":"mismatched types"}}"#;
        assert!(refusal(Board::Stm32f405, said).ends_with("does not build: mismatched types"));
        let said = "warning: x\nerror: no space left\n";
        assert!(refusal(Board::Stm32f405, said).ends_with("does not build: error: no space left"));
    }

    #[test]
    fn the_program_is_found_among_cargos_messages() {
        let messages = "{\"reason\":\"compiler-artifact\",\"executable\":null}\nnoise\n{\"executable\":\"/t/selftest\"}\n";
        assert_eq!(executable(messages), Some(PathBuf::from("/t/selftest")));
        assert_eq!(executable("{}"), None);
    }
}

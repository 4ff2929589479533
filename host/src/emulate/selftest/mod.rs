//! The device without the device: runs the firmware's self-test in QEMU and reads what it says.
//!
//! The self-test evaluates a reference model, and the model in flash slot A when there is one, with
//! the firmware's own code on an emulated processor. Its digests are to equal the host's, computed
//! by [`jointwatch_shared::selftest::digest`] with the seed and number of points that the report
//! names.

mod image;
mod report;

pub use image::{Board, build, emulated, selftest};
pub use report::{ChainReport, Instructions, ModelReport, SelfTestReport, SlotReport, SlotState};

use crate::text::error::{Error, Result};
use std::ffi::OsString;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// Where slot A begins in the STM32F405's flash as `memory.x` divides it; a test compares the two.
pub const SLOT_A: u32 = 0x080C_0000;

/// Inputs over which instructions are counted: the 81 corner and centre points, the others random.
const COUNTED_INPUTS: u32 = 500;

/// QEMU's program for 32-bit Arm.
const QEMU: &str = "qemu-system-arm";

/// Where QEMU is, if it is on the search path.
pub fn find_qemu() -> Option<PathBuf> {
    let paths = std::env::var_os("PATH")?;
    std::env::split_paths(&paths)
        .map(|folder| {
            folder
                .join(QEMU)
                .with_extension(std::env::consts::EXE_EXTENSION)
        })
        .find(|file| file.is_file())
}

/// Where QEMU is, or the sentence that says how to get it.
///
/// # Errors
/// When QEMU is not on the search path.
pub fn require_qemu() -> Result<PathBuf> {
    find_qemu().ok_or_else(|| {
        Error::failed(format!(
            "{QEMU} is not on the search path: install it with `sudo apt-get install {QEMU}` (Debian, Ubuntu), \
             `sudo dnf install {QEMU}` (Fedora) or `brew install qemu` (macOS)"
        ))
    })
}

/// QEMU with the machine of `board`, without screen, serial port or prompt; the caller adds what is
/// to run.
pub fn machine(qemu: &Path, board: Board) -> Command {
    let mut command = Command::new(qemu);
    command.args(["-M", board.machine(), "-display", "none"]);
    command.args(["-serial", "none", "-monitor", "none"]);
    command
}

/// QEMU's option that puts a file into the flash of the emulated chip before it starts.
pub fn load_into_flash(file: &Path, address: u32) -> OsString {
    // QEMU splits options at commas; a doubled comma stands for itself.
    let path = file.display().to_string().replace(',', ",,");
    format!("loader,file={path},addr={address:#x},force-raw=on").into()
}

/// Runs the self-test image `elf` on the emulated `board`, with `blob` in slot A, over `points`
/// random points per model.
///
/// Runs it twice where the board can count instructions: once at full speed for the digests, once
/// in lockstep with the instruction counter over a few hundred inputs. A blob that the device
/// refuses is no error here: the report says so, and has not [passed](SelfTestReport::passed).
///
/// # Errors
/// When QEMU is missing or does not start, when the image does not come to an end in time, and when
/// its text is not that of a finished self-test.
pub fn run_selftest(
    board: Board,
    elf: &Path,
    blob: Option<&Path>,
    points: u32,
) -> Result<SelfTestReport> {
    let qemu = require_qemu()?;
    if let (Some(_), Board::Microbit) = (blob, board) {
        return Err(Error::usage(
            "the micro:bit has no slot for a model: emulate the STM32F405",
        ));
    }
    let start = |arguments: &str, counting: bool| {
        let mut command = machine(&qemu, board);
        let semihosting = format!("enable=on,target=native,arg=selftest,{arguments}");
        command.arg("-semihosting-config").arg(semihosting);
        if counting {
            // One instruction lasts 1 ns and TIM5 counts ns, so it counts instructions.
            command.args(["-icount", "shift=0"]);
            command.args(["-global", "stm32f2xx-timer.clock-frequency=1000000000"]);
        }
        if let Some(blob) = blob {
            command.arg("-device").arg(load_into_flash(blob, SLOT_A));
        }
        command.arg("-kernel").arg(elf);
        // Emulated, a point takes some microseconds on a Cortex-M4F and less than 100 on a
        // Cortex-M0.
        finish(command, Duration::from_secs(60 + u64::from(points) / 2000))
    };
    let mut report = start(&format!("arg=points={points}"), false)?;
    if board.counts_instructions() {
        report.add_counts(start(
            &format!("arg=points=0,arg=count={COUNTED_INPUTS}"),
            true,
        )?);
    }
    Ok(report)
}

/// Waits until the run has ended, at most `limit`, and reads its text.
fn finish(mut command: Command, limit: Duration) -> Result<SelfTestReport> {
    if let Some(missing) = command
        .get_args()
        .last()
        .map(Path::new)
        .filter(|elf| !elf.is_file())
    {
        return Err(Error::failed(format!(
            "the self-test image {} is not there",
            missing.display()
        )));
    }
    let started = Instant::now();
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|why| Error::failed(format!("QEMU could not be started: {why}")))?;
    // The text is taken up while the image runs, so that a full pipe cannot stop it.
    let text = collect(child.stdout.take());
    let complaints = collect(child.stderr.take());
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) if started.elapsed() < limit => thread::sleep(Duration::from_millis(5)),
            waited => {
                // Ending it can only fail when it has just ended by itself.
                let _ = child.kill();
                let _ = child.wait();
                return Err(Error::failed(match waited {
                    Err(why) => format!("QEMU could not be watched: {why}"),
                    Ok(_) => format!(
                        "the self-test did not end within {} s under QEMU: try fewer points",
                        limit.as_secs()
                    ),
                }));
            }
        }
    };
    let text = text.join().unwrap_or_default();
    let complaints = complaints.join().unwrap_or_default();
    let report = SelfTestReport::parse(&text).map_err(|what| {
        let said = complaints.lines().next().unwrap_or("nothing");
        Error::failed(format!(
            "the self-test under QEMU ended with {status}, and {what}; QEMU said: {said}"
        ))
    })?;
    if report.passed != status.success() {
        return Err(Error::failed(format!(
            "the self-test under QEMU says that it {}, but ended with {status}",
            if report.passed { "passed" } else { "failed" }
        )));
    }
    Ok(report)
}

/// Reads a pipe to its end, beside everything else.
fn collect(pipe: Option<impl Read + Send + 'static>) -> thread::JoinHandle<String> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut pipe) = pipe {
            // What was read until the pipe broke is what there is to judge.
            let _ = pipe.read_to_end(&mut bytes);
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comma_in_a_path_does_not_split_the_option() {
        assert_eq!(
            load_into_flash(Path::new("a,b/m.bin"), SLOT_A),
            "loader,file=a,,b/m.bin,addr=0x80c0000,force-raw=on"
        );
    }

    #[cfg(unix)]
    mod with_a_shell {
        use super::*;

        /// A run that prints `text` and ends with `code`; the shell's `$0` stands where the image's
        /// path would.
        fn ended(script: &str, limit: Duration) -> Result<SelfTestReport> {
            let mut command = Command::new("sh");
            command.args([
                "-c",
                script,
                concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"),
            ]);
            finish(command, limit)
        }

        #[test]
        fn a_run_that_hangs_is_ended_and_said_so() {
            let why = ended("exec sleep 60", Duration::from_millis(50)).unwrap_err();
            assert!(why.sentence.contains("did not end within"), "{why}");
        }

        #[test]
        fn silence_is_no_pass_even_with_exit_code_0() {
            let why = ended("true", Duration::from_secs(20)).unwrap_err();
            assert!(why.sentence.contains("QEMU said: nothing"), "{why}");
        }

        #[test]
        fn text_and_exit_code_have_to_agree() {
            let text = "echo board b; echo clock internal 1; echo errors 0; echo result passed";
            assert!(ended(text, Duration::from_secs(20)).is_ok());
            let why = ended(&format!("{text}; exit 1"), Duration::from_secs(20)).unwrap_err();
            assert!(why.sentence.contains("says that it passed"), "{why}");
        }
    }
}

//! The image under QEMU, with its two pipes: started, watched, and ended whatever happens.

use super::link::{Host, serve};
use crate::emulate::selftest::{self, Board, SLOT_A};
use crate::text::error::{Error, Result};
use std::fs::{File, OpenOptions};
use std::io::{BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// An image that makes no request for so long hangs; the longest work between two is the check of a
/// signature.
const SILENCE: Duration = Duration::from_secs(60);
/// Bytes of a slot's sector.
const SECTOR: usize = 128 * 1024;
/// The pipes' names in a folder of their own: the image's command line has little room.
const TO_DEVICE: &str = "to";
const FROM_DEVICE: &str = "from";

/// Runs the image `elf` with `slot` in slot A, its requests served by `host`, to its end; gives the
/// time that took.
///
/// # Errors
/// When QEMU or `mkfifo` is missing, and when the image ends in another way than with the record:
/// with an exit code, by hanging, or with a request that the link does not know.
pub fn run(elf: &Path, slot: &[u8], host: &mut impl Host) -> Result<Duration> {
    let qemu = selftest::require_qemu()?;
    let elf = elf.canonicalize().map_err(|e| {
        Error::failed(format!(
            "{}: the image to be emulated is not there ({e})",
            elf.display()
        ))
    })?;
    let folder = tempfile::tempdir()
        .map_err(|e| Error::failed(format!("no temporary folder could be made ({e})")))?;
    let slot_file = folder.path().join("slot");
    // Both sectors as an erased chip has them, and not as the zeros that QEMU's flash begins with.
    let mut flash = slot.to_vec();
    flash.resize(2 * SECTOR, 0xFF);
    std::fs::write(&slot_file, flash)
        .map_err(|e| Error::failed(format!("{}: {e}", slot_file.display())))?;
    let Pipes {
        mut answers,
        requests,
        keeper,
    } = Pipes::make(folder.path())?;
    let mut command = machine(&qemu, &elf, folder.path());
    let begun = Instant::now();
    let child = command
        .spawn()
        .map_err(|e| Error::failed(format!("QEMU could not be started: {e}")))?;
    let watch = Supervisor::over(child, keeper);
    let mut requests = BufReader::new(Heartbeat {
        pipe: requests,
        beats: Arc::clone(&watch.beats),
    });
    let served = serve(&mut requests, &mut answers, host);
    if served.is_err() {
        watch.stop.store(true, Ordering::Relaxed);
    }
    let (status, complaints, silent) = watch.end();
    if silent {
        return Err(Error::failed(format!(
            "the emulated device made no request for {} s and was ended",
            SILENCE.as_secs()
        )));
    }
    let ended = served?;
    if !ended || !status.is_some_and(|status| status.success()) {
        let status = status.map_or("no status".to_owned(), |status| status.to_string());
        let said = complaints.lines().next().unwrap_or("nothing");
        return Err(Error::failed(format!(
            "the emulated device ended before its record with {status}; QEMU said: {said}"
        )));
    }
    Ok(begun.elapsed())
}

/// The two pipes of a run, in a folder of their own.
struct Pipes {
    answers: File,
    requests: File,
    /// Holds the requests' pipe open until QEMU is gone.
    keeper: File,
}

impl Pipes {
    fn make(folder: &Path) -> Result<Self> {
        let made = Command::new("mkfifo")
            .current_dir(folder)
            .args([TO_DEVICE, FROM_DEVICE])
            .stdin(Stdio::null())
            .output();
        if !made.is_ok_and(|output| output.status.success()) {
            return Err(Error::failed(
                "the pipes to the emulated device could not be made: `mkfifo` is missing; run this on Linux or macOS",
            ));
        }
        // Opened for both ways neither end waits for the other.
        let both = |name: &str| {
            let path = folder.join(name);
            OpenOptions::new()
                .read(true)
                .write(true)
                .open(&path)
                .map_err(|e| Error::failed(format!("{}: {e}", path.display())))
        };
        let answers = both(TO_DEVICE)?;
        let keeper = both(FROM_DEVICE)?;
        let requests = File::open(folder.join(FROM_DEVICE))
            .map_err(|e| Error::failed(format!("{FROM_DEVICE}: {e}")))?;
        Ok(Self {
            answers,
            requests,
            keeper,
        })
    }
}

/// The command that runs the image on its machine, the folder's slot loaded, its link in the
/// folder's pipes.
fn machine(qemu: &Path, elf: &Path, folder: &Path) -> Command {
    let mut command = selftest::machine(qemu, Board::Stm32f405);
    command
        .current_dir(folder)
        // QEMU splits options at commas; a doubled comma stands for itself.
        .arg("-semihosting-config")
        .arg(format!(
            "enable=on,target=native,arg=jointwatch,arg=link={TO_DEVICE},,{FROM_DEVICE},arg=count"
        ))
        // One instruction lasts 1 ns and TIM5 counts ns, so it counts instructions.
        .args(["-icount", "shift=0,align=off,sleep=off"])
        .args(["-global", "stm32f2xx-timer.clock-frequency=1000000000"])
        .arg("-device")
        .arg(selftest::load_into_flash(Path::new("slot"), SLOT_A))
        .arg("-kernel")
        .arg(elf)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped());
    command
}

/// Counts the reads of a pipe, so that somebody else sees that there are any.
struct Heartbeat {
    pipe: File,
    beats: Arc<AtomicU64>,
}

impl Read for Heartbeat {
    fn read(&mut self, place: &mut [u8]) -> std::io::Result<usize> {
        self.beats.fetch_add(1, Ordering::Relaxed);
        self.pipe.read(place)
    }
}

/// Watches QEMU from a thread of its own: ends it when it is silent or when nobody serves it any
/// more.
struct Supervisor {
    beats: Arc<AtomicU64>,
    stop: Arc<AtomicBool>,
    thread: JoinHandle<(Option<ExitStatus>, String, bool)>,
}

impl Supervisor {
    fn over(mut child: Child, keeper: File) -> Self {
        let (beats, stop) = (
            Arc::new(AtomicU64::new(0)),
            Arc::new(AtomicBool::new(false)),
        );
        let (heard, stopped) = (Arc::clone(&beats), Arc::clone(&stop));
        let thread = thread::spawn(move || {
            let mut last = (0, Instant::now());
            let mut silent = false;
            let status = loop {
                if let Ok(Some(status)) = child.try_wait() {
                    break Some(status);
                }
                let beats = heard.load(Ordering::Relaxed);
                if beats != last.0 {
                    last = (beats, Instant::now());
                }
                silent = last.1.elapsed() > SILENCE;
                if silent || stopped.load(Ordering::Relaxed) {
                    // Ending it can only fail when it has just ended by itself.
                    let _ = child.kill();
                    break child.wait().ok();
                }
                thread::sleep(Duration::from_millis(2));
            };
            // Nobody else can write any more: the reader comes to the pipe's end.
            drop(keeper);
            let mut complaints = String::new();
            if let Some(mut pipe) = child.stderr.take() {
                // What was read until the pipe broke is what there is to tell.
                let _ = pipe.read_to_string(&mut complaints);
            }
            (status, complaints, silent)
        });
        Self {
            beats,
            stop,
            thread,
        }
    }

    fn end(self) -> (Option<ExitStatus>, String, bool) {
        self.thread.join().unwrap_or_default()
    }
}

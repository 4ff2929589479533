//! The device, and what `jointwatch` does with it: record its frames, sum them, upload a model.

use crate::settings::Settings;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Bytes of the model in a signed model; the rig block follows (docs/reference/slot.md).
const MODEL_LEN: usize = 4096;
/// Where a signed model says how long its rig block is.
const RIG_LEN_AT: usize = 8240;

pub(crate) struct Device {
    name: String,
    line: String,
    program: PathBuf,
    study: PathBuf,
    /// The rig block that it runs with.
    rig: PathBuf,
    folder: PathBuf,
    /// The signed model that it took last.
    taken: Vec<u8>,
}

impl Device {
    pub(crate) fn new(settings: &Settings) -> Result<Self, String> {
        fs::create_dir_all(&settings.folder)
            .map_err(|why| format!("{}: {why}", settings.folder.display()))?;
        Ok(Self {
            name: settings.name.clone(),
            line: settings.device.clone(),
            program: settings.program.clone(),
            study: settings.study.clone(),
            rig: settings.rig.clone(),
            folder: settings.folder.clone(),
            taken: Vec::new(),
        })
    }

    /// The sums of so many samples, from now on.
    pub(crate) fn part(&self, round: &str, rows: usize) -> Result<Vec<u8>, String> {
        let place = |what: &str| self.folder.join(format!("{}-{round}{what}", self.name));
        let (frames, study, part) = (place(".frames"), place(""), place(".acc"));
        self.record(rows, &frames)?;
        self.run(&[
            "study-from".as_ref(),
            &frames,
            "--rig".as_ref(),
            &self.rig,
            "-o".as_ref(),
            &study,
        ])?;
        let failed = |why: std::io::Error| format!("{}: {why}", study.display());
        // A device that restarts begins another record.
        let mut logs = Vec::new();
        for entry in fs::read_dir(&study).map_err(failed)? {
            let log = entry.map_err(failed)?.path();
            if log.extension().is_some_and(|ending| ending == "csv") {
                // The records of the model that is made of them then tell the device.
                let called = place(&format!("-{}.csv", logs.len() + 1));
                fs::rename(&log, &called).map_err(failed)?;
                logs.push(called);
            }
        }
        let mut words: Vec<&Path> = vec!["accumulate".as_ref(), &self.study];
        words.extend(logs.iter().map(PathBuf::as_path));
        words.extend(["-o".as_ref(), part.as_path()]);
        self.run(&words)?;
        fs::read(&part).map_err(|why| format!("{}: {why}", part.display()))
    }

    pub(crate) fn has(&self, model: &[u8]) -> bool {
        self.taken == model
    }

    /// Uploads a signed model, which the device verifies; gives what it says of itself after its
    /// restart.
    pub(crate) fn take(&mut self, model: Vec<u8>) -> Result<String, String> {
        let file = self.folder.join("model.signed");
        fs::write(&file, &model).map_err(|why| format!("{}: {why}", file.display()))?;
        let port = format!("tcp:{}", self.line);
        self.run(&["upload".as_ref(), &file, "--port".as_ref(), port.as_ref()])?;
        let wanted = format!(
            "\"crc\":{}",
            checksum(&model).ok_or("the signed model is too short")?
        );
        let mut hello = None;
        self.listen(&["--seconds", "120"], |line| {
            let runs = line.contains("\"message\":\"hello\"") && line.contains(&wanted);
            hello = runs.then(|| line.to_owned());
            runs
        })?;
        let hello = hello.ok_or("the device did not come to run the model")?;
        // Frames that follow are those of a device with the block that came with the model.
        let rig = self.folder.join("rig.bin");
        fs::write(
            &rig,
            rig_block(&model).ok_or("the signed model is too short")?,
        )
        .map_err(|why| format!("{}: {why}", rig.display()))?;
        (self.rig, self.taken) = (rig, model);
        Ok(hello)
    }

    /// Keeps the frames of so many samples: samples are counted, since a device under emulation has
    /// its own time.
    fn record(&self, rows: usize, frames: &Path) -> Result<(), String> {
        let mut seen = 0;
        let file = frames.to_string_lossy();
        self.listen(&["--stream", "1", "--record", &file], |line| {
            seen += usize::from(line.contains("\"message\":\"sample\""));
            seen >= rows
        })?;
        match seen >= rows {
            true => Ok(()),
            false => Err(format!("the line ended after {seen} of {rows} samples")),
        }
    }

    /// Reads the device's messages as lines of JSON until one is the last that is wanted.
    fn listen(&self, more: &[&str], mut last: impl FnMut(&str) -> bool) -> Result<(), String> {
        let failed = |why: std::io::Error| format!("{}: {why}", self.program.display());
        let mut monitor = Command::new(&self.program)
            .args(["monitor", "--tcp", &self.line, "--json", "-"])
            .args(more)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(failed)?;
        let lines = BufReader::new(monitor.stdout.take().expect("it is piped")).lines();
        let mut ending = false;
        for line in lines.map_while(Result::ok) {
            if !ending && last(&line) {
                ending = true;
                // As Ctrl-C: the device is asked to stop streaming, and the rest is read below.
                let pid = monitor.id().to_string();
                Command::new("kill")
                    .args(["-INT", &pid])
                    .status()
                    .map_err(failed)?;
            }
        }
        monitor.wait().map_err(failed)?;
        Ok(())
    }

    /// Runs a command of the tool; what goes wrong is its own sentence.
    fn run(&self, words: &[&Path]) -> Result<(), String> {
        let done = Command::new(&self.program)
            .args(["--quiet", "--threads", "1"])
            .args(words)
            .stdin(Stdio::null())
            .output()
            .map_err(|why| format!("{}: {why}", self.program.display()))?;
        match done.status.success() {
            true => Ok(()),
            false => Err(String::from_utf8_lossy(&done.stderr).trim().to_owned()),
        }
    }
}

/// The rig block of a signed model.
fn rig_block(model: &[u8]) -> Option<&[u8]> {
    let length = model.get(RIG_LEN_AT..RIG_LEN_AT + 4)?.try_into().ok()?;
    model.get(MODEL_LEN..MODEL_LEN + u32::from_le_bytes(length) as usize)
}

/// The checksum that ends the model, by which a device names what it runs.
fn checksum(model: &[u8]) -> Option<u32> {
    let end = model.get(MODEL_LEN - 4..MODEL_LEN)?.try_into().ok()?;
    Some(u32::from_le_bytes(end))
}

//! A study that the program simulated, learnt from and exported, for the tests that only want to
//! look at one.

use crate::monitor::watched::{RATE_HZ, STUDY_LEVEL};
use crate::program::succeed;
use jointwatch::simulate::{SimulationOptions, write_study};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use tempfile::TempDir;

/// A simulated study with its model and blob, made once by the program itself; nobody changes it.
///
/// # Panics
/// When the program fails to make it.
pub fn story() -> &'static Path {
    static STORY: OnceLock<TempDir> = OnceLock::new();
    let folder = STORY.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        for words in [
            "simulate --out rig --seed 3 --duration 6",
            "identify rig/study.toml --model polynomial -o model.json",
            "export model.json -o model.bin",
        ] {
            succeed(folder.path(), words);
        }
        folder
    });
    folder.path()
}

/// Writes the study of the watched rig of a seed into `rig/`, with its physical model, blob and rig
/// block with limits beside.
///
/// # Panics
/// When any of it fails.
pub fn watched_rig(folder: &Path, seed: u64) {
    let options = SimulationOptions {
        seed,
        duration_s: 20.0,
        sample_rate_hz: RATE_HZ,
        validation_level: STUDY_LEVEL,
        ..SimulationOptions::default()
    };
    write_study(&folder.join("rig"), &options).unwrap();
    for words in [
        "identify rig/study.toml --model physical -o model.json",
        "export model.json -o model.bin",
        "export model.json --rig defaults --study rig/study.toml -o rig.bin",
    ] {
        succeed(folder, words);
    }
}

/// A copy of the simulated study that a test may spoil.
///
/// # Panics
/// When the files cannot be copied.
pub fn copy_of_rig(into: &Path) -> PathBuf {
    let rig = into.join("rig");
    fs::create_dir(&rig).unwrap();
    for entry in fs::read_dir(story().join("rig")).unwrap() {
        let entry = entry.unwrap();
        if entry.file_type().unwrap().is_file() {
            fs::copy(entry.path(), rig.join(entry.file_name())).unwrap();
        }
    }
    rig
}

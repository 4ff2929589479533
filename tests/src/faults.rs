//! Faults that some test has to notice: `tests/faults.toml` lists them, and each is tried in a copy
//! of the crates.

use crate::program::{copy_folder, workspace};
use std::fs;
use std::path::PathBuf;
use std::process::Command;

/// One fault of the list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// What is wrong with the program that has it.
    pub name: String,
    /// The file that it is put into, from the workspace on.
    pub file: String,
    /// What stands there once.
    pub find: String,
    /// What stands there instead.
    pub replace: String,
    /// It is tried by `tests/run`.
    pub quick: bool,
    /// It shows only when power fails.
    pub power: bool,
    /// Why no test can notice it.
    pub equivalent: Option<String>,
}

/// What became of a fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// A test failed, as one has to.
    Noticed,
    /// All tests passed, although the program is wrong.
    Survived,
    /// It could not be tried: the sentence says why.
    Stale(String),
}

/// The tests that have to notice a fault, by the beginning of the path of the file that has it, the
/// longest that fits: fast ones.
const TESTS: [(&str, &[&str]); 6] = [
    (
        "firmware",
        &[
            "--lib",
            "--test",
            "firmware",
            "--",
            "--skip",
            "power_cuts",
            "--skip",
            "kept_alarm",
        ],
    ),
    ("shared", &["--lib"]),
    ("shared/src/base", &["--lib", "--test", "wire"]),
    (
        "shared/src/chain",
        &["--lib", "--test", "chain", "--test", "wire"],
    ),
    (
        "shared/src/monitor",
        &["--lib", "--test", "chain", "--test", "wire"],
    ),
    ("shared/src/wire", &["--lib", "--test", "wire"]),
];
/// Those that have to notice one that shows only when power fails.
const OF_POWER: [&str; 6] = [
    "--test",
    "firmware",
    "--",
    "one_cut_anywhere_from",
    "an_alarm",
    "one_weak_cell",
];
const OF_FIRMWARE: [&str; 2] = ["-p", "jointwatch-firmware"];
const OF_SHARED: [&str; 4] = ["-p", "jointwatch-shared", "--features", "fit"];

/// The crate of a file, and its tests.
fn tests_of(file: &str, power: bool) -> Vec<&'static str> {
    let package = if file.starts_with("shared") {
        &OF_SHARED[..]
    } else {
        &OF_FIRMWARE
    };
    let fitting = TESTS.iter().filter(|(path, _)| file.starts_with(path));
    let longest = fitting.max_by_key(|(path, _)| path.len());
    let tests = match longest {
        _ if power => &OF_POWER[..],
        Some((_, tests)) => tests,
        None => &[],
    };
    [package, tests].concat()
}

/// The list.
///
/// # Errors
/// A sentence, when the file is not there or is no such list.
pub fn list() -> Result<Vec<Fault>, String> {
    let path = workspace().join("tests/faults.toml");
    let text = fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let table: toml::Table = text
        .parse()
        .map_err(|e| format!("{}: {e}", path.display()))?;
    let faults = table.get("fault").and_then(toml::Value::as_array);
    let faults = faults.ok_or_else(|| format!("{}: no [[fault]]", path.display()))?;
    faults.iter().map(read).collect()
}

fn read(entry: &toml::Value) -> Result<Fault, String> {
    let text = |key: &str| {
        let value = entry.get(key).and_then(toml::Value::as_str);
        value.map(str::to_owned)
    };
    let wanted = |key: &str| text(key).ok_or_else(|| format!("a fault without {key}: {entry}"));
    let flag = |key: &str| entry.get(key).and_then(toml::Value::as_bool) == Some(true);
    Ok(Fault {
        name: wanted("name")?,
        file: wanted("file")?,
        find: wanted("find")?,
        replace: wanted("replace")?,
        quick: flag("quick"),
        power: flag("power"),
        equivalent: text("equivalent"),
    })
}

/// A copy of the crates that run on the device, to be spoilt.
#[derive(Debug)]
pub struct Copy {
    folder: PathBuf,
    target: PathBuf,
}

impl Copy {
    /// Copies the crates into `target/faults`.
    ///
    /// # Errors
    /// A sentence, when a file cannot be copied.
    pub fn make() -> Result<Self, String> {
        let (from, target) = (workspace(), workspace().join("target/faults"));
        let folder = target.join("tree");
        let failed = |e: std::io::Error| format!("{}: {e}", folder.display());
        if folder.exists() {
            fs::remove_dir_all(&folder).map_err(failed)?;
        }
        // The tests of the frames read their page.
        for part in ["shared", "firmware", "docs/reference"] {
            copy_folder(&from.join(part), &folder.join(part)).map_err(failed)?;
        }
        for file in ["Cargo.lock", "memory.x", "rust-toolchain.toml"] {
            fs::copy(from.join(file), folder.join(file)).map_err(failed)?;
        }
        let manifest = fs::read_to_string(from.join("Cargo.toml")).map_err(failed)?;
        let lines = manifest.lines().filter_map(|line| {
            if line.starts_with("members") {
                Some("members = [\"shared\", \"firmware\"]")
            } else if line.starts_with("default-members") {
                None
            } else {
                Some(line)
            }
        });
        let manifest: Vec<&str> = lines.collect();
        fs::write(folder.join("Cargo.toml"), manifest.join("\n")).map_err(failed)?;
        Ok(Self { folder, target })
    }

    /// Whether the tests pass as the crates are.
    ///
    /// # Errors
    /// What failed.
    pub fn passes_untouched(&self) -> Result<(), String> {
        for (path, _) in TESTS {
            self.test(&tests_of(path, false))?;
        }
        self.test(&tests_of("firmware", true))
    }

    /// Puts a fault in, runs the tests, and takes it out again.
    ///
    /// # Errors
    /// A sentence, when the file cannot be read or written.
    pub fn attempt(&self, fault: &Fault) -> Result<Outcome, String> {
        let path = self.folder.join(&fault.file);
        let failed = |e: std::io::Error| format!("{}: {e}", path.display());
        let sound = fs::read_to_string(&path).map_err(failed)?;
        let times = sound.matches(&fault.find).count();
        if times != 1 {
            let why = format!("what is to be found stands {times} times in {}", fault.file);
            return Ok(Outcome::Stale(why));
        }
        fs::write(&path, sound.replace(&fault.find, &fault.replace)).map_err(failed)?;
        let outcome = match self.test(&tests_of(&fault.file, fault.power)) {
            Ok(()) => Outcome::Survived,
            Err(said) if said.contains("could not compile") => {
                Outcome::Stale(format!("it does not compile:\n{said}"))
            }
            Err(_) => Outcome::Noticed,
        };
        fs::write(&path, sound).map_err(failed)?;
        Ok(outcome)
    }

    fn test(&self, tests: &[&str]) -> Result<(), String> {
        let output = Command::new(std::env::var_os("CARGO").unwrap_or("cargo".into()))
            .args(["test", "--release", "--quiet"])
            .args(tests)
            .current_dir(&self.folder)
            .env("CARGO_TARGET_DIR", &self.target)
            .env("CARGO_INCREMENTAL", "1")
            .output()
            .map_err(|e| format!("cargo could not be started: {e}"))?;
        if output.status.success() {
            return Ok(());
        }
        let said = [output.stdout, output.stderr].concat();
        Err(String::from_utf8_lossy(&said).into_owned())
    }
}

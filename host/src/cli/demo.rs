//! `jointwatch demo`: every step on a simulated rig with a hidden effect, in a folder that the user
//! can go on with.
//!
//! Every step is a command as the user would type it, printed and then run through the same parser;
//! the emulated device is the one step that has no command of its own.

use super::console::Console;
use super::lab;
use crate::device::export;
use crate::emulate::selftest::{self, Board};
use crate::text::error::{Error, Result};
use crate::text::table::quantity;
use clap::Args;
use jointwatch_shared::effect::{Acts, EFFECTS, Entry, Subsystem};
use jointwatch_shared::selftest as arithmetic;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// Runs a command given as words, as a user would type them; quietly if told so.
pub(super) type RunWords = fn(&[&str], bool) -> Result<()>;

/// Points at which the emulated device and the host evaluate the model, besides the corners of its
/// range.
const POINTS: u32 = 100_000;

/// The slot that the blob is loaded into, as the firmware calls it.
const SLOT: &str = "a";

/// The axes of the simulated rig.
const AXES: [&str; 2] = ["x", "phi"];
/// Effects that its study lists.
const LISTED: [&str; 4] = ["stiffness", "viscous", "clearance", "clearance_coupling"];

/// Options of `jointwatch demo`.
#[derive(Args)]
pub(crate) struct Demo {
    /// The folder to make; jointwatch-demo, or the first free jointwatch-demo-2, -3, … when left
    /// out.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Seed of the story: which effect is hidden on which axis and how strongly, the rig's drives
    /// and its noise.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Open the lab on it at the end, in the browser.
    #[arg(long)]
    lab: bool,
}

impl Demo {
    pub(super) fn run(self, console: &Console, run: RunWords) -> Result<()> {
        let out = self.out.unwrap_or_else(first_free_folder);
        let story = Story {
            console: console.inner(),
            run,
            out: &out,
        };
        let (study, base) = (story.file("study.toml"), story.file("base.json"));
        let (blob, diagnosis) = (story.file("model.bin"), story.file("diagnosis.json"));
        let (report, mut model) = (story.file("report.html"), story.file("model.json"));
        let hidden = story.simulate(self.seed)?;

        story.heading("2. A base model from the physics that the study does list")?;
        story.step(&["identify", &study, "--model", "physical", "-o", &base])?;

        story.heading("3. How wrong it is, and where it fails")?;
        let (comparison, before) = (story.file("comparison.json"), story.file("plots/before"));
        story.step(&[
            "compare",
            &study,
            &base,
            "--json",
            &comparison,
            "--plots",
            &before,
        ])?;

        story.heading("4. What is missing")?;
        story.step(&[
            "diagnose", &study, &base, "--json", &diagnosis, "--report", &report,
        ])?;
        let found = found(&read_json(&diagnosis)?);

        if found.is_empty() {
            console.say(
                "\nNothing is named that could be added, so the base goes to the device as it is.",
            )?;
            model = base;
        } else {
            story.heading("5. Add it, and watch the error fall")?;
            let mut add = vec!["add", &study, &base];
            add.extend(found.iter().map(String::as_str));
            let after = story.file("plots/after");
            add.extend(["-o", &model, "--plots", &after, "--report", &report]);
            story.step(&add)?;
        }

        story.heading("6. Export it for the microcontroller, and hear what the device would say, from raw counts on")?;
        story.step(&["export", &model, "-o", &blob])?;
        console.say("")?;
        let replay = story.file("replay.json");
        story.step(&[
            "replay",
            &blob,
            &study,
            "--record",
            "valid.csv",
            "--json",
            &replay,
        ])?;

        story.heading("7. The firmware's own evaluation, on an emulated Cortex-M4F")?;
        let emulated = emulate(console, Path::new(&blob))?;
        console.say(&emulated)?;

        let truth = truth(&read_json(&story.file("truth/truth.json"))?, &found);
        let next = go_on(&study, &model, self.seed.wrapping_add(1));
        console.say(format!(
            "\n{truth}\n\nAll of it is in {}. To see it, open {report} in a browser.\n{next}",
            out.display()
        ))?;
        console.json(&serde_json::json!({
            "folder": out, "hidden": hidden, "found": found, "emulated": emulated,
        }))?;
        if self.lab {
            console.say("")?;
            return lab::serve(console, vec![study.into()], Some(model.into()), None, true);
        }
        Ok(())
    }
}

/// What can be done next.
fn go_on(study: &str, model: &str, seed: u64) -> String {
    format!(
        "Go on with:\n  jointwatch lab {study} {model}\n  jointwatch respond {study} {model}\n  jointwatch demo --seed {seed}"
    )
}

/// The steps of the demo.
struct Story<'a> {
    console: Console,
    run: RunWords,
    out: &'a Path,
}

impl Story<'_> {
    fn file(&self, name: &str) -> String {
        self.out.join(name).to_string_lossy().into_owned()
    }

    fn heading(&self, text: &str) -> Result<()> {
        self.console.say(format!("\n{text}\n"))
    }

    /// Simulates a rig with a hidden effect, and says everything of it but which.
    fn simulate(&self, seed: u64) -> Result<String> {
        self.heading("1. A rig whose joint does something that its study does not list (what it is stays hidden until the end)")?;
        let (hidden, share) = chosen(seed);
        let (seed, share) = (seed.to_string(), format!("{share:.2}"));
        let out = self.out.to_string_lossy();
        let words = [
            "simulate", "--out", &out, "--seed", &seed, "--share", &share,
        ];
        self.console
            .say(format!("$ {} --hidden …\n", line(&words)))?;
        (self.run)(&[&words[..], &["--hidden", &hidden]].concat(), true)?;
        self.console
            .say("Four records of 10000 rows at 2000 Hz; sensor noise 60 dB below the signals.")?;
        Ok(hidden)
    }

    /// Prints a command and runs it.
    fn step(&self, words: &[&str]) -> Result<()> {
        self.console.say(format!("$ {}\n", line(words)))?;
        (self.run)(words, self.console.is_quiet())
    }
}

/// A command as it is typed.
fn line(words: &[&str]) -> String {
    let word = |word: &&str| match word.contains(char::is_whitespace) {
        true => format!("'{word}'"),
        false => (*word).to_string(),
    };
    let words: Vec<String> = words.iter().map(word).collect();
    format!("jointwatch {}", words.join(" "))
}

/// Effects with a larger tag hold simpler ones as special cases: hidden with drawn strengths they
/// would be those.
const LAST_SHOWN: u8 = 24;

/// Which effect of the joint a seed hides, on which axis, and its share of the RMS force.
fn chosen(seed: u64) -> (String, f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let may = |entry: &&Entry| {
        let proposed = entry.tag <= LAST_SHOWN && !LISTED.contains(&entry.about.name);
        entry.subsystem == Subsystem::Plant && proposed
    };
    let names: Vec<&str> = EFFECTS.iter().filter(may).map(|e| e.about.name).collect();
    let effect = names.choose(&mut rng).unwrap_or(&"coulomb");
    let axis = AXES.choose(&mut rng).unwrap_or(&AXES[0]);
    (format!("{effect}@{axis}"), rng.random_range(0.08..0.2))
}

/// What a diagnosis found, as `add` takes it.
fn found(diagnosis: &Value) -> Vec<String> {
    let listed = diagnosis["found"].as_array();
    let mut effects = Vec::new();
    for one in listed.into_iter().flatten() {
        let (Some(effect), Some(axis)) = (one["effect"].as_str(), one["axis"].as_str()) else {
            continue;
        };
        let on_both = Entry::named(effect).is_some_and(|e| e.acts == Acts::BothAxes);
        match axis {
            "both" if on_both => effects.push(effect.to_string()),
            "both" => effects.extend(AXES.map(|axis| format!("{effect}@{axis}"))),
            axis => effects.push(format!("{effect}@{axis}")),
        }
    }
    effects
}

/// What had been hidden, beside what was found.
fn truth(truth: &Value, found: &[String]) -> String {
    let hidden = &truth["effects"][0];
    let text = |value: &Value| value.as_str().unwrap_or_default().to_string();
    let name = format!("{}@{}", text(&hidden["effect"]), text(&hidden["axis"]));
    let parameters = hidden["parameters"].as_array().into_iter().flatten();
    let values: Vec<String> = parameters
        .map(|p| {
            let value = p["value"].as_f64().unwrap_or(f64::NAN);
            quantity(&text(&p["name"]), value, &text(&p["unit"]))
        })
        .collect();
    let share = 100.0 * hidden["share_of_rms_force"].as_f64().unwrap_or(f64::NAN);
    let judged = match found {
        [one] if *one == name => "That is what was found".to_string(),
        [] => "Nothing was found".to_string(),
        some if some.contains(&name) => format!("Found was {}", some.join(", ")),
        some => format!(
            "That was not found: {} was named in its place",
            some.join(", ")
        ),
    };
    format!(
        "Hidden in the rig was {name}, {share:.1} % of the RMS force, with {}. {judged}.",
        values.join(", ")
    )
}

fn read_json(path: &str) -> Result<Value> {
    let failed = |e: String| Error::failed(format!("{path}: it could not be read back ({e})"));
    let text = fs::read_to_string(path).map_err(|e| failed(e.to_string()))?;
    serde_json::from_str(&text).map_err(|e| failed(e.to_string()))
}

/// Runs the self-test image with the blob in its flash slot, and holds its digest against the
/// host's.
///
/// A missing emulator or device toolchain is a reason to leave the step out and say so; a digest
/// that differs is a failure.
fn emulate(console: &Console, blob: &Path) -> Result<String> {
    let working = console.working("building the firmware and running it in QEMU");
    let image = match selftest::require_qemu().and_then(|_| selftest::selftest(Board::Stm32f405)) {
        Ok(image) => image,
        Err(e) => return Ok(format!("Left out: {e}.")),
    };
    let report = selftest::run_selftest(Board::Stm32f405, &image, Some(blob), POINTS)?;
    working.finish_and_clear();
    let model = export::read_blob(blob)?;
    let Some(seen) = report.model(SLOT) else {
        return Err(Error::failed(format!(
            "the firmware did not evaluate the model in its flash slot; it said: {}",
            report.complaints.join("; ")
        )));
    };
    let wanted = arithmetic::digest(&model, seen.seed, seen.points);
    if seen.digest != wanted {
        return Err(Error::failed(format!(
            "the emulated device computed other bits than the host: digest {:016x} where the host has {wanted:016x}",
            seen.digest
        )));
    }
    let counted = seen.instructions.map_or(String::new(), |counted| {
        format!(
            " One evaluation takes {} instructions, whatever the input.",
            counted.most
        )
    });
    Ok(format!(
        "The firmware found the model in flash slot A and evaluated it at {} points: digest {wanted:016x}, the same bits \
         as the host.{counted}",
        seen.points + arithmetic::CORNER_POINTS
    ))
}

/// A name that is still free, so that the demo can be run again.
fn first_free_folder() -> PathBuf {
    let taken = |path: &Path| path.exists();
    let first = PathBuf::from("jointwatch-demo");
    if !taken(&first) {
        return first;
    }
    (2_u32..)
        .map(|n| PathBuf::from(format!("jointwatch-demo-{n}")))
        .find(|path| !taken(path))
        .unwrap_or(first)
}

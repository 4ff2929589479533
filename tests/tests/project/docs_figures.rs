//! The figures of measured joints that the book and README state are those that the program gives,
//! to a percent.
//!
//! The logs are public and not part of the project. Where they are absent, each test says so and
//! what to set.

use jointwatch_tests::program::{json, measurements, study_with_logs, succeed, workspace};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

fn page(path: &str) -> String {
    fs::read_to_string(workspace().join(path)).unwrap()
}

/// The numbers of a text, in their order; a minus may be typographic.
fn numbers(text: &str) -> Vec<f64> {
    let text = text.replace('−', "-");
    let words = text.split(|c: char| !(c.is_ascii_digit() || ".-".contains(c)));
    words
        .filter_map(|word| word.trim_end_matches(['.', '-']).parse().ok())
        .collect()
}

/// The numbers behind the first cell of the table row that begins with `start`.
fn row(page: &str, start: &str) -> Vec<f64> {
    let found = page
        .lines()
        .find_map(|line| line.strip_prefix("| ")?.strip_prefix(start));
    numbers(found.unwrap_or_else(|| panic!("no row begins with {start:?}")))
}

/// Whether a page states what the program gave: to one percent, or half a unit of the last digit
/// printed.
fn is_right(stated: f64, seen: f64) -> bool {
    (stated - seen).abs() <= (0.01 * seen.abs()).max(0.0006)
}

/// Holds a row of a page against what the program gave.
fn agree(what: &str, stated: &[f64], seen: &[f64]) {
    println!("{what}: stated {stated:?}, seen {seen:?}");
    assert_eq!(stated.len(), seen.len(), "{what}");
    for (stated, seen) in stated.iter().zip(seen) {
        assert!(is_right(*stated, *seen), "{what}: {stated} and {seen}");
    }
}

/// A folder with a study of the docs and its logs.
fn study(data: &Path, study: &str, logs: &[&str]) -> TempDir {
    let text = fs::read_to_string(workspace().join(study)).unwrap();
    study_with_logs(data, logs, &text)
}

fn identify(folder: &Path, kind: &str, file: &str) {
    let identify = format!("identify study.toml --model {kind} -o {file}");
    succeed(folder, &identify);
}

/// Verification and validation NMSE, percent.
fn nmse(folder: &Path, model: &str) -> [f64; 2] {
    let said = json(folder, &format!("compare study.toml {model}"));
    ["verification", "validation"].map(|role| said[role][0]["nmse_percent"].as_f64().unwrap())
}

/// Verification before and after, validation before and after an effect was added to the base.
fn before_and_after(folder: &Path, effect: &str) -> [f64; 4] {
    let add = format!("add study.toml base.json {effect}@x --force -o model.json");
    succeed(folder, &add);
    let ([v0, w0], [v1, w1]) = (nmse(folder, "base.json"), nmse(folder, "model.json"));
    [v0, v1, w0, w1]
}

#[test]
fn readme_states_what_the_campaign_of_the_notebook_gave() {
    let readme = page("README.md");
    let stated = readme
        .lines()
        .find(|line| line.contains("simulated joints:"));
    let stated = numbers(stated.expect("README has a row of the campaign"));
    let notebook = page("docs/notebook/hidden-effects.md");
    let named = row(&notebook, "effects of the library, named first");
    let told = row(&notebook, "the same, or told as much like the first");
    assert_eq!(stated, [named[0], named[1], told[1]]);
}

const EMPS: [&str; 2] = ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"];

#[test]
fn the_slide_without_dry_friction() {
    let Some(data) = measurements("data/emps") else {
        return;
    };
    let folder = study(&data, "docs/missing-effects/emps.toml", &EMPS);
    identify(folder.path(), "physical", "base.json");
    let seen = before_and_after(folder.path(), "coulomb");
    let notebook = page("docs/notebook/missing-effects.md");
    agree("notebook", &row(&notebook, "positioning axis"), &seen);
    let howto = page("docs/howto/find-a-missing-effect.md");
    agree("how-to", &row(&howto, "EMPS positioning axis"), &seen[2..]);
    let readme = page("README.md");
    let stated = readme.split("NMSE").filter(|part| part.contains(" %"));
    let stated: Vec<f64> = stated
        .filter_map(|part| numbers(part.split(" %").next()?).last().copied())
        .take(2)
        .collect();
    println!("README: stated {stated:?}");
    for (stated, seen) in stated.iter().zip(&seen[2..]) {
        assert!((stated - seen).abs() < 0.006, "README: {stated} and {seen}");
    }
}

#[test]
fn the_oscillator_without_its_cubic_spring() {
    let Some(data) = measurements("data/silverbox") else {
        return;
    };
    let folder = study(
        &data,
        "docs/missing-effects/silverbox.toml",
        &["SNLS80mV.mat"],
    );
    identify(folder.path(), "physical", "base.json");
    let seen = before_and_after(folder.path(), "cubic_hardening");
    let notebook = page("docs/notebook/missing-effects.md");
    agree("notebook", &row(&notebook, "electronic oscillator"), &seen);
}

#[test]
fn the_damper_without_hysteresis() {
    let Some(data) = measurements("data/brfd") else {
        return;
    };
    let logs = ["0.5Hz", "1Hz"].map(|f| format!("ds2_{f}36lbtension1amplitude.json"));
    let logs = logs.each_ref().map(String::as_str);
    let folder = study(&data, "docs/missing-effects/friction-damper.toml", &logs);
    identify(folder.path(), "physical", "base.json");
    let notebook = page("docs/notebook/missing-effects.md");
    let seen = before_and_after(folder.path(), "dahl");
    agree("notebook", &row(&notebook, "friction damper"), &seen);
    for effect in ["lugre", "dahl", "bouc_wen", "jenkins", "coulomb"] {
        let [_, verification, _, validation] = before_and_after(folder.path(), effect);
        let stated = row(&notebook, &format!("`{effect}@x`"));
        agree(effect, &stated[..2], &[verification, validation]);
    }
}

#[test]
fn the_slide_with_its_physical_model_and_a_polynomial() {
    let Some(data) = measurements("data/emps") else {
        return;
    };
    let folder = study(&data, "docs/measured-axis.toml", &EMPS);
    let notebook = page("docs/notebook/measured-axis.md");
    let models = ["physical", "polynomial"].map(|kind| {
        let file = format!("{kind}.json");
        identify(folder.path(), kind, &file);
        file
    });
    let errors = models.each_ref().map(|file| nmse(folder.path(), file));
    for (record, name) in ["estimation record, 20 Hz band", "pulses record, 20 Hz band"]
        .into_iter()
        .enumerate()
    {
        // The first number is that of the band.
        let stated = row(&notebook, name.trim_end_matches("20 Hz band"));
        agree(name, &stated[1..], &errors.map(|error| error[record]));
    }
    for (model, options, name) in [
        (1, &["--restart", "1"][..], "polynomial, `--restart 1`"),
        (1, &["--restart", "0.2"], "polynomial, `--restart 0.2`"),
        (0, &[], "physical model, from the first state on"),
    ] {
        let respond = [&["respond", "study.toml", &models[model]], options].concat();
        let said = json(folder.path(), &respond);
        let records = said["records"].as_array().unwrap().iter();
        let seen: Vec<f64> = records
            .flat_map(|record| {
                ["displacement", "velocity"].map(|what| {
                    let axis = &record["axes"]["x"];
                    axis[format!("{what}_nmse_percent")].as_f64().unwrap()
                })
            })
            .collect();
        agree(name, &row(&notebook, name), &seen);
    }
}

#[test]
fn a_wrong_figure_is_seen() {
    let table = "| slide | 2.860 %, 0.147 % | −3.18 N |\n";
    assert_eq!(row(table, "slide"), [2.860, 0.147, -3.18]);
    assert!(is_right(0.147, 0.1472) && is_right(0.0, 0.0005));
    assert!(!is_right(0.147, 0.150) && !is_right(82.2, 80.0));
}

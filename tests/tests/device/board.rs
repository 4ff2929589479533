//! Boards that read a record in their own way: late, at a rail, or as their description should not
//! have it.

use jointwatch_shared::wire::rig_block::decode;
use jointwatch_tests::program::{fail, json, succeed};
use jointwatch_tests::story::watched_rig;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;
use tempfile::TempDir;

/// A board that suits the simulated rig, whose counters are in its study.
const BOARD: &str = r#"
[wiring]
oversampling = 1024
counters = [{}, {}, {}, {}]

[[axis]]
name = "x"
far = "+0"
near = "+1"
body = "+1"
counts_per_m = 500000.0
bridge = "+0"
gain = 32
sensitivity = 250000.0
excitation_V = 3.0

[[axis]]
name = "phi"
far = "+2"
near = "+3"
body = "+3"
counts_per_rev = 262144.0
bridge = "+1"
gain = 32
sensitivity = 1200.0
excitation_V = 3.0
"#;

/// A folder with a model, its blob and the study of its rig.
fn rig() -> &'static Path {
    static RIG: OnceLock<TempDir> = OnceLock::new();
    let folder = RIG.get_or_init(|| {
        let folder = TempDir::new().unwrap();
        watched_rig(folder.path(), 3);
        folder
    });
    folder.path()
}

/// Every axis with a line more.
fn with(line: &str) -> String {
    BOARD.replace(
        "excitation_V = 3.0\n",
        &format!("excitation_V = 3.0\n{line}\n"),
    )
}

/// Writes a description under a name, and the arguments that export its block with limits.
fn export(name: &[String; 2], description: &str) -> String {
    let [toml, block] = name;
    fs::write(rig().join(toml), description).unwrap();
    format!("export model.json --rig {toml} --study rig -o {block}")
}

fn named(name: &str) -> [String; 2] {
    [format!("{name}.toml"), format!("{name}.block")]
}

/// Relative errors of the last record by axis.
fn errors(block: &str) -> [f64; 2] {
    let said = json(rig(), &format!("replay model.bin rig --rig {block}"));
    let records = said["records"].as_array().unwrap();
    let axes = &records.last().unwrap()["axes"];
    ["x", "phi"].map(|axis| axes[axis]["relative_error"].as_f64().unwrap())
}

#[test]
fn what_a_board_reads_late_is_put_in_time_and_costs_no_limit() {
    let (prompt, late) = (named("prompt"), named("late"));
    let said = succeed(rig(), &export(&prompt, BOARD));
    for part in [
        "What the monitor finds:",
        "x: a stiffness",
        "phi: a stiffness",
    ] {
        assert!(said.contains(part), "{said}");
    }
    assert!(!said.contains("Warning"), "{said}");
    let skew = "skew_us = { displacement = 40.0, body = 40.0, force = 620.0 }";
    succeed(rig(), &export(&late, &with(skew)));
    let [[prompt_x, prompt_phi], [late_x, late_phi]] =
        [&prompt, &late].map(|name| errors(&name[1]));
    println!("x {prompt_x} {late_x}, phi {prompt_phi} {late_phi}");
    assert!(late_x < 1.2 * prompt_x && late_phi < 1.2 * prompt_phi);
    let limits = |name: &[String; 2]| {
        let block = decode(&fs::read(rig().join(&name[1])).unwrap()).unwrap();
        block.limits.expect("limits").axes
    };
    for (prompt, late) in limits(&prompt).iter().zip(&limits(&late)) {
        let pairs = [
            (prompt.error, late.error),
            (prompt.friction.more, late.friction.more),
            (prompt.stiffness.less, late.stiffness.less),
        ];
        for (prompt, late) in pairs {
            let ratio = f64::from(late.threshold) / f64::from(prompt.threshold);
            assert!((ratio - 1.0).abs() < 0.2, "{prompt:?} {late:?}");
        }
    }
}

#[test]
fn records_from_a_device_are_free_of_its_boards_skew() {
    let name = named("streaming");
    let skew = "skew_us = { displacement = 30.0, body = 30.0, force = 620.0 }";
    succeed(rig(), &export(&name, &with(skew)));
    let out = TempDir::new_in(rig()).unwrap();
    let frames = out.path().join("frames.bin");
    let frames = frames.to_str().unwrap();
    let block = name[1].as_str();
    let replay = ["replay", "model.bin", "rig", "--rig", block];
    succeed(
        rig(),
        &[&replay[..], &["--record", "valid.csv", "--frames", frames]].concat(),
    );
    let study = out.path().join("heard");
    let study = study.to_str().unwrap();
    let from = ["study-from", frames, "--rig", block, "--model", "model.bin"];
    succeed(rig(), &[&from[..], &["-o", study]].concat());
    let said = json(rig(), &["compare", study, "model.json"]);
    for axis in said["verification"].as_array().unwrap() {
        let error = axis["relative_error"].as_f64().unwrap();
        assert!(error < 0.005, "{said}");
    }
}

#[test]
fn a_description_that_blinds_the_monitor_is_refused() {
    let wirings = [
        (
            "weak",
            BOARD.replace("sensitivity = 250000.0", "sensitivity = 250.0"),
            "the force channel of axis x stands at its rail",
        ),
        (
            "bodiless",
            BOARD.replace("body = \"+1\"\n", ""),
            "as this board reads the validation records, the model's error on x is",
        ),
        (
            "slow",
            BOARD.replace("oversampling = 1024", "oversampling = 16384"),
            "gives 250 samples per second and is asked for",
        ),
        (
            "twice",
            BOARD
                .replace("\"+2\"", "\"-0\"")
                .replace("\"+3\"", "\"+1\""),
            "reads the same counters",
        ),
    ];
    for (name, description, words) in wirings {
        let name = named(name);
        let sentence = fail(rig(), &export(&name, &description), 3);
        assert!(sentence.contains(words), "{sentence}");
        assert!(!rig().join(&name[1]).exists(), "{sentence}");
    }
}

#[test]
fn a_description_that_measures_worse_than_the_log_is_warned_of() {
    let name = named("coarse");
    let coarse = BOARD.replace("counts_per_m = 500000.0", "counts_per_m = 4000.0");
    let said = succeed(rig(), &export(&name, &coarse));
    assert!(
        said.contains("Warning: as this board reads the validation records"),
        "{said}"
    );
}

#[test]
fn a_signed_model_says_for_whom_it_is() {
    let folder = TempDir::new().unwrap();
    let path = |file: &str| rig().join(file).to_str().unwrap().to_owned();
    let (model, block) = (path("model.bin"), path("rig.bin"));
    let sign = ["sign", &model, "--development-key", "--release", "7"];
    let sign = [&sign[..], &["--class", "press", "-o"]].concat();
    let at = folder.path();
    succeed(at, &[&sign[..], &["bare.signed"]].concat());
    succeed(
        at,
        &[&sign[..], &["whole.signed", "--rig", &block]].concat(),
    );
    let bare = succeed(at, &["inspect", "bare.signed"]);
    assert!(
        bare.contains("Release 7, for the class \"press\", with no rig block"),
        "{bare}"
    );
    let whole = json(at, &["inspect", "whole.signed"]);
    assert_eq!(whole["signed"]["rig_bytes"], 4096);
    assert_eq!(whole["signed"]["signature"], true);
    assert!(whole["axes"].is_array(), "{whole}");
    let mut damaged = fs::read(at.join("bare.signed")).unwrap();
    damaged[100] ^= 1;
    fs::write(at.join("damaged.signed"), damaged).unwrap();
    let sentence = fail(at, &["inspect", "damaged.signed"], 3);
    assert!(sentence.contains("damaged"), "{sentence}");
}

//! `export --rig`: a description of the wiring becomes the numbers of a block, and what is wrong
//! with it is said with its line.

use jointwatch_shared::wire::rig_block::{RIG_BLOCK_LEN, decode};
use jointwatch_tests::program::{fail, json, succeed, workspace};
use jointwatch_tests::story::story;
use std::fs;
use std::path::Path;

/// The example of the documentation.
fn example() -> String {
    let page = fs::read_to_string(workspace().join("docs/reference/rig-block.md")).unwrap();
    let (_, rest) = page.split_once("```toml\n").unwrap();
    rest.split_once("```").unwrap().0.to_owned()
}

fn model() -> String {
    story().join("model.json").to_str().unwrap().to_owned()
}

fn exported(folder: &Path, rig: &str) -> String {
    fs::write(folder.join("rig.toml"), rig).unwrap();
    succeed(
        folder,
        &["export", &model(), "--rig", "rig.toml", "-o", "rig.bin"],
    )
}

#[test]
fn the_documented_description_becomes_the_numbers_of_a_block() {
    let folder = tempfile::tempdir().unwrap();
    let said = exported(folder.path(), &example());
    let bytes = fs::read(folder.path().join("rig.bin")).unwrap();
    assert_eq!(bytes.len(), RIG_BLOCK_LEN);
    let block = decode(&bytes).unwrap();
    let near = |seen: f64, wanted: f64| {
        assert!((seen / wanted - 1.0).abs() < 1e-12, "{seen} for {wanted}")
    };
    let [x, phi] = block.axes.as_slice() else {
        panic!("two axes");
    };
    near(x.displacement_step, 2e-6);
    near(phi.displacement_step, std::f64::consts::TAU / 20_000.0);
    near(x.acceleration_step, 9.80665 / 256_000.0);
    near(phi.acceleration_step, 9.80665 / 256_000.0 / 0.12);
    near(x.force_step, 1.2 / 32.0 / 8_388_608.0 / 3.0 * 250_000.0);
    near(phi.force_step, 1.2 / 64.0 / 8_388_608.0 / 3.0 * 1200.0);
    let rate = block.sample_rate_hz;
    near(x.delays.acceleration, 1500e-6 * rate);
    near(x.force_delay_samples, 620e-6 * rate);
    assert_eq!((x.delays.displacement, x.delays.body), (0.0, 0.0));
    assert_eq!((x.body_step, phi.body_step), (x.displacement_step, 0.0));
    assert_eq!(block.wiring.converter.gain_log2, [5, 6, 0, 0]);
    assert_eq!(
        block.wiring.counters[2].map(|c| (c.index, c.start)),
        Some((true, -2500))
    );

    let inspected = succeed(folder.path(), &["inspect", "rig.bin"]);
    assert!(said.contains(&inspected), "{said}\n{inspected}");
    for part in ["1500.0", "620.0", "+1z -0z", "without limits", "+0x"] {
        assert!(inspected.contains(part), "{part} is missing in {inspected}");
    }
    let inspected = json(folder.path(), "inspect rig.bin");
    assert_eq!(inspected["axes"][1]["far"], "+2");
    assert_eq!(inspected["gains"][1], 64);
}

#[test]
fn the_defaults_come_from_a_study_and_keep_replays_steps() {
    let folder = tempfile::tempdir().unwrap();
    let study = story().join("rig/study.toml");
    let study = study.to_str().unwrap();
    let arguments = ["export", &model(), "--rig", "defaults", "--study", study];
    succeed(folder.path(), &arguments);
    let block = decode(&fs::read(folder.path().join("rig.bin")).unwrap()).unwrap();
    assert_eq!(block.axes.len(), 2);
    assert!(block.wiring.counters.iter().any(Option::is_some));

    let sentence = fail(folder.path(), &["export", &model(), "--rig", "defaults"], 2);
    assert!(sentence.contains("--study"), "{sentence}");
    let sentence = fail(folder.path(), &["export", &model(), "--study", study], 2);
    assert!(sentence.contains("--rig"), "{sentence}");
    assert!(!folder.path().join("model.bin").exists());
}

#[test]
fn a_study_puts_the_monitors_limits_into_the_block_and_replay_takes_them_from_there() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let study = story().join("rig/study.toml");
    let study = study.to_str().unwrap();
    succeed(at, &["export", &model(), "-o", "model.bin"]);
    let checksum = jointwatch_shared::wire::blob::checksum(
        &fs::read(at.join("model.bin"))
            .unwrap()
            .try_into()
            .expect("a blob's length"),
    );
    let export = ["export", &model(), "--rig", "defaults", "--study", study];
    let said = succeed(at, &[&export[..], &["--false-alarm-days", "60"]].concat());
    let block = decode(&fs::read(at.join("rig.bin")).unwrap()).unwrap();
    let limits = block.limits.clone().expect("limits");
    assert_eq!(limits.model_checksum, checksum);
    assert_eq!((limits.axes.len(), limits.false_alarm_hours), (2, 60 * 24));
    let inspected = succeed(at, &["inspect", "rig.bin"]);
    assert!(said.contains(&inspected), "{said}\n{inspected}");
    for part in ["60 days", "less friction", &format!("{checksum:08x}")] {
        assert!(inspected.contains(part), "{part} is missing in {inspected}");
    }
    let block_said = json(at, "inspect rig.bin --quiet");
    assert_eq!(block_said["model_checksum"], checksum);
    let blob = succeed(at, &["inspect", "model.bin"]);
    assert!(blob.contains(&format!("checksum {checksum:08x}")), "{blob}");
    let head = format!("for the model whose checksum is {checksum:08x}");
    assert!(inspected.contains(&head), "{inspected}");
    let seen = block_said["limits"]["axes"][1]["sums"][1]["threshold"]
        .as_f64()
        .unwrap();
    let held = f64::from(limits.axes[1].stiffness.more.threshold) * 100.0 / 65536.0;
    assert!((seen - held).abs() < 1e-9, "{seen} for {held}");

    // The same verdicts from the block's limits as from the study's, which are the same but for the
    // accelerometers' steps.
    let replay = ["replay", "model.bin", study, "--monitor", "--quiet"];
    let verdicts = |more: &[&str]| -> Vec<(String, Vec<String>)> {
        let said = json(at, &[&replay[..], more].concat());
        let records = said["monitor"]["records"].as_array().unwrap().iter();
        let reasons = |record: &serde_json::Value| {
            let changes = record["changes"].as_array().unwrap().iter();
            changes.map(|c| c["reason"].to_string()).collect()
        };
        records
            .map(|r| (r["file"].to_string(), reasons(r)))
            .collect()
    };
    assert_eq!(
        verdicts(&["--rig", "rig.bin"]),
        verdicts(&["--false-alarm-days", "60"])
    );

    // A description of a real board takes limits from a study as well; without one it has none and
    // says so.
    fs::write(at.join("rig.toml"), example()).unwrap();
    let real = ["export", &model(), "--rig", "rig.toml", "-o", "real.bin"];
    let said = succeed(at, &real);
    assert!(said.contains("will not judge"), "{said}");
    let refused = |arguments: &[&str], code: i32, words: &str| {
        let sentence = fail(at, arguments, code);
        assert!(sentence.contains(words), "{sentence}");
    };
    let with = |rig| ["replay", "model.bin", study, "--monitor", "--rig", rig];
    refused(&with("real.bin"), 3, "no limits for the monitor");
    refused(&with("model.bin"), 3, "model.bin");
    refused(&with("nothing.bin"), 3, "nothing.bin");
    let mut other = block.clone();
    other.limits = Some(jointwatch_shared::monitor::limits::Limits {
        model_checksum: !checksum,
        ..limits
    });
    let bytes = jointwatch_shared::wire::rig_block::encode(&other).unwrap();
    fs::write(at.join("other.bin"), bytes).unwrap();
    refused(&with("other.bin"), 3, "set for another model");
}

#[test]
fn what_is_wrong_with_a_description_is_said_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let good = example();
    let changes = [
        (
            "oversampling = 1024",
            "oversampling = 1000",
            "oversampling = 1000 is not",
        ),
        (
            "{ quadrature = 4 },",
            "{ quadrature = 3 },",
            "quadrature = 3",
        ),
        (
            "range_g = 2, corner_hz = 1000 }",
            "range_g = 3, corner_hz = 1000 }",
            "choose from 2, 4, 8",
        ),
        ("corner_hz = 1000 }", "corner_hz = 900 }", "corner_hz = 900"),
        (
            "far = \"+0\"",
            "far = \"0\"",
            "write a sign and a number from 0 to 3",
        ),
        ("far = \"+0\"", "far = \"+4\"", "\"+4\" is no counter"),
        ("near = \"+1\"", "near = \"-0\"", "the same counter"),
        ("  {},\n", "", "counter 3 is not fitted"),
        (
            "counts_per_m = 500000.0",
            "counts_per_m = 0.0",
            "has to be above 0",
        ),
        (
            "counts_per_m = 500000.0",
            "counts_per_rev = 500.0",
            "a translation takes counts_per_m",
        ),
        ("gain = 32", "gain = 33", "gain = 33 is not"),
        ("gain = 32", "gain = 256", "gain = 256 is not"),
        (
            "excitation_V = 3.0",
            "excitation_V = nan",
            "excitation_V = NaN",
        ),
        (
            "acceleration = [\"+0x\"]",
            "acceleration = [\"+0w\"]",
            "no direction",
        ),
        (
            "acceleration = [\"+0x\"]",
            "acceleration = [\"+0x\", \"-1x\"]",
            "same sign for their mean",
        ),
        ("[\"+1z\", \"-0z\"]", "[\"+1z\", \"+0z\"]", "opposite signs"),
        ("pair_distance_m = 0.12", "", "pair_distance_m is missing"),
        (
            "name = \"phi\"",
            "name = \"theta\"",
            "the model has no axis \"theta\"",
        ),
        ("name = \"phi\"", "name = \"x\"", "there twice"),
        (
            "bridge = \"+1\"",
            "bridge = \"+0\"",
            "is given away already",
        ),
        (
            "sensitivity = 1200.0",
            "sensitivty = 1200.0",
            "did you mean \"sensitivity\"?",
        ),
        (
            "force = 620.0",
            "force = 620000.0",
            "force delay in samples",
        ),
    ];
    for (from, to, wanted) in changes {
        assert!(good.contains(from), "{from}");
        fs::write(folder.path().join("rig.toml"), good.replacen(from, to, 1)).unwrap();
        let sentence = fail(folder.path(), &["export", &model(), "--rig", "rig.toml"], 3);
        assert!(sentence.contains(wanted), "{to}: {sentence}");
        assert!(sentence.contains("rig.toml"), "{to}: {sentence}");
        assert!(!folder.path().join("rig.bin").exists(), "{to}");
    }
    let sentence = fail(
        folder.path(),
        &["export", &model(), "--rig", "missing.toml"],
        3,
    );
    assert!(sentence.contains("missing.toml"), "{sentence}");
}

#[test]
fn a_damaged_block_is_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    exported(folder.path(), &example());
    let mut bytes = fs::read(folder.path().join("rig.bin")).unwrap();
    bytes[333] ^= 1;
    fs::write(folder.path().join("bad.bin"), &bytes).unwrap();
    assert!(fail(folder.path(), &["inspect", "bad.bin"], 3).contains("damaged"));
    fs::write(folder.path().join("bad.bin"), &bytes[..4000]).unwrap();
    assert!(fail(folder.path(), &["inspect", "bad.bin"], 3).contains("4000"));
}

//! The whole way round, as a user goes it: a joint changes, the device under QEMU raises its alarm,
//! the counts that it kept become a study, `changed` and `diagnose` name what changed, a new model
//! is learnt, signed and uploaded, and the alarm is gone.

use jointwatch::simulate::{SimulationOptions, write_study};
use jointwatch_shared::monitor::State;
use jointwatch_tests::monitor::watched::{RATE_HZ, STUDY_LEVEL};
use jointwatch_tests::program::{json, succeed};
use jointwatch_tests::running::Running;
use serde_json::Value;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// The sensors of the board; the acceleration is derived from the counts.
const RIG: &str = r#"
[wiring]
oversampling = 1024
counters = [{ quadrature = 4 }, { quadrature = 4 }]

[[axis]]
name = "x"
far = "+0"
near = "+1"
body = "+1"
counts_per_m = 500000.0
bridge = "+0"
gain = 32
sensitivity = 25000.0
excitation_V = 3.0
"#;
/// How much stiffer the joint becomes.
const STIFFER: f64 = 1.4;
/// Samples of the changed joint from which the new limits are set.
const STREAMED: usize = 12_000;

/// The state of x in a message on health.
fn state(line: &str) -> Option<u64> {
    let json: Value = serde_json::from_str(line).ok()?;
    let health = json["message"] == "health";
    json["axes"][0]["verdict"]["state"]
        .as_u64()
        .filter(|_| health)
}

/// Reads messages of a monitor until the axis is in this state; gives the states on the way.
fn until_state(monitor: &mut Running, wanted: State) -> Vec<u64> {
    let mut seen = Vec::new();
    monitor.until(&format!("{wanted:?}"), |line| {
        let state = state(line);
        if state.is_some() && seen.last() != state.as_ref() {
            seen.extend(state);
        }
        state == Some(u64::from(wanted.tag()))
    });
    seen
}

/// Learns a model of a study and exports it with its rig block.
fn exported(folder: &Path, study: &str, name: &str) {
    for words in [
        format!("identify {study} --model physical -o {name}.json"),
        format!("export {name}.json -o {name}.bin"),
        format!("export {name}.json --rig rig.toml --study {study} -o {name}.rig"),
    ] {
        succeed(folder, &words);
    }
}

/// What the device kept and streamed as a study: learnt from the one, validated on the other.
fn study_of_the_changed_joint(folder: &Path) {
    let from = |frames: &str, out: &str| {
        let words = format!("study-from {frames} --rig old.rig -o {out}");
        json(folder, &words)
    };
    let kept = from("capture.bin", "now");
    assert_eq!(kept["records"][1]["in_study"], true, "{kept}");
    let streamed = from("stream.bin", "later");
    assert_eq!(streamed["records"][0]["gaps"], 0, "{streamed}");
    let file = folder.join("now/study.toml");
    let text = fs::read_to_string(&file).unwrap();
    let (records, _) = text.split_once("[base]").unwrap();
    let own = fs::read_to_string(folder.join("rig/study.toml")).unwrap();
    let (_, base) = own.split_once("[base]").unwrap();
    let more = "[[record]]\nfile = \"../later/run_1.csv\"\nrole = \"validate\"\n";
    fs::write(file, format!("{records}{more}[base]{base}")).unwrap();
}

#[test]
fn a_change_is_found_named_learnt_and_no_alarm_any_more() {
    let home = TempDir::new().unwrap();
    let folder = home.path();
    let options = SimulationOptions {
        axes: 1,
        seed: 1,
        duration_s: 20.0,
        sample_rate_hz: RATE_HZ,
        validation_level: STUDY_LEVEL,
        ..SimulationOptions::default()
    };
    write_study(&folder.join("rig"), &options).unwrap();
    fs::write(folder.join("rig.toml"), RIG).unwrap();
    exported(folder, "rig", "old");
    let mut device = Running::start(folder, "emulate old.bin rig --rig old.rig --serve 0");
    let told = device.until("the address", |line| line.contains("--tcp"));
    let address = told.split_whitespace().last().unwrap().to_string();
    let port = format!("tcp:{address}");
    let listen = ["monitor", "--tcp", &address, "--json", "-"];

    let mut monitor = Running::start(folder, &listen);
    until_state(&mut monitor, State::Healthy);
    device.say(&format!("change stiffness@x*{STIFFER}"));
    device.until("the change", |line| line.contains("the joint changed"));
    println!(
        "states until the alarm: {:?}",
        until_state(&mut monitor, State::Alarm)
    );
    drop(monitor);
    // What the device streams after that says how well the new model does; by then the counts
    // behind the alarm are there as well.
    let stream = ["--stream", "1", "--record", "stream.bin"];
    let mut monitor = Running::start(folder, &[&listen[..], &stream].concat());
    for _ in 0..STREAMED {
        monitor.until("a sample", |line| line.contains("\"measured\""));
    }
    drop(monitor);
    succeed(folder, &["capture", "--port", &port, "-o", "capture.bin"]);
    study_of_the_changed_joint(folder);

    let changed = json(folder, &["changed", "old.json", "now"]);
    let parameters = changed["parameters"].as_array().unwrap();
    let counts: Vec<&Value> = parameters.iter().filter(|p| p["counts"] == true).collect();
    println!("{counts:?}");
    let [stiffness] = counts[..] else {
        panic!("the stiffness alone: {changed}");
    };
    assert_eq!(stiffness["effect"], "stiffness@x");
    let grew = stiffness["new"].as_f64().unwrap() / stiffness["old"].as_f64().unwrap();
    assert!((grew / STIFFER - 1.0).abs() < 0.02, "{grew}");
    let said = succeed(folder, &["diagnose", "now", "old.json"]);
    assert!(
        said.contains("Changed since the model was made: stiffness of stiffness@x by +"),
        "{said}"
    );
    assert!(said.contains("Nothing is missing"), "{said}");

    exported(folder, "now", "new");
    let sign = "sign new.bin --rig new.rig --development-key -o new.signed";
    succeed(folder, sign);
    succeed(folder, &["upload", "new.signed", "--port", &port]);
    let mut monitor = Running::start(folder, &listen);
    monitor.until("the restart", |line| {
        line.contains("\"occasion\":\"restart\"")
    });
    let seen = until_state(&mut monitor, State::Healthy);
    println!("states after the restart: {seen:?}");
    assert!(!seen.contains(&u64::from(State::Alarm.tag())), "{seen:?}");
    // The trial ends well, and no alarm comes meanwhile.
    let kept = monitor.until("the end of the trial", |line| {
        let alarm = state(line) == Some(u64::from(State::Alarm.tag()));
        assert!(!alarm, "an alarm under the new model: {line}");
        line.contains("model_confirmed")
    });
    println!("{kept}");
    device.say("quit");
    device.until("the end", |line| line.contains("switched off"));
}

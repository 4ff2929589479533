//! The device that runs on and on: a loop that no monitor takes for a change, and the demo that
//! needs no board, end to end.

use super::subject::{RATE_HZ, subject, validation};
use jointwatch::emulate::device::EmulatedDevice;
use jointwatch::emulate::joint::LoopedJoint;
use jointwatch_shared::base::Model;
use jointwatch_shared::chain::ChainState;
use jointwatch_shared::monitor::{Cause, Faults, Monitor, MonitorState, State, Verdict};
use jointwatch_tests::program::{fail, run, says};
use jointwatch_tests::running::Running;
use jointwatch_tests::story::story;
use serde_json::Value;
use std::net::TcpStream;

/// Every verdict of each axis over so many seconds of the loop, from power-on, with these changes
/// of the joint from 15 s on.
fn over_the_loop(model: &Model, changes: &[&str], seconds: f64) -> Vec<(f64, [Verdict; 2])> {
    let study = &subject().simulation.study;
    let device = EmulatedDevice::new(study, model, None).unwrap_or_else(|why| panic!("{why}"));
    let joint = LoopedJoint::new(&device, study, model, validation()).unwrap();
    let changes: Vec<_> = changes.iter().map(|c| joint.change(c).unwrap()).collect();
    let rounds = [
        joint.readings(&[]).unwrap(),
        joint.readings(&changes).unwrap(),
    ];
    let chain = &device.set_up.chain;
    let limits = device.block.limits.clone().expect("a validation record");
    let monitor = Monitor::new(limits, chain).unwrap();
    let wiring = &device.block.wiring;
    let (mut chained, mut state) = (ChainState::default(), MonitorState::default());
    let mut said: Vec<(f64, [Verdict; 2])> = Vec::new();
    for sample in 0..(seconds * RATE_HZ) as usize {
        let time_s = sample as f64 / RATE_HZ;
        let rows = &rounds[usize::from(time_s >= 15.0)];
        let raw = wiring.raw_sample(&rows[sample % rows.len()]);
        let output = chain.step(&mut chained, model, &raw);
        monitor.update(&mut state, &raw, output.as_ref(), &Faults::default());
        let now = [0, 1].map(|axis| state.axis(&monitor, axis).verdict);
        let same = |last: &(f64, [Verdict; 2])| (0..2).all(|a| last.1[a].same_reason(&now[a]));
        if !said.last().is_some_and(same) {
            said.push((time_s, now));
        }
    }
    println!("{said:?}");
    said
}

#[test]
fn a_loop_is_healthy_at_every_seam_and_a_change_is_found_on_its_axis() {
    let subject = subject();
    for model in [&subject.polynomial, &subject.physical] {
        // Forty seconds are eleven rounds of the record of four.
        let said = over_the_loop(model, &[], 40.0);
        let (_, last) = said.last().unwrap();
        assert!(last.iter().all(|v| v.state == State::Healthy), "{said:?}");
        let gravest = said.iter().flat_map(|(_, v)| v).map(|v| v.state).max();
        assert_eq!(gravest, Some(State::Healthy), "{said:?}");
    }
    let alarm = |changes: &[&str]| {
        let said = over_the_loop(&subject.physical, changes, 25.0);
        let mut alarms = said
            .into_iter()
            .flat_map(|(time_s, verdicts)| verdicts.map(|v| (time_s, v)).into_iter());
        alarms
            .find(|(_, v)| v.state == State::Alarm)
            .expect("an alarm")
    };
    let more = [Cause::Stiffer, Cause::MoreFriction, Cause::ForceUnexpected];
    let less = [Cause::Softer, Cause::LessFriction, Cause::ForceGone];
    for (change, axis, causes) in [
        ("force@x*0.5", 0, less),
        ("force@phi*1.5", 1, more),
        ("viscous@x*3", 0, more),
        ("stiffness@phi*0.3", 1, less),
    ] {
        let (time_s, verdict) = alarm(&[change]);
        assert!((15.0..21.0).contains(&time_s), "{change}: {time_s} s");
        assert_eq!(verdict.axis, axis, "{change}: {verdict:?}");
        assert!(causes.contains(&verdict.cause), "{change}: {verdict:?}");
    }
    // A change and its opposite leave the joint as it is.
    let study = &subject.simulation.study;
    let device = EmulatedDevice::new(study, &subject.physical, None).unwrap();
    let joint = LoopedJoint::new(&device, study, &subject.physical, validation()).unwrap();
    let changes = ["viscous@x*1.5", "viscous@x*0.5"].map(|c| joint.change(c).unwrap());
    let (plain, both) = (
        joint.readings(&[]).unwrap(),
        joint.readings(&changes).unwrap(),
    );
    assert_eq!(plain, both);
    for wrong in [
        "viscous@x",
        "viscous@x*",
        "viscous@x*11",
        "viscous@x*nan",
        "dahl@x*2",
        "*2",
        "",
    ] {
        let sentence = joint.change(wrong).unwrap_err().sentence;
        says(&sentence, &["force@x, force@phi", "viscous@phi"]);
    }
}

#[test]
fn the_demo_without_a_board_goes_from_healthy_to_an_alarm_of_the_right_axis() {
    let [blob, study] = ["model.bin", "rig/study.toml"].map(|file| story().join(file));
    let [blob, study] = [&blob, &study].map(|path| path.to_str().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let emulate = ["emulate", blob, study, "--serve", "0"];
    let mut device = Running::start(folder.path(), &emulate);
    let told = device.until("the address", |line| line.contains("--tcp"));
    let address = told.split_whitespace().last().unwrap().to_string();
    assert!(address.starts_with("127.0.0.1:"), "{address}");

    let recorded = folder.path().join("frames.bin");
    let record = recorded.to_str().unwrap();
    let monitor = [
        "monitor", "--tcp", &address, "--stream", "4", "--json", "-", "--record", record,
    ];
    let mut listener = Running::start(folder.path(), &monitor);
    let hello = listener.until("an introduction", |line| line.contains("\"hello\""));
    let hello: Value = serde_json::from_str(&hello).unwrap();
    assert_eq!(hello["model"]["axes"][1]["name"], "phi");
    listener.until("samples", |line| line.contains("\"measured\""));
    let axes = |line: &str| -> Option<Vec<[u64; 2]>> {
        let json: Value = serde_json::from_str(line).ok()?;
        let axes = json["axes"]
            .as_array()
            .filter(|_| json["message"] == "health")?;
        let code = |axis: &Value, key: &str| axis["verdict"][key].as_u64();
        axes.iter()
            .map(|a| Some([code(a, "state")?, code(a, "cause")?]))
            .collect()
    };
    let healthy = u64::from(State::Healthy.tag());
    let line = listener.until("a healthy joint", |line| {
        axes(line).is_some_and(|axes| axes.iter().all(|a| a[0] == healthy))
    });
    println!("{line}");

    // Nonsense is answered, and the joint stays as it is.
    device.say("break it");
    device.until("an answer", |line| {
        line.contains("is no change") && line.contains("force@phi")
    });
    device.say("change force@phi*0.5");
    device.until("the change", |line| {
        line.contains("the joint changed: force@phi*0.5")
    });
    let alarm = u64::from(State::Alarm.tag());
    let line = listener.until("an alarm", |line| {
        axes(line).is_some_and(|axes| axes.iter().any(|a| a[0] == alarm))
    });
    println!("{line}");
    let [x, phi] = axes(&line).unwrap()[..] else {
        panic!("two axes: {line}");
    };
    let less = [
        Cause::Softer,
        Cause::LessFriction,
        Cause::ForceGone,
        Cause::ErrorGrew,
    ];
    assert!(x[0] != alarm && phi[0] == alarm, "{line}");
    assert!(less.iter().any(|c| u64::from(c.tag()) == phi[1]), "{line}");
    device.say("restore");
    device.until("the old joint", |line| {
        line.contains("the joint is what it was")
    });

    device.say("quit");
    device.until("the end", |line| line.contains("switched off"));
    let end = listener.until("the count", |line| line.contains("\"end\""));
    let end: Value = serde_json::from_str(&end).unwrap();
    assert_eq!(
        (&end["lost"], &end["damaged"]),
        (&0.into(), &0.into()),
        "{end}"
    );
    assert_eq!(end["bytes"], std::fs::metadata(&recorded).unwrap().len());
    drop((listener, device));
    assert!(
        TcpStream::connect(&address).is_err(),
        "nobody listens any more"
    );
}

#[test]
fn a_service_that_cannot_be_is_refused_in_a_sentence() {
    let [blob, study] = ["model.bin", "rig/study.toml"].map(|file| story().join(file));
    let [blob, study] = [&blob, &study].map(|path| path.to_str().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let refused = |more: &[&str]| {
        let arguments = [&["emulate", blob, study][..], more].concat();
        fail(folder.path(), &arguments, 2)
    };
    assert!(refused(&["--serve", "0", "--change", "dahl@x"]).contains("is no change"));
    // The parser of the command line says these in its own lines.
    for wrong in [["--change", "force@x*2"], ["--serve", "70000"]] {
        let arguments = [&["emulate", blob, study][..], &wrong].concat();
        let code = run(folder.path(), &arguments).status.code();
        assert_eq!(code, Some(2), "{wrong:?}");
    }
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let sentence = fail(
        folder.path(),
        &["emulate", blob, study, "--serve", &port],
        1,
    );
    assert!(
        sentence.contains(&port) && sentence.contains("--serve"),
        "{sentence}"
    );
}

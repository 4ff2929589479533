//! The firmware itself under QEMU on emulated sensor chips: the host's bits on a healthy run, and a device that goes on, says what
//! is wrong and recovers when something fails.
//!
//! A missing QEMU fails these tests; nothing is skipped.

use jointwatch::device;
use jointwatch::emulate::bench::{REST, Run, Scenario};
use jointwatch::emulate::board::{DropOuts, Injection, Place, Trouble};
use jointwatch::emulate::device::Device;
use jointwatch::emulate::judge::Known;
use jointwatch::emulate::line::{Talk, Uploading};
use jointwatch::emulate::size;
use jointwatch::error::Error;
use jointwatch::export::export;
use jointwatch::fit::polynomial::PolynomialOptions;
use jointwatch::identify;
use jointwatch::rig_block;
use jointwatch::signing::{PrivateKey, SignedModel};
use jointwatch::sim::{Simulation, SimulationOptions, simulate};
use jointwatch::study::{Record, Role};
use jointwatch::upload::Patience;
use jointwatch_shared::blob;
use jointwatch_shared::model::Model;
use jointwatch_shared::monitor::{Cause, State};
use jointwatch_shared::rig_block::RigBlock;
use jointwatch_shared::slot::{ContentCrc, signed_prefix};
use jointwatch_shared::telemetry::{
    Counters, Decoder, Event, Kind, MAX_FRAME, Report, Request, Restart, Signature, UploadReply,
    UploadRequest as Ask, encode,
};
use jointwatch_tests::program::{fail, succeed};
use jointwatch_tests::story::story;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

/// Rows per second of the simulated rig, and seconds of each record.
const RATE_HZ: f64 = 2000.0;
const SECONDS: f64 = 4.0;

/// What the estimate of the highest sample rate in `docs/firmware.md` rests on: a full board's time on the bus, from the data sheets' clocks;
/// the processor's clock; and cycles per instruction, which no emulator counts.
const BUS_S: f64 = 120e-6;
const CLOCK_HZ: f64 = 168e6;
const CYCLES_PER_INSTRUCTION: f64 = 1.5;

/// A rig, a polynomial and the sum of the base terms, both exported.
struct Subject {
    simulation: Simulation,
    polynomial: Model,
    physical: Model,
}

fn subject() -> &'static Subject {
    static SUBJECT: OnceLock<Subject> = OnceLock::new();
    SUBJECT.get_or_init(|| {
        let options = SimulationOptions {
            seed: 5,
            duration_s: SECONDS,
            sample_rate_hz: RATE_HZ,
            ..SimulationOptions::default()
        };
        let simulation = simulate(&options).expect("a stable rig");
        let study = &simulation.study;
        let exported = |file| {
            let exported = export(&file, None).expect("it fits the device");
            blob::decode(&exported.blob).expect("a sound blob")
        };
        let polynomial = identify::polynomial(study, &PolynomialOptions::default(), &|_| ());
        Subject {
            polynomial: exported(polynomial.expect("a fit").model),
            physical: exported(identify::physical(study).expect("a fit").model),
            simulation,
        }
    })
}

fn validation() -> &'static Record {
    let mut records = subject().simulation.study.records.iter();
    records
        .find(|record| record.role == Role::Validate)
        .expect("the simulation has one")
}

fn image() -> &'static Path {
    static IMAGE: OnceLock<PathBuf> = OnceLock::new();
    IMAGE.get_or_init(|| device::emulated().unwrap_or_else(|why| panic!("{why}")))
}

fn polynomial() -> Device<'static> {
    Device::new(&subject().simulation.study, &subject().polynomial, None)
        .unwrap_or_else(|why| panic!("{why}"))
}

/// Runs the device over the validation record with its own model in slot A.
fn run(device: &Device<'_>, scenario: Scenario) -> Run {
    let slot = device.slot().expect("it can be signed").to_bytes();
    run_with(device, &slot, &[], scenario)
}

fn run_with(device: &Device<'_>, slot: &[u8], others: &[Known<'_>], scenario: Scenario) -> Run {
    let run = device.run(image(), slot, validation(), others, scenario);
    run.unwrap_or_else(|why| panic!("{why}")).run
}

/// Every bit of every output is the host's, for the counts that the device itself names.
fn same_bits(run: &Run) {
    let c = &run.comparison;
    assert!(c.outputs > 0, "{c:?}");
    assert_eq!((c.different_bits, c.first_difference), (0, None), "{c:?}");
}

fn counters(run: &Run) -> Counters {
    run.statuses.last().expect("a status").counters
}

/// Samples after the end of a fault in which every count is right again, unless its chip was given up meanwhile.
const RECOVERY: u64 = 64;
/// The same with a chip that was given up: its wait is doubled with every try.
const RECOVERY_OF_GIVEN_UP: u64 = 2048;

/// Nothing was concluded about the joint, which is healthy.
fn no_damage(run: &Run) {
    let mut verdicts = run.statuses.iter().filter_map(|s| s.verdict.read());
    let alarm = verdicts.find(|v| v.state == State::Alarm && v.cause.is_damage());
    assert_eq!(alarm, None);
}

/// Whether the device ever said so, of the whole or of a channel.
fn said(run: &Run, cause: Cause) -> bool {
    run.statuses.iter().any(|status| {
        let of_all = status.verdict.read().map(|verdict| verdict.cause);
        of_all == Some(cause) || status.channels.iter().any(|c| c.fault == cause.tag())
    })
}

#[test]
fn a_healthy_run_has_the_hosts_bits_and_counts_its_costs() {
    let subject = subject();
    let rows = validation().rows as u64;
    for model in [&subject.polynomial, &subject.physical] {
        let device = Device::new(&subject.simulation.study, model, None).unwrap();
        let slot = device.slot().unwrap().to_bytes();
        let emulated = device
            .run(image(), &slot, validation(), &[], Scenario::default())
            .unwrap_or_else(|why| panic!("{why}"));
        let (run, c) = (&emulated.run, &emulated.run.comparison);
        same_bits(run);
        assert_eq!(run.instants, REST + rows);
        assert_eq!(c.samples, run.instants, "every sample is streamed");
        assert_eq!(c.wrong_counts, 0, "{:?}", run.wrong);
        let fill = 2 * device.set_up.chain.delay() as u64;
        assert_eq!(c.replayed, rows - fill);
        // Clearances have no memory: replay of the record alone says the same.
        assert_eq!(c.different_replayed_bits, 0, "{c:?}");
        assert_eq!((run.tally.lost, run.tally.damaged), (0, 0));
        assert_eq!(counters(run), Counters::default());
        println!("{:?}", run.events);
        let started = |event: &Event| matches!(event, Event::Started { .. });
        assert!(run.events.iter().any(started));
        assert!(
            run.events.contains(&Event::NoCrystal),
            "QEMU has no crystal"
        );
        let last = run.statuses.last().and_then(|s| s.verdict.read()).unwrap();
        assert_ne!(last.state, State::Alarm, "{last:?}");

        let memory = run.memory.expect("the device counts");
        let size = size::of(image()).unwrap();
        println!("{:?}\n{memory:?} {size:?}", run.instructions);
        assert!(size.flash <= 90 * 1024, "{size:?}");
        assert!(memory.variables <= 24 * 1024, "{memory:?}");
        assert!(
            4 * memory.stack_peak <= 3 * memory.stack_reserved,
            "{memory:?}"
        );
        let [_, evaluate, monitor, _] = &run.instructions[..] else {
            panic!("four steps: {:?}", run.instructions);
        };
        let computed = f64::from(evaluate.most + monitor.most) * CYCLES_PER_INSTRUCTION / CLOCK_HZ;
        println!(
            "{:.0} µs of computation and {:.0} µs on the bus",
            1e6 * computed,
            1e6 * BUS_S
        );
        assert!(computed + BUS_S <= 1.0 / 5000.0, "no 5 kHz: {computed} s");
        let seconds = rows as f64 / RATE_HZ;
        println!(
            "{:.2} times real time",
            seconds / emulated.took.as_secs_f64()
        );
    }
}

#[test]
fn every_trouble_of_a_chip_is_said_and_passes_and_stops_nothing() {
    let device = polynomial();
    let samples = 2000..4000;
    for (place, trouble, causes) in [
        (
            Place::Converter,
            Trouble::Silent(0x00),
            vec![Cause::Checksum],
        ),
        (
            Place::Converter,
            Trouble::Silent(0xFF),
            vec![Cause::Checksum],
        ),
        (Place::Converter, Trouble::Damaged, vec![Cause::Checksum]),
        (
            Place::Converter,
            Trouble::Replaced,
            vec![Cause::TimeOut, Cause::Missing, Cause::Checksum],
        ),
        (
            Place::Converter,
            Trouble::PowerCut,
            vec![Cause::TimeOut, Cause::Missing],
        ),
        (Place::Converter, Trouble::Stuck, vec![Cause::Stuck]),
        (Place::Converter, Trouble::Saturated, vec![Cause::Saturated]),
        (Place::Counter(0), Trouble::Stuck, vec![Cause::Stuck]),
        (
            Place::Counter(2),
            Trouble::Silent(0xFF),
            vec![Cause::TimeOut, Cause::Missing],
        ),
        (
            Place::Counter(1),
            Trouble::PowerCut,
            vec![Cause::TimeOut, Cause::Missing, Cause::OutsideRange],
        ),
        (
            Place::Accelerometer(0),
            Trouble::Silent(0xFF),
            vec![Cause::TimeOut, Cause::Missing],
        ),
        (
            Place::Accelerometer(1),
            Trouble::Replaced,
            vec![Cause::TimeOut, Cause::Missing],
        ),
        (
            Place::Accelerometer(0),
            Trouble::Saturated,
            vec![Cause::Saturated],
        ),
    ] {
        let injection = Injection {
            place,
            trouble,
            samples: samples.clone(),
        };
        let run = run(
            &device,
            Scenario {
                injections: vec![injection],
                ..Scenario::default()
            },
        );
        same_bits(&run);
        let seen: Vec<_> = run
            .statuses
            .iter()
            .filter_map(|s| s.verdict.read())
            .map(|v| (v.state, v.cause))
            .collect();
        assert!(
            causes.iter().any(|cause| said(&run, *cause)),
            "{place:?} {trouble:?}: {seen:?}"
        );
        assert_eq!(run.comparison.samples, run.instants);
        // What is over is over, but for a count that the chip itself lost: of that no conclusion is drawn about the joint.
        let lost = matches!((place, trouble), (Place::Counter(_), Trouble::PowerCut));
        let allowed = if lost { Cause::ReferenceLost.tag() } else { 0 };
        let last = run.statuses.last().unwrap();
        assert!(
            last.channels
                .iter()
                .all(|c| [0, allowed].contains(&c.fault)),
            "{place:?} {trouble:?} has passed: {:?}",
            last.channels
        );
        assert_eq!(
            said(&run, Cause::ReferenceLost),
            lost,
            "{place:?} {trouble:?}"
        );
        no_damage(&run);
        if lost {
            let verdict = last.verdict.read().map(|v| (v.state, v.cause, v.channel));
            let wanted = (State::Alarm, Cause::ReferenceLost, 1);
            assert_eq!(verdict, Some(wanted), "{place:?} {trouble:?}");
        } else if let Some(last) = run.comparison.last_wrong_counts {
            println!(
                "{place:?} {trouble:?}: the last wrong count came with sample {last} of {}",
                run.instants
            );
            assert!(
                last < samples.end + RECOVERY_OF_GIVEN_UP,
                "{place:?} {trouble:?}: {last}"
            );
        }
    }
}

#[test]
fn transfers_that_drop_out_change_no_bit_of_what_is_computed() {
    let device = polynomial();
    let samples = 1000..3000;
    for part in [0.01, 0.1, 0.5] {
        let run = run(
            &device,
            Scenario {
                drop_outs: Some(DropOuts {
                    part,
                    samples: samples.clone(),
                }),
                seed: 21,
                ..Scenario::default()
            },
        );
        same_bits(&run);
        assert_eq!(run.comparison.samples, run.instants);
        let worst = run.statuses.iter().filter_map(|s| s.verdict.read());
        assert!(
            worst.into_iter().any(|v| v.state != State::Healthy),
            "{part}"
        );
        let last = run.statuses.last().unwrap();
        let wrong = last.channels.iter().filter(|c| c.fault != 0).count();
        assert_eq!(wrong, 0, "{part}: {:?}", last.channels);
        println!("{part}: {:?}", run.comparison);
        let last = run.comparison.last_wrong_counts.expect("drop-outs");
        // With every second transfer lost the converter is given up, and tried again ever more rarely.
        let recovery = if part < 0.5 {
            RECOVERY
        } else {
            RECOVERY_OF_GIVEN_UP
        };
        assert!(
            last < samples.end + recovery,
            "{part}: still wrong at {last}"
        );
        assert!(
            !said(&run, Cause::ReferenceLost),
            "{part}: no chip lost its count"
        );
        no_damage(&run);
    }
}

#[test]
fn noise_on_the_line_destroys_frames_and_nothing_else() {
    let device = polynomial();
    for (bit_error_rate, arrive) in [(1e-3, 0.2), (1e-2, 1e-4), (1e-1, 0.0)] {
        let run = run(
            &device,
            Scenario {
                bit_error_rate,
                seed: 31,
                ..Scenario::default()
            },
        );
        let c = &run.comparison;
        assert_eq!(
            (c.different_bits, c.wrong_counts),
            (0, 0),
            "{bit_error_rate}: {c:?}"
        );
        assert!(c.samples as f64 >= arrive * run.instants as f64, "{c:?}");
        println!("{bit_error_rate}: {c:?} {:?}", run.tally);
    }
}

#[test]
fn samples_that_come_late_are_counted_and_never_hidden() {
    let device = polynomial();
    let run = run(
        &device,
        Scenario {
            late: vec![(700, 3), (701, 1), (2000, 200)],
            ..Scenario::default()
        },
    );
    same_bits(&run);
    assert_eq!(counters(&run).missed_deadlines, 204);
}

fn patience() -> Patience {
    Patience {
        silent_reads: 100,
        silent_reads_at_work: 400,
        longest: Duration::from_secs(20),
        tries: 30,
        beginnings: 3,
    }
}

/// The same rig with the other model on it.
fn other_block(device: &Device<'_>) -> RigBlock {
    let RigBlock {
        rig,
        wiring,
        limits,
        ..
    } = device.block.clone();
    RigBlock::new(rig, wiring, limits, &subject().physical).unwrap()
}

/// The other model for the same rig, signed.
fn other(device: &Device<'_>) -> SignedModel {
    let rig = rig_block::encode(&other_block(device)).unwrap();
    let model = blob::encode(&subject().physical);
    SignedModel::sign(&model, &rig, &PrivateKey::development()).unwrap()
}

fn uploading(model: SignedModel) -> Scenario {
    Scenario {
        talk: Some((200, Uploading::of(model, patience()))),
        // Checked, activated, a restart a second later, and some time with the new model.
        linger: 6000,
        ..Scenario::default()
    }
}

#[test]
fn a_good_model_is_uploaded_and_runs_after_the_restart() {
    let device = polynomial();
    let successor = Device::new(
        &subject().simulation.study,
        &subject().physical,
        Some(other_block(&device)),
    )
    .unwrap();
    let slot = device.slot().unwrap().to_bytes();
    let run = run_with(
        &device,
        &slot,
        &[successor.known()],
        uploading(other(&device)),
    );
    let uploaded = run.uploaded.as_ref().expect("it has ended");
    assert!(uploaded.is_ok(), "{uploaded:?}");
    same_bits(&run);
    assert!(run.hellos.len() > 1, "{:?}", run.hellos);
    let crc = run
        .hellos
        .last()
        .and_then(|h| h.model.as_ref())
        .unwrap()
        .crc;
    assert_eq!(crc, successor.known().crc);
}

#[test]
fn a_restart_in_the_middle_of_an_upload_leaves_the_old_model_and_the_upload_begins_anew() {
    let device = polynomial();
    let slot = device.slot().unwrap().to_bytes();
    let successor = Device::new(
        &subject().simulation.study,
        &subject().physical,
        Some(other_block(&device)),
    )
    .unwrap();
    let mut scenario = uploading(other(&device));
    scenario.restart_after_replies = Some(20);
    let run = run_with(&device, &slot, &[successor.known()], scenario);
    same_bits(&run);
    let crcs: Vec<_> = run
        .hellos
        .iter()
        .map(|hello| hello.model.as_ref().map(|model| model.crc))
        .collect();
    // The old one, the old one after the restart, the new one after its upload.
    let [old, new] = [device.known().crc, successor.known().crc];
    assert_eq!(crcs[..2], [Some(old), Some(old)], "{crcs:?}");
    assert_eq!(crcs.last(), Some(&Some(new)), "{crcs:?}");
    let software = Event::Started {
        why: Restart::Software,
    };
    assert!(run.events.contains(&software), "{:?}", run.events);
    assert!(run.uploaded.expect("it has ended").is_ok());
}

#[test]
fn what_must_not_run_is_refused_and_the_old_model_goes_on() {
    let device = polynomial();
    let rig = rig_block::encode(&device.block).unwrap();
    let model = blob::encode(&subject().physical);
    let stranger = PrivateKey::generate().unwrap();
    for (bad, wanted) in [
        (
            SignedModel::unsigned(&model, &rig).unwrap(),
            "sign it first",
        ),
        (
            SignedModel::sign(&model, &rig, &stranger).unwrap(),
            "signature is not by the key",
        ),
    ] {
        let mut scenario = uploading(bad);
        scenario.linger = 500;
        let run = run(&device, scenario);
        let why: Error = run.uploaded.as_ref().unwrap().clone().unwrap_err();
        assert!(why.sentence.contains(wanted), "{why}");
        same_bits(&run);
        assert_eq!(run.hellos.len(), 1, "no restart");
    }
}

#[test]
fn a_slot_that_holds_no_usable_model_leaves_raw_counts_and_a_named_reason() {
    let device = polynomial();
    let good = device.slot().unwrap().to_bytes();
    let mut damaged = good.clone();
    damaged[1000] ^= 1;
    let rig = rig_block::encode(&device.block).unwrap();
    let unsigned = SignedModel::unsigned(&blob::encode(&subject().polynomial), &rig).unwrap();
    let short = Scenario::default;
    for slot in [vec![0xFF; 8448], damaged, unsigned.to_bytes()] {
        let run = run_with(&device, &slot, &[], short());
        assert!(run.events.contains(&Event::NoModel), "{:?}", run.events);
        assert!(said(&run, Cause::NoModel));
        assert_eq!(run.comparison.outputs, 0);
        assert_eq!(run.comparison.samples, run.instants, "sensors are reported");
    }
}

#[test]
fn an_image_that_is_missing_or_no_image_is_said_in_a_sentence() {
    let device = polynomial();
    let slot = device.slot().unwrap().to_bytes();
    let absent = Path::new("/nowhere/jointwatch-link");
    let why = device
        .run(absent, &slot, validation(), &[], Scenario::default())
        .map(|_| ())
        .unwrap_err();
    assert!(why.sentence.contains("/nowhere/jointwatch-link"), "{why}");
    let text = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"));
    let why = device.run(text, &slot, validation(), &[], Scenario::default());
    assert!(why.is_err());
    assert!(size::of(text).is_err());
}

/// A host that checks nothing before it sends: announces `crc`, sends the bytes, finishes with a good signature over them.
fn forged(content: Vec<u8>, crc: u32) -> Talk {
    Box::new(move |wire| {
        let message = [
            &signed_prefix(content.len().saturating_sub(4096) as u32)[..],
            &content,
        ]
        .concat();
        let signature = Signature::new(PrivateKey::development().sign(&message));
        let mut decoder = Decoder::<Report>::default();
        let mut sequence = 0;
        let mut ask = |step: Ask| -> Result<UploadReply, Error> {
            let broken = |why: std::io::Error| Error::failed(why.to_string());
            let mut place = [0; MAX_FRAME];
            let frame = encode(&Request::Upload(step), sequence, &mut place).expect("it fits");
            sequence += 1;
            wire.write_all(frame).map_err(broken)?;
            for _ in 0..2000 {
                let mut bytes = [0; 256];
                let count = wire.read(&mut bytes).map_err(broken)?;
                for &byte in &bytes[..count] {
                    if let Some(Ok(frame)) = decoder.push(byte)
                        && let Report::Upload(reply) = frame.message
                    {
                        return Ok(reply);
                    }
                }
            }
            Err(Error::failed("no answer"))
        };
        let mut reply = ask(Ask::Begin {
            kind: Kind::Model,
            length: content.len() as u32,
            crc,
        })?;
        for (number, data) in content.chunks(128).enumerate() {
            if let UploadReply::Accepted { .. } = reply {
                reply = ask(Ask::Chunk {
                    offset: number as u32 * 128,
                    data: data.iter().copied().collect(),
                })?;
            }
        }
        if let UploadReply::Accepted { .. } = reply {
            reply = ask(Ask::Finish {
                signature: Some(signature),
            })?;
        }
        Err(Error::data(format!("{reply:?}")))
    })
}

#[test]
fn what_no_honest_host_sends_is_refused_by_the_device_itself() {
    let device = polynomial();
    let crc = |content: &[u8]| {
        let mut crc = ContentCrc::new();
        crc.absorb(content);
        crc.value()
    };
    let good = blob::encode(&subject().physical).to_vec();
    let mut corrupt = good.clone();
    corrupt[7] ^= 64;
    let mut newer = good.clone();
    newer[4] = 3;
    let long = vec![0; 8196];
    for (content, announced, wanted) in [
        (corrupt.clone(), crc(&good), "Checksum"),
        (corrupt.clone(), crc(&corrupt), "Model(Checksum)"),
        (newer.clone(), crc(&newer), "Model(Version)"),
        (long.clone(), crc(&long), "Length"),
    ] {
        let run = run(
            &device,
            Scenario {
                talk: Some((200, forged(content, announced))),
                linger: 500,
                ..Scenario::default()
            },
        );
        let why = run.uploaded.as_ref().unwrap().clone().unwrap_err();
        assert!(
            why.sentence.contains("Refused") && why.sentence.contains(wanted),
            "{wanted}: {why}"
        );
        same_bits(&run);
        assert_eq!(run.hellos.len(), 1, "no restart");
    }
}

#[test]
fn the_program_says_what_agrees_and_refuses_bad_input_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let blob = story().join("model.bin");
    let study = story().join("rig/study.toml");
    let [blob, study] = [&blob, &study].map(|path| path.to_str().unwrap());
    let record = "valid.csv";
    let arguments = ["emulate", blob, study, "--record", record, "--json", "-"];
    let said = succeed(folder.path(), &arguments);
    let said: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!(said["records"][0]["agrees"], true, "{said}");
    assert_eq!(said["records"][0]["comparison"]["different_bits"], 0);

    let sentence = fail(
        folder.path(),
        &["emulate", blob, study, "--record", "x.csv"],
        2,
    );
    assert!(sentence.contains("x.csv"), "{sentence}");
    for command in ["emulate", "replay"] {
        let sentence = fail(folder.path(), &[command, blob, study, "--rig", "no.bin"], 3);
        assert!(sentence.contains("no.bin"), "{sentence}");
        let sentence = fail(folder.path(), &[command, blob, study, "--rig", blob], 3);
        assert!(sentence.contains("model.bin"), "{sentence}");
    }
}

//! `jointwatch monitor`: every line is a message that was sent, what was lost is told, and it ends
//! as it should.

use jointwatch_shared::monitor::{self, Cause};
use jointwatch_shared::wire::telemetry::{
    Access, Counters, Hello, MAX_FRAME, Occasion, PROTOCOL_VERSION, Report, Status, encode,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

const JOINTWATCH: &str = env!("CARGO_BIN_EXE_jointwatch");

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(JOINTWATCH)
        .current_dir(folder)
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("the program starts")
}

fn succeed(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {error}");
    String::from_utf8(output.stdout).unwrap()
}

/// The one sentence of a failure with this exit code.
fn fail(folder: &Path, arguments: &[&str], code: i32) -> String {
    let output = run(folder, arguments);
    let sentence = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(
        output.status.code(),
        Some(code),
        "{arguments:?}: {sentence}"
    );
    println!("{sentence}");
    sentence
}

fn json_lines(text: &str) -> Vec<Value> {
    let lines = text.lines();
    lines
        .map(|line| serde_json::from_str(line).expect(line))
        .collect()
}

fn frame(report: &Report, sequence: u16) -> Vec<u8> {
    let mut place = [0; MAX_FRAME];
    encode(report, sequence, &mut place).unwrap().to_vec()
}

fn hello(occasion: Occasion) -> Report {
    Report::Hello(Hello {
        protocol: PROTOCOL_VERSION,
        firmware: [1, 2, 3],
        occasion,
        model: None,
        rig: None,
        access: Access {
            development_key: true,
            ..Access::default()
        },
    })
}

/// A status that can be told from every other one.
fn status(number: u32) -> Report {
    Report::Status(Status {
        sample: 100 * u64::from(number),
        verdict: monitor::Verdict::without(Cause::NoRig).into(),
        outside_permille: 0,
        axes: heapless::Vec::new(),
        channels: heapless::Vec::new(),
        counters: Counters {
            missed_deadlines: number,
            ..Counters::default()
        },
        development_key: true,
    })
}

/// A device that starts and then sends so many statuses.
fn session(statuses: u32) -> Vec<u8> {
    let mut bytes = frame(&hello(Occasion::Restart), 0);
    for number in 1..=statuses {
        bytes.extend(frame(&status(number), number as u16));
    }
    bytes
}

#[test]
fn a_whole_session_is_printed_and_nothing_is_lost() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("capture.bin"), session(5)).unwrap();
    let text = succeed(folder.path(), &["monitor", "capture.bin"]);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 7, "{text}");
    assert!(lines[0].contains("firmware 1.2.3, restarted; no model; no rig block"));
    for line in &lines[..6] {
        assert!(line.contains("development key: anybody can put"), "{line}");
    }
    assert!(lines[1].contains("sample 100: not judged, rig block missing"));
    assert!(lines[3].contains("3 samples late"));
    assert!(lines[6].contains("6 messages") && lines[6].contains("0 lost on the way"));

    let json = json_lines(&succeed(
        folder.path(),
        &["monitor", "capture.bin", "--json", "-"],
    ));
    assert_eq!(json.len(), 7);
    assert_eq!(json[0]["message"], "hello");
    assert_eq!(json[0]["occasion"], "restart");
    assert_eq!(json[2]["sequence"], 2);
    assert_eq!(json[2]["counters"]["missed_deadlines"], 2);
    assert_eq!(json[2]["text"], lines[2]);
    assert_eq!(json[6]["message"], "end");
    assert_eq!(json[6]["messages"], 6);
    assert_eq!(json[6]["torn_end"], false);

    // Text and JSON at once; and neither.
    let said = succeed(
        folder.path(),
        &["monitor", "capture.bin", "--json", "log.jsonl"],
    );
    assert_eq!(said, text);
    let log = fs::read_to_string(folder.path().join("log.jsonl")).unwrap();
    assert_eq!(json_lines(&log), json);
    assert_eq!(
        succeed(folder.path(), &["monitor", "capture.bin", "--quiet"]),
        ""
    );

    // What was recorded is not written over.
    let record = ["monitor", "capture.bin", "--quiet", "--record", "kept.bin"];
    succeed(folder.path(), &record);
    let kept = || fs::read(folder.path().join("kept.bin")).unwrap();
    let first = kept();
    assert_eq!(first, fs::read(folder.path().join("capture.bin")).unwrap());
    let sentence = fail(folder.path(), &record, 2);
    assert!(
        sentence.contains("kept.bin: --record would write over"),
        "{sentence}"
    );
    assert_eq!(kept(), first);
}

#[test]
fn what_is_lost_restarted_torn_or_unknown_is_told() {
    let folder = TempDir::new().unwrap();
    let mut bytes = frame(&status(9), 9)[5..].to_vec();
    bytes.extend(frame(&status(10), 10));
    bytes.extend(frame(&status(14), 14));
    bytes.extend(frame(&hello(Occasion::Restart), 0));
    // A restart whose introduction was lost: numbers go backwards.
    bytes.extend(frame(&status(2), 1));
    bytes.extend(frame(&status(3), 60_000));
    bytes.extend(&frame(&status(4), 60_001)[..8]);
    fs::write(folder.path().join("torn.bin"), bytes).unwrap();
    let json = json_lines(&succeed(
        folder.path(),
        &["monitor", "torn.bin", "--json", "-"],
    ));
    let kinds: Vec<&str> = json
        .iter()
        .map(|l| l["message"].as_str().unwrap())
        .collect();
    assert_eq!(
        kinds,
        [
            "status",
            "lost",
            "status",
            "restarted",
            "hello",
            "status",
            "restarted",
            "lost",
            "status",
            "end"
        ]
    );
    assert_eq!(json[1]["count"], 3);
    let end = json.last().unwrap();
    assert_eq!(end["restarts"], 2);
    assert_eq!(end["lost"], 60_003);
    assert_eq!(
        end["damaged"], 0,
        "the rest of a frame at the start is no damage"
    );
    assert_eq!(end["torn_end"], true);
}

/// A hundred thousand frames over a noisy line, then silence and one good frame.
#[test]
fn no_line_is_printed_that_was_not_sent_and_the_frame_after_the_noise_is() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("noisy.bin");
    for (seed, rate) in [(1_u64, 1e-3), (2, 3e-3), (3, 1e-2), (4, 1e-1)] {
        println!("seed {seed}, bit error rate {rate:e}");
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let sent = 25_000;
        let mut bytes = session(sent);
        for byte in &mut bytes {
            for bit in 0..8 {
                *byte ^= u8::from(random.random_bool(rate)) << bit;
            }
        }
        bytes.extend((0..300).map(|_| random.random::<u8>()));
        bytes.extend(frame(&status(sent + 1), (sent + 1) as u16));
        fs::write(&path, bytes).unwrap();
        let output = succeed(folder.path(), &["monitor", "noisy.bin", "--json", "-"]);
        let json = json_lines(&output);
        let messages: Vec<&Value> = json.iter().filter(|l| l["sequence"].is_u64()).collect();
        for line in &messages {
            let sequence = line["sequence"].as_u64().unwrap();
            if sequence == 0 {
                assert_eq!(line["message"], "hello");
            } else {
                assert_eq!(line["message"], "status");
                assert_eq!(line["sample"], 100 * sequence);
                assert_eq!(line["counters"]["missed_deadlines"], sequence);
            }
        }
        assert_eq!(messages.last().unwrap()["sequence"], u64::from(sent + 1));
        let end = json.last().unwrap();
        println!("{end}");
        assert_eq!(end["messages"], messages.len());
        assert_eq!(end["unknown"], 0);
        // The first ones may have been lost before anything was heard; all others are accounted
        // for.
        let first = messages[0]["sequence"].as_u64().unwrap();
        let lost = end["lost"].as_u64().unwrap();
        assert_eq!(first + lost + messages.len() as u64, u64::from(sent) + 2);
        assert!(end["damaged"].as_u64().unwrap() > 0);
    }
}

#[test]
fn a_replayed_record_is_what_a_device_would_send() {
    let folder = TempDir::new().unwrap();
    let at = |arguments: &[&str]| succeed(folder.path(), arguments);
    at(&[
        "simulate",
        "--out",
        "rig",
        "--duration",
        "2",
        "--seed",
        "3",
        "--quiet",
    ]);
    let select = ["--model", "polynomial", "--fit", "select"];
    let identify = ["identify", "rig/study.toml", "-o", "model.json", "--quiet"];
    at(&[&identify[..], &select].concat());
    at(&["export", "model.json", "-o", "model.bin", "--quiet"]);
    let replay = ["replay", "model.bin", "rig/study.toml"];
    let both = ["-o", "out.csv", "--frames", "out.bin"];
    let sentence = fail(
        folder.path(),
        &[&replay[..], &["--frames", "out.bin"]].concat(),
        2,
    );
    assert!(sentence.contains("--frames") && sentence.contains("--record"));
    assert!(!folder.path().join("out.bin").exists());
    at(&[&replay[..], &["--record", "valid.csv"], &both].concat());

    let json = json_lines(&at(&["monitor", "out.bin", "--json", "-"]));
    assert_eq!(json[0]["message"], "hello");
    let checksum = fs::read(folder.path().join("model.bin")).unwrap();
    let checksum = u32::from_le_bytes(*checksum.last_chunk().unwrap());
    assert_eq!(json[0]["model"]["crc"], checksum);
    assert_eq!(json[0]["model"]["axes"][1]["name"], "phi");
    let end = json.last().unwrap();
    assert_eq!((&end["lost"], &end["damaged"]), (&0.into(), &0.into()));

    // Each sample's forces are those of the table that replay writes for the row that they belong
    // to.
    let delay = json[0]["rig"]["delay"].as_u64().unwrap();
    let csv = fs::read_to_string(folder.path().join("out.csv")).unwrap();
    let mut rows = csv.lines().skip(1);
    let samples = json.iter().filter(|line| line["message"] == "sample");
    let mut seen = 0;
    for (number, sample) in samples.enumerate() {
        assert_eq!(sample["sample"], number);
        if sample["output"].is_null() {
            assert!((number as u64) < 2 * delay);
            continue;
        }
        let cells: Vec<&str> = rows.next().unwrap().split(',').collect();
        assert_eq!(cells[0], (number as u64 - delay).to_string());
        for (column, name) in [(2, "measured"), (4, "predicted"), (6, "residual")] {
            let forces = &sample["output"][name];
            assert_eq!(cells[column], forces[0].to_string(), "{name} at {number}");
            assert_eq!(
                cells[column + 6],
                forces[1].to_string(),
                "{name} at {number}"
            );
        }
        seen += 1;
    }
    assert!(seen > 1000 && rows.next().is_none());
    let rate = json[0]["rig"]["sample_rate_hz"].as_f64().unwrap();
    let statuses = json.iter().filter(|line| line["message"] == "status");
    for (number, status) in statuses.enumerate() {
        assert_eq!(status["sample"], 1 + number as u64 * (rate / 10.0) as u64);
    }
}

#[test]
fn wrong_use_and_bad_files_get_a_sentence() {
    let folder = TempDir::new().unwrap();
    let at = folder.path();
    fs::write(at.join("empty.bin"), []).unwrap();
    fs::write(at.join("text.csv"), "t_s,x_m\n0,1\n".repeat(200)).unwrap();
    let sentence = fail(at, &["monitor", "missing.bin"], 3);
    assert!(sentence.contains("missing.bin") && sentence.contains("--port"));
    assert!(fail(at, &["monitor", "."], 3).contains("folder"));
    for file in ["empty.bin", "text.csv", "-"] {
        let sentence = fail(at, &["monitor", file, "--quiet"], 3);
        assert!(sentence.contains("no undamaged message"), "{sentence}");
    }
    for wrong in [
        &["monitor"][..],
        &["monitor", "empty.bin", "--port", "/dev/ttyACM0"],
        &["monitor", "empty.bin", "--stream", "1"],
        &["monitor", "empty.bin", "--baud", "9600"],
        &["monitor", "empty.bin", "--seconds", "-1"],
        &["monitor", "--port", "x", "--stream", "0"],
    ] {
        fail(at, wrong, 2);
    }
    assert!(fail(at, &["monitor", "/dev/ttyACM0"], 2).contains("--port"));
    let sentence = fail(at, &["monitor", "--port", "no-such-port"], 1);
    assert!(sentence.contains("no-such-port") && sentence.contains("port"));
    let nowhere = ["monitor", "text.csv", "--json", "missing/log.jsonl"];
    assert!(fail(at, &nowhere, 1).contains("missing/log.jsonl"));
}

/// What needs signals and pseudo-terminals.
#[cfg(target_os = "linux")]
mod live {
    use super::*;
    use jointwatch_shared::wire::telemetry::{Decoder, Received, Request};
    use serialport::{SerialPort, TTYPort};
    use std::io::{BufRead, BufReader, Read, Write};
    use std::process::Child;
    use std::thread::sleep;
    use std::time::Duration;

    fn spawn(arguments: &[&str]) -> Child {
        Command::new(JOINTWATCH)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts")
    }

    fn interrupt(child: &Child) {
        let id = child.id().to_string();
        let sent = Command::new("kill").args(["-INT", &id]).status();
        assert!(sent.expect("kill runs").success());
    }

    /// Reads lines until one holds this text.
    fn wait_for(lines: &mut impl BufRead, text: &str) {
        let mut line = String::new();
        while !line.contains(text) {
            line.clear();
            assert_ne!(lines.read_line(&mut line).unwrap(), 0, "no line has {text}");
        }
    }

    #[test]
    fn ctrl_c_ends_a_stream_that_goes_on_and_says_what_was_heard() {
        let mut child = spawn(&["monitor", "-"]);
        let mut input = child.stdin.take().unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap());
        input.write_all(&session(3)).unwrap();
        wait_for(&mut lines, "3 samples late");
        interrupt(&child);
        wait_for(&mut lines, "4 messages");
        assert_eq!(child.wait().unwrap().code(), Some(0));
        drop(input);
    }

    #[test]
    fn it_ends_by_itself_after_the_time_that_was_asked_for() {
        let mut child = spawn(&["monitor", "-", "--seconds", "0.2"]);
        let mut input = child.stdin.take().unwrap();
        input.write_all(&session(1)).unwrap();
        let mut said = String::new();
        child
            .stdout
            .take()
            .unwrap()
            .read_to_string(&mut said)
            .unwrap();
        child.wait().unwrap();
        assert!(said.contains(" messages in "), "{said}");
        drop(input);
    }

    /// The requests that arrive at the device's end until there are so many.
    fn requests(port: &mut TTYPort, count: usize) -> Vec<Received<Request>> {
        let mut decoder = Decoder::<Request>::default();
        let mut found = Vec::new();
        let mut bytes = [0; 64];
        while found.len() < count {
            match port.read(&mut bytes) {
                Ok(length) => {
                    let new = bytes[..length].iter().filter_map(|&b| decoder.push(b));
                    found.extend(new.map(|request| request.expect("undamaged")));
                }
                Err(e) if e.kind() == std::io::ErrorKind::TimedOut => {
                    sleep(Duration::from_millis(5));
                }
                Err(e) => panic!("{e}"),
            }
        }
        found
    }

    #[test]
    fn a_device_on_a_serial_port_is_asked_and_heard() {
        let (mut device, mut host) = TTYPort::pair().expect("a pseudo-terminal");
        device.set_timeout(Duration::from_millis(100)).unwrap();
        let name = host.name().expect("it has a name");
        // Held open, as a cable stays plugged in when no program uses it; but not locked, so that
        // one can.
        host.set_exclusive(false).unwrap();
        let cable = fs::File::options().read(true).write(true).open(&name);
        drop(host);
        let mut child = spawn(&["monitor", "--port", &name, "--stream", "10"]);
        let mut lines = BufReader::new(child.stdout.take().unwrap());
        let asked = requests(&mut device, 2);
        assert_eq!(asked[0].message, Request::Hello);
        assert_eq!(asked[1].message, Request::Stream { every: 10 });
        assert_eq!((asked[0].sequence, asked[1].sequence), (0, 1));
        device.write_all(&session(2)).unwrap();
        wait_for(&mut lines, "2 samples late");
        interrupt(&child);
        let last = requests(&mut device, 1);
        assert_eq!(last[0].message, Request::Stream { every: 0 });
        wait_for(&mut lines, "3 messages");
        assert_eq!(child.wait().unwrap().code(), Some(0));
        drop(cable.unwrap());
    }
}

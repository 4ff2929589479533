//! The lab's server: its numbers are the command line's, what runs can be ended, and nobody without the token changes anything.

use jointwatch_tests::lab::Lab;
use jointwatch_tests::program::{fail, succeed};
use jointwatch_tests::story::story;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A one-axis rig with dry friction that its study does not list, and its base model.
fn rig() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let run = |words: &str| succeed(folder.path(), &words.split(' ').collect::<Vec<_>>());
    run("simulate --out rig --axes 1 --hidden coulomb@x --share 0.15 --duration 4 --seed 5");
    run("identify rig --model physical -o rig/base.json");
    let rig = folder.path().join("rig");
    (folder, rig)
}

fn read_json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// All files of a folder with what is in them.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => found.extend(files(&path)),
            false => drop(found.insert(path.clone(), fs::read(&path).unwrap())),
        }
    }
    found
}

#[test]
fn the_loop_gives_the_numbers_of_the_command_line() {
    let (_folder, rig) = rig();
    let cli = |words: &str| succeed(&rig, &words.split(' ').collect::<Vec<_>>());
    let lab = Lab::start(&rig, &["study.toml", "base.json"]);
    let state = lab.rest();
    assert_eq!(state["current"], "base.json");

    // Compare: every record's figures.
    cli("compare study.toml base.json --json compared.json");
    let compared = read_json(&rig.join("compared.json"));
    let drawn = lab.view(&state);
    for (record, shown) in compared["records"]
        .as_array()
        .unwrap()
        .iter()
        .zip(drawn["records"].as_array().unwrap())
    {
        for figure in ["nmse_percent", "relative_error", "peak_error"] {
            assert_eq!(
                record["axes"]["x"][figure], shown["axes"][0]["versions"][0][figure],
                "{figure}"
            );
        }
    }

    // Diagnose, told to a page that waits.
    let seen = state["revision"].as_u64().unwrap();
    let waiting = std::thread::scope(|scope| {
        let other = scope.spawn(|| lab.state(seen));
        std::thread::sleep(Duration::from_millis(200));
        assert_eq!(lab.act(&json!({ "do": "diagnose" })).0, 200);
        other.join().unwrap()
    });
    assert_eq!(
        waiting["job"]["command"],
        "jointwatch diagnose study.toml base.json"
    );
    let (code, sentence) = lab.act(&json!({ "do": "export" }));
    assert!(
        code == 409 && sentence.contains("still runs"),
        "{code} {sentence}"
    );
    let state = lab.rest();
    cli("diagnose study.toml base.json --json diagnosed.json");
    let diagnosed = read_json(&rig.join("diagnosed.json"));
    for key in ["verdict", "found", "relative_error_after", "noise_floor"] {
        assert_eq!(state["diagnosis"][key], diagnosed[key], "{key}");
    }
    assert_eq!(lab.view(&state)["candidates"][0]["name"], "coulomb@x");

    // Add, undo, add again.
    let state = lab.done(&json!({ "do": "add", "effects": ["coulomb@x"] }));
    let added = "jointwatch-lab/base-coulomb-x.json";
    assert_eq!(state["current"], added);
    cli("add study.toml base.json coulomb@x -o added.json --quiet");
    assert_eq!(
        read_json(&rig.join(added)),
        read_json(&rig.join("added.json"))
    );
    let steps = lab.view(&state)["axes"][0]["steps"].clone();
    assert!(
        steps[1]["error"].as_f64().unwrap() < 0.1 * steps[0]["error"].as_f64().unwrap(),
        "{steps}"
    );
    let last = |state: &Value| state["done"].as_array().unwrap().last().unwrap().clone();
    assert_eq!(
        last(&state)["command"],
        format!("jointwatch add study.toml base.json coulomb@x -o {added}")
    );
    let state = lab.done(&json!({ "do": "undo" }));
    assert_eq!(state["current"], "base.json");
    assert!(
        !state["diagnosis"].is_null(),
        "what was said of it is still known"
    );
    let beside = json!({ "do": "show", "model": added, "beside": "base.json" });
    let state = lab.done(&beside);
    assert_eq!(lab.view(&state)["versions"], json!(["before", "after"]));

    // What is kept: blob, model, report.
    let state = lab.done(&json!({ "do": "export" }));
    assert!(last(&state)["done"].as_bool().unwrap(), "{}", last(&state));
    cli("export added.json -o wanted.bin");
    let kept = |what: &str| lab.request("GET", &format!("/api/download/{what}"), &[], b"");
    assert_eq!(
        kept("blob"),
        (200, fs::read(rig.join("wanted.bin")).unwrap())
    );
    assert_eq!(kept("model"), (200, fs::read(rig.join(added)).unwrap()));
    let (code, page) = kept("report");
    assert!(
        code == 200 && page.starts_with(b"<!doctype html>"),
        "{code}"
    );
    let state = lab.done(&json!({ "do": "replay", "record": "valid.csv" }));
    let said = last(&state)["said"].as_str().unwrap().to_string();
    assert_eq!(
        said,
        cli("replay wanted.bin study.toml --record valid.csv").trim()
    );
    let state = lab.done(&json!({ "do": "add", "effects": ["cubic_hardening@x"] }));
    assert_eq!(
        last(&state)["useless"],
        json!(["cubic_hardening@x"]),
        "{}",
        last(&state)
    );
    assert_eq!(state["current"], added);
    assert!(
        !rig.join("jointwatch-lab/.contents.json").exists(),
        "nothing is left lying about"
    );
}

#[test]
fn what_runs_can_be_ended_and_leaves_nothing() {
    let (_folder, rig) = rig();
    let lab = Lab::start(&rig, &["."]);
    let state = lab.rest();
    let before = files(&rig);
    assert_eq!(
        lab.act(&json!({ "do": "identify", "kind": "network" })).0,
        200
    );
    std::thread::sleep(Duration::from_millis(300));
    let begun = Instant::now();
    assert_eq!(lab.act(&json!({ "do": "cancel" })).0, 200);
    let after = lab.rest();
    assert!(
        begun.elapsed() < Duration::from_secs(3),
        "{:?}",
        begun.elapsed()
    );
    let last = after["done"].as_array().unwrap().last().unwrap().clone();
    assert_eq!(
        (&last["said"], &last["done"]),
        (&json!("Cancelled"), &json!(false))
    );
    assert_eq!(after["models"], state["models"]);
    assert_eq!(files(&rig), before);
}

#[test]
fn a_study_that_cannot_be_read_is_told_in_its_own_sentence_and_read_again() {
    let (_folder, rig) = rig();
    let log = rig.join("valid.csv");
    let whole = fs::read_to_string(&log).unwrap();
    let broken = whole.replacen("\n0.1,", "\nnan,", 1);
    fs::write(
        &log,
        if broken == whole {
            whole.replacen(",", ",x", 9)
        } else {
            broken
        },
    )
    .unwrap();
    let sentence = fail(&rig, &["compare", "study.toml", "base.json"], 3);
    let lab = Lab::start(&rig, &["study.toml"]);
    let state = lab.rest();
    assert_eq!(state["opened"], "wrong");
    let told = state["sentence"].as_str().unwrap();
    // The command was given the path as study.toml, the lab has it whole.
    let end = sentence.trim().split_once("valid.csv").unwrap().1;
    assert!(
        told.ends_with(end.trim_end_matches('.')),
        "{told}\n{sentence}"
    );
    fs::write(&log, whole).unwrap();
    let state = lab.done(&json!({ "do": "reopen" }));
    assert_eq!(
        (&state["opened"], &state["current"]),
        (&json!("study"), &json!("base.json"))
    );
}

#[test]
fn a_dropped_log_becomes_the_study_that_init_writes() {
    let (_folder, rig) = rig();
    let [cli, here] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let folders = [cli.path().join("bench"), here.path().join("bench")];
    folders.iter().for_each(|f| fs::create_dir(f).unwrap());
    let log = fs::read(rig.join("train_x.csv")).unwrap();
    fs::write(folders[0].join("run.csv"), &log).unwrap();
    succeed(&folders[0], &["init", "--yes", "--inertia=1.5", "run.csv"]);

    let lab = Lab::start(&folders[1], &[]);
    assert_eq!(lab.rest()["opened"], "missing");
    let put =
        |name: &str, bytes: &[u8]| lab.request("PUT", &format!("/api/log/{name}"), &[], bytes);
    for name in [
        "..%2Frun.csv",
        "%2Fetc%2Frun.csv",
        "study.toml",
        ".run.csv",
        "a%00.csv",
    ] {
        let (code, body) = put(name, &log);
        assert!(
            code >= 400,
            "{name}: {code} {}",
            String::from_utf8_lossy(&body)
        );
    }
    assert_eq!(put("empty.csv", b"").0, 422);
    let (code, body) = put("photo.csv", &[0xff, 0xd8, 0xff, 0xe0, 0, 1, 2, 3]);
    assert!(code == 422, "{code} {}", String::from_utf8_lossy(&body));
    assert!(
        files(here.path()).is_empty(),
        "what cannot be read is not kept"
    );
    assert_eq!(put("run.csv", &log).0, 200);
    assert_eq!(put("run.csv", b"other").0, 409, "a log is not written over");
    let state = lab.rest();
    assert_eq!(state["drafted"], true);
    let (code, draft) = lab.request("GET", "/api/draft", &[], b"");
    let draft: Value = serde_json::from_slice(&draft).unwrap();
    assert_eq!((code, &draft["logs"][0]["file"]), (200, &json!("run.csv")));
    lab.done(&json!({ "do": "draft", "inertia": 1.5 }));
    let state = lab.done(&json!({ "do": "init", "inertia": 1.5 }));
    assert_eq!(state["opened"], "study", "{state}");
    let text = |folder: &Path| fs::read_to_string(folder.join("study.toml")).unwrap();
    assert_eq!(text(&folders[0]), text(&folders[1]));
    assert_eq!(put("more.csv", &log).0, 409, "a study has its records");
}

/// What is sent by somebody who has no business here: a name and a request.
fn hostile(lab: &Lab) -> Vec<(&'static str, Vec<u8>)> {
    let port = lab.port;
    let body = r#"{"do":"identify","kind":"polynomial"}"#;
    let act = |headers: &str, body: &str| {
        let length = body.len();
        format!("POST /api/do HTTP/1.1\r\n{headers}Content-Type: application/json\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{body}")
            .into_bytes()
    };
    let host = format!("Host: 127.0.0.1:{port}\r\n");
    let token = format!("X-Jointwatch-Token: {}\r\n", lab.token);
    let get = |path: &str| {
        format!("GET {path} HTTP/1.1\r\n{host}{token}Connection: close\r\n\r\n").into_bytes()
    };
    let form = act(&format!("{host}{token}"), "do=identify&kind=polynomial");
    let form = String::from_utf8(form)
        .unwrap()
        .replace("application/json", "text/plain")
        .into_bytes();
    let put = |name: &str| {
        format!("PUT /api/log/{name} HTTP/1.1\r\n{host}{token}Content-Length: 3\r\nConnection: close\r\n\r\n1,2").into_bytes()
    };
    vec![
        ("no token", act(&host, body)),
        (
            "a wrong token",
            act(
                &format!("{host}X-Jointwatch-Token: {}x\r\n", lab.token),
                body,
            ),
        ),
        (
            "the token in the address",
            format!(
                "GET /api/state/0?token={} HTTP/1.1\r\n{host}Connection: close\r\n\r\n",
                lab.token
            )
            .into_bytes(),
        ),
        (
            "another host",
            act(&format!("Host: evil.example\r\n{token}"), body),
        ),
        ("no host", act(&token, body)),
        (
            "another origin",
            act(
                &format!("{host}{token}Origin: http://evil.example\r\n"),
                body,
            ),
        ),
        (
            "another site",
            act(
                &format!("{host}{token}Sec-Fetch-Site: cross-site\r\n"),
                body,
            ),
        ),
        ("a form", form),
        ("no JSON", act(&format!("{host}{token}"), "{\"do\":")),
        (
            "an unknown action",
            act(
                &format!("{host}{token}"),
                r#"{"do":"shell","command":"rm"}"#,
            ),
        ),
        (
            "an unknown key",
            act(
                &format!("{host}{token}"),
                r#"{"do":"export","output":"/tmp/x"}"#,
            ),
        ),
        (
            "a model elsewhere",
            act(
                &format!("{host}{token}"),
                r#"{"do":"show","model":"../../etc/passwd"}"#,
            ),
        ),
        (
            "an option as an effect",
            act(
                &format!("{host}{token}"),
                r#"{"do":"add","effects":["--force","-o/tmp/x"]}"#,
            ),
        ),
        (
            "a record elsewhere",
            act(
                &format!("{host}{token}"),
                r#"{"do":"replay","record":"../valid.csv"}"#,
            ),
        ),
        (
            "a large action",
            act(
                &format!("{host}{token}"),
                &format!("{{\"do\":\"{}\"}}", "x".repeat(100_000)),
            ),
        ),
        (
            "a long head",
            act(
                &format!("{host}{token}X: {}\r\n", "x".repeat(100_000)),
                body,
            ),
        ),
        (
            "many headers",
            act(&format!("{host}{token}{}", "X: y\r\n".repeat(200)), body),
        ),
        (
            "a study elsewhere",
            act(
                &format!("{host}{token}"),
                r#"{"do":"work","study":"../study.toml"}"#,
            ),
        ),
        ("an overview of nothing", get("/api/overview/0/0/100")),
        ("a path upwards", get("/lab/..%2F..%2Fstudy.toml")),
        ("another path upwards", get("/lab/../../study.toml")),
        ("a download upwards", get("/api/download/..%2Fstudy.toml")),
        ("a log over the study", put("study.toml")),
        ("a log upwards", put("..%2Fx.csv")),
        ("a log beside a study", put("x.csv")),
        ("another method", get("/api/do")),
        (
            "noise",
            vec![0x16, 3, 1, 2, 0, 1, 0, 1, 252, 3, 3, 13, 10, 13, 10],
        ),
        (
            "two lengths",
            act(&format!("{host}{token}Content-Length: 5\r\n"), body),
        ),
    ]
}

#[test]
fn ten_thousand_hostile_requests_change_nothing() {
    let (_folder, rig) = rig();
    let lab = Lab::start(&rig, &["."]);
    let before = lab.rest();
    let untouched = files(&rig);
    let requests = hostile(&lab);
    for (name, request) in &requests {
        let (code, body) = lab.send(request);
        assert!(
            code == 0 || code >= 400,
            "{name}: {code} {}",
            String::from_utf8_lossy(&body)
        );
    }
    // Half a head, and a body that stops, on every connection that the lab gives out and more.
    let stalled: Vec<TcpStream> = (0..80)
        .map(|i| {
            let mut stream = TcpStream::connect(("127.0.0.1", lab.port)).unwrap();
            let text = match i % 2 {
                0 => "POST /api/do HTTP/1.1\r\nHost: 127".to_string(),
                _ => format!(
                    "POST /api/do HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nX-Jointwatch-Token: {}\r\nContent-Type: application/json\r\n\
                     Content-Length: 100\r\n\r\n{{",
                    lab.port, lab.token
                ),
            };
            stream.write_all(text.as_bytes()).unwrap();
            stream
        })
        .collect();
    let begun = Instant::now();
    assert_eq!(
        lab.state(0)["revision"],
        before["revision"],
        "the page is still answered"
    );
    println!(
        "answered after {:?} beside 80 stalled connections",
        begun.elapsed()
    );
    drop(stalled);
    let begun = Instant::now();
    for round in 0..10_000 {
        // A request without a token, so that an answer that waits is not among them.
        let (_, request) = &requests[round % 2];
        let (code, _) = lab.send(request);
        assert_eq!(code, 401);
    }
    println!("10,000 requests refused in {:?}", begun.elapsed());
    for (_, request) in requests.iter().cycle().take(2_000) {
        lab.send(request);
    }
    let after = lab.state(0);
    for key in ["revision", "models", "done", "job", "current"] {
        assert_eq!(after[key], before[key], "{key}");
    }
    assert_eq!(files(&rig), untouched);
}

#[test]
fn what_goes_out_forbids_the_browser_everything_else() {
    let (_folder, rig) = rig();
    let lab = Lab::start(&rig, &["."]);
    let mut stream = TcpStream::connect(("127.0.0.1", lab.port)).unwrap();
    write!(
        stream,
        "GET / HTTP/1.1\r\nHost: localhost:{}\r\nConnection: close\r\n\r\n",
        lab.port
    )
    .unwrap();
    let mut text = String::new();
    std::io::Read::read_to_string(&mut stream, &mut text).unwrap();
    let head = text.split("\r\n\r\n").next().unwrap().to_lowercase();
    for wanted in [
        "content-security-policy: default-src 'none'; script-src 'self'",
        "x-content-type-options: nosniff",
        "cross-origin-resource-policy: same-origin",
        "cache-control: no-store",
        "referrer-policy: no-referrer",
    ] {
        assert!(head.contains(wanted), "{wanted} is not in {head}");
    }
    assert!(!head.contains("access-control"), "{head}");
    assert!(
        !text.contains(&lab.token),
        "the page without the token does not hold it"
    );
}

#[test]
fn wrong_uses_are_one_sentence() {
    let (folder, rig) = rig();
    let sentence = fail(folder.path(), &["lab", "nowhere"], 1);
    assert!(sentence.contains("nowhere is not there"), "{sentence}");
    let sentence = fail(&rig, &["lab", "train_x.csv"], 2);
    assert!(sentence.contains("study.toml already"), "{sentence}");
    let sentence = fail(&rig, &["lab", "study.toml", "none.json"], 1);
    assert!(sentence.contains("none.json"), "{sentence}");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let sentence = fail(&rig, &["lab", "study.toml", "--port", &port], 1);
    assert!(sentence.contains("--port"), "{sentence}");
}

/// The server-sent events of the live view, each as JSON.
fn live_events(lab: &Lab) -> impl Iterator<Item = Value> {
    let mut stream = TcpStream::connect(("127.0.0.1", lab.port)).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_secs(40)))
        .unwrap();
    let head = format!(
        "GET /api/live HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nX-Jointwatch-Token: {}\r\n\r\n",
        lab.port, lab.token
    );
    stream.write_all(head.as_bytes()).unwrap();
    let mut lines = BufReader::new(stream).lines().map_while(Result::ok);
    assert!(lines.next().unwrap().contains("200"));
    let kind = lines.find(|line| line.starts_with("content-type"));
    assert_eq!(kind.as_deref(), Some("content-type: text/event-stream"));
    lines.filter_map(|line| Some(serde_json::from_str(line.strip_prefix("data: ")?).unwrap()))
}

#[test]
fn the_live_view_tells_what_the_device_says_to_whoever_has_the_token() {
    let empty = tempfile::tempdir().unwrap();
    let lab = Lab::start(empty.path(), &[]);
    let json = ("Content-Type", "application/json");
    for method in ["GET", "POST", "DELETE"] {
        let with = |headers: &[(&str, &str)]| lab.request(method, "/api/live", headers, b"{}").0;
        assert_eq!(with(&[json, ("X-Jointwatch-Token", "wrong")]), 401);
        assert_eq!(with(&[json, ("Origin", "http://evil.example")]), 403);
        assert_eq!(with(&[json, ("Host", "evil.example")]), 421);
    }
    let look = |body: &str| {
        let (code, said) = lab.request("POST", "/api/live", &[], body.as_bytes());
        let said: Value = serde_json::from_slice(&said).unwrap_or_default();
        (
            code,
            said["sentence"].as_str().unwrap_or_default().to_string(),
        )
    };
    for wrong in ["", "{}", "[]", "{\"file\":\"/etc/passwd\"}", "{\"tcp\":7}"] {
        assert_eq!(look(wrong).0, 400, "{wrong}");
    }
    for (nobody, code) in [
        ("{\"tcp\":\"here\"}", 409),
        ("{\"port\":\"/no/port\"}", 500),
    ] {
        let (got, sentence) = look(nobody);
        assert!(got == code && !sentence.is_empty(), "{got} {sentence}");
    }

    // A device behind a TCP port that says what `replay` would have it say.
    let frames = empty.path().join("frames.bin");
    let [blob, study] = ["model.bin", "rig/study.toml"].map(|file| story().join(file));
    let arguments = [
        blob.to_str().unwrap(),
        study.to_str().unwrap(),
        "--record",
        "valid.csv",
    ];
    let arguments = [&["replay"], &arguments[..], &["--frames", "frames.bin"]].concat();
    succeed(empty.path(), &arguments);
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = server.local_addr().unwrap();
    let device = std::thread::spawn(move || {
        let (mut line, _) = server.accept().unwrap();
        line.write_all(&fs::read(frames).unwrap()).unwrap();
        line
    });
    let mut events = live_events(&lab);
    assert_eq!(events.next().unwrap()["picture"], Value::Null);
    assert_eq!(
        look(&json!({ "tcp": address.to_string() }).to_string()).0,
        200
    );
    let line = device.join().unwrap();
    let (mut columns, mut points, mut last) = ([0, 0], [0, 0], Value::Null);
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(30) && last["time_s"].as_f64().unwrap_or(0.0) < 5.99
    {
        let news = events.next().unwrap();
        for (axis, fresh) in news["axes"].as_array().unwrap().iter().enumerate() {
            columns[axis] += fresh["columns"].as_array().unwrap().len();
            points[axis] += fresh["points"].as_array().unwrap().len();
        }
        last = news["picture"].clone();
    }
    assert!(
        columns.iter().chain(&points).all(|count| *count > 500),
        "{columns:?} {points:?}"
    );
    assert_eq!(last["axes"][1]["name"], "phi");
    assert_eq!(last["axes"][1]["unit"], "N·m");
    let count = |what: &str| {
        let counters = last["counters"].as_array().unwrap();
        counters.iter().find(|c| c["what"] == what).unwrap()["count"].clone()
    };
    assert_eq!(
        (count("lost on the way"), count("damaged frames")),
        (json!(0), json!(0))
    );

    drop(line);
    let lost = |news: &Value| {
        news["picture"]["line"]
            .as_str()
            .is_some_and(|l| l.contains("lost"))
    };
    assert!(events.any(|news| lost(&news)), "a lost device is told");
    let (code, _) = lab.request("DELETE", "/api/live", &[], b"");
    assert_eq!(code, 200);
    assert!(events.any(|news| news["picture"].is_null()));
}

//! The live view: what a device says reaches whoever has the token.

use jointwatch_tests::lab::Lab;
use jointwatch_tests::program::succeed;
use jointwatch_tests::story::story;
use serde_json::{Value, json};
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

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

//! Requests of somebody who has no business here change nothing, and what goes out forbids the
//! browser everything else.

use super::{files, rig};
use jointwatch_tests::lab::Lab;
use std::io::Write;
use std::net::TcpStream;
use std::time::Instant;

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

//! The lab as a process, and requests to it byte by byte, so that a test can send what no browser
//! would.

use crate::program::jointwatch;
use crate::running::Ended;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A lab that runs until it is dropped.
pub struct Lab {
    process: Ended,
    /// The address that it printed, with the token behind the #.
    pub url: String,
    /// Its port on 127.0.0.1.
    pub port: u16,
    /// The token behind the # of `url`.
    pub token: String,
}

impl Lab {
    /// The number of its process.
    pub fn id(&self) -> u32 {
        self.process.0.id()
    }

    /// Starts the lab in a folder, with these words behind `jointwatch lab`.
    ///
    /// # Panics
    /// When it does not start.
    pub fn start(folder: &Path, words: &[&str]) -> Self {
        Self::start_with(folder, words, &[])
    }

    /// The same in an environment with these variables.
    ///
    /// # Panics
    /// When it does not start.
    pub fn start_with(folder: &Path, words: &[&str], variables: &[(&str, &str)]) -> Self {
        let mut process = Command::new(jointwatch())
            .envs(variables.iter().copied())
            .current_dir(folder)
            .arg("lab")
            .args(words)
            .args(["--json", "-"])
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let said = BufReader::new(process.stdout.take().expect("it has an output"));
        let lines = said.lines().map_while(Result::ok);
        let mut text = String::new();
        for line in lines {
            text.push_str(&line);
            if line == "}" {
                break;
            }
        }
        let told: Value = serde_json::from_str(&text).expect("the lab says where it listens");
        let url = told["url"].as_str().expect("an address").to_string();
        let (address, token) = url.split_once("/#").expect("a token");
        let port = address.rsplit(':').next().and_then(|p| p.parse().ok());
        Self {
            process: Ended(process),
            port: port.expect("a port"),
            token: token.into(),
            url,
        }
    }

    /// Sends bytes and gives what comes back until the lab closes, as code and body; code 0 when it
    /// only closed.
    ///
    /// # Panics
    /// When the lab takes no connection or keeps silent for half a minute.
    pub fn send(&self, bytes: &[u8]) -> (u16, Vec<u8>) {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).expect("the lab listens");
        stream
            .set_read_timeout(Some(Duration::from_secs(40)))
            .expect("a limit");
        // A lab that has read enough may close before everything is sent.
        let _ = stream.write_all(bytes);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let head = answer.windows(4).position(|w| w == b"\r\n\r\n");
        let text = String::from_utf8_lossy(&answer);
        let code = text
            .split(' ')
            .nth(1)
            .and_then(|c| c.parse().ok())
            .unwrap_or(0);
        (
            code,
            head.map_or(Vec::new(), |at| answer[at + 4..].to_vec()),
        )
    }

    /// A request as the page makes it, with other headers in place of the usual ones where
    /// `headers` names them.
    pub fn request(
        &self,
        method: &str,
        path: &str,
        headers: &[(&str, &str)],
        body: &[u8],
    ) -> (u16, Vec<u8>) {
        let host = format!("127.0.0.1:{}", self.port);
        let length = body.len().to_string();
        let usual = [
            ("Host", host.as_str()),
            ("X-Jointwatch-Token", &self.token),
            ("Content-Type", "application/json"),
            ("Content-Length", &length),
            ("Connection", "close"),
        ];
        let mut text = format!("{method} {path} HTTP/1.1\r\n");
        let replaced = |name: &str| headers.iter().any(|(h, _)| h.eq_ignore_ascii_case(name));
        let kept = usual.iter().filter(|(name, _)| !replaced(name));
        for (name, value) in kept.chain(headers) {
            text.push_str(&format!("{name}: {value}\r\n"));
        }
        text.push_str("\r\n");
        self.send(&[text.as_bytes(), body].concat())
    }

    /// The state; with `seen` as the one that is known, the next one.
    ///
    /// # Panics
    /// When the answer is none.
    pub fn state(&self, seen: u64) -> Value {
        let (code, body) = self.request("GET", &format!("/api/state/{seen}"), &[], b"");
        assert_eq!(code, 200);
        serde_json::from_slice(&body).expect("the state is JSON")
    }

    /// Asks for an action and gives the code and the sentence, if there is one.
    pub fn act(&self, action: &Value) -> (u16, String) {
        let body = action.to_string();
        let (code, body) = self.request("POST", "/api/do", &[], body.as_bytes());
        let told: Value = serde_json::from_slice(&body).unwrap_or_default();
        (code, told["sentence"].as_str().unwrap_or_default().into())
    }

    /// Waits until nothing runs and the study is read; gives the state.
    ///
    /// # Panics
    /// When that takes longer than two minutes.
    pub fn rest(&self) -> Value {
        let begun = Instant::now();
        let mut seen = 0;
        loop {
            let state = self.state(seen);
            let shown = state["models"] == json!([])
                || !state["view"].is_null()
                || state["opened"] != "study";
            if state["job"].is_null() && state["opened"] != "reading" && shown {
                return state;
            }
            seen = state["revision"].as_u64().expect("a number");
            assert!(begun.elapsed() < Duration::from_secs(120), "{state}");
        }
    }

    /// Does one thing and waits for its end.
    ///
    /// # Panics
    /// When it is refused.
    pub fn done(&self, action: &Value) -> Value {
        let (code, sentence) = self.act(action);
        assert_eq!(code, 200, "{action}: {sentence}");
        self.rest()
    }

    /// What is drawn, as JSON.
    ///
    /// # Panics
    /// When nothing is.
    pub fn view(&self, state: &Value) -> Value {
        let (code, body) = self.request(
            "GET",
            &format!("/api/view/{}", state["view"]["key"]),
            &[],
            b"",
        );
        assert_eq!(code, 200, "{}", state["view"]);
        serde_json::from_slice(&body).expect("what is drawn is JSON")
    }
}

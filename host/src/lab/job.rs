//! A command that runs as a process of its own: what it says while it runs, how it ended, and how
//! it is ended.

use super::locked;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};

/// What stands before a line of progress that a command writes for the lab.
pub(crate) const PROGRESS_MARK: &str = "progress: ";

/// Options that the lab gives a command besides what it shows: their beginnings.
pub(crate) const HIDDEN: [&str; 2] = ["--contents=", "--progress-lines"];

/// As much of what a command prints is kept.
const MAX_TEXT: u64 = 200_000;

/// A process that can be ended from elsewhere.
#[derive(Clone)]
pub(super) struct Running(Arc<Mutex<Child>>);

/// How a command ended.
pub(super) struct Ended {
    /// Whether it did what was asked.
    pub(super) done: bool,
    /// What it printed, or the sentence that says why not.
    pub(super) said: String,
}

/// The words of a command as they are typed.
pub(super) fn line(words: &[String]) -> String {
    let plain = |w: &str| {
        let safe = |c: char| c.is_alphanumeric() || "-_./@=,+:~%".contains(c);
        !w.is_empty() && w.chars().all(safe)
    };
    let word = |w: &String| match plain(w) {
        true => w.clone(),
        false => format!("'{}'", w.replace('\'', "'\\''")),
    };
    let words: Vec<String> = words.iter().map(word).collect();
    format!("jointwatch {}", words.join(" "))
}

impl Running {
    /// Starts a command in a folder; `contents` is a file for what the page draws, `json` one for
    /// the result.
    pub(super) fn start(
        program: &Path,
        folder: &Path,
        words: &[String],
        contents: Option<&Path>,
        json: Option<&Path>,
    ) -> std::io::Result<Self> {
        let mut command = Command::new(program);
        command.current_dir(folder).args(words);
        let file = |option: &str, path: &Path| format!("{option}{}", path.display());
        command.args(contents.map(|p| file(HIDDEN[0], p)));
        command.args(json.map(|p| file("--json=", p)));
        command.arg(HIDDEN[1]);
        let child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        Ok(Self(Arc::new(Mutex::new(child))))
    }

    /// Ends it at once.
    pub(super) fn end(&self) {
        // One that has ended by itself needs no ending.
        let _ = locked(&self.0).kill();
    }

    /// Follows it to its end; `tell` hears every line of progress.
    pub(super) fn follow(&self, tell: &dyn Fn(String)) -> Ended {
        let (out, err) = {
            let mut child = locked(&self.0);
            (child.stdout.take(), child.stderr.take())
        };
        let printed = std::thread::spawn(move || {
            let mut text = Vec::new();
            if let Some(mut out) = out {
                let _ = out.by_ref().take(MAX_TEXT).read_to_end(&mut text);
                let _ = std::io::copy(&mut out, &mut std::io::sink());
            }
            String::from_utf8_lossy(&text).into_owned()
        });
        let mut complaint = String::new();
        for line in err
            .into_iter()
            .flat_map(|e| BufReader::new(e).lines())
            .map_while(Result::ok)
        {
            match line.strip_prefix(PROGRESS_MARK) {
                Some(progress) => tell(progress.into()),
                None => {
                    complaint.push_str(&format!("{}\n", line.trim_start_matches("jointwatch: ")))
                }
            }
        }
        let printed = printed.join().unwrap_or_default();
        let done = loop {
            // The lock is not held while waiting: who ends the process needs it.
            let state = locked(&self.0).try_wait();
            match state {
                Ok(Some(status)) => break status.success(),
                Ok(None) => std::thread::sleep(std::time::Duration::from_millis(5)),
                Err(_) => break false,
            }
        };
        let said = match (done, complaint.trim()) {
            (true, _) => printed,
            (false, "") => "The command ended without saying why".into(),
            (false, complaint) => complaint.into(),
        };
        Ended {
            done,
            said: said.trim().into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::line;

    #[test]
    fn a_command_is_shown_as_a_shell_takes_it() {
        let words = ["add", "study.toml", "it's.json", "coulomb@x", "a b"].map(String::from);
        assert_eq!(
            line(&words),
            "jointwatch add study.toml 'it'\\''s.json' coulomb@x 'a b'"
        );
    }
}

//! A log that was dropped onto the page, written into the study's folder as it comes in.

use super::folder::{Folder, safe_log_name};
use crate::study::survey::Survey;
use crate::text::error::{Error, Result};
use crate::text::output;
use axum::body::Body;
use http_body_util::BodyExt;
use std::io::Write;
use std::path::PathBuf;
use std::time::Duration;

/// The largest log that is taken; a larger one is put into the folder by hand and named at the
/// start.
pub(super) const LARGEST_LOG: u64 = 1 << 30;
/// So long may a sender pause.
const PAUSE: Duration = Duration::from_secs(10);

/// Takes a log; the file is there whole and can be read, or is not there at all, and none is
/// written over.
///
/// # Errors
/// One sentence: a name that is no plain file name, a file that is there already, a body that is
/// too large, stops, or cannot be written.
pub(super) async fn take(folder: &Folder, name: &str, mut body: Body) -> Result<String> {
    let name = safe_log_name(name)?;
    let path = folder.path.join(&name);
    let failed = |e: std::io::Error| {
        Error::failed(format!("{}: could not be written ({e})", path.display()))
    };
    let mut file = tempfile::NamedTempFile::new_in(&folder.path).map_err(failed)?;
    let mut size = 0;
    loop {
        let frame = tokio::time::timeout(PAUSE, body.frame()).await;
        let Ok(frame) = frame else {
            return Err(Error::failed(format!(
                "{name}: the log stopped coming; drop it once more"
            )));
        };
        let Some(frame) = frame else { break };
        let frame = frame.map_err(|e| Error::failed(format!("{name}: the log broke off ({e})")))?;
        let Ok(data) = frame.into_data() else {
            continue;
        };
        size += data.len() as u64;
        if size > LARGEST_LOG {
            return Err(Error::failed(format!(
                "{name}: the log is larger than 1 GiB; put it into {} and start `jointwatch lab {name}` there",
                folder.path.display()
            )));
        }
        file.write_all(&data).map_err(failed)?;
    }
    if size == 0 {
        return Err(Error::data(format!(
            "{name} is empty; check that the logger finished writing it"
        )));
    }
    output::make_readable_as_usual(&file).map_err(failed)?;
    file.persist_noclobber(&path)
        .map_err(|e| match e.error.kind() {
            std::io::ErrorKind::AlreadyExists => Error::usage(format!(
                "{name} is in the folder already; rename the log, or remove the old one first"
            )),
            _ => failed(e.error),
        })?;
    look(path.clone()).await.inspect_err(|_| {
        // Nobody else knows of it: it was not there before.
        let _ = std::fs::remove_file(&path);
    })?;
    Ok(name)
}

/// Whether it can be read at all, which takes a while for a long one.
async fn look(path: PathBuf) -> Result<()> {
    let looked = tokio::task::spawn_blocking(move || Survey::of(&path).map(drop));
    looked
        .await
        .map_err(|e| Error::failed(format!("the log could not be looked at ({e})")))?
}

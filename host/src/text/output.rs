//! Files that are either whole or not there: everything the tool leaves behind is written through
//! here.

use crate::text::error::{Error, Result};
use std::io::Write;
use std::path::Path;

/// Whether a path stands for standard output.
pub fn is_standard(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Writes to standard output; a reader that has gone away (`| head`) is no error of ours, but ends
/// the run.
///
/// # Errors
/// [`crate::text::error::Kind::Failed`] when it cannot be written to.
pub fn print(contents: &[u8]) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(contents).and_then(|()| out.flush()) {
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => std::process::exit(0),
        Err(e) => Err(Error::failed(format!(
            "standard output could not be written to ({e})"
        ))),
        Ok(()) => Ok(()),
    }
}

/// Writes a file in one step: into a temporary file beside it, then renamed over it; for `-` to
/// standard output. What is there and no file, such as `/dev/null` or a pipe, is written into and
/// never replaced.
///
/// # Errors
/// [`crate::text::error::Kind::Failed`] with the path when the folder is missing or not writable;
/// the old file, if there was one, is then untouched.
pub fn write_whole(path: &Path, contents: &[u8]) -> Result<()> {
    check(path)?;
    if is_standard(path) {
        return print(contents);
    }
    let folder = folder_of(path);
    let failed = |e: std::io::Error| {
        Error::failed(format!(
            "{}: could not be written ({e}); check that the folder {} exists and may be written to",
            path.display(),
            folder.display()
        ))
    };
    if std::fs::metadata(path).is_ok_and(|there| !there.is_file()) {
        let open = std::fs::OpenOptions::new().write(true).open(path);
        return open
            .and_then(|mut there| there.write_all(contents))
            .map_err(failed);
    }
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(failed)?;
    file.write_all(contents).map_err(failed)?;
    file.as_file().sync_all().map_err(failed)?;
    make_readable_as_usual(&file).map_err(failed)?;
    file.persist(path).map_err(|e| failed(e.error))?;
    Ok(())
}

/// The folder that a file is in or is to be written to.
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Refuses a path that no file can be written to: whoever computes for a while asks beforehand.
///
/// # Errors
/// [`crate::text::error::Kind::Failed`] when its folder is missing or it is a folder itself.
pub fn check(path: &Path) -> Result<()> {
    if is_standard(path) {
        return Ok(());
    }
    let folder = folder_of(path);
    if !folder.is_dir() {
        return Err(Error::failed(format!(
            "{}: could not be written, for there is no folder {}; make it, or name another file",
            path.display(),
            folder.display()
        )));
    }
    if path.is_dir() {
        return Err(Error::failed(format!(
            "{}: could not be written, for this is a folder; name a file",
            path.display()
        )));
    }
    Ok(())
}

/// Refuses a folder that holds something already; the outer error is that of the system.
pub(crate) fn check_free(folder: &Path) -> std::io::Result<Result<()>> {
    let occupied = match std::fs::read_dir(folder) {
        Ok(mut entries) => entries.next().is_some(),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => false,
        Err(error) => return Err(error),
    };
    Ok(match occupied {
        false => Ok(()),
        true => Err(Error::failed(format!(
            "{} exists and is not empty: name another folder, or remove it first",
            folder.display()
        ))),
    })
}

/// Temporary files are private; what the user finds should carry the usual permissions.
pub(crate) fn make_readable_as_usual(file: &tempfile::NamedTempFile) -> std::io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        file.as_file()
            .set_permissions(std::fs::Permissions::from_mode(0o644))?;
    }
    #[cfg(not(unix))]
    let _ = file;
    Ok(())
}

/// A value as indented JSON with a line feed at its end.
///
/// # Errors
/// [`crate::text::error::Kind::Failed`] when the value cannot be expressed, which for the tool's
/// own types does not happen.
pub fn json_text<T: serde::Serialize>(value: &T) -> Result<String> {
    let mut text = serde_json::to_string_pretty(value)
        .map_err(|e| Error::failed(format!("the result could not be written as JSON ({e})")))?;
    text.push('\n');
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_temporary_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.json");
        write_whole(&path, b"old").unwrap();
        write_whole(&path, b"new").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);

        // A directory in the way cannot be replaced by a file.
        let blocked = folder.path().join("blocked");
        std::fs::create_dir(&blocked).unwrap();
        std::fs::write(blocked.join("inside"), b"x").unwrap();
        let error = write_whole(&blocked, b"new").unwrap_err();
        assert!(error.sentence.contains("blocked"), "{error}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);

        let error = write_whole(&folder.path().join("missing/model.json"), b"x").unwrap_err();
        assert_eq!(error.exit_code(), 1);
    }
    #[cfg(unix)]
    #[test]
    fn what_is_no_file_is_never_replaced() {
        use std::os::unix::fs::FileTypeExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&path).unwrap();
        let error = write_whole(&path, b"new").unwrap_err();
        assert!(error.sentence.contains("socket"), "{error}");
        assert!(std::fs::metadata(&path).unwrap().file_type().is_socket());
    }
}

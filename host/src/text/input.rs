//! Reading files that somebody else wrote: regular files only, and only up to a size.

use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;
use std::sync::OnceLock;

/// Bytes that one file may have, unless the environment says otherwise: what is read of so many
/// stays under 2 GB of memory.
const DEFAULT_LIMIT: u64 = 1 << 28;
/// The environment variable that raises it.
pub(crate) const VARIABLE: &str = "JOINTWATCH_MAX_FILE_BYTES";

/// Bytes that one file may have.
pub(crate) fn limit() -> u64 {
    let stated = std::env::var(VARIABLE).ok();
    stated
        .and_then(|value| value.parse().ok())
        .unwrap_or(DEFAULT_LIMIT)
}

/// What standard input held; it can be read once.
static STANDARD_INPUT: OnceLock<Vec<u8>> = OnceLock::new();

/// The bytes of a file, or of standard input for `-`. A pipe or a device, which may never end, is
/// refused before it is opened.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>> {
    if path.as_os_str() != "-" {
        return read_up_to(path, limit());
    }
    if let Some(known) = STANDARD_INPUT.get() {
        return Ok(known.clone());
    }
    let bytes = taken(std::io::stdin().lock(), limit())?;
    Ok(STANDARD_INPUT.get_or_init(|| bytes).clone())
}

/// The text of a file.
pub(crate) fn read_to_string(path: &Path) -> Result<String> {
    let not_text = |_| Error::new(ErrorKind::InvalidData, "it is not UTF-8 text");
    String::from_utf8(read(path)?).map_err(not_text)
}

fn read_up_to(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let about = std::fs::metadata(path)?;
    // What to say of a folder is the system's.
    if !about.is_file() && !about.is_dir() {
        return Err(Error::other("it is a pipe or a device and no file"));
    }
    taken(std::fs::File::open(path)?, limit)
}

/// All that is to be read, if it is no more than the limit.
fn taken(from: impl Read, limit: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    from.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        return Err(Error::other(format!(
            "it has more than {limit} bytes; if it is sound, set {VARIABLE} to a larger number"
        )));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_read_up_to_their_limit_and_devices_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        std::fs::write(&path, b"123456").unwrap();
        assert_eq!(read_up_to(&path, 6).unwrap(), b"123456");
        let said = read_up_to(&path, 5).unwrap_err().to_string();
        assert!(
            said.contains("more than 5 bytes") && said.contains(VARIABLE),
            "{said}"
        );
        assert!(read(folder.path()).is_err());
        assert_eq!(
            read(&folder.path().join("none")).unwrap_err().kind(),
            ErrorKind::NotFound
        );
        std::fs::write(&path, [0xC3, 0x28]).unwrap();
        assert!(
            read_to_string(&path)
                .unwrap_err()
                .to_string()
                .contains("UTF-8")
        );
        #[cfg(unix)]
        {
            let said = read(Path::new("/dev/zero")).unwrap_err().to_string();
            assert!(said.contains("pipe or a device"), "{said}");
        }
    }
}

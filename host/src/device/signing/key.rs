//! Ed25519 keys as files: the private one stays with the engineer, the public one is built into the
//! firmware.

use crate::text::error::{Error, Result};
use crate::text::hexadecimal::hexadecimal;
use ed25519_compact::{KeyPair, Seed};
use rand::TryRng;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

/// What a private key file begins with; 64 hexadecimal digits follow.
const PRIVATE: &str = "jointwatch private key ed25519 ";
/// The same of a public key file.
const PUBLIC: &str = "jointwatch public key ed25519 ";

/// The seed of the development key, which everybody knows: for trying things out and for tests,
/// never for a device that matters. Firmware that trusts it says so at every start.
pub const DEVELOPMENT_SEED: [u8; 32] = *b"Everybody knows jointwatch's key";

/// A key that signs.
pub struct PrivateKey(KeyPair);

impl PrivateKey {
    /// A new key from the operating system's random numbers.
    ///
    /// # Errors
    /// When the operating system has none.
    pub fn generate() -> Result<Self> {
        let mut seed = [0; 32];
        rand::rngs::SysRng
            .try_fill_bytes(&mut seed)
            .map_err(|why| {
                Error::failed(format!(
                    "the operating system gave no random numbers ({why})"
                ))
            })?;
        Ok(Self(KeyPair::from_seed(Seed::new(seed))))
    }

    /// The key that everybody knows, see [`DEVELOPMENT_SEED`].
    pub fn development() -> Self {
        Self(KeyPair::from_seed(Seed::new(DEVELOPMENT_SEED)))
    }

    /// The public half of the key.
    pub fn public(&self) -> [u8; 32] {
        *self.0.pk
    }

    /// The signature of `message`.
    pub fn sign(&self, message: &[u8]) -> [u8; 64] {
        *self.0.sk.sign(message, None)
    }

    /// Reads a private key file.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when it cannot be read or is something else.
    pub fn read(path: &Path) -> Result<Self> {
        let refused = |what: String| {
            Error::data(format!(
                "{}: {what}; give the private key file that `jointwatch keygen` wrote",
                path.display()
            ))
        };
        let text = crate::text::input::read_to_string(path)
            .map_err(|e| refused(format!("could not be read ({e})")))?;
        if text.starts_with(PUBLIC) {
            return Err(refused("is a public key, which cannot sign".into()));
        }
        let seed = text
            .strip_prefix(PRIVATE)
            .and_then(|digits| from_hex(digits.trim_end()))
            .ok_or_else(|| refused("is no private key".into()))?;
        Ok(Self(KeyPair::from_seed(Seed::new(seed))))
    }

    /// Writes the private key to `path`, readable by its owner alone, and the public key beside it,
    /// with `.pub` behind its name; gives the latter's path.
    ///
    /// # Errors
    /// When either is there already, or cannot be written; then neither is left behind.
    pub fn write_new(&self, path: &Path) -> Result<PathBuf> {
        let mut name = path.as_os_str().to_owned();
        name.push(".pub");
        let public = PathBuf::from(name);
        if public.exists() {
            return Err(in_the_way(&public));
        }
        let private_text = format!("{PRIVATE}{}\n", hexadecimal(&self.0.sk.seed()[..]));
        write_new(path, &private_text, 0o600)?;
        write_new(&public, &public_key_text(&self.public()), 0o644).inspect_err(|_| {
            // Half a pair is of no use; that it could not be taken away again changes nothing about
            // the error.
            let _ = std::fs::remove_file(path);
        })?;
        Ok(public)
    }
}

/// The contents of a public key file.
pub fn public_key_text(key: &[u8; 32]) -> String {
    format!("{PUBLIC}{}\n", hexadecimal(key))
}

fn in_the_way(path: &Path) -> Error {
    Error::failed(format!(
        "{}: is there already, and a key is never overwritten; choose another name",
        path.display()
    ))
}

fn write_new(path: &Path, text: &str, mode: u32) -> Result<()> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        options.mode(mode);
    }
    #[cfg(not(unix))]
    let _ = mode;
    let mut file = options.open(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::AlreadyExists => in_the_way(path),
        _ => Error::failed(format!("{}: could not be written ({e})", path.display())),
    })?;
    file.write_all(text.as_bytes())
        .and_then(|()| file.sync_all())
        .map_err(|e| {
            // A key that is not whole is not left behind; the error that is told is the one that
            // came first.
            let _ = std::fs::remove_file(path);
            Error::failed(format!("{}: could not be written ({e})", path.display()))
        })
}

fn from_hex(digits: &str) -> Option<[u8; 32]> {
    let mut bytes = [0; 32];
    let (pairs, rest) = digits.as_bytes().as_chunks::<2>();
    if pairs.len() != bytes.len() || !rest.is_empty() {
        return None;
    }
    for (byte, pair) in bytes.iter_mut().zip(pairs) {
        let digit = |at: usize| char::from(pair[at]).to_digit(16);
        *byte = (digit(0)? * 16 + digit(1)?) as u8;
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_comes_back_from_its_file_and_is_never_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("key");
        let key = PrivateKey::generate().unwrap();
        let public = key.write_new(&path).unwrap();
        assert_eq!(PrivateKey::read(&path).unwrap().public(), key.public());
        let text = std::fs::read_to_string(&public).unwrap();
        assert_eq!(text, public_key_text(&key.public()));
        let why = PrivateKey::read(&public).err().unwrap();
        assert!(why.sentence.contains("public key"), "{why}");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            let mode = std::fs::metadata(&path).unwrap().permissions().mode();
            assert_eq!(mode & 0o777, 0o600);
        }

        let other = PrivateKey::generate().unwrap();
        assert_ne!(other.public(), key.public());
        assert_eq!(other.write_new(&path).unwrap_err().exit_code(), 1);
        assert_eq!(PrivateKey::read(&path).unwrap().public(), key.public());
        // A public key in the way leaves no private one behind.
        std::fs::remove_file(&path).unwrap();
        assert!(other.write_new(&path).is_err() && !path.exists());
    }

    #[test]
    fn the_firmware_has_the_public_half_of_the_development_key() {
        let file = include_str!("../../../../firmware/keys/development.pub");
        assert_eq!(file, public_key_text(&PrivateKey::development().public()));
    }

    #[test]
    fn what_is_no_private_key_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("key");
        for text in ["", "key", PRIVATE, "jointwatch private key ed25519 00ff\n"] {
            std::fs::write(&path, text).unwrap();
            let why = PrivateKey::read(&path).err().unwrap();
            assert_eq!(why.exit_code(), 3, "{text}");
        }
        std::fs::write(&path, format!("{PRIVATE}{}\n", "é".repeat(32))).unwrap();
        assert!(PrivateKey::read(&path).is_err());
    }
}

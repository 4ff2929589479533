//! What a bridge is told at its start, as `key=value`.

use std::collections::HashMap;
use std::path::PathBuf;

/// Which device, which broker, and where the files are.
pub(crate) struct Settings {
    /// The device's name, which is its user name at the broker.
    pub(crate) name: String,
    /// Where the device's line is, host and port.
    pub(crate) device: String,
    /// The broker's host and port.
    pub(crate) broker: (String, u16),
    /// The certificate of the authority that signed the broker's, PEM.
    pub(crate) ca: PathBuf,
    /// The file that holds the device's password.
    pub(crate) password: PathBuf,
    /// The study whose training records set the filters and the normalisation of the sums; the
    /// same for the fleet.
    pub(crate) study: PathBuf,
    /// The rig block that the device runs with at first.
    pub(crate) rig: PathBuf,
    /// Where records and parts are kept.
    pub(crate) folder: PathBuf,
    /// The program `jointwatch`, whose commands the bridge runs.
    pub(crate) program: PathBuf,
}

impl Settings {
    pub(crate) fn read(words: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut given = HashMap::new();
        for word in words {
            let (key, value) = word
                .split_once('=')
                .ok_or(format!("{word:?} is not key=value"))?;
            given.insert(key.to_owned(), value.to_owned());
        }
        let mut take = |key: &str| given.remove(key).ok_or(format!("{key}= is missing"));
        let broker = take("broker")?;
        let parts = broker
            .rsplit_once(':')
            .and_then(|(host, port)| Some((host.to_owned(), port.parse().ok()?)));
        let settings = Self {
            name: take("name")?,
            device: take("device")?,
            broker: parts.ok_or(format!("broker={broker} is not HOST:PORT"))?,
            ca: take("ca")?.into(),
            password: take("password")?.into(),
            study: take("study")?.into(),
            rig: take("rig")?.into(),
            folder: take("folder")?.into(),
            program: take("program")?.into(),
        };
        match given.keys().next() {
            Some(key) => Err(format!("{key}= is not known")),
            None => Ok(settings),
        }
    }
}

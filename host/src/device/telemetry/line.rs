//! The line over which a device is heard: a serial port, or a file, a FIFO or standard input that holds what one sent.

use crate::text::error::{Error, Result};
use jointwatch_shared::wire::telemetry::{MAX_FRAME, Request, encode};
use serialport::{SerialPort, SerialPortType};
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

/// Bytes that are read at once, at most.
const PIECE: usize = 4096;
/// Pieces that may wait until they are looked at; then reading waits.
const PIECES: usize = 64;
/// How long a serial port is waited for before it is asked again.
const PATIENCE: Duration = Duration::from_millis(50);

/// Where the bytes come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A serial port and its bits per second.
    Port(String, u32),
    /// A file or a FIFO.
    File(PathBuf),
    /// Bytes that come in over standard input.
    StandardInput,
}

/// What a wait for bytes ended with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Piece {
    /// Bytes that have arrived.
    Bytes(Vec<u8>),
    /// No byte came within the wait.
    Nothing,
    /// There will be no more.
    End,
}

/// An open line. A thread reads it, so that whoever listens can stop at any time.
pub struct TelemetryLine {
    source: Source,
    pieces: Receiver<std::io::Result<Vec<u8>>>,
    back: Option<Box<dyn SerialPort>>,
    sequence: u16,
}

impl TelemetryLine {
    /// Opens it.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Failed`] when a serial port cannot be opened, with the ports that there are;
    /// [`crate::text::error::Kind::Data`] when a file cannot be.
    pub fn open(source: Source) -> Result<Self> {
        let (reader, back): (Box<dyn Read + Send>, _) = match &source {
            Source::StandardInput => (Box::new(std::io::stdin()), None),
            Source::File(path) => (Box::new(open_file(path)?), None),
            Source::Port(name, baud) => {
                let port = open_port(name, *baud)?;
                let back = port.try_clone().map_err(|e| {
                    Error::failed(format!("{name}: could not be opened for writing ({e})"))
                })?;
                (Box::new(port), Some(back))
            }
        };
        let (sender, pieces) = sync_channel(PIECES);
        let is_port = back.is_some();
        thread::spawn(move || {
            let mut reader = reader;
            let mut buffer = [0; PIECE];
            loop {
                let piece = match reader.read(&mut buffer) {
                    // A port that is gone reads as empty on some systems.
                    Ok(0) if is_port => Err(ErrorKind::UnexpectedEof.into()),
                    Ok(0) => return,
                    Ok(length) => Ok(buffer[..length].to_vec()),
                    Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {
                        Ok(Vec::new())
                    }
                    Err(e) => Err(e),
                };
                let over = piece.is_err();
                let idle = matches!(&piece, Ok(bytes) if bytes.is_empty());
                if !idle && sender.send(piece).is_err() || over {
                    return;
                }
            }
        });
        Ok(Self {
            source,
            pieces,
            back,
            sequence: 0,
        })
    }

    /// Waits for bytes, but not for longer than this.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Failed`] when the line breaks: a port that was unplugged, a disk that cannot be read.
    pub fn next(&self, wait: Duration) -> Result<Piece> {
        match self.pieces.recv_timeout(wait) {
            Ok(Ok(bytes)) => Ok(Piece::Bytes(bytes)),
            Err(RecvTimeoutError::Timeout) => Ok(Piece::Nothing),
            Err(RecvTimeoutError::Disconnected) => Ok(Piece::End),
            Ok(Err(e)) => Err(Error::failed(match &self.source {
                Source::Port(name, _) => format!(
                    "{name}: the port is gone ({e}); plug the device in again and look whether its name is still the same"
                ),
                Source::File(path) => format!("{}: could not be read ({e})", path.display()),
                Source::StandardInput => format!("standard input could not be read ({e})"),
            })),
        }
    }

    /// Sends a request to the device; gives its sequence number.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Usage`] when this is no serial port, [`crate::text::error::Kind::Failed`] when the port does not take it.
    pub fn send(&mut self, request: &Request) -> Result<u16> {
        let (Source::Port(name, _), Some(port)) = (&self.source, &mut self.back) else {
            return Err(Error::usage(
                "a request can only be sent to a device: name its serial port with --port",
            ));
        };
        let sequence = self.sequence;
        let mut place = [0; MAX_FRAME];
        let frame = encode(request, sequence, &mut place)
            .map_err(|_| Error::failed("the request does not fit a frame"))?;
        port.write_all(frame)
            .and_then(|()| port.flush())
            .map_err(|e| Error::failed(format!("{name}: a request could not be sent ({e})")))?;
        self.sequence = sequence.wrapping_add(1);
        Ok(sequence)
    }
}

fn open_file(path: &Path) -> Result<File> {
    let wrong = |why: String| Error::data(format!("{}: {why}", path.display()));
    if path.is_dir() {
        return Err(wrong("is a folder; name a file".to_string()));
    }
    File::open(path).map_err(|e| {
        wrong(format!(
            "could not be opened ({e}); name a file that holds what a device sent, or a serial port with --port"
        ))
    })
}

fn open_port(name: &str, baud: u32) -> Result<Box<dyn SerialPort>> {
    let port = serialport::new(name, baud).timeout(PATIENCE).open();
    port.map_err(|e| {
        let ports = serialport::available_ports().unwrap_or_default();
        let ports: Vec<String> = ports.into_iter().map(described).collect();
        let advice = if ports.is_empty() {
            "no serial port was found on this computer: is the device plugged in?".to_string()
        } else {
            format!("there are {}", ports.join(", "))
        };
        let access = match e.kind() {
            serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => {
                "; on Linux, ports usually belong to the group dialout: sudo usermod -aG dialout $USER, then log in again"
            }
            serialport::ErrorKind::NoDevice => "; is another program using it?",
            _ => "",
        };
        Error::failed(format!(
            "{name}: this serial port could not be opened at {baud} baud ({e}){access}; {advice}"
        ))
    })
}

fn described(port: serialport::SerialPortInfo) -> String {
    let product = match port.port_type {
        SerialPortType::UsbPort(usb) => usb.product,
        _ => None,
    };
    match product {
        Some(product) => format!("{} ({product})", port.port_name),
        None => port.port_name,
    }
}

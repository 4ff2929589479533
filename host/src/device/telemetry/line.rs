//! The line over which a device is heard: a serial port, a TCP address, or a file, a FIFO or
//! standard input that holds what one sent.

use crate::text::error::{Error, Result};
use jointwatch_shared::wire::telemetry::{MAX_FRAME, Request, encode};
use serialport::{SerialPort, SerialPortType};
use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

/// Bytes that are read at once, at most.
const PIECE: usize = 4096;
/// Pieces that may wait until they are looked at; then reading waits.
const PIECES: usize = 64;
/// How long a serial port is waited for before it is asked again.
const PATIENCE: Duration = Duration::from_millis(50);
/// How long a TCP address is waited for until it answers.
const CALLING: Duration = Duration::from_secs(3);

/// Where the bytes come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A serial port and its bits per second.
    Port(String, u32),
    /// Host and port of a program that hands on what a device sends, such as `jointwatch emulate
    /// --serve`.
    Tcp(String),
    /// A file or a FIFO.
    File(PathBuf),
    /// Bytes that come in over standard input.
    StandardInput,
}

impl Source {
    /// Whether a device may be at its other end, to which requests can be sent, and which may come
    /// back after the line was lost.
    pub fn is_device(&self) -> bool {
        matches!(self, Self::Port(..) | Self::Tcp(_))
    }

    /// As a person names it.
    pub fn name(&self) -> String {
        match self {
            Self::Port(name, _) | Self::Tcp(name) => name.clone(),
            Self::File(path) => path.display().to_string(),
            Self::StandardInput => "standard input".to_string(),
        }
    }
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
    back: Option<Box<dyn Write + Send>>,
    sequence: u16,
    stop: Arc<AtomicBool>,
}

impl Drop for TelemetryLine {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// The two ends of a line: to read from, and where there is a device, to write to.
type Ends = (Box<dyn Read + Send>, Option<Box<dyn Write + Send>>);

impl TelemetryLine {
    /// Opens it.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Failed`] when a serial port cannot be opened, with the ports
    /// that there are; [`crate::text::error::Kind::Data`] when a file cannot be.
    pub fn open(source: Source) -> Result<Self> {
        let (reader, back): Ends = match &source {
            Source::StandardInput => (Box::new(std::io::stdin()), None),
            Source::File(path) => (Box::new(open_file(path)?), None),
            Source::Port(name, baud) => {
                let port = open_port(name, *baud)?;
                let back = port.try_clone().map_err(|e| {
                    Error::failed(format!("{name}: could not be opened for writing ({e})"))
                })?;
                (Box::new(port), Some(Box::new(back)))
            }
            Source::Tcp(address) => {
                let stream = call(address)?;
                let back = stream.try_clone().map_err(|e| unanswered(address, &e))?;
                (Box::new(stream), Some(Box::new(back)))
            }
        };
        let (sender, pieces) = sync_channel(PIECES);
        // A port that is gone reads as empty on some systems; a TCP line ends like a file.
        let is_port = matches!(source, Source::Port(..));
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        thread::spawn(move || {
            let mut reader = reader;
            let mut buffer = [0; PIECE];
            while !stopped.load(Ordering::Relaxed) {
                let piece = match reader.read(&mut buffer) {
                    Ok(0) if is_port => Err(ErrorKind::UnexpectedEof.into()),
                    Ok(0) => return,
                    Ok(length) => Ok(buffer[..length].to_vec()),
                    Err(e) if is_idle(e.kind()) => continue,
                    Err(e) => Err(e),
                };
                let over = piece.is_err();
                if sender.send(piece).is_err() || over {
                    return;
                }
            }
        });
        Ok(Self {
            source,
            pieces,
            back,
            sequence: 0,
            stop,
        })
    }

    /// Waits for bytes, but not for longer than this.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Failed`] when the line breaks: a port that was unplugged, a disk
    /// that cannot be read.
    pub fn next(&self, wait: Duration) -> Result<Piece> {
        match self.pieces.recv_timeout(wait) {
            Ok(Ok(bytes)) => Ok(Piece::Bytes(bytes)),
            Err(RecvTimeoutError::Timeout) => Ok(Piece::Nothing),
            Err(RecvTimeoutError::Disconnected) => Ok(Piece::End),
            Ok(Err(e)) => Err(Error::failed(match &self.source {
                Source::Port(name, _) => format!(
                    "{name}: the port is gone ({e}); plug the device in again and look whether its name is still the same"
                ),
                Source::Tcp(address) => format!("{address}: the line is lost ({e})"),
                Source::File(path) => format!("{}: could not be read ({e})", path.display()),
                Source::StandardInput => format!("standard input could not be read ({e})"),
            })),
        }
    }

    /// Sends a request to the device; gives its sequence number.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Usage`] when no device can be at the other end,
    /// [`crate::text::error::Kind::Failed`] when the line does not take it.
    pub fn send(&mut self, request: &Request) -> Result<u16> {
        let Some(back) = &mut self.back else {
            return Err(Error::usage(
                "a request can only be sent to a device: name its serial port with --port, or its address with --tcp",
            ));
        };
        let sequence = self.sequence;
        let mut place = [0; MAX_FRAME];
        let frame = encode(request, sequence, &mut place)
            .map_err(|_| Error::failed("the request does not fit a frame"))?;
        back.write_all(frame)
            .and_then(|()| back.flush())
            .map_err(|e| {
                let name = self.source.name();
                Error::failed(format!("{name}: a request could not be sent ({e})"))
            })?;
        self.sequence = sequence.wrapping_add(1);
        Ok(sequence)
    }
}

/// Whether a read only had nothing to give.
fn is_idle(kind: ErrorKind) -> bool {
    matches!(
        kind,
        ErrorKind::TimedOut | ErrorKind::Interrupted | ErrorKind::WouldBlock
    )
}

fn unanswered(address: &str, why: &std::io::Error) -> Error {
    Error::failed(format!(
        "{address}: nobody answers there ({why}); is `jointwatch emulate --serve` or another server running, on this port?"
    ))
}

/// A line that goes both ways, whatever carries it.
pub trait TwoWay: Read + Write {}
impl<T: Read + Write> TwoWay for T {}

/// Opens a serial port, `tcp:HOST:PORT`, or on Unix `unix:PATH` for an emulator's socket; a read
/// waits 50 ms.
///
/// # Errors
/// [`crate::text::error::Kind::Failed`] with the ports that there are, or that nobody answers.
pub fn connect(port: &str, baud: u32) -> Result<Box<dyn TwoWay>> {
    if let Some(address) = port.strip_prefix("tcp:") {
        return Ok(Box::new(call(address)?));
    }
    #[cfg(unix)]
    if let Some(path) = port.strip_prefix("unix:") {
        let line = std::os::unix::net::UnixStream::connect(path);
        let line = line.and_then(|line| line.set_read_timeout(Some(PATIENCE)).map(|()| line));
        return Ok(Box::new(line.map_err(|e| unanswered(path, &e))?));
    }
    if port.parse::<SocketAddr>().is_ok() {
        return Err(Error::usage(format!(
            "{port} is an address and no serial port; write tcp:{port}"
        )));
    }
    Ok(Box::new(open_port(port, baud)?))
}

/// Connects to the first of a name's addresses that answers.
fn call(address: &str) -> Result<TcpStream> {
    let found = address.to_socket_addrs().map_err(|e| {
        Error::usage(format!(
            "{address:?} is no address ({e}); write host and port, as in 127.0.0.1:4000"
        ))
    })?;
    let mut why = std::io::Error::from(ErrorKind::AddrNotAvailable);
    for one in found {
        match TcpStream::connect_timeout(&one, CALLING) {
            Ok(stream) => {
                let set = stream.set_read_timeout(Some(PATIENCE));
                let set = set.and_then(|()| stream.set_write_timeout(Some(CALLING)));
                return set.map(|()| stream).map_err(|e| unanswered(address, &e));
            }
            Err(e) => why = e,
        }
    }
    Err(unanswered(address, &why))
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

//! The emulated device's serial line on a TCP port of this machine: one listener at a time, as at a
//! serial port.

use crate::text::error::{Error, Result};
use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, TrySendError, channel, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

/// Pieces of what the device says that may wait for a listener; a slower one loses them, as at a
/// serial port.
const WAITING: usize = 4096;
/// A listener that takes nothing for so long is let go.
const PATIENCE: Duration = Duration::from_secs(5);
/// One that comes while another listens is sent away after so long: the other may have ended, and
/// nobody has seen it yet.
const CHANGEOVER: Duration = Duration::from_millis(500);

/// The port's end at the device.
pub struct Loopback {
    /// Where it listens: address and port.
    pub address: SocketAddr,
    to_listener: SyncSender<Vec<u8>>,
    from_listener: Receiver<Vec<u8>>,
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    connected: AtomicBool,
    connections: AtomicU64,
}

impl Loopback {
    /// Listens on a port of the loopback address; 0 takes a free one.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Failed`] when the port is taken.
    pub fn open(port: u16) -> Result<Self> {
        let wanted = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        let failed = |e: std::io::Error| {
            Error::failed(format!(
                "{wanted}: cannot be listened on ({e}); give another port to --serve, or 0 for a free one"
            ))
        };
        let server = TcpListener::bind(wanted).map_err(failed)?;
        let address = server.local_addr().map_err(failed)?;
        let (to_listener, said) = sync_channel(WAITING);
        let (heard, from_listener) = channel();
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        thread::spawn(move || take_turns(&server, &said, &heard, &of_thread));
        Ok(Self {
            address,
            to_listener,
            from_listener,
            shared,
        })
    }

    /// Whether a program is connected to the port.
    pub fn is_connected(&self) -> bool {
        self.shared.connected.load(Ordering::Relaxed)
    }

    /// How many have listened so far.
    pub fn connections(&self) -> u64 {
        self.shared.connections.load(Ordering::Relaxed)
    }

    /// Hands on what the device says, to whoever listens.
    pub fn say(&self, bytes: &[u8]) {
        if self.is_connected() {
            // What a listener is too slow for is lost to it; its program counts that.
            match self.to_listener.try_send(bytes.to_vec()) {
                Ok(()) | Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {}
            }
        }
    }

    /// What was sent to the device since.
    pub fn heard(&self) -> Vec<u8> {
        self.from_listener.try_iter().flatten().collect()
    }
}

/// Serves one listener after another; one that comes while another goes on listening is sent away.
fn take_turns(
    server: &TcpListener,
    said: &Receiver<Vec<u8>>,
    heard: &Sender<Vec<u8>>,
    shared: &Arc<Shared>,
) {
    let mut next = None;
    loop {
        let Some(stream) = next.take().or_else(|| Some(server.accept().ok()?.0)) else {
            // A connection that broke before it was taken is nobody's loss.
            thread::sleep(Duration::from_millis(20));
            continue;
        };
        // What was said before was said to nobody.
        said.try_iter().for_each(drop);
        shared.connections.fetch_add(1, Ordering::Relaxed);
        shared.connected.store(true, Ordering::Relaxed);
        if server.set_nonblocking(true).is_ok() {
            next = attend(server, stream, said, heard);
        }
        shared.connected.store(false, Ordering::Relaxed);
        if server.set_nonblocking(false).is_err() {
            return;
        }
    }
}

/// Serves a listener to its end; gives the one that came meanwhile.
fn attend(
    server: &TcpListener,
    stream: TcpStream,
    said: &Receiver<Vec<u8>>,
    heard: &Sender<Vec<u8>>,
) -> Option<TcpStream> {
    let set = stream.set_nonblocking(false);
    let set = set.and_then(|()| stream.set_write_timeout(Some(PATIENCE)));
    let set = set.and_then(|()| stream.set_nodelay(true));
    let (Ok(()), Ok(reader)) = (set, stream.try_clone()) else {
        return None;
    };
    let gone = Arc::new(AtomicBool::new(false));
    let (went, heard) = (Arc::clone(&gone), heard.clone());
    let reading = thread::spawn(move || {
        read(reader, &heard);
        went.store(true, Ordering::Relaxed);
    });
    let mut stream = stream;
    let mut next: Option<(TcpStream, Instant)> = None;
    while !gone.load(Ordering::Relaxed) {
        next = next.filter(|(_, since)| since.elapsed() < CHANGEOVER);
        if let Ok((other, _)) = server.accept() {
            next.get_or_insert((other, Instant::now()));
        }
        if let Ok(bytes) = said.recv_timeout(Duration::from_millis(50))
            && stream.write_all(&bytes).is_err()
        {
            break;
        }
    }
    // Ends the reader too; a stream that is gone needs no shutting down.
    let _ = stream.shutdown(Shutdown::Both);
    let _ = reading.join();
    next.map(|(stream, _)| stream)
}

fn read(mut stream: TcpStream, heard: &Sender<Vec<u8>>) {
    let mut buffer = [0; 1024];
    loop {
        match stream.read(&mut buffer) {
            Ok(0) => return,
            Ok(length) if heard.send(buffer[..length].to_vec()).is_err() => return,
            Ok(_) => {}
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(_) => return,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn until(what: impl Fn() -> bool) {
        for _ in 0..500 {
            if what() {
                return;
            }
            thread::sleep(Duration::from_millis(10));
        }
        panic!("it never came");
    }

    #[test]
    fn listeners_take_turns_and_hear_what_is_said_while_they_listen() {
        let line = Loopback::open(0).unwrap();
        assert!(line.address.ip().is_loopback());
        assert!(Loopback::open(line.address.port()).is_err(), "it is taken");
        line.say(b"to nobody");
        for turn in 1..=3_u8 {
            let mut listener = TcpStream::connect(line.address).unwrap();
            until(|| line.connections() == u64::from(turn) && line.is_connected());
            // A second one is sent away, and the first hears on.
            let mut second = TcpStream::connect(line.address).unwrap();
            assert_eq!(second.read(&mut [0; 9]).unwrap_or(0), 0);
            line.say(&[turn; 3]);
            let mut heard = [0; 3];
            listener.read_exact(&mut heard).unwrap();
            assert_eq!(heard, [turn; 3]);
            listener.write_all(&[turn]).unwrap();
            let mut asked = Vec::new();
            for _ in 0..500 {
                asked.extend(line.heard());
                if !asked.is_empty() {
                    break;
                }
                thread::sleep(Duration::from_millis(10));
            }
            assert_eq!(asked, [turn]);
            drop(listener);
            until(|| !line.is_connected());
        }
    }

    #[test]
    fn who_comes_while_the_one_before_is_going_is_served() {
        let line = Loopback::open(0).unwrap();
        let first = TcpStream::connect(line.address).unwrap();
        until(|| line.connections() == 1);
        let mut second = TcpStream::connect(line.address).unwrap();
        thread::sleep(Duration::from_millis(150));
        drop(first);
        until(|| line.connections() == 2 && line.is_connected());
        line.say(b"here");
        let mut heard = [0; 4];
        second.read_exact(&mut heard).unwrap();
        assert_eq!(&heard, b"here");
    }
}

//! The two files of the link: requests go into one, answers come out of the other.

use crate::board::semihosting::{MAX_COMMAND_LINE, command_line, exit};
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m_semihosting::{nr, syscall1};

/// Handles of the host's files, and whether instructions are to be counted.
static TO_DEVICE: AtomicU32 = AtomicU32::new(0);
static FROM_DEVICE: AtomicU32 = AtomicU32::new(0);
static COUNTS: AtomicU32 = AtomicU32::new(0);

/// Bytes of a request besides its head.
const MOST: usize = 256;
/// Bytes of a request's head: its kind, then its length in 16 bits, little-endian.
const HEAD: usize = 3;

/// The open files; there is nothing to it, because their handles are statics.
#[derive(Clone, Copy, Debug)]
pub(super) struct Files;

/// Opens the files that the command line names. To be called once, before anything else of the
/// link; ends the program with exit code 1 when that is not possible.
pub fn open() {
    let mut room = [0; MAX_COMMAND_LINE];
    let words = command_line(&mut room).split_ascii_whitespace().skip(1);
    let mut names = None;
    for word in words {
        match word.split_once('=') {
            Some(("link", files)) => names = files.split_once(','),
            None if word == "count" => COUNTS.store(1, Ordering::Relaxed),
            _ => exit(false),
        }
    }
    let Some((to_device, from_device)) = names else {
        exit(false)
    };
    // In this order, as the other end opens them: each of both waits for the other.
    TO_DEVICE.store(open_one(to_device, nr::open::R_BINARY), Ordering::Relaxed);
    FROM_DEVICE.store(
        open_one(from_device, nr::open::W_TRUNC_BINARY),
        Ordering::Relaxed,
    );
}

fn open_one(name: &str, mode: usize) -> u32 {
    let mut text = [0; MAX_COMMAND_LINE];
    let Some(place) = text.get_mut(..name.len()) else {
        exit(false)
    };
    place.copy_from_slice(name.as_bytes());
    let block = [text.as_ptr() as usize, mode, name.len()];
    // SAFETY: the block names a text that ends with a zero, for as long as this call lasts.
    let handle = unsafe { syscall1(nr::OPEN, &raw const block as usize) };
    if handle == usize::MAX {
        exit(false)
    }
    handle as u32
}

impl Files {
    /// Whether instructions are to be counted.
    pub(super) fn counts(self) -> bool {
        COUNTS.load(Ordering::Relaxed) != 0
    }

    /// Sends a request in one piece.
    pub(super) fn request(self, kind: u8, bytes: &[u8]) {
        let mut message = [0; HEAD + MOST];
        let [low, high] = (bytes.len() as u16).to_le_bytes();
        if let Some((head, rest)) = message.split_first_chunk_mut() {
            *head = [kind, low, high];
            for (place, &byte) in rest.iter_mut().zip(bytes) {
                *place = byte;
            }
        }
        let length = HEAD + bytes.len().min(MOST);
        let handle = FROM_DEVICE.load(Ordering::Relaxed);
        let block = [handle as usize, message.as_ptr() as usize, length];
        // SAFETY: the block names memory of this function, which is only read.
        let left = unsafe { syscall1(nr::WRITE, &raw const block as usize) };
        if left != 0 || bytes.len() > MOST {
            // Nobody reads any more, or a frame is longer than any: nothing that runs on can be
            // believed.
            exit(false)
        }
    }

    /// Waits for all bytes of an answer.
    pub(super) fn answer(self, bytes: &mut [u8]) {
        let handle = TO_DEVICE.load(Ordering::Relaxed) as usize;
        let mut place = bytes.as_mut_ptr() as usize;
        let mut left = bytes.len();
        while left > 0 {
            let block = [handle, place, left];
            // SAFETY: the block names what is still to be filled of `bytes`.
            let missing = unsafe { syscall1(nr::READ, &raw const block as usize) };
            if missing >= left {
                exit(false)
            }
            place += left - missing;
            left = missing;
        }
    }
}

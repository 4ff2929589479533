//! A flash of two sectors whose power fails on command: in the middle of a word, of a write, of an
//! erasure.
//!
//! A word that power failed on is in doubt: its bits were driven for too short a time, so that each
//! reading of it may give another value, until it is programmed again or erased. A weak cell reads
//! right as long as power lasts, and wrong afterwards.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use jointwatch_shared::wire::slot::{ENTRY_LEN, SLOT_LEN};

/// Bytes of a sector: enough for a slot and some entries of its journal, and little enough to be
/// copied a million times.
pub(crate) const SECTOR: usize = SLOT_LEN + 30 * ENTRY_LEN;

/// When power fails, and what the operation that it fails in has done by then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Cut {
    /// The operation, counted from 0.
    pub(crate) operation: usize,
    /// How far it came.
    pub(crate) how: How,
}

/// How far an operation came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum How {
    /// A write: so many bytes were programmed; the others of the word are untouched.
    Bytes(usize),
    /// A write: so many bytes were programmed; what is left of the word is in doubt.
    Doubtful(usize),
    /// An erasure: so many bytes from the beginning of the sector were erased.
    ErasedFromFront(usize),
    /// An erasure: so many bytes from the end of the sector were erased.
    ErasedFromBack(usize),
    /// An erasure: each programmed bit is in doubt.
    ErasureInDoubt,
    /// An erasure: the whole sector reads anything at all.
    Garbage,
    /// The operation came to its end, and power failed before the next one.
    After,
}

/// The flash's answer once power has failed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoPower;

impl NorFlashError for NoPower {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// What the program did to the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Operation {
    /// A write of so many bytes.
    Write(usize),
    /// An erasure of a sector.
    Erase,
}

/// See the top of this file.
#[derive(Clone)]
pub(crate) struct Flash {
    pub(crate) bytes: Vec<u8>,
    /// Bits in doubt, by the number of their byte.
    doubts: Vec<(usize, u8)>,
    /// Bits that read right until power comes back, by the number of their byte.
    weak: Vec<(usize, u8)>,
    cut: Option<Cut>,
    dead: bool,
    pub(crate) operations: Vec<Operation>,
    random: u64,
    /// What the slots were after the last whole erasure.
    pub(crate) after_erasure: Option<(usize, u64)>,
}

impl Flash {
    pub(crate) fn erased() -> Self {
        Self {
            bytes: vec![0xFF; 2 * SECTOR],
            doubts: Vec::new(),
            weak: Vec::new(),
            cut: None,
            dead: false,
            operations: Vec::new(),
            random: 0x9E37_79B9_7F4A_7C15,
            after_erasure: None,
        }
    }

    /// Power comes back, to fail again at `cut`.
    pub(crate) fn power(&mut self, cut: Option<Cut>, seed: u64) {
        self.cut = cut;
        self.dead = false;
        for (at, bits) in std::mem::take(&mut self.weak) {
            self.bytes[at] ^= bits;
        }
        self.operations.clear();
        self.after_erasure = None;
        self.random = (seed | 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    }

    /// These cells hold what they hold until power fails, and then something else.
    pub(crate) fn weaken(&mut self, at: usize, bits: u8) {
        self.weak.push((at, bits));
    }

    /// Whether power has failed.
    pub(crate) fn is_dead(&self) -> bool {
        self.dead
    }

    fn random(&mut self) -> u64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.random >> 16
    }

    /// Counts an operation; gives how far it comes when power fails in it.
    fn operation(&mut self, operation: Operation) -> Option<How> {
        let number = self.operations.len();
        self.operations.push(operation);
        let how = self.cut.filter(|cut| cut.operation == number)?.how;
        self.dead = true;
        Some(how)
    }

    fn settle(&mut self, from: usize, to: usize) {
        self.weak.retain(|(at, _)| !(from..to).contains(at));
        self.doubts.retain(|(at, _)| !(from..to).contains(at));
    }
}

/// Every cut of a session that did these operations, or, with `few`, only the first and last bytes
/// of long writes.
pub(crate) fn cuts(operations: &[Operation], few: bool) -> Vec<Cut> {
    let mut cuts = Vec::new();
    for (operation, what) in operations.iter().enumerate() {
        let mut add = |how| cuts.push(Cut { operation, how });
        match *what {
            Operation::Write(length) => {
                for byte in 0..length {
                    if !few || length <= 4 || byte < 5 || byte + 2 > length {
                        add(How::Bytes(byte));
                        add(How::Doubtful(byte));
                    }
                }
            }
            Operation::Erase => {
                for count in [
                    0, 1, 100, 4096, 4400, 8192, 8196, 8224, 8300, 8364, 8368, 8372, 8376, 8444,
                    8448, 8468, 8500,
                ] {
                    add(How::ErasedFromFront(count));
                    add(How::ErasedFromBack(SECTOR - count));
                }
                add(How::ErasureInDoubt);
                add(How::Garbage);
            }
        }
        add(How::After);
    }
    cuts
}

impl ErrorType for Flash {
    type Error = NoPower;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, into: &mut [u8]) -> Result<(), NoPower> {
        if self.dead {
            return Err(NoPower);
        }
        let from = offset as usize;
        into.copy_from_slice(&self.bytes[from..from + into.len()]);
        for number in 0..self.doubts.len() {
            let (at, bits) = self.doubts[number];
            if (from..from + into.len()).contains(&at) {
                into[at - from] ^= bits & self.random() as u8;
            }
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NoPower> {
        let (from, to) = (from as usize, to as usize);
        assert!(
            from.is_multiple_of(SECTOR) && to == from + SECTOR,
            "{from} to {to}"
        );
        if self.dead {
            return Err(NoPower);
        }
        let how = self.operation(Operation::Erase);
        match how {
            None | Some(How::After) => {
                self.bytes[from..to].fill(0xFF);
                self.settle(from, to);
            }
            Some(How::ErasedFromFront(count)) => self.bytes[from..from + count].fill(0xFF),
            Some(How::ErasedFromBack(count)) => self.bytes[to - count..to].fill(0xFF),
            Some(How::ErasureInDoubt) => {
                let programmed = (from..to)
                    .map(|at| (at, !self.bytes[at]))
                    .filter(|&(_, bits)| bits != 0);
                self.doubts.extend(programmed.collect::<Vec<_>>());
            }
            Some(How::Garbage) => {
                for at in from..to {
                    self.bytes[at] = self.random() as u8;
                }
            }
            Some(how) => panic!("{how:?} is no way to stop an erasure"),
        }
        if how.is_some() {
            return Err(NoPower);
        }
        use std::hash::{DefaultHasher, Hash, Hasher};
        let mut hasher = DefaultHasher::new();
        // All but the journals: those differ by how often something was erased, which decides about
        // no model.
        let of_slot = |at: usize| at % SECTOR < SLOT_LEN;
        for sector in self.bytes.chunks(SECTOR) {
            sector[..SLOT_LEN].hash(&mut hasher);
        }
        for doubt in self.doubts.iter().filter(|doubt| of_slot(doubt.0)) {
            doubt.hash(&mut hasher);
        }
        self.after_erasure = Some((self.operations.len(), hasher.finish()));
        Ok(())
    }

    fn write(&mut self, offset: u32, data: &[u8]) -> Result<(), NoPower> {
        let offset = offset as usize;
        assert!(
            offset.is_multiple_of(4) && data.len().is_multiple_of(4),
            "{offset}, {}",
            data.len()
        );
        if self.dead {
            return Err(NoPower);
        }
        for at in offset..offset + data.len() {
            let in_doubt = self.doubts.iter().any(|&(other, _)| other == at);
            assert!(
                self.bytes[at] == 0xFF || in_doubt,
                "byte {at} is programmed twice"
            );
        }
        let how = self.operation(Operation::Write(data.len()));
        let whole = match how {
            None | Some(How::After) => data.len(),
            Some(How::Bytes(count) | How::Doubtful(count)) => count,
            Some(how) => panic!("{how:?} is no way to stop a write"),
        };
        self.settle(offset, offset + whole);
        for (place, byte) in self.bytes[offset..].iter_mut().zip(&data[..whole]) {
            *place &= byte;
        }
        if let Some(How::Doubtful(_)) = how {
            let end = (whole / 4 * 4 + 4).min(data.len());
            // Driven towards `data`, for too short a time: may read as before or as programmed, bit
            // by bit.
            let doubtful = data[whole..end].iter().zip(offset + whole..);
            self.doubts.extend(doubtful.map(|(byte, at)| (at, !byte)));
        }
        if how.is_some() { Err(NoPower) } else { Ok(()) }
    }
}

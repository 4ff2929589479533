//! The emulated chips behind the bus that the firmware's drivers talk over, without a processor
//! between them.

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use jointwatch::emulate::board::{Board, BoardChip};
use jointwatch_firmware::sensor::acquire::Sensors;
use jointwatch_shared::wire::wiring::Wiring;
use std::cell::RefCell;
use std::rc::Rc;

/// One chip select of an emulated board; without a place, the one that all counters share.
pub struct ChipSelect {
    board: Rc<RefCell<Board>>,
    place: Option<BoardChip>,
}

impl ChipSelect {
    /// The chip select of a place.
    pub fn of(board: &Rc<RefCell<Board>>, place: Option<BoardChip>) -> Self {
        Self {
            board: Rc::clone(board),
            place,
        }
    }
}

/// The firmware's drivers on an emulated board.
pub type Chips = Sensors<ChipSelect, ChipSelect, ChipSelect, ChipSelect>;

/// The firmware's drivers for a board that is wired so.
pub fn chips(board: &Rc<RefCell<Board>>, wiring: &Wiring) -> Chips {
    let to = |place| ChipSelect::of(board, Some(place));
    Sensors::new(
        wiring,
        ChipSelect::of(board, None),
        std::array::from_fn(|n| to(BoardChip::Counter(n))),
        to(BoardChip::Converter),
        std::array::from_fn(|n| to(BoardChip::Accelerometer(n))),
    )
}

impl ErrorType for ChipSelect {
    type Error = ErrorKind;
}

impl SpiDevice for ChipSelect {
    /// All operations are one selection of the chip, as the trait has it.
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let mut sent = Vec::new();
        for operation in operations.iter() {
            match operation {
                Operation::TransferInPlace(bytes) => sent.extend_from_slice(bytes),
                Operation::Write(bytes) => sent.extend_from_slice(bytes),
                Operation::Read(bytes) => sent.resize(sent.len() + bytes.len(), 0),
                Operation::Transfer(read, write) => {
                    let end = sent.len() + read.len().max(write.len());
                    sent.extend_from_slice(write);
                    sent.resize(end, 0);
                }
                Operation::DelayNs(_) => {}
            }
        }
        let mut board = self.board.borrow_mut();
        match self.place {
            Some(place) => board.select(place, &mut sent),
            None => board.select_counters(&sent),
        }
        let mut back = sent.into_iter();
        let mut fill = |place: &mut [u8]| place.iter_mut().zip(&mut back).for_each(|(p, b)| *p = b);
        for operation in operations {
            match operation {
                Operation::TransferInPlace(bytes) | Operation::Read(bytes) => fill(bytes),
                Operation::Write(bytes) => fill(&mut bytes.to_vec()),
                Operation::Transfer(read, write) => {
                    let most = read.len().max(write.len());
                    let mut all = vec![0; most];
                    fill(&mut all);
                    let kept = read.len();
                    read.copy_from_slice(&all[..kept]);
                }
                Operation::DelayNs(_) => {}
            }
        }
        Ok(())
    }
}

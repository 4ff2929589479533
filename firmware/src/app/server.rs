//! The last step, which has time: frames out, requests in, uploads into flash.

use super::watch::{Streamed, Watch};
use crate::store::{Store, Upload, Verifier};
use embedded_storage::nor_flash::NorFlash;
use heapless::spsc::Consumer;
use jointwatch_shared::wire::blob::BLOB_LEN;
use jointwatch_shared::wire::slot::Order;
use jointwatch_shared::wire::telemetry::{
    Answer, Answered, Decoder, Hello, MAX_FRAME, Occasion, Report, Request, Supply, Text,
    UploadReply, encode,
};

/// What a board offers to send frames over its serial line.
pub trait SerialPort {
    /// Bits per second that it carries; `None` when it always keeps up.
    const BAUD: Option<u32>;

    /// Sends all of a frame; false when it could not.
    fn send(&mut self, frame: &[u8]) -> bool;
}

/// Received bytes that are looked at in one go; the longest frame is shorter.
const AT_ONCE: usize = 256;

/// What the board of a flash knows of the supply that it is written with.
pub trait Supplied {
    /// The supply as it is now; nothing is known of it where a board does not say.
    fn supply(&self) -> Supply {
        Supply::default()
    }
}

/// The watch, which the monitor's task holds and this one borrows for moments.
pub trait Shared {
    /// Does something with it that is soon done: the monitor waits meanwhile.
    fn with<R>(&mut self, what: impl FnOnce(&mut Watch) -> R) -> R;
}

impl Shared for &mut Watch {
    fn with<R>(&mut self, what: impl FnOnce(&mut Watch) -> R) -> R {
        what(self)
    }
}

/// What became of a request that only the device's owner may make.
enum Judged {
    Upload(UploadReply),
    Order(Order, Result<(), Answered>),
    Neither,
}

/// The device's end of the line.
pub struct Server<F, V, O> {
    store: Store<F, V>,
    upload: Upload,
    decoder: Decoder<Request>,
    sequence: u16,
    hello: Hello,
    line: O,
}

impl<F: NorFlash + Supplied, V: Verifier, O: SerialPort> Server<F, V, O> {
    /// Serves a device that introduces itself so.
    pub fn new(store: Store<F, V>, hello: Hello, line: O) -> Self {
        Self {
            store,
            upload: Upload::new(),
            decoder: Decoder::default(),
            sequence: 0,
            hello,
            line,
        }
    }

    /// The serial line that frames go out over.
    pub fn line_mut(&mut self) -> &mut O {
        &mut self.line
    }

    /// The flash behind the store, for who plays its board.
    pub fn flash_mut(&mut self) -> &mut F {
        self.store.flash_mut()
    }

    /// Gives the store back.
    pub fn into_store(self) -> Store<F, V> {
        self.store
    }

    /// Introduces the device: the first frame after a restart.
    pub fn introduce(&mut self, occasion: Occasion, watch: &mut impl Shared) {
        self.hello.occasion = occasion;
        let access = &mut self.hello.access;
        // A name that cannot be told is left out, and so are counts that cannot be read.
        let class = self.store.class();
        let name = class.split(|&byte| byte == 0).next();
        let name = name.and_then(|name| core::str::from_utf8(name).ok());
        access.class = Text::try_from(name.unwrap_or_default()).unwrap_or_default();
        access.keys = self.store.trusted();
        if let Ok(standing) = self.store.standing() {
            (access.number, access.newest) = (standing.number, standing.newest);
            access.erasures = standing.erasures;
        }
        let hello = Report::Hello(self.hello.clone());
        self.send(&hello, watch);
    }

    /// Sends one report; what the line does not take is counted, and its number is used up all the
    /// same.
    fn send(&mut self, report: &Report, watch: &mut impl Shared) {
        let mut place = [0; MAX_FRAME];
        let sent = match encode(report, self.sequence, &mut place) {
            Ok(frame) => self.line.send(frame),
            Err(_) => false,
        };
        self.sequence = self.sequence.wrapping_add(1);
        if !sent {
            watch.with(|watch| watch.dropped(1));
        }
    }

    /// Takes received bytes as long as there is a `next` one, but not so many that a line that
    /// never pauses keeps the device from telling anything.
    pub fn hear(&mut self, mut next: impl FnMut() -> Option<u8>, watch: &mut impl Shared) {
        for _ in 0..AT_ONCE {
            let Some(byte) = next() else { return };
            self.receive(byte, watch);
        }
    }

    /// Takes one received byte, and does what it completes.
    pub fn receive(&mut self, byte: u8, watch: &mut impl Shared) {
        let received = match self.decoder.push(byte) {
            None => return,
            Some(Err(_)) => return watch.with(Watch::damaged),
            Some(Ok(received)) => received,
        };
        let answered = watch.with(|watch| watch.ask(&received.message, O::BAUD));
        if let Some(answered) = answered {
            let to = received.sequence;
            self.send(&Report::Answer(Answer { to, answered }), watch);
            return;
        }
        match received.message {
            Request::Hello => self.introduce(Occasion::Asked, watch),
            Request::Capture { piece } => {
                let to = received.sequence;
                let report = match watch.with(|watch| watch.counts(piece)) {
                    Ok(piece) => Report::Capture(piece),
                    Err(answered) => Report::Answer(Answer { to, answered }),
                };
                self.send(&report, watch);
            }
            Request::Upload(_) | Request::Order { .. } => {
                self.signed(received.sequence, &received.message, watch);
            }
            _ => {}
        }
    }

    /// What only the device's owner may ask for: a step of an upload, or an order.
    fn signed(&mut self, sequence: u16, request: &Request, watch: &mut impl Shared) {
        match self.judged(request, watch.with(|watch| watch.has_alarm())) {
            Judged::Upload(reply) => {
                self.send(&Report::Upload(reply), watch);
                if matches!(reply, UploadReply::Activated { .. }) {
                    watch.with(Watch::restart_soon);
                }
            }
            Judged::Order(order, outcome) => {
                let answered = outcome.err().unwrap_or(Answered::Done);
                let to = sequence;
                self.send(&Report::Answer(Answer { to, answered }), watch);
                if answered == Answered::Done {
                    watch.with(|watch| match order {
                        Order::Restart | Order::RollBack => watch.restart_soon(),
                        Order::Acknowledge => watch.acknowledged(),
                        Order::RevokeOther => {}
                    });
                }
            }
            Judged::Neither => {}
        }
    }

    /// What the store says to it.
    ///
    /// Not inlined: the room for a blob is on the stack only meanwhile.
    #[inline(never)]
    fn judged(&mut self, request: &Request, has_alarm: bool) -> Judged {
        let mut work = [0; BLOB_LEN];
        match request {
            Request::Upload(step) => {
                Judged::Upload(self.upload.step(&mut self.store, step, &mut work))
            }
            Request::Order {
                order: Order::Acknowledge,
                ..
            } if !has_alarm => Judged::Order(Order::Acknowledge, Err(Answered::Nothing)),
            Request::Order {
                order,
                number,
                signature,
            } => {
                let signature = signature.bytes();
                let outcome = self.store.order(*order, *number, &signature, &mut work);
                Judged::Order(*order, outcome)
            }
            _ => Judged::Neither,
        }
    }

    /// Sends what there is to send: streamed samples, then what the watch has to tell; keeps an
    /// alarm, and marks a model that has proven itself.
    pub fn turn(&mut self, stream: &mut Consumer<'_, Streamed>, watch: &mut impl Shared) {
        while let Some(sample) = stream.dequeue() {
            self.send(&sample.report(), watch);
        }
        while let Some(mut report) = watch.with(Watch::to_tell) {
            if let Report::Upkeep(upkeep) = &mut report {
                upkeep.supply = self.store.flash().supply();
            }
            self.send(&report, watch);
        }
        if let Some(alarm) = watch.with(Watch::alarm_to_keep)
            && self.store.keep_alarm(alarm).is_err()
        {
            watch.with(Watch::not_kept);
        }
        if watch.with(Watch::take_proven) {
            let marked = self.store.confirm().is_ok();
            watch.with(|watch| watch.confirmed(marked));
        }
        if watch.with(Watch::take_hour) {
            // What cannot be written now is waited for another hour.
            let _ = self.store.an_hour_is_over();
        }
    }
}

//! Frames: what is written is read again, what is damaged is refused, and codes never change.

use super::telemetry_frames::{
    decode, frame, hello, longest_reports, longest_requests, messages, reports, requests,
};
use jointwatch_shared::monitor::{self, Cause, State};
use jointwatch_shared::wire::bytes::Bytes;
use jointwatch_shared::wire::slot::{Header, Order};
use jointwatch_shared::wire::telemetry::{
    Answer, Answered, Damage, Event, Hello, Kind, MAX_FRAME, Message, ModelFault, Occasion,
    Quantity, Received, Refusal, Report, Request, Restart, Slot, UploadReply, UploadRequest,
    Verdict,
};
use serde::Serialize;
use std::fmt::Debug;

/// Every example and every longest message of one direction.
fn all_reports() -> Vec<Report> {
    [reports(), longest_reports()].concat()
}

fn all_requests() -> Vec<Request> {
    [requests(), longest_requests()].concat()
}

fn each_is_read_as_it_was_written<M: Message + Debug + PartialEq + Clone>(messages: &[M]) {
    for (number, message) in messages.iter().enumerate() {
        let sequence = 0xff00 + number as u16;
        let frame = frame(message, sequence);
        println!("{} bytes: {message:?}", frame.len());
        assert!(frame.len() <= MAX_FRAME);
        let inner = &frame[1..frame.len() - 1];
        assert!(frame.starts_with(&[0]) && frame.ends_with(&[0]) && !inner.contains(&0));
        let message = message.clone();
        assert_eq!(decode(&frame), [Ok(Received { sequence, message })]);
    }
}

#[test]
fn every_message_fits_a_frame_and_is_read_as_it_was_written() {
    each_is_read_as_it_was_written(&all_reports());
    each_is_read_as_it_was_written(&all_requests());
}

/// Every single bit of a frame flipped, between two good ones.
fn no_flipped_bit_gets_through<M: Message + Debug + PartialEq + Clone>(all: &[M]) {
    let before = frame(&all[0], 1);
    for message in all {
        let good = frame(message, 2);
        let after = frame(message, 3);
        for bit in 0..8 * good.len() {
            let mut damaged = good.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let found = decode::<M>(&[&before[..], &damaged, &after].concat());
            let sequences: Vec<u16> = found.iter().flatten().map(|r| r.sequence).collect();
            assert_eq!(sequences, [1, 3], "bit {bit} of {message:?}");
            assert!(found.len() > 2, "the damage of bit {bit} was not counted");
        }
    }
}

#[test]
fn every_flipped_bit_is_refused_and_the_next_frame_is_read() {
    no_flipped_bit_gets_through(&all_reports());
    no_flipped_bit_gets_through(&all_requests());
}

/// Every frame cut off at its end or its beginning, before a good one. Only the zeros at its ends
/// may be missing.
fn no_torn_frame_gets_through<M: Message + Debug + PartialEq + Clone>(all: &[M]) {
    for message in all {
        let (torn, after) = (frame(message, 2), frame(message, 3));
        for cut in 0..=torn.len() {
            for (piece, whole) in [
                (&torn[..cut], torn.len() - 1),
                (&torn[torn.len() - cut..], 0),
            ] {
                let found = messages::<M>(&[piece, &after].concat());
                let sequences: Vec<u16> = found.iter().map(|r| r.sequence).collect();
                let complete = if whole > 0 {
                    cut >= whole
                } else {
                    cut + 1 >= torn.len()
                };
                let wanted: &[u16] = if complete { &[2, 3] } else { &[3] };
                assert_eq!(sequences, wanted, "{cut} bytes of {message:?}");
            }
        }
    }
}

#[test]
fn every_torn_frame_is_refused_and_the_next_one_is_read() {
    no_torn_frame_gets_through(&all_reports());
    no_torn_frame_gets_through(&all_requests());
}

#[test]
fn a_frame_of_the_other_direction_is_not_taken_for_an_answer() {
    for request in requests() {
        let tag = request.tag();
        assert_eq!(
            decode::<Report>(&frame(&request, 0)),
            [Err(Damage::Unknown { tag })]
        );
    }
    for report in reports() {
        let tag = report.tag();
        assert_eq!(
            decode::<Request>(&frame(&report, 0)),
            [Err(Damage::Unknown { tag })]
        );
    }
}

/// A message with a tag and fields of one's own choice.
struct Foreign(u8, Vec<u8>);

impl Message for Foreign {
    fn tag(&self) -> u8 {
        self.0
    }

    fn write<'a>(&self, place: &'a mut [u8]) -> Option<&'a [u8]> {
        let place = place.get_mut(..self.1.len())?;
        place.copy_from_slice(&self.1);
        Some(place)
    }

    fn read(_: u8, _: &[u8]) -> Option<Self> {
        None
    }
}

#[test]
fn what_this_program_does_not_know_is_told_apart_from_damage() {
    let unknown = |tag, fields: &[u8]| {
        let found = decode::<Report>(&frame(&Foreign(tag, fields.to_vec()), 9));
        assert_eq!(found, [Err(Damage::Unknown { tag })], "{fields:?}");
    };
    unknown(0x00, &[]);
    unknown(0x0a, &[1, 2, 3]);
    // An answer with a code that is not there yet, with a byte too many, with one too few.
    unknown(0x07, &[1, 7]);
    unknown(0x07, &[1, 0, 0]);
    unknown(0x07, &[1]);
    // A text that is no UTF-8, a list that is longer than it may be.
    unknown(
        0x01,
        &[
            1, 0, 1, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0xff,
        ],
    );
    unknown(0x02, &[0, 0, 0, 0, 3]);
    let answer = |fields: &[u8]| frame(&Foreign(0x07, fields.to_vec()), 9);
    let report = Report::Answer(Answer {
        to: 1,
        answered: Answered::LineTooSlow,
    });
    assert_eq!(answer(&[1, 3]), frame(&report, 9));
}

#[test]
fn fields_that_do_not_fit_are_refused_and_not_cut_off() {
    use jointwatch_shared::wire::telemetry::{MAX_PAYLOAD, TooLong, encode};
    let mut place = [0; MAX_FRAME];
    let most = MAX_PAYLOAD - 7;
    for value in [0, 1] {
        let fits = Foreign(1, vec![value; most]);
        let frame = encode(&fits, 0, &mut place).unwrap();
        assert_eq!(frame.len(), MAX_FRAME);
        let long = Foreign(1, vec![value; most + 1]);
        assert_eq!(encode(&long, 0, &mut place), Err(TooLong));
    }
}

#[test]
fn a_decoder_counts_what_it_sees() {
    let mut decoder = jointwatch_shared::wire::telemetry::Decoder::<Report>::default();
    let mut feed = |bytes: &[u8]| -> Vec<_> {
        let found = bytes.iter().filter_map(|&byte| decoder.push(byte));
        found.collect()
    };
    let good = frame(&hello(), 0);
    assert_eq!(feed(&[0; 20]), []);
    assert!(feed(&good)[0].is_ok());
    assert_eq!(feed(&[7; 1000]), []);
    assert_eq!(feed(&[0]), [Err(Damage::TooLong)]);
    assert_eq!(feed(&[5, 1, 0]), [Err(Damage::Broken)]);
    assert_eq!(feed(&[2, 1, 0]), [Err(Damage::Broken)]);
    assert_eq!(
        feed(&[9, 1, 1, 1, 1, 1, 1, 1, 1, 0]),
        [Err(Damage::Checksum)]
    );
    assert_eq!(
        feed(&frame(&Foreign(0x33, vec![]), 0)),
        [Err(Damage::Unknown { tag: 0x33 })]
    );
    assert_eq!(feed(&good[..9]), []);
    assert!(decoder.in_frame());
    let counts = decoder.counts();
    assert_eq!((counts.messages, counts.damaged, counts.unknown), (1, 4, 1));
}

/// The first byte of a value's fields: the code of an enum.
fn code<T: Serialize>(value: &T) -> u8 {
    let mut place = [0; 64];
    postcard::to_slice(value, &mut place).unwrap()[0]
}

fn codes<T: Serialize + Debug>(values: &[T]) {
    for (wanted, value) in values.iter().enumerate() {
        assert_eq!(usize::from(code(value)), wanted, "{value:?}");
    }
}

#[test]
fn tags_and_codes_never_change() {
    assert_eq!(
        reports().iter().map(Message::tag).collect::<Vec<u8>>(),
        [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]
    );
    assert_eq!(
        requests().iter().map(Message::tag).collect::<Vec<u8>>(),
        [
            0x81, 0x82, 0x83, 0x84, 0x85, 0x86, 0x86, 0x86, 0x86, 0x87, 0x88
        ]
    );
    codes(&[Slot::A, Slot::B]);
    codes(&[Kind::Model, Kind::Rig]);
    codes(&[Quantity::Translation, Quantity::Rotation]);
    codes(&[Occasion::Restart, Occasion::Asked, Occasion::Changed]);
    codes(&[
        Answered::Done,
        Answered::Busy,
        Answered::Nothing,
        Answered::LineTooSlow,
        Answered::NotSigned,
        Answered::Stale,
        Answered::Failed,
    ]);
    codes(&[
        Restart::PowerOn,
        Restart::BrownOut,
        Restart::Pin,
        Restart::Software,
        Restart::Watchdog,
        Restart::Fault,
        Restart::Unknown,
    ]);
    let (slot, fault) = (Slot::A, ModelFault::Length);
    codes(&[
        Event::Started { why: Restart::Pin },
        Event::NoCrystal,
        Event::NoModel,
        Event::ModelRefused { slot, fault },
        Event::ModelUnsigned { slot },
        Event::ModelConfirmed { slot },
        Event::ModelGivenUp { slot },
        Event::NoRig,
        Event::RigRefused { fault },
        Event::Mismatch,
        Event::SensorMissing { channel: 0 },
        Event::SensorBack { channel: 0 },
        Event::Verdict(Verdict::default()),
    ]);
    codes(&[
        ModelFault::Length,
        ModelFault::Magic,
        ModelFault::Version,
        ModelFault::Checksum,
        ModelFault::Field,
        ModelFault::Reserved,
        ModelFault::OutOfRange,
        ModelFault::Overflow,
        ModelFault::Other,
    ]);
    codes(&[
        UploadRequest::Begin {
            header: Header {
                rig_len: 0,
                release: 0,
                class: Bytes::new([0; 16]),
                digest: Bytes::new([0; 32]),
            },
            signature: None,
        },
        UploadRequest::Chunk {
            offset: 0,
            data: heapless::Vec::new(),
        },
        UploadRequest::Finish,
        UploadRequest::Abort,
    ]);
    codes(&[
        UploadReply::Accepted { next: 0 },
        UploadReply::Activated {
            kind: Kind::Rig,
            slot: None,
        },
        UploadReply::Aborted,
        UploadReply::Refused(Refusal::Busy),
    ]);
    codes(&[
        Order::Restart,
        Order::RollBack,
        Order::Acknowledge,
        Order::RevokeOther,
    ]);
    codes(&[
        Refusal::NotBegun,
        Refusal::Busy,
        Refusal::Length { seen: 0, most: 0 },
        Refusal::WrongOffset { next: 0 },
        Refusal::EmptyChunk,
        Refusal::BeyondEnd,
        Refusal::Incomplete { seen: 0 },
        Refusal::Checksum { seen: 0 },
        Refusal::Unsigned,
        Refusal::Signature,
        Refusal::NoKey,
        Refusal::Model(fault),
        Refusal::Rig(fault),
        Refusal::Mismatch,
        Refusal::Flash,
        Refusal::Worn,
        Refusal::TooOften,
        Refusal::Class,
        Refusal::NotNewer { newest: 0 },
    ]);
}

#[test]
fn a_verdict_of_the_monitor_survives_and_a_newer_code_is_told() {
    for state in State::ALL {
        for cause in Cause::ALL {
            let said = monitor::Verdict {
                state,
                cause,
                axis: 1,
                channel: 4,
                permille: 900,
            };
            assert_eq!(Verdict::from(said).read(), Some(said));
        }
    }
    let newer = Verdict {
        cause: 200,
        ..Verdict::default()
    };
    assert_eq!(newer.read(), None);
}

#[test]
fn the_protocol_version_can_be_read_whatever_follows_it() {
    let Report::Hello(Hello { protocol, .. }) = hello() else {
        panic!("hello is a hello");
    };
    let frame = frame(&hello(), 0);
    // COBS code, tag, sequence number (two zeros, which are codes), then the version.
    assert_eq!(u16::from(frame[5]), protocol);
    assert_eq!(
        protocol,
        jointwatch_shared::wire::telemetry::PROTOCOL_VERSION
    );
}

#[test]
fn the_frames_that_a_line_has_to_carry_are_as_long_as_the_firmware_reckons() {
    let longest = |tag: u8| {
        let all = longest_reports();
        let lengths = all.iter().filter(|report| report.tag() == tag);
        lengths.map(|report| frame(report, u16::MAX).len()).max()
    };
    // The firmware's `SAMPLE_FRAME`, `HEALTH_FRAME`, `ALARM_FRAME` and `UPKEEP_FRAME`.
    assert!(longest(0x04).is_some_and(|bytes| bytes <= 128));
    assert_eq!(longest(0x08), Some(56));
    assert_eq!(longest(0x09), Some(30));
    assert_eq!(longest(0x0b), Some(33));
}

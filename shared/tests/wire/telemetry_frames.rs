//! One example of every message, and the longest of each, for the tests of frames and of the page
//! that explains them.
#![allow(
    dead_code,
    reason = "each test binary uses the part of this that it needs"
)]

use heapless::Vec;
use jointwatch_shared::wire::bytes::Bytes;
use jointwatch_shared::wire::slot::{Header, Order};
use jointwatch_shared::wire::telemetry::{
    Access, Alarm, Answer, Answered, AxisHealth, AxisIdentity, AxisStatus, CAPTURE_PIECE,
    CapturePiece, Counters, Event, Health, Hello, KeptAlarm, MAX_CHUNK, MAX_FRAME, Message,
    ModelIdentity, Occasion, Quantity, Received, Refusal, Report, Request, RigIdentity,
    SNAPSHOT_PIECE, Sample, SampleOutput, SensorStatus, Signature, Slot, Snapshot, Status, Supply,
    Text, Upkeep, UploadReply, UploadRequest, Verdict, encode,
};

/// What an alarm says.
const ALARMED: Verdict = Verdict {
    state: 3,
    cause: 32,
    axis: 0,
    channel: 0,
    permille: 1200,
};

/// The frame of a message.
pub(crate) fn frame<M: Message>(message: &M, sequence: u16) -> std::vec::Vec<u8> {
    let mut place = [0; MAX_FRAME];
    encode(message, sequence, &mut place).unwrap().to_vec()
}

/// What a decoder finds in these bytes.
pub(crate) fn decode<M: Message>(
    bytes: &[u8],
) -> std::vec::Vec<Result<Received<M>, jointwatch_shared::wire::telemetry::Damage>> {
    let mut decoder = jointwatch_shared::wire::telemetry::Decoder::default();
    let found = bytes.iter().filter_map(|&byte| decoder.push(byte));
    found.collect()
}

/// Only the messages of [`decode`].
pub(crate) fn messages<M: Message>(bytes: &[u8]) -> std::vec::Vec<Received<M>> {
    decode(bytes).into_iter().flatten().collect()
}

fn list<T: Clone, const N: usize>(items: &[T]) -> Vec<T, N> {
    Vec::from_slice(items).ok().unwrap()
}

fn axis(name: &str, kind: Quantity, force_per_lsb: f64) -> AxisIdentity {
    AxisIdentity {
        name: Text::try_from(name).unwrap(),
        kind,
        force_per_lsb,
    }
}

/// A device with a two-axis model, as the page has it.
pub(crate) fn hello() -> Report {
    Report::Hello(Hello {
        protocol: 3,
        firmware: [0, 1, 0],
        occasion: Occasion::Restart,
        model: Some(ModelIdentity {
            slot: Slot::B,
            crc: 0x1234_5678,
            signed: true,
            sample_rate_hz: 1000.0,
            axes: list(&[
                axis("x", Quantity::Translation, 0.5),
                axis("phi", Quantity::Rotation, 0.25),
            ]),
        }),
        rig: Some(RigIdentity {
            crc: 0xcafe,
            sample_rate_hz: 1000.0,
            delay: 20,
            band_delay: 84,
        }),
        access: Access {
            development_key: true,
            class: Text::try_from("line7").unwrap(),
            keys: 3,
            number: 5,
            newest: 1000,
            erasures: 4,
        },
    })
}

/// The reports of the page, in the order of their tags.
pub(crate) fn reports() -> std::vec::Vec<Report> {
    let good = SensorStatus::default();
    let late = SensorStatus {
        fault: 51,
        bus_errors: 300,
        crc_errors: 2,
    };
    vec![
        hello(),
        Report::Status(Status {
            sample: 1000,
            verdict: Verdict {
                state: 2,
                cause: 32,
                axis: 0,
                channel: 0,
                permille: 1200,
            },
            outside_permille: 25,
            axes: list(&[AxisStatus {
                nmse_fast: Some(14_000),
                nmse_slow: None,
            }]),
            channels: list(&[good, good, good, good, late, good]),
            counters: Counters {
                missed_deadlines: 3,
                queue_overruns: 0,
                frames_dropped: 129,
                saturated: 0,
                link_errors: 1,
            },
            development_key: true,
        }),
        Report::Snapshot(Snapshot {
            alarm: 1,
            piece: 0,
            pieces: 32,
            first: -256,
            every: 1,
            residual: list(&[[-1, 0], [100, 0], [-70_000, 0]]),
        }),
        Report::Sample(Sample {
            sample: 1000,
            counts: list(&[[-2, 64, 0, 8_000_000, -1, 500]]),
            output: Some(SampleOutput {
                outside: 1,
                saturated: 0,
                measured: [1000, 0],
                predicted: [990, 0],
                residual: [10, 0],
                residual_band: Some([-3, 0]),
            }),
        }),
        Report::Upload(UploadReply::Accepted { next: 256 }),
        Report::Event(Event::SensorMissing { channel: 4 }),
        Report::Answer(Answer {
            to: 515,
            answered: Answered::Done,
        }),
        Report::Health(Health {
            sample: 1000,
            samples_lost: 3,
            axes: list(&[AxisHealth {
                verdict: Verdict {
                    state: 0,
                    cause: 6,
                    axis: 0,
                    channel: 0,
                    permille: 125,
                },
                judged_permille: 125,
                unjudged_samples: 7168,
            }]),
        }),
        Report::Alarm(Alarm {
            sample: 1000,
            verdict: ALARMED,
            alarms: 2,
        }),
        Report::Capture(CapturePiece {
            alarm: 1000,
            piece: 0,
            pieces: 330,
            bytes: list(&[0xe8, 0x03, 0, 0]),
        }),
        Report::Upkeep(Upkeep {
            alarm: Some(KeptAlarm {
                sample: 1000,
                verdict: ALARMED,
            }),
            supply: Supply {
                reset_below_mv: Some(2830),
                is_low: false,
            },
        }),
    ]
}

/// A header of an upload.
fn header(rig_len: u32, release: u32) -> Header {
    Header {
        rig_len,
        release,
        class: Bytes::new(*b"line7\0\0\0\0\0\0\0\0\0\0\0"),
        digest: Bytes::new(std::array::from_fn(|place| 0x40 + place as u8)),
    }
}

/// The requests of the page, in the order of their tags; the upload has one for each of its steps.
pub(crate) fn requests() -> std::vec::Vec<Request> {
    let signature = Signature::new(std::array::from_fn(|place| place as u8));
    vec![
        Request::Ping,
        Request::Hello,
        Request::Stream { every: 1 },
        Request::ResetStatistics,
        Request::Snapshot,
        Request::Upload(UploadRequest::Begin {
            header: header(4096, 1000),
            signature: Some(signature),
        }),
        Request::Upload(UploadRequest::Chunk {
            offset: 128,
            data: list(&[0x4a, 0x57, 0x00, 0x42]),
        }),
        Request::Upload(UploadRequest::Finish),
        Request::Upload(UploadRequest::Abort),
        Request::Order {
            order: Order::RollBack,
            number: 5,
            signature,
        },
        Request::Capture { piece: 7 },
    ]
}

const LONGEST_VERDICT: Verdict = Verdict {
    state: u8::MAX,
    cause: u8::MAX,
    axis: u8::MAX,
    channel: u8::MAX,
    permille: u16::MAX,
};

/// The longest of each report.
pub(crate) fn longest_reports() -> std::vec::Vec<Report> {
    let name = "a name of 16 b. ";
    let worst = SensorStatus {
        fault: u8::MAX,
        bus_errors: u32::MAX,
        crc_errors: u32::MAX,
    };
    let nmse = AxisStatus {
        nmse_fast: Some(u32::MAX),
        nmse_slow: Some(u32::MAX),
    };
    vec![
        Report::Hello(Hello {
            protocol: u16::MAX,
            firmware: [u16::MAX; 3],
            occasion: Occasion::Changed,
            model: Some(ModelIdentity {
                slot: Slot::B,
                crc: u32::MAX,
                signed: true,
                sample_rate_hz: f64::MIN,
                axes: list(&[
                    axis(name, Quantity::Rotation, f64::MIN),
                    axis(name, Quantity::Rotation, f64::MIN),
                ]),
            }),
            rig: Some(RigIdentity {
                crc: u32::MAX,
                sample_rate_hz: f64::MIN,
                delay: u16::MAX,
                band_delay: u16::MAX,
            }),
            access: Access {
                development_key: true,
                class: Text::try_from(name).unwrap(),
                keys: u8::MAX,
                number: u32::MAX,
                newest: u32::MAX,
                erasures: u32::MAX,
            },
        }),
        Report::Status(Status {
            sample: u64::MAX,
            verdict: LONGEST_VERDICT,
            outside_permille: u16::MAX,
            axes: list(&[nmse; 2]),
            channels: list(&[worst; 12]),
            counters: Counters {
                missed_deadlines: u32::MAX,
                queue_overruns: u32::MAX,
                frames_dropped: u32::MAX,
                saturated: u32::MAX,
                link_errors: u32::MAX,
            },
            development_key: true,
        }),
        Report::Snapshot(Snapshot {
            alarm: u16::MAX,
            piece: u16::MAX,
            pieces: u16::MAX,
            first: i32::MIN,
            every: u16::MAX,
            residual: list(&[[i32::MIN; 2]; SNAPSHOT_PIECE]),
        }),
        Report::Sample(Sample {
            sample: u64::MAX,
            counts: list(&[[i32::MIN; 6]; 2]),
            output: Some(SampleOutput {
                outside: u8::MAX,
                saturated: u8::MAX,
                measured: [i32::MIN; 2],
                predicted: [i32::MIN; 2],
                residual: [i32::MIN; 2],
                residual_band: Some([i32::MIN; 2]),
            }),
        }),
        Report::Upload(UploadReply::Refused(Refusal::Length {
            seen: u32::MAX,
            most: u32::MAX,
        })),
        Report::Event(Event::Verdict(LONGEST_VERDICT)),
        Report::Answer(Answer {
            to: u16::MAX,
            answered: Answered::LineTooSlow,
        }),
        Report::Health(Health {
            sample: u64::MAX,
            samples_lost: u32::MAX,
            axes: list(
                &[AxisHealth {
                    verdict: LONGEST_VERDICT,
                    judged_permille: u16::MAX,
                    unjudged_samples: u32::MAX,
                }; 2],
            ),
        }),
        Report::Alarm(Alarm {
            sample: u64::MAX,
            verdict: LONGEST_VERDICT,
            alarms: u16::MAX,
        }),
        Report::Capture(CapturePiece {
            alarm: u64::MAX,
            piece: u16::MAX,
            pieces: u16::MAX,
            bytes: list(&[1; CAPTURE_PIECE]),
        }),
        Report::Upkeep(Upkeep {
            alarm: Some(KeptAlarm {
                sample: u64::MAX,
                verdict: LONGEST_VERDICT,
            }),
            supply: Supply {
                reset_below_mv: Some(u16::MAX),
                is_low: true,
            },
        }),
    ]
}

/// The longest of each request.
pub(crate) fn longest_requests() -> std::vec::Vec<Request> {
    vec![
        Request::Stream { every: u16::MAX },
        Request::Upload(UploadRequest::Begin {
            header: header(u32::MAX, u32::MAX),
            signature: Some(Signature::new([0; 64])),
        }),
        Request::Upload(UploadRequest::Chunk {
            offset: u32::MAX,
            data: list(&[0; MAX_CHUNK]),
        }),
        Request::Order {
            order: Order::RevokeOther,
            number: u32::MAX,
            signature: Signature::new([0; 64]),
        },
        Request::Capture { piece: u16::MAX },
    ]
}

//! A million requests of somebody who has no key.

use super::alarms::{until_alarm, upkeep};
use super::{hello, ordered, proven, release, run, uploaded};
use crate::bench::Bench;
use crate::signing;
use jointwatch_shared::chain::RawSample;
use jointwatch_shared::selftest::Points;
use jointwatch_shared::selftest::network::reference_network;
use jointwatch_shared::wire::bytes::Bytes;
use jointwatch_shared::wire::slot::{Header, Order};
use jointwatch_shared::wire::telemetry::{Answered, Report, Request, Signature, UploadRequest};

const REQUESTS: u32 = 1_000_000;
/// One in so many has a signature, which takes the time of its check.
const SIGNED: u32 = 32;
const ORDERS: [Order; 3] = [Order::Restart, Order::RollBack, Order::Acknowledge];

/// A header like that of a newer release, its parts as they may be.
fn header(points: &mut Points, genuine: Header) -> Header {
    let mut word = || points.next_word();
    let mut header = genuine;
    header.release = word() as u32;
    match word() & 3 {
        0 => header.digest = Bytes::new([word() as u8; 32]),
        1 => header.rig_len = word() as u32,
        2 => header.class = Bytes::new([word() as u8; 16]),
        _ => {}
    }
    header
}

/// A request that nobody signed, or the wrong one did.
fn request(points: &mut Points, genuine: Header, stolen: Signature) -> Request {
    let number = points.next_word() as u32;
    let signature = (number.is_multiple_of(SIGNED)).then(|| match points.next_word() & 3 {
        0 => Signature::new([points.next_word() as u8; 64]),
        1 => signing::by(7, &genuine.signed_bytes()),
        // The owner's, for something else.
        _ => stolen,
    });
    match (points.next_word() & 7, signature) {
        (0, _) => Request::ResetStatistics,
        (1, _) => Request::Upload(UploadRequest::Finish),
        (2, _) => Request::Upload(UploadRequest::Abort),
        (3 | 4, _) => Request::Upload(UploadRequest::Chunk {
            offset: points.next_word() as u32 & 0x3FFF,
            data: (0..number % 129).map(|n| n as u8).collect(),
        }),
        (5, Some(signature)) => Request::Order {
            order: ORDERS[number as usize % ORDERS.len()],
            number: points.next_word() as u32 & 0xF,
            signature,
        },
        _ => Request::Upload(UploadRequest::Begin {
            header: header(points, genuine),
            signature,
        }),
    }
}

/// Sends them all, a sample of a resting joint after every tenth; how many statuses came, and how
/// often the alarm that nobody has acknowledged was told with one.
fn beset(bench: &mut Bench, genuine: Header, stolen: Signature) -> [usize; 2] {
    let mut points = Points::new(16);
    let mut told = [0; 2];
    for number in 0..REQUESTS {
        bench.ask(&request(&mut points, genuine, stolen));
        if number.is_multiple_of(10) {
            bench.sample(RawSample::default());
        }
        for report in bench.reports() {
            told[0] += usize::from(matches!(report, Report::Status(_)));
            told[1] += usize::from(matches!(report, Report::Alarm(_)));
        }
    }
    told
}

#[test]
fn a_million_requests_without_a_key_erase_nothing_hide_no_alarm_and_stop_no_upload() {
    let mut bench = proven();
    until_alarm(&mut bench);
    run(&mut bench, 1);
    let erasures = hello(&mut bench).access.erasures;
    let second = release(2, reference_network());
    let stolen = signing::by(0, b"something else that the owner signed");
    let [statuses, alarms] = beset(&mut bench, second.header(), stolen);
    assert!(
        statuses > 20 && alarms == statuses,
        "{alarms} of {statuses}"
    );
    assert_eq!(hello(&mut bench).access.erasures, erasures);
    uploaded(&mut bench, &second);
    // The alarm is kept until its owner takes it back.
    let mut bench = bench.restart();
    run(&mut bench, 11);
    assert!(upkeep(&mut bench).alarm.is_some());
    let acknowledged = ordered(&mut bench, Order::Acknowledge);
    assert_eq!(acknowledged, Answered::Done);
    assert_eq!(upkeep(&mut bench).alarm, None);
}

//! What the device holds and what goes over its line: blob, rig block, limits, seal, frames,
//! requests.

use super::bench::{Bench, Slot, content, reference_rig, signed};
use super::bytes::{line, pieces, repaired};
use jointwatch::device::live::LiveView;
use jointwatch::device::telemetry::listen::{Heard, Listener};
use jointwatch::device::telemetry::words::Reader;
use jointwatch_shared::chain::{Chain, ChainState, RawSample};
use jointwatch_shared::monitor::{Faults, Monitor, MonitorState};
use jointwatch_shared::selftest::network::reference_network;
use jointwatch_shared::selftest::{Points, reference_model};
use jointwatch_shared::wire::capture::{CHUNK, unpack};
use jointwatch_shared::wire::slot::{ENTRY_LEN, Entry, SEAL_LEN, SEAL_OFFSET, Seal};
use jointwatch_shared::wire::telemetry::{
    MAX_CHUNK, MAX_FRAME, Message, Report, Request, UploadRequest,
};
use jointwatch_shared::wire::{blob, rig_block};
use std::cell::RefCell;
use std::sync::LazyLock;
use std::time::Duration;

/// Samples that go through a chain that was accepted: past its filters.
const SAMPLES: usize = 200;
/// Inputs after which the device of the requests begins anew: each start takes memory for good.
const RESTART_AFTER: usize = 2000;

/// Counts of any size.
fn samples() -> impl Iterator<Item = RawSample> {
    let mut points = Points::new(5);
    (0..SAMPLES).map(move |_| {
        let mut sample = RawSample::default();
        for axis in &mut sample {
            let mut word = || points.next_word();
            axis.displacement = [word(), word()];
            (axis.body, axis.acceleration, axis.force) = (word(), word(), word());
        }
        sample
    })
}

/// The blobs of the reference models.
pub(super) fn blobs() -> Vec<Vec<u8>> {
    [reference_model(), reference_network()]
        .map(|model| blob::encode(model).to_vec())
        .to_vec()
}

/// Reads a blob, as it is and with its checksum repaired, and runs the model that it holds.
pub(super) fn blob(bytes: &[u8]) {
    for bytes in [bytes, &repaired(bytes)] {
        let Ok(model) = blob::decode(bytes) else {
            continue;
        };
        assert_eq!(blob::encode(&model)[..], *bytes);
        let mut rig = reference_rig(&model, None);
        rig.axes.truncate(model.axes());
        if let Ok(chain) = Chain::new(&model, &rig) {
            let mut state = ChainState::default();
            for raw in samples() {
                chain.step(&mut state, &model, &raw);
            }
        }
    }
}

/// A rig block with limits and one without.
pub(super) fn rig_blocks() -> Vec<Vec<u8>> {
    let rigs = [None, Some(7)].map(|limits| reference_rig(reference_model(), limits));
    let encoded = |rig| rig_block::encode(&rig).expect("a sound block").to_vec();
    rigs.map(encoded).to_vec()
}

/// Reads a rig block, as it is and with its checksum repaired, and runs the chain and the monitor
/// that it describes.
pub(super) fn rig_block(bytes: &[u8]) {
    for bytes in [bytes, &repaired(bytes)] {
        let _ = rig_block::model_checksum(bytes);
        let Ok(rig) = rig_block::decode(bytes) else {
            continue;
        };
        assert_eq!(rig_block::encode(&rig).expect("what was read")[..], *bytes);
        jointwatch::device::rig_block::in_words(&rig);
        jointwatch::device::rig_block::as_json(&rig);
        let Ok(chain) = Chain::new(reference_model(), &rig) else {
            continue;
        };
        let limits = rig.limits.clone();
        let monitor = limits.and_then(|limits| Monitor::new(limits, &chain).ok());
        let (mut state, mut watch) = (ChainState::default(), MonitorState::default());
        for raw in samples() {
            let output = chain.step(&mut state, reference_model(), &raw);
            if let Some(monitor) = &monitor {
                monitor.update(&mut watch, &raw, output.as_ref(), &Faults::default());
            }
        }
    }
}

/// The limits alone: bytes in the place of a sound block's, behind which they stand.
pub(super) fn limits(bytes: &[u8]) {
    static SOUND: LazyLock<Vec<Vec<u8>>> = LazyLock::new(rig_blocks);
    let [without, with] = &SOUND[..] else { return };
    let differs = without.iter().zip(with).position(|(a, b)| a != b);
    let place = differs.unwrap_or_default();
    let mut block = with.clone();
    let end = block.len() - 4;
    let taken = &bytes[place.min(bytes.len())..];
    let length = taken.len().min(end - place);
    block[place..place + length].copy_from_slice(&taken[..length]);
    rig_block(&block);
}

/// A signed slot of the reference model to begin with.
pub(super) fn slots() -> Vec<Vec<u8>> {
    let rig = reference_rig(reference_model(), Some(7));
    let slot = signed(reference_model(), Some(&rig));
    let Slot::Bytes(bytes) = slot else {
        return Vec::new();
    };
    vec![bytes[..jointwatch_shared::wire::slot::SLOT_LEN].to_vec()]
}

/// Reads a seal and an entry of the journal, as they are and with their checksum repaired.
pub(super) fn seal(bytes: &[u8]) {
    let place = if bytes.len() > SEAL_OFFSET {
        SEAL_OFFSET
    } else {
        0
    };
    if let Some(seal) = bytes[place..].first_chunk::<SEAL_LEN>() {
        for seal in [&seal[..], &repaired(seal)] {
            let seal: &[u8; SEAL_LEN] = seal.try_into().expect("as long");
            if let Ok(read) = Seal::decode(seal) {
                assert_eq!(&read.encode(), seal);
            }
        }
    }
    if let Some(entry) = bytes.first_chunk::<ENTRY_LEN>()
        && let Some(read) = Entry::decode(entry)
    {
        // Of bytes that say nothing when there is no alarm, none is kept.
        assert_eq!(Entry::decode(&read.encode()), Some(read));
    }
}

/// Chunks of counts: two samples of two axes, and no bits behind them.
pub(super) fn chunks() -> Vec<Vec<u8>> {
    let head = [&[0; 8][..], &[2, 0, 2, 0]].concat();
    let channel = [&[9, 0, 0, 0, 1, 0, 0, 0][..], &[4]].concat();
    let mut chunk = [head, channel.repeat(10)].concat();
    chunk.resize(CHUNK, 0x5A);
    vec![chunk]
}

/// Unpacks a chunk of counts.
pub(super) fn capture(bytes: &[u8]) {
    let mut shown = 0_usize;
    let contents = unpack(bytes, |_| shown += 1);
    if let Some(contents) = contents {
        assert_eq!(shown, usize::from(contents.samples));
    }
}

fn payload<M: Message>(message: &M, sequence: u16) -> Vec<u8> {
    let mut place = [0; MAX_FRAME];
    let fields = message.write(&mut place).expect("it fits");
    [&[message.tag()][..], &sequence.to_le_bytes(), fields].concat()
}

/// What a device says that is asked everything.
pub(super) fn reports() -> Vec<Vec<u8>> {
    let mut bench = Bench::start([signed(reference_model(), None), Slot::Empty]);
    bench.ask(&Request::Stream { every: 40 });
    samples().for_each(|raw| bench.sample(raw));
    for request in plain_requests() {
        bench.ask(&request);
    }
    let reports = bench.reports();
    let numbered = (0..).zip(&reports);
    let payloads: Vec<Vec<u8>> = numbered
        .map(|(n, report): (u16, &Report)| payload(report, n))
        .collect();
    payloads.chunks(4).map(pieces).collect()
}

/// Listens to a line with these frames, tells every message in words, and shows them.
pub(super) fn telemetry(bytes: &[u8]) {
    let (mut listener, mut reader) = (Listener::default(), Reader::default());
    let mut view = LiveView::new("line");
    for (second, part) in line(bytes).chunks(256).enumerate() {
        let heard = listener.hear(part);
        for heard in &heard {
            if let Heard::Message(received) = heard {
                let words = reader.line(&received.message);
                assert!(!words.contains('\n'), "{words}");
                serde_json::to_string(&received.message).expect("JSON");
            }
        }
        let now = Duration::from_secs(second as u64);
        view.hear(&heard, listener.tally(), now);
        view.picture(now);
    }
}

fn plain_requests() -> Vec<Request> {
    vec![
        Request::Ping,
        Request::Hello,
        Request::Stream { every: 3 },
        Request::ResetStatistics,
        Request::Snapshot,
        Request::Capture { piece: 0 },
    ]
}

/// Every request, and a whole upload of a signed model.
pub(super) fn asked() -> Vec<Vec<u8>> {
    let slot = signed(reference_network(), None);
    let content = content(&slot);
    let chunk = |(number, bytes): (usize, &[u8])| UploadRequest::Chunk {
        offset: (number * MAX_CHUNK) as u32,
        data: bytes.iter().copied().collect(),
    };
    let begin = UploadRequest::Begin {
        header: slot.header(),
        signature: slot.signature(),
    };
    let chunks = content.chunks(MAX_CHUNK).enumerate().map(chunk);
    let upload = [begin]
        .into_iter()
        .chain(chunks)
        .chain([UploadRequest::Finish]);
    let upload: Vec<Request> = upload.map(Request::Upload).collect();
    let order = super::signing::order(0, jointwatch_shared::wire::slot::Order::Acknowledge, 1);
    let rest = vec![Request::Upload(UploadRequest::Abort), order];
    let all = [plain_requests(), upload, rest];
    let payloads = |requests: &Vec<Request>| {
        let numbered = (0..).zip(requests);
        let payloads: Vec<Vec<u8>> = numbered.map(|(n, request)| payload(request, n)).collect();
        pieces(&payloads)
    };
    all.iter().map(payloads).collect()
}

thread_local! {
    static DEVICE: RefCell<(usize, Option<Bench>)> = const { RefCell::new((0, None)) };
}

/// Sends these frames to a device with a model in one slot, which has to answer in sound frames
/// only.
pub(super) fn requests(bytes: &[u8]) {
    DEVICE.with_borrow_mut(|(inputs, device)| {
        if inputs.is_multiple_of(RESTART_AFTER) {
            *device = None;
        }
        *inputs += 1;
        let start = || Bench::start([signed(reference_model(), None), Slot::Empty]);
        let device = device.get_or_insert_with(start);
        for byte in line(bytes) {
            device.receive(byte);
        }
        device.work();
        device.reports();
    });
}

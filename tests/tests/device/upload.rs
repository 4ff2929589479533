//! A signed model over a line that loses and damages bytes, from the host's upload to the
//! firmware's own slots.

#[path = "../../../firmware/tests/firmware/flash.rs"]
mod flash;

use jointwatch::device::order::give;
use jointwatch::device::signing::{PrivateKey, SignedModel, Stamp};
use jointwatch::device::upload::{Patience, Uploaded, upload};
use jointwatch::text::error::Error;
use jointwatch_firmware::key::{IS_DEVELOPMENT_KEY, PUBLIC_KEY};
use jointwatch_firmware::store::{Key, SlotName, Store, Trust, Upload};
use jointwatch_shared::selftest::{chain, reference_model};
use jointwatch_shared::wire::blob::{self, BLOB_LEN};
use jointwatch_shared::wire::rig::Rig;
use jointwatch_shared::wire::rig_block::{self, RIG_BLOCK_LEN};
use jointwatch_shared::wire::slot::Order;
use jointwatch_shared::wire::telemetry::{
    Access, Answer, Answered, Decoder, Hello, KeptAlarm, MAX_FRAME, Occasion, PROTOCOL_VERSION,
    Report, Request, Verdict, encode,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;
use std::io::{Read, Result, Write};
use std::time::Duration;

/// A sector of the device's flash, which holds a slot.
const SECTOR: usize = 128 * 1024;

type Flash = flash::Flash<SECTOR>;

/// The device behind its line: what is written to it is heard, answered, and both ways suffer.
struct Device {
    store: Store<Flash, Key>,
    upload: Upload,
    decoder: Decoder<Request>,
    answers: VecDeque<u8>,
    noise: ChaCha8Rng,
    /// Probabilities that a write is lost, and that a bit is wrong.
    loss: f64,
    bit_errors: f64,
    /// After so many more requests the device restarts.
    restart_after: Option<u32>,
    sequence: u16,
    carried_out: u32,
    /// The next order does not arrive, and the device remembers something else meanwhile.
    loses_order: bool,
}

fn trust(key: [u8; 32]) -> Trust<Key> {
    Trust {
        keys: [Some(Key::new(key)), None],
        class: [0; 16],
        unsigned: false,
    }
}

impl Device {
    fn new(loss: f64, bit_errors: f64, seed: u64) -> Self {
        println!("seed {seed}");
        let mut store = Store::new(Flash::new(vec![0xFF; 2 * SECTOR]), trust(PUBLIC_KEY));
        assert!(store.start(&mut [0; BLOB_LEN]).model.is_none());
        Self {
            store,
            upload: Upload::new(),
            decoder: Decoder::default(),
            answers: VecDeque::new(),
            noise: ChaCha8Rng::seed_from_u64(seed),
            loss,
            bit_errors,
            restart_after: None,
            sequence: 0,
            carried_out: 0,
            loses_order: false,
        }
    }

    fn hello(&mut self) -> Report {
        Report::Hello(Hello {
            protocol: PROTOCOL_VERSION,
            firmware: [0; 3],
            occasion: Occasion::Asked,
            model: None,
            rig: None,
            access: Access {
                number: self.store.standing().unwrap().number,
                keys: self.store.trusted(),
                ..Access::default()
            },
        })
    }

    fn restart(&mut self) -> Option<SlotName> {
        let flash = std::mem::replace(
            &mut self.store,
            Store::new(Flash::new(Vec::new()), trust(PUBLIC_KEY)),
        )
        .into_flash();
        self.store = Store::new(flash, trust(PUBLIC_KEY));
        self.upload = Upload::new();
        self.store
            .start(&mut [0; BLOB_LEN])
            .model
            .map(|(place, model)| {
                assert_eq!(&model, reference_model());
                place
            })
    }

    fn damaged(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        if self.bit_errors > 0.0 {
            for byte in &mut bytes {
                for bit in 0..8 {
                    *byte ^= u8::from(self.noise.random_bool(self.bit_errors)) << bit;
                }
            }
        }
        if self.noise.random_bool(self.loss) {
            bytes.clear();
        }
        bytes
    }
}

impl Write for Device {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        for byte in self.damaged(bytes) {
            let Some(Ok(frame)) = self.decoder.push(byte) else {
                continue;
            };
            if let Some(left) = &mut self.restart_after {
                *left = left.saturating_sub(1);
                if *left == 0 {
                    self.restart_after = None;
                    self.restart();
                    continue;
                }
            }
            let report = match frame.message {
                Request::Upload(step) => {
                    let reply = self.upload.step(&mut self.store, &step, &mut [0; BLOB_LEN]);
                    Report::Upload(reply)
                }
                Request::Hello => self.hello(),
                Request::Order { .. } if std::mem::take(&mut self.loses_order) => {
                    self.store
                        .keep_alarm(KeptAlarm {
                            sample: 0,
                            verdict: Verdict::default(),
                        })
                        .unwrap();
                    continue;
                }
                Request::Order {
                    order,
                    number,
                    signature,
                } => {
                    let mut work = [0; BLOB_LEN];
                    let signature = signature.bytes();
                    let outcome = self.store.order(order, number, &signature, &mut work);
                    self.carried_out += u32::from(outcome.is_ok());
                    let answered = outcome.err().unwrap_or(Answered::Done);
                    let to = frame.sequence;
                    Report::Answer(Answer { to, answered })
                }
                _ => continue,
            };
            let mut room = [0; MAX_FRAME];
            let answer = encode(&report, self.sequence, &mut room).unwrap().to_vec();
            self.sequence = self.sequence.wrapping_add(1);
            let answer = self.damaged(&answer);
            self.answers.extend(answer);
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

impl Read for Device {
    fn read(&mut self, into: &mut [u8]) -> Result<usize> {
        self.answers.read(into)
    }
}

fn patience() -> Patience {
    Patience {
        silent_reads: 2,
        silent_reads_at_work: 2,
        longest: Duration::from_secs(600),
        tries: 100,
        beginnings: 3,
    }
}

fn send(device: &mut Device, model: &SignedModel) -> std::result::Result<Uploaded, Error> {
    upload(device, model, patience(), |_| ())
}

/// The rig block of the model that is sent.
fn rig() -> [u8; RIG_BLOCK_LEN] {
    let rig = chain::reference_rig(chain::SHORT_TAPS).unwrap();
    rig_block::encode(&Rig {
        model_checksum: blob::checksum_of(reference_model()),
        ..rig
    })
    .unwrap()
}

fn signed() -> SignedModel {
    SignedModel::sign(
        &blob::encode(reference_model()),
        &rig(),
        &PrivateKey::development(),
        &Stamp::default(),
    )
    .unwrap()
}

#[test]
fn a_good_model_arrives_over_good_and_bad_lines_and_runs_on_trial() {
    const {
        assert!(
            IS_DEVELOPMENT_KEY,
            "tests are built with the development key"
        )
    };
    for (loss, bit_errors, seed) in [
        (0.0, 0.0, 1),
        (0.1, 0.0, 2),
        (0.3, 0.0, 3),
        (0.0, 1e-4, 4),
        (0.05, 5e-4, 5),
    ] {
        let mut device = Device::new(loss, bit_errors, seed);
        let done = send(&mut device, &signed()).unwrap();
        assert_eq!(done.bytes, 4096 + 4096);
        assert_eq!(done.repeated == 0, loss + bit_errors == 0.0, "{done:?}");
        println!(
            "loss {loss}, bit errors {bit_errors}: {} requests sent again",
            done.repeated
        );
        assert_eq!(device.restart(), Some(SlotName::A));
        let mut block = [0; RIG_BLOCK_LEN];
        assert_eq!(device.store.rig(4096, &mut block), Some(&rig()[..]));
    }
}

#[test]
fn an_upload_that_was_left_goes_on_and_one_that_a_restart_broke_begins_anew() {
    let mut device = Device::new(0.0, 0.0, 6);
    let give_up = Patience {
        tries: 1,
        ..patience()
    };
    // The line goes silent in the middle.
    let mut steps = 0;
    device.restart_after = None;
    let model = signed();
    struct Cut<'a>(&'a mut Device, u32);
    impl Write for Cut<'_> {
        fn write(&mut self, bytes: &[u8]) -> Result<usize> {
            self.1 = self.1.saturating_sub(1);
            if self.1 == 0 {
                Ok(bytes.len())
            } else {
                self.0.write(bytes)
            }
        }
        fn flush(&mut self) -> Result<()> {
            Ok(())
        }
    }
    impl Read for Cut<'_> {
        fn read(&mut self, into: &mut [u8]) -> Result<usize> {
            self.0.read(into)
        }
    }
    let why = upload(&mut Cut(&mut device, 12), &model, give_up, |_| steps += 1).unwrap_err();
    assert!(
        why.exit_code() == 1 && why.sentence.contains("did not answer"),
        "{why}"
    );
    assert_eq!(steps, 11);
    assert_eq!(send(&mut device, &model).unwrap().went_on_at, 1280);

    let mut device = Device::new(0.0, 0.0, 7);
    device.restart_after = Some(20);
    assert_eq!(send(&mut device, &model).unwrap().went_on_at, 0);
    assert_eq!(device.restart(), Some(SlotName::A));
}

#[test]
fn what_the_device_refuses_is_said_in_a_sentence_and_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.signed");
    let model = blob::encode(reference_model());
    let refused = |model: &SignedModel, wanted: &str| {
        let mut device = Device::new(0.0, 0.0, 8);
        let why = send(&mut device, model).unwrap_err();
        assert!(
            why.exit_code() == 3 && why.sentence.contains(wanted),
            "{why}"
        );
        assert_eq!(device.restart(), None);
    };
    refused(
        &SignedModel::unsigned(&model, &[], &Stamp::default()).unwrap(),
        "sign it first",
    );
    let stranger = PrivateKey::generate().unwrap();
    refused(
        &SignedModel::sign(&model, &[], &stranger, &Stamp::default()).unwrap(),
        "signature is not by the key",
    );

    // What the host itself refuses to send.
    let bytes = signed().to_bytes();
    let mut corrupt = bytes.clone();
    corrupt[1000] ^= 1;
    let oversized = [&bytes[..], &[0; 4]].concat();
    for (bytes, wanted) in [
        (corrupt, "checksum"),
        (oversized, "8452"),
        (model.to_vec(), "nobody signed"),
    ] {
        std::fs::write(&path, bytes).unwrap();
        let why = SignedModel::read(&path).unwrap_err();
        assert!(
            why.exit_code() == 3 && why.sentence.contains(wanted),
            "{why}"
        );
    }
}

/// A host that checks nothing: what the device itself says to bytes that no honest host sends.
#[test]
fn the_device_does_not_rely_on_the_host() {
    use jointwatch::device::signing::content_digest;
    use jointwatch_shared::wire::bytes::Bytes;
    use jointwatch_shared::wire::slot::Header;
    use jointwatch_shared::wire::telemetry::{
        ModelFault, Refusal, Signature, UploadReply, UploadRequest as Ask,
    };
    let work = &mut [0; BLOB_LEN];
    let begin = |rig_len: usize, digest: [u8; 32], release: u32| {
        let header = Header {
            rig_len: rig_len as u32,
            release,
            class: Bytes::new([0; 16]),
            digest: Bytes::new(digest),
        };
        let signature = PrivateKey::development().sign(&header.signed_bytes());
        Ask::Begin {
            header,
            signature: Some(Signature::new(signature)),
        }
    };
    let outcome = |content: &[u8], announced: [u8; 32]| {
        let mut device = Device::new(0.0, 0.0, 9);
        let mut step = |ask| {
            device
                .upload
                .step(&mut device.store, &ask, &mut [0; BLOB_LEN])
        };
        let mut reply = step(begin(content.len() - 4096, announced, 1));
        for (number, data) in content.chunks(128).enumerate() {
            if let UploadReply::Accepted { .. } = reply {
                let data = data.iter().copied().collect();
                reply = step(Ask::Chunk {
                    offset: number as u32 * 128,
                    data,
                });
            }
        }
        if let UploadReply::Accepted { .. } = reply {
            reply = step(Ask::Finish);
        }
        assert!(device.restart().is_none());
        reply
    };
    let good = blob::encode(reference_model());
    let mut corrupt = good;
    corrupt[7] ^= 64;
    let [a, b, c, d, ..] = content_digest(&corrupt);
    let seen = u32::from_be_bytes([a, b, c, d]);
    assert_eq!(
        outcome(&corrupt, content_digest(&good)),
        UploadReply::Refused(Refusal::Checksum { seen })
    );
    // Signed all the same: the model's own checks are asked as well.
    let fault = Refusal::Model(ModelFault::Checksum);
    assert_eq!(
        outcome(&corrupt, content_digest(&corrupt)),
        UploadReply::Refused(fault)
    );
    let mut newer = good;
    newer[4] = jointwatch_shared::wire::blob::BLOB_VERSION as u8 + 1;
    let fault = Refusal::Model(ModelFault::Version);
    assert_eq!(
        outcome(&newer, content_digest(&newer)),
        UploadReply::Refused(fault)
    );
    let long = [0; 8196];
    let length = Refusal::Length {
        seen: 8196,
        most: 8192,
    };
    assert_eq!(
        outcome(&long, content_digest(&long)),
        UploadReply::Refused(length)
    );

    let mut device = Device::new(0.0, 0.0, 10);
    let mut step = |ask| device.upload.step(&mut device.store, &ask, work);
    let chunk = |offset, length| Ask::Chunk {
        offset,
        data: (0..length).collect(),
    };
    assert_eq!(step(chunk(0, 8)), UploadReply::Refused(Refusal::NotBegun));
    assert_eq!(step(Ask::Finish), UploadReply::Refused(Refusal::NotBegun));
    let begin = || begin(0, [7; 32], 1);
    assert_eq!(step(begin()), UploadReply::Accepted { next: 0 });
    assert_eq!(step(chunk(0, 7)), UploadReply::Accepted { next: 4 });
    assert_eq!(
        step(chunk(8, 4)),
        UploadReply::Refused(Refusal::WrongOffset { next: 4 })
    );
    assert_eq!(step(chunk(4, 3)), UploadReply::Refused(Refusal::EmptyChunk));
    assert_eq!(step(chunk(0, 4)), UploadReply::Accepted { next: 4 });
    assert_eq!(step(begin()), UploadReply::Accepted { next: 4 });
    assert_eq!(
        step(Ask::Finish),
        UploadReply::Refused(Refusal::Incomplete { seen: 4 })
    );
    assert_eq!(step(begin()), UploadReply::Accepted { next: 0 });
    assert_eq!(
        step(chunk(u32::MAX, 8)),
        UploadReply::Refused(Refusal::BeyondEnd)
    );
    assert_eq!(step(begin()), UploadReply::Accepted { next: 0 });
    assert_eq!(
        step(chunk(4092, 8)),
        UploadReply::Refused(Refusal::BeyondEnd)
    );
    assert_eq!(step(Ask::Abort), UploadReply::Aborted);
}

#[test]
fn an_order_is_carried_out_once_over_good_and_bad_lines_and_only_when_its_owner_signs() {
    let owner = PrivateKey::development();
    for (loss, seed) in [(0.0, 21), (0.2, 22), (0.2, 23)] {
        let mut device = Device::new(loss, 0.0, seed);
        for times in 1..=2 {
            give(&mut device, Order::Restart, &owner).unwrap();
            assert_eq!(device.carried_out, times);
        }
    }
    let mut device = Device::new(0.0, 0.0, 24);
    let stranger = PrivateKey::generate().unwrap();
    let refused = give(&mut device, Order::Restart, &stranger).unwrap_err();
    assert!(
        refused.sentence.contains("does not trust this key"),
        "{refused}"
    );
    let nothing = give(&mut device, Order::RollBack, &owner).unwrap_err();
    assert!(
        nothing.sentence.contains("holds no other model"),
        "{nothing}"
    );
    assert_eq!(device.carried_out, 0);
    let mut silent = Device::new(1.0, 0.0, 25);
    let gone = give(&mut silent, Order::Restart, &owner).unwrap_err();
    assert!(gone.sentence.contains("did not answer"), "{gone}");
}

#[test]
fn a_key_counts_as_revoked_only_when_the_device_says_that_it_is() {
    let owner = PrivateKey::development();
    let mut device = Device::new(0.0, 0.0, 26);
    let other = PrivateKey::generate().unwrap();
    let trust = Trust {
        keys: [PUBLIC_KEY, other.public()].map(|key| Some(Key::new(key))),
        ..trust(PUBLIC_KEY)
    };
    device.store = Store::new(Flash::new(vec![0xFF; 2 * SECTOR]), trust);
    device.store.start(&mut [0; BLOB_LEN]);
    device.loses_order = true;
    give(&mut device, Order::RevokeOther, &owner).unwrap();
    assert_eq!((device.carried_out, device.store.trusted()), (1, 0b01));
}

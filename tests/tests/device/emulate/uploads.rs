//! Models that are uploaded, and slots that hold none that may run.

use super::subject::{polynomial, run, run_with, said, same_bits, subject};
use jointwatch::device::rig_block;
use jointwatch::device::signing::content_digest;
use jointwatch::device::signing::{PrivateKey, SignedModel, Stamp};
use jointwatch::device::upload::Patience;
use jointwatch::emulate::bench::Scenario;
use jointwatch::emulate::device::EmulatedDevice;
use jointwatch::emulate::line::{Talk, Uploading};
use jointwatch::text::error::Error;
use jointwatch_shared::monitor::Cause;
use jointwatch_shared::wire::blob;
use jointwatch_shared::wire::bytes::Bytes;
use jointwatch_shared::wire::rig::Rig;
use jointwatch_shared::wire::slot::Header;
use jointwatch_shared::wire::telemetry::{
    Decoder, Event, MAX_FRAME, Report, Request, Restart, Signature, UploadReply,
    UploadRequest as Ask, encode,
};
use std::io::{Read, Write};
use std::time::Duration;

fn patience() -> Patience {
    Patience {
        silent_reads: 100,
        silent_reads_at_work: 400,
        longest: Duration::from_secs(20),
        tries: 30,
        beginnings: 3,
    }
}

/// The same rig with the other model on it.
fn other_block(device: &EmulatedDevice<'_>) -> Rig {
    Rig {
        model_checksum: blob::checksum_of(&subject().physical),
        ..device.block.clone()
    }
}

/// The other model for the same rig, signed.
fn other(device: &EmulatedDevice<'_>) -> SignedModel {
    let rig = rig_block::encode(&other_block(device)).unwrap();
    let model = blob::encode(&subject().physical);
    SignedModel::sign(&model, &rig, &PrivateKey::development(), &Stamp::default()).unwrap()
}

fn uploading(model: SignedModel) -> Scenario {
    Scenario {
        talk: Some((200, Uploading::of(model, patience()))),
        // Checked, activated, a restart a second later, and some time with the new model.
        linger: 6000,
        ..Scenario::default()
    }
}

#[test]
fn a_good_model_is_uploaded_and_runs_after_the_restart() {
    let device = polynomial();
    let successor = EmulatedDevice::new(
        &subject().simulation.study,
        &subject().physical,
        Some(other_block(&device)),
    )
    .unwrap();
    let slot = device.slot().unwrap().to_bytes();
    let run = run_with(
        &device,
        &slot,
        &[successor.known()],
        uploading(other(&device)),
    );
    let uploaded = run.uploaded.as_ref().expect("it has ended");
    assert!(uploaded.is_ok(), "{uploaded:?}");
    same_bits(&run);
    assert!(run.said.hellos.len() > 1, "{:?}", run.said.hellos);
    let crc = run
        .said
        .hellos
        .last()
        .and_then(|h| h.model.as_ref())
        .unwrap()
        .crc;
    assert_eq!(crc, successor.known().crc);
}

#[test]
fn a_restart_in_the_middle_of_an_upload_leaves_the_old_model_and_the_upload_begins_anew() {
    let device = polynomial();
    let slot = device.slot().unwrap().to_bytes();
    let successor = EmulatedDevice::new(
        &subject().simulation.study,
        &subject().physical,
        Some(other_block(&device)),
    )
    .unwrap();
    let mut scenario = uploading(other(&device));
    scenario.restart_after_replies = Some(20);
    let run = run_with(&device, &slot, &[successor.known()], scenario);
    same_bits(&run);
    let crcs: Vec<_> = run
        .said
        .hellos
        .iter()
        .map(|hello| hello.model.as_ref().map(|model| model.crc))
        .collect();
    // The old one, the old one after the restart, the new one after its upload.
    let [old, new] = [device.known().crc, successor.known().crc];
    assert_eq!(crcs[..2], [Some(old), Some(old)], "{crcs:?}");
    assert_eq!(crcs.last(), Some(&Some(new)), "{crcs:?}");
    let software = Event::Started {
        why: Restart::Software,
    };
    assert!(run.said.events.contains(&software), "{:?}", run.said.events);
    assert!(run.uploaded.expect("it has ended").is_ok());
}

#[test]
fn what_must_not_run_is_refused_and_the_old_model_goes_on() {
    let device = polynomial();
    let rig = rig_block::encode(&device.block).unwrap();
    let model = blob::encode(&subject().physical);
    let stranger = PrivateKey::generate().unwrap();
    for (bad, wanted) in [
        (
            SignedModel::unsigned(&model, &rig, &Stamp::default()).unwrap(),
            "sign it first",
        ),
        (
            SignedModel::sign(&model, &rig, &stranger, &Stamp::default()).unwrap(),
            "signature is not by the key",
        ),
    ] {
        let mut scenario = uploading(bad);
        scenario.linger = 500;
        let run = run(&device, scenario);
        let why: Error = run.uploaded.as_ref().unwrap().clone().unwrap_err();
        assert!(why.sentence.contains(wanted), "{why}");
        same_bits(&run);
        assert_eq!(run.said.hellos.len(), 1, "no restart");
    }
}

#[test]
fn a_slot_that_holds_no_usable_model_leaves_raw_counts_and_a_named_reason() {
    let device = polynomial();
    let good = device.slot().unwrap().to_bytes();
    let mut damaged = good.clone();
    damaged[1000] ^= 1;
    let rig = rig_block::encode(&device.block).unwrap();
    let unsigned = SignedModel::unsigned(
        &blob::encode(&subject().polynomial),
        &rig,
        &Stamp::default(),
    )
    .unwrap();
    let short = Scenario::default;
    for slot in [vec![0xFF; 8448], damaged, unsigned.to_bytes()] {
        let run = run_with(&device, &slot, &[], short());
        assert!(
            run.said.events.contains(&Event::NoModel),
            "{:?}",
            run.said.events
        );
        assert!(said(&run, Cause::NoModel));
        assert_eq!(run.comparison.outputs, 0);
        assert_eq!(run.comparison.samples, run.instants, "sensors are reported");
    }
}

/// A host that checks nothing before it sends: announces `digest`, well signed, and sends the
/// bytes.
fn forged(content: Vec<u8>, digest: [u8; 32]) -> Talk {
    Box::new(move |wire| {
        let header = Header {
            rig_len: content.len().saturating_sub(4096) as u32,
            release: 1,
            class: Bytes::new([0; 16]),
            digest: Bytes::new(digest),
        };
        let signature = PrivateKey::development().sign(&header.signed_bytes());
        let mut decoder = Decoder::<Report>::default();
        let mut sequence = 0;
        let mut ask = |step: Ask| -> Result<UploadReply, Error> {
            let broken = |why: std::io::Error| Error::failed(why.to_string());
            let mut place = [0; MAX_FRAME];
            let frame = encode(&Request::Upload(step), sequence, &mut place).expect("it fits");
            sequence += 1;
            wire.write_all(frame).map_err(broken)?;
            for _ in 0..2000 {
                let mut bytes = [0; 256];
                let count = wire.read(&mut bytes).map_err(broken)?;
                for &byte in &bytes[..count] {
                    if let Some(Ok(frame)) = decoder.push(byte)
                        && let Report::Upload(reply) = frame.message
                    {
                        return Ok(reply);
                    }
                }
            }
            Err(Error::failed("no answer"))
        };
        let mut reply = ask(Ask::Begin {
            header,
            signature: Some(Signature::new(signature)),
        })?;
        for (number, data) in content.chunks(128).enumerate() {
            if let UploadReply::Accepted { .. } = reply {
                reply = ask(Ask::Chunk {
                    offset: number as u32 * 128,
                    data: data.iter().copied().collect(),
                })?;
            }
        }
        if let UploadReply::Accepted { .. } = reply {
            reply = ask(Ask::Finish)?;
        }
        Err(Error::data(format!("{reply:?}")))
    })
}

#[test]
fn what_no_honest_host_sends_is_refused_by_the_device_itself() {
    let device = polynomial();
    let good = blob::encode(&subject().physical).to_vec();
    let mut corrupt = good.clone();
    corrupt[7] ^= 64;
    let mut newer = good.clone();
    newer[4] = jointwatch_shared::wire::blob::BLOB_VERSION as u8 + 1;
    let long = vec![0; 8196];
    for (content, announced, wanted) in [
        (corrupt.clone(), content_digest(&good), "Checksum"),
        (corrupt.clone(), content_digest(&corrupt), "Model(Checksum)"),
        (newer.clone(), content_digest(&newer), "Model(Version)"),
        (long.clone(), content_digest(&long), "Length"),
    ] {
        let run = run(
            &device,
            Scenario {
                talk: Some((200, forged(content, announced))),
                linger: 500,
                ..Scenario::default()
            },
        );
        let why = run.uploaded.as_ref().unwrap().clone().unwrap_err();
        assert!(
            why.sentence.contains("Refused") && why.sentence.contains(wanted),
            "{wanted}: {why}"
        );
        same_bits(&run);
        assert_eq!(run.said.hellos.len(), 1, "no restart");
    }
}

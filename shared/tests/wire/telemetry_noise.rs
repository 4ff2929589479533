//! Frames on a line that flips bits, loses bytes and carries nonsense: no wrong message, and the
//! next good one is read.

use super::telemetry_frames::{decode, frame, hello, messages, reports, requests};
use jointwatch_shared::wire::telemetry::{Decoder, Message, Received, Report, Request};
use proptest::prelude::*;

/// Steele, Lea, Flood, "Fast splittable pseudorandom number generators" (2014): enough for noise.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// True with this probability.
    fn happens(&mut self, probability: f64) -> bool {
        (self.next() >> 11) as f64 * (-53_f64).exp2() < probability
    }

    /// A byte with each of its bits flipped with this probability.
    fn through(&mut self, byte: u8, bit_error_rate: f64) -> u8 {
        (0..8).fold(byte, |byte, bit| {
            byte ^ u8::from(self.happens(bit_error_rate)) << bit
        })
    }
}

/// Frames that were sent over a line with flipped bits and, now and then, lost bytes.
#[test]
fn no_wrong_message_comes_out_of_a_hundred_thousand_noisy_frames() {
    let (seed, per_rate) = (20_261_121, 25_000);
    println!("seed {seed}");
    for (number, rate) in [1e-3, 3e-3, 1e-2, 1e-1].into_iter().enumerate() {
        let mut noise = Noise(seed + number as u64);
        let mut decoder = Decoder::<Report>::default();
        let (all, mut read, mut flipped) = (reports(), 0, 0);
        // What was sent is known by its number; nothing older may come out.
        let mut newest = None;
        for sent in 0..per_rate {
            let message = &all[sent % all.len()];
            for byte in frame(message, sent as u16) {
                let arrived = noise.through(byte, rate);
                flipped += usize::from(arrived != byte);
                if noise.happens(rate / 10.0) {
                    continue;
                }
                if let Some(Ok(Received { sequence, message })) = decoder.push(arrived) {
                    let age = (sent as u16).wrapping_sub(sequence);
                    let original = sent - usize::from(age);
                    assert_eq!(message, all[original % all.len()], "rate {rate}");
                    assert!(age <= 1, "a message came out {age} frames late");
                    assert!(Some(original) > newest, "a message came out twice");
                    newest = Some(original);
                    read += 1;
                }
            }
        }
        let counts = decoder.counts();
        println!(
            "bit error rate {rate:.0e}: {read} of {per_rate} read, {flipped} bytes hit, {counts:?}"
        );
        assert_eq!(counts.messages as usize, read);
        assert_eq!(counts.unknown, 0);
        assert!(counts.damaged as usize >= (per_rate - read) / 2);
        // Frames of about 30 bytes: most survive the best line, next to none the worst.
        match rate {
            1e-3 => assert!(read > per_rate / 2),
            1e-1 => assert!(read < per_rate / 100),
            _ => (),
        }
    }
}

/// The very next frame after noise of any length is read.
#[test]
fn the_next_whole_frame_after_noise_is_read() {
    let seed = 7;
    println!("seed {seed}");
    let mut noise = Noise(seed);
    let all = reports();
    for round in 0..20_000_usize {
        let mut decoder = Decoder::<Report>::default();
        for _ in 0..noise.next() % 600 {
            let byte = noise.next() as u8;
            assert!(!matches!(decoder.push(byte), Some(Ok(_))));
        }
        let message = all[round % all.len()].clone();
        let bytes = frame(&message, 77);
        let found: Vec<_> = bytes.iter().filter_map(|&b| decoder.push(b)).collect();
        let sequence = 77;
        assert_eq!(found.last(), Some(&Ok(Received { sequence, message })));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

    #[test]
    fn any_bytes_are_decoded_without_panic(bytes in proptest::collection::vec(any::<u8>(), 0..2000)) {
        let last = frame(&hello(), 5);
        let stream = [&bytes[..], &last].concat();
        let found = decode::<Report>(&stream);
        prop_assert_eq!(found.last().unwrap().as_ref().unwrap().sequence, 5);
        decode::<Request>(&stream);
    }

    /// Mostly frames, with pieces cut out and bytes changed: deeper into the fields than arbitrary
    /// bytes get.
    #[test]
    fn frames_with_anything_done_to_them_are_decoded_without_panic(
        picks in proptest::collection::vec(0_usize..9, 1..20),
        cuts in proptest::collection::vec((any::<u16>(), any::<u8>(), any::<u8>()), 0..20),
    ) {
        let mut stream: Vec<u8> = picks.iter().flat_map(|&pick| frame(&requests()[pick], 0)).collect();
        for (place, length, value) in cuts {
            let at = usize::from(place) % stream.len();
            let end = (at + usize::from(length % 8)).min(stream.len());
            stream.splice(at..end, [value]);
        }
        for found in messages::<Request>(&stream) {
            prop_assert!(requests().contains(&found.message), "{:?} was never sent", found);
        }
    }

    /// Fields that a receiver would believe, because their checksum is right: read or refused, and
    /// what is read can be written.
    #[test]
    fn any_fields_are_read_or_refused_without_panic(
        tag in 0_u8..0x10,
        fields in proptest::collection::vec(prop_oneof![0_u8..4, any::<u8>()], 0..243),
    ) {
        if let Some(message) = Report::read(tag, &fields) {
            prop_assert_eq!(messages(&frame(&message, 1)), [Received { sequence: 1, message }]);
        }
        if let Some(message) = Request::read(0x80 | tag, &fields) {
            prop_assert_eq!(messages(&frame(&message, 1)), [Received { sequence: 1, message }]);
        }
    }
}

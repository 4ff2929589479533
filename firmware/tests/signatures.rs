//! The check of signatures, held against the standard's examples and against the library that signs.

use ed25519_compact::{KeyPair, PublicKey as Reference, Seed, Signature};
use jointwatch_firmware::signature::{PublicKey, SIGNATURE_LEN};
use proptest::prelude::*;

fn holds(key: [u8; 32], message: &[u8], signature: &[u8; SIGNATURE_LEN]) -> bool {
    let Some(mut check) = PublicKey::new(key).check(signature) else {
        return false;
    };
    // In two pieces, so that a piece ends in the middle of a block.
    let (first, second) = message.split_at(message.len() / 3);
    check.absorb(first);
    check.absorb(second);
    check.holds()
}

/// What the library says, which also takes some signatures that this check does not: RFC 8032 leaves that open.
fn reference(key: [u8; 32], message: &[u8], signature: &[u8; SIGNATURE_LEN]) -> bool {
    let signature = Signature::new(*signature);
    Reference::new(key).verify(message, &signature).is_ok()
}

fn hex<const LEN: usize>(text: &str) -> [u8; LEN] {
    let digit = |at: usize| u8::from_str_radix(&text[2 * at..2 * at + 2], 16).unwrap();
    core::array::from_fn(digit)
}

#[test]
fn the_examples_of_the_standard_hold() {
    // RFC 8032, 7.1: tests 1 to 3.
    for (key, message, signature) in [
        (
            "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a",
            &[][..],
            "e5564300c360ac729086e2cc806e828a84877f1eb8e5d974d873e065224901555fb8821590a33bacc61e39701cf9b46bd25bf5f0595bbe24655141438e7a100b",
        ),
        (
            "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c",
            &[0x72],
            "92a009a9f0d4cab8720e820b5f642540a2b27b5416503f8fb3762223ebdb69da085ac1e43e15996e458f3613d0f11d8c387b2eaeb4302aeeb00d291612bb0c00",
        ),
        (
            "fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025",
            &[0xaf, 0x82],
            "6291d657deec24024827e69c3abe01a30ce548a284743a445e3680d7db5ac3ac18ff9b538d16f290ae67f760984dc6594a7c15e9716ed28dc027beceea1ec40a",
        ),
    ] {
        assert!(holds(hex(key), message, &hex(signature)));
        assert!(!holds(hex(key), &[message, &[0]].concat(), &hex(signature)));
    }
}

#[test]
fn every_flipped_bit_of_a_signature_and_of_its_key_is_refused() {
    let keys = KeyPair::from_seed(Seed::new([7; 32]));
    let message = [0x5A; 200];
    let signature = *keys.sk.sign(message, None);
    assert!(holds(*keys.pk, &message, &signature));
    for bit in 0..8 * SIGNATURE_LEN {
        let mut flipped = signature;
        flipped[bit / 8] ^= 1 << (bit % 8);
        assert!(!holds(*keys.pk, &message, &flipped), "bit {bit}");
    }
    for bit in 0..256 {
        let mut key = *keys.pk;
        key[bit / 8] ^= 1 << (bit % 8);
        assert!(!holds(key, &message, &signature), "bit {bit} of the key");
    }
}

#[test]
fn a_second_form_of_s_is_refused() {
    // S + L proves the same equation.
    let order: [u8; 32] = hex("edd3f55c1a631258d69cf7a2def9de1400000000000000000000000000000010");
    for seed in 1..9 {
        let keys = KeyPair::from_seed(Seed::new([seed; 32]));
        let mut signature = *keys.sk.sign(b"one form", None);
        let mut carry = 0;
        for (byte, more) in signature[32..].iter_mut().zip(order) {
            carry += u16::from(*byte) + u16::from(more);
            *byte = carry as u8;
            carry >>= 8;
        }
        assert!(!holds(*keys.pk, b"one form", &signature));
    }
}

#[test]
fn a_key_of_small_order_lets_nothing_pass() {
    // With y = 1, the neutral point, S = 0 and R = 0·B would prove every message.
    let mut one = [0; 32];
    one[0] = 1;
    let mut signature = [0; SIGNATURE_LEN];
    signature[0] = 1;
    assert!(PublicKey::new(one).check(&signature).is_none());
    // Order 4, and no point at all.
    assert!(PublicKey::new([0; 32]).check(&signature).is_none());
    let mut none = [0; 32];
    none[0] = 2;
    assert!(PublicKey::new(none).check(&signature).is_none());
}

proptest! {
    #[test]
    fn it_says_what_the_library_says(
        seed: [u8; 32], message in proptest::collection::vec(any::<u8>(), 0..600),
        damage in proptest::option::of((0..SIGNATURE_LEN, 1..=255_u8)), other: bool,
    ) {
        let keys = KeyPair::from_seed(Seed::new(seed));
        let mut signature = *keys.sk.sign(&message, None);
        if let Some((place, bits)) = damage {
            signature[place] ^= bits;
        }
        let mut read = message.clone();
        if other {
            read.push(0);
        }
        let key = *keys.pk;
        prop_assert_eq!(holds(key, &read, &signature), reference(key, &read, &signature));
        prop_assert_eq!(holds(key, &read, &signature), damage.is_none() && !other);
    }

    #[test]
    fn any_bytes_are_refused_without_a_panic(key: [u8; 32], r: [u8; 32], s: [u8; 32], message: [u8; 40]) {
        let mut signature = [0; SIGNATURE_LEN];
        signature[..32].copy_from_slice(&r);
        signature[32..].copy_from_slice(&s);
        prop_assert!(!holds(key, &message, &signature));
    }
}

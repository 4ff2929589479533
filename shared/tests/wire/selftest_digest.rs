//! The digests that every machine has to reproduce, and the reference model behind them.
//!
//! The pinned values were made by this test on x86-64 (it prints what it got when they differ); the
//! firmware's self-test compares against the same function, so a device that differs in one bit
//! fails.

use jointwatch_shared::base::Base;
use jointwatch_shared::selftest::network::reference_network;
use jointwatch_shared::selftest::{CORNER_POINTS, Digest, Points, corner, digest, reference_model};
use std::collections::HashSet;

#[test]
fn digests_are_pinned() {
    let of = |n| format!("{:016x}", digest(reference_model(), 1, n));
    assert_eq!(of(0), "77ac6bc19b9d4ca1");
    assert_eq!(of(100_000), "7e8c3c41ddc9f559");
    assert_eq!(of(1_000_000), "f513fecd353c8c02");
}

#[test]
fn digests_of_the_network_are_pinned() {
    let of = |n| format!("{:016x}", digest(reference_network(), 1, n));
    assert_eq!(of(0), "912075c904b7d69c");
    assert_eq!(of(100_000), "d67fc08e74bb0335");
    assert_eq!(of(1_000_000), "fda183f171afcfcd");
}

#[test]
fn the_digest_tells_a_single_bit_apart() {
    let mut seen = HashSet::new();
    for bit in 0..64 {
        let mut digest = Digest::new();
        digest.add(((1_u64 << bit) >> 32) as i32);
        digest.add((1_u64 << bit) as i32);
        assert!(seen.insert(digest.value()), "bit {bit}");
    }
}

#[test]
fn corners_are_all_different() {
    let all: HashSet<[i32; 4]> = (0..CORNER_POINTS).map(corner).collect();
    assert_eq!(all.len(), 81);
    assert!(all.contains(&[i32::MIN; 4]) && all.contains(&[0; 4]) && all.contains(&[i32::MAX; 4]));
    assert_eq!(corner(0), [i32::MIN; 4]);
}

#[test]
fn random_points_fill_every_octant() {
    let mut points = Points::new(3);
    let signs: HashSet<[bool; 4]> = (0..500)
        .map(|_| points.next_point().map(i32::is_negative))
        .collect();
    assert_eq!(signs.len(), 16);
}

#[test]
fn the_reference_model_is_sound_and_uses_its_range() {
    let model = reference_model();
    let Base::Polynomial(polynomial) = model.base() else {
        panic!("the reference model is a polynomial");
    };
    polynomial.check().unwrap();
    for (axis, output) in model.outputs().iter().enumerate() {
        let bound = polynomial.error_bound_lsb(axis) * output.force_per_lsb;
        assert!(
            bound <= output.error_bound && bound > 0.9 * output.error_bound,
            "{bound}"
        );
    }
    let mut points = Points::new(4);
    let largest = (0..10_000)
        .flat_map(|_| model.evaluate(&points.next_point()))
        .map(i32::unsigned_abs)
        .max();
    assert!(largest > Some(1 << 27), "{largest:?}");
}

#[test]
fn the_reference_network_is_sound_and_uses_its_range() {
    let model = reference_network();
    let Base::Network(network) = model.base() else {
        panic!("the reference network is a network");
    };
    network.check().unwrap();
    for (axis, output) in model.outputs().iter().enumerate() {
        let bound = network.error_bound_lsb(axis) * output.force_per_lsb;
        assert!(
            bound <= output.error_bound && bound > 0.9 * output.error_bound,
            "{bound}"
        );
    }
    let mut points = Points::new(4);
    let mut forces = || model.evaluate(&points.next_point());
    let largest = (0..10_000).flat_map(|_| forces()).map(i32::unsigned_abs);
    let largest = largest.max();
    assert!(largest > Some(1 << 28), "{largest:?}");
}

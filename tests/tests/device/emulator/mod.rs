//! The firmware under QEMU: the host's bits, a steady count of instructions, and the truth about
//! what lies in its slot.
//!
//! A missing QEMU fails these tests; nothing is skipped.

mod models;
mod sample;

use jointwatch::device::signing::{PrivateKey, SignedModel, Stamp};
use jointwatch::emulate::selftest::{self, Board, SelfTestReport, SlotState};
use jointwatch_shared::base::Model;
use jointwatch_shared::base::network::NEURONS;
use jointwatch_shared::selftest::chain::chain_digest;
use jointwatch_shared::selftest::network::reference_network;
use jointwatch_shared::selftest::{self as arithmetic, reference_model};
use jointwatch_shared::wire::blob::{self, BLOB_LEN};
use jointwatch_tests::elf::Image;
use jointwatch_tests::log::boot_log;
use models::{model, network, of_the_table, physical, with_effects, with_memory};
use std::io::Write;
use std::path::PathBuf;
use tempfile::NamedTempFile;

/// The most instructions that one evaluation of the full polynomial, both outputs, may take on a
/// Cortex-M4F.
const MAX_OF_POLYNOMIAL: u32 = 1000;
/// The same of a network with four inputs, 40 neurons and two outputs.
const MAX_OF_NETWORK: u32 = 1300;
/// The most that the effects of a full model, eight of them at most, may add.
const MAX_OF_EFFECTS: u32 = 2000;
/// The most that one effect with memory may add.
const MAX_OF_MEMORY: u32 = 700;

fn image(board: Board) -> PathBuf {
    selftest::selftest(board).unwrap_or_else(|why| panic!("{why}"))
}

fn flashed_image() -> PathBuf {
    selftest::build(Board::Stm32f405, "jointwatch").unwrap_or_else(|why| panic!("{why}"))
}

fn run(board: Board, slot: Option<&[u8]>, points: u32) -> SelfTestReport {
    let file = slot.map(file);
    let blob = file.as_ref().map(|file| file.path());
    selftest::run_selftest(board, &image(board), blob, points).unwrap_or_else(|why| panic!("{why}"))
}

fn file(bytes: &[u8]) -> NamedTempFile {
    let mut file = NamedTempFile::new().expect("a temporary file");
    file.write_all(bytes).expect("it takes the bytes");
    file
}

/// The digest of `name` on the device is the one that the host computes for `model`.
fn same_bits(report: &SelfTestReport, name: &str, model: &Model) {
    let device = report.model(name);
    let device = device.unwrap_or_else(|| panic!("no digest of {name}: {report:?}"));
    let host = arithmetic::digest(model, device.seed, device.points);
    assert_eq!(
        device.digest, host,
        "{name} over {} points: device {:#018x}, host {host:#018x}",
        device.points, device.digest
    );
}

/// Both reference models give the host's bits, over as many points as were asked for.
fn same_reference_bits(report: &SelfTestReport, points: u32) {
    for (name, model) in [
        ("reference", reference_model()),
        ("network", reference_network()),
    ] {
        let seen = report.model(name).map(|model| model.points);
        assert_eq!(seen, Some(points), "{name}");
        same_bits(report, name, model);
    }
}

/// The on-board chain, from counts to residuals, gives on the device what it gives on the host.
fn same_chain(report: &SelfTestReport, samples: u32) {
    let device = report.chain.expect("a digest of the chain");
    assert_eq!(device.samples, samples);
    let host = chain_digest(reference_model(), device.seed, device.samples);
    assert_ne!(host, 0, "the reference model fits the reference rig");
    assert_eq!(
        device.digest, host,
        "device {:#018x}, host {host:#018x}",
        device.digest
    );
}

#[test]
fn cortex_m4f_computes_the_same_bits_a_million_times() {
    let report = run(Board::Stm32f405, None, 1_000_000);
    assert!(report.passed, "{report:?}");
    same_reference_bits(&report, 1_000_000);
    same_chain(&report, 20_000);
}

#[test]
fn cortex_m0_computes_the_same_bits() {
    let report = run(Board::Microbit, None, 100_000);
    assert!(report.passed, "{report:?}");
    assert_eq!(report.board, "microbit");
    same_reference_bits(&report, 100_000);
    same_chain(&report, 2_000);
}

#[test]
fn instructions_are_few_and_do_not_depend_on_the_input() {
    // As many multiplications as there are numbers in the model; fewer would mean that something
    // else was counted.
    let of_polynomial = 512..=MAX_OF_POLYNOMIAL;
    let of_network = 40 * 6..=MAX_OF_NETWORK;
    for (slot, of_slot) in [
        (model(2, 11), &of_polynomial),
        (network(2, NEURONS, 12), &of_network),
        (network(1, NEURONS, 13), &of_network),
    ] {
        let report = run(Board::Stm32f405, Some(&blob::encode(&slot)), 0);
        let names = [
            ("reference", &of_polynomial),
            ("network", &of_network),
            ("a", of_slot),
        ];
        for (name, range) in names {
            let counted = report.model(name).and_then(|model| model.instructions);
            let counted = counted.unwrap_or_else(|| panic!("no count of {name}: {report:?}"));
            println!("{name}: {counted:?}");
            assert!(
                counted.inputs > arithmetic::CORNER_POINTS,
                "corners and random points"
            );
            assert_eq!(counted.least, counted.most, "{name}");
            assert!(range.contains(&counted.most), "{name}: {}", counted.most);
        }
    }
}

#[test]
fn effects_add_few_instructions() {
    // What `docs/explanation/numerics.md` states; a law's branches make the count depend on the
    // input.
    for (what, slot, most) in [
        ("physical, 1 axis", physical(1), MAX_OF_EFFECTS),
        ("physical, 2 axes", physical(2), MAX_OF_EFFECTS),
        (
            "polynomial and an effect with memory, 2 axes",
            with_memory(model(2, 19)),
            MAX_OF_POLYNOMIAL + MAX_OF_MEMORY,
        ),
        (
            "polynomial and effects, 2 axes",
            with_effects(model(2, 19)),
            MAX_OF_POLYNOMIAL + MAX_OF_EFFECTS,
        ),
    ] {
        let report = run(Board::Stm32f405, Some(&blob::encode(&slot)), 0);
        assert!(report.passed, "{report:?}");
        let counted = report.model("a").and_then(|model| model.instructions);
        let counted = counted.unwrap_or_else(|| panic!("no count: {report:?}"));
        let effects = slot.terms().list().len();
        println!("{what}, {effects} effects: {counted:?}");
        assert!(counted.least > 10 * effects as u32, "{what}: {counted:?}");
        assert!(counted.most <= most, "{what}: {counted:?}");
    }
}

#[test]
fn a_good_blob_in_the_slot_is_taken_and_gives_the_hosts_bits() {
    let models = [
        model(1, 5),
        model(2, 6),
        model(2, 7),
        network(1, NEURONS, 14),
        network(2, NEURONS, 15),
        network(2, 9, 16),
        physical(1),
        physical(2),
        with_effects(model(2, 17)),
        with_effects(network(1, NEURONS, 18)),
    ];
    for (number, model) in models.iter().enumerate() {
        let report = run(Board::Stm32f405, Some(&blob::encode(model)), 20_000);
        let what = format!("model {number}: {report:?}");
        assert_eq!(report.slot("a"), Some(&SlotState::Model), "{what}");
        assert!(report.passed, "{what}");
        same_bits(&report, "a", model);
    }
}

#[test]
fn every_effect_of_the_joint_gives_the_hosts_bits() {
    for model in of_the_table() {
        let names: Vec<&str> = model
            .terms()
            .list()
            .iter()
            .map(|term| term.entry().about.name)
            .collect();
        let report = run(Board::Stm32f405, Some(&blob::encode(&model)), 20_000);
        assert!(report.passed, "{names:?}: {report:?}");
        same_bits(&report, "a", &model);
        let counted = report.model("a").and_then(|model| model.instructions);
        println!("{names:?}: {counted:?}");
    }
}

#[test]
fn a_damaged_blob_is_refused_with_the_hosts_reason() {
    let good = blob::encode(&model(2, 8));
    let mut flipped = good;
    flipped[1000] ^= 0x20;
    let mut foreign = good;
    foreign[0] = b'X';
    let mut cut = good;
    cut[2000..].fill(0);
    let mut half_written = [0xFF; BLOB_LEN];
    half_written[..100].copy_from_slice(&good[..100]);
    for bytes in [flipped, foreign, cut, half_written] {
        let reason = blob::decode(&bytes)
            .expect_err("a damaged blob")
            .to_string();
        let report = run(Board::Stm32f405, Some(&bytes), 10);
        assert_eq!(report.slot("a"), Some(&SlotState::Refused(reason)));
        assert!(!report.passed && report.errors == 1, "{report:?}");
        assert!(report.model("a").is_none(), "nothing of it is evaluated");
    }
}

#[test]
fn an_erased_slot_holds_no_model() {
    let report = run(Board::Stm32f405, Some(&[0xFF; BLOB_LEN]), 10);
    assert_eq!(report.slot("a"), Some(&SlotState::NoModel));
    assert_eq!(report.slot("b"), Some(&SlotState::NoModel));
    assert!(report.passed, "{report:?}");
}

#[test]
fn without_crystal_and_pll_the_internal_oscillator_is_used_and_named() {
    // QEMU's chip has neither, and reads 0 where their flags would be.
    let report = run(Board::Stm32f405, None, 0);
    assert_eq!(report.clock_source, "internal");
    assert_eq!(report.clock_hz, 16_000_000);
}

#[test]
fn faults_and_panics_end_the_self_test_as_failures() {
    let image = Image::read(&image(Board::Stm32f405));
    // 0xDE00 is the undefined instruction `udf #0`, little-endian.
    let fault = image.patched(image.address("Reset") & !1, &[0x00, 0xDE]);
    // The second word of the vector table is where the processor starts; every panic goes through
    // this function.
    let handler = (image.address("panic_fmt") | 1) as u32;
    let panic = image.patched(image.address("__vector_table") + 4, &handler.to_le_bytes());
    for (what, bytes) in [("fault", fault), ("panic", panic)] {
        let elf = file(&bytes);
        let why = selftest::run_selftest(Board::Stm32f405, elf.path(), None, 0);
        let why = why.expect_err("it must not pass").sentence;
        assert!(why.contains("ended with exit status: 1"), "{what}: {why}");
    }
}

#[test]
fn flashed_image_boots_and_logs_clock_and_empty_slots() {
    let log = boot_log(&flashed_image(), None, "ready");
    assert_eq!(
        log,
        [
            concat!("info jointwatch ", env!("CARGO_PKG_VERSION")),
            "warn clock: internal oscillator, 16000000 Hz: no crystal",
            "warn this image trusts the development key: anybody can put a model onto it",
            "info slot a: empty",
            "info slot b: empty",
            "warn no model",
            "info sampling at 1000.0 Hz",
            "info ready",
        ]
    );
}

#[test]
fn flashed_image_takes_its_model_from_the_slot() {
    let model = model(2, 9);
    let signed = SignedModel::sign(
        &blob::encode(&model),
        &[],
        &PrivateKey::development(),
        &Stamp::default(),
    );
    let good = file(&signed.expect("a sound model").to_bytes());
    let log = boot_log(&flashed_image(), Some(good.path()), "ready").join("\n");
    let [x_unit, phi_unit] = [0, 1].map(|axis| model.outputs()[axis].force_per_lsb);
    for expected in [
        "warn this image trusts the development key".to_owned(),
        "info slot a: a model\ninfo slot b: empty\n".to_owned(),
        "info model in use: slot a, 2 axes, learnt at 2000".to_owned(),
        format!("info axis x: {x_unit} N per unit of force"),
        format!("info axis phi: {phi_unit} N·m per unit of force"),
        "warn axis phi: never compared with unseen records".to_owned(),
        "warn rig block not used, raw counts only: there is none".to_owned(),
    ] {
        assert!(log.contains(&expected), "no “{expected}” in:\n{log}");
    }
}

#[test]
fn flashed_image_says_why_it_refuses_a_damaged_or_an_unsigned_model() {
    let good = blob::encode(&model(1, 10));
    let mut damaged = good;
    damaged[BLOB_LEN / 2] ^= 1;
    for (bytes, why) in [
        (damaged, "its checksum does not match"),
        (good, "nobody signed it"),
    ] {
        let log = boot_log(&flashed_image(), Some(file(&bytes).path()), "ready");
        let refused = format!("warn slot a: refused: {why}");
        assert_eq!(
            log[3..],
            [
                refused.as_str(),
                "info slot b: empty",
                "warn no model",
                "info sampling at 1000.0 Hz",
                "info ready"
            ]
        );
    }
}

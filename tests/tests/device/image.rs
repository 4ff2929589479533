//! The flashed image as a file: it has no path to a panic, it fits its flash, and its slots lie
//! where the host believes.

use jointwatch::emulate::selftest::{self, Board, SLOT_A};
use jointwatch_tests::elf::{Image, panic_paths, readable};
use std::collections::{BTreeMap, BTreeSet};

fn image(name: &str) -> Image {
    let path = selftest::build(Board::Stm32f405, name).unwrap_or_else(|why| panic!("{why}"));
    Image::read(&path)
}

/// The tasks of a sample, by the interrupts that they are hung to.
const PER_SAMPLE: [&str; 5] = ["TIM2", "UART4", "USART6", "UART5", "USART2"];

/// What calls a panic and may: the check of a signature, with bounds checks of constant tables that
/// the compiler cannot prove away. It runs at the start and at the end of an upload, and its
/// indices do not depend on what was uploaded.
const OF_SIGNATURES: [&str; 3] = [
    "ed25519_compact",
    "jointwatch_firmware::store::verify::Key",
    "jointwatch_firmware::store::Store",
];

#[test]
fn nothing_of_the_flashed_image_but_the_check_of_a_signature_can_panic() {
    let image = image("jointwatch");
    // Without these the symbol table would be stripped, and its silence would prove nothing.
    for known in ["main", "Reset", "HardFault", "_SEGGER_RTT"] {
        assert!(image.symbols.contains_key(known), "no symbol {known}");
    }
    let shared = |name: &String| name.contains("jointwatch_shared");
    assert!(
        image.symbols.keys().any(shared),
        "the model's code is part of the image"
    );
    let calls = image.calls();
    let panics = panic_paths(calls.keys());
    assert!(!panics.is_empty(), "the check of a signature has some");
    for (caller, callees) in &calls {
        let leads = callees.iter().any(|name| panics.contains(&name.as_str()));
        let may = panics.contains(&caller.as_str())
            || OF_SIGNATURES
                .iter()
                .any(|part| readable(caller).contains(part));
        assert!(!leads || may, "{caller} leads to a panic");
    }
}

/// Everything that a task of a sample may come to call, but for what an upload does.
fn reached<'a>(task: &'a str, calls: &'a BTreeMap<String, BTreeSet<String>>) -> BTreeSet<&'a str> {
    assert!(calls.contains_key(task), "no task {task}");
    let mut seen = BTreeSet::new();
    let mut to_see = vec![task];
    while let Some(name) = to_see.pop() {
        // The one way to a signature, and to a new model, that the tasks have.
        if readable(name).contains("server::Server") && readable(name).contains("judged") {
            continue;
        }
        if seen.insert(name) {
            to_see.extend(calls.get(name).into_iter().flatten().map(String::as_str));
        }
    }
    assert!(seen.len() > 1 || task == "USART2", "{task} calls nothing");
    seen
}

#[test]
fn no_task_reaches_a_panic_but_through_an_upload() {
    let image = image("jointwatch");
    let calls = image.calls();
    let panics = panic_paths(calls.keys());
    for task in PER_SAMPLE {
        for name in reached(task, &calls) {
            assert!(!panics.contains(&name), "{task} reaches {name}");
        }
    }
}

/// Real numbers of 64 bits, which this processor has no instructions for, are for the start and for
/// uploads: there the rig's SI values become integers.
#[test]
fn no_task_reaches_arithmetic_on_real_numbers_of_64_bits_but_through_an_upload() {
    let image = image("jointwatch");
    let calls = image.calls();
    // As the compiler's library calls them, and as it calls their insides.
    let arithmetic = [
        "__aeabi_dadd",
        "__aeabi_dsub",
        "__aeabi_dmul",
        "__aeabi_ddiv",
        "__adddf3",
        "__subdf3",
        "__muldf3",
        "__divdf3",
    ];
    let is_arithmetic = |name: &str| arithmetic.iter().any(|part| name.contains(part));
    // Were there none at the start, its absence from the tasks would prove nothing.
    assert!(image.symbols.keys().any(|name| is_arithmetic(name)));
    for task in PER_SAMPLE {
        for name in reached(task, &calls) {
            assert!(!is_arithmetic(name), "{task} reaches {name}");
        }
    }
}

#[test]
fn the_image_for_tests_differs_in_chips_line_clock_and_slots_alone() {
    let of = |name: &str, crate_name: &str| -> BTreeSet<String> {
        let image = image(name);
        let names = image.symbols.keys().map(|name| readable(name));
        let own = names.filter(|name| {
            ["jointwatch_shared", "jointwatch_firmware"]
                .iter()
                .any(|part| name.starts_with(part))
        });
        own.map(|name| name.replace(crate_name, "jointwatch"))
            .collect()
    };
    let flashed = of("jointwatch", "jointwatch");
    let tested = of("jointwatch-link", "jointwatch_link");
    // The drivers are generic over the bus, so the compiler may put other pieces of them into their
    // callers.
    let parts = [
        "board::link",
        "board::driver",
        "board::stm32f405",
        "board::semihosting",
        "board::stack",
        "jointwatch_firmware::sensor",
    ];
    let differ: Vec<_> = flashed
        .symmetric_difference(&tested)
        .filter(|name| !parts.iter().any(|part| name.contains(part)))
        .collect();
    assert!(differ.is_empty(), "{differ:#?}");
}

#[test]
fn the_search_for_panic_paths_finds_them_where_they_are() {
    // The self-test formats numbers, and the library's code for that can panic.
    let image = image("selftest");
    let found = panic_paths(image.symbols.keys());
    let formatter = found.iter().any(|name| name.contains("panic_fmt"));
    assert!(formatter, "no panic_fmt in {found:#?}");
}

#[test]
fn slots_lie_where_the_host_puts_a_blob() {
    for name in ["jointwatch", "selftest"] {
        let image = image(name);
        assert_eq!(image.symbols["_slot_a"], u64::from(SLOT_A), "{name}");
        assert_eq!(
            image.symbols["_slot_b"] - image.symbols["_slot_a"],
            128 * 1024,
            "{name}"
        );
        assert!(
            image.symbols["__veneer_limit"] < u64::from(SLOT_A),
            "{name}"
        );
    }
}

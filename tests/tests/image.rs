//! The flashed image as a file: it has no path to a panic, it fits its flash, and its slots lie where the host believes.

use jointwatch::device::{self, Board, SLOT_A};
use jointwatch_tests::elf::{Image, panic_paths};

fn image(name: &str) -> Image {
    let path = device::build(Board::Stm32f405, name).unwrap_or_else(|why| panic!("{why}"));
    Image::read(&path)
}

#[test]
fn flashed_image_has_no_panic_path() {
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
    let found = panic_paths(image.symbols.keys());
    assert!(
        found.is_empty(),
        "these functions lead to a panic: {found:#?}"
    );
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

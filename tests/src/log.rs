//! Runs the image that is flashed under QEMU and reads its defmt log out of the emulated RAM, as a
//! debug probe would.

use crate::elf::Image;
use crate::running::Ended;
use defmt_decoder::Table;
use jointwatch::emulate::selftest::{self, Board, SLOT_A};
use std::io::Write;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

/// RAM of the STM32F405 as the image uses it.
const RAM: u64 = 0x2000_0000;
const RAM_LEN: usize = 128 * 1024;
/// How long an image may take to come to its last line; under QEMU it takes a fraction of a second.
const LIMIT: Duration = Duration::from_secs(60);

/// Boots the image `elf` with `blob` in slot A and gives its log, one line per message with its
/// level, up to `last`.
///
/// # Panics
/// When QEMU is missing, or when the message `last` does not come within a minute.
pub fn boot_log(elf: &Path, blob: Option<&Path>, last: &str) -> Vec<String> {
    let image = Image::read(elf);
    let table = Table::parse(&image.bytes)
        .expect("a defmt table of a version that the decoder knows")
        .expect("the image logs over defmt");
    let qemu = selftest::require_qemu().unwrap_or_else(|why| panic!("{why}"));
    let mut command = selftest::machine(&qemu, Board::Stm32f405);
    // The monitor's later option wins over the earlier one that turns it off.
    command.args(["-monitor", "stdio", "-kernel"]).arg(elf);
    if let Some(blob) = blob {
        command
            .arg("-device")
            .arg(selftest::load_into_flash(blob, SLOT_A));
    }
    command.stdin(Stdio::piped()).stdout(Stdio::null());
    let mut qemu = Ended(command.spawn().expect("QEMU starts"));
    let mut monitor = qemu.0.stdin.take().expect("it was piped");

    let folder = tempfile::tempdir().expect("a temporary folder");
    let started = Instant::now();
    let mut lines = Vec::new();
    for number in 0.. {
        let dump = folder.path().join(format!("{number}.ram"));
        writeln!(
            monitor,
            "pmemsave {RAM:#x} {RAM_LEN} {:?}",
            dump.display().to_string()
        )
        .expect("QEMU still runs");
        let ram = loop {
            match std::fs::read(&dump) {
                Ok(ram) if ram.len() == RAM_LEN => break ram,
                _ => assert!(started.elapsed() < LIMIT, "QEMU does not show its RAM"),
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        lines = decode(&table, &ring(&image, &ram));
        if lines.iter().any(|line| line.ends_with(last)) {
            break;
        }
        assert!(
            started.elapsed() < LIMIT,
            "no “{last}” in the log: {lines:#?}"
        );
        std::thread::sleep(Duration::from_millis(20));
    }
    lines
}

/// The bytes logged so far, from the control block that a debug probe would look for.
fn ring(image: &Image, ram: &[u8]) -> Vec<u8> {
    let at = (image.address("_SEGGER_RTT") - RAM) as usize;
    let word = |place: usize| {
        let bytes = ram[at + place..]
            .first_chunk()
            .expect("the block lies within RAM");
        u32::from_le_bytes(*bytes)
    };
    // Start-up code has not yet copied the block into RAM.
    if !ram[at..].starts_with(b"SEGGER RTT\0") {
        return Vec::new();
    }
    // UM08001: identification, counts of channels, then per channel name, buffer, size, write and
    // read position.
    assert_eq!((word(16), word(20)), (1, 0), "one channel up, none down");
    let (start, length, write) = (u64::from(word(28)) - RAM, word(32), word(36));
    assert!(write < length, "the write position lies within the ring");
    let logged = &ram[start as usize..][..length as usize];
    // A boot log is far shorter than the ring, so it has not wrapped.
    logged[..write as usize].to_vec()
}

fn decode(table: &Table, bytes: &[u8]) -> Vec<String> {
    let mut decoder = table.new_stream_decoder();
    decoder.received(bytes);
    let mut lines = Vec::new();
    while let Ok(frame) = decoder.decode() {
        let level = frame.level().map_or("", |level| level.as_str());
        lines.push(format!("{level} {}", frame.display_message()));
    }
    lines
}

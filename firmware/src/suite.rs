//! The self-test: does this processor compute the same forces, bit for bit, as the host, and in how
//! many instructions?
//!
//! It knows no board. It is handed what a [`Board`] has, writes lines of text that people and
//! programs can read (`docs/notebook/emulation.md` lists them), and says whether every check
//! passed.

use crate::clock::Clock;
use crate::store::{Slot, SlotName};
use core::fmt::{self, Write};
use core::hint::black_box;
use jointwatch_shared::base::Model;
use jointwatch_shared::base::kernels::Kernels;
use jointwatch_shared::selftest::chain::{USUAL_TAPS, Watched, chain_digest_by};
use jointwatch_shared::selftest::network::reference_network;
use jointwatch_shared::selftest::{CORNER_POINTS, Points, corner, digest_by, reference_model};
use jointwatch_shared::wire::blob;

/// Reads a counter that, under QEMU's `-icount shift=0`, has counted every executed instruction.
pub type Counter = fn() -> u32;

/// The seed of the random points; part of every digest line, so that the host draws the same ones.
pub const SEED: u64 = 20_070_099;

/// The digest of the reference model over the corner points and [`KNOWN_POINTS`] random ones, as an
/// x86-64 computed it.
///
/// It lets a device fail the test with nobody there to compare; a test on the host pins it.
pub const KNOWN_DIGEST: u64 = 0xe526_1779_e239_9e0c;
/// The same of the reference network.
pub const KNOWN_NETWORK_DIGEST: u64 = 0x7391_2321_e7f4_9797;
/// The number of random points of [`KNOWN_DIGEST`] and [`KNOWN_NETWORK_DIGEST`].
pub const KNOWN_POINTS: u32 = 1000;

/// A sample of the chain costs as much as so many evaluations where 64-bit products are slow.
const POINTS_PER_SAMPLE: u32 = 50;

/// What the suite is to know of a board.
pub struct Board<'a> {
    /// The name under which results are printed.
    pub name: &'a str,
    /// What the processor is clocked by.
    pub clock: Clock,
    /// The bytes of slot A and slot B; none on a chip without the memory for a blob's decoder.
    pub slots: &'a [&'a [u8]],
    /// The instruction counter, where there is one.
    pub counter: Option<Counter>,
}

/// What the run is to do, from its command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arguments {
    /// Random points per digest: `points=N`.
    pub points: u32,
    /// Inputs over which instructions are counted, 0 for no count: `count=N`. Needs QEMU's
    /// `-icount`.
    pub count: u32,
}

impl Arguments {
    /// Reads a command line: the program's name, then any of `points=N` and `count=N`.
    ///
    /// # Errors
    /// The first word that is neither: a run that does something else than it was asked to must not
    /// pass.
    pub fn parse(line: &str) -> Result<Self, &str> {
        let mut arguments = Self {
            points: 10_000,
            count: 0,
        };
        for word in line.split_ascii_whitespace().skip(1) {
            let (name, value) = word.split_once('=').ok_or(word)?;
            let value = value.parse().map_err(|_| word)?;
            match name {
                "points" => arguments.points = value,
                "count" => arguments.count = value,
                _ => return Err(word),
            }
        }
        Ok(arguments)
    }
}

/// Runs every check and writes one line for each result; true when all passed.
///
/// # Errors
/// When the text cannot be written. A run that nobody could read must not count as passed.
pub fn run<K: Kernels>(
    board: &Board,
    command_line: &str,
    text: &mut impl Write,
) -> Result<bool, fmt::Error> {
    writeln!(text, "selftest {}", env!("CARGO_PKG_VERSION"))?;
    writeln!(text, "board {}", board.name)?;
    writeln!(text, "clock {}", board.clock)?;
    let arguments = match Arguments::parse(command_line) {
        Ok(arguments) => arguments,
        Err(word) => {
            writeln!(
                text,
                "error argument {word} is neither points=N nor count=N"
            )?;
            return finish(1, text);
        }
    };

    let mut errors = 0;
    for (name, reference, known) in [
        ("reference", reference_model(), KNOWN_DIGEST),
        ("network", reference_network(), KNOWN_NETWORK_DIGEST),
    ] {
        let seen = digest_by::<K>(reference, SEED, KNOWN_POINTS);
        if seen != known {
            errors += 1;
            writeln!(
                text,
                "error the model {name} gives {seen:#018x}, not {known:#018x}"
            )?;
        }
        errors += model::<K>(name, reference, board, arguments, text)?;
    }
    chain::<K>(arguments, text)?;
    if !board.slots.is_empty() {
        errors += decoder(text)?;
    }
    for (place, bytes) in SlotName::ALL.into_iter().zip(board.slots) {
        errors += slot::<K>(place, bytes, board, arguments, text)?;
    }
    finish(errors, text)
}

/// The last two lines.
fn finish(errors: u32, text: &mut impl Write) -> Result<bool, fmt::Error> {
    writeln!(text, "errors {errors}")?;
    let passed = errors == 0;
    writeln!(text, "result {}", if passed { "passed" } else { "failed" })?;
    Ok(passed)
}

/// The blob decoder on this processor: takes a good blob, refuses damaged ones. Gives the number of
/// errors.
///
/// Not inlined: its buffers would stand in the caller's stack frame even on a chip that never gets
/// here.
#[inline(never)]
fn decoder(text: &mut impl Write) -> Result<u32, fmt::Error> {
    let mut errors = 0;
    for model in [reference_network(), reference_model()] {
        let bytes = blob::encode(model);
        if blob::decode(&bytes).as_ref() != Ok(model) {
            errors += 1;
            writeln!(text, "error a good blob did not come back as its model")?;
        }
    }
    let mut bytes = blob::encode(reference_model());
    // One bit in every 64 bytes; the host goes through all of them.
    let mut damaged = 0;
    for place in (0..blob::BLOB_LEN).step_by(64) {
        let bit = 1 << (place / 64 % 8);
        bytes[place] ^= bit;
        if blob::decode(&bytes).is_ok() {
            errors += 1;
            writeln!(text, "error a blob damaged at byte {place} was taken")?;
        }
        bytes[place] ^= bit;
        damaged += 1;
    }
    writeln!(text, "decoder taken 2 refused {damaged} errors {errors}")?;
    Ok(errors)
}

/// What one slot holds, and its model's figures. Gives the number of errors. Not inlined, as
/// [`decoder`].
#[inline(never)]
fn slot<K: Kernels>(
    place: SlotName,
    bytes: &[u8],
    board: &Board,
    arguments: Arguments,
    text: &mut impl Write,
) -> Result<u32, fmt::Error> {
    let name = place.name();
    match Slot::read(bytes) {
        Slot::Empty => {
            writeln!(text, "slot {name} no model")?;
            Ok(0)
        }
        Slot::Refused(why) => {
            writeln!(text, "slot {name} refused: {why}")?;
            Ok(1)
        }
        Slot::Model(found) => {
            writeln!(text, "slot {name} model")?;
            model::<K>(name, &found, board, arguments, text)
        }
    }
}

/// The digest of the whole on-board chain over a fixed motion. Not inlined, as [`decoder`].
#[inline(never)]
fn chain<K: Kernels>(arguments: Arguments, text: &mut impl Write) -> fmt::Result {
    let samples = arguments.points / POINTS_PER_SAMPLE;
    let value = chain_digest_by::<K>(reference_model(), SEED, samples);
    writeln!(text, "chain seed {SEED} samples {samples} {value:#018x}")
}

/// Digest and instruction count of one model. Gives the number of errors.
fn model<K: Kernels>(
    name: &str,
    model: &Model,
    board: &Board,
    arguments: Arguments,
    text: &mut impl Write,
) -> Result<u32, fmt::Error> {
    let points = arguments.points;
    let value = digest_by::<K>(model, SEED, points);
    writeln!(
        text,
        "digest {name} seed {SEED} points {points} {value:#018x}"
    )?;
    let (Some(counter), true) = (board.counter, arguments.count > 0) else {
        return Ok(0);
    };
    let (least, most) = instructions::<K>(model, counter, arguments.count);
    let inputs = arguments.count;
    writeln!(
        text,
        "instructions {name} inputs {inputs} min {least} max {most}"
    )?;
    for (what, humming) in [("sample", false), ("humming", true)] {
        if let Some((least, most, ending)) = instructions_per_sample::<K>(model, counter, humming) {
            let [derivative, band] = USUAL_TAPS;
            writeln!(
                text,
                "{what} {name} taps {derivative} {band} samples {SAMPLES_COUNTED} min {least} max {most} ending {ending}"
            )?;
        }
    }
    // Laws of effects have branches, a base has none.
    if least == most || !model.terms().list().is_empty() {
        return Ok(0);
    }
    writeln!(text, "error the instructions of {name} depend on its input")?;
    Ok(1)
}

/// The fewest and the most instructions that one evaluation took, over the corner points first and
/// then random ones.
fn instructions<K: Kernels>(model: &Model, counter: Counter, inputs: u32) -> (u32, u32) {
    let overhead = span(counter, || ());
    let mut points = Points::new(SEED);
    let mut least = u32::MAX;
    let mut most = 0;
    for number in 0..inputs {
        let input = if number < CORNER_POINTS {
            corner(number)
        } else {
            points.next_point()
        };
        let taken = span(counter, || {
            black_box(model.evaluate_by::<K>(black_box(&input)));
        })
        .saturating_sub(overhead);
        least = least.min(taken);
        most = most.max(taken);
    }
    (least, most)
}

/// Samples of the chain over which instructions are counted: several blocks of the monitor after
/// the filters are full.
const SAMPLES_COUNTED: u32 = 1000;
/// Samples before the count begins.
const SAMPLES_TO_FILL: u32 = 400;

/// The fewest and the most instructions that one sample took from counts to verdict, and the most
/// where a block of the monitor ends; none when the model does not fit the rig of the fixed motion,
/// with lines of the mains in both forces where that is `humming`. Not inlined, as [`decoder`].
#[inline(never)]
fn instructions_per_sample<K: Kernels>(
    model: &Model,
    counter: Counter,
    humming: bool,
) -> Option<(u32, u32, u32)> {
    let overhead = span(counter, || ());
    let mut watched = Watched::new(model, SEED, humming)?;
    let (mut least, mut most, mut ending) = (u32::MAX, 0, 0);
    for number in 0..SAMPLES_TO_FILL + SAMPLES_COUNTED {
        let (raw, (is_ending, filled)) = (watched.counts(), watched.blocks());
        let taken = span(counter, || {
            black_box(watched.step::<K>(black_box(&raw)));
        })
        .saturating_sub(overhead);
        if number < SAMPLES_TO_FILL {
            continue;
        }
        if is_ending || watched.blocks().1 != filled {
            ending = ending.max(taken);
        } else {
            least = least.min(taken);
            most = most.max(taken);
        }
    }
    Some((least, most, ending))
}

/// What the counter counts from before `work` to after it. Not inlined, so that every use has the
/// same overhead.
#[inline(never)]
fn span(counter: Counter, work: impl FnOnce()) -> u32 {
    let start = counter();
    work();
    counter().wrapping_sub(start)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use core::cell::Cell;
    use jointwatch_shared::base::kernels::Portable;
    use jointwatch_shared::selftest::digest;
    use std::string::String;
    use std::thread_local;

    thread_local! {
        static TICKS: Cell<u32> = const { Cell::new(0) };
    }

    /// A counter that wraps and takes three ticks from one reading to the next.
    fn steady() -> u32 {
        TICKS.set(TICKS.get().wrapping_add(3));
        TICKS.get().wrapping_sub(1000)
    }

    /// A counter whose steps grow.
    fn drifting() -> u32 {
        TICKS.set(TICKS.get() + 1);
        TICKS.get() * TICKS.get()
    }

    fn board<'a>(slots: &'a [&'a [u8]], counter: Option<Counter>) -> Board<'a> {
        Board {
            name: "computer",
            clock: Clock::crystal(1),
            slots,
            counter,
        }
    }

    fn outcome(board: &Board, line: &str) -> (bool, String) {
        let mut text = String::new();
        let passed = run::<Portable>(board, line, &mut text).expect("a string takes any text");
        (passed, text)
    }

    const ERASED: [u8; blob::BLOB_LEN] = [0xFF; blob::BLOB_LEN];

    #[test]
    fn known_digests_are_the_reference_models() {
        let value = digest(reference_model(), SEED, KNOWN_POINTS);
        assert_eq!(
            value, KNOWN_DIGEST,
            "the reference model, the points or the kernel changed; the digest now is {value:#018x}"
        );
        let value = digest(reference_network(), SEED, KNOWN_POINTS);
        assert_eq!(
            value, KNOWN_NETWORK_DIGEST,
            "the reference network, the points or the kernel changed; the digest now is {value:#018x}"
        );
    }

    #[test]
    fn passes_with_empty_slots_and_counts_nothing_unless_asked() {
        let (passed, text) = outcome(
            &board(&[&ERASED, &ERASED], Some(steady)),
            "selftest points=5",
        );
        assert!(passed, "{text}");
        assert!(
            text.contains("slot a no model\nslot b no model\n"),
            "{text}"
        );
        assert!(text.contains(" points 5 0x"), "{text}");
        assert!(!text.contains("instructions"), "{text}");
    }

    #[test]
    fn takes_the_overhead_of_counting_off() {
        let (passed, text) = outcome(
            &board(&[&ERASED, &ERASED], Some(steady)),
            "selftest count=100",
        );
        assert!(passed, "{text}");
        for name in ["reference", "network"] {
            let what = std::format!("instructions {name} inputs 100 min 0 max 0\n");
            assert!(text.contains(&what), "{text}");
        }
    }

    #[test]
    fn fails_when_the_count_depends_on_the_input() {
        let (passed, text) = outcome(
            &board(&[&ERASED, &ERASED], Some(drifting)),
            "selftest count=9",
        );
        assert!(!passed, "{text}");
        for name in ["reference", "network"] {
            let what = std::format!("error the instructions of {name} depend on its input\n");
            assert!(text.contains(&what), "{text}");
        }
        assert!(text.ends_with("errors 2\nresult failed\n"), "{text}");
    }

    #[test]
    fn a_good_slot_is_evaluated_and_a_damaged_one_fails_the_run() {
        let good = blob::encode(reference_model());
        let mut damaged = good;
        damaged[300] ^= 0x10;
        let (passed, text) = outcome(&board(&[&good, &damaged], None), "selftest points=7");
        assert!(!passed, "{text}");
        let expected = digest(reference_model(), SEED, 7);
        assert!(
            text.contains(&std::format!(
                "slot a model\ndigest a seed {SEED} points 7 {expected:#018x}\nslot b refused: "
            )),
            "{text}"
        );
    }

    #[test]
    fn a_word_that_is_not_understood_fails_the_run() {
        for word in ["points", "points=", "points=-1", "point=3", "count=x"] {
            let line = std::format!("selftest {word}");
            assert_eq!(Arguments::parse(&line), Err(word));
            let (passed, text) = outcome(&board(&[&ERASED, &ERASED], None), &line);
            assert!(!passed && text.contains(word), "{text}");
        }
    }

    #[test]
    fn text_that_cannot_be_written_is_an_error() {
        struct Shut;
        impl Write for Shut {
            fn write_str(&mut self, _: &str) -> fmt::Result {
                Err(fmt::Error)
            }
        }
        assert!(run::<Portable>(&board(&[&ERASED, &ERASED], None), "selftest", &mut Shut).is_err());
    }
}

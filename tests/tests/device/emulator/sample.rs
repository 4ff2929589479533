//! What a sample takes, from counts to verdict, alone and with every effect that has a memory.

use super::models::{model, network, with_effect};
use super::run;
use jointwatch::emulate::selftest::Board;
use jointwatch_shared::base::Model;
use jointwatch_shared::base::network::NEURONS;
use jointwatch_shared::effect::{EFFECTS, Entry, Subsystem};
use jointwatch_shared::wire::blob;

/// A base: its name in the report, how a model of it is made, the most instructions that a sample
/// may take with it alone, and with one effect with memory beside it.
type Base = (&'static str, fn() -> Model, u32, u32);
const BASES: [Base; 2] = [
    ("reference", || model(2, 19), 3300, 4500),
    ("network", || network(2, NEURONS, 12), 3670, 4500),
];
/// The most that a sample may take where a block of the monitor ends.
const MAX_AT_END: u32 = 6500;
/// The most that a line of the mains in either force channel may add to a sample.
const MAX_OF_LINES: u32 = 260;

#[test]
fn a_sample_takes_no_more_instructions_than_stated() {
    let with_memory =
        |entry: &&Entry| entry.subsystem == Subsystem::Plant && !entry.state_bounds.is_empty();
    for (base, make, alone, beside) in BASES {
        for (number, effect) in EFFECTS.iter().filter(with_memory).enumerate() {
            let slot = with_effect(make(), effect);
            let report = run(Board::Stm32f405, Some(&blob::encode(&slot)), 0);
            let effect = effect.about.name;
            for (slot, what, most) in [(base, "alone", alone), ("a", effect, beside)] {
                let counted = report.model(slot).and_then(|model| model.sample);
                let counted = counted.unwrap_or_else(|| panic!("no count of {what}: {report:?}"));
                assert!(counted.most <= most, "{base}, {what}: {counted:?}");
                let ending = report.model(slot).and_then(|model| model.ending);
                let ending = ending.unwrap_or_else(|| panic!("no count of {what}: {report:?}"));
                assert!(
                    (counted.least..=MAX_AT_END).contains(&ending),
                    "{base}, {what}: {ending} at a block's end"
                );
                let humming = report.model(slot).and_then(|model| model.humming);
                let humming = humming.unwrap_or_else(|| panic!("no count of {what}: {report:?}"));
                // The same with every effect.
                if what != "alone" || number == 0 {
                    println!(
                        "{base}, {what}: {} to {} instructions, {ending} at a block's end; with lines of the mains {} to {}",
                        counted.least, counted.most, humming.least, humming.most
                    );
                }
                let more = humming.most.saturating_sub(counted.most);
                assert!(
                    (1..=MAX_OF_LINES).contains(&more),
                    "{base}, {what}: {more} more"
                );
            }
        }
    }
}

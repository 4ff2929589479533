//! A healthy run: the host's bits, and what a sample and the image cost.

use super::subject::{RATE_HZ, counters, image, same_bits, subject, validation};
use jointwatch::emulate::bench::{REST, Scenario};
use jointwatch::emulate::device::Device;
use jointwatch::emulate::size;
use jointwatch_shared::monitor::State;
use jointwatch_shared::telemetry::{Counters, Event};

/// What the estimate of the highest sample rate in `docs/firmware.md` rests on: a full board's time on the bus, from the data sheets' clocks;
/// the processor's clock; and cycles per instruction, which no emulator counts.
const BUS_S: f64 = 120e-6;
const CLOCK_HZ: f64 = 168e6;
const CYCLES_PER_INSTRUCTION: f64 = 1.5;

#[test]
fn a_healthy_run_has_the_hosts_bits_and_counts_its_costs() {
    let subject = subject();
    let rows = validation().rows as u64;
    for model in [&subject.polynomial, &subject.physical] {
        let device = Device::new(&subject.simulation.study, model, None).unwrap();
        let slot = device.slot().unwrap().to_bytes();
        let emulated = device
            .run(image(), &slot, validation(), &[], Scenario::default())
            .unwrap_or_else(|why| panic!("{why}"));
        let (run, c) = (&emulated.run, &emulated.run.comparison);
        same_bits(run);
        assert_eq!(run.instants, REST + rows);
        assert_eq!(c.samples, run.instants, "every sample is streamed");
        assert_eq!(c.wrong_counts, 0, "{:?}", run.wrong);
        let fill = 2 * device.set_up.chain.delay() as u64;
        assert_eq!(c.replayed, rows - fill);
        // Clearances have no memory: replay of the record alone says the same.
        assert_eq!(c.different_replayed_bits, 0, "{c:?}");
        assert_eq!((run.tally.lost, run.tally.damaged), (0, 0));
        assert_eq!(counters(run), Counters::default());
        println!("{:?}", run.events);
        let started = |event: &Event| matches!(event, Event::Started { .. });
        assert!(run.events.iter().any(started));
        assert!(
            run.events.contains(&Event::NoCrystal),
            "QEMU has no crystal"
        );
        let last = run.statuses.last().and_then(|s| s.verdict.read()).unwrap();
        assert_ne!(last.state, State::Alarm, "{last:?}");

        let memory = run.memory.expect("the device counts");
        let size = size::of(image()).unwrap();
        println!("{:?}\n{memory:?} {size:?}", run.instructions);
        assert!(size.flash <= 96 * 1024, "{size:?}");
        assert!(memory.variables <= 24 * 1024, "{memory:?}");
        assert!(
            4 * memory.stack_peak <= 3 * memory.stack_reserved,
            "{memory:?}"
        );
        let [_, evaluate, monitor, _] = &run.instructions[..] else {
            panic!("four steps: {:?}", run.instructions);
        };
        let computed = f64::from(evaluate.most + monitor.most) * CYCLES_PER_INSTRUCTION / CLOCK_HZ;
        println!(
            "{:.0} µs of computation and {:.0} µs on the bus",
            1e6 * computed,
            1e6 * BUS_S
        );
        assert!(computed + BUS_S <= 1.0 / 5000.0, "no 5 kHz: {computed} s");
        let seconds = rows as f64 / RATE_HZ;
        println!(
            "{:.2} times real time",
            seconds / emulated.took.as_secs_f64()
        );
    }
}

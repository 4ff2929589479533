//! A healthy run: the host's bits, and what a sample and the image cost.

use super::subject::{RATE_HZ, counters, image, same_bits, subject, validation};
use jointwatch::emulate::bench::{REST, STAGES, Scenario};
use jointwatch::emulate::device::EmulatedDevice;
use jointwatch::emulate::selftest::{self, Board};
use jointwatch::emulate::size;
use jointwatch_shared::monitor::State;
use jointwatch_shared::wire::telemetry::{Counters, Event};

/// What the estimate of the highest sample rate in `docs/explanation/firmware.md` rests on: a full
/// board's time on the bus, from the data sheets' clocks; the processor's clock; and cycles per
/// instruction, which no emulator counts.
const BUS_S: f64 = 120e-6;
const CLOCK_HZ: f64 = 168e6;
const CYCLES_PER_INSTRUCTION: f64 = 1.5;
/// Bytes of flash and of variables that an image may take.
const MAX_FLASH: u64 = 192 * 1024;
const MAX_VARIABLES: u32 = 40 * 1024;
/// Instructions of a start: as `docs/explanation/numerics.md` states.
const MAX_OF_START: u32 = 4_400_000;

#[test]
fn a_healthy_run_has_the_hosts_bits_and_counts_its_costs() {
    let subject = subject();
    let rows = validation().rows as u64;
    let flashed = selftest::build(Board::Stm32f405, "jointwatch").unwrap();
    let flash = [&flashed, image()].map(|image| size::of(image).unwrap().flash);
    println!(
        "flash: {} bytes of the image that is flashed, {} of the emulated one; at most {MAX_FLASH}",
        flash[0], flash[1]
    );
    assert!(flash.iter().all(|bytes| *bytes <= MAX_FLASH), "{flash:?}");
    for model in [&subject.polynomial, &subject.physical] {
        let device = EmulatedDevice::new(&subject.simulation.study, model, None).unwrap();
        let slot = device.slot().unwrap().to_bytes();
        let emulated = device
            .run(image(), &slot, validation(), &[], Scenario::default())
            .unwrap_or_else(|why| panic!("{why}"));
        let (run, c) = (&emulated.run, &emulated.run.comparison);
        same_bits(run);
        assert_eq!(run.instants, REST + rows);
        assert_eq!(c.samples, run.instants, "every sample is streamed");
        assert_eq!(c.wrong_counts, 0, "{:?}", run.said.wrong);
        let fill = 2 * device.set_up.chain.delay() as u64;
        assert_eq!(c.replayed, rows - fill);
        // Clearances have no memory: replay of the record alone says the same.
        assert_eq!(c.different_replayed_bits, 0, "{c:?}");
        assert_eq!((run.tally.lost, run.tally.damaged), (0, 0));
        assert_eq!(counters(run), Counters::default());
        println!("{:?}", run.said.events);
        let started = |event: &Event| matches!(event, Event::Started { .. });
        assert!(run.said.events.iter().any(started));
        assert!(
            run.said.events.contains(&Event::NoCrystal),
            "QEMU has no crystal"
        );
        let last = run
            .said
            .statuses
            .last()
            .and_then(|s| s.verdict.read())
            .unwrap();
        assert_ne!(last.state, State::Alarm, "{last:?}");

        let memory = run.memory.expect("the device counts");
        println!(
            "RAM: {} bytes of variables; at most {MAX_VARIABLES}",
            memory.variables
        );
        println!(
            "stack: {} of {} bytes at its peak, {:.1} %; at most 75 %",
            memory.stack_peak,
            memory.stack_reserved,
            100.0 * f64::from(memory.stack_peak) / f64::from(memory.stack_reserved)
        );
        let start = run.start.expect("the device counts");
        println!(
            "start: {:.1} million instructions, a signature among them",
            1e-6 * f64::from(start)
        );
        assert!(start <= MAX_OF_START, "{start}");
        for (stage, count) in STAGES.iter().zip(&run.instructions) {
            let mean = count.sum as f64 / count.samples as f64;
            println!(
                "{stage}: {mean:.0} instructions per sample in the mean, {} to {}",
                count.least, count.most
            );
        }
        assert!(memory.variables <= MAX_VARIABLES, "{memory:?}");
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

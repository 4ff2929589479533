//! The firmware's drivers against chips written from the datasheets alone: each tells the other's
//! mistakes.

use jointwatch::emulate::board::{Board, BoardChip, DropOuts, Injection, Trouble};
use jointwatch_firmware::sensor::acquire::{Acquired, CHIPS, CONVERTER};
use jointwatch_firmware::sensor::presence::{BACK_WITHIN, ChipState};
use jointwatch_shared::wire::wiring::{
    AxisWiring, Counter, Readings, Signed, SignedDirection, Wiring,
};
use jointwatch_tests::bus::{Chips, chips};
use std::cell::RefCell;
use std::rc::Rc;

/// Every setting different, so that one that lands in the wrong place is seen.
fn wiring() -> Wiring {
    let mut wiring = Wiring::unconfigured();
    for (place, (quadrature, start)) in [(1, 7), (2, -100), (4, 0), (4, 1 << 30)]
        .into_iter()
        .enumerate()
    {
        wiring.counters[place] = Some(Counter {
            quadrature,
            start,
            index: place == 2,
        });
    }
    wiring.converter.gain_log2 = [5, 6, 0, 7];
    wiring.converter.oversampling = 2;
    for (place, range) in [3, 2].into_iter().enumerate() {
        if let Some(chip) = &mut wiring.accelerometers[place] {
            (chip.range, chip.filter) = (range, place as u8);
        }
    }
    let signed = |place, negative| Signed { place, negative };
    let direction = |chip, direction, negative| {
        Some(SignedDirection {
            chip,
            direction,
            negative,
        })
    };
    for (far, acceleration) in [
        (0, [direction(0, 0, false), None]),
        (2, [direction(1, 2, false), direction(0, 2, true)]),
    ] {
        let turns = acceleration[1].is_some();
        let axis = AxisWiring {
            far: signed(far, false),
            near: Some(signed(far + 1, true)),
            body: Some(signed(far + 1, true)),
            force: signed(far / 2, far > 0),
            input: Some(signed(3 - far / 2, far == 0)),
            acceleration,
            pair_distance_m: if turns { 0.1 } else { 0.0 },
        };
        assert!(wiring.axes.push(axis).is_ok());
    }
    wiring.check().unwrap();
    wiring
}

struct Bench {
    board: Rc<RefCell<Board>>,
    sensors: Chips,
    wiring: Wiring,
    rest: Readings,
}

impl Bench {
    fn new(injections: Vec<Injection>, drop_outs: Option<DropOuts>) -> Self {
        let wiring = wiring();
        let board = Board::new(&wiring, 2000.0, 11).with_troubles(injections, drop_outs);
        let board = Rc::new(RefCell::new(board));
        let sensors = chips(&board, &wiring);
        Self {
            board,
            sensors,
            rest: wiring.at_rest(),
            wiring,
        }
    }

    fn sample(&mut self, readings: &Readings) -> Acquired {
        self.board.borrow_mut().next_instant(readings);
        self.sensors.acquire(&self.wiring)
    }

    /// Until the chips run.
    fn started(injections: Vec<Injection>, drop_outs: Option<DropOuts>) -> Self {
        let mut bench = Self::new(injections, drop_outs);
        let rest = bench.rest;
        for _ in 0..63 {
            bench.sample(&rest);
        }
        assert_eq!(bench.sample(&rest).health, [ChipState::Ok; CHIPS]);
        bench
    }
}

/// Something else in every chip at every instant, rails included.
fn readings(n: i32) -> Readings {
    let wave = |factor: i32| (n.wrapping_mul(7919).wrapping_add(factor * 104_729)) % 500_000;
    Readings {
        counters: [wave(1), wave(2) * 3, -wave(3), (1 << 30) + wave(4)],
        channels: [wave(5) * 16, -wave(6) * 16, (1 << 23) - 1, -(1 << 23)],
        accelerations: [
            [wave(7), -wave(8), (1 << 19) - 1],
            [-(1 << 19), wave(9), wave(10)],
        ],
    }
}

#[test]
fn every_code_of_every_chip_arrives_at_its_instant() {
    let mut bench = Bench::started(Vec::new(), None);
    for n in 0..2000 {
        let wanted = readings(n);
        let acquired = bench.sample(&wanted);
        assert_eq!(acquired.readings, wanted, "sample {n}");
        assert!(acquired.usable(), "{:?}", acquired.health);
        assert_eq!(acquired.saturated_channels, 0b1100);
        assert_eq!(acquired.saturated_directions, [0b100, 0b001]);
    }
}

#[test]
fn every_trouble_of_every_chip_is_noticed_where_it_can_be_and_passes() {
    let places = (0..4)
        .map(BoardChip::Counter)
        .chain([BoardChip::Converter])
        .chain((0..2).map(BoardChip::Accelerometer));
    for (chip, place) in places.enumerate() {
        for trouble in [
            Trouble::Silent(0x00),
            Trouble::Silent(0xFF),
            Trouble::Damaged,
            Trouble::Replaced,
            Trouble::PowerCut,
            Trouble::Stuck,
            Trouble::Saturated,
        ] {
            let samples = 100..300;
            let injection = Injection {
                place,
                trouble,
                samples: samples.clone(),
            };
            let mut bench = Bench::started(vec![injection], None);
            let mut seen = Vec::new();
            for n in 64..1000_u64 {
                let acquired = bench.sample(&readings(n as i32));
                for (other, health) in acquired.health.into_iter().enumerate() {
                    if other != chip {
                        assert!(health.usable(), "{other} beside {place:?} {trouble:?}");
                    }
                }
                if samples.contains(&n) && !seen.contains(&acquired.health[chip]) {
                    seen.push(acquired.health[chip]);
                }
                if n >= samples.end + u64::from(BACK_WITHIN) {
                    assert!(
                        acquired.health[chip].usable(),
                        "{place:?} after {trouble:?}: {:?} at {n}",
                        acquired.health[chip]
                    );
                }
            }
            println!("{place:?} {trouble:?}: {seen:?}");
            let is_counter = chip < CONVERTER;
            let unseen = match trouble {
                // A count carries no checksum and may stand still.
                Trouble::Stuck => true,
                Trouble::Saturated | Trouble::Damaged if is_counter => true,
                // Two axes of an accelerometer carry none either.
                Trouble::Damaged if chip > CONVERTER => true,
                _ => false,
            };
            let bad = seen.iter().any(|health| *health != ChipState::Ok);
            assert!(bad || unseen, "{place:?} {trouble:?}: {seen:?}");
            if place == BoardChip::Converter && trouble == Trouble::Damaged {
                assert!(seen.contains(&ChipState::Crc));
            }
        }
    }
}

#[test]
fn transfers_that_drop_out_do_no_lasting_harm() {
    for part in [0.01, 0.1, 0.5] {
        let drop_outs = DropOuts {
            part,
            samples: 64..1064,
        };
        let mut bench = Bench::started(Vec::new(), Some(drop_outs));
        let mut unusable = 0;
        for n in 64..1064 {
            unusable += u32::from(!bench.sample(&readings(n)).usable());
        }
        assert!(f64::from(unusable) > 300.0 * part, "{unusable} at {part}");
        let back = 1064 + i32::from(BACK_WITHIN);
        for n in 1064..back {
            bench.sample(&readings(n));
        }
        let acquired = bench.sample(&readings(back));
        assert!(acquired.usable(), "{part}: {:?}", acquired.health);
        assert_eq!(acquired.readings.channels, readings(back).channels);
        println!("{part}: {unusable} of 1000 samples were not usable");
    }
}

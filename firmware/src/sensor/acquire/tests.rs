//! The whole board against chips that keep registers as the real ones do: faults come, stay, and
//! go.

use super::super::presence::{
    FAILURES_ALLOWED, FIRST_WAIT, LONGEST_WAIT, STALE_ALLOWED, TIME_TO_START,
};
use super::chips::{AccelerometerChip, Chip, ConverterChip, CounterChip, SelectLine};
use super::*;
use heapless::Vec as Bounded;
use jointwatch_shared::monitor::limits::CHANNELS as CHANNELS_OF_AXIS;
use jointwatch_shared::wire::wiring::{AxisWiring, Signed, SignedDirection};
use std::cell::RefCell;
use std::rc::Rc;
use std::vec::Vec;

/// A board with all its chips, and the lines by which the test breaks them.
struct Board {
    counters: Vec<Rc<RefCell<CounterChip>>>,
    converter: Rc<RefCell<ConverterChip>>,
    accelerometers: Vec<Rc<RefCell<AccelerometerChip>>>,
    latch: SelectLine<CounterChip>,
    counter_lines: Vec<SelectLine<CounterChip>>,
    converter_line: SelectLine<ConverterChip>,
    accelerometer_lines: Vec<SelectLine<AccelerometerChip>>,
    sensors: Sensors<
        SelectLine<CounterChip>,
        SelectLine<CounterChip>,
        SelectLine<ConverterChip>,
        SelectLine<AccelerometerChip>,
    >,
    wiring: Wiring,
}

fn wiring() -> Wiring {
    let counter = |place| Signed {
        place,
        negative: place == 1,
    };
    let turning = |chip| SignedDirection {
        chip,
        direction: 2,
        negative: chip == 0,
    };
    let mut axes = Bounded::new();
    let x = AxisWiring {
        far: counter(0),
        near: Some(counter(1)),
        body: Some(counter(1)),
        force: counter(0),
        input: Some(counter(2)),
        acceleration: [
            Some(SignedDirection {
                direction: 0,
                ..turning(1)
            }),
            None,
        ],
        pair_distance_m: 0.0,
    };
    let phi = AxisWiring {
        far: counter(2),
        near: Some(counter(3)),
        body: None,
        force: counter(1),
        input: None,
        acceleration: [Some(turning(1)), Some(turning(0))],
        pair_distance_m: 0.12,
    };
    axes.push(x).unwrap();
    axes.push(phi).unwrap();
    let wiring = Wiring {
        axes,
        ..Wiring::unconfigured()
    };
    wiring.check().unwrap();
    wiring
}

impl Board {
    fn new() -> Self {
        let wiring = wiring();
        let counters: Vec<Rc<RefCell<CounterChip>>> = (0..4).map(|_| Rc::default()).collect();
        counters.iter().for_each(|c| c.borrow_mut().lose_power());
        let converter = Rc::default();
        let accelerometers: Vec<_> = (0..2).map(|_| Rc::default()).collect();
        let latch = SelectLine::to(counters.clone());
        let counter_lines: Vec<_> = counters
            .iter()
            .map(|c| SelectLine::to(std::vec![c.clone()]))
            .collect();
        let converter_line = SelectLine::to(std::vec![Rc::clone(&converter)]);
        let accelerometer_lines: Vec<_> = accelerometers
            .iter()
            .map(|c| SelectLine::to(std::vec![Rc::clone(c)]))
            .collect();
        let sensors = Sensors::new(
            &wiring,
            latch.clone(),
            std::array::from_fn(|at| counter_lines[at].clone()),
            converter_line.clone(),
            std::array::from_fn(|at| accelerometer_lines[at].clone()),
        );
        Self {
            counters,
            converter,
            accelerometers,
            latch,
            counter_lines,
            converter_line,
            accelerometer_lines,
            sensors,
            wiring,
        }
    }

    fn acquire(&mut self) -> Acquired {
        self.sensors.acquire(&self.wiring)
    }

    /// So many samples; the last of them.
    fn run(&mut self, samples: u16) -> Acquired {
        (0..samples).fold(Acquired::default(), |_, _| self.acquire())
    }

    /// Until every chip runs.
    fn started() -> Self {
        let mut board = Self::new();
        let acquired = board.run(TIME_TO_START + 3);
        assert_eq!(acquired.health, [ChipState::Ok; CHIPS]);
        board
    }

    fn move_rig(&mut self, by: i32) {
        for (n, counter) in (1..).zip(&self.counters) {
            counter.borrow_mut().count += n * by;
        }
        self.converter.borrow_mut().codes = [10, -20, 30, -40].map(|code| code * by);
        for (n, chip) in (1..).zip(&self.accelerometers) {
            chip.borrow_mut().codes = [n * by, 0, n * n * by];
        }
    }
}

#[test]
fn every_code_arrives_in_its_place_with_its_sign() {
    let mut board = Board::started();
    board.move_rig(100);
    let acquired = board.acquire();
    assert!(acquired.usable());
    let [x, phi] = acquired.sample;
    assert_eq!((x.displacement, x.body), ([100, -200], -200));
    assert_eq!((x.force, x.acceleration), (1000, 200));
    assert_eq!((x.input, phi.input), (3000, 0));
    assert_eq!((phi.displacement, phi.body), ([300, 400], 0));
    // The pair turns: code of chip 1 minus code of chip 0. Channel 1 is wired the other way round.
    assert_eq!((phi.force, phi.acceleration), (2000, 400 - 100));
    assert_eq!(
        (acquired.saturated_channels, acquired.saturated_directions),
        (0, [0; 2])
    );
}

#[test]
fn an_input_at_its_rail_is_told_as_a_fault_of_the_input_alone() {
    let mut board = Board::started();
    board.converter.borrow_mut().codes[2] = (1 << 23) - 1;
    let faults = board.acquire().faults(&board.wiring);
    assert_eq!(faults.saturated, Faults::bit(0, CHANNELS_OF_AXIS - 1));
    assert_eq!(faults.checksum | faults.time_out | faults.missing, 0);
}

#[test]
fn counters_belong_to_the_instant_of_the_latch() {
    let mut board = Board::started();
    board.move_rig(1);
    // The converter's line is used between latch and read-out: what moves then is not seen before
    // the next sample.
    let counter = Rc::clone(&board.counters[0]);
    let converter = Rc::clone(&board.converter);
    struct Moving(Rc<RefCell<CounterChip>>, Rc<RefCell<ConverterChip>>);
    impl Chip for Moving {
        fn select(&mut self, bytes: &mut [u8]) {
            self.0.borrow_mut().count += 50;
            self.1.borrow_mut().select(bytes);
        }
    }
    let moving = Rc::new(RefCell::new(Moving(counter, converter)));
    let mut sensors = Sensors::new(
        &board.wiring,
        board.latch.clone(),
        std::array::from_fn(|at| board.counter_lines[at].clone()),
        SelectLine::to(std::vec![moving]),
        std::array::from_fn(|at| board.accelerometer_lines[at].clone()),
    );
    // Until all run: the counters kept their settings, so their counts go on.
    for _ in 0..TIME_TO_START + 3 {
        sensors.acquire(&board.wiring);
    }
    let before = board.counters[0].borrow().count;
    let acquired = sensors.acquire(&board.wiring);
    assert_eq!(acquired.sample[0].displacement[0], before);
    assert_eq!(board.counters[0].borrow().count, before + 100, "two frames");
    assert_eq!(sensors.counter_restarts(0), 0);
}

#[test]
fn one_broken_line_stops_nothing_else_and_its_last_code_stays() {
    for chip in 0..CHIPS {
        let mut board = Board::started();
        board.move_rig(100);
        let before = board.acquire();
        let line = match chip {
            0..COUNTERS => &board.counter_lines[chip].broken,
            CONVERTER => &board.converter_line.broken,
            _ => &board.accelerometer_lines[chip - CONVERTER - 1].broken,
        };
        let line = Rc::clone(line);
        *line.borrow_mut() = true;
        board.move_rig(100);
        board.move_rig(70);
        for sample in 0..100 {
            let acquired = board.acquire();
            for (other, health) in acquired.health.into_iter().enumerate() {
                let wanted = if other == chip {
                    ChipState::Bus
                } else {
                    ChipState::Ok
                };
                assert_eq!(health, wanted, "{}, sample {sample}", CHIP_NAMES[other]);
            }
            assert!(!acquired.usable());
            let (now, old) = (acquired.readings, before.readings);
            for place in 0..COUNTERS {
                assert_eq!(now.counters[place] == old.counters[place], place == chip);
            }
            assert_eq!(now.channels == old.channels, chip == CONVERTER);
            for place in 0..ACCELEROMETERS {
                let held = now.accelerations[place] == old.accelerations[place];
                assert_eq!(held, chip == CONVERTER + 1 + place);
            }
        }
        // It comes back by itself, and a counter that kept its supply kept its count.
        *line.borrow_mut() = false;
        let acquired = board.run(300);
        assert_eq!(acquired.health, [ChipState::Ok; CHIPS]);
        assert_eq!(acquired.readings.counters[0], 270);
    }
}

#[test]
fn a_missing_chip_is_tried_ever_more_rarely_and_found_when_it_comes() {
    let mut board = Board::new();
    *board.converter_line.broken.borrow_mut() = true;
    let used = Rc::clone(&board.converter_line.used);
    let mut attempts = Vec::new();
    for sample in 0..20_000_u32 {
        let before = *used.borrow();
        let acquired = board.acquire();
        if *used.borrow() > before {
            attempts.push(sample);
        }
        let health = acquired.health[CONVERTER];
        assert_eq!(health, ChipState::Bus);
    }
    let waits: Vec<u32> = attempts.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert_eq!(attempts[0], 0);
    for (number, wait) in waits.iter().enumerate() {
        let wanted = (u32::from(FIRST_WAIT) << number.min(20)).min(LONGEST_WAIT.into());
        assert_eq!(*wait, wanted + 1, "attempt {number}");
    }
    *board.converter_line.broken.borrow_mut() = false;
    let acquired = board.run(LONGEST_WAIT + TIME_TO_START + 4);
    assert_eq!(acquired.health, [ChipState::Ok; CHIPS]);
}

#[test]
fn a_wrong_chip_and_an_absent_one_are_named() {
    let mut board = Board::new();
    board.accelerometers[1].borrow_mut().part = 0xF2;
    board.counters[2].borrow_mut().absent = true;
    let health = board.run(200).health;
    let mut wanted = [ChipState::Ok; CHIPS];
    (wanted[2], wanted[CONVERTER + 2]) = (ChipState::Identity, ChipState::Identity);
    assert_eq!(health, wanted);
}

#[test]
fn a_counter_that_loses_its_supply_is_noticed_within_a_round_and_begins_anew() {
    for place in 0..COUNTERS {
        let mut board = Board::started();
        board.move_rig(100);
        board.acquire();
        assert_eq!(board.sensors.counter_restarts(place), 1);
        board.counters[place].borrow_mut().lose_power();
        let noticed = (0..COUNTERS).any(|_| board.acquire().health[place] == ChipState::Restarted);
        assert!(noticed, "counter {place}");
        let acquired = board.run(FIRST_WAIT + TIME_TO_START + 4);
        assert_eq!(acquired.health, [ChipState::Ok; CHIPS]);
        assert_eq!(acquired.readings.counters[place], 0);
        assert_eq!(board.sensors.counter_restarts(place), 2);
    }
}

#[test]
fn damaged_frames_and_a_converter_that_stands_still_are_told_apart() {
    let mut board = Board::started();
    board.converter.borrow_mut().damages_frames = true;
    for _ in 0..5 {
        assert_eq!(board.acquire().health[CONVERTER], ChipState::Crc);
    }
    board.converter.borrow_mut().damages_frames = false;
    assert_eq!(
        board.acquire().health[CONVERTER],
        ChipState::Ok,
        "five are forgiven"
    );

    board.converter.borrow_mut().converts = false;
    // The frame after the last conversion still brings it.
    let told = (0..2 * STALE_ALLOWED)
        .position(|_| board.acquire().health[CONVERTER] == ChipState::TimedOut);
    assert_eq!(told, Some(usize::from(STALE_ALLOWED) + 1));
    let health = board.run(40).health;
    assert_eq!(health[CONVERTER], ChipState::TimedOut);
    board.converter.borrow_mut().converts = true;
    assert_eq!(board.run(200).health, [ChipState::Ok; CHIPS]);
}

#[test]
fn a_latch_that_fails_concerns_the_counters_only() {
    let mut board = Board::started();
    board.move_rig(100);
    let before = board.acquire();
    *board.latch.broken.borrow_mut() = true;
    board.move_rig(5);
    for _ in 0..FAILURES_ALLOWED {
        let acquired = board.acquire();
        assert_eq!(acquired.health[..COUNTERS], [ChipState::Bus; COUNTERS]);
        assert_eq!(acquired.health[CONVERTER..], [ChipState::Ok; 3]);
        assert_eq!(acquired.readings.counters, before.readings.counters);
    }
    *board.latch.broken.borrow_mut() = false;
    let acquired = board.run(200);
    assert_eq!(acquired.health, [ChipState::Ok; CHIPS]);
    assert_eq!(acquired.readings.counters, [105, 210, 315, 420]);
}

#[test]
fn saturated_codes_pass_and_are_marked() {
    let mut board = Board::started();
    board.converter.borrow_mut().codes = [0, (1 << 23) - 1, -(1 << 23), 5];
    board.accelerometers[0].borrow_mut().codes = [0, 0, -(1 << 19)];
    let acquired = board.run(2);
    let mut wanted = [ChipState::Ok; CHIPS];
    (wanted[CONVERTER], wanted[CONVERTER + 1]) = (ChipState::Saturated, ChipState::Saturated);
    assert_eq!(acquired.health, wanted);
    assert_eq!(
        (acquired.saturated_channels, acquired.saturated_directions),
        (0b0110, [0b100, 0])
    );
    assert_eq!(acquired.sample[1].force, -((1 << 23) - 1));
    assert!(acquired.usable());
}

#[test]
fn a_board_that_lacks_chips_does_not_talk_to_them() {
    let board = Board::new();
    let mut wiring = Wiring::unconfigured();
    wiring.counters[3] = None;
    wiring.accelerometers[0] = None;
    let mut sensors = Sensors::new(
        &wiring,
        board.latch.clone(),
        std::array::from_fn(|at| board.counter_lines[at].clone()),
        board.converter_line.clone(),
        std::array::from_fn(|at| board.accelerometer_lines[at].clone()),
    );
    let health = (0..100).fold([ChipState::Ok; CHIPS], |_, _| {
        sensors.acquire(&wiring).health
    });
    let mut wanted = [ChipState::Ok; CHIPS];
    (wanted[3], wanted[CONVERTER + 1]) = (ChipState::NotFitted, ChipState::NotFitted);
    assert_eq!(health, wanted);
    assert_eq!(*board.counter_lines[3].used.borrow(), 0);
    assert_eq!(*board.accelerometer_lines[0].used.borrow(), 0);
}

#[test]
fn numbers_of_health_are_never_reused() {
    for (number, health) in ChipState::ALL.into_iter().enumerate() {
        assert_eq!(health as usize, number, "{}", health.name());
    }
}

#[test]
fn the_monitor_hears_of_the_channels_that_a_chip_feeds() {
    let wiring = wiring();
    let mut acquired = Acquired {
        health: [ChipState::Ok; CHIPS],
        ..Acquired::default()
    };
    assert!(!acquired.faults(&wiring).any());
    let bits = |channels: &[(usize, usize)]| {
        channels.iter().fold(0, |bits, &(axis, channel)| {
            bits | Faults::bit(axis, channel)
        })
    };
    // Counter 1 is the near side and the body of x; accelerometer 1 feeds both axes; channel 1 is
    // the torque, 2 what effects of x follow.
    acquired.health[1] = ChipState::Restarted;
    acquired.health[CONVERTER] = ChipState::Saturated;
    acquired.saturated_channels = 0b0110;
    acquired.health[CONVERTER + 2] = ChipState::Crc;
    let faults = acquired.faults(&wiring);
    assert_eq!(faults.time_out, bits(&[(0, 1), (0, 2)]));
    assert_eq!(faults.saturated, bits(&[(0, 5), (1, 4)]));
    assert_eq!(faults.checksum, bits(&[(0, 3), (1, 3)]));
    assert_eq!((faults.missing, faults.out_of_range), (0, 0));
    // A direction at its rail concerns who uses it: z of chip 0 the rotation, x of chip 0 nobody.
    acquired = Acquired {
        health: [ChipState::Ok; CHIPS],
        saturated_directions: [0b101, 0],
        ..Acquired::default()
    };
    acquired.health[CONVERTER + 1] = ChipState::Saturated;
    acquired.health[2] = ChipState::Starting;
    let faults = acquired.faults(&wiring);
    assert_eq!(faults.saturated, bits(&[(1, 3)]));
    assert_eq!(faults.missing, bits(&[(1, 0)]));
    assert_eq!((faults.time_out, faults.checksum), (0, 0));
}

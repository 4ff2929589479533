//! The screen against frames whose truth is known, drawn into a buffer, by a clock that the test
//! moves.

use super::draw::draw;
use super::screen::Pace;
use crate::device::live::LiveView;
use crate::device::telemetry::line::Source;
use crate::device::telemetry::listen::{Heard, Listener};
use crate::device::telemetry::steady::{Caught, News, SteadyLine, Wanted};
use jointwatch_shared::monitor::{self, Cause, State};
use jointwatch_shared::wire::telemetry::{
    Access, AxisHealth, AxisIdentity, AxisStatus, Counters, Decoder, Event, Health, Hello,
    MAX_FRAME, ModelIdentity, Occasion, PROTOCOL_VERSION, Quantity, Report, Request, RigIdentity,
    Sample, SampleOutput, SensorStatus, Slot, Status, Text, encode,
};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

const RATE_HZ: f64 = 5000.0;
const DELAY: u64 = 20;

/// A device that says what a test wants.
#[derive(Default)]
struct Device {
    sequence: u16,
    bytes: Vec<u8>,
}

impl Device {
    fn say(&mut self, report: &Report) {
        let mut place = [0; MAX_FRAME];
        let frame = encode(report, self.sequence, &mut place).unwrap();
        self.bytes.extend_from_slice(frame);
        self.sequence = self.sequence.wrapping_add(1);
    }

    fn hello(&mut self, names: [&str; 2]) {
        let axis = |name: &str, kind, force_per_lsb| AxisIdentity {
            name: Text::try_from(name).unwrap(),
            kind,
            force_per_lsb,
        };
        let axes = [
            axis(names[0], Quantity::Translation, 0.5),
            axis(names[1], Quantity::Rotation, 0.25),
        ];
        self.say(&Report::Hello(Hello {
            protocol: PROTOCOL_VERSION,
            firmware: [1, 2, 3],
            occasion: Occasion::Restart,
            model: Some(ModelIdentity {
                slot: Slot::A,
                crc: 0xcafe,
                signed: true,
                sample_rate_hz: RATE_HZ,
                axes: axes.into_iter().collect(),
            }),
            rig: Some(RigIdentity {
                crc: 7,
                sample_rate_hz: RATE_HZ,
                delay: DELAY as u16,
                band_delay: 84,
            }),
            access: Access::default(),
        }));
    }

    /// A sample with forces of 40 and 30 units of x, and of φ with a slow sine.
    fn sample(&mut self, number: u64) {
        let phase = number as f64 / RATE_HZ * std::f64::consts::TAU;
        let wave = (400.0 * phase.sin()) as i32;
        self.say(&Report::Sample(Sample {
            sample: number,
            counts: [[wave, 3, 0, 0, 0, 0], [0; 6]].into_iter().collect(),
            output: Some(SampleOutput {
                outside: 0,
                saturated: 0,
                measured: [40, wave],
                predicted: [30, wave - 4],
                residual: [10, 4],
                residual_band: None,
            }),
        }));
    }

    fn status(&mut self, number: u64, verdicts: [monitor::Verdict; 2], late: u32) {
        let error = AxisStatus {
            nmse_fast: Some(1250),
            nmse_slow: None,
        };
        let mut channels = [SensorStatus::default(); 10];
        channels[4].fault = Cause::Stuck.tag();
        self.say(&Report::Status(Status {
            sample: number,
            verdict: verdicts[0].into(),
            outside_permille: 25,
            axes: [error, error].into_iter().collect(),
            channels: channels.into_iter().collect(),
            counters: Counters {
                missed_deadlines: late,
                ..Counters::default()
            },
            development_key: false,
        }));
        let axis = |verdict: monitor::Verdict| AxisHealth {
            verdict: verdict.into(),
            judged_permille: 870,
            unjudged_samples: 6000,
        };
        self.say(&Report::Health(Health {
            sample: number,
            samples_lost: 0,
            axes: verdicts.map(axis).into_iter().collect(),
        }));
    }
}

fn verdict(state: State, cause: Cause, axis: u8, permille: u16) -> monitor::Verdict {
    monitor::Verdict {
        state,
        cause,
        axis,
        channel: 0,
        permille,
    }
}

fn healthy(axis: u8) -> monitor::Verdict {
    verdict(State::Healthy, Cause::AsExpected, axis, 0)
}

/// What stands on the screen, row by row.
fn screen(view: &LiveView, now: Duration, size: [u16; 2]) -> String {
    let mut terminal = Terminal::new(TestBackend::new(size[0], size[1])).unwrap();
    let drawn = terminal
        .draw(|frame| draw(frame, view, now, false))
        .unwrap();
    let cells = drawn.buffer.content();
    let rows = cells.chunks(usize::from(size[0]));
    let text = |row: &[ratatui::buffer::Cell]| row.iter().map(|c| c.symbol()).collect::<String>();
    rows.map(|row| text(row) + "\n").collect()
}

fn view_of(bytes: &[u8], now: Duration) -> LiveView {
    let mut view = LiveView::new("COM3");
    let mut listener = Listener::default();
    view.learn(&News::Open, now);
    let heard = listener.hear(bytes);
    view.hear(&heard, listener.tally(), now);
    view
}

const WIDE: [u16; 2] = [150, 42];
const S: fn(u64) -> Duration = Duration::from_secs;

#[test]
fn the_screen_has_the_word_the_reason_and_the_numbers() {
    let mut device = Device::default();
    device.hello(["x", "phi"]);
    (0..2000).for_each(|number| device.sample(number));
    device.status(2000, [healthy(0), healthy(1)], 0);
    let mut view = view_of(&device.bytes, S(1));
    let well = screen(&view, S(1), WIDE);
    println!("{well}");
    for text in [
        "  HEALTHY  ",
        "as expected",
        "COM3: connected",
        "0.4 s since its start",
        "model 0000cafe",
        "change ·······|·· below 75 % of its limit",
        "NMSE 1.250 % fast, – slow",
        "measured 20.0 N, predicted 15.0 N, residual 5.00 N",
        "judged 1.2 s ago, 87 % of the recent time",
        "force of x, N",
        "residual of phi, N·m",
        "2.5 % outside range",
        "force channel of x: stuck",
        "9 of 10 channels well",
        "2003 messages",
        "firmware 1.2.3, restarted",
    ] {
        assert!(
            well.contains(text),
            "{text:?} is not on the screen:\n{well}"
        );
    }
    assert!(!well.contains("samples late") && !well.contains("ALARM"));

    let softer = verdict(State::Alarm, Cause::Softer, 1, 1200);
    let mut device = Device {
        sequence: device.sequence,
        ..Device::default()
    };
    device.say(&Report::Event(Event::Verdict(softer.into())));
    device.status(2500, [softer, softer], 3);
    let mut listener = Listener::default();
    let heard = listener.hear(&device.bytes);
    view.hear(&heard, listener.tally(), S(2));
    let ill = screen(&view, S(2), WIDE);
    for text in [
        "  ALARM  ",
        "phi is softer than the model",
        "change ███████|·· 120 % of its limit",
        "3 samples late",
        "event     alarm, phi is softer",
    ] {
        assert!(ill.contains(text), "{text:?} is not on the screen:\n{ill}");
    }

    // A screen of any size is drawn, however little stands on it.
    for size in [[1, 1], [20, 5], [80, 24], [40, 60], [300, 100]] {
        screen(&view, S(2), size);
    }
    assert!(screen(&view, S(2), [80, 24]).contains("  ALARM  "));
}

#[test]
fn silence_takes_the_place_of_a_verdict_that_is_no_longer_heard() {
    let mut device = Device::default();
    device.hello(["x", "phi"]);
    device.status(100, [healthy(0), healthy(1)], 0);
    let mut view = view_of(&device.bytes, S(10));
    assert!(screen(&view, S(11), WIDE).contains("  HEALTHY  "));
    let silent = screen(&view, S(17), WIDE);
    assert!(silent.contains("  SILENT  ") && !silent.contains("  HEALTHY  "));
    assert!(silent.contains("no frames for 7 s; the last said healthy"));

    view.learn(&News::Lost("unplugged".into()), S(18));
    let lost = screen(&view, S(18), WIDE);
    assert!(lost.contains("lost, trying again (unplugged)"), "{lost}");
    view.learn(&News::Open, S(20));
    assert!(screen(&view, S(21), WIDE).contains("the line is back"));
    assert!(screen(&LiveView::new("x"), S(9), WIDE).contains("no frames for 9 s; is the device"));
}

#[test]
fn what_a_hostile_line_says_commands_no_terminal() {
    let mut device = Device::default();
    device.hello(["\u{1b}[2J\n\u{202e}x", "\u{9b}31m"]);
    (0..100).for_each(|number| device.sample(number << 40));
    let strange = verdict(State::Alarm, Cause::Softer, 200, u16::MAX);
    device.status(u64::MAX, [strange, strange], u32::MAX);
    device.say(&Report::Event(Event::SensorMissing { channel: 255 }));
    device.bytes.extend((0..=255).cycle().take(5000));
    let view = view_of(&device.bytes, S(1));
    let shown = screen(&view, S(1), WIDE);
    assert!(shown.contains("\\u{1b}[2J \\u{202e}x"), "{shown}");
    let picture = serde_json::to_string(&view.picture(S(1))).unwrap();
    let happened: Vec<&str> = view.happened().map(|h| h.text.as_str()).collect();
    for text in [shown, picture, happened.join("|")] {
        let command = |c: char| c != '\n' && c.is_control() || c == '\u{202e}';
        assert!(!text.contains(command), "{text:?}");
    }
}

/// A line over TCP, the test at the device's end.
fn tcp(wanted: Wanted) -> (TcpListener, TcpStream, SteadyLine) {
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = server.local_addr().unwrap().to_string();
    let line = SteadyLine::open(Source::Tcp(address), wanted).unwrap();
    let (device, _) = server.accept().unwrap();
    (server, device, line)
}

/// What the monitor asks for first.
fn asked(device: &mut TcpStream, count: usize) -> Vec<Request> {
    let (mut decoder, mut found) = (Decoder::<Request>::default(), Vec::new());
    let mut byte = [0];
    while found.len() < count {
        device.read_exact(&mut byte).unwrap();
        if let Some(request) = decoder.push(byte[0]) {
            found.push(request.unwrap().message);
        }
    }
    found
}

#[test]
fn a_minute_at_5_khz_over_tcp_loses_nothing_at_20_screens_a_second() {
    const SCREENS: u64 = 20 * 60;
    const PER_SCREEN: u64 = 5000 / 20;
    let (_server, mut device_end, mut line) = tcp(Wanted::Every(1));
    let sender = thread::spawn(move || {
        let mut device = Device::default();
        device.hello(["x", "phi"]);
        for number in 0..SCREENS * PER_SCREEN {
            device.sample(number);
            if number % 500 == 499 {
                device.status(number, [healthy(0), healthy(1)], 0);
                device_end.write_all(&device.bytes).unwrap();
                device.bytes.clear();
            }
        }
        device_end
    });
    let mut view = LiveView::new("device");
    let mut terminal = Terminal::new(TestBackend::new(120, 40)).unwrap();
    let (mut samples, mut screens) = (0, 0);
    // The clock is the test's: a screen is due whenever a twentieth of a second of samples has
    // come.
    while screens < SCREENS {
        let now = Duration::from_millis(50 * screens);
        let caught = line.next(Duration::from_millis(20)).unwrap();
        caught.news.iter().for_each(|news| view.learn(news, now));
        let sample =
            |h: &&Heard| matches!(h, Heard::Message(m) if matches!(m.message, Report::Sample(_)));
        samples += caught.heard.iter().filter(sample).count() as u64;
        view.hear(&caught.heard, line.tally(), now);
        while screens < SCREENS && samples >= (screens + 1) * PER_SCREEN {
            let now = Duration::from_millis(50 * screens);
            terminal
                .draw(|frame| draw(frame, &view, now, false))
                .unwrap();
            screens += 1;
        }
    }
    let device_end = sender.join().unwrap();
    // What follows the last sample may still be on its way.
    for _ in 0..50 {
        let caught = line.next(Duration::from_millis(20)).unwrap();
        view.hear(&caught.heard, line.tally(), S(60));
    }
    let tally = line.tally();
    assert_eq!(samples, 300_000);
    assert_eq!(tally.messages, 1 + 300_000 + 2 * 600, "{tally:?}");
    assert_eq!((tally.lost, tally.damaged, tally.unknown), (0, 0, 0));
    assert!(view.traces().iter().all(|t| t.columns().count() > 590));
    assert_eq!(view.picture(S(60)).state, "healthy");
    drop(device_end);
}

#[test]
fn a_lost_line_is_opened_again_and_asked_again() {
    let (server, mut first, mut line) = tcp(Wanted::Shown);
    let mut view = LiveView::new("device");
    let mut step = |until: &dyn Fn(&LiveView) -> bool| {
        for _ in 0..200 {
            let caught = line.next(Duration::from_millis(50)).unwrap();
            caught.news.iter().for_each(|news| view.learn(news, S(1)));
            view.hear(&caught.heard, line.tally(), S(1));
            if until(&view) {
                return view.picture(S(1));
            }
        }
        panic!("{:?}", view.picture(S(1)));
    };
    let mut device = Device::default();
    device.hello(["x", "phi"]);
    // Broken frames before and between the whole ones.
    first.write_all(&[1, 2, 3, 0, 9, 9, 0]).unwrap();
    first.write_all(&device.bytes).unwrap();
    step(&|view| !view.traces().is_empty());
    // At 5 kHz every tenth sample is enough for a screen.
    let wanted = [Request::Hello, Request::Stream { every: 10 }];
    assert_eq!(asked(&mut first, 2), wanted);
    first.write_all(&device.bytes[..9]).unwrap();
    drop(first);
    let lost = step(&|view| view.picture(S(1)).line.contains("lost"));
    assert!(
        lost.line.contains("the other end closed it"),
        "{}",
        lost.line
    );

    let accepting = thread::spawn(move || server.accept().unwrap().0);
    step(&|view| view.picture(S(1)).line.contains("connected"));
    let mut second = accepting.join().unwrap();
    device.bytes.clear();
    device.sequence = 900;
    device.hello(["x", "phi"]);
    device.status(5, [healthy(0), healthy(1)], 0);
    second.write_all(&device.bytes).unwrap();
    let back = step(&|view| view.picture(S(1)).state == "healthy");
    assert!(back.line.contains("connected"));
    assert_eq!(asked(&mut second, 2), wanted);
    let counted = |what: &str| back.counters.iter().find(|c| c.what == what).unwrap().count;
    assert_eq!(counted("lost on the way"), 0, "a lost line loses no frames");
}

#[test]
fn a_device_that_restarted_while_the_line_was_lost_is_drawn_from_its_start() {
    let mut device = Device::default();
    device.hello(["x", "phi"]);
    (50_000..51_000).for_each(|number| device.sample(number));
    let mut view = view_of(&device.bytes, S(1));
    assert_eq!(view.traces()[0].columns().count(), 21);
    device.bytes.clear();
    (0..500).for_each(|number| device.sample(number));
    let mut listener = Listener::default();
    let heard = listener.hear(&device.bytes);
    view.hear(&heard, listener.tally(), S(2));
    assert_eq!(view.traces()[0].columns().count(), 10);
    assert_eq!(view.generation(), 2);
}

#[test]
fn a_file_is_shown_as_fast_as_it_was_sent() {
    let mut device = Device::default();
    device.hello(["x", "phi"]);
    for number in 0..3 {
        device.status(5000 * number, [healthy(0), healthy(1)], number as u32);
    }
    let mut listener = Listener::default();
    let heard = listener.hear(&device.bytes);
    let mut pace = Pace::of(&Source::File(PathBuf::from("frames.bin")));
    pace.take(Caught {
        bytes: Vec::new(),
        heard,
        news: Some(News::End),
    });
    let mut view = LiveView::new("frames.bin");
    for (at, late) in [(7, 0), (8, 1), (9, 2)] {
        pace.feed(&mut view, listener.tally(), S(at));
        let counters = view.picture(S(at)).counters;
        assert_eq!(counters[0].count, late);
        assert_eq!(view.has_ended(), late == 2);
    }
    assert_eq!(
        view.picture(S(100)).state,
        "healthy",
        "an ended file is not silent"
    );
}

//! `jointwatch emulate --serve`: the emulated device that runs on and on, and the words that change
//! its joint.

use crate::cli::console::Console;
use crate::emulate::device::EmulatedDevice;
use crate::emulate::joint::LoopedJoint;
use crate::emulate::loopback::Loopback;
use crate::emulate::serve::{Order, Serving, Told};
use crate::emulate::{qemu, selftest};
use crate::study::{Record, Role, Study};
use crate::text::error::{Error, Result};
use jointwatch_shared::base::Model;
use std::io::BufRead;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::thread;

/// Set by the first Ctrl-C; the second ends the program at once.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// What was asked for.
pub(super) struct Service<'a> {
    pub(super) port: u16,
    /// A change, and the seconds of the device's time after which it comes.
    pub(super) change: Option<(&'a str, f64)>,
}

/// The record that is driven in a loop where none is named: the first validation record, or the
/// first of all.
pub(super) fn driven<'a>(records: &[&'a Record]) -> Result<&'a Record> {
    let validates = records.iter().find(|r| r.role == Role::Validate);
    let record = validates.or(records.first()).copied();
    record.ok_or_else(|| Error::data("the study has no record that could drive the joint"))
}

/// Runs the device until somebody ends it.
pub(super) fn serve(
    console: &Console,
    device: &EmulatedDevice<'_>,
    (study, model, record): (&Study, &Model, &Record),
    service: &Service<'_>,
) -> Result<()> {
    let joint = LoopedJoint::new(device, study, model, record)?;
    let mut later = Vec::new();
    if let Some((text, after_s)) = service.change {
        joint.change(text)?;
        later.push((after_s, Order::Change(text.into())));
    }
    let line = Loopback::open(service.port)?;
    let slot = device.slot()?.to_bytes();
    let elf = selftest::emulated()?;
    let (send, orders) = channel();
    let of_interrupt = send.clone();
    ctrlc::set_handler(move || {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        // A device that has ended takes no orders any more.
        let _ = of_interrupt.send(Order::Quit);
    })
    .map_err(|e| Error::failed(format!("Ctrl-C could not be listened for ({e})")))?;
    thread::spawn(move || listen(&send));
    console.say(welcome(&line, record, &study.axes[0].name))?;
    console.json(&serde_json::json!({ "address": line.address, "record": record.file }))?;
    let going = console.working("starting");
    let mut tell = |told: Told| match told {
        Told::Said(text) => going.suspend(|| {
            // A terminal that is gone ends the program with the next word.
            let _ = console.say(text);
        }),
        Told::Going {
            time_s,
            speed,
            connected,
        } => {
            let heard = if connected { "heard" } else { "nobody listens" };
            going.set_message(format!(
                "{time_s:.0} s of the device's time, {speed:.2} × real time, {heard}"
            ));
        }
    };
    let wiring = (device.wired().wiring(), device.block.sample_rate_hz);
    let mut host = Serving::new(&joint, wiring, &line, (orders, later), &mut tell)?;
    let ran = qemu::run(&elf, &slot, &mut host);
    drop(host);
    going.finish_and_clear();
    match ran {
        // Ctrl-C ends QEMU as well.
        Err(e) if !INTERRUPTED.load(Ordering::Relaxed) => Err(e),
        _ => console.say("The emulated device was switched off."),
    }
}

fn welcome(line: &Loopback, record: &Record, axis: &str) -> String {
    format!(
        "The emulated device runs, driven by {} in a loop, at most as fast as a real one. Watch it from another terminal:\n\n  \
         jointwatch monitor --tcp {}\n\nType a change of the joint, such as  change force@{axis}*0.7  then  restore , and  quit  at the end.",
        record.file, line.address
    )
}

/// Reads orders, a line each, from standard input; its end ends nothing.
fn listen(orders: &Sender<Order>) {
    for line in std::io::stdin()
        .lock()
        .lines()
        .map_while(std::result::Result::ok)
    {
        let line = line.trim();
        let order = match line
            .split_once(' ')
            .map_or((line, ""), |(word, rest)| (word, rest.trim()))
        {
            ("", _) => continue,
            ("change", what) => Order::Change(what.into()),
            ("restore", "") => Order::Restore,
            ("quit", "") => Order::Quit,
            // Said as what is wrong with a change, with what could be changed.
            _ => Order::Change(line.into()),
        };
        if orders.send(order).is_err() {
            return;
        }
    }
}

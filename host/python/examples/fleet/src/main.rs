//! Beside a device: what it measures goes to the broker as sums, and signed models come back to it.
//!
//!     fleet-bridge name=a device=127.0.0.1:4001 broker=localhost:8883 ca=ca.crt password=FILE
//! study=fleet/study.toml rig=rig.bin         folder=DIR program=jointwatch
//!
//! `fleet/measure` asks for sums (`ROUND ROWS`), `fleet/model` brings a model. The bridge answers
//! below `fleet/NAME/`: `state` (retained; `lost` is its last will), `part/ROUND`, `runs` (how the
//! device introduces itself with a new model) and `trouble`.

mod broker;
mod device;
mod settings;

use device::Device;
use rumqttc::{Client, ConnectionError, Event, Packet, Publish};
use settings::Settings;
use std::process::ExitCode;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

/// What the broker asks of the device.
enum Job {
    Measure { round: String, rows: usize },
    Model(Vec<u8>),
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("fleet-bridge: {why}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), String> {
    let settings = Settings::read(std::env::args().skip(1))?;
    let (client, mut connection) = broker::connect(&settings)?;
    let device = Device::new(&settings)?;
    let (send, jobs) = channel();
    let (publisher, name) = (client.clone(), settings.name.clone());
    // Work with the device takes seconds, in which the connection must go on.
    let worker = thread::spawn(move || work(&jobs, &publisher, &name, device));
    for event in connection.iter() {
        match event {
            Ok(Event::Incoming(Packet::ConnAck(_))) => broker::begin(&client, &settings.name)?,
            Ok(Event::Incoming(Packet::Publish(message))) => {
                let Some(job) = job(&message) else {
                    eprintln!("fleet-bridge: {} is not understood", message.topic);
                    continue;
                };
                if send.send(job).is_err() {
                    break;
                }
            }
            Ok(_) => {}
            Err(why @ ConnectionError::ConnectionRefused(_)) => return Err(why.to_string()),
            Err(why) => {
                // The next turn of the loop connects anew.
                eprintln!("fleet-bridge: {why}");
                thread::sleep(Duration::from_secs(1));
            }
        }
    }
    drop(send);
    worker
        .join()
        .map_err(|_| "the work with the device broke off".to_owned())?
}

fn job(message: &Publish) -> Option<Job> {
    if message.topic == broker::MODEL {
        return Some(Job::Model(message.payload.to_vec()));
    }
    let text = std::str::from_utf8(&message.payload).ok()?;
    let (round, rows) = text.split_once(' ')?;
    // The round becomes the name of a folder.
    let plain = round.chars().all(|c| c.is_ascii_alphanumeric());
    (plain && !round.is_empty()).then_some(Job::Measure {
        round: round.to_owned(),
        rows: rows.parse().ok()?,
    })
}

fn work(
    jobs: &Receiver<Job>,
    client: &Client,
    name: &str,
    mut device: Device,
) -> Result<(), String> {
    let say = |what: &str, content: Vec<u8>| broker::say(client, name, what, content);
    for job in jobs {
        let done = match job {
            Job::Measure { round, rows } => {
                broker::state(client, name, &format!("measures {round}"))?;
                let part = device.part(&round, rows);
                broker::state(client, name, broker::HERE)?;
                part.map(|part| (format!("part/{round}"), part))
            }
            // The broker hands a retained model on with every new connection.
            Job::Model(model) if device.has(&model) => continue,
            Job::Model(model) => device
                .take(model)
                .map(|hello| ("runs".to_owned(), hello.into_bytes())),
        };
        match done {
            Ok((what, content)) => say(&what, content)?,
            Err(why) => say("trouble", why.into_bytes())?,
        }
    }
    Ok(())
}

//! The connection to the MQTT broker: TLS, the device's own credentials, and a last will.

use crate::settings::Settings;
use rumqttc::{Client, Connection, LastWill, MqttOptions, QoS, Transport};
use std::fs;
use std::time::Duration;

/// Where the host puts the signed model, retained.
pub(crate) const MODEL: &str = "fleet/model";
/// Where the host asks for sums.
const MEASURE: &str = "fleet/measure";
/// States of a bridge.
pub(crate) const HERE: &str = "here";
const LOST: &str = "lost";
/// The largest message, bytes: the sums of two axes have 0.7 MB.
const LARGEST: usize = 4 << 20;
/// Messages that may wait for the connection.
const WAITING: usize = 64;

/// Prepares the connection; it is made, and made again, by whoever takes its events.
pub(crate) fn connect(settings: &Settings) -> Result<(Client, Connection), String> {
    let read =
        |path: &std::path::Path| fs::read(path).map_err(|why| format!("{}: {why}", path.display()));
    let password = String::from_utf8(read(&settings.password)?).map_err(|why| why.to_string())?;
    let (host, port) = &settings.broker;
    let mut options = MqttOptions::new(&settings.name, host, *port);
    options.set_credentials(&settings.name, password.trim());
    options.set_transport(Transport::tls(read(&settings.ca)?, None, None));
    options.set_keep_alive(Duration::from_secs(5));
    options.set_max_packet_size(LARGEST, LARGEST);
    options.set_last_will(LastWill::new(
        topic(&settings.name, "state"),
        LOST,
        QoS::AtLeastOnce,
        true,
    ));
    Ok(Client::new(options, WAITING))
}

/// What a connection begins with.
pub(crate) fn begin(client: &Client, name: &str) -> Result<(), String> {
    // Not the calls that wait: this is the thread that empties the queue.
    for topic in [MODEL, MEASURE] {
        client
            .try_subscribe(topic, QoS::AtLeastOnce)
            .map_err(|why| why.to_string())?;
    }
    let said = client.try_publish(topic(name, "state"), QoS::AtLeastOnce, true, HERE);
    said.map_err(|why| why.to_string())
}

/// Says how it stands with the device, for those who ask later as well.
pub(crate) fn state(client: &Client, name: &str, state: &str) -> Result<(), String> {
    let said = client.publish(topic(name, "state"), QoS::AtLeastOnce, true, state);
    said.map_err(|why| why.to_string())
}

/// Publishes something of the device.
pub(crate) fn say(client: &Client, name: &str, what: &str, content: Vec<u8>) -> Result<(), String> {
    let said = client.publish(topic(name, what), QoS::AtLeastOnce, false, content);
    said.map_err(|why| why.to_string())
}

fn topic(name: &str, what: &str) -> String {
    format!("fleet/{name}/{what}")
}

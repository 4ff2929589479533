//! Orders: what a device does only when its owner signs for it.
//!
//! A device tells the number of its next order when it introduces itself, and takes an order that
//! is signed with it once.

use super::line::Line;
use crate::device::signing::PrivateKey;
use crate::text::error::{Error, Result};
use jointwatch_shared::wire::slot::{CLASS_LEN, Order, signed_order};
use jointwatch_shared::wire::telemetry::{Access, Answered, Report, Request, Signature};
use std::io::{Read, Write};
use std::time::Duration;

/// How long to wait for an answer before the request is sent again; an entry of the journal takes a
/// fraction of it.
const WAIT: Duration = Duration::from_millis(700);
/// How often a request is sent.
const TRIES: u16 = 8;

/// Has a device carry out an order, signed by `key`.
///
/// A read of `line` that brings nothing gives no bytes, or fails as timed out.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the device does not trust the key,
/// [`crate::text::error::Kind::Failed`] when it does not answer or cannot carry the order out.
pub fn give(line: &mut (impl Read + Write), order: Order, key: &PrivateKey) -> Result<()> {
    let mut line = Line::new(line, "try again");
    for _ in 0..TRIES {
        let before = access(&mut line)?;
        let mut class = [0; CLASS_LEN];
        for (place, byte) in class.iter_mut().zip(before.class.bytes()) {
            *place = byte;
        }
        let signature = key.sign(&signed_order(order, before.number, &class));
        let request = Request::Order {
            order,
            number: before.number,
            signature: Signature::new(signature),
        };
        let to = line.send(&request)?;
        let answered = line.heard(WAIT, |report| match report {
            Report::Answer(answer) if answer.to == to => Some(answer.answered),
            _ => None,
        })?;
        return match answered {
            Some(Answered::Done) => Ok(()),
            None if is_done(&mut line, order, &before)? => Ok(()),
            None | Some(Answered::Stale | Answered::Busy) => continue,
            Some(Answered::NotSigned) => Err(Error::data(
                "the device does not trust this key; give the key that its firmware was built with",
            )),
            Some(Answered::Nothing) => Err(Error::failed(nothing(order))),
            Some(_) => Err(Error::failed(
                "the device could not write the order into its flash; upload a model, which makes room for orders",
            )),
        };
    }
    Err(Error::failed(
        "the device took none of several orders; does something else talk to it at the same time?",
    ))
}

/// Why there is nothing to carry out.
fn nothing(order: Order) -> &'static str {
    match order {
        Order::Restart => "the device has nothing to restart",
        Order::RollBack => "the device holds no other model that has proven itself; upload one",
        Order::Acknowledge => "no alarm stands on the device",
        Order::RevokeOther => {
            "the device trusts no other key, or runs a model that is signed by it; upload one that is signed by this key first"
        }
    }
}

/// Asks until the device introduces itself.
fn access(line: &mut Line<'_, impl Read + Write>) -> Result<Access> {
    for _ in 0..TRIES {
        line.send(&Request::Hello)?;
        let access = line.heard(WAIT, |report| match report {
            Report::Hello(hello) => Some(hello.access),
            _ => None,
        })?;
        if let Some(access) = access {
            return Ok(access);
        }
    }
    Err(Error::failed(
        "the device did not answer; check the port, the baud rate and that the device runs",
    ))
}

/// Whether an order was carried out whose answer did not come: the next number tells, or that
/// something else was done meanwhile. So where more than the number tells it, that counts.
fn is_done(line: &mut Line<'_, impl Read + Write>, order: Order, before: &Access) -> Result<bool> {
    let now = access(line)?;
    let only_this_key = order != Order::RevokeOther || now.keys != before.keys;
    Ok(now.number != before.number && only_this_key)
}

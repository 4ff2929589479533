//! The public keys that this firmware trusts: whoever has the private half of one can put a model
//! onto the device. And the class of devices that it is for.
//!
//! The build takes the first from the file that `JOINTWATCH_PUBLIC_KEY` names, a second, if there
//! is to be one, from `JOINTWATCH_SECOND_PUBLIC_KEY`, and the name of the class from
//! `JOINTWATCH_DEVICE_CLASS`. Without the first it is the development key, whose
//! private half everybody knows; the firmware then has to say so at every start.

use crate::store::{Key, Trust};

include!(concat!(env!("OUT_DIR"), "/key.rs"));

/// Whom a device trusts that has only what was built in: never what nobody signed.
pub fn trust() -> Trust<Key> {
    Trust {
        keys: [Some(Key::new(PUBLIC_KEY)), SECOND_PUBLIC_KEY.map(Key::new)],
        class: DEVICE_CLASS,
        unsigned: false,
    }
}

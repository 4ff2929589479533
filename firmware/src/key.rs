//! The public key that this firmware trusts: whoever has its private half can put a model onto the device.
//!
//! The build takes it from the file that `JOINTWATCH_PUBLIC_KEY` names. Without that it is the development key, whose
//! private half everybody knows; the firmware then has to say so at every start.

include!(concat!(env!("OUT_DIR"), "/key.rs"));

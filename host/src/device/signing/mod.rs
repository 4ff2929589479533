//! Who may put a model onto the device: keys, and the signed file that an upload sends.

mod key;
mod signed_model;

pub use key::{DEVELOPMENT_SEED, PrivateKey, public_key_text};
pub use signed_model::{SignedModel, Stamp, content_digest};

//! What an owner does on the host: headers and signatures.

use ed25519_compact::sha512::Hash;
use ed25519_compact::{KeyPair, Seed};
use jointwatch_shared::wire::blob::BLOB_LEN;
use jointwatch_shared::wire::bytes::Bytes;
use jointwatch_shared::wire::slot::{CLASS_LEN, Header, Order, signed_order};
use jointwatch_shared::wire::telemetry::{Request, Signature};

/// The class of the devices here.
pub(crate) const CLASS: [u8; CLASS_LEN] = *b"bench\0\0\0\0\0\0\0\0\0\0\0";

/// One of the owner's keys.
pub(crate) fn keys(number: u8) -> KeyPair {
    KeyPair::from_seed(Seed::new([9 + number; 32]))
}

/// The header of model and rig block.
pub(crate) fn header(content: &[u8], release: u32) -> Header {
    let digest = Hash::hash(content);
    Header {
        rig_len: (content.len() - BLOB_LEN) as u32,
        release,
        class: Bytes::new(CLASS),
        digest: Bytes::new(*digest.first_chunk().unwrap()),
    }
}

/// Its signature by the owner's first key.
pub(crate) fn signature(header: &Header) -> Signature {
    by(0, &header.signed_bytes())
}

/// The signature of this key.
pub(crate) fn by(key: u8, message: &[u8]) -> Signature {
    Signature::new(*keys(key).sk.sign(message, None))
}

/// An order, signed by this key.
pub(crate) fn order(key: u8, order: Order, number: u32) -> Request {
    Request::Order {
        order,
        number,
        signature: by(key, &signed_order(order, number, &CLASS)),
    }
}

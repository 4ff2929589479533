//! Whose model it is: the Ed25519 signature of its header, by one of the keys that are trusted.

use ed25519_compact::sha512::Hash;
use ed25519_compact::{PublicKey, Signature};
use jointwatch_shared::wire::slot::{CLASS_LEN, DIGEST_LEN, SIGNATURE_LEN};

/// The keys that a firmware may trust.
pub const KEYS: usize = 2;

/// Something that can tell a good signature from a bad one.
pub trait Verifier {
    /// Whether this is a signature of the message.
    fn holds(&self, message: &[u8], signature: &[u8; SIGNATURE_LEN]) -> bool;
}

/// The public key that signatures are held against.
#[derive(Clone, Copy, Debug)]
pub struct Key(PublicKey);

impl Key {
    /// The key with these bytes. A key that is no point of the curve lets no signature pass.
    pub fn new(bytes: [u8; 32]) -> Self {
        Self(PublicKey::new(bytes))
    }
}

impl Verifier for Key {
    // Not inlined: what it needs on the stack is free again when it is done.
    #[inline(never)]
    fn holds(&self, message: &[u8], signature: &[u8; SIGNATURE_LEN]) -> bool {
        self.0.verify(message, &Signature::new(*signature)).is_ok()
    }
}

/// The digest of content that comes in pieces: the first bytes of its SHA-512.
pub(super) struct ContentDigest(Hash);

impl ContentDigest {
    /// Of nothing so far.
    pub(super) fn new() -> Self {
        Self(Hash::new())
    }

    /// Takes the next bytes in.
    pub(super) fn absorb(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// Of all bytes taken in.
    pub(super) fn value(self) -> [u8; DIGEST_LEN] {
        self.0.finalize().first_chunk().copied().unwrap_or_default()
    }
}

/// Who may put a model onto the device.
#[derive(Clone, Copy, Debug)]
pub struct Trust<V> {
    /// What checks signatures: each of the keys that the firmware was built with.
    pub keys: [Option<V>; KEYS],
    /// The class of devices that this one belongs to.
    pub class: [u8; CLASS_LEN],
    /// Whether a model that nobody signed is taken as well. A wrong signature is refused either
    /// way.
    pub unsigned: bool,
}

impl<V: Verifier> Trust<V> {
    /// The key that made this signature, if it is trusted: neither missing nor among the `revoked`.
    pub(super) fn signer(
        &self,
        message: &[u8],
        signature: &[u8; SIGNATURE_LEN],
        revoked: u8,
    ) -> Option<u8> {
        let keys = (0..).zip(&self.keys);
        let mut trusted = keys.filter(|(number, _)| revoked >> number & 1 == 0);
        trusted.find_map(|(number, key)| {
            let holds = key.as_ref()?.holds(message, signature);
            holds.then_some(number)
        })
    }
}

//! Whose model it is: the Ed25519 signature over model and rig block, checked in pieces, so that nothing has to fit into RAM.

use ed25519_compact::{PublicKey, Signature, VerifyingState};
use jointwatch_shared::wire::slot::SIGNATURE_LEN;

/// Something that can tell a good signature from a bad one.
pub trait Verifier {
    /// A check under way.
    type Check: Check;

    /// Begins to check a signature; `None` when no content could make it good.
    fn begin(&self, signature: &[u8; SIGNATURE_LEN]) -> Option<Self::Check>;
}

/// The check of one signature, which takes the signed bytes piece by piece.
pub trait Check {
    /// Takes the next signed bytes.
    fn absorb(&mut self, bytes: &[u8]);

    /// Whether the signature is good for all bytes taken.
    fn holds(self) -> bool;
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
    type Check = Ed25519Check;

    fn begin(&self, signature: &[u8; SIGNATURE_LEN]) -> Option<Ed25519Check> {
        let state = self
            .0
            .verify_incremental(&Signature::new(*signature))
            .ok()?;
        Some(Ed25519Check(state))
    }
}

/// A signature check in progress: the signed bytes go in piece by piece.
pub struct Ed25519Check(VerifyingState);

impl Check for Ed25519Check {
    fn absorb(&mut self, bytes: &[u8]) {
        self.0.absorb(bytes);
    }

    fn holds(self) -> bool {
        self.0.verify().is_ok()
    }
}

/// Who may put a model onto the device.
#[derive(Clone, Copy, Debug)]
pub struct Trust<V> {
    /// What checks signatures.
    pub verifier: V,
    /// Whether a model that nobody signed is taken as well. A wrong signature is refused either way.
    pub unsigned: bool,
}

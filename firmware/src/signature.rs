//! Ed25519 (RFC 8032): whether a signature is good for a message that is taken in pieces. Checks only, so nothing in here is secret.
//!
//! Written for size: a library's check takes the flashed image 14 KiB, because its arithmetic is made for processors with 64 bits, and
//! keeps paths to a panic; this takes 3 KiB and has none. Every number is public, so time may depend on it. A signature passes when its S is
//! below the group's order and the encoding of S·B − k·A is R, byte for byte, with k the hash of R, A and the message: the strictest of the readings of RFC
//! 8032. A test holds it against the library that signs.

mod curve;
mod field;
mod scalar;
mod sha512;

use curve::Point;
use scalar::Scalar;
use sha512::Sha512;

/// Bytes of a signature: R, then S.
pub const SIGNATURE_LEN: usize = 64;

/// A public key.
#[derive(Clone, Copy, Debug)]
pub struct PublicKey([u8; 32]);

/// The check of one signature, which takes the message piece by piece.
#[derive(Clone, Debug)]
pub struct Check {
    hash: Sha512,
    r: [u8; 32],
    s: Scalar,
    minus_a: Point,
}

impl PublicKey {
    /// The key with these bytes. One that is no point of the curve, or of a small order, lets no signature pass.
    pub const fn new(bytes: [u8; 32]) -> Self {
        Self(bytes)
    }

    /// Begins to check a signature; `None` when no message could make it good.
    ///
    /// Not inlined: what it needs on the stack is free again when the message comes.
    #[inline(never)]
    pub fn check(&self, signature: &[u8; SIGNATURE_LEN]) -> Option<Check> {
        let (r, s) = signature.split_first_chunk()?;
        let s = Scalar::below_order(s.first_chunk()?)?;
        let minus_a = Point::decode(&self.0)?.negated();
        if minus_a.is_of_small_order() {
            return None;
        }
        let mut hash = Sha512::new();
        hash.absorb(r);
        hash.absorb(&self.0);
        Some(Check {
            hash,
            r: *r,
            s,
            minus_a,
        })
    }
}

impl Check {
    /// Takes the next bytes of the message.
    pub fn absorb(&mut self, bytes: &[u8]) {
        self.hash.absorb(bytes);
    }

    /// Whether the signature is good for all that was taken.
    #[inline(never)]
    pub fn holds(self) -> bool {
        let k = Scalar::reduced(&self.hash.finish());
        Point::sum_of_products(&self.s, &Point::BASE, &k, &self.minus_a).encode() == self.r
    }
}

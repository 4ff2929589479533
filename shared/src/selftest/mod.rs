//! Test vectors that every machine draws alike, and one number that tells whether it computed the
//! same forces from them.
//!
//! Host and device draw the same inputs, evaluate the same model and fold every output bit into a
//! digest. Equal digests mean equal bits. Integers only, so that the check itself cannot depend on
//! the machine.

pub mod chain;
pub mod network;

use crate::base::axis::{Axis, AxisKind, Convention, InputRange, Name};
use crate::base::corrections::ForceCorrection;
use crate::base::kernels::{Kernels, Portable};
use crate::base::polynomial::{BLOCKS, Block, Blocks, PolynomialModel};
use crate::base::terms::{Memory, Terms};
use crate::base::{Base, Header, Model, Output};
use heapless::Vec;

/// The corner-and-centre values of one input: −1, 0 and the Q31 number next to 1.
const CORNERS: [i32; 3] = [i32::MIN, 0, i32::MAX];

/// Corner-and-centre points of four inputs: 3⁴.
pub const CORNER_POINTS: u32 = 81;

/// Marsaglia's xorshift64 (J. Stat. Softw. 8(14), 2003; shifts 13, 7, 17): period 2⁶⁴ − 1, the high
/// half is used.
#[derive(Clone, Debug)]
pub struct Points {
    state: u64,
}

impl Points {
    /// The points of a seed. The seed 0, which xorshift cannot leave, stands for another fixed one.
    pub const fn new(seed: u64) -> Self {
        let state = if seed == 0 {
            0x9e37_79b9_7f4a_7c15
        } else {
            seed
        };
        Self { state }
    }

    /// The next 32 bits.
    #[inline]
    pub const fn next_word(&mut self) -> i32 {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 7;
        self.state ^= self.state << 17;
        (self.state >> 32) as i32
    }

    /// The next four inputs in Q31, each uniform over its whole range.
    #[inline]
    pub const fn next_point(&mut self) -> [i32; 4] {
        [
            self.next_word(),
            self.next_word(),
            self.next_word(),
            self.next_word(),
        ]
    }
}

/// The corner or centre number `n` (0 to 80) of {−1, 0, 1}⁴, the last input running fastest.
pub fn corner(n: u32) -> [i32; 4] {
    [n / 27, n / 9, n / 3, n].map(|digits| match digits % 3 {
        0 => CORNERS[0],
        1 => CORNERS[1],
        _ => CORNERS[2],
    })
}

/// Folds words into 64 bits: FNV-1a (Fowler, Noll, Vo; offset 0xcbf29ce484222325, prime
/// 0x100000001b3), a word at a time.
#[derive(Clone, Debug)]
pub struct Digest {
    state: u64,
}

impl Digest {
    /// The digest of nothing.
    pub const fn new() -> Self {
        Self {
            state: 0xcbf2_9ce4_8422_2325,
        }
    }

    /// Takes in one word.
    #[inline]
    pub const fn add(&mut self, word: i32) {
        self.state = (self.state ^ word as u32 as u64).wrapping_mul(0x0000_0100_0000_01b3);
    }

    /// The digest so far.
    pub const fn value(&self) -> u64 {
        self.state
    }
}

impl Default for Digest {
    fn default() -> Self {
        Self::new()
    }
}

/// The digest of a model's outputs over the 81 corner-and-centre points and then `n` random points
/// of `seed`, taken as one motion: effects with memory carry it from point to point.
///
/// Host and device call this with the same model, seed and `n` and compare the result.
pub fn digest(model: &Model, seed: u64, n: u32) -> u64 {
    digest_by::<Portable>(model, seed, n)
}

/// [`digest`] with a board's kernels.
pub fn digest_by<K: Kernels>(model: &Model, seed: u64, n: u32) -> u64 {
    let mut digest = Digest::new();
    let mut memory = Memory::default();
    let mut add = |u: &[i32; 4]| {
        // What effects follow takes the numbers of a state of the other axis.
        let [_, v, _, omega] = *u;
        memory.follow([omega, v]);
        for force in model.step_by::<K>(&mut memory, u) {
            digest.add(force);
        }
    };
    for number in 0..CORNER_POINTS {
        add(&corner(number));
    }
    let mut points = Points::new(seed);
    for _ in 0..n {
        add(&points.next_point());
    }
    digest.value()
}

/// A dense two-axis model of all 512 terms, made from a fixed seed by integers alone; it lies in
/// flash.
pub fn reference_model() -> &'static Model {
    &REFERENCE
}

static REFERENCE: Model = reference(
    Base::Polynomial(PolynomialModel {
        orders: [3; 4],
        axes: 2,
        shifts: [1, 2],
        blocks: reference_blocks(),
    }),
    REFERENCE_BOUNDS,
);

/// The bounds of the reference model's error, in its force units; a test compares them with the
/// computed ones.
const REFERENCE_BOUNDS: [f64; 2] = [14.0, 9.5];

/// A model of nothing but a base, whose error has these bounds.
pub(crate) const fn reference(base: Base, bounds: [f64; 2]) -> Model {
    let mut outputs = [Output {
        force_per_lsb: 1.0,
        error_bound: bounds[0],
    }; 2];
    outputs[1].error_bound = bounds[1];
    Model {
        header: reference_header(),
        outputs: Vec::from_array(outputs),
        base_shifts: [0; 2],
        terms: Terms::NONE,
        base,
        corrections: [ForceCorrection::NONE; 2],
    }
}

/// What both reference models say about themselves: two axes whose ranges are ±1.
const fn reference_header() -> Header {
    Header {
        sample_rate_hz: 2000.0,
        band_hz: 120.0,
        state_band_hz: 400.0,
        axes: Vec::from_array([
            reference_axis(*b"x\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", AxisKind::Translation),
            reference_axis(*b"phi\0\0\0\0\0\0\0\0\0\0\0\0\0", AxisKind::Rotation),
        ]),
    }
}

const fn reference_axis(bytes: [u8; 16], kind: AxisKind) -> Axis {
    let range = InputRange {
        center: 0.0,
        half_range: 1.0,
    };
    Axis {
        name: Name { bytes },
        kind,
        convention: Convention::ForceMinusInertia,
        inertia: 1.0,
        displacement: range,
        velocity: range,
        input: None,
        validation: None,
    }
}

/// Words of both signs of up to 2²⁸ and gains of very different size.
const fn reference_blocks() -> [Blocks; 2] {
    let mut points = Points::new(1);
    let mut blocks = [[Block::EMPTY; BLOCKS]; 2];
    let mut axis = 0;
    while axis < 2 {
        let mut number = 0;
        while number < BLOCKS {
            let block = &mut blocks[axis][number];
            let mut word = 0;
            while word < 16 {
                block.words[word] = points.next_word() >> 3;
                word += 1;
            }
            // Multiples of 4, of up to 2³¹, 2²⁸, 2²⁵, … in turn.
            block.gain = ((points.next_word() as u32 >> 1) >> (3 * (number % 5)) & !3) as i32;
            number += 1;
        }
        axis += 1;
    }
    blocks
}

//! What the inner loops of a model run over, as a blob stores it: the blocks of a polynomial, the
//! neurons of a network.

use crate::wire::layout::laid_out;

/// Blocks of a two-axis polynomial, one for each x^i·ẋ^j; block number 4·i + j. Of one axis those
/// with j = 0, for each power i of its input.
pub const BLOCKS: usize = 16;

laid_out! {
/// The terms of one x^i·ẋ^j as stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C, align(8))]
pub struct Block {
    /// The coefficient of φ^k·φ̇^l at 4·k + l (one axis: of x^k·ẋ^l), at the block's own scale.
    pub words: [i32; 16],
    /// What brings the block's scale to that of the axis: a Q31 number, not negative. 0 for one
    /// axis without an input.
    pub gain: i32,
}
}

/// The blocks of one axis.
pub type Blocks = [Block; BLOCKS];

impl Block {
    /// A block without terms.
    pub const EMPTY: Self = Self {
        words: [0; 16],
        gain: 0,
    };
}

laid_out! {
/// One neuron as stored: what goes into its argument, and what its tanh weighs in each force.
///
/// With s the scale of its argument, `steps` = 2³⁷/s, a weight is stored as 2·s·w and its bias as
/// 2³²·s·b + 2³¹.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct Neuron {
    /// Weights of the inputs x, ẋ, φ, φ̇; of one axis the third is that of its input, if it follows
    /// one, and the last is 0.
    pub weights: [i32; 4],
    /// Weights of the neuron in the force of each axis; the last is 0 for one axis.
    pub outputs: [i32; 2],
    /// The bias, with 32 more binary places than the argument, and the half that rounds.
    pub bias: i64,
    /// Steps of the tanh table per unit of the argument's integer, in 2⁻³²; not 0.
    pub steps: u32,
}
}

impl Neuron {
    /// Fills the places of an array that no neuron takes.
    pub(crate) const NONE: Self = Self {
        weights: [0; 4],
        outputs: [0; 2],
        bias: 0,
        steps: 0,
    };
}

//! How far the end of a block is: which of its steps are left, and what they are about.

use super::judged::Reason;

/// What is still to be done about a block that has ended.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ending {
    /// Steps that are left: the sensors, each axis, the verdict.
    pub(super) left: u8,
    /// Blocks that ended, those in a gap included.
    pub(super) blocks: u32,
    /// Whether residuals of either kind are to be judged.
    pub(super) fine: bool,
    pub(super) gross: bool,
    /// What kept residuals out of the block.
    pub(super) kept_out: Option<Reason>,
}

/// The sensors, two axes, and the verdict.
pub(super) const STEPS: u8 = 4;

impl Ending {
    /// Whether a block that has ended is not done with.
    pub(super) fn is_under_way(&self) -> bool {
        self.left != 0
    }

    /// A block, or so many in a gap, have ended.
    pub(super) fn begin(&mut self, blocks: u32) {
        (self.left, self.blocks) = (STEPS, blocks);
    }
}

//! The end of a block: the sensors' figures, what the last residuals say about each axis, and the
//! verdict; a step per sample, so that no sample takes much longer than the others.

use super::block::Gross;
use super::judged::Reason;
use super::level::{GROSS, most_of_block, values};
use super::sensors::forget;
use super::sliding::{FAST, SLOW};
use super::steps::STEPS;
use super::{Block, Monitor, MonitorState, OUTSIDE_MEMORY};

impl<S: Default + Copy> Block<S> {
    /// Whether there is a block to be judged, which is then taken for judged.
    fn taken(&mut self) -> bool {
        core::mem::take(&mut self.is_ready)
    }
}

impl Monitor {
    /// Begins the end of a block when it is time, or does its next step; whether there was
    /// something to do.
    pub(super) fn end(&self, state: &mut MonitorState) -> bool {
        let blocks = state.ticks >> (self.log_block & 31);
        if state.ending.is_under_way() {
            self.go_on(state);
        } else if blocks != 0 {
            state.ticks -= blocks << (self.log_block & 31);
            state.ending.begin(blocks);
        } else {
            return false;
        }
        true
    }

    /// The next step of the end of a block.
    #[inline(never)]
    fn go_on(&self, state: &mut MonitorState) {
        let step = STEPS.saturating_sub(state.ending.left);
        state.ending.left = state.ending.left.saturating_sub(1);
        match step {
            0 => self.end_sensors(state),
            1 => self.end_axis(state, 0),
            2 => self.end_axis(state, 1),
            _ => self.review(state),
        }
    }

    /// The sensors' figures, and what of the block can be judged.
    fn end_sensors(&self, state: &mut MonitorState) {
        for axis in 0..2 {
            state.sensors.end_courses(&self.limits, axis);
        }
        if state.sensors.end_rates(self.log_block, state.ending.blocks) {
            // A channel stands still: what was summed up meanwhile says nothing about the joint.
            state.fine.discard();
            state.gross.discard();
            state.gross_outside[0] = false;
            state.spoilt_fault = self.after_fault;
            (state.held, state.is_lost) = (None, false);
            state.kept_out = Some(Reason::Sensor);
        }
        let outside = core::mem::take(&mut state.outside);
        let rate = &mut state.outside_rate;
        forget(rate, outside, self.log_block, OUTSIDE_MEMORY);
        let ending = &mut state.ending;
        (ending.fine, ending.gross) = (state.fine.taken(), state.gross.taken());
        ending.kept_out = state.kept_out.take();
    }

    /// What the block says about one axis, and whether it says anything.
    fn end_axis(&self, state: &mut MonitorState, axis: usize) {
        if axis >= self.limits.axes.len() {
            return;
        }
        let ending = state.ending;
        let own = &mut state.axes[axis & 1];
        let outside = core::mem::take(&mut own.outside);
        let rate = &mut own.outside_rate;
        forget(rate, outside, self.log_block, OUTSIDE_MEMORY);
        if ending.gross {
            self.judge_gross(state, axis);
        }
        let is_judged = ending.fine && self.judge(state, axis);
        // A block that moved too little says so; one that is not full was kept from it.
        let reason = if ending.fine { None } else { ending.kept_out };
        let unjudged = (!is_judged).then(|| reason.unwrap_or_default());
        let low = self.is_low(state, axis);
        state.axes[axis & 1]
            .judged
            .end(ending.blocks, unjudged, low);
    }

    /// Whether no sum of an axis stands near its threshold.
    fn is_low(&self, state: &MonitorState, axis: usize) -> bool {
        self.limits.axes.get(axis).is_some_and(|limits| {
            let mut levels = state.levels[axis & 1].iter().zip(limits.sides());
            levels.all(|(level, side)| level.is_low(side))
        })
    }

    /// What the last block says about one axis, where the joint moves enough; whether it does.
    fn judge(&self, state: &mut MonitorState, axis: usize) -> bool {
        let Some(limits) = self.limits.axes.get(axis) else {
            return false;
        };
        let sums = &state.fine.full[axis & 1];
        let [fast, slow] = &mut state.sliding[axis & 1];
        fast.add::<FAST>(sums);
        slow.add::<SLOW>(sums);
        let seen = sums.statistics(limits, self.log_values);
        if !seen.moves {
            return false;
        }
        let levels = state.levels[axis & 1].iter_mut().zip(limits.sides());
        for (number, (value, (level, side))) in values(&seen).into_iter().zip(levels).enumerate() {
            level.add(value, side, most_of_block(number, side.threshold));
        }
        true
    }

    /// What the last block says about a gross change of the force of one axis.
    fn judge_gross(&self, state: &mut MonitorState, axis: usize) {
        let Some(limits) = self.limits.axes.get(axis) else {
            return;
        };
        let [_, outside] = state.gross_outside;
        let sums = &state.gross.full[axis & 1];
        let Some(Gross { side, value }) = sums.judged(limits, self.log_values, outside) else {
            return;
        };
        let levels = &mut state.levels[axis & 1];
        let place = GROSS + (side & 1);
        if let (Some(level), Some(&side)) = (levels.get_mut(place), limits.sides().get(place)) {
            level.add(value, side, most_of_block(place, side.threshold));
        }
    }
}

//! The second step of a sample: counts become states, forces and a residual.

use super::sampling::Frame;
use heapless::spsc::{Consumer, Producer};
use jointwatch_shared::base::Model;
use jointwatch_shared::base::kernels::Kernels;
use jointwatch_shared::chain::{Chain, ChainState, Output};

/// The chain of the rig and the model behind it, with what both remember.
#[derive(Debug)]
pub struct Evaluator {
    /// Turns raw counts into states, measured force and residual.
    pub chain: Chain,
    /// Predicts the force of the joint.
    pub model: Model,
    /// The state of the chain and of the model's effects.
    pub state: &'static mut ChainState,
}

/// A frame with what the chain made of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Evaluated {
    /// The sample, with its number and what went wrong with it.
    pub frame: Frame,
    /// What the chain says of the instant its delay ago; `None` without model and rig block, and
    /// until its filters are full.
    pub output: Option<Output>,
}

/// What was lost since the last frame that found room on the way out of the evaluation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lost {
    /// Instants at which no sample was taken.
    missed: u32,
    /// Samples that found no room.
    overruns: u32,
}

/// Evaluates every frame that waits. `lost` counts what found no room on the way out until
/// something does. Gives the number of the newest frame that did, which tells that all goes on.
///
/// The chain goes on over a gap as if there were none; the frame behind it says so, and the monitor
/// judges no residual that the gap can have spoilt. Lines of the mains are not followed as long as
/// a gap or another fault is within the filters.
pub fn evaluate<K: Kernels>(
    mut evaluator: Option<&mut Evaluator>,
    frames: &mut Consumer<'_, Frame>,
    evaluated: &mut Producer<'_, Evaluated>,
    lost: &mut Lost,
) -> Option<u64> {
    let mut newest = None;
    while let Some(waiting) = frames.peek() {
        let output = evaluator.as_mut().and_then(|evaluator| {
            let Evaluator {
                chain,
                model,
                state,
            } = &mut **evaluator;
            if waiting.faults.any() || waiting.follows_gap() {
                state.hold_notches(chain.invalidated_by_fault());
            }
            chain.step_by::<K>(state, model, &waiting.sample)
        });
        let mut frame = *waiting;
        frame.missed = frame.missed.saturating_add(lost.missed);
        frame.overruns = frame.overruns.saturating_add(lost.overruns);
        *lost = match evaluated.enqueue(Evaluated { frame, output }) {
            Ok(()) => {
                newest = Some(frame.number);
                Lost::default()
            }
            Err(_) => Lost {
                missed: frame.missed,
                overruns: frame.overruns.saturating_add(1),
            },
        };
        let _ = frames.dequeue();
    }
    newest
}

//! Jointwatch in a firmware of your own: model, chain and monitor from the two files of `jointwatch
//! export`, and one call per sample.
//!
//! Nothing here needs an operating system or a heap but `main`, which stands in for a board: it
//! makes up counts and prints. The function `watch` is what a firmware takes over.

use jointwatch_shared::base::kernels::Portable;
use jointwatch_shared::chain::{Chain, ChainState, RawSample};
use jointwatch_shared::monitor::{Faults, Monitor, MonitorState, Verdict};
use jointwatch_shared::wire::{blob, rig_block};

/// Watches the joint as long as there are samples; gives the last verdict, or why it cannot begin.
fn watch(
    model: &[u8],
    rig: &[u8],
    samples: impl Iterator<Item = (RawSample, Faults)>,
    mut force: impl FnMut([i32; 2]),
) -> Result<Verdict, &'static str> {
    // At start: checked in every respect, in floating point, once.
    let model = blob::decode(model).map_err(|_| "the model is not usable")?;
    let rig = rig_block::decode(rig).map_err(|why| why.phrase())?;
    let chain = Chain::new(&model, &rig).map_err(|_| "rig and model do not fit")?;
    let limits = rig.limits.ok_or("the rig block has no limits")?;
    let monitor = Monitor::new(limits, &chain).map_err(|_| "the limits do not fit")?;
    let (mut state, mut watched) = (ChainState::NEW, MonitorState::default());
    // At every sample: integers, no panic, nearly the same time whatever the values.
    for (counts, faults) in samples {
        if faults.any() {
            state.hold_notches(chain.invalidated_by_fault());
        }
        let output = chain.step_by::<Portable>(&mut state, &model, &counts);
        if let Some(output) = &output {
            force(output.predicted);
        }
        monitor.update(&mut watched, &counts, output.as_ref(), &faults);
    }
    Ok(watched.verdict())
}

/// The files that `jointwatch export` writes; here those of the self-test.
fn exported() -> (Vec<u8>, Vec<u8>) {
    use jointwatch_shared::selftest::{chain::usual_rig, reference_model};
    let model = blob::encode(reference_model());
    let mut rig = usual_rig(reference_model(), false).expect("a sound rig");
    rig.model_checksum = blob::checksum(&model);
    if let Some(limits) = &mut rig.limits {
        limits.model_checksum = rig.model_checksum;
    }
    let rig = rig_block::encode(&rig).expect("a sound rig");
    (model.to_vec(), rig.to_vec())
}

fn main() -> Result<(), &'static str> {
    let (model, rig) = exported();
    let at_rest = (0..2000).map(|_| (RawSample::default(), Faults::default()));
    let mut forces = 0;
    let verdict = watch(&model, &rig, at_rest, |_| forces += 1)?;
    println!("{forces} forces; {}", verdict.words(&["x", "phi"]));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use jointwatch_shared::monitor::State;
    use jointwatch_shared::selftest::{chain::Watched, reference_model};

    #[test]
    fn it_predicts_and_judges() {
        let (model, rig) = exported();
        let mut motion = Watched::new(reference_model(), 1, false).expect("they fit");
        let samples = (0..5000).map(|_| (motion.counts(), Faults::default()));
        let mut forces = 0;
        let verdict = watch(&model, &rig, samples, |_| forces += 1);
        let verdict = verdict.expect("it begins");
        assert!((4000..5000).contains(&forces), "{forces}");
        assert_ne!(verdict.state, State::Unjudged, "{verdict:?}");
    }

    #[test]
    fn it_says_why_it_does_not_begin() {
        let (model, rig) = exported();
        let none = || std::iter::empty();
        let why = watch(&model[1..], &rig, none(), |_| ());
        assert_eq!(why, Err("the model is not usable"));
        let why = watch(&model, &rig[1..], none(), |_| ());
        assert_eq!(why, Err("it has another length than a rig block"));
    }
}

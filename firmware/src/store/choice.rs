//! Which of the two models runs after a restart: a pure function of what the two slots hold.

use jointwatch_shared::wire::telemetry::{ModelFault, Slot as SlotName};

/// What is wrong with what a slot holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlotFault {
    /// It was never written to its end: an upload that stopped, or whose check failed.
    Unfinished,
    /// The seal is damaged, or not of this version.
    Seal,
    /// Model and rig block do not have the digest that the seal states.
    Checksum,
    /// It has no signature where one is required.
    Unsigned,
    /// The signature is not by a key that the firmware trusts.
    Signature,
    /// The model's own checks refuse it.
    Model(ModelFault),
    /// The rig block behind it cannot be used.
    Rig(ModelFault),
    /// Model and rig block do not fit each other.
    Mismatch,
    /// It is for another class of devices.
    Class,
    /// The flash may not be erased again, or its journal is full.
    Worn,
    /// The flash could not be read.
    Flash,
}

impl SlotFault {
    /// The fault in a fixed phrase, for the log.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Unfinished => "it was never written to its end",
            Self::Seal => "its seal is damaged or of another version",
            Self::Checksum => "its bytes do not have the checksum of its seal",
            Self::Unsigned => "nobody signed it",
            Self::Signature => "its signature is not by a key that this firmware trusts",
            Self::Model(fault) | Self::Rig(fault) => fault.words(),
            Self::Mismatch => "its model and its rig block do not fit each other",
            Self::Class => "it is for another class of devices",
            Self::Worn => "the flash has been erased too often",
            Self::Flash => "the flash could not be read",
        }
    }
}

/// How far a good model has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// It has never been started.
    Untried,
    /// It was started and has not yet run long enough.
    Tried,
    /// It has run. `sure` when a mark of it was programmed to its end; else power failed on it.
    Confirmed {
        /// Whether a mark of it was programmed to its end.
        sure: bool,
    },
}

/// What a slot holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Erased, or never written.
    Empty,
    /// Set aside: it failed its trial, or was about to be erased.
    Void,
    /// Nothing that may run.
    Refused(SlotFault),
    /// A model that may run.
    Good {
        /// Its number: the larger, the newer.
        sequence: u32,
        /// Bytes of the rig block behind it.
        rig_len: u32,
        /// The release that its owner gave it.
        release: u32,
        /// The key that signed it; `None` when nobody did.
        signer: Option<u8>,
        /// How far it has come.
        progress: Progress,
    },
}

/// What is to be done after a restart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// The slot whose model runs; `None` when neither has one.
    pub run: Option<SlotName>,
    /// The slot whose model failed its trial and is set aside.
    pub set_aside: Option<SlotName>,
    /// Whether the model that runs is on trial.
    pub trial: bool,
}

/// Chooses: the newer of two good models, unless it was started before and never confirmed; then
/// the other one.
///
/// Where there is no other, the trial is repeated: an unproven model is better than none.
pub(super) fn choose(states: &[State; 2]) -> Choice {
    let good = |place| match of(states, place) {
        State::Good {
            sequence, progress, ..
        } => Some((sequence, progress)),
        _ => None,
    };
    let (newer, older) = match (good(SlotName::A), good(SlotName::B)) {
        (Some((a, _)), Some((b, _))) if b > a => (SlotName::B, Some(SlotName::A)),
        (Some(_), Some(_)) => (SlotName::A, Some(SlotName::B)),
        (Some(_), None) => (SlotName::A, None),
        (None, Some(_)) => (SlotName::B, None),
        (None, None) => {
            return Choice {
                run: None,
                set_aside: None,
                trial: false,
            };
        }
    };
    let on_trial = |place| !matches!(good(place), Some((_, Progress::Confirmed { .. })));
    match (good(newer), older) {
        (Some((_, Progress::Tried)), Some(older)) => Choice {
            run: Some(older),
            set_aside: Some(newer),
            trial: on_trial(older),
        },
        _ => Choice {
            run: Some(newer),
            set_aside: None,
            trial: on_trial(newer),
        },
    }
}

/// The state of one of two slots.
pub(super) fn of(states: &[State; 2], place: SlotName) -> State {
    let [a, b] = *states;
    match place {
        SlotName::A => a,
        SlotName::B => b,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all_states() -> impl Iterator<Item = State> + Clone {
        let progress = [
            Progress::Untried,
            Progress::Tried,
            Progress::Confirmed { sure: false },
            Progress::Confirmed { sure: true },
        ];
        let good = progress.into_iter().flat_map(|progress| {
            [1, 2].map(|sequence| State::Good {
                sequence,
                rig_len: 0,
                release: 0,
                signer: None,
                progress,
            })
        });
        [State::Empty, State::Void, State::Refused(SlotFault::Seal)]
            .into_iter()
            .chain(good)
    }

    #[test]
    fn any_pair_of_states_with_a_good_one_runs_a_good_one() {
        let is_good = |state: &State| matches!(state, State::Good { .. });
        for a in all_states() {
            for b in all_states() {
                let choice = choose(&[a, b]);
                let of = |place| if place == SlotName::A { a } else { b };
                match choice.run {
                    None => assert!(!is_good(&a) && !is_good(&b), "{a:?} {b:?}"),
                    Some(place) => assert!(is_good(&of(place)), "{a:?} {b:?}"),
                }
                // What is set aside never was the only model, and never a confirmed one.
                if let Some(aside) = choice.set_aside {
                    assert_ne!(choice.run, Some(aside));
                    let tried = State::Good {
                        sequence: 0,
                        rig_len: 0,
                        release: 0,
                        signer: None,
                        progress: Progress::Tried,
                    };
                    let State::Good { sequence, .. } = of(aside) else {
                        panic!("{a:?} {b:?}")
                    };
                    let State::Good { progress, .. } = of(aside) else {
                        panic!("{a:?} {b:?}")
                    };
                    assert!(matches!(tried, State::Good { progress: p, .. } if p == progress));
                    assert!(choice.run.is_some_and(|run| {
                        matches!(of(run), State::Good { sequence: other, .. } if other <= sequence)
                    }));
                }
            }
        }
    }

    #[test]
    fn the_newer_runs_until_its_trial_has_failed() {
        let good = |sequence, progress| State::Good {
            sequence,
            rig_len: 0,
            release: 0,
            signer: None,
            progress,
        };
        let old = good(4, Progress::Confirmed { sure: true });
        let run = |new| choose(&[old, new]);
        let fresh = run(good(5, Progress::Untried));
        assert_eq!(
            fresh,
            Choice {
                run: Some(SlotName::B),
                set_aside: None,
                trial: true
            }
        );
        let failed = run(good(5, Progress::Tried));
        assert_eq!(
            failed,
            Choice {
                run: Some(SlotName::A),
                set_aside: Some(SlotName::B),
                trial: false
            }
        );
        let proven = run(good(5, Progress::Confirmed { sure: false }));
        assert_eq!(
            proven,
            Choice {
                run: Some(SlotName::B),
                set_aside: None,
                trial: false
            }
        );
        // Nothing to go back to: the trial is repeated.
        let alone = choose(&[State::Void, good(5, Progress::Tried)]);
        assert_eq!(
            alone,
            Choice {
                run: Some(SlotName::B),
                set_aside: None,
                trial: true
            }
        );
    }
}

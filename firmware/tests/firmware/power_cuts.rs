//! Power fails at every flash operation of an update, at every byte of it, and twice in a row: the
//! device then runs the old model or the new one, each with its own rig block, and the update can
//! be done after all.

use crate::failing_flash::{Cut, Flash, How, Operation, SECTOR, cuts};
use crate::signing;
use jointwatch_firmware::store::{Key, SlotName, Started, Store, Trust, Upload, Verifier};
use jointwatch_shared::base::Model;
use jointwatch_shared::selftest::chain;
use jointwatch_shared::selftest::network::reference_network;
use jointwatch_shared::selftest::reference_model;
use jointwatch_shared::wire::blob::{self, BLOB_LEN};
use jointwatch_shared::wire::rig::Rig;
use jointwatch_shared::wire::rig_block::{self, RIG_BLOCK_LEN};
use jointwatch_shared::wire::slot::{CONFIRMED_OFFSETS, Header, SIGNATURE_LEN, SLOT_LEN};
use jointwatch_shared::wire::telemetry::{Signature, UploadReply, UploadRequest};
use std::collections::{HashMap, HashSet};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, RwLock};

/// A model and its rig block, signed.
struct Package {
    model: Model,
    rig: Vec<u8>,
    content: Vec<u8>,
    header: Header,
    signature: Signature,
}

fn package(release: u32, model: &Model, rig: &[u8]) -> Package {
    let content = [&blob::encode(model)[..], rig].concat();
    let header = signing::header(&content, release);
    Package {
        model: model.clone(),
        rig: rig.to_vec(),
        header,
        signature: signing::signature(&header),
        content,
    }
}

fn key() -> Key {
    Key::new(*signing::keys(0).pk)
}

/// The real check, its verdict remembered for each signature and content: a campaign judges the
/// same bytes a million times.
#[derive(Clone, Copy)]
struct Remembering<'a> {
    key: Key,
    known: &'a RwLock<HashMap<u64, bool>>,
}

impl Verifier for Remembering<'_> {
    fn holds(&self, message: &[u8], signature: &[u8; SIGNATURE_LEN]) -> bool {
        let mut hasher = DefaultHasher::new();
        (signature, message).hash(&mut hasher);
        let name = hasher.finish();
        if let Some(&known) = self.known.read().unwrap().get(&name) {
            return known;
        }
        let holds = self.key.holds(message, signature);
        self.known.write().unwrap().insert(name, holds);
        holds
    }
}

/// What a session did to the device, as far as power let it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ran {
    Nothing,
    Old,
    New,
}

struct Campaign<'a, V> {
    verifier: V,
    old: Option<&'a Package>,
    new: &'a Package,
}

impl<V: Verifier + Copy> Campaign<'_, V> {
    /// A restart: which model runs. Anything that is neither the old nor the new one, with its own
    /// rig block, is a bad state.
    fn start(&self, flash: Flash) -> (Store<Flash, V>, Started, Ran) {
        let mut store = Store::new(
            flash,
            Trust {
                keys: [Some(self.verifier), None],
                class: signing::CLASS,
                unsigned: false,
            },
        );
        let started = store.start(&mut [0; BLOB_LEN]);
        let ran = match &started.model {
            None => Ran::Nothing,
            // Power failed while it started: nothing runs.
            Some(_) if store.flash().is_dead() => Ran::Nothing,
            Some((_, model)) => {
                let mut room = [0; 4096];
                let rig = store.rig(started.rig_len, &mut room).unwrap_or_default();
                let is = |package: &Package| *model == package.model && rig == package.rig;
                if is(self.new) {
                    Ran::New
                } else if self.old.is_some_and(is) {
                    Ran::Old
                } else {
                    panic!("a mixture runs")
                }
            }
        };
        (store, started, ran)
    }

    /// A user's whole update: restart, confirm what is on trial, upload, restart, run the trial,
    /// restart. Stops where power does. Gives the flash.
    fn update(&self, flash: Flash) -> Flash {
        let (mut store, started, ran) = self.start(flash);
        if started.trial {
            let _ = store.confirm();
        }
        if ran != Ran::New {
            let mut upload = Upload::new();
            let mut work = [0; BLOB_LEN];
            let mut step = |request| upload.step(&mut store, &request, &mut work);
            let length = self.new.content.len() as u32;
            let mut reply = step(UploadRequest::Begin {
                header: self.new.header,
                signature: Some(self.new.signature),
            });
            while let UploadReply::Accepted { next } = reply {
                reply = if next == length {
                    step(UploadRequest::Finish)
                } else {
                    let rest = &self.new.content[next as usize..];
                    step(UploadRequest::Chunk {
                        offset: next,
                        data: rest.iter().copied().take(128).collect(),
                    })
                };
            }
            if !store.flash().is_dead() {
                assert!(matches!(reply, UploadReply::Activated { .. }), "{reply:?}");
            }
        }
        let flash = store.into_flash();
        if flash.is_dead() {
            return flash;
        }
        let (mut store, started, ran) = self.start(flash);
        if !store.flash().is_dead() {
            assert_eq!(ran, Ran::New, "{started:?}");
        }
        if started.trial {
            let _ = store.confirm();
        }
        let flash = store.into_flash();
        if flash.is_dead() {
            return flash;
        }
        let (store, started, ran) = self.start(flash);
        let proven = ran == Ran::New && !started.trial;
        assert!(proven || store.flash().is_dead(), "{started:?}");
        store.into_flash()
    }

    /// After a cut: one restart gives the old or the new model, and three updates at most bring the
    /// new one.
    fn survives(&self, flash: &Flash, seed: u64) {
        let mut flash = flash.clone();
        flash.power(None, seed);
        let (store, started, ran) = self.start(flash);
        assert!(
            ran != Ran::Nothing || self.old.is_none(),
            "nothing runs: {started:?}"
        );
        let mut flash = store.into_flash();
        flash.power(None, seed + 1);
        let flash = self.update(flash);
        let (_, started, ran) = self.start(flash);
        assert!(ran == Ran::New && !started.trial, "{started:?}");
    }
}

/// Works through `items` on all cores.
fn on_all_cores<T: Sync>(items: &[T], work: impl Fn(usize, &T) + Sync) {
    let next = AtomicU64::new(0);
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, Into::into) {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed) as usize;
                    let Some(item) = items.get(number) else { break };
                    work(number, item);
                }
            });
        }
    });
}

/// A rig block for this model.
fn rig(model: &Model) -> [u8; RIG_BLOCK_LEN] {
    let rig = chain::reference_rig(chain::SHORT_TAPS).expect("a sound rig");
    rig_block::encode(&Rig {
        model_checksum: blob::checksum_of(model),
        ..rig
    })
    .expect("a sound block")
}

fn old() -> Package {
    package(2, reference_model(), &rig(reference_model()))
}

fn new() -> Package {
    package(3, reference_network(), &rig(reference_network()))
}

/// The flash of a device that has been through these updates.
fn after<V: Verifier + Copy>(verifier: V, history: &[&Package]) -> Flash {
    let mut flash = Flash::erased();
    let mut before = None;
    for package in history {
        let campaign = Campaign {
            verifier,
            old: before,
            new: package,
        };
        flash.power(None, 1);
        flash = campaign.update(flash);
        before = Some(package);
    }
    flash
}

fn operations<V: Verifier + Copy>(campaign: &Campaign<V>, flash: &Flash) -> Vec<Operation> {
    let mut flash = flash.clone();
    flash.power(None, 2);
    campaign.update(flash).operations
}

#[test]
fn one_cut_anywhere_with_every_signature_checked() {
    let (old, new) = (old(), new());
    let older = package(1, reference_network(), &[]);
    let key = key();
    let full = after(key, &[&older, &old]);
    let campaign = Campaign {
        verifier: key,
        old: Some(&old),
        new: &new,
    };
    let operations = operations(&campaign, &full);
    let cuts = cuts(&operations, false);
    on_all_cores(&cuts, |number, &cut| {
        let mut flash = full.clone();
        flash.power(Some(cut), number as u64);
        let flash = campaign.update(flash);
        assert!(flash.is_dead(), "{cut:?} was never reached");
        campaign.survives(&flash, number as u64 + 7);
    });
    println!(
        "{} operations, {} single cuts: 0 bad states",
        operations.len(),
        cuts.len()
    );
}

#[test]
fn one_cut_anywhere_from_every_kind_of_beginning() {
    let (old, new) = (old(), new());
    let older = package(1, reference_network(), &[]);
    let known = RwLock::default();
    let verifier = Remembering {
        key: key(),
        known: &known,
    };
    let failed_trial = {
        // The newer model was started and never ran: slot B is void.
        let mut flash = after(verifier, &[&old]);
        flash.power(None, 3);
        let campaign = Campaign {
            verifier,
            old: Some(&old),
            new: &new,
        };
        let operations = operations(&campaign, &flash);
        let before_confirmation = Cut {
            operation: operations.len() - 1,
            how: How::Bytes(0),
        };
        flash.power(Some(before_confirmation), 4);
        let mut flash = campaign.update(flash);
        flash.power(None, 5);
        let (store, started, ran) = campaign.start(flash);
        assert!(
            ran == Ran::Old && started.set_aside == Some(SlotName::B),
            "{started:?}"
        );
        store.into_flash()
    };
    let mut cut_count = 0;
    for (name, flash, old) in [
        ("empty flash", Flash::erased(), None),
        ("one model", after(verifier, &[&old]), Some(&old)),
        ("two models", after(verifier, &[&older, &old]), Some(&old)),
        ("a failed trial", failed_trial, Some(&old)),
    ] {
        let campaign = Campaign {
            verifier,
            old,
            new: &new,
        };
        let operations = operations(&campaign, &flash);
        let cuts = cuts(&operations, true);
        on_all_cores(&cuts, |number, &cut| {
            let mut flash = flash.clone();
            flash.power(Some(cut), number as u64);
            let flash = campaign.update(flash);
            assert!(flash.is_dead(), "{name}: {cut:?} was never reached");
            campaign.survives(&flash, number as u64 + 7);
        });
        cut_count += cuts.len();
    }
    println!("{cut_count} single cuts from four beginnings: 0 bad states");
}

#[test]
fn one_cut_anywhere_from_which_a_model_that_counted_as_proven_goes_on() {
    let (old, new) = (old(), new());
    let known = RwLock::default();
    let verifier = Remembering {
        key: key(),
        known: &known,
    };
    let full = after(verifier, &[&old]);
    let campaign = Campaign {
        verifier,
        old: Some(&old),
        new: &new,
    };
    // The last operation says that the model has run. Power fails on it: it counts, until its cells
    // are as they were before.
    let operation = operations(&campaign, &full).len() - 1;
    for count in 1..=3 {
        let how = How::Bytes(count);
        let mut flash = full.clone();
        flash.power(Some(Cut { operation, how }), 1);
        let mut flash = campaign.update(flash);
        for restart in 0..3 {
            flash.power(None, restart);
            let (store, started, ran) = campaign.start(flash);
            assert!(ran == Ran::New && !started.trial, "{how:?}: {started:?}");
            flash = store.into_flash();
            if restart == 0 {
                let [first, ..] = CONFIRMED_OFFSETS;
                (0..count).for_each(|byte| flash.weaken(SECTOR + first + byte, 0xFF));
            }
        }
    }
}

/// Tries something on a device that was updated before, so that both of its slots hold a model.
fn on_two_models(test: impl FnOnce(&Campaign<'_, Remembering<'_>>, &Flash)) {
    let (old, new) = (old(), new());
    let older = package(1, reference_network(), &[]);
    let known = RwLock::default();
    let verifier = Remembering {
        key: key(),
        known: &known,
    };
    let full = after(verifier, &[&older, &old]);
    let campaign = Campaign {
        verifier,
        old: Some(&old),
        new: &new,
    };
    test(&campaign, &full);
}

#[test]
fn every_pair_of_cuts() {
    on_two_models(|campaign, full| {
        let first_cuts = cuts(&operations(campaign, full), true);
        // After a sector was erased whole, what happened before is forgotten: the same flash is
        // gone through once.
        let seen = Mutex::new(HashSet::new());
        let (pairs, run) = (AtomicU64::new(0), AtomicU64::new(0));
        on_all_cores(&first_cuts, |number, &first| {
            let mut flash = full.clone();
            flash.power(Some(first), number as u64);
            let mut broken = campaign.update(flash);
            // What the recovery does, when nothing disturbs it.
            broken.power(None, number as u64 + 11);
            let undisturbed = campaign.update(broken.clone());
            let second_cuts = cuts(&undisturbed.operations, false);
            let fresh = undisturbed
                .after_erasure
                .map(|(at, state)| (at, seen.lock().unwrap().insert(state)));
            for (second_number, &second) in second_cuts.iter().enumerate() {
                pairs.fetch_add(1, Ordering::Relaxed);
                if matches!(fresh, Some((at, false)) if second.operation >= at) {
                    continue;
                }
                run.fetch_add(1, Ordering::Relaxed);
                let mut flash = broken.clone();
                flash.power(Some(second), number as u64 + 11);
                let flash = campaign.update(flash);
                campaign.survives(&flash, second_number as u64 + 7);
            }
        });
        println!(
            "{} first cuts, {} pairs, {} of them run, the others from a flash that was gone through: 0 bad states",
            first_cuts.len(),
            pairs.into_inner(),
            run.into_inner()
        );
    });
}

/// The bytes of a sector of which one cell is weak: all where a bit decides something by itself,
/// and some of the others.
fn weak_places() -> impl Iterator<Item = usize> {
    let content = (0..8192).step_by(97);
    let marks = 8192..SLOT_LEN;
    let journal = (SLOT_LEN..SECTOR).step_by(7);
    content.chain(marks).chain(journal)
}

#[test]
fn one_weak_cell_anywhere_that_reads_right_until_power_comes_back() {
    on_two_models(|campaign, full| {
        let operations = operations(campaign, full).len();
        // Before it is sealed, sealed, tried, confirmed.
        let states: Vec<Flash> = (operations - 4..operations)
            .map(|operation| {
                let mut flash = full.clone();
                let how = How::After;
                flash.power(Some(Cut { operation, how }), 21);
                campaign.update(flash)
            })
            .collect();
        let weak: Vec<(usize, usize)> = (0..states.len())
            .flat_map(|state| weak_places().map(move |place| (state, place)))
            .flat_map(|(state, place)| [(state, place), (state, SECTOR + place)])
            // Before the new model is sealed there is one model, and no other copy of it.
            .filter(|&(state, place)| state > 0 || !(SECTOR..SECTOR + SLOT_LEN).contains(&place))
            .collect();
        on_all_cores(&weak, |number, &(state, place)| {
            let mut flash = states[state].clone();
            // A single bit, and the whole byte.
            flash.weaken(
                place,
                if number % 3 == 0 {
                    0xFF
                } else {
                    1 << (number % 8)
                },
            );
            campaign.survives(&flash, number as u64 + 7);
        });
        println!(
            "{} weak cells in {} states: 0 bad ones",
            weak.len(),
            states.len()
        );
    });
}

//! What a restart finds: model, rig block, limits, and everything that is wrong with them, each
//! with its name.

use super::channels::{Places, raw_wiring};
use super::evaluation::Evaluator;
use super::watch::{OnTrial, Watch};
use crate::clock::{Clock, Rate, Source};
use crate::pair::{self, Unfit};
use crate::store::{SlotFault, SlotName, Started, State, Store, Trial, Verifier};
use core::mem::MaybeUninit;
use embedded_storage::nor_flash::NorFlash;
use heapless::Vec;
use jointwatch_shared::base::Model;
use jointwatch_shared::chain::{Chain, ChainState};
use jointwatch_shared::monitor::limits::Limits;
use jointwatch_shared::monitor::{Cause, Monitor};
use jointwatch_shared::wire::blob::{self, BLOB_LEN};
use jointwatch_shared::wire::rig_block;
use jointwatch_shared::wire::telemetry::{
    Access, Event, Hello, ModelFault, ModelIdentity, Occasion, PROTOCOL_VERSION, Restart,
    RigIdentity,
};
use jointwatch_shared::wire::wiring::Wiring;

/// How long a new model has to run before it is kept, in seconds.
const TRIAL_S: u32 = 10;
/// How long it has to do so before the one before it runs again, in seconds.
const TRIAL_WITHIN_S: u32 = 60;

/// Room for what is too large to be built on the stack and handed round.
#[derive(Debug)]
pub struct Room {
    watch: MaybeUninit<Watch>,
    evaluator: MaybeUninit<Evaluator>,
    state: ChainState,
}

impl Room {
    /// Nothing in it yet.
    pub const EMPTY: Self = Self {
        watch: MaybeUninit::uninit(),
        evaluator: MaybeUninit::uninit(),
        state: ChainState::NEW,
    };
}

/// What a restart has made of the two slots.
pub struct Begun {
    /// Chain and model, when there is a model and a rig block that fit each other.
    pub evaluator: Option<&'static mut Evaluator>,
    /// How often the sensors are sampled.
    pub rate: Rate,
    /// Which chip is wired to what.
    pub wiring: Wiring,
    /// The monitor with its telemetry.
    pub watch: &'static mut Watch,
    /// Who the device is.
    pub hello: Hello,
    /// Why the rig block is not used.
    pub rig_refused: Option<&'static str>,
}

/// What a device brings to a restart.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    /// The processor's clock source and its frequency.
    pub clock: Clock,
    /// Why the device restarted.
    pub why: Restart,
    /// Whether every model in use was signed.
    pub signed: bool,
    /// Whether the firmware trusts the development key.
    pub development_key: bool,
}

/// Looks at both slots, and builds what runs from what they hold. `report` is shown what the store
/// found. What evaluates samples is built in `room`.
///
/// Runs once, before the first sample, and may take some tenths of a second: signatures are
/// checked.
///
/// Not inlined: what it needs on the stack is free again when samples begin.
#[inline(never)]
pub fn begin<F: NorFlash, V: Verifier>(
    store: &mut Store<F, V>,
    setup: Setup,
    room: &'static mut Room,
    report: impl FnOnce(&Started),
) -> Begun {
    let mut work = [0; BLOB_LEN];
    let started = store.start(&mut work);
    report(&started);
    let kept = store.remembered().ok().and_then(|entry| entry.alarm);
    let mut events: Vec<Event, 8> = Vec::new();
    // The list holds every event of a start.
    let mut say = |event| {
        let _ = events.push(event);
    };
    say(Event::Started { why: setup.why });
    if setup.clock.source == Source::Internal {
        say(Event::NoCrystal);
    }
    for (place, state) in SlotName::ALL.into_iter().zip(started.states) {
        if let Some(event) = refused(place, state) {
            say(event);
        }
    }
    if let Some(place) = started.set_aside {
        say(Event::ModelGivenUp { slot: place });
    }
    let mut begun = Begun {
        evaluator: None,
        rate: Rate::USUAL,
        wiring: raw_wiring(),
        watch: new_watch(&mut room.watch),
        hello: hello_without_model(setup.development_key),
        rig_refused: None,
    };
    let rig_len = started.rig_len;
    let trial = started.trial;
    let mut confirming = None;
    match started.model {
        None => say(Event::NoModel),
        Some((place, model)) => {
            // The store read the model that runs last, so its bytes are those in `work`.
            let checksum = blob::checksum(&work);
            begun.hello.model = Some(ModelIdentity::new(&model, place, checksum, setup.signed));
            confirming = trial.then_some(OnTrial {
                slot: place,
                evaluates: rig_len > 0,
                fallback: started.fallback && !started.flash_failed,
            });
            let unused = match store.rig(rig_len, &mut work) {
                None => Some((Event::NoRig, "there is none")),
                Some(bytes) => {
                    let places = (&mut room.evaluator, &mut room.state);
                    let used = with_rig(bytes, model, checksum, &mut begun, places);
                    used.err().map(|why| (why.event(), why.phrase()))
                }
            };
            if let Some((event, phrase)) = unused {
                begun.watch.judge(Err(Cause::NoRig));
                begun.rig_refused = Some(phrase);
                say(event);
            }
        }
    }
    let places = Places::of(&begun.wiring);
    begun
        .watch
        .start(begun.rate, places, setup.development_key, &events);
    if let Some(alarm) = kept {
        begun.watch.stands(alarm);
    }
    if let Some(of) = confirming {
        begun.try_out(of);
    }
    begun
}

impl Begun {
    /// Begins the trial of a model, which ends at once where nothing evaluates it.
    fn try_out(&mut self, of: OnTrial) {
        let [samples, within] = [TRIAL_S, TRIAL_WITHIN_S].map(|s| self.rate.samples(s));
        self.watch.try_out(Trial::over(samples, within), of);
        if of.evaluates && self.evaluator.is_none() {
            self.watch.give_up();
        }
    }
}

/// How a device introduces itself that has no model and was not asked whom it trusts.
fn hello_without_model(development_key: bool) -> Hello {
    Hello {
        protocol: PROTOCOL_VERSION,
        firmware: firmware_version(),
        occasion: Occasion::Restart,
        model: None,
        rig: None,
        access: Access {
            development_key,
            ..Access::default()
        },
    }
}

/// A watch that has nothing to judge yet. Not inlined, as above.
#[inline(never)]
fn new_watch(place: &'static mut MaybeUninit<Watch>) -> &'static mut Watch {
    place.write(Watch::new(Err(Cause::NoModel)))
}

/// Chain, monitor and wiring from the rig block's bytes.
///
/// Not inlined: its rig block would stand in the stack frame of everything that follows.
#[inline(never)]
fn with_rig(
    bytes: &[u8],
    model: Model,
    checksum: u32,
    begun: &mut Begun,
    (evaluator, state): (&'static mut MaybeUninit<Evaluator>, &'static mut ChainState),
) -> Result<(), Unfit> {
    let rig = rig_block::decode(bytes).map_err(Unfit::Refused)?;
    let rate = pair::rate(&rig, &model, checksum)?;
    let chain = Chain::new(&model, &rig).map_err(|error| Unfit::Refused(error.into()))?;
    let evaluator = evaluator.write(Evaluator {
        chain,
        model,
        state,
    });
    let chain = &evaluator.chain;
    set_limits(begun.watch, rig.limits, checksum, chain)?;
    let crc = bytes.last_chunk().copied().map_or(0, u32::from_le_bytes);
    begun.hello.rig = Some(RigIdentity::new(rate.hz, chain, crc));
    begun.rate = rate;
    begun.wiring = rig.wiring;
    begun.evaluator = Some(evaluator);
    Ok(())
}

/// Lets the watch judge by the limits of the rig block, where they are for this model. Not inlined,
/// as above.
#[inline(never)]
fn set_limits(
    watch: &mut Watch,
    limits: Option<Limits>,
    checksum: u32,
    chain: &Chain,
) -> Result<(), Unfit> {
    watch.judge(match limits {
        None => Err(Cause::NoLimits),
        Some(limits) if limits.model_checksum != checksum => Err(Cause::OtherModel),
        Some(limits) => Ok(Monitor::new(limits, chain).map_err(|_| Unfit::Mismatch)?),
    });
    Ok(())
}

/// What is told of a slot whose content is not used.
fn refused(slot: SlotName, state: State) -> Option<Event> {
    let State::Refused(why) = state else {
        return None;
    };
    let fault = match why {
        SlotFault::Unsigned | SlotFault::Signature | SlotFault::Class => {
            return Some(Event::ModelUnsigned { slot });
        }
        SlotFault::Model(fault) | SlotFault::Rig(fault) => fault,
        SlotFault::Mismatch => ModelFault::Other,
        SlotFault::Checksum => ModelFault::Checksum,
        SlotFault::Seal => ModelFault::Field,
        SlotFault::Unfinished => ModelFault::Length,
        SlotFault::Flash | SlotFault::Worn => ModelFault::Other,
    };
    Some(Event::ModelRefused { slot, fault })
}

/// Major, minor, patch of this package.
const fn firmware_version() -> [u16; 3] {
    let text = env!("CARGO_PKG_VERSION").as_bytes();
    let mut version = [0; 3];
    let (mut part, mut at) = (0, 0);
    while at < text.len() && part < version.len() {
        match text[at] {
            digit @ b'0'..=b'9' => version[part] = 10 * version[part] + (digit - b'0') as u16,
            b'.' => part += 1,
            // A pre-release's name has no place among three numbers.
            _ => break,
        }
        at += 1;
    }
    version
}

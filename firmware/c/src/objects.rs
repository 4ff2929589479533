//! Model, chain and monitor as objects in buffers of the caller, in safe Rust.

use crate::Kernels;
use crate::error::jw_error;
use crate::types::{
    JW_ALIGN, JW_BLOB_LENGTH, JW_CHAIN_SIZE, JW_MODEL_SIZE, JW_MONITOR_SIZE, jw_output,
};
use jointwatch_shared::base::Model;
use jointwatch_shared::chain::{Chain, ChainState, RawSample};
use jointwatch_shared::monitor::limits::Limits;
use jointwatch_shared::monitor::{Faults, Monitor, MonitorState, Verdict};
use jointwatch_shared::wire::{blob, rig_block};

/// An object that begins with a word by which it is known, and the buffer that holds it.
pub(crate) trait Object {
    /// The first word of the object, which tells what it is: four letters, little-endian.
    const TAG: u32;
    /// Bytes of its buffer.
    const SIZE: usize;
}

macro_rules! object {
    ($name:ident, $tag:literal, $size:ident) => {
        impl Object for $name {
            const TAG: u32 = u32::from_le_bytes(*$tag);
            const SIZE: usize = $size;
        }

        const _: () = assert!(core::mem::offset_of!($name, tag) == 0);
        const _: () = assert!(size_of::<$name>() <= $size && align_of::<$name>() <= JW_ALIGN);
    };
}

// The word has to come first, so that looking for it stays within a smaller buffer. `repr(C)` is
// written so that cbindgen, which does not expand it, leaves the objects opaque.

/// A model, checked in every respect.
#[cfg_attr(all(), repr(C))]
pub struct jw_model {
    tag: u32,
    checksum: u32,
    pub(crate) model: Model,
}

/// The chain of a rig and its state, with the model behind it.
#[cfg_attr(all(), repr(C))]
pub struct jw_chain {
    tag: u32,
    model: &'static jw_model,
    pub(crate) chain: Chain,
    state: ChainState,
    limits: Option<Limits>,
    pub(crate) sample_rate_hz: f64,
}

/// The monitor and its state.
#[cfg_attr(all(), repr(C))]
pub struct jw_monitor {
    tag: u32,
    pub(crate) axes: u32,
    pub(crate) monitor: Monitor,
    pub(crate) state: MonitorState,
}

object!(jw_model, b"JWmo", JW_MODEL_SIZE);
object!(jw_chain, b"JWch", JW_CHAIN_SIZE);
object!(jw_monitor, b"JWwa", JW_MONITOR_SIZE);

const _: () =
    assert!(blob::BLOB_LEN == JW_BLOB_LENGTH && rig_block::RIG_BLOCK_LEN == JW_BLOB_LENGTH);

impl jw_model {
    pub(crate) fn load(bytes: &[u8; JW_BLOB_LENGTH]) -> Result<Self, jw_error> {
        Ok(Self {
            tag: Self::TAG,
            checksum: blob::checksum(bytes),
            model: blob::decode(bytes)?,
        })
    }
}

impl jw_chain {
    pub(crate) fn new(
        rig: &[u8; JW_BLOB_LENGTH],
        model: &'static jw_model,
    ) -> Result<Self, jw_error> {
        let rig = rig_block::decode(rig)?;
        if rig.model_checksum != model.checksum || rig.axes.len() != model.model.axes() {
            return Err(jw_error::JW_OTHER_MODEL);
        }
        Ok(Self {
            tag: Self::TAG,
            chain: Chain::new(&model.model, &rig)?,
            model,
            state: ChainState::NEW,
            sample_rate_hz: rig.sample_rate_hz,
            limits: rig.limits,
        })
    }

    /// Takes one sample in.
    #[inline]
    pub(crate) fn step(&mut self, sample: &RawSample, wrong: Option<&Faults>) -> jw_output {
        // Without a notch there is nothing to hold.
        if self.chain.tracks_hum() && wrong.is_some_and(Faults::any) {
            self.state.hold_notches(self.chain.invalidated_by_fault());
        }
        let output = self
            .chain
            .step_by::<Kernels>(&mut self.state, &self.model.model, sample);
        output
            .as_ref()
            .map_or_else(jw_output::default, jw_output::from)
    }
}

impl jw_monitor {
    pub(crate) fn new(chain: &jw_chain) -> Result<Self, jw_error> {
        let limits = chain.limits.clone().ok_or(jw_error::JW_NO_LIMITS)?;
        if limits.model_checksum != chain.model.checksum {
            return Err(jw_error::JW_OTHER_MODEL);
        }
        Ok(Self {
            tag: Self::TAG,
            axes: chain.chain.axes() as u32,
            monitor: Monitor::new(limits, &chain.chain)?,
            state: MonitorState::default(),
        })
    }

    /// Takes one sample in: the counts, what the chain made of them, and what was wrong with the
    /// sensors.
    #[inline]
    pub(crate) fn step(
        &mut self,
        sample: &RawSample,
        output: &jw_output,
        wrong: Option<&Faults>,
    ) -> Verdict {
        let faults = wrong.unwrap_or(const { &WELL });
        let output = output.output();
        self.monitor
            .update(&mut self.state, sample, output.as_ref(), faults)
    }
}

/// The faults of a sample for which the caller names none.
const WELL: Faults = Faults {
    saturated: 0,
    out_of_range: 0,
    checksum: 0,
    time_out: 0,
    missing: 0,
    reference_lost: 0,
    lost: 0,
};

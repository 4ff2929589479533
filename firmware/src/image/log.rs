//! What the device says over defmt while it starts, for a person with a debug probe.

use defmt::{info, warn};
use jointwatch_firmware::app::Begun;
use jointwatch_firmware::clock::{Clock, Source};
use jointwatch_firmware::key::IS_DEVELOPMENT_KEY;
use jointwatch_firmware::store::{SlotName, Started, State};
use jointwatch_shared::base::Model;
use jointwatch_shared::base::axis::AxisKind;
use jointwatch_shared::wire::telemetry::Restart;

/// Version, clock, key, and why it started.
pub(crate) fn start(clock: Clock, why: Restart) {
    info!("jointwatch {=str}", env!("CARGO_PKG_VERSION"));
    match clock.source {
        Source::Crystal => info!("clock: crystal, {=u32} Hz", clock.hz),
        Source::Internal => warn!(
            "clock: internal oscillator, {=u32} Hz: no crystal",
            clock.hz
        ),
    }
    match why {
        Restart::Fault => warn!("restarted after a processor fault or a panic"),
        Restart::Watchdog => warn!("restarted by the watchdog"),
        Restart::BrownOut => warn!("restarted after the supply had dropped"),
        Restart::Software => info!("restarted by the program"),
        Restart::PowerOn | Restart::Pin | Restart::Unknown => {}
    }
    if IS_DEVELOPMENT_KEY {
        warn!("this image trusts the development key: anybody can put a model onto it");
    }
}

/// What the two slots hold.
pub(crate) fn slots(started: &Started) {
    for (place, state) in SlotName::ALL.into_iter().zip(started.states) {
        let name = place.name();
        match state {
            State::Empty => info!("slot {=str}: empty", name),
            State::Void => info!("slot {=str}: set aside", name),
            State::Refused(why) => warn!("slot {=str}: refused: {=str}", name, why.words()),
            State::Good { .. } => info!("slot {=str}: a model", name),
        }
    }
    if let Some(place) = started.set_aside {
        warn!("slot {=str}: its model failed its trial", place.name());
    }
    if started.flash_failed {
        warn!("the flash could not be marked");
    }
    match &started.model {
        Some((place, model)) => introduce(*place, model),
        None => warn!("no model"),
    }
}

/// Which joint the model in use is of.
fn introduce(place: SlotName, model: &Model) {
    let header = model.header();
    info!(
        "model in use: slot {=str}, {=usize} axes, learnt at {=f64} Hz",
        place.name(),
        model.axes(),
        header.sample_rate_hz
    );
    for (axis, output) in header.axes.iter().zip(model.outputs()) {
        let unit = match axis.kind {
            AxisKind::Translation => "N",
            AxisKind::Rotation => "N·m",
        };
        info!(
            "axis {=str}: {=f64} {=str} per unit of force",
            axis.name.as_str(),
            output.force_per_lsb,
            unit
        );
        match axis.validation {
            Some(seen) => info!(
                "axis {=str}: NMSE {=f32} % on unseen records",
                axis.name.as_str(),
                seen.nmse_percent
            ),
            None => warn!(
                "axis {=str}: never compared with unseen records",
                axis.name.as_str()
            ),
        }
    }
}

/// What the device does from now on.
pub(crate) fn begun(begun: &Begun) {
    if let Some(why) = begun.rig_refused {
        warn!("rig block not used, raw counts only: {=str}", why);
    }
    info!("sampling at {=f64} Hz", begun.rate.hz);
}

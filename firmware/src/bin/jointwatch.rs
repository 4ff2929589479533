//! The image that is flashed: starts the board, finds its model, says over defmt what it found, and waits.
#![no_std]
#![no_main]

use cortex_m::asm::wfi;
use cortex_m::peripheral::SCB;
use defmt::{info, warn};
use jointwatch_firmware::board::stm32f405 as board;
use jointwatch_firmware::clock::Source;
use jointwatch_firmware::store::{self, Place, Slot};
use jointwatch_shared::model::Model;
use jointwatch_shared::model::axis::AxisKind;

#[cortex_m_rt::entry]
fn main() -> ! {
    let (clock, _) = board::start();
    info!("jointwatch {=str}", env!("CARGO_PKG_VERSION"));
    match clock.source {
        Source::Crystal => info!("clock: crystal, {=u32} Hz", clock.hz),
        Source::Internal => warn!(
            "clock: internal oscillator, {=u32} Hz: no crystal",
            clock.hz
        ),
    }
    match store::choose(&board::slots(), report) {
        Some((place, model)) => introduce(place, &model),
        None => warn!("no model"),
    }
    info!("ready");
    loop {
        wfi();
    }
}

/// What a slot holds.
fn report(place: Place, slot: &Slot) {
    let name = place.name();
    match slot {
        Slot::Empty => info!("slot {=str}: empty", name),
        Slot::Refused(why) => warn!("slot {=str}: refused: {=str}", name, store::phrase(why)),
        Slot::Model(_) => info!("slot {=str}: a model", name),
    }
}

/// Which joint the model in use is of.
fn introduce(place: Place, model: &Model) {
    let header = model.header();
    info!(
        "model in use: slot {=str}, {=usize} axes, learnt at {=f64} Hz",
        place.name(),
        model.axes(),
        header.sample_rate_hz
    );
    let middle = model.evaluate(&[0; 4]);
    for ((axis, output), force) in header.axes.iter().zip(model.outputs()).zip(middle) {
        let unit = match axis.kind {
            AxisKind::Translation => "N",
            AxisKind::Rotation => "N·m",
        };
        info!(
            "axis {=str}: {=i32} × {=f64} {=str} at the middle of its range",
            axis.name.as_str(),
            force,
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

/// A fault has no better answer than a fresh start.
#[cortex_m_rt::exception]
unsafe fn HardFault(_: &cortex_m_rt::ExceptionFrame) -> ! {
    SCB::sys_reset()
}

/// Never reached: a test finds no path to it in the release image. The language asks for it all the same.
///
/// The undefined instruction leads to the fault above; were the two functions alike, the linker would make them one
/// and the test could not tell them apart.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    cortex_m::asm::udf()
}

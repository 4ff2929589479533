//! The fields of a rig block as they lie in its bytes, before any of them is believed.

use super::{RIG_BLOCK_MAGIC, RIG_BLOCK_VERSION, Refusal, RigBlock, TAPS_OFFSET, unless_zero};
use crate::error::Error;
use crate::layout::{Field, laid_out};
use crate::rig::{ChannelDelays, MAX_TAPS, Rig, RigAxis, Taps};
use crate::wiring::{
    ACCELEROMETERS, Accelerometer, AxisWiring, COUNTERS, Converter, Counter, Signed,
    SignedDirection, Wiring,
};
use heapless::Vec;

/// What stands where nothing is wired.
const NOT_WIRED: u8 = 0xFF;

laid_out! {
/// Everything before the taps.
pub(super) struct Message {
    magic: [u8; 4],
    version: u16,
    axes: u8,
    pub(super) limits: u8,
    sample_rate_hz: f64,
    counters: [CounterMessage; COUNTERS],
    converter: ConverterMessage,
    accelerometers: [AccelerometerMessage; ACCELEROMETERS],
    axis: [AxisMessage; 2],
    /// Of the first derivative, the second and the low-pass.
    shifts: [i8; 3],
    reserved: u8,
    derivative_taps: u16,
    band_taps: u16,
}
}

laid_out! {
#[derive(Clone, Copy, Default)]
struct CounterMessage {
    start: i32,
    fitted: u8,
    quadrature: u8,
    index: u8,
    reserved: u8,
}
}

laid_out! {
#[derive(Clone, Copy)]
struct ConverterMessage {
    gain_log2: [u8; 4],
    oversampling: u8,
    reserved: [u8; 3],
}
}

laid_out! {
#[derive(Clone, Copy, Default)]
struct AccelerometerMessage {
    fitted: u8,
    range: u8,
    filter: u8,
    external_sync: u8,
    reserved: [u8; 4],
}
}

laid_out! {
/// One axis; all zero for the second of a one-axis rig.
#[derive(Clone, Copy, Default)]
struct AxisMessage {
    displacement_step: f64,
    body_step: f64,
    acceleration_step: f64,
    force_step: f64,
    inertia: f64,
    ground_stiffness: f64,
    ground_damping: f64,
    force_cross: f64,
    displacement_delay: f64,
    body_delay: f64,
    acceleration_delay: f64,
    force_delay: f64,
    pair_distance_m: f64,
    convention: u8,
    far: [u8; 2],
    near: [u8; 2],
    body: [u8; 2],
    force: [u8; 2],
    acceleration: [[u8; 3]; 2],
    reserved: u8,
}
}

/// Writes taps to the beginning of their places, which are zeros.
pub(super) fn write_taps(taps: &[i32], places: &mut [[u8; 4]]) {
    for (place, tap) in places.iter_mut().zip(taps) {
        *place = tap.to_le_bytes();
    }
}

/// A mark that is 0 or 1.
fn mark(field: &'static str, seen: u8) -> Result<bool, Refusal> {
    match seen {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(Refusal::Field { field, seen }),
    }
}

fn source(signed: Option<Signed>) -> [u8; 2] {
    signed.map_or([NOT_WIRED, 0], |s| [s.place, u8::from(s.negative)])
}

fn signed(field: &'static str, [place, negative]: [u8; 2]) -> Result<Option<Signed>, Refusal> {
    let negative = mark(field, negative)?;
    match place {
        NOT_WIRED if negative => Err(Refusal::Field { field, seen: place }),
        NOT_WIRED => Ok(None),
        place => Ok(Some(Signed { place, negative })),
    }
}

/// What has to be wired.
fn wired(field: &'static str, bytes: [u8; 2]) -> Result<Signed, Refusal> {
    let seen = NOT_WIRED;
    signed(field, bytes)?.ok_or(Refusal::Field { field, seen })
}

fn direction([chip, direction, negative]: [u8; 3]) -> Result<Option<SignedDirection>, Refusal> {
    let field = "sign of an accelerometer";
    let negative = mark(field, negative)?;
    match chip {
        NOT_WIRED if negative || direction != 0 => Err(Refusal::Field {
            field: "accelerometer that is not wired",
            seen: direction,
        }),
        NOT_WIRED => Ok(None),
        chip => Ok(Some(SignedDirection {
            chip,
            direction,
            negative,
        })),
    }
}

impl Message {
    pub(super) fn of(block: &RigBlock) -> Self {
        let (rig, wiring) = (&block.rig, &block.wiring);
        let mut axis = [AxisMessage::default(); 2];
        for (place, (rig, wiring)) in axis.iter_mut().zip(rig.axes.iter().zip(&wiring.axes)) {
            *place = AxisMessage::of(rig, wiring);
        }
        Self {
            magic: RIG_BLOCK_MAGIC,
            version: RIG_BLOCK_VERSION,
            axes: rig.axes.len() as u8,
            limits: u8::from(block.limits.is_some()),
            sample_rate_hz: rig.sample_rate_hz,
            counters: wiring.counters.map(|counter| {
                counter.map_or(CounterMessage::default(), |counter| CounterMessage {
                    start: counter.start,
                    fitted: 1,
                    quadrature: counter.quadrature,
                    index: u8::from(counter.index),
                    reserved: 0,
                })
            }),
            converter: ConverterMessage {
                gain_log2: wiring.converter.gain_log2,
                oversampling: wiring.converter.oversampling,
                reserved: [0; 3],
            },
            accelerometers: wiring.accelerometers.map(|chip| {
                chip.map_or(AccelerometerMessage::default(), |chip| {
                    AccelerometerMessage {
                        fitted: 1,
                        range: chip.range,
                        filter: chip.filter,
                        external_sync: u8::from(chip.external_sync),
                        reserved: [0; 4],
                    }
                })
            }),
            axis,
            shifts: [rig.velocity.shift, rig.acceleration.shift, rig.band.shift],
            reserved: 0,
            // 257 at most.
            derivative_taps: rig.velocity.taps.len() as u16,
            band_taps: rig.band.taps.len() as u16,
        }
    }

    /// The rig, with its filters from the bytes of the taps; `header` are this message's own bytes. What it holds is checked by the caller.
    pub(super) fn rig(&self, header: &[u8], taps: &[u8]) -> Result<Rig, Refusal> {
        let reserved = TAPS_OFFSET - 5;
        unless_zero(reserved, &[self.reserved])?;
        let (places, _) = taps.as_chunks::<4>();
        let (velocity, places) = places.split_at_checked(MAX_TAPS).unwrap_or_default();
        let (acceleration, band) = places.split_at_checked(MAX_TAPS).unwrap_or_default();
        let [of_velocity, of_acceleration, of_band] = self.shifts;
        let second = TAPS_OFFSET + 4 * MAX_TAPS;
        let mut axes = Vec::new();
        for (number, axis) in self.axis.iter().enumerate() {
            if number < usize::from(self.axes) {
                // Two at most, as the array that is walked.
                let _ = axes.push(axis.rig_axis()?);
            } else {
                let offset = AXES_OFFSET + number * AxisMessage::LEN;
                let bytes = header.get(offset..offset + AxisMessage::LEN);
                unless_zero(offset, bytes.unwrap_or_default())?;
            }
        }
        Error::unless_within("number of axes", f64::from(self.axes), 1.0, 2.0)?;
        Ok(Rig {
            sample_rate_hz: self.sample_rate_hz,
            axes,
            velocity: filter(TAPS_OFFSET, velocity, self.derivative_taps, of_velocity)?,
            acceleration: filter(second, acceleration, self.derivative_taps, of_acceleration)?,
            band: filter(second + 4 * MAX_TAPS, band, self.band_taps, of_band)?,
        })
    }

    /// The wiring; what it holds is checked by the caller.
    pub(super) fn wiring(&self) -> Result<Wiring, Refusal> {
        let mut counters = [None; COUNTERS];
        let messages = self.counters.iter().enumerate();
        for (counter, (number, message)) in counters.iter_mut().zip(messages) {
            let offset = COUNTERS_OFFSET + 8 * number;
            unless_zero(offset + 7, &[message.reserved])?;
            if mark("mark of a fitted counter", message.fitted)? {
                *counter = Some(Counter {
                    quadrature: message.quadrature,
                    start: message.start,
                    index: mark("index of a counter", message.index)?,
                });
            } else {
                unless_zero(offset, &message.start.to_le_bytes())?;
                unless_zero(offset + 5, &[message.quadrature, message.index])?;
            }
        }
        let converter = COUNTERS_OFFSET + 8 * COUNTERS;
        unless_zero(converter + 5, &self.converter.reserved)?;
        let mut accelerometers = [None; ACCELEROMETERS];
        let messages = self.accelerometers.iter().enumerate();
        for (chip, (number, message)) in accelerometers.iter_mut().zip(messages) {
            let offset = converter + 8 * (1 + number);
            unless_zero(offset + 4, &message.reserved)?;
            if mark("mark of a fitted accelerometer", message.fitted)? {
                *chip = Some(Accelerometer {
                    range: message.range,
                    filter: message.filter,
                    external_sync: mark("sync of an accelerometer", message.external_sync)?,
                });
            } else {
                let settings = [message.range, message.filter, message.external_sync];
                unless_zero(offset + 1, &settings)?;
            }
        }
        let mut axes = Vec::new();
        for axis in self.axis.iter().take(usize::from(self.axes)) {
            // Two at most, as the array that is walked.
            let _ = axes.push(axis.wiring()?);
        }
        Ok(Wiring {
            counters,
            converter: Converter {
                gain_log2: self.converter.gain_log2,
                oversampling: self.converter.oversampling,
            },
            accelerometers,
            axes,
        })
    }
}

/// A filter of `length` taps at the beginning of its places; the others have to be empty.
fn filter<const MOST: usize>(
    offset: usize,
    places: &[[u8; 4]],
    length: u16,
    shift: i8,
) -> Result<Taps<MOST>, Refusal> {
    let most = MOST as f64;
    Error::unless_within("number of a filter's taps", f64::from(length), 1.0, most)?;
    let length = usize::from(length);
    let (used, unused) = places.split_at_checked(length).unwrap_or_default();
    unless_zero(offset + 4 * length, unused.as_flattened())?;
    let mut taps = Vec::new();
    for tap in used {
        // There are no more than it holds; a collector would keep a panic for the case that there were.
        let _ = taps.push(i32::from_le_bytes(*tap));
    }
    Ok(Taps { taps, shift })
}

/// Where the counters' settings begin.
const COUNTERS_OFFSET: usize = 16;
/// Where the first axis begins.
const AXES_OFFSET: usize = COUNTERS_OFFSET + 8 * (COUNTERS + 1 + ACCELEROMETERS);

impl AxisMessage {
    fn of(rig: &RigAxis, wiring: &AxisWiring) -> Self {
        // A zero has one form: this makes that of a negative one.
        let f = |value: f64| value + 0.0;
        Self {
            displacement_step: f(rig.displacement_step),
            body_step: f(rig.body_step),
            acceleration_step: f(rig.acceleration_step),
            force_step: f(rig.force_step),
            inertia: f(rig.inertia),
            ground_stiffness: f(rig.ground_stiffness),
            ground_damping: f(rig.ground_damping),
            force_cross: f(rig.force_cross),
            displacement_delay: f(rig.delays.displacement),
            body_delay: f(rig.delays.body),
            acceleration_delay: f(rig.delays.acceleration),
            force_delay: f(rig.force_delay_samples),
            pair_distance_m: f(wiring.pair_distance_m),
            convention: u8::from(rig.inertia_minus_force),
            far: source(Some(wiring.far)),
            near: source(wiring.near),
            body: source(wiring.body),
            force: source(Some(wiring.force)),
            acceleration: wiring.acceleration.map(|direction| {
                direction.map_or([NOT_WIRED, 0, 0], |d| {
                    [d.chip, d.direction, u8::from(d.negative)]
                })
            }),
            reserved: 0,
        }
    }

    fn rig_axis(&self) -> Result<RigAxis, Refusal> {
        let quantities = [
            self.displacement_step,
            self.body_step,
            self.acceleration_step,
            self.force_step,
            self.inertia,
            self.ground_stiffness,
            self.ground_damping,
            self.force_cross,
            self.displacement_delay,
            self.body_delay,
            self.acceleration_delay,
            self.force_delay,
            self.pair_distance_m,
        ];
        if quantities.iter().any(|q| *q == 0.0 && q.is_sign_negative()) {
            return Err(Refusal::Field {
                field: "sign of a zero",
                seen: 0x80,
            });
        }
        Ok(RigAxis {
            displacement_step: self.displacement_step,
            displacement_difference: signed("sign of a near counter", self.near)?.is_some(),
            body_step: self.body_step,
            acceleration_step: self.acceleration_step,
            force_step: self.force_step,
            inertia: self.inertia,
            inertia_minus_force: mark("sign convention", self.convention)?,
            ground_stiffness: self.ground_stiffness,
            ground_damping: self.ground_damping,
            force_cross: self.force_cross,
            force_delay_samples: self.force_delay,
            delays: ChannelDelays {
                displacement: self.displacement_delay,
                body: self.body_delay,
                acceleration: self.acceleration_delay,
            },
        })
    }

    fn wiring(&self) -> Result<AxisWiring, Refusal> {
        if self.reserved != 0 {
            return Err(Refusal::Field {
                field: "reserved byte of an axis",
                seen: self.reserved,
            });
        }
        let [first, second] = self.acceleration;
        Ok(AxisWiring {
            far: wired("far counter of an axis", self.far)?,
            near: signed("near counter of an axis", self.near)?,
            body: signed("body counter of an axis", self.body)?,
            force: wired("bridge channel of an axis", self.force)?,
            acceleration: [direction(first)?, direction(second)?],
            pair_distance_m: self.pair_distance_m,
        })
    }
}

const _: () = assert!(Message::LEN == AXES_OFFSET + 2 * AxisMessage::LEN + 8);

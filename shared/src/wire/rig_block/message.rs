//! What the device reads of a rig block, as it lies in its bytes, before any of it is believed: wiring, filters, the chain's numbers.

use super::{RIG_BLOCK_MAGIC, RIG_BLOCK_VERSION, Refusal, RigBlock, Seen};
use crate::chain::Chain;
use crate::chain::numbers::Numbers;
use crate::fault::Checks;
use crate::wire::layout::{Field, laid_out};
use crate::wire::rig::{MAX_BAND_TAPS, MAX_TAPS};
use crate::wire::wiring::{
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
    pub(super) sample_rate_hz: f64,
    pub(super) sample_rate_uhz: u64,
    pub(super) model_checksum: u32,
    derivative_taps: u16,
    band_taps: u16,
    counters: [CounterMessage; COUNTERS],
    gain_log2: [u8; 4],
    oversampling: u8,
    band_shift: i8,
    reserved: [u8; 2],
    accelerometers: [AccelerometerMessage; ACCELEROMETERS],
    wiring: [WiringMessage; 2],
    chain: Numbers,
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
#[derive(Clone, Copy, Default)]
struct AccelerometerMessage {
    fitted: u8,
    range: u8,
    filter: u8,
    external_sync: u8,
}
}

laid_out! {
/// Where the counts of one axis come from; all zero for the second of a one-axis rig.
#[derive(Clone, Copy, Default)]
struct WiringMessage {
    pair_distance_m: f64,
    far: [u8; 2],
    near: [u8; 2],
    body: [u8; 2],
    force: [u8; 2],
    acceleration: [[u8; 3]; 2],
    reserved: [u8; 2],
}
}

/// Where the counters' settings begin.
const COUNTERS_OFFSET: usize = 32;
/// Where the converter's do.
const CONVERTER_OFFSET: usize = COUNTERS_OFFSET + COUNTERS * CounterMessage::LEN;
/// Where the accelerometers' do.
const ACCELEROMETERS_OFFSET: usize = CONVERTER_OFFSET + 8;
/// Where the wiring of the axes does.
const WIRING_OFFSET: usize = ACCELEROMETERS_OFFSET + ACCELEROMETERS * AccelerometerMessage::LEN;
/// Where the chain's numbers do.
const NUMBERS_OFFSET: usize = WIRING_OFFSET + 2 * WiringMessage::LEN;

const _: () = assert!(Message::LEN == NUMBERS_OFFSET + Numbers::LEN);

/// Writes taps to the beginning of their places, which are zeros.
pub(super) fn write_taps(taps: &[i32], places: &mut [[u8; 4]]) {
    for (place, tap) in places.iter_mut().zip(taps) {
        *place = tap.to_le_bytes();
    }
}

fn source(signed: Option<Signed>) -> [u8; 2] {
    signed.map_or([NOT_WIRED, 0], |s| [s.place, u8::from(s.negative)])
}

impl Seen {
    #[inline(never)]
    fn signed(&mut self, field: &'static str, [place, negative]: [u8; 2]) -> Option<Signed> {
        let negative = self.mark(field, negative);
        if place != NOT_WIRED {
            return Some(Signed { place, negative });
        }
        if negative {
            self.say(Refusal::Field { field, seen: place });
        }
        None
    }

    /// What has to be wired.
    fn wired(&mut self, field: &'static str, bytes: [u8; 2]) -> Signed {
        let signed = self.signed(field, bytes);
        if signed.is_none() {
            let seen = NOT_WIRED;
            self.say(Refusal::Field { field, seen });
        }
        signed.unwrap_or(Signed {
            place: NOT_WIRED,
            negative: false,
        })
    }

    #[inline(never)]
    fn direction(&mut self, [chip, direction, negative]: [u8; 3]) -> Option<SignedDirection> {
        let negative = self.mark("sign of an accelerometer", negative);
        if chip != NOT_WIRED {
            return Some(SignedDirection {
                chip,
                direction,
                negative,
            });
        }
        if negative || direction != 0 {
            self.say(Refusal::Field {
                field: "accelerometer that is not wired",
                seen: direction,
            });
        }
        None
    }
}

impl Message {
    pub(super) fn of(block: &RigBlock) -> Self {
        let (rig, wiring) = (&block.rig, &block.wiring);
        let mut of_axes = [WiringMessage::default(); 2];
        for (place, wiring) in of_axes.iter_mut().zip(&wiring.axes) {
            *place = WiringMessage::of(wiring);
        }
        Self {
            magic: RIG_BLOCK_MAGIC,
            version: RIG_BLOCK_VERSION,
            axes: rig.axes.len() as u8,
            limits: u8::from(block.limits.is_some()),
            sample_rate_hz: rig.sample_rate_hz,
            sample_rate_uhz: rig.sample_rate_uhz(),
            model_checksum: block.model_checksum,
            // 257 at most.
            derivative_taps: rig.velocity.taps.len() as u16,
            band_taps: rig.band.taps.len() as u16,
            counters: wiring.counters.map(|counter| {
                counter.map_or(CounterMessage::default(), |counter| CounterMessage {
                    start: counter.start,
                    fitted: 1,
                    quadrature: counter.quadrature,
                    index: u8::from(counter.index),
                    reserved: 0,
                })
            }),
            gain_log2: wiring.converter.gain_log2,
            oversampling: wiring.converter.oversampling,
            band_shift: rig.band.shift,
            reserved: [0; 2],
            accelerometers: wiring.accelerometers.map(|chip| {
                chip.map_or(AccelerometerMessage::default(), |chip| {
                    AccelerometerMessage {
                        fitted: 1,
                        range: chip.range,
                        filter: chip.filter,
                        external_sync: u8::from(chip.external_sync),
                    }
                })
            }),
            wiring: of_axes,
            chain: Numbers::of(&block.chain),
        }
    }

    /// Puts the numbers and the filters, from the bytes of the taps, into an empty chain.
    #[inline(never)]
    pub(super) fn put_chain(&self, taps: &[u8], chain: &mut Chain) -> Result<(), Refusal> {
        let mut checks = Checks::new();
        for (count, most) in [
            (self.derivative_taps, MAX_TAPS),
            (self.band_taps, MAX_BAND_TAPS),
        ] {
            let quantity = "number of a filter's taps";
            checks.whole(quantity, i32::from(count), 1, most as i32);
        }
        checks.done()?;
        let mut seen = Seen::new();
        seen.zeros(NUMBERS_OFFSET + 3, &[self.chain.reserved]);
        let (places, _) = taps.as_chunks::<4>();
        let (velocity, places) = places.split_at_checked(MAX_TAPS).unwrap_or_default();
        let (acceleration, band) = places.split_at_checked(MAX_TAPS).unwrap_or_default();
        let mut offset = Self::LEN;
        let counts = [self.derivative_taps, self.derivative_taps, self.band_taps];
        let mut filters = [velocity, acceleration, band];
        for (filter, count) in filters.iter_mut().zip(counts) {
            let places = *filter;
            let count = usize::from(count);
            let (used, unused) = places.split_at_checked(count).unwrap_or_default();
            seen.zeros(offset + 4 * count, unused.as_flattened());
            *filter = used;
            offset += 4 * places.len();
        }
        seen.done()?;
        let tap = |place: &[u8; 4]| i32::from_le_bytes(*place);
        let filters = filters.map(|places| places.iter().map(tap));
        self.chain.put(self.axes, filters, self.band_shift, chain)?;
        Ok(())
    }

    /// The wiring; what it holds is checked by the caller.
    #[inline(never)]
    pub(super) fn wiring(&self, seen: &mut Seen) -> Wiring {
        let mut counters = [None; COUNTERS];
        let messages = self.counters.iter().enumerate();
        for (counter, (number, message)) in counters.iter_mut().zip(messages) {
            let offset = COUNTERS_OFFSET + CounterMessage::LEN * number;
            seen.zeros(offset + 7, &[message.reserved]);
            if seen.mark("mark of a fitted counter", message.fitted) {
                *counter = Some(Counter {
                    quadrature: message.quadrature,
                    start: message.start,
                    index: seen.mark("index of a counter", message.index),
                });
            } else {
                seen.zeros(offset, &message.start.to_le_bytes());
                seen.zeros(offset + 5, &[message.quadrature, message.index]);
            }
        }
        seen.zeros(CONVERTER_OFFSET + 6, &self.reserved);
        let mut accelerometers = [None; ACCELEROMETERS];
        let messages = self.accelerometers.iter().enumerate();
        for (chip, (number, message)) in accelerometers.iter_mut().zip(messages) {
            let offset = ACCELEROMETERS_OFFSET + AccelerometerMessage::LEN * number;
            if seen.mark("mark of a fitted accelerometer", message.fitted) {
                *chip = Some(Accelerometer {
                    range: message.range,
                    filter: message.filter,
                    external_sync: seen.mark("sync of an accelerometer", message.external_sync),
                });
            } else {
                let settings = [message.range, message.filter, message.external_sync];
                seen.zeros(offset + 1, &settings);
            }
        }
        let mut axes = Vec::new();
        for (number, axis) in self.wiring.iter().enumerate() {
            let offset = WIRING_OFFSET + WiringMessage::LEN * number;
            if number < usize::from(self.axes) {
                // Two at most, as the array that is walked.
                let _ = axes.push(axis.wiring(offset, seen));
            } else {
                seen.zeros(offset, &axis.pair_distance_m.to_bits().to_le_bytes());
                let places = [axis.far, axis.near, axis.body, axis.force];
                seen.zeros(offset + 8, places.as_flattened());
                seen.zeros(offset + 16, axis.acceleration.as_flattened());
                seen.zeros(offset + 22, &axis.reserved);
            }
        }
        Wiring {
            counters,
            converter: Converter {
                gain_log2: self.gain_log2,
                oversampling: self.oversampling,
            },
            accelerometers,
            axes,
        }
    }
}

impl WiringMessage {
    fn of(wiring: &AxisWiring) -> Self {
        Self {
            // A zero has one form: this makes that of a negative one.
            pair_distance_m: wiring.pair_distance_m + 0.0,
            far: source(Some(wiring.far)),
            near: source(wiring.near),
            body: source(wiring.body),
            force: source(Some(wiring.force)),
            acceleration: wiring.acceleration.map(|direction| {
                direction.map_or([NOT_WIRED, 0, 0], |d| {
                    [d.chip, d.direction, u8::from(d.negative)]
                })
            }),
            reserved: [0; 2],
        }
    }

    #[inline(never)]
    fn wiring(&self, offset: usize, seen: &mut Seen) -> AxisWiring {
        seen.zeros(offset + 22, &self.reserved);
        if self.pair_distance_m.is_sign_negative() {
            seen.say(Refusal::Field {
                field: "sign of a distance",
                seen: 0x80,
            });
        }
        let [first, second] = self.acceleration;
        AxisWiring {
            far: seen.wired("far counter of an axis", self.far),
            near: seen.signed("near counter of an axis", self.near),
            body: seen.signed("body counter of an axis", self.body),
            force: seen.wired("bridge channel of an axis", self.force),
            acceleration: [seen.direction(first), seen.direction(second)],
            pair_distance_m: self.pair_distance_m,
        }
    }
}

//! What a count is worth in SI, as it lies in a rig block: for people and the host. The device has the chain's numbers instead.

use super::{Refusal, SI_OFFSET, Seen, TAPS_OFFSET};
use crate::base::hum::Hum;
use crate::chain::Chain;
use crate::wire::layout::{Field, laid_out};
use crate::wire::rig::{ChannelDelays, MAX_TAPS, Rig, RigAxis, Taps};
use crate::wire::wiring::Wiring;
use heapless::Vec;

laid_out! {
/// Both axes, and what turns the taps of the derivatives into 1/s and 1/s².
pub(super) struct SiMessage {
    axis: [AxisMessage; 2],
    shifts: [i8; 2],
    reserved: [u8; 6],
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
    convention: u8,
    reserved: [u8; 7],
}
}

impl SiMessage {
    pub(super) fn of(rig: &Rig) -> Self {
        let mut axis = [AxisMessage::default(); 2];
        for (place, rig) in axis.iter_mut().zip(&rig.axes) {
            *place = AxisMessage::of(rig);
        }
        Self {
            axis,
            shifts: [rig.velocity.shift, rig.acceleration.shift],
            reserved: [0; 6],
        }
    }

    /// The rig, with its filters from the bytes of the block, of which `chain` and `wiring` are; what it holds is checked by the caller.
    pub(super) fn rig(
        &self,
        sample_rate_hz: f64,
        bytes: &[u8],
        chain: &Chain,
        wiring: &Wiring,
    ) -> Result<Rig, Refusal> {
        let mut seen = Seen::new();
        seen.zeros(SI_OFFSET + 2 * AxisMessage::LEN + 2, &self.reserved);
        let mut axes = Vec::new();
        for (number, axis) in self.axis.iter().enumerate() {
            let offset = SI_OFFSET + number * AxisMessage::LEN;
            if let Some(wired) = wiring.axes.get(number) {
                seen.zeros(offset + AxisMessage::LEN - 7, &axis.reserved);
                // Two at most, as the array that is walked.
                let _ = axes.push(axis.rig_axis(wired.near.is_some(), &mut seen));
            } else {
                let unused = bytes.get(offset..offset + AxisMessage::LEN);
                seen.zeros(offset, unused.unwrap_or_default());
            }
        }
        seen.done()?;
        let [velocity, acceleration] = self.shifts;
        let taps = |filter: usize, shift| {
            let from = TAPS_OFFSET + 4 * MAX_TAPS * filter;
            let places = bytes.get(from..).unwrap_or_default().as_chunks::<4>().0;
            let used = places.iter().take(chain.derivative_taps());
            Taps {
                taps: used.map(|tap| i32::from_le_bytes(*tap)).collect(),
                shift,
            }
        };
        Ok(Rig {
            sample_rate_hz,
            axes,
            velocity: taps(0, velocity),
            acceleration: taps(1, acceleration),
            band: chain.band().clone(),
            // A power of two.
            band_every_log2: chain.band_every().trailing_zeros() as u8,
        })
    }
}

impl AxisMessage {
    fn of(rig: &RigAxis) -> Self {
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
            convention: u8::from(rig.inertia_minus_force),
            reserved: [0; 7],
        }
    }

    fn rig_axis(&self, displacement_difference: bool, seen: &mut Seen) -> RigAxis {
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
        ];
        quantities.into_iter().for_each(|q| seen.signless(q));
        RigAxis {
            displacement_step: self.displacement_step,
            displacement_difference,
            body_step: self.body_step,
            acceleration_step: self.acceleration_step,
            force_step: self.force_step,
            inertia: self.inertia,
            inertia_minus_force: seen.mark("sign convention", self.convention),
            ground_stiffness: self.ground_stiffness,
            ground_damping: self.ground_damping,
            force_cross: self.force_cross,
            force_delay_samples: self.force_delay,
            delays: ChannelDelays {
                displacement: self.displacement_delay,
                body: self.body_delay,
                acceleration: self.acceleration_delay,
            },
            // It lies behind the others.
            hum: Hum::NONE,
        }
    }
}

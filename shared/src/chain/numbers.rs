//! The chain's numbers as a rig block holds them: what the host made of SI values, and what the device checks before it computes.

use super::adaptive_notch::AdaptiveNotch;
use super::axis::{Acceleration, AxisChain};
use super::channel::{Channel, Settling};
use super::term::Terms;
use super::{Chain, slopes};
use crate::chain::filter::put_weights_of_steps;
use crate::chain::scale::Scale;
use crate::fault::{Checks, Error};
use crate::wire::layout::laid_out;
use crate::wire::rig::{MAX_COUNTER_DELAY, TapsFromEitherEnd, check_filters};

laid_out! {
/// A chain but for its filters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Numbers {
    wait: u8,
    before: u8,
    band_every_log2: u8,
    pub(crate) reserved: u8,
    axes: [AxisNumbers; 2],
}
}

laid_out! {
/// One axis; all zero for the second of a one-axis rig.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct AxisNumbers {
    difference: u8,
    has_body: u8,
    /// 0: none, 1: logged, 2: derived.
    acceleration: u8,
    /// Which channels are not in time: 1 the accelerometer, 2 the displacement, 4 the body; what is in time has zeros below.
    late: u8,
    velocity_shift: i8,
    curvature_shift: i8,
    body_velocity_shift: i8,
    position: Scale,
    velocity: Scale,
    terms: Terms,
    force: Channel,
    late_channels: [Channel; 3],
}
}

/// The most samples that a counter waits, or needs before: what it may be late, and the cubic's own.
const MOST_SETTLING: i32 = MAX_COUNTER_DELAY as i32 + 2;

impl Numbers {
    /// Those of a chain.
    pub(crate) fn of(chain: &Chain) -> Self {
        let mut axes = [AxisNumbers::default(); 2];
        for (numbers, axis) in axes.iter_mut().zip(&chain.axes) {
            *numbers = AxisNumbers::of(axis);
        }
        Self {
            // Five at most.
            wait: chain.settling.wait as u8,
            before: chain.settling.before as u8,
            band_every_log2: chain.band.every_log2,
            reserved: 0,
            axes,
        }
    }

    /// Puts them into a chain that is empty, of so many axes and with these filters: both derivatives and the low-pass with its shift.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] names the first number that the arithmetic is not proven for, or that is not written in its one form.
    pub(crate) fn put<T: TapsFromEitherEnd>(
        &self,
        axes: u8,
        filters: [T; 3],
        band_shift: i8,
        chain: &mut Chain,
    ) -> Result<(), Error> {
        let mut checks = Checks::new();
        checks.whole("number of axes", i32::from(axes), 1, 2);
        let of_band = [band_shift, self.band_every_log2.cast_signed()];
        check_filters(filters.clone(), of_band, &mut checks);
        let (wait, before) = (i32::from(self.wait), i32::from(self.before));
        let most = MOST_SETTLING;
        checks.whole("samples that counters wait", wait, 0, most);
        checks.whole("samples before the first output", before, 0, most);
        let [velocity, acceleration, band] = filters;
        put_weights_of_steps(velocity, &mut chain.velocity);
        put_weights_of_steps(acceleration, &mut chain.acceleration);
        for tap in band {
            // No more than it holds, as was checked.
            let _ = chain.band.taps.taps.push(tap);
        }
        chain.band.taps.shift = band_shift;
        chain.band.every_log2 = self.band_every_log2;
        chain.settling = Settling {
            wait: usize::from(self.wait),
            before: usize::from(self.before),
        };
        for (number, axis) in (0..).zip(&self.axes) {
            if number < axes {
                // Two at most, as the array that is walked.
                let _ = chain.axes.push(axis.chain(&mut checks));
            } else {
                let wrong = i32::from(*axis != AxisNumbers::default());
                checks.whole("numbers of an axis that is not there", wrong, 0, 0);
            }
        }
        [chain.damped, chain.derived] = slopes(&chain.axes);
        checks.done()
    }
}

impl AxisNumbers {
    fn of(axis: &AxisChain) -> Self {
        let late = [
            &axis.late_acceleration,
            &axis.late_displacement,
            &axis.late_body,
        ];
        Self {
            difference: u8::from(axis.difference),
            has_body: u8::from(axis.has_body),
            acceleration: axis.acceleration as u8,
            late: (0..)
                .zip(late)
                .map(|(bit, channel)| u8::from(channel.is_some()) << bit)
                .sum(),
            velocity_shift: axis.velocity_shift,
            curvature_shift: axis.curvature_shift,
            body_velocity_shift: axis.body_velocity_shift,
            position: axis.position,
            velocity: axis.velocity,
            terms: axis.terms,
            force: axis.force,
            late_channels: late.map(|channel| channel.unwrap_or_default()),
        }
    }

    fn chain(&self, checks: &mut Checks) -> AxisChain {
        let mark = |checks: &mut Checks, quantity, seen: u8| {
            checks.whole(quantity, i32::from(seen), 0, 1);
            seen == 1
        };
        let [difference, has_body] = [
            mark(
                checks,
                "mark of a displacement of two counters",
                self.difference,
            ),
            mark(checks, "mark of a body's counter", self.has_body),
        ];
        let quantity = "kind of an acceleration";
        checks.whole(quantity, i32::from(self.acceleration), 0, 2);
        let quantity = "marks of channels that are not in time";
        checks.whole(quantity, i32::from(self.late), 0, 7);
        for shift in [
            self.velocity_shift,
            self.curvature_shift,
            self.body_velocity_shift,
        ] {
            checks.whole("shift of a derivative", i32::from(shift), 1, 62);
        }
        self.position.check(checks);
        self.velocity.check(checks);
        self.terms.check(checks);
        self.force.check(checks);
        let mut late = [None; 3];
        for (bit, (place, channel)) in late.iter_mut().zip(&self.late_channels).enumerate() {
            if self.late >> bit & 1 == 1 {
                channel.check(checks);
                *place = Some(*channel);
            } else {
                let wrong = i32::from(*channel != Channel::default());
                checks.whole("weights of a channel that is in time", wrong, 0, 0);
            }
        }
        let [late_acceleration, late_displacement, late_body] = late;
        AxisChain {
            difference,
            has_body,
            position: self.position,
            velocity: self.velocity,
            velocity_shift: self.velocity_shift,
            acceleration: match self.acceleration {
                0 => Acceleration::None,
                1 => Acceleration::Logged,
                _ => Acceleration::Derived,
            },
            curvature_shift: self.curvature_shift,
            body_velocity_shift: self.body_velocity_shift,
            terms: self.terms,
            force: self.force,
            late_acceleration,
            late_displacement,
            late_body,
            notch: AdaptiveNotch::default(),
        }
    }
}

//! Which chip feeds which channel: to count a chip's failures under the channels that a user knows.

use crate::sensor::acquire::{ACCELERATION_CHANNEL, CHIPS, CONVERTER};
use heapless::Vec;
use jointwatch_shared::monitor::limits::CHANNELS;
use jointwatch_shared::wire::wiring::{AxisWiring, Signed, SignedDirection, Wiring};

/// The chip of every channel, where one is wired.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Places {
    /// A place in [`CHIP_NAMES`](crate::sensor::acquire::CHIP_NAMES) per axis and channel.
    pub chips: [[Option<u8>; CHANNELS]; 2],
    /// The other accelerometer of an axis that takes the difference of two.
    pub second: [Option<u8>; 2],
    /// Axes of the rig: 1 or 2.
    pub axes: u8,
}

impl Places {
    /// The chips behind the axes of a wiring.
    pub fn of(wiring: &Wiring) -> Self {
        let mut places = Self {
            axes: wiring.axes.len() as u8,
            ..Self::default()
        };
        let all = places.chips.iter_mut().zip(&mut places.second);
        for ((chips, other), axis) in all.zip(&wiring.axes) {
            let [first, second] = axis
                .acceleration
                .map(|one| one.map(|one| (CONVERTER + 1) as u8 + one.chip));
            *other = second.filter(|_| second != first);
            *chips = [
                Some(axis.far.place),
                axis.near.map(|near| near.place),
                axis.body.map(|body| body.place),
                first,
                Some(CONVERTER as u8),
                axis.input.map(|_| CONVERTER as u8),
            ];
        }
        places
    }

    /// The chips that feed a channel.
    pub fn of_channel(&self, axis: usize, channel: usize) -> [Option<u8>; 2] {
        let chips = self.chips.get(axis).and_then(|chips| chips.get(channel));
        let second = self
            .second
            .get(axis)
            .filter(|_| channel == ACCELERATION_CHANNEL);
        [chips, second].map(|chip| chip.copied().flatten())
    }

    /// The first channel that a chip feeds, numbered as in a status report; `None` when it feeds
    /// none.
    pub fn first_channel(&self, chip: usize) -> Option<u8> {
        let places = (0..2).flat_map(|axis| (0..CHANNELS).map(move |channel| (axis, channel)));
        let mut numbered = places.zip(0..);
        let feeds = |place: Option<u8>| place.is_some_and(|place| usize::from(place) == chip);
        numbered
            .find(|((axis, channel), _)| self.of_channel(*axis, *channel).into_iter().any(feeds))
            .map(|(_, number)| number)
    }

    /// Every channel of the axes there are, as the monitor's faults have them.
    pub fn all_bits(&self) -> u16 {
        let own = (1 << CHANNELS) - 1;
        if self.axes > 1 {
            own << CHANNELS | own
        } else {
            own
        }
    }
}

const _: () = assert!(CHIPS <= u8::MAX as usize);

/// The wiring of a board without a rig block: all chips, in the order of the board. Its counts are
/// raw; nothing is known of their signs or of what they are worth.
///
/// Axis 0 shows counters 0 and 1, the x direction of accelerometer 0 and converter channels 0 and
/// 2; axis 1 counters 2 and 3, the x direction of accelerometer 1 and converter channels 1 and 3: a
/// force and an input each.
pub fn raw_wiring() -> Wiring {
    let plain = |place| Signed {
        place,
        negative: false,
    };
    let axis = |number: u8| AxisWiring {
        far: plain(2 * number),
        near: Some(plain(2 * number + 1)),
        body: None,
        force: plain(number),
        input: Some(plain(number + 2)),
        acceleration: [
            Some(SignedDirection {
                chip: number,
                direction: 0,
                negative: false,
            }),
            None,
        ],
        pair_distance_m: 0.0,
    };
    let mut axes = Vec::new();
    for number in 0..2 {
        // The list holds two.
        let _ = axes.push(axis(number));
    }
    Wiring {
        axes,
        ..Wiring::unconfigured()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_accelerometers_of_a_pair_have_a_channel() {
        let mut wiring = raw_wiring();
        let [first, _] = wiring.axes[1].acceleration;
        wiring.axes[0].acceleration[1] = first;
        wiring.axes.truncate(1);
        let places = Places::of(&wiring);
        let chips = [1, 2].map(|number| CONVERTER + number);
        for chip in chips {
            assert_eq!(places.first_channel(chip), Some(ACCELERATION_CHANNEL as u8));
        }
        let fed_by = chips.map(|chip| Some(chip as u8));
        assert_eq!(places.of_channel(0, ACCELERATION_CHANNEL), fed_by);
        assert_eq!(places.of_channel(0, 0), [Some(0), None]);
        assert_eq!(places.first_channel(3), None);
    }
}

//! Which chip feeds which channel: to count a chip's failures under the channels that a user knows.

use crate::sensor::acquire::{CHIPS, CONVERTER};
use heapless::Vec;
use jointwatch_shared::monitor::limits::CHANNELS;
use jointwatch_shared::wire::wiring::{AxisWiring, Signed, SignedDirection, Wiring};

/// The chip of every channel, where one is wired.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Places {
    /// A place in [`CHIP_NAMES`](crate::sensor::acquire::CHIP_NAMES) per axis and channel.
    pub chips: [[Option<u8>; CHANNELS]; 2],
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
        for (chips, axis) in places.chips.iter_mut().zip(&wiring.axes) {
            let [first, _] = axis.acceleration;
            *chips = [
                Some(axis.far.place),
                axis.near.map(|near| near.place),
                axis.body.map(|body| body.place),
                first.map(|one| (CONVERTER + 1) as u8 + one.chip),
                Some(CONVERTER as u8),
                axis.input.map(|_| CONVERTER as u8),
            ];
        }
        places
    }

    /// The first channel that a chip feeds, numbered as in a status report; `None` when it feeds none.
    pub fn first_channel(&self, chip: usize) -> Option<u8> {
        let all = self.chips.as_flattened().iter();
        let mut numbered = all.zip(0..);
        numbered
            .find(|(place, _)| place.is_some_and(|place| usize::from(place) == chip))
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

/// The wiring of a board without a rig block: all chips, in the order of the board. Its counts are raw; nothing is known of
/// their signs or of what they are worth.
///
/// Axis 0 shows counters 0 and 1, the x direction of accelerometer 0 and converter channels 0 and 2; axis 1 counters 2 and 3, the x
/// direction of accelerometer 1 and converter channels 1 and 3: a force and an input each.
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

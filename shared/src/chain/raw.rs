//! What the sensors gave at one instant, before anything is made of it.

use crate::monitor::limits::CHANNELS;

/// What the sensors of one axis gave at one instant, laid out as in C, so that the C library hands
/// it on where it lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct RawAxis {
    /// Encoder counters: far side and near side; the second is 0 on a rig that measures the
    /// difference itself.
    pub displacement: [i32; 2],
    /// Encoder counter of the body that carries the inertia, where the rig has one; may be the
    /// near side's.
    pub body: i32,
    /// Accelerometer code, where the rig has one.
    pub acceleration: i32,
    /// Force or torque code.
    pub force: i32,
    /// Converter code of the input that effects of the axis follow, where the rig has one.
    pub input: i32,
}

impl RawAxis {
    /// Counts in the order of the fields: displacement far and near, body, acceleration, force,
    /// input.
    #[inline]
    pub fn counts(&self) -> [i32; CHANNELS] {
        let [far, near] = self.displacement;
        [
            far,
            near,
            self.body,
            self.acceleration,
            self.force,
            self.input,
        ]
    }

    /// Of counts in that order.
    #[inline]
    pub fn of_counts([far, near, body, acceleration, force, input]: [i32; CHANNELS]) -> Self {
        Self {
            displacement: [far, near],
            body,
            acceleration,
            force,
            input,
        }
    }
}

/// One instant, both axes; a one-axis rig leaves the second at its default.
pub type RawSample = [RawAxis; 2];

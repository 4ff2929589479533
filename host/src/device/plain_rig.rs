//! The rig that a study alone describes: what its sensors would count, wired in a plain order.

use super::followed::Followed;
use super::monitor_limits::rate;
use crate::signal::motion::Filters;
use crate::study::{AxisKind, Channels, Convention, Study};
use crate::text::error::{Error, Result};
use jointwatch_shared::base::Model;
use jointwatch_shared::base::hum::Hum;
use jointwatch_shared::wire::blob;
use jointwatch_shared::wire::rig::{ChannelDelays, Rig, RigAxis};
use jointwatch_shared::wire::wiring::{
    ACCELEROMETERS, Accelerometer, AxisWiring, CHANNELS, COUNTERS, Converter, Counter, Signed,
    SignedDirection, Wiring,
};

/// Full scale of a 24-bit converter, as the force and acceleration channels of the device have it.
const CONVERTER_FULL_SCALE: f64 = (1 << 23) as f64;
/// A converter's range is set this much wider than what the study's records reach.
const CONVERTER_HEADROOM: f64 = 1.25;
/// Distance between the accelerometers of a pair, m, on a rig that is known from its study only.
const PAIR_DISTANCE_M: f64 = 0.1;
/// Where a study states no encoder step, the displacement's range is cut into this many counts.
const COUNTS_WITHOUT_ENCODER: f64 = (1 << 22) as f64;

/// The rig that a study describes, as the device would be configured for it if every force channel
/// were right; [`super::replay::corrected`] is the rig as it is. Its chips are wired in a plain
/// order, and there may be more counters than a board has.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when the study does not fit the model.
pub(crate) fn rig(study: &Study, model: &Model, filters: &Filters) -> Result<Rig> {
    let followed = Followed::of(model);
    followed.check(study)?;
    let wiring = plain_wiring(study, &followed);
    let mut axes = heapless::Vec::new();
    for (index, (axis, wired)) in study.axes.iter().zip(&wiring.axes).enumerate() {
        let channels = || study.records.iter().map(|record| &record.axes[index]);
        let step = axis.encoder_step.unwrap_or_else(|| {
            let largest = largest(
                channels()
                    .flat_map(|c| [Some(&c.displacement_first), c.displacement_second.as_ref()]),
            );
            largest * CONVERTER_HEADROOM / COUNTS_WITHOUT_ENCODER
        });
        let code = |largest: f64| largest * CONVERTER_HEADROOM / CONVERTER_FULL_SCALE;
        let rig_axis = RigAxis {
            displacement_step: step,
            body_step: if wired.body.is_some() { step } else { 0.0 },
            acceleration_step: if wired.acceleration[0].is_some() {
                code(largest(channels().map(|c| c.acceleration.as_ref())))
            } else {
                0.0
            },
            force_step: code(largest(channels().map(|c| Some(&c.force)))),
            input_step: match followed.name(index) {
                Some(input) => code(largest(study.records.iter().map(|r| r.input(input)))),
                None => 0.0,
            },
            input_zero: 0.0,
            inertia: model.header().axes[index].inertia,
            inertia_minus_force: axis.restoring_force == Convention::InertiaMinusForce,
            ground_stiffness: axis.ground_stiffness,
            ground_damping: axis.ground_damping,
            force_cross: 0.0,
            force_delay_samples: 0.0,
            delays: ChannelDelays::default(),
            hum: Hum::NONE,
        };
        axes.push(rig_axis)
            .map_err(|_| Error::data("a study has at most two axes".to_string()))?;
    }
    let (velocity, acceleration, band) = filters.taps()?;
    Ok(Rig {
        model_checksum: blob::checksum_of(model),
        sample_rate_hz: study.sample_rate_hz,
        wiring,
        axes,
        velocity,
        acceleration,
        band,
        band_every_log2: rate::band_every_log2(filters),
        limits: None,
    })
}

/// Counters in the order of the axes, one converter channel each for the force and one for what
/// effects follow, a pair of accelerometers on rotations.
fn plain_wiring(study: &Study, followed: &Followed) -> Wiring {
    let mut wiring = Wiring {
        counters: [None; COUNTERS],
        accelerometers: [None; ACCELEROMETERS],
        converter: Converter {
            gain_log2: [0; CHANNELS],
            oversampling: 3,
        },
        axes: heapless::Vec::new(),
    };
    let mut free = 0..;
    for (index, axis) in study.axes.iter().enumerate() {
        let channels = || study.records.iter().map(|record| &record.axes[index]);
        let mut counter = || {
            let place = free.next().unwrap_or(u8::MAX);
            if let Some(chip) = wiring.counters.get_mut(usize::from(place)) {
                *chip = Some(Counter {
                    quadrature: 4,
                    start: 0,
                    index: false,
                });
            }
            Signed {
                place,
                negative: false,
            }
        };
        let far = counter();
        let is_difference = channels().all(|c| c.displacement_second.is_some());
        let near = is_difference.then(&mut counter);
        let has_body = channels().all(|c| c.body_position.is_some());
        let is_near = |c: &Channels| c.body_position == c.displacement_second;
        let body = match near {
            _ if !has_body => None,
            Some(near) if channels().all(is_near) => Some(near),
            _ => Some(counter()),
        };
        let measured = channels().all(|c| c.acceleration.is_some());
        let turns = measured && axis.kind == AxisKind::Rotation;
        let direction = |chip: u8, negative: bool| SignedDirection {
            chip,
            // A translation takes x or y by its number, a rotation z.
            direction: if turns { 2 } else { index as u8 },
            negative,
        };
        let acceleration = match (measured, turns) {
            (false, _) => [None; 2],
            (true, false) => [Some(direction(0, false)), None],
            (true, true) => [Some(direction(1, false)), Some(direction(0, true))],
        };
        for one in acceleration.iter().flatten() {
            wiring.accelerometers[usize::from(one.chip)] = Some(Accelerometer {
                range: 1,
                filter: 0,
                external_sync: false,
            });
        }
        let wired = AxisWiring {
            far,
            near,
            body,
            force: Signed {
                place: index as u8,
                negative: false,
            },
            input: followed.name(index).map(|_| Signed {
                place: 2 + index as u8,
                negative: false,
            }),
            acceleration,
            pair_distance_m: if turns { PAIR_DISTANCE_M } else { 0.0 },
        };
        // A study has at most two axes.
        let _ = wiring.axes.push(wired);
    }
    wiring
}

fn largest<'a>(series: impl Iterator<Item = Option<&'a Vec<f64>>>) -> f64 {
    series
        .flatten()
        .flatten()
        .fold(0.0, |most: f64, value| most.max(value.abs()))
}

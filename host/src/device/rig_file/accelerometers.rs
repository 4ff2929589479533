//! The accelerometers of a rig, and which of their directions an axis's acceleration is made of.

use super::keys::{AxisEntry, WiringEntry, positive};
use crate::study::AxisKind;
use crate::study::description::Source;
use crate::text::error::Result;
use jointwatch_shared::wire::wiring::{ACCELEROMETERS, Accelerometer, SignedDirection, Wiring};
use toml::Spanned;

pub(super) fn accelerometers(
    source: &Source<'_>,
    wiring: &WiringEntry,
) -> Result<[Option<Accelerometer>; ACCELEROMETERS]> {
    if wiring.accelerometers.len() > ACCELEROMETERS {
        let what = format!(
            "{} accelerometers, but the board has {ACCELEROMETERS}; leave some out",
            wiring.accelerometers.len()
        );
        return Err(source.wrong(&wiring.accelerometers[ACCELEROMETERS].range_g, what));
    }
    let mut chips = [None; ACCELEROMETERS];
    for (place, entry) in chips.iter_mut().zip(&wiring.accelerometers) {
        let range = match entry.range_g.get_ref() {
            2 => 1,
            4 => 2,
            8 => 3,
            other => {
                let what = format!(
                    "range_g = {other} is not a range of the accelerometer; choose from 2, 4, 8"
                );
                return Err(source.wrong(&entry.range_g, what));
            }
        };
        // 1000 Hz at 4000 samples/s, halved ten times at most.
        let filter = (0..=10_u8).find(|step| {
            let corner = 1000.0 / f64::from(1 << step);
            (entry.corner_hz.get_ref() / corner - 1.0).abs() < 0.01
        });
        let filter = filter.ok_or_else(|| {
            let what = format!(
                "corner_hz = {} is not 1000, 500, 250, 125, … Hz; 1000 delays least",
                entry.corner_hz.get_ref()
            );
            source.wrong(&entry.corner_hz, what)
        })?;
        *place = entry.fitted.then_some(Accelerometer {
            range,
            filter,
            external_sync: entry.external_sync,
        });
    }
    Ok(chips)
}

/// "+0x": a sign, an accelerometer and its direction.
fn direction<T>(source: &Source<'_>, place: &Spanned<T>, text: &str) -> Result<SignedDirection> {
    let wrong = || {
        let what = format!(
            "{text:?} is no direction of an accelerometer; write a sign, 0 or 1, and x, y or z, as \"+0x\" or \"-1z\""
        );
        source.wrong(place, what)
    };
    let [sign, chip, direction] = text.as_bytes() else {
        return Err(wrong());
    };
    let chip = chip.wrapping_sub(b'0');
    let direction = direction.wrapping_sub(b'x');
    if !matches!(sign, b'+' | b'-') || usize::from(chip) >= ACCELEROMETERS || direction > 2 {
        return Err(wrong());
    }
    Ok(SignedDirection {
        chip,
        direction,
        negative: *sign == b'-',
    })
}

/// Whether two accelerometers measure a rotation: with opposite signs.
pub(super) fn turns(acceleration: &[Option<SignedDirection>; 2]) -> bool {
    matches!(acceleration, [Some(a), Some(b)] if a.negative != b.negative)
}

/// The directions that an axis's acceleration is made of.
pub(super) fn directions(
    source: &Source<'_>,
    stated: &Spanned<Vec<String>>,
    kind: AxisKind,
    wiring: &Wiring,
) -> Result<[Option<SignedDirection>; 2]> {
    let list = stated.get_ref();
    if list.is_empty() || list.len() > 2 {
        let what = "acceleration takes one direction of an accelerometer, or a pair; leave it out to derive it from the position";
        return Err(source.wrong(stated, what));
    }
    let mut acceleration = [None; 2];
    for (place, text) in acceleration.iter_mut().zip(list) {
        let one = direction(source, stated, text)?;
        if wiring.accelerometers[usize::from(one.chip)].is_none() {
            let what = format!(
                "accelerometer {} is not fitted; add it to accelerometers in [wiring]",
                one.chip
            );
            return Err(source.wrong(stated, what));
        }
        *place = Some(one);
    }
    if turns(&acceleration) != (kind == AxisKind::Rotation) {
        let what = match kind {
            AxisKind::Rotation => {
                "an angular acceleration takes two directions with opposite signs, as [\"+1z\", \"-0z\"]"
            }
            AxisKind::Translation => {
                "two accelerometers with opposite signs measure a rotation; give both the same sign for their mean"
            }
        };
        return Err(source.wrong(stated, what));
    }
    if let [Some(a), Some(b)] = acceleration {
        let range =
            |d: SignedDirection| wiring.accelerometers[usize::from(d.chip)].map(|chip| chip.range);
        if a.chip == b.chip || range(a) != range(b) {
            let what = "a pair takes two accelerometers with the same range_g";
            return Err(source.wrong(stated, what));
        }
    }
    Ok(acceleration)
}

/// The distance of a pair of accelerometers in m; 0 where there is none.
pub(super) fn pair_distance(source: &Source<'_>, entry: &AxisEntry, turning: bool) -> Result<f64> {
    match (&entry.pair_distance_m, turning) {
        (Some(distance), true) => positive(source, "pair_distance_m", distance),
        (None, false) => Ok(0.0),
        (Some(distance), false) => Err(source.wrong(
            distance,
            "pair_distance_m goes with a pair of accelerometers on a rotation; leave it out",
        )),
        (None, true) => Err(source.wrong(
            &entry.name,
            "pair_distance_m is missing; state the distance between the pair of accelerometers",
        )),
    }
}

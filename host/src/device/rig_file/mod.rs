//! `rig.toml`: how the sensors of a rig are wired and what their counts are worth, in people's
//! units.

mod accelerometers;
mod keys;

use crate::study::AxisKind;
use crate::study::description::Source;
use crate::text::error::{Error, Result};
use crate::text::nearest::suggestion;
use accelerometers::{accelerometers, directions, pair_distance, turns};
use jointwatch_shared::base::Model;
use jointwatch_shared::base::axis::Convention;
use jointwatch_shared::base::hum::Hum;
use jointwatch_shared::wire::rig::{ChannelDelays, RigAxis};
use jointwatch_shared::wire::wiring::{
    AxisWiring, CHANNELS, COUNTERS, Converter, Counter, Signed, Wiring,
};
pub(crate) use keys::RigFile;
use keys::{AxisEntry, InputEntry, WiringEntry, bounded, positive};
use std::f64::consts::TAU;
use toml::Spanned;

/// Standard gravity, m/s² (CGPM 1901).
const GRAVITY: f64 = 9.806_65;
/// ADXL355, sensitivity at ±2.048 g, counts per g; each wider range halves it (data sheet, table
/// "Specifications").
const COUNTS_PER_G: f64 = 256_000.0;
/// ADS131M04, reference voltage: full scale is ± this over the gain (SBAS890, "Electrical
/// Characteristics").
const REFERENCE_V: f64 = 1.2;
/// Codes from 0 to full scale of its 24 bits.
const CONVERTER_FULL_SCALE: f64 = (1 << 23) as f64;

/// What the file says, in the order of the model's axes.
pub(crate) struct Described {
    pub(crate) axes: Vec<RigAxis>,
    pub(crate) wiring: Wiring,
}

/// The file's content for a model's axes.
pub(crate) fn described(source: &Source<'_>, file: &RigFile, model: &Model) -> Result<Described> {
    let header = model.header();
    let names: Vec<&str> = header.axes.iter().map(|axis| axis.name.as_str()).collect();
    check_names(source, file, &names)?;
    let mut wiring = Wiring {
        counters: counters(source, &file.wiring)?,
        converter: Converter {
            gain_log2: [0; CHANNELS],
            oversampling: oversampling(source, &file.wiring.oversampling)?,
        },
        accelerometers: accelerometers(source, &file.wiring)?,
        axes: heapless::Vec::new(),
    };
    let mut axes = Vec::new();
    let mut channels = Channels::default();
    for learnt in &header.axes {
        let name = learnt.name.as_str();
        let Some(entry) = file.axis.iter().find(|entry| entry.name.get_ref() == name) else {
            return Err(Error::data(format!(
                "{}: the model's axis {name:?} is not described; add an [[axis]] with that name",
                source.path.display()
            )));
        };
        let kind = AxisKind::from(learnt.kind);
        let wired = axis_wiring(source, entry, kind, &wiring)?;
        channels.take(source, &entry.bridge, wired.force, &entry.gain, false)?;
        if let (Some(stated), Some(input)) = (&entry.input, wired.input) {
            channels.take(source, &stated.channel, input, &stated.gain, true)?;
        }
        if let (None, Some(needed)) = (&entry.input, &learnt.input) {
            let what = format!(
                "the model follows the input {:?}; state its channel as input = {{ channel = \"+2\", gain = 1, per_V = 1.0 }}",
                needed.name.as_str()
            );
            return Err(source.wrong(&entry.name, what));
        }
        let minus = learnt.convention == Convention::InertiaMinusForce;
        axes.push(rig_axis(
            source,
            entry,
            kind,
            &wired,
            &wiring,
            (learnt.inertia, minus),
            header.sample_rate_hz,
        )?);
        let place = |signed: Signed| signed.place;
        let counters = |w: &AxisWiring| (w.far.place, w.near.map(place));
        if wiring
            .axes
            .iter()
            .any(|other| counters(other) == counters(&wired))
        {
            return Err(source.wrong(
                &entry.far,
                "the other axis reads the same counters, so that both would move alike; name those of this axis",
            ));
        }
        // A model has at most two axes.
        let _ = wiring.axes.push(wired);
    }
    wiring.converter.gain_log2 = channels.gain_log2;
    Ok(Described { axes, wiring })
}

/// Refuses an axis that the model has not, and one that is there twice.
fn check_names(source: &Source<'_>, file: &RigFile, names: &[&str]) -> Result<()> {
    for (at, entry) in file.axis.iter().enumerate() {
        let name = entry.name.get_ref().as_str();
        if !names.contains(&name) {
            let what = format!(
                "the model has no axis {name:?}; {}",
                suggestion(name, names)
            );
            return Err(source.wrong(&entry.name, what));
        }
        if file
            .axis
            .iter()
            .take(at)
            .any(|other| other.name.get_ref() == name)
        {
            return Err(source.wrong(
                &entry.name,
                format!("the axis {name:?} is there twice; keep one"),
            ));
        }
    }
    Ok(())
}

/// The converter's channels that are given away, and their gains.
#[derive(Default)]
struct Channels {
    gain_log2: [u8; CHANNELS],
    /// Whether the channel is that of an input.
    taken: [Option<bool>; CHANNELS],
}

impl Channels {
    /// Gives a channel to a bridge or an input; two axes may follow one input.
    fn take(
        &mut self,
        source: &Source<'_>,
        stated: &Spanned<String>,
        channel: Signed,
        gain: &Spanned<u32>,
        is_input: bool,
    ) -> Result<()> {
        let place = usize::from(channel.place);
        let gain_log2 = gain_log2(source, gain)?;
        match self.taken[place] {
            Some(before) if !(before && is_input) => {
                let what =
                    format!("converter channel {place} is given away already; name another one");
                return Err(source.wrong(stated, what));
            }
            Some(_) if self.gain_log2[place] != gain_log2 => {
                let what = format!(
                    "converter channel {place} has another gain on the other axis; give both the same"
                );
                return Err(source.wrong(gain, what));
            }
            _ => {}
        }
        self.taken[place] = Some(is_input);
        self.gain_log2[place] = gain_log2;
        Ok(())
    }
}

/// The binary logarithm of a gain that the converter has.
fn gain_log2(source: &Source<'_>, stated: &Spanned<u32>) -> Result<u8> {
    let gain = *stated.get_ref();
    if gain.is_power_of_two() && gain <= 128 {
        return Ok(gain.trailing_zeros() as u8);
    }
    let what = format!("gain = {gain} is not 1, 2, 4, 8, 16, 32, 64 or 128; choose one of these");
    Err(source.wrong(stated, what))
}

fn counters(source: &Source<'_>, wiring: &WiringEntry) -> Result<[Option<Counter>; COUNTERS]> {
    let entries = wiring.counters.get_ref();
    if entries.len() > COUNTERS {
        let what = format!(
            "{} counters, but the board has {COUNTERS}; leave some out",
            entries.len()
        );
        return Err(source.wrong(&wiring.counters, what));
    }
    let mut counters = [None; COUNTERS];
    for (place, entry) in counters.iter_mut().zip(entries) {
        let quadrature = entry.quadrature.as_ref().map_or(4, |q| *q.get_ref());
        if let (Some(stated), false) = (&entry.quadrature, [1, 2, 4].contains(&quadrature)) {
            let what = format!(
                "quadrature = {quadrature} is not 1, 2 or 4 counts per cycle of the encoder; 4 is usual"
            );
            return Err(source.wrong(stated, what));
        }
        *place = entry.fitted.then_some(Counter {
            quadrature,
            start: entry.start,
            index: entry.index,
        });
    }
    Ok(counters)
}

fn oversampling(source: &Source<'_>, stated: &Spanned<u32>) -> Result<u8> {
    (0..8_u8)
        .find(|step| 128 << step == *stated.get_ref())
        .ok_or_else(|| {
            let what = format!(
                "oversampling = {} is not 128, 256, 512, … 16384; 1024 gives 4000 samples/s",
                stated.get_ref()
            );
            source.wrong(stated, what)
        })
}

/// "+0" or "-3": a sign and a number below `most`.
fn signed(
    source: &Source<'_>,
    stated: &Spanned<String>,
    what: &str,
    most: usize,
) -> Result<Signed> {
    let text = stated.get_ref();
    let split = text.strip_prefix('+').map(|rest| (false, rest));
    let split = split.or_else(|| text.strip_prefix('-').map(|rest| (true, rest)));
    let place = split.and_then(|(negative, rest)| Some((negative, rest.parse::<u8>().ok()?)));
    match place {
        Some((negative, place)) if usize::from(place) < most => Ok(Signed { place, negative }),
        _ => Err(source.wrong(
            stated,
            format!("{text:?} is no {what}; write a sign and a number from 0 to {}, as \"+0\" or \"-1\"", most - 1),
        )),
    }
}

fn axis_wiring(
    source: &Source<'_>,
    entry: &AxisEntry,
    kind: AxisKind,
    wiring: &Wiring,
) -> Result<AxisWiring> {
    let counter = |stated: &Spanned<String>| {
        let signed = signed(source, stated, "counter", COUNTERS)?;
        if wiring.counters[usize::from(signed.place)].is_none() {
            let what = format!(
                "counter {} is not fitted; add it to counters in [wiring]",
                signed.place
            );
            return Err(source.wrong(stated, what));
        }
        Ok(signed)
    };
    let far = counter(&entry.far)?;
    let near = entry.near.as_ref().map(counter).transpose()?;
    if let (Some(stated), Some(near)) = (&entry.near, near)
        && near.place == far.place
    {
        return Err(source.wrong(
            stated,
            "far and near are the same counter; name the other side's",
        ));
    }
    let acceleration = match &entry.acceleration {
        Some(stated) => directions(source, stated, kind, wiring)?,
        None => [None; 2],
    };
    let pair_distance_m = pair_distance(source, entry, turns(&acceleration))?;
    let input = entry.input.as_ref();
    let channel =
        |input: &InputEntry| signed(source, &input.channel, "converter channel", CHANNELS);
    Ok(AxisWiring {
        input: input.map(channel).transpose()?,
        far,
        near,
        body: entry.body.as_ref().map(counter).transpose()?,
        force: signed(source, &entry.bridge, "bridge channel", CHANNELS)?,
        acceleration,
        pair_distance_m,
    })
}

/// Metres or radians per count.
fn displacement_step(source: &Source<'_>, entry: &AxisEntry, kind: AxisKind) -> Result<f64> {
    match (kind, &entry.counts_per_m, &entry.counts_per_rev) {
        (AxisKind::Translation, Some(counts), None) => Ok(1.0 / positive(source, "counts_per_m", counts)?),
        (AxisKind::Rotation, None, Some(counts)) => Ok(TAU / positive(source, "counts_per_rev", counts)?),
        (AxisKind::Translation, ..) => Err(source.wrong(
            &entry.name,
            "a translation takes counts_per_m, and no counts_per_rev; state how many counts a metre has",
        )),
        (AxisKind::Rotation, ..) => Err(source.wrong(
            &entry.name,
            "a rotation takes counts_per_rev, and no counts_per_m; state how many counts a revolution has",
        )),
    }
}

/// What a count of an input is worth, and what it is at count 0; a falling one has its sign in the
/// channel.
fn input_scale(source: &Source<'_>, input: &InputEntry, volts_per_code: f64) -> Result<(f64, f64)> {
    let per_v = positive(source, "per_V", &input.per_v)?;
    if !input.at_0_v.is_finite() {
        return Err(source.wrong(&input.per_v, "at_0_V is not finite; put the number right"));
    }
    Ok((volts_per_code * per_v, input.at_0_v))
}

fn rig_axis(
    source: &Source<'_>,
    entry: &AxisEntry,
    kind: AxisKind,
    wired: &AxisWiring,
    wiring: &Wiring,
    (inertia, inertia_minus_force): (f64, bool),
    sample_rate_hz: f64,
) -> Result<RigAxis> {
    let step = displacement_step(source, entry, kind)?;
    let acceleration_step = match wired.acceleration {
        [Some(first), second] => {
            let chip = wiring.accelerometers[usize::from(first.chip)];
            let range = chip.map_or(1, |chip| chip.range);
            let one = GRAVITY / COUNTS_PER_G * f64::from(1 << (range - 1));
            match (kind, second) {
                (AxisKind::Rotation, _) => one / wired.pair_distance_m,
                (AxisKind::Translation, Some(_)) => 0.5 * one,
                (AxisKind::Translation, None) => one,
            }
        }
        _ => 0.0,
    };
    let volts_per_code =
        |gain: &Spanned<u32>| REFERENCE_V / f64::from(*gain.get_ref()) / CONVERTER_FULL_SCALE;
    let (input_step, input_zero) = match &entry.input {
        Some(input) => input_scale(source, input, volts_per_code(&input.gain))?,
        None => (0.0, 0.0),
    };
    let excitation = positive(source, "excitation_V", &entry.excitation_v)?;
    let sensitivity = positive(source, "sensitivity", &entry.sensitivity)?;
    let known = |key: &str, stated: &Option<Spanned<f64>>| match stated {
        Some(stated) => bounded(source, key, stated, 0.0, "must not be below 0"),
        None => Ok(0.0),
    };
    let samples = |microseconds: f64| microseconds * 1e-6 * sample_rate_hz;
    Ok(RigAxis {
        displacement_step: step,
        body_step: if wired.body.is_some() { step } else { 0.0 },
        acceleration_step,
        force_step: volts_per_code(&entry.gain) / excitation * sensitivity,
        input_step,
        input_zero,
        inertia,
        inertia_minus_force,
        ground_stiffness: known("ground_stiffness", &entry.ground_stiffness)?,
        ground_damping: known("ground_damping", &entry.ground_damping)?,
        force_cross: 0.0,
        force_delay_samples: samples(entry.skew_us.force),
        delays: ChannelDelays {
            displacement: samples(entry.skew_us.displacement),
            body: samples(entry.skew_us.body),
            acceleration: samples(entry.skew_us.acceleration),
            input: match &entry.input {
                Some(_) => samples(entry.skew_us.input.unwrap_or(entry.skew_us.force)),
                None => 0.0,
            },
        },
        hum: Hum::NONE,
    })
}

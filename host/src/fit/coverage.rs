//! Whether the training records can support a model: which motions they hold, how fast, and how
//! many rows.
//!
//! The paper's Section 6: a model learnt only from the record in which both axes move fails on the
//! others, and no model is to be trusted outside the range and the spectrum it was learnt from.

use crate::signal::motion::Motion;
use crate::study::Axis;
use crate::study::series::extent;
use crate::study::series::{about_mean, mean, peak, rms};
use crate::text::table::rounded;

/// An axis counts as excited in a record from this share of its largest RMS velocity over all
/// records on.
const EXCITED: f64 = 0.1;

/// A record whose velocity range is below this share of another's is worth a word.
const SMALL: f64 = 0.4;

/// A validation record may leave the training range by this share before it is worth a word.
const BEYOND: f64 = 1.1;

/// Fewer rows than this per parameter are worth a word: rows of a record are far from independent.
const ROWS_PER_PARAMETER: usize = 20;

/// How much the distance from the middle of the motion varies, beside its mean, where an axis goes
/// round one loop: displacement and velocity in units of their RMS. Sines of one amplitude and
/// frequency come to 0.03, one trajectory that is repeated to 0.17, random motion to 0.5.
const ONE_LOOP: f64 = 0.1;

/// Part of its way that an axis goes in one direction, from which on the way back is no motion to
/// learn from.
const ONE_WAY: f64 = 0.99;

/// An axis's velocity, m/s or rad/s.
fn velocity(motion: &Motion, axis: usize) -> &[f64] {
    &motion.states[2 * axis + 1]
}

/// An axis's displacement, m or rad.
fn displacement(motion: &Motion, axis: usize) -> &[f64] {
    &motion.states[2 * axis]
}

/// A list such as "0.12, 0 and 1".
fn shares(values: impl Iterator<Item = f64>) -> String {
    let texts: Vec<String> = values.map(|v| format!("{v:.2}")).collect();
    match texts.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} and {last}", rest.join(", ")),
        None => String::new(),
    }
}

/// What is missing in the training records, one sentence each; records are numbered from 1 as in
/// study.toml.
pub fn training_warnings(axes: &[Axis], training: &[&Motion], parameters: usize) -> Vec<String> {
    let mut warnings = Vec::new();
    let most: Vec<f64> = (0..axes.len())
        .map(|axis| {
            training
                .iter()
                .map(|m| rms(velocity(m, axis)))
                .fold(0.0, f64::max)
        })
        .collect();
    let share = |motion: &Motion, axis: usize| {
        if most[axis] > 0.0 {
            rms(velocity(motion, axis)) / most[axis]
        } else {
            0.0
        }
    };
    for (i, axis) in axes.iter().enumerate() {
        if most[i] == 0.0 {
            warnings.push(format!(
                "axis {} rests in every training record: the model knows nothing about it",
                axis.name
            ));
        }
    }
    if axes.len() == 2 {
        let kinds: Vec<[bool; 2]> = training
            .iter()
            .map(|m| [share(m, 0) >= EXCITED, share(m, 1) >= EXCITED])
            .collect();
        let listed = |axis: usize| {
            format!(
                "{}: {}",
                axes[axis].name,
                shares(training.iter().map(|m| share(m, axis)))
            )
        };
        for (i, axis) in axes.iter().enumerate() {
            let alone = if i == 0 { [true, false] } else { [false, true] };
            if most[i] > 0.0 && !kinds.contains(&alone) {
                warnings.push(format!(
                    "no training record moves axis {} alone, so its own force cannot be told from the coupling (RMS velocity per record as a share of the largest, {}; {})",
                    axis.name, listed(0), listed(1)
                ));
            }
        }
        if most.iter().all(|m| *m > 0.0) && !kinds.contains(&[true, true]) {
            warnings.push(format!(
                "no training record moves both axes together, so their coupling cannot be learnt (RMS velocity per record as a share of the largest, {}; {})",
                listed(0), listed(1)
            ));
        }
    }
    for (i, axis) in axes.iter().enumerate() {
        let Some(fastest) = training
            .iter()
            .max_by(|a, b| peak(velocity(a, i)).total_cmp(&peak(velocity(b, i))))
        else {
            continue;
        };
        for motion in training.iter().filter(|m| share(m, i) >= EXCITED) {
            if peak(velocity(motion, i)) < SMALL * peak(velocity(fastest, i)) {
                warnings.push(format!(
                    "the velocity of axis {} reaches {} in record {} but {} in record {} ({}/s): one of them covers little of the range",
                    axis.name, rounded(peak(velocity(motion, i))), motion.record + 1, rounded(peak(velocity(fastest, i))), fastest.record + 1, unit(axis)
                ));
            }
        }
    }
    warnings.extend(confounded(axes, training));
    let rows: usize = training.iter().map(|m| m.rows()).sum();
    if rows < ROWS_PER_PARAMETER * parameters {
        warnings.push(format!(
            "{rows} training rows are few for {parameters} parameters per axis: record longer, or lower the orders with --order"
        ));
    }
    warnings
}

/// A sentence for every axis whose motion in the training records lets one law pass for another.
pub fn confounded(axes: &[Axis], training: &[&Motion]) -> Vec<String> {
    [one_loop(axes, training), one_way(axes, training)].concat()
}

/// A sentence for every axis that goes one way in all training records.
fn one_way(axes: &[Axis], training: &[&Motion]) -> Vec<String> {
    let goes_one_way = |axis: usize| {
        let all = training.iter().flat_map(|m| velocity(m, axis));
        let [forward, back] = all.fold([0.0_f64; 2], |[forward, back], v| {
            [forward + v.max(0.0), back - v.min(0.0)]
        });
        forward.max(back) > ONE_WAY * (forward + back)
    };
    let axes = axes.iter().enumerate().filter(|(i, _)| goes_one_way(*i));
    axes.map(|(index, axis)| {
        let all = training.iter().flat_map(|m| velocity(m, index));
        let all: Vec<f64> = all.copied().collect();
        let zero = match axis.velocity_alone {
            false => String::new(),
            true => format!(
                "; the mean of its velocity is {} {}/s: where that is the zero of the sensor, give the channel an offset",
                rounded(mean(&all)),
                unit(axis)
            ),
        };
        format!(
            "axis {} goes one way in all training records: there dry friction passes for a constant force, and a force that remembers for a \
             spring that bends; let a record of the other way train{zero}",
            axis.name
        )
    })
    .collect()
}

/// A sentence for every axis that goes round one and the same loop in all training records.
fn one_loop(axes: &[Axis], training: &[&Motion]) -> Vec<String> {
    let goes_round = |axis: usize| {
        let gathered = |of: fn(&Motion, usize) -> &[f64]| -> Vec<f64> {
            let all: Vec<f64> = training.iter().flat_map(|m| of(m, axis)).copied().collect();
            about_mean(&all)
        };
        let (x, v) = (gathered(displacement), gathered(velocity));
        let units = [rms(&x), rms(&v)];
        let pairs = x.iter().zip(&v);
        let radius: Vec<f64> = pairs
            .map(|(x, v)| (x / units[0]).hypot(v / units[1]))
            .collect();
        rms(&about_mean(&radius)) < ONE_LOOP * mean(&radius)
    };
    let axes = axes.iter().enumerate().filter(|(i, _)| goes_round(*i));
    axes.map(|(_, axis)| {
        format!(
            "axis {} goes round one loop in all training records, with one amplitude and one frequency: displacement, velocity and what came \
             before stand in for each other there, so that a law of one of them can pass for another; shake it with several of both",
            axis.name
        )
    })
    .collect()
}

/// Where validation records, each with its file, leave what was trained on, one sentence each.
pub fn validation_warnings(
    axes: &[Axis],
    training: &[&Motion],
    validation: &[(&str, &Motion)],
) -> Vec<String> {
    let mut warnings = Vec::new();
    for (i, axis) in axes.iter().enumerate() {
        let [low, high] = extent(training.iter().flat_map(|m| displacement(m, i)).copied());
        for (file, motion) in validation {
            let [least, most] = extent(displacement(motion, i).iter().copied());
            if (low - least).max(most - high) > (BEYOND - 1.0) * (high - low) {
                warnings.push(format!(
                    "the displacement of axis {} goes from {} to {} {} in {file} but only from {} to {} in training: errors \
                     there say nothing about the range that was learnt",
                    axis.name,
                    rounded(least),
                    rounded(most),
                    unit(axis),
                    rounded(low),
                    rounded(high)
                ));
            }
        }
        let trained = training
            .iter()
            .map(|m| peak(velocity(m, i)))
            .fold(0.0, f64::max);
        for (file, motion) in validation {
            let seen = peak(velocity(motion, i));
            if seen > BEYOND * trained {
                warnings.push(format!(
                    "the velocity of axis {} reaches {} {}/s in {file} but only {} in training: errors there say nothing about the range that was learnt",
                    axis.name, rounded(seen), unit(axis), rounded(trained)
                ));
            }
        }
    }
    warnings
}

fn unit(axis: &Axis) -> &'static str {
    match axis.kind {
        crate::study::AxisKind::Translation => "m",
        crate::study::AxisKind::Rotation => "rad",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::{AxisKind, Controller, Convention};

    fn axes() -> Vec<Axis> {
        [("x", AxisKind::Translation), ("phi", AxisKind::Rotation)]
            .map(|(name, kind)| Axis {
                name: name.into(),
                kind,
                inertia: Some(1.0),
                restoring_force: Convention::default(),
                ground_stiffness: 0.0,
                ground_damping: 0.0,
                controller: Controller::default(),
                encoder_step: None,
                velocity_alone: false,
                integrated_above_hz: None,
            })
            .to_vec()
    }

    fn motion(record: usize, velocity: [f64; 2]) -> Motion {
        let wave = |size: f64| {
            (0..1000)
                .map(|i| size * (f64::from(i) * 0.1).sin())
                .collect()
        };
        Motion {
            still: Vec::new(),
            before: Vec::new(),
            inputs: Vec::new(),
            record,
            first_row: 0,
            sample_rate_hz: 1000.0,
            states: vec![
                wave(0.1 * velocity[0]),
                wave(velocity[0]),
                wave(0.1 * velocity[1]),
                wave(velocity[1]),
            ],
            ground: vec![None; 2],
            acceleration: vec![vec![0.0; 1000]; 2],
            force: vec![vec![0.0; 1000]; 2],
        }
    }

    fn count(velocities: &[[f64; 2]], word: &str) -> usize {
        let motions: Vec<_> = velocities
            .iter()
            .enumerate()
            .map(|(i, v)| motion(i, *v))
            .collect();
        let motions: Vec<_> = motions.iter().collect();
        let warnings = training_warnings(&axes(), &motions, 16);
        println!("{warnings:#?}");
        warnings.iter().filter(|w| w.contains(word)).count()
    }

    #[test]
    fn each_missing_motion_is_named() {
        let all = [[1.0, 0.0], [0.0, 3.0], [0.9, 2.5]];
        assert_eq!(count(&all, ""), 0);
        assert_eq!(count(&all[2..], "alone"), 2);
        assert_eq!(count(&all[..2], "together"), 1);
        assert_eq!(count(&all[..1], "rests in every"), 1);
        assert_eq!(count(&[all[0], all[1], [0.2, 2.5]], "but 1.000"), 1);
    }

    #[test]
    fn a_sine_goes_round_one_loop_and_two_of_them_do_not() {
        let sine = |size: f64, rate: f64| {
            let mut motion = motion(0, [size, 0.0]);
            let at = |n: usize| rate * n as f64;
            motion.states[0] = (0..1000).map(|n| 3.0 - size * at(n).cos()).collect();
            motion.states[1] = (0..1000).map(|n| size * rate * at(n).sin()).collect();
            motion
        };
        let (one, faster, larger) = (sine(1.0, 0.1), sine(1.0, 0.3), sine(2.0, 0.1));
        let axes = &axes()[..1];
        assert_eq!(one_loop(axes, &[&one, &one]).len(), 1);
        assert_eq!(one_loop(axes, &[&one, &faster]), [""; 0]);
        assert_eq!(one_loop(axes, &[&one, &larger]), [""; 0]);
    }

    #[test]
    fn a_motion_to_one_side_is_told_and_one_to_and_fro_is_not() {
        let (ahead, mut back) = (motion(0, [1.0, 0.0]), motion(1, [1.0, 0.0]));
        let mut forth = ahead.clone();
        for v in &mut forth.states[1] {
            *v = 0.5 + 0.501 * *v;
        }
        for v in &mut back.states[1] {
            *v = -0.5 - 0.5 * *v;
        }
        let axes = &axes()[..1];
        assert_eq!(one_way(axes, &[&forth, &forth]).len(), 1);
        assert_eq!(one_way(axes, &[&back]).len(), 1);
        assert_eq!(one_way(axes, &[&forth, &back]), [""; 0]);
        assert_eq!(one_way(axes, &[&ahead]), [""; 0]);
        assert_eq!(one_way(axes, &[]), [""; 0]);
        // A velocity that alone was logged may have a zero of its own.
        let mut alone = axes.to_vec();
        assert!(!one_way(&alone, &[&forth])[0].contains("offset"));
        alone[0].velocity_alone = true;
        let said = &one_way(&alone, &[&forth])[0];
        assert!(said.contains("the mean of its velocity is 0.5"), "{said}");
    }

    #[test]
    fn rows_and_range_are_counted() {
        let (slow, fast) = (motion(0, [1.0, 0.0]), motion(1, [1.3, 0.0]));
        let warnings = training_warnings(&axes()[..1], &[&slow], 256);
        assert!(warnings.iter().any(|w| w.contains("1000 training rows")));
        let beyond = validation_warnings(&axes()[..1], &[&slow], &[("v.csv", &fast)]);
        assert!(beyond[0].contains("from -0.13"), "{beyond:?}");
        assert!(beyond[1].contains("reaches 1.30"), "{beyond:?}");
        assert_eq!(
            validation_warnings(&axes()[..1], &[&fast], &[("v.csv", &slow)]).len(),
            0
        );
    }
}

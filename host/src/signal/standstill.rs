//! Rows in which nothing moves.
//!
//! A joint that sticks takes any force up to its breakaway: its force follows no motion there, and
//! no law of motion can be learnt from such rows or be judged by them.

use crate::signal::spectrum::{Accumulator, DISPLACEMENT_FLOOR, SEGMENT, floor_of};
use crate::study::series::median;
use crate::study::survey::smallest_step;
use crate::study::{Record, Role, Study};
use crate::text::error::{Error, Result};

/// Steps of an encoder that a position may go to and fro while its axis stands.
const STEPS: f64 = 1.5;
/// The same in standard deviations of a position's noise.
const NOISE: f64 = 6.0;
/// Where a joint rests, it stays for so many times longer than half of the stretches that it stays
/// for.
const LONGER: f64 = 5.0;
/// Fewer rows in motion tell nothing.
const LEAST: usize = 100;
/// Part of the rows that is worth a word.
const MANY: f64 = 0.1;
/// Part of the rows beyond which leaving them out leaves nothing to learn from.
const NEARLY_ALL: f64 = 0.9;

/// Of every row of a record but those that the filters cost at each end, whether no axis moves: for
/// a period of the fastest motion that the states show, and for much longer than usual, its
/// displacement stays within what encoder and noise do.
fn rows(study: &Study, record: &Record, (state_band_hz, half): (f64, usize)) -> Vec<bool> {
    let mut still = vec![true; record.rows];
    let period = (study.sample_rate_hz / state_band_hz).ceil() as usize + 1;
    for (axis, channels) in study.axes.iter().zip(&record.axes) {
        let displacement = channels.relative_displacement();
        let least = least_motion(&displacement, axis.encoder_step, study.sample_rate_hz);
        let stays = stays(&displacement, least);
        let usual = median(stays.iter().map(|rows| *rows as f64).collect()).unwrap_or(0.0);
        let mut from = 0;
        for &rows in &stays {
            let rests = stays.len() == 1 || (rows >= period && rows as f64 > LONGER * usual);
            if !rests {
                still[from..from + rows].fill(false);
            }
            from += rows;
        }
    }
    let kept = half..record.rows.saturating_sub(half);
    still.get(kept).unwrap_or_default().to_vec()
}

/// Rows for which a displacement stays within this range, one stretch after the other.
///
/// What creeps all the time, or is read less often than its log has rows, stays for equally long
/// everywhere; what rests stays for longer than it does as it moves.
fn stays(displacement: &[f64], least: f64) -> Vec<usize> {
    let mut stays = Vec::new();
    let (mut from, mut low, mut high) = (0, f64::INFINITY, f64::NEG_INFINITY);
    for (row, &x) in displacement.iter().enumerate() {
        (low, high) = (low.min(x), high.max(x));
        if high - low > least {
            stays.push(row - from);
            (from, low, high) = (row, x, x);
        }
    }
    stays.push(displacement.len() - from);
    stays
}

/// The same of a study that leaves such rows out.
///
/// # Errors
/// A record in which next to nothing moves.
pub(crate) fn left_out(study: &Study, record: &Record, ends: (f64, usize)) -> Result<Vec<bool>> {
    let still = rows(study, record, ends);
    let moving = still.iter().filter(|still| !**still).count();
    if moving >= LEAST.min(still.len()) {
        return Ok(still);
    }
    Err(Error::data(format!(
        "{}: nothing moves in {} of its {} rows, which {} leaves out; take the record or leave_out_standstill out of it",
        record.file,
        still.len() - moving,
        still.len(),
        study.path.display()
    )))
}

/// That nothing moves in many rows of the training records, where they count.
pub(crate) fn in_words(study: &Study, state_band_hz: f64, half: usize) -> Option<String> {
    let training = study.records.iter().filter(|r| r.role == Role::Train);
    let still: Vec<bool> = training
        .flat_map(|r| rows(study, r, (state_band_hz, half)))
        .collect();
    let share = still.iter().filter(|still| **still).count() as f64 / still.len().max(1) as f64;
    (share > MANY && !study.leave_out_standstill && !study.quasi_static).then(|| {
        let mut records = study.records.iter();
        let stays = records.all(|r| left_out(study, r, (state_band_hz, half)).is_ok());
        let advice = match (share > NEARLY_ALL, stays) {
            (true, _) => "check the unit and the scale of the displacement, and whether the log holds the motion",
            (false, true) => "leave_out_standstill = true in study.toml leaves such rows out",
            (false, false) => "of a record too few rows would stay without them, so log one that moves for longer",
        };
        format!(
            "nothing moves in {:.0} % of the training rows: unless the motion is imposed, a joint that sticks takes any force there up to its \
             breakaway; {advice}",
            100.0 * share
        )
    })
}

/// The range beyond which a displacement moves: more than steps of its encoder and its noise.
fn least_motion(displacement: &[f64], encoder_step: Option<f64>, rate: f64) -> f64 {
    let step = encoder_step.or_else(|| smallest_step(displacement));
    // Two ways to the noise, of which each may take something else for it: the tail of the spectrum
    // the stairs of an encoder, and third differences (twenty times the variance of white noise,
    // and a median of 0.6745 standard deviations) a motion of few rows a period.
    let thirds = displacement.windows(4);
    let mut thirds: Vec<f64> = thirds
        .map(|w| (w[3] - 3.0 * (w[2] - w[1]) - w[0]).abs())
        .collect();
    thirds.sort_by(f64::total_cmp);
    let median = thirds.get(thirds.len() / 2).copied().unwrap_or(0.0);
    let noise = tail(displacement, rate).min(median / (0.6745 * 20f64.sqrt()));
    (STEPS * step.unwrap_or(0.0)).max(NOISE * noise)
}

/// Standard deviation of white noise as strong as the tail of a displacement's spectrum.
fn tail(displacement: &[f64], rate: f64) -> f64 {
    let mut sum = Accumulator::new(rate, SEGMENT.min(displacement.len()));
    sum.add(displacement);
    (floor_of(&sum.finish(), DISPLACEMENT_FLOOR) * 0.5 * rate).sqrt()
}

#[cfg(test)]
mod tests {
    use super::{least_motion, stays};

    #[test]
    fn what_creeps_stays_equally_long_everywhere_and_what_rests_for_longer() {
        let creeps: Vec<f64> = (0..1000).map(|row| 1e-3 * f64::from(row)).collect();
        let of_creep = stays(&creeps, 0.0995);
        assert_eq!(of_creep, [100; 10]);
        let moves: Vec<f64> = (0..100).map(|row| 1e-2 * f64::from(row)).collect();
        let rests = [moves, vec![1.0; 300]].concat();
        assert_eq!(stays(&rests, 0.0995).last(), Some(&300));
        assert_eq!(stays(&[1.0; 7], 0.1), [7]);
    }

    #[test]
    fn an_encoder_moves_by_more_than_a_step_and_a_gauge_by_more_than_its_noise() {
        let counts = |row: i32| (10.0 * (0.01 * f64::from(row)).sin()).round() * 1e-3;
        let encoder: Vec<f64> = (0..2000).map(counts).collect();
        assert!((least_motion(&encoder, None, 1e3) - 1.5e-3).abs() < 1e-12);
        assert!((least_motion(&encoder, Some(2e-3), 1e3) - 3e-3).abs() < 1e-12);
        let noise = |row: i32| (43758.5453 * (12.9898 * f64::from(row)).sin().abs()).fract() - 0.5;
        let gauge: Vec<f64> = (0..2000)
            .map(|row| (0.01 * f64::from(row)).sin() + 1e-3 * noise(row))
            .collect();
        // A uniform distribution of width 1 has a standard deviation of 0.289.
        let least = least_motion(&gauge, None, 1e3);
        assert!((1.0e-3..3.0e-3).contains(&least), "{least}");
    }
}

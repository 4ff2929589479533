//! Derivatives that can be compared with measured ones without an error of their own.
//!
//! The second difference of a position over a lag of `h` samples is the acceleration averaged with
//! a triangle of half-width `h`: exactly, whatever the motion. So a logged acceleration, averaged
//! with that triangle, must equal it, and a longer lag lowers the noise of both alike. The same
//! holds for velocities.

use crate::study::series::mean;

/// Lags tried, in samples.
pub(crate) const LAGS: [usize; 7] = [1, 2, 4, 8, 16, 32, 64];

/// Average with a triangle of half-width `lag`; `lag − 1` rows are lost at each end.
pub(crate) fn triangle(series: &[f64], lag: usize) -> Vec<f64> {
    boxed(&boxed(series, lag), lag)
}

/// Running mean of `count` rows.
fn boxed(series: &[f64], count: usize) -> Vec<f64> {
    if count <= 1 || series.len() < count {
        return series.to_vec();
    }
    let mut sums = Vec::with_capacity(series.len() + 1);
    sums.push(0.0);
    let mut sum = 0.0;
    for value in series {
        sum += value;
        sums.push(sum);
    }
    let means = sums[count..].iter().zip(&sums);
    means
        .map(|(end, start)| (end - start) / count as f64)
        .collect()
}

/// Position, velocity and acceleration of a logged position, each averaged with the same triangle;
/// `lag` rows are lost at each end.
pub(crate) fn motion(position: &[f64], lag: usize, rate_hz: f64) -> [Vec<f64>; 3] {
    let inner = position
        .get(1..position.len().saturating_sub(1))
        .unwrap_or(&[]);
    let velocity: Vec<f64> = position
        .windows(3)
        .map(|w| 0.5 * (w[2] - w[0]) * rate_hz)
        .collect();
    let acceleration: Vec<f64> = position
        .windows(3)
        .map(|w| (w[2] - 2.0 * w[1] + w[0]) * rate_hz * rate_hz)
        .collect();
    [
        triangle(inner, lag),
        triangle(&velocity, lag),
        triangle(&acceleration, lag),
    ]
}

/// A logged channel averaged like the derivatives of [`motion`], and cut to the same rows.
pub(crate) fn alike(series: &[f64], lag: usize) -> Vec<f64> {
    triangle(
        series.get(1..series.len().saturating_sub(1)).unwrap_or(&[]),
        lag,
    )
}

/// Displacement and velocity of a joint, and the acceleration of its body, logged or else derived
/// from the body's position, each averaged with the same triangle; and its half-width.
pub(crate) fn joint_motion(
    displacement: &[f64],
    body: &[f64],
    acceleration: Option<&[f64]>,
    rate_hz: f64,
) -> ([Vec<f64>; 3], usize) {
    let lag = clear_lag(body).max(2);
    let [x, v, _] = motion(displacement, lag, rate_hz);
    let a = match acceleration {
        Some(logged) => alike(logged, lag),
        None => motion(body, lag, rate_hz)[2].clone(),
    };
    ([x, v, a], lag)
}

/// How one series follows another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Likeness {
    /// Coefficient of correlation, −1 to 1.
    pub(crate) correlation: f64,
    /// The factor by which the first is larger than the second, with its sign.
    pub(crate) gain: f64,
}

/// Correlation and gain of `first` against `second`, means taken off.
pub(crate) fn likeness(first: &[f64], second: &[f64]) -> Likeness {
    let count = first.len().min(second.len());
    let (a, b) = (mean(&first[..count]), mean(&second[..count]));
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (x, y) in first.iter().zip(second) {
        let (x, y) = (x - a, y - b);
        aa += x * x;
        bb += y * y;
        ab += x * y;
    }
    if !(aa > 0.0 && bb > 0.0) {
        return Likeness {
            correlation: 0.0,
            gain: 0.0,
        };
    }
    Likeness {
        correlation: ab / (aa * bb).sqrt(),
        // The ratio of the sizes: noise in either lowers a regression's slope, but hardly this.
        gain: (aa / bb).sqrt().copysign(ab),
    }
}

/// How a logged derivative of the given order (1 velocity, 2 acceleration) follows a position, at
/// the lag where it does so best.
pub(crate) fn derivative_likeness(
    logged: &[f64],
    position: &[f64],
    order: usize,
    rate_hz: f64,
) -> Likeness {
    let rows = logged.len().min(position.len());
    let tried = LAGS.iter().filter(|lag| 8 * **lag < rows).map(|lag| {
        let derived = &motion(&position[..rows], *lag, rate_hz)[order];
        likeness(&alike(&logged[..rows], *lag), derived)
    });
    let best = tried.max_by(|a, b| a.correlation.abs().total_cmp(&b.correlation.abs()));
    best.unwrap_or(Likeness {
        correlation: 0.0,
        gain: 0.0,
    })
}

/// The shortest lag at which the second difference of a position stands clear of the position's
/// noise.
pub(crate) fn clear_lag(position: &[f64]) -> usize {
    // Of white noise the sixth difference has 924 times the variance; of a motion sampled well it
    // has next to nothing.
    let sixth = position
        .windows(7)
        .map(|w| w[0] - 6.0 * w[1] + 15.0 * w[2] - 20.0 * w[3] + 15.0 * w[4] - 6.0 * w[5] + w[6]);
    let rows = position.len().max(7) - 6;
    let noise = sixth.map(|d| d * d).sum::<f64>() / (924.0 * rows as f64);
    let clear = |lag: usize| {
        let count = position.len().saturating_sub(2 * lag).max(1) as f64;
        let size: f64 = (2 * lag..position.len())
            .map(|i| (position[i] - 2.0 * position[i - lag] + position[i - 2 * lag]).powi(2))
            .sum();
        // The noise of three readings, weighted 1, −2, 1.
        size / count > 100.0 * 6.0 * noise
    };
    let usable = LAGS.iter().filter(|lag| 20 * **lag < position.len());
    usable.copied().find(|lag| clear(*lag)).unwrap_or(16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_logged_acceleration_equals_the_second_difference_at_every_lag() {
        let rate = 1000.0;
        let wave = |w: f64, i: usize| (w * i as f64 / rate).sin();
        let position: Vec<f64> = (0..4000)
            .map(|i| wave(70.0, i) + 0.3 * wave(190.0, i))
            .collect();
        let acceleration: Vec<f64> = (0..4000)
            .map(|i| -4900.0 * wave(70.0, i) - 0.3 * 36_100.0 * wave(190.0, i))
            .collect();
        for lag in [1, 2, 4, 8] {
            let derived = &motion(&position, lag, rate)[2];
            let averaged = alike(&acceleration, lag);
            assert_eq!(derived.len(), averaged.len());
            let found = likeness(&averaged, derived);
            assert!(found.correlation > 0.999_99, "{lag}: {found:?}");
            assert!((found.gain - 1.0).abs() < 5e-3, "{lag}: {found:?}");
        }
        let in_g: Vec<f64> = acceleration.iter().map(|a| -a / 9.80665).collect();
        let found = derivative_likeness(&in_g, &position, 2, rate);
        assert!((found.gain * 9.80665 + 1.0).abs() < 5e-3, "{found:?}");
    }

    #[test]
    fn noise_asks_for_a_longer_lag() {
        let clean: Vec<f64> = (0..4000).map(|i| (0.02 * f64::from(i)).sin()).collect();
        let mut state = 1_u64;
        let mut noise = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
        };
        let noisy: Vec<f64> = clean.iter().map(|x| x + 1e-3 * noise()).collect();
        assert_eq!(clear_lag(&clean), 1);
        assert!(clear_lag(&noisy) >= 4, "{}", clear_lag(&noisy));
    }
}

//! How often the device looks at a residual in the band: as often as the band needs, and not at
//! every sample.

use super::fir::shut_from_hz;

/// The binary logarithm, `most` at most, of the largest power of two such that of a signal
/// low-passed by `taps` every so-many-th value is enough: whatever then looks like a frequency from
/// 0 to `band_hz` but is another one is damped by 60 dB at least.
///
/// With every D-th value f looks like its distance from the nearest multiple of rate/D, so that
/// nothing falls into the band when the filter is shut ([`shut_from_hz`]) from rate/D − `band_hz`
/// on.
pub fn every_log2(taps: &[f64], sample_rate_hz: f64, band_hz: f64, most: u8) -> u8 {
    let needed_hz = shut_from_hz(taps, sample_rate_hz) + band_hz;
    let every = (sample_rate_hz / needed_hz).log2().floor();
    every.clamp(0.0, f64::from(most)) as u8
}

#[cfg(test)]
mod tests {
    use super::super::filters::Filters;
    use super::super::fir::apply_every;
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn what_folds_into_the_band_is_gone_and_twice_as_far_apart_it_is_not() {
        let (rate, most) = (1000.0, 6);
        for band_hz in [20.0, 35.0, 70.0, 110.0, 150.0, 220.0, 400.0] {
            let filters = Filters::for_bands(rate, band_hz, (2.0 * band_hz).min(450.0)).unwrap();
            let log2 = every_log2(&filters.band, rate, band_hz, most);
            // The loudest tone above half the rate of what is kept that looks like one of the band.
            let loudest = |every: usize| {
                let kept_hz = rate / every as f64;
                let tones = (1..2000).map(|quarter| 0.25 * f64::from(quarter));
                let folded = tones.filter(|hz| {
                    let seen = (hz - kept_hz * (hz / kept_hz).round()).abs();
                    *hz > kept_hz / 2.0 && seen <= band_hz
                });
                folded.fold(0.0, |most: f64, hz| {
                    let tone: Vec<f64> = (0..filters.band.len() + 256)
                        .map(|n| (2.0 * PI * hz / rate * f64::from(n as u32)).sin())
                        .collect();
                    let kept = apply_every(&tone, &filters.band, every);
                    kept.iter().fold(most, |most, value| most.max(value.abs()))
                })
            };
            assert!(loudest(1 << log2) <= 1e-3, "{band_hz} Hz, 2^{log2}");
            let twice = loudest(2 << log2);
            assert!(log2 == most || twice > 1e-3, "{band_hz} Hz, 2^{log2}");
        }
    }
}

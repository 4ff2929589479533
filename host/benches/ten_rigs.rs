//! How well the fits generalise: plain, default and selected fits of ten simulated rigs with
//! different parameters, as a table.
//!
//! `cargo bench -p jointwatch --bench ten_rigs` prints the tables of docs/notebook/fits.md. Logs
//! with noise and encoder counts go through the same filters as a user's; errors are NMSE in
//! percent on the validation record, band-limited as `compare` does.

use jointwatch::fit::polynomial::{Method, PolynomialOptions, fit_polynomial};
use jointwatch::paper::Spread;
use jointwatch::signal::filters::Filters;
use jointwatch::signal::motion::{Motion, low_pass, motions};
use jointwatch::simulate::{RigParameters, SimulationOptions, simulate};
use jointwatch::study::Role;
use jointwatch::text::error::Result;

const METHODS: [Method; 3] = [Method::LeastSquares, Method::Ridge, Method::Select];

/// Per method and axis the NMSE in percent, and the number of selected terms per axis.
struct Outcome {
    nmse: [[f64; 2]; 3],
    terms: [usize; 2],
}

fn rig(index: u64, snr_db: f64, duration_s: f64) -> Result<Outcome> {
    let parameters = if index == 0 {
        RigParameters::default()
    } else {
        RigParameters::draw(index)
    };
    let study = simulate(&SimulationOptions {
        rig: parameters,
        snr_db: Some(snr_db),
        seed: 100 + index,
        duration_s,
        ..Default::default()
    })?
    .study;
    let filters = Filters::design(&study)?;
    let motions = motions(&study, &filters)?;
    let (training, validation): (Vec<&Motion>, Vec<&Motion>) = motions
        .iter()
        .partition(|motion| study.records[motion.record].role == Role::Train);
    let mut outcome = Outcome {
        nmse: [[0.0; 2]; 3],
        terms: [0; 2],
    };
    for (method, nmse) in METHODS.into_iter().zip(&mut outcome.nmse) {
        let options = PolynomialOptions {
            method,
            ..PolynomialOptions::default()
        };
        let fit = fit_polynomial(&study.axes, &training, &filters.band, &options, &|_| ())?;
        let states: Vec<&[f64]> = validation[0].states.iter().map(Vec::as_slice).collect();
        let predicted = fit.polynomial.predict(&states)?;
        for (i, axis) in study.axes.iter().enumerate() {
            let measured =
                validation[0].restoring_force(i, fit.inertia[i].value, axis.restoring_force);
            let measured = low_pass(&measured, &filters.band);
            let predicted = low_pass(&predicted[i], &filters.band);
            let mean = measured.iter().sum::<f64>() / measured.len() as f64;
            let spread: f64 = measured.iter().map(|r| (r - mean).powi(2)).sum();
            let error: f64 = measured
                .iter()
                .zip(&predicted)
                .map(|(a, b)| (a - b).powi(2))
                .sum();
            nmse[i] = 100.0 * error / spread;
            if method == Method::Select {
                outcome.terms[i] = fit.axes[i].terms;
            }
        }
    }
    Ok(outcome)
}

fn main() -> Result<()> {
    let cases = [
        (0, 60.0, 5.0),
        (0, 40.0, 5.0),
        (10, 60.0, 5.0),
        (20, 60.0, 5.0),
        (0, 60.0, 17.0),
    ];
    for (first, snr_db, duration_s) in cases {
        println!(
            "\n### Rigs {first} to {}, {snr_db} dB, records of {duration_s} s\n",
            first + 9
        );
        println!(
            "| rig | plain x / φ | default x / φ | selected x / φ | terms x / φ | plain ÷ default x / φ |"
        );
        println!("|---|---|---|---|---|---|");
        let mut gains: [Vec<f64>; 2] = Default::default();
        for index in first..first + 10 {
            let outcome = rig(index, snr_db, duration_s)?;
            let [plain, default, select] = outcome.nmse;
            for (i, gains) in gains.iter_mut().enumerate() {
                gains.push(plain[i] / default[i]);
            }
            println!(
                "| {index} | {:.2} / {:.2} | {:.2} / {:.2} | {:.2} / {:.2} | {} / {} | {:.2} / {:.2} |",
                plain[0],
                plain[1],
                default[0],
                default[1],
                select[0],
                select[1],
                outcome.terms[0],
                outcome.terms[1],
                plain[0] / default[0],
                plain[1] / default[1]
            );
        }
        let [x, phi] = gains.map(|gains| Spread::of(gains).expect("ten rigs"));
        println!(
            "\nPlain error over default error: median {:.2} on x and {:.2} on φ; least {:.2} and {:.2}.",
            x.median, phi.median, x.least, phi.least
        );
    }
    Ok(())
}

//! Files of MATLAB: those of version 4, the rate that a number of its own states, and columns
//! beside those in use.

use super::noise::noise;
use jointwatch_tests::program::{says, succeed};
use std::f64::consts::TAU;
use std::fs;
use tempfile::TempDir;

const RATE_HZ: f64 = 400.0;

/// A column or a number as version 4 stores it, little-endian.
fn stored(name: &str, values: &[f64]) -> Vec<u8> {
    let words = [0, values.len() as u32, 1, 0, name.len() as u32 + 1].map(u32::to_le_bytes);
    let numbers: Vec<[u8; 8]> = values.iter().map(|v| v.to_le_bytes()).collect();
    [
        words.as_flattened(),
        name.as_bytes(),
        &[0],
        numbers.as_flattened(),
    ]
    .concat()
}

#[test]
fn an_old_file_states_its_rate_and_a_spectrum_beside_its_signals_is_no_input() {
    let mut noise = noise(3);
    let (mut x, mut force) = (Vec::new(), Vec::new());
    for row in 0..4000 {
        let t = f64::from(row) / RATE_HZ;
        let tones = [(0.7, 2e-3), (2.9, 5e-4), (7.0, 2e-4)];
        let sum = |of: &dyn Fn(f64, f64) -> f64| {
            tones
                .iter()
                .map(|(hz, size)| of(TAU * hz, *size))
                .sum::<f64>()
        };
        let place = sum(&|w, size| size * (w * t).sin());
        let speed = sum(&|w, size| size * w * (w * t).cos());
        x.push(place);
        force.push(2e4 * place + 30.0 * speed + 5.0 * (speed / 1e-3).tanh() + 0.05 * noise());
    }
    let spectrum: Vec<f64> = (0..801).map(|_| noise()).collect();
    let file = [
        stored("SampleRate", &[RATE_HZ]),
        stored("displacement_m", &x),
        stored("force_N", &force),
        stored("spectrum", &spectrum),
    ];
    let folder = TempDir::new().unwrap();
    let folder = folder.path();
    fs::write(folder.join("run.mat"), file.concat()).unwrap();
    let said = succeed(folder, &["init", "--yes", "run.mat"]);
    says(&said, &["MATLAB version 4", "states SampleRate = 400"]);
    let study = fs::read_to_string(folder.join("study.toml")).unwrap();
    says(&study, &["sample_rate_hz = 400.0"]);
    succeed(folder, "identify . --model physical");
    let said = succeed(folder, "diagnose . model.json");
    assert!(said.contains("coulomb@x"), "{said}");
}

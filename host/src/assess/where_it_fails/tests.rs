//! What is wrong where is known beforehand.

use super::*;
use rand::{RngExt, SeedableRng};

fn names() -> Vec<StateName> {
    vec![
        StateName {
            name: "x".into(),
            unit: "mm".into(),
            factor: 1e3,
        },
        StateName {
            name: "velocity of x".into(),
            unit: "mm/s".into(),
            factor: 1e3,
        },
    ]
}

#[test]
fn an_error_planted_in_a_region_a_stretch_and_a_band_is_found_there() {
    let seed = 7;
    println!("seed {seed}");
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let (rate, rows) = (1000.0, 20_000);
    let x: Vec<f64> = (0..rows).map(|_| rng.random_range(-1e-3..1e-3)).collect();
    let v: Vec<f64> = (0..rows).map(|_| rng.random_range(-0.1..0.1)).collect();

    // A contact: large error where |x| > 0.8 mm and the joint closes.
    let contact: Vec<f64> = (0..rows)
        .map(|n| if x[n].abs() > 0.8e-3 && v[n] > 0.0 { 1.0 } else { 0.01 } * rng.random_range(-1.0..1.0))
        .collect();
    let record = ErrorRecord {
        file: "a.csv",
        start_s: 0.0,
        states: vec![&x, &v],
        error: &contact,
    };
    let places = find("x", &names(), &[record], rate, 0.5 * rate);
    let state = places.iter().find(|p| p.kind == "state").unwrap();
    assert!(state.region.contains("|x| above 0.8"), "{}", state.region);
    assert!(
        state.region.contains("velocity of x above"),
        "{}",
        state.region
    );
    assert!(
        state.share_of_error > 0.9 && state.share_of_rows < 0.13,
        "{state:?}"
    );
    let time = places.iter().find(|p| p.kind == "time").unwrap();
    assert!(time.region.contains("evenly"), "{}", time.region);

    // A burst of 50 Hz from 12 s to 13 s.
    let burst: Vec<f64> = (0..rows)
        .map(|n| {
            let t = n as f64 / rate;
            let tone = if (12.0..13.0).contains(&t) {
                (314.159 * t).sin()
            } else {
                0.0
            };
            tone + 0.01 * rng.random_range(-1.0..1.0)
        })
        .collect();
    let record = ErrorRecord {
        file: "b.csv",
        start_s: 0.0,
        states: vec![&x, &v],
        error: &burst,
    };
    let places = find("x", &names(), &[record], rate, 0.5 * rate);
    let time = places.iter().find(|p| p.kind == "time").unwrap();
    assert!(
        time.region.starts_with("b.csv from 12.") && time.share_of_rows < 0.06,
        "{time:?}"
    );
    let band = places.iter().find(|p| p.kind == "frequency").unwrap();
    let low: f64 = band.region.split(' ').next().unwrap().parse().unwrap();
    assert!(
        (40.0..50.0).contains(&low) && band.share_of_rows < 0.05,
        "{band:?}"
    );
}

#[test]
fn an_error_without_a_place_is_not_given_one() {
    let seed = 11;
    println!("seed {seed}");
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut noise = || {
        (0..20_000)
            .map(|_| rng.random_range(-1.0..1.0))
            .collect::<Vec<f64>>()
    };
    let (x, v, error) = (noise(), noise(), noise());
    let record = ErrorRecord {
        file: "a.csv",
        start_s: 0.0,
        states: vec![&x, &v],
        error: &error,
    };
    let places = find("x", &names(), &[record], 1000.0, 500.0);
    let state = places.iter().find(|p| p.kind == "state").unwrap();
    assert!(state.region.starts_with("no region"), "{state:?}");
}

#[test]
fn a_constant_is_named_as_the_zero_of_the_record_that_it_is_in() {
    let of = |mean: f64| -> Vec<f64> {
        let swing = |n: usize| if n.is_multiple_of(2) { 1.0 } else { -1.0 };
        (0..1000).map(|n| mean + swing(n)).collect()
    };
    let (still, shifted) = (of(0.1), of(-3.0));
    let record = |file: &'static str, error| ErrorRecord {
        file,
        start_s: 0.0,
        states: Vec::new(),
        error,
    };
    let found = zero(
        "x",
        "N",
        &[record("a.csv", &still), record("b.csv", &shifted)],
    )
    .unwrap();
    assert!(
        found.region.contains("-3.0") && found.region.contains("b.csv"),
        "{}",
        found.region
    );
    assert!((found.share_of_error - 9000.0 / (1010.0 + 10_000.0)).abs() < 1e-9);
    assert_eq!((found.kind, found.share_of_rows), ("zero", 0.5));
    assert_eq!(zero("x", "N", &[record("a.csv", &still)]), None);
}

//! MATLAB logs, written here byte by byte as the format's description has them, and what is refused
//! about them.

use jointwatch::study::Study;
use jointwatch::text::error::Kind;
use std::fs;
use tempfile::TempDir;

const STUDY: &str = r#"time = "t"
[[axis]]
name = "x"
kind = "translation"
displacement = "q"
force = { column = "u", unit = "V", scale = 3.0 }
[[record]]
file = "log.mat"
role = "train"
"#;

/// One element: type, number of bytes, data, filled up to eight.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = [kind.to_le_bytes(), (data.len() as u32).to_le_bytes()].concat();
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

/// A matrix of doubles (class 6) of `rows` × 1.
fn column(name: &str, values: &[f64]) -> Vec<u8> {
    let data: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let dimensions = [(values.len() as i32).to_le_bytes(), 1_i32.to_le_bytes()].concat();
    let flags = [6_u32.to_le_bytes(), 0_u32.to_le_bytes()].concat();
    let body = [
        element(6, &flags),
        element(5, &dimensions),
        element(1, name.as_bytes()),
        element(9, &data),
    ]
    .concat();
    element(14, &body)
}

fn file(columns: &[(&str, &[f64])]) -> Vec<u8> {
    let mut bytes = b"MATLAB 5.0 MAT-file".to_vec();
    bytes.resize(124, b' ');
    bytes.extend([0x00, 0x01, b'I', b'M']);
    for (name, values) in columns {
        bytes.extend(column(name, values));
    }
    bytes
}

fn read(columns: &[(&str, &[f64])]) -> Result<Study, String> {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("study.toml"), STUDY).unwrap();
    fs::write(folder.path().join("log.mat"), file(columns)).unwrap();
    Study::read(folder.path()).map_err(|e| {
        assert_eq!(e.kind, Kind::Data);
        println!("{e}");
        e.sentence
    })
}

fn signals() -> [Vec<f64>; 3] {
    let time: Vec<f64> = (0..200).map(|i| f64::from(i) * 2e-3).collect();
    let position = time.iter().map(|t| (9.0 * t).sin()).collect();
    let command = time.iter().map(|t| (9.0 * t).cos()).collect();
    [time, position, command]
}

#[test]
fn vectors_are_columns_and_scalars_are_not() {
    let [t, q, u] = signals();
    let study = read(&[
        ("t", &t),
        ("q", &q),
        ("u", &u),
        ("gain", &[3.0]),
        ("extra", &q),
    ])
    .unwrap();
    let axis = &study.records[0].axes[0];
    assert_eq!(study.sample_rate_hz, 500.0);
    assert_eq!(axis.displacement_first, q);
    assert!(axis.force.iter().zip(&u).all(|(f, u)| *f == 3.0 * u));
    assert!(
        study
            .notes
            .iter()
            .any(|n| n.contains("not used") && n.ends_with("extra"))
    );
    let missing = read(&[("t", &t), ("q", &q), ("gain", &[3.0])]).unwrap_err();
    assert!(
        missing.contains("log.mat") && missing.contains("\"u\""),
        "{missing}"
    );
}

#[test]
fn what_is_refused() {
    let [t, q, mut u] = signals();
    let short = read(&[("t", &t), ("q", &q[..150]), ("u", &u)]).unwrap_err();
    assert!(
        short.contains("200 values in \"t\" but 150 in \"q\""),
        "{short}"
    );
    u[16] = f64::NAN;
    let hole = read(&[("t", &t), ("q", &q), ("u", &u)]).unwrap_err();
    for part in ["log.mat", "row 17 (counted from 1)", "\"u\"", "NaN"] {
        assert!(hole.contains(part), "{hole}");
    }
}

//! What is refused about study.toml itself.

use super::{STUDY, log, read, refused};
use jointwatch::study::Study;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// Refused after a part of study.toml was changed.
fn said(from: &str, to: &str, parts: &[&str]) {
    assert!(STUDY.contains(from), "{from}");
    let mut all = vec!["study.toml"];
    all.extend(parts);
    refused(read(&STUDY.replacen(from, to, 1), &log().join("\n")), &all);
}

#[test]
fn units() {
    let unit = |text: &str, parts: &[&str]| {
        let study = STUDY.replace("\"force_N\"", text);
        refused(read(&study, &log().join("\n")), parts);
    };
    unit(
        r#"{ column = "force_N", unit = "mm" }"#,
        &["study.toml, line 10", "force_N", "not one of force", "lbf"],
    );
    unit(
        r#"{ column = "force_N", unit = "V" }"#,
        &["line 10", "force_N", "scale"],
    );
    unit(
        r#"{ column = "force_N", scale = 0.0 }"#,
        &["line 10", "force_N", "scale"],
    );
    unit(
        r#"{ column = "force_N", units = "N" }"#,
        &["line 10", "units", "did you mean \"unit\"?"],
    );
}

#[test]
fn axes() {
    let second = "[[axis]]\nname = \"x\"\nkind = \"rotation\"\ndisplacement = \"x2_m\"\nforce = \"force_N\"\n\n[[record]]";
    said("[[record]]", second, &["line 15", "\"x\"", "twice"]);
    for name in ["a@b", "", "both", "two words"] {
        said(
            "name = \"x\"",
            &format!("name = {name:?}"),
            &["line 6", "effect@axis"],
        );
    }
    said(
        "kind = \"translation\"",
        "kind = \"translatoin\"",
        &["line 7", "did you mean \"translation\"?"],
    );
    said(
        "inertia = 1.5",
        "inertia = -1.5",
        &["line 11", "-1.5", "identified"],
    );
    said(
        "encoder_step = 1e-6",
        "encoder_step = 0.0",
        &["line 12", "encoder_step = 0"],
    );
    said(
        "encoder_step = 1e-6",
        "ground_stiffness = 5.0",
        &["line 12", "body_position"],
    );
    said("[\"x3_m\", \"x2_m\"]", "[]", &["line 8", "displacement"]);
    said(
        "[\"x3_m\", \"x2_m\"]",
        "[\"x3_m\", \"x3_m\"]",
        &["line 8", "x3_m", "itself"],
    );
    said("force = \"force_N\"", "force = []", &["line 10", "force"]);
    said("force = \"force_N\"\n", "", &["\"force\" is missing"]);
}

#[test]
fn keys_values_and_toml() {
    said(
        "inertia = 1.5",
        "inertai = 1.5",
        &["line 11", "inertai", "did you mean \"inertia\"?"],
    );
    said(
        "sample_rate_hz = 1000.0",
        "sample_rate_hz = \"fast\"",
        &["line 2", "fast"],
    );
    said(
        "sample_rate_hz = 1000.0",
        "sample_rate_hz = 0",
        &["line 2", "sample_rate_hz = 0"],
    );
    said(
        "sample_rate_hz = 1000.0",
        "sample_rate_hz = nan",
        &["line 2", "above 0"],
    );
    said(
        "time = \"t_s\"",
        "time = \"t_s\"\nband_hz = 600.0",
        &["line 4", "band_hz = 600", "half"],
    );
    said("time = \"t_s\"", "time = \"t_s", &["line 3", "not TOML"]);
    said(
        "role = \"validate\"",
        "role = \"validat\"",
        &["line 20", "did you mean \"validate\"?"],
    );
    said(
        "[[record]]",
        "[base]\nterms = [\"stiffness@z\"]\n[[record]]",
        &["line 15", "stiffness@z", "x"],
    );
}

#[test]
fn records() {
    let none_to_learn = STUDY.replace("role = \"train\"", "role = \"validate\"");
    let read_only = read(&none_to_learn, &log().join("\n")).unwrap();
    assert!(
        read_only
            .notes
            .iter()
            .any(|n| n.contains("nothing can be learnt")),
        "{:?}",
        read_only.notes
    );
    said(
        "two.csv",
        "one.csv",
        &["line 19", "one.csv", "train", "rows = "],
    );
    let rows = |range: &str, parts: &[&str]| {
        let study = STUDY.replacen(
            "role = \"train\"",
            &format!("role = \"train\"\nrows = {range}"),
            1,
        );
        refused(read(&study, &log().join("\n")), parts);
    };
    rows("[0, 701]", &["one.csv", "700 rows", "[0, 701]"]);
    rows("[200, 100]", &["one.csv", "[200, 100]"]);
    rows("[0, 99]", &["one.csv", "99 rows", "100"]);
    rows("[-1, 99]", &["study.toml", "line 17"]);
    let apart = STUDY
        .replace("two.csv", "one.csv")
        .replacen("role = \"train\"", "role = \"train\"\nrows = [0, 150]", 1)
        .replacen(
            "role = \"validate\"",
            "role = \"validate\"\nrows = [150, 300]",
            1,
        );
    assert_eq!(
        read(&apart, &log().join("\n")).unwrap().records[1].first_row,
        150
    );
}

#[test]
fn a_study_that_is_not_there() {
    let folder = TempDir::new().unwrap();
    refused(
        Study::read(folder.path()),
        &["study.toml", "cannot be read"],
    );
    refused(
        Study::read(Path::new("no/such/study.toml")),
        &["no/such/study.toml"],
    );
    fs::write(folder.path().join("study.toml"), b"name = \"\xff\"").unwrap();
    refused(Study::read(folder.path()), &["study.toml, line 1", "UTF-8"]);
}

#[test]
fn optional_force_columns_count_as_nothing_where_absent() {
    let study = STUDY.replace(
        "\"force_N\"",
        "[\"force_N\", { column = \"pulses_N\", optional = true }]",
    );
    let read = read(&study, &log().join("\n")).unwrap();
    assert!(
        read.notes
            .iter()
            .any(|n| n.contains("one.csv") && n.contains("pulses_N"))
    );
    said(
        "acceleration = \"a2_m_s2\"",
        "acceleration = { column = \"a2_m_s2\", optional = true }",
        &["line 9", "a2_m_s2", "optional"],
    );
}

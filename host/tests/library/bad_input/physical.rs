//! What `identify --model physical` refuses, in one sentence with exit code 3 and nothing written,
//! and what it warns of.

use super::{HEADING, STUDY, refusal, run, write};
use tempfile::TempDir;

/// The study with these base terms.
fn with_terms(study: &str, terms: &str) -> String {
    format!("{study}\n[base]\nterms = {terms}\n")
}

const IDENTIFY: [&str; 6] = ["identify", ".", "--model", "physical", "-o", "model.json"];

/// Runs `identify` on a study; it must be refused in one sentence that contains all `parts`.
fn refused(study: &str, one: &str, parts: &[&str]) {
    let folder = TempDir::new().unwrap();
    write(&folder, study, one);
    refusal(folder.path(), &IDENTIFY, 3, parts);
    let left = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 3, "only the study and its two records");
}

/// A log of as many rows, one per millisecond, of a body that moves at two frequencies; its force
/// from acceleration, m/s².
fn log(rows: u32, force: impl Fn(f64) -> f64) -> String {
    let line = |row: u32| {
        let t = f64::from(row) * 1e-3;
        let (slow, fast) = (60.0 * t, 97.0 * t + 0.4);
        let x = 2e-4 * slow.sin() + 1e-4 * fast.sin();
        let a = -2e-4 * 3600.0 * slow.sin() - 1e-4 * 9409.0 * fast.sin();
        format!("{t},{:.9},{:.9},{a:.9},{:.9}", x, 2.0 * x, force(a))
    };
    let lines = (0..rows).map(line);
    std::iter::once(HEADING.to_owned())
        .chain(lines)
        .collect::<Vec<_>>()
        .join("\n")
}

#[test]
fn terms_that_contradict_or_do_not_exist() {
    let good = log(4000, |a| 1.5 * a);
    for (terms, parts) in [
        (
            r#"["stiffness@x", "stiffness@x"]"#,
            &["stiffness@x stands twice", "[base] terms"][..],
        ),
        (r#"["stiffness@y"]"#, &["axis", "does not have", "x"]),
        (r#"["stifness@x"]"#, &["no effect", "stiffness"]),
        (r#"["viscous"]"#, &["needs the axis", "viscous@x"]),
        (r#"["clearance_coupling"]"#, &["two axes", "has one"]),
        (r#"["clearance_coupling@x"]"#, &["two axes", "has one"]),
    ] {
        refused(&with_terms(STUDY, terms), &good, parts);
    }
    let second = "[[axis]]\nname = \"phi\"\nkind = \"rotation\"\ndisplacement = [\"x3_m\", \"x2_m\"]\n\
                  acceleration = \"a2_m_s2\"\nforce = \"force_N\"\ninertia = 1.5\n\n[[record]]";
    let two = STUDY.replacen("[[record]]", second, 1);
    refused(
        &with_terms(&two, r#"["clearance_coupling@x"]"#),
        &good,
        &["acts on both axes and takes no @x"],
    );
    refused(
        &with_terms(&two, r#"["stiffness@ph"]"#),
        &good,
        &["axis", "does not have", "phi"],
    );
}

#[test]
fn records_that_determine_nothing() {
    let short = log(120, |a| 0.7 * a);
    let many =
        r#"["stiffness@x", "viscous@x", "preload@x", "bouc_wen@x", "cogging@x", "stribeck@x"]"#;
    refused(
        &with_terms(STUDY, many),
        &short,
        &["too few for 14 parameters"],
    );
    let terms = with_terms(STUDY, r#"["viscous@x", "preload@x"]"#);
    // A force that is inertia·acceleration and an offset: the joint's own force is the same
    // everywhere.
    refused(
        &terms,
        &log(4000, |a| 1.5 * a + 2.5),
        &["force of axis x never changes"],
    );
    let unlearnt = terms.replace("role = \"train\"", "role = \"validate\"");
    refused(
        &unlearnt,
        &log(4000, |a| 0.7 * a),
        &["no [[record]] has role"],
    );
}

#[test]
fn an_inertia_that_cannot_be() {
    // The force with the wrong sign, on a body whose inertia is asked for.
    let study = STUDY.replace("inertia = 1.5\n", "");
    let folder = TempDir::new().unwrap();
    write(
        &folder,
        &with_terms(&study, r#"["viscous@x"]"#),
        &log(4000, |a| -1.5 * a),
    );
    let output = run(folder.path(), &IDENTIFY);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(0), "{said}");
    for part in [
        "inertia of axis x would be below 0",
        "held there",
        "sign of the force",
    ] {
        assert!(said.contains(part), "{said:?} lacks {part:?}");
    }
}

//! Studies whose logs a test writes itself.

use std::path::Path;

/// The head of a study: one translation without a mass, with columns of time, displacement and
/// force.
pub const HEAD: &str = r#"time = "t"
[[axis]]
name = "x"
kind = "translation"
displacement = "x"
force = "F"
inertia = 0
"#;

/// Writes `study.toml` of these logs, the first of which, so many, are learnt from, with the terms
/// of its base where there are any.
///
/// # Panics
/// When it cannot be written.
pub fn write_study(folder: &Path, head: &str, logs: &[&str], training: usize, terms: &str) {
    let mut text = head.to_owned();
    for (place, log) in logs.iter().enumerate() {
        let role = if place < training {
            "train"
        } else {
            "validate"
        };
        text += &format!("[[record]]\nfile = \"{log}\"\nrole = \"{role}\"\n");
    }
    if !terms.is_empty() {
        text += &format!("[base]\nterms = [{terms}]\n");
    }
    std::fs::write(folder.join("study.toml"), text).expect("a study");
}

//! What the user names stays what it was named, and what names and levels of columns say of them.

use super::{assert_near, init, motion, refused, text, values};
use jointwatch_tests::program::says;
use std::fs;
use tempfile::TempDir;

#[test]
fn names_before_every_number_are_the_heading() {
    let folder = TempDir::new().unwrap();
    let rows = text("", |t| {
        let [x, v, _] = motion(t);
        [t, x, 40.0 * x + 3.0 * v]
    });
    let mut log = "Board ready".to_owned();
    for row in rows.lines() {
        let cells = ["t", "pos", "force"].iter().zip(row.split(','));
        let cells: Vec<String> = cells.map(|(name, cell)| format!("{name}:{cell}")).collect();
        log += &format!(
            "{}\n",
            if row.is_empty() {
                String::new()
            } else {
                cells.join(", ")
            }
        );
    }
    fs::write(folder.path().join("run.txt"), &log).unwrap();
    let study = init(&folder, &["run.txt"]);
    says(&study, &["displacement = \"pos\"", "force = \"force\""]);
    let found = values(&folder.path().join("study.toml"));
    assert_near(&found, "stiffness", 40.0, 1e-3);
    assert_near(&found, "viscous", 3.0, 1e-2);
    // A line that was cut off is told with its number.
    fs::write(folder.path().join("run.txt"), log + "t:12.0, po\n").unwrap();
    let said = refused(&folder, &["inspect", "run.txt"], 3);
    assert!(said.contains("row 6002 (line of the file)"), "{said}");
}

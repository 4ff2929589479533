//! What the user names stays what it was named, and what names and levels of columns say of them.

use super::{assert_near, init, motion, refused, text, values};
use jointwatch_tests::program::{says, succeed};
use std::fs;
use tempfile::TempDir;

#[test]
fn a_column_that_was_named_stays_and_is_held_against_the_displacement() {
    let folder = TempDir::new().unwrap();
    let log = text("t,x,F,late,own,other", |t| {
        let [x, v, a] = motion(t);
        let [_, late, jerky] = motion(t - 0.3);
        [t, x, 40.0 * x + 3.0 * v + 0.1 * a, 0.5 * late, v, jerky]
    });
    fs::write(folder.path().join("run.csv"), log).unwrap();
    let column = |role: &str| ["--column".to_owned(), role.to_owned()];
    let drafted = |roles: &[&str]| {
        let _ = fs::remove_file(folder.path().join("study.toml"));
        let roles: Vec<String> = roles.iter().flat_map(|role| column(role)).collect();
        let mut words = vec!["init", "--yes", "run.csv"];
        words.extend(roles.iter().map(String::as_str));
        let said = succeed(folder.path(), &words);
        let study = fs::read_to_string(folder.path().join("study.toml")).unwrap();
        (said, study)
    };
    let (said, study) = drafted(&["displacement=x", "velocity=late", "acceleration=other"]);
    says(&study, &["velocity = \"late\"", "acceleration = \"other\""]);
    says(
        &said,
        &[
            "column \"late\" stays the velocity, as you named it",
            "column \"other\" stays the acceleration, as you named it",
        ],
    );
    let (said, study) = drafted(&["velocity=own"]);
    assert!(study.contains("velocity = \"own\""), "{study}");
    assert!(!said.contains("as you named it"), "{said}");
    // What was guessed yields to it.
    let (said, study) = drafted(&["velocity=late"]);
    assert!(study.contains("# displacement = …"), "{study}");
    assert!(
        said.contains("is no derivative of \"x\", so it is integrated"),
        "{said}"
    );
    // Nor is it dropped where nothing is applied.
    let (said, study) = drafted(&["force=0", "displacement=x", "velocity=late"]);
    assert!(study.contains("velocity = \"late\""), "{study}");
    assert!(said.contains("as you named it"), "{said}");
}

/// A model's speed beside the measured one, and a valve that is on or off.
#[test]
fn a_variant_has_no_unit_and_what_is_switched_does_not_move() {
    let folder = TempDir::new().unwrap();
    let log = text("t,Y,A,speed,speed_m,x,F", |t| {
        let [x, v, a] = motion(t);
        let on = if (0.7 * t).sin() > 0.0 { 2.2 } else { 0.01 };
        let noise = 0.001 * (1e4 * t).sin();
        let force = (3.0 + 2.0 * on) * v + 40.0 * x;
        [t, on + noise, a + 50.0 * x, v, 0.4 * v, x, force]
    });
    fs::write(folder.path().join("damper.csv"), log).unwrap();
    let study = init(&folder, &["damper.csv"]);
    says(
        &study,
        &[
            "displacement = \"x\"",
            "# column = \"Y\"   # or \"A\", \"speed_m\"",
            "velocity = \"speed\"",
        ],
    );
}

#[test]
fn an_angle_without_a_unit_is_asked_about_and_a_rotary_position_is_one() {
    let folder = TempDir::new().unwrap();
    let rows = |position: &str| {
        text(&format!("t,{position},force"), |t| {
            let [x, v, _] = motion(t);
            [t, 90.0 * x, 40.0 * x + 3.0 * v]
        })
    };
    fs::write(folder.path().join("run.csv"), rows("pos")).unwrap();
    let said = succeed(folder.path(), &["init", "--yes", "run.csv"]);
    let asked = "if it is an angle, kind = \"rotation\" for the axis and unit = \"deg\" or \"rad\"";
    assert!(said.contains(asked), "{said}");
    fs::remove_file(folder.path().join("study.toml")).unwrap();
    fs::write(folder.path().join("run.csv"), rows("Rotary.Position")).unwrap();
    let study = init(&folder, &["run.csv", "--column", "force=force"]);
    assert!(study.contains("kind = \"rotation\""), "{study}");
}

#[test]
fn a_log_in_which_nothing_moves_and_contradictions_are_refused() {
    let folder = TempDir::new().unwrap();
    let log = text("row,t,F", |t| [(500.0 * t).round(), t, motion(t)[0]]);
    fs::write(folder.path().join("force.csv"), log).unwrap();
    let log = text("t,p1,p2", |t| [t, motion(t)[0], motion(t)[1]]);
    fs::write(folder.path().join("other.csv"), log).unwrap();
    let column = "--column";
    for (words, code, part) in [
        (&["force.csv"][..], 3, "nothing that moves was logged"),
        (
            &["force.csv", column, "force=F"],
            3,
            "nothing that moves was logged",
        ),
        (&["other.csv"], 3, "--column force=COLUMN, of p1, p2;"),
        (
            &["other.csv", column, "force=p1"],
            3,
            "--column displacement=COLUMN, of p2",
        ),
        (
            &["other.csv", "--rate", "8", column, "time=t"],
            2,
            "--rate 8 and --column time=t contradict each other",
        ),
        (
            &["other.csv", column, "time=none", column, "velocity=p2"],
            2,
            "--column velocity=p2 and --column time=none contradict each other",
        ),
    ] {
        let said = refused(&folder, &[&["init", "--yes"], words].concat(), code);
        assert!(said.contains(part), "{words:?}: {said}");
    }
}

/// As a board prints them for a plotter.
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

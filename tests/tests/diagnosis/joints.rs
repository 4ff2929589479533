//! The table of docs/notebook/joints.md is the one that the program gives.

use jointwatch_tests::learnt::value;
use jointwatch_tests::program::{read_json, says, succeed, workspace};
use jointwatch_tests::public::joints::{Outcome, outcomes, outcomes_in_project, table};
use std::fs;

#[test]
#[ignore = "takes minutes: `cargo test --release -p jointwatch-tests --test diagnosis joints:: -- --ignored`"]
fn real_joints_are_diagnosed_as_the_page_says() {
    assert_on_the_page(outcomes(&|_| ()).unwrap());
}

#[test]
fn joints_whose_logs_are_here_are_diagnosed_as_the_page_says() {
    assert_on_the_page(outcomes_in_project().unwrap());
}

fn assert_on_the_page(outcomes: Vec<Outcome>) {
    let page = fs::read_to_string(workspace().join("docs/notebook/joints.md")).unwrap();
    assert!(!outcomes.is_empty());
    for outcome in outcomes {
        let row = table(&[outcome]).lines().last().unwrap().to_owned();
        assert!(page.contains(&row), "the page does not say {row}");
    }
}

/// From two logs of a robot's joint, with nothing said but which column stands for the torque, to
/// what a least-squares fit of the law that robotics uses for it gives: viscous and dry friction
/// and an inertia that the study takes as none.
#[test]
fn a_robot_joint_from_its_logs() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for name in ["train.csv", "validation.csv"] {
        let from = workspace().join("tests/data/robot_joint").join(name);
        fs::copy(from, folder.join(name)).unwrap();
    }
    let init = "init train.csv validation.csv --yes --column force=current_A";
    succeed(folder, init);
    let study = fs::read_to_string(folder.join("study.toml")).unwrap();
    assert!(study.contains("kind = \"rotation\""), "{study}");
    says(&study, &["displacement = { column = \"position_rad\""]);
    succeed(folder, "identify study.toml --model physical -o base.json");
    let apply = "diagnose study.toml base.json --apply -o joint.json";
    let said = succeed(folder, apply);
    println!("{said}");
    let model = read_json(folder.join("joint.json"));
    let effects = model["effects"].as_array().unwrap();
    // Least squares by a script of a few lines on rows behind a low-pass of 5 Hz: 2.13, 0.152 and
    // 0.279; 5.2 and 4.9 % are left.
    assert!((2.0..2.3).contains(&value(&model, "viscous")));
    assert!((0.14..0.16).contains(&value(&model, "coulomb")));
    assert!((0.2..0.5).contains(&value(&model, "inertia_error")));
    assert_eq!(effects.len(), 3, "{effects:?}");
    let left = model["validation"][0]["nmse_percent"].as_f64().unwrap();
    assert!(left < 7.0, "{left}");
}

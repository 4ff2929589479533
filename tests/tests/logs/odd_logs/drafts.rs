//! What a draft takes names, units and numbers for, and what it refuses.

use super::{RATE, ROWS, assert_near, init, motion, refused, text, values};
use jointwatch::study::{AxisKind, Study};
use jointwatch_tests::program::{says, succeed};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fmt::Write as _;
use std::fs;
use tempfile::TempDir;

#[test]
fn logs_of_one_joint_in_different_units_are_each_read_in_their_own() {
    let folder = TempDir::new().unwrap();
    for (name, head, size) in [
        ("a.csv", "millis,Weg,Kraft\nms,mm,N", 1e3),
        ("b.csv", "millis,Weg,Kraft\nms,m,N", 1.0),
    ] {
        let log = text(head, |t| {
            let [x, v, _] = motion(t);
            [1e3 * t, size * x, 40.0 * x + 3.0 * v]
        });
        fs::write(folder.path().join(name), log).unwrap();
    }
    let said = succeed(folder.path(), &["init", "--yes", "a.csv", "b.csv"]);
    assert!(said.contains("each read in its own"), "{said}");
    let study = folder.path().join("study.toml");
    assert_eq!(Study::read(&study).unwrap().sample_rate_hz, RATE);
    let found = values(&study);
    assert_near(&found, "stiffness", 40.0, 1e-3);
    assert_near(&found, "viscous", 3.0, 1e-2);
}

#[test]
fn a_unit_that_nobody_knows_is_told_and_marked_as_guessed() {
    let folder = TempDir::new().unwrap();
    let log = text("Time (s),Stroke:mm,Kraft [Blub]", |t| {
        let [x, v, _] = motion(t);
        [t, 1e3 * x, 40.0 * x + 3.0 * v]
    });
    fs::write(folder.path().join("run.csv"), log).unwrap();
    let said = succeed(folder.path(), &["init", "--yes", "run.csv"]);
    assert!(said.contains("is in \"Blub\", which is no unit"), "{said}");
    let study = fs::read_to_string(folder.path().join("study.toml")).unwrap();
    let force = study.lines().find(|line| line.starts_with("force"));
    assert!(
        force.is_some_and(|line| line.contains("guessed")),
        "{study}"
    );
}

#[test]
fn a_command_beside_what_was_measured_is_not_taken_for_it() {
    let folder = TempDir::new().unwrap();
    let log = text(
        "t,posSoll [mm],posIst [mm],Force SP (N),Force act (N)",
        |t| {
            let [x, v, _] = motion(t);
            let [ahead, ..] = motion(t + 0.02);
            [t, 1e3 * ahead, 1e3 * x, 41.0 * ahead, 40.0 * x + 3.0 * v]
        },
    );
    fs::write(folder.path().join("run.csv"), log).unwrap();
    init(&folder, &["run.csv"]);
    let found = values(&folder.path().join("study.toml"));
    assert_near(&found, "stiffness", 40.0, 1e-3);
}

#[test]
fn a_measurement_file_of_labview_names_a_column_without_cells_and_its_units_in_its_heads() {
    let folder = TempDir::new().unwrap();
    let segment = "Channels\t2\t\nY_Unit_Label\tmm\tkN\nX_Dimension\tTime\tTime\nDelta_X\t0.002\t0.002\n\
                   ***End_of_Header***\t\t\nX_Value\tStroke\tRod force\tComment";
    let rows = text(segment, |t| {
        let [x, v, _] = motion(t);
        [t, 1e3 * x, 0.04 * x + 0.003 * v]
    });
    let log = format!("LabVIEW Measurement\t\n***End_of_Header***\t\n\n{rows}\n{rows}");
    fs::write(folder.path().join("run.lvm"), log.replace(',', "\t")).unwrap();
    let study = init(&folder, &["run.lvm"]);
    assert!(study.contains("rows = [6000, 12000]"), "{study}");
    let found = values(&folder.path().join("study.toml"));
    assert_near(&found, "stiffness", 40.0, 1e-3);
    assert_near(&found, "viscous", 3.0, 1e-2);
}

#[test]
fn of_joints_in_numbered_columns_the_one_that_moves_is_drafted_with_what_has_its_number() {
    let folder = TempDir::new().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let noise: Vec<[f64; 12]> = (0..ROWS)
        .map(|_| random.random::<[f64; 12]>().map(|x| x - 0.5))
        .collect();
    let names = |name: &str| (0..6).map(|n| format!(",{name}_{n}")).collect::<String>();
    let head = format!("timestamp{}{}", names("actual_q"), names("joint_torque"));
    let log = text(&head, |t| {
        let noise = noise[(t * RATE).round() as usize];
        let [x, v, _] = motion(t);
        let mut cells = [0.0; 13];
        cells[0] = t;
        for joint in 0..6 {
            cells[1 + joint] = joint as f64 + 1e-4 * noise[joint];
            cells[7 + joint] = 10.0 * joint as f64 + 0.2 * noise[6 + joint];
        }
        cells[5] = x;
        cells[11] += 40.0 * x + 3.0 * v;
        cells
    });
    fs::write(folder.path().join("robot.csv"), log).unwrap();
    let study = init(&folder, &["robot.csv"]);
    let lines = [
        "displacement = \"actual_q_4\"",
        "force = \"joint_torque_4\"",
    ];
    says(&study, &lines);
}

#[test]
fn columns_of_matrices_have_the_units_in_their_names_and_go_with_those_of_their_number() {
    let folder = TempDir::new().unwrap();
    let head = "t,laser_um[1],laser_um[2],acc_g[1],acc_g[2],force_N[1],force_N[2]";
    let log = text(head, |t| {
        let motions = [motion(t), motion(1.3 * t + 2.0)];
        let [x, y] = motions.map(|[x, _, _]| 1e3 * x);
        let [a, b] = [motions[0][2], 1.69 * motions[1][2]].map(|a| 1e-3 * a / 9.80665);
        let [f, g] = [(x, a), (y, b)].map(|(x, a)| 0.04 * x + 300.0 * a * 9.80665);
        [t, x, y, a, b, f, g + 0.01 * (7.0 * t).sin()]
    });
    fs::write(folder.path().join("runs.csv"), log).unwrap();
    let study = init(&folder, &["runs.csv"]);
    let lines = [
        "displacement = { column = \"laser_um[1]\", unit = \"um\" }",
        "acceleration = { column = \"acc_g[1]\", unit = \"g\" }",
        "force = { column = \"force_N[1]\", unit = \"N\" }",
    ];
    says(&study, &lines);
}

#[test]
fn what_init_cannot_draft_is_refused_with_its_reason() {
    let folder = TempDir::new().unwrap();
    let write = |name: &str, force: fn(f64, f64) -> f64| {
        let log = text("t,x_mm,F_N", |t| {
            let [x, ..] = motion(t);
            [t, 1e3 * x, force(t, x)]
        });
        fs::write(folder.path().join(name), log).unwrap();
    };
    write("good.csv", |_, x| 40.0 * x);
    write("dead.csv", |_, _| 1.5);
    write("broken.csv", |t, x| {
        if t > 2.0 && t < 2.1 {
            f64::NAN
        } else {
            40.0 * x
        }
    });
    let drafted = |words: &[&'static str]| [&["init", "--yes"], words].concat();
    let twice = [
        "good.csv",
        "--column",
        "force=F_N",
        "--column",
        "force=x_mm",
    ];
    for (words, code, parts) in [
        (
            &["good.csv", "--rate", "0"][..],
            2,
            "a rate is a number above 0",
        ),
        (
            &["good.csv", "--inertia=-1"],
            2,
            "an inertia is a number above 0",
        ),
        (
            &["good.csv", "--rate", "9", "--column", "time=none"],
            2,
            "contradict each other",
        ),
        (&twice, 2, "was given twice"),
        (
            &["good.csv", "-o", "-", "--json", "said.json"],
            2,
            "-o - writes the study",
        ),
        (&["dead.csv"], 3, "all of its rows hold the same number"),
        (&["broken.csv"], 3, "of its rows hold no number"),
    ] {
        let said = refused(&folder, &drafted(words), code);
        assert!(said.contains(parts), "{words:?}: {said}");
        assert!(!folder.path().join("study.toml").exists(), "{words:?}");
    }
}

#[test]
fn a_lone_current_is_the_force_by_its_name_and_degrees_without_a_unit_are_asked_about() {
    let folder = TempDir::new().unwrap();
    let log = text("t,q,Iq", |t| {
        let [x, v, _] = motion(t);
        let degrees = 60.0;
        [t, degrees * x, degrees * (0.4 * x + 0.2 * v)]
    });
    fs::write(folder.path().join("motor.csv"), log).unwrap();
    let said = succeed(folder.path(), &["init", "--yes", "motor.csv"]);
    assert!(
        said.contains("no column is a force, so the current \"Iq\" stands for it"),
        "{said}"
    );
    let asked = "displacement = { column = \"q\", unit = \"deg\" } if these are degrees";
    assert!(said.contains(asked), "{said}");
    // Once the unit is written, nothing is asked.
    let path = folder.path().join("study.toml");
    let study = fs::read_to_string(&path).unwrap();
    let given = "displacement = { column = \"q\", unit = \"deg\" }";
    let stated = study.replace("displacement = \"q\"", given);
    assert_ne!(stated, study);
    fs::write(&path, stated).unwrap();
    let said = succeed(folder.path(), &["identify", ".", "--model", "physical"]);
    assert!(!said.contains("if these are degrees"), "{said}");
}

#[test]
fn a_lone_commanded_torque_is_the_force_and_says_so() {
    let folder = TempDir::new().unwrap();
    let log = text("t_s,q_rad,tau_cmd_Nm", |t| {
        let [x, v, _] = motion(t);
        [t, x, 0.4 * x + 0.2 * v]
    });
    fs::write(folder.path().join("joint.csv"), log).unwrap();
    let said = succeed(folder.path(), &["init", "--yes", "joint.csv"]);
    let told = "what was commanded, \"tau_cmd_Nm\", stands for it";
    assert!(said.contains(told), "{said}");
    let study = fs::read_to_string(folder.path().join("study.toml")).unwrap();
    assert!(study.contains("tau_cmd_Nm"), "{study}");
}

/// A robot's own log, and the file of a stand for springs: units in columns of their own, words
/// among the numbers, a summary above.
#[test]
fn an_axis_by_its_number_and_a_unit_in_a_column_of_its_own_are_understood() {
    let folder = TempDir::new().unwrap();
    let log = text("t,q6,dq6,i6,i_des6", |t| {
        let [x, v, _] = motion(t);
        [t, x, v, 0.4 * x + 0.2 * v, 0.5 * x]
    });
    fs::write(folder.path().join("robot.csv"), log).unwrap();
    let study = init(&folder, &["robot.csv"]);
    assert!(study.contains("force = \"i6\""), "{study}");
    // The second is so short that its middle and its end are one.
    for (rows, last) in [(1000, "3/4/2025"), (460, "--")] {
        unit_columns(rows, last);
    }
}

fn unit_columns(rows: u32, last: &str) {
    let folder = TempDir::new().unwrap();
    let mut log = String::from(
        "Maximum,197.6,@,No.1181,\nAverage,51.99,,,\n\nNo.,Force,Unit,Displacement,Unit,Judge,Position,\n",
    );
    for row in 0..rows {
        let [x, v, _] = motion(f64::from(row) / RATE);
        let force = 120.0 * x + 15.0 * v.signum();
        writeln!(log, "{row},{force:.4},gf,{x:.5},mm,OK,{last},").unwrap();
    }
    fs::write(folder.path().join("stand.csv"), log).unwrap();
    let words = ["init", "--yes", "stand.csv", "--column", "time=none"];
    succeed(folder.path(), &words);
    let study = fs::read_to_string(folder.path().join("study.toml")).unwrap();
    for held in [
        "displacement = { column = \"Displacement\", unit = \"mm\" }",
        "force = { column = \"Force\", unit = \"gf\" }",
    ] {
        assert!(study.contains(held), "{held} is not in {study}");
    }
    succeed(folder.path(), &["identify", ".", "--model", "physical"]);
}

/// As structural tests write it: the drift of a storey is an angle, the force is none about it.
#[test]
fn an_angle_beside_a_force_stands_for_the_displacement_and_the_force_for_its_torque() {
    let folder = TempDir::new().unwrap();
    let log = text("t,storey drift angle (rad),Force (kN)", |t| {
        let [x, v, _] = motion(t);
        [t, x, 40.0 * x + 3.0 * v]
    });
    fs::write(folder.path().join("run.csv"), log).unwrap();
    let said = succeed(folder.path(), &["init", "--yes", "run.csv"]);
    assert!(said.contains("is taken for the displacement"), "{said}");
    assert!(said.contains("turns the axis by a lever"), "{said}");
    let study = Study::read(&folder.path().join("study.toml")).unwrap();
    assert_eq!(study.axes[0].kind, AxisKind::Rotation);
    let found = values(&folder.path().join("study.toml"));
    assert_near(&found, "stiffness", 40e3, 1e-3);
    assert_near(&found, "viscous", 3e3, 1e-2);
}

/// A serial servo writes its load as a size with a bit for the sign.
#[test]
fn a_register_with_a_bit_for_its_sign_is_read() {
    let folder = TempDir::new().unwrap();
    let most = (0..4000)
        .map(|row| motion(f64::from(row) / RATE))
        .map(|[x, v, _]| (40.0 * x + 3.0 * v).abs())
        .fold(0.0, f64::max);
    let scale = 500.0 / most;
    let log = text("t,pos,load", |t| {
        let [x, v, _] = motion(t);
        let load = (scale * (40.0 * x + 3.0 * v)).round();
        [t, x, if load < 0.0 { 1024.0 - load } else { load }]
    });
    fs::write(folder.path().join("servo.csv"), log).unwrap();
    let said = succeed(folder.path(), &["init", "--yes", "servo.csv"]);
    assert!(said.contains("holds its sign in bit 10"), "{said}");
    let path = folder.path().join("study.toml");
    let study = fs::read_to_string(&path).unwrap();
    assert!(study.contains("sign_bit = 10"), "{study}");
    let found = values(&path);
    assert_near(&found, "stiffness", scale * 40.0, 0.02);
    assert_near(&found, "viscous", scale * 3.0, 0.02);
    fs::write(&path, study.replace("sign_bit = 10", "sign_bit = 40")).unwrap();
    let words = ["identify", "study.toml", "--model", "physical", "-o", "m"];
    let said = refused(&folder, &words, 3);
    assert!(said.contains("is no bit of a register"), "{said}");
}

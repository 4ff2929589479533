//! The model in a simulation engine: the rig, or one measured body, moving with a law in place of
//! the joint.

use jointwatch::fit::identify::polynomial;
use jointwatch::fit::polynomial::{Method, PolynomialOptions};
use jointwatch::model::file::{Base, ModelFile};
use jointwatch::simulate::respond::{
    Against, AxisResponse, Options, Response, respond, respond_with,
};
use jointwatch::simulate::{
    Contact, Joint, JointLaw, RigParameters, SimulationOptions, write_study,
};
use jointwatch::study::Study;
use jointwatch_tests::program::{json, measurements, says, study_with_logs, succeed};
use jointwatch_tests::story::story;
use std::fs;
use std::path::Path;

fn story_study() -> Study {
    Study::read(&story().join("rig")).unwrap()
}

/// The default polynomial of a study.
fn learnt(study: &Study) -> ModelFile {
    let options = PolynomialOptions {
        method: Method::Ridge,
        ..PolynomialOptions::default()
    };
    polynomial(study, &options, &|_| {}).unwrap().model
}

fn story_model() -> ModelFile {
    learnt(&story_study())
}

fn axis<'a>(response: &'a Response, file: &str, name: &str) -> &'a AxisResponse {
    let record = response.records.iter().find(|r| r.file == file);
    &record.unwrap_or_else(|| panic!("no record {file}")).axes[name]
}

/// Every figure of the axes that do not rest.
fn moving(response: &Response) -> Vec<(String, &AxisResponse)> {
    let axes = response.records.iter().flat_map(|record| {
        let named = |(name, figures)| (format!("{} {name}", record.file), figures);
        record.axes.iter().map(named)
    });
    axes.filter(|(_, figures)| !figures.at_rest).collect()
}

#[test]
fn the_joints_own_law_gives_the_true_motion_and_a_slightly_wrong_one_does_not() {
    let (study, model) = (story_study(), story_model());
    let joint = RigParameters::default().joint;
    for restart_s in [None, Some(0.7)] {
        let options = Options {
            restart_s,
            ..Options::default()
        };
        let response = respond_with(&study, &model, &joint, &options).unwrap();
        assert_eq!(response.against, Against::Truth);
        assert_eq!(moving(&response).len(), 6);
        for (name, figures) in moving(&response) {
            let nmse = figures.displacement_nmse_percent;
            println!("{name}: displacement NMSE {nmse:.1e} %");
            assert!(nmse < 1e-18, "{name}: {nmse:e} %");
            assert!(figures.velocity_nmse_percent < 1e-18, "{name}");
        }
        for record in &response.records {
            assert!(record.diverged.is_empty() && record.simulated == 1.0);
            // Where x alone is shaken, phi does not move at all.
            for figures in record.axes.values().filter(|f| f.at_rest) {
                assert_eq!(figures.peak_error, 0.0);
            }
        }
    }
    let softer = Joint {
        stiffness: [joint.stiffness[0], 0.98 * joint.stiffness[1]],
        ..joint
    };
    let response = respond_with(&study, &model, &softer, &Options::default()).unwrap();
    let nmse = axis(&response, "valid.csv", "phi").displacement_nmse_percent;
    println!("two percent of stiffness in phi: displacement NMSE {nmse:.2e} %");
    assert!(nmse > 1e-4, "{nmse:e} %");
}

/// A study without noise or encoder counts, written into `rig`.
fn clean_study(folder: &Path, rig: RigParameters, axes: usize) {
    let options = SimulationOptions {
        rig,
        axes,
        snr_db: None,
        quantised: false,
        seed: 12,
        ..SimulationOptions::default()
    };
    write_study(&folder.join("rig"), &options).unwrap();
}

/// A joint whose displacement is counted the other way round.
#[derive(Clone)]
struct Mirrored(Joint);

impl JointLaw for Mirrored {
    fn contacts(&self, state: [f64; 4]) -> [Contact; 2] {
        self.0.contacts(state.map(|s| -s))
    }

    fn force(&self, state: [f64; 4], contacts: [Contact; 2]) -> [f64; 2] {
        self.0.force_with(state.map(|s| -s), contacts)
    }
}

/// The joint's own law moves the measured body as it was measured, whichever way the study names
/// its columns.
#[test]
fn the_joints_own_law_moves_the_measured_body() {
    let measured = Options {
        measured: true,
        ..Options::default()
    };
    for axes in [1, 2] {
        let folder = tempfile::tempdir().unwrap();
        let rig = RigParameters::default();
        clean_study(folder.path(), rig, axes);
        let toml = folder.path().join("rig/study.toml");
        let good = fs::read_to_string(&toml).unwrap();
        let without_body = good
            .lines()
            .filter(|line| !line.starts_with("body_position"))
            .collect::<Vec<_>>()
            .join("\n");
        let swapped = good
            .replace(
                "displacement = [\"x3_m\", \"x2_m\"]",
                "displacement = [\"x2_m\", \"x3_m\"]",
            )
            .replace(
                "displacement = [\"phi3_rad\", \"phi2_rad\"]",
                "displacement = [\"phi2_rad\", \"phi3_rad\"]",
            )
            .replace("inertia_minus_force", "force_minus_inertia");
        let swapped_without_body = swapped
            .lines()
            .filter(|line| !line.starts_with("body_position"))
            .collect::<Vec<_>>()
            .join("\n");
        for (what, text, mirrored) in [
            ("as written", &good, false),
            ("without body_position", &without_body, false),
            ("the other way round", &swapped, true),
            ("both", &swapped_without_body, true),
        ] {
            fs::write(&toml, text).unwrap();
            let study = Study::read(&toml).unwrap();
            let model = learnt(&study);
            let response = if mirrored {
                respond_with(&study, &model, &Mirrored(rig.joint), &measured)
            } else {
                respond_with(&study, &model, &rig.joint, &measured)
            }
            .unwrap();
            assert_eq!(response.against, Against::Measurement);
            for (name, figures) in moving(&response) {
                let nmse = figures.displacement_nmse_percent;
                println!("{axes} axes, {what}, {name}: displacement NMSE {nmse:.1e} %");
                // What is left is interpolation between samples and the filters' first state.
                assert!(nmse < 1e-7, "{axes} axes, {what}, {name}: {nmse} %");
            }
        }
    }
}

/// A joint that a polynomial can hold exactly: springs and dampers.
#[test]
fn a_model_of_the_right_form_moves_like_the_joint_by_either_way() {
    let folder = tempfile::tempdir().unwrap();
    let mut rig = RigParameters::default();
    rig.joint.contact_stiffness = [0.0; 2];
    rig.joint.coupling = [0.0; 2];
    // Stiff enough that it moves as far as the joint with its stops.
    rig.joint.stiffness = [8_000.0, 12.0];
    clean_study(folder.path(), rig, 2);
    let toml = folder.path().join("rig/study.toml");
    let mut figures_by_convention = Vec::new();
    for convention in ["inertia_minus_force", "force_minus_inertia"] {
        let text = fs::read_to_string(&toml).unwrap();
        fs::write(&toml, text.replace("inertia_minus_force", convention)).unwrap();
        let study = Study::read(&toml).unwrap();
        let model = learnt(&study);
        for measured in [false, true] {
            let options = Options {
                measured,
                ..Options::default()
            };
            let response = respond(&study, &model, &options).unwrap();
            for (name, figures) in moving(&response) {
                let nmse = figures.displacement_nmse_percent;
                println!("{convention}, measured {measured}, {name}: {nmse:.2e} %");
                assert!(nmse < 1e-8, "{convention}, {measured}, {name}: {nmse} %");
                for band in &figures.spectrum {
                    assert!((band.ratio - 1.0).abs() < 1e-4, "{name}: {band:?}");
                }
            }
            figures_by_convention.push(axis(&response, "valid.csv", "x").displacement_nmse_percent);
        }
    }
    // The sign of the force is a matter of bookkeeping and must not change the motion.
    for measured in [0, 1] {
        let [a, b] = [measured, measured + 2].map(|at| figures_by_convention[at]);
        assert!((a / b - 1.0).abs() < 1e-3, "{a} % and {b} %");
    }
}

/// The story's model with its force turned round: a joint that pushes where it should pull.
fn turned_round(into: &Path) {
    let mut model = story_model();
    let Base::Polynomial(polynomial) = &mut model.base else {
        panic!("the story's model is a polynomial");
    };
    for coefficient in polynomial.coefficients.iter_mut().flatten() {
        *coefficient = -*coefficient;
    }
    model.write(into).unwrap();
}

#[test]
fn a_model_of_the_wrong_sign_diverges_and_the_program_says_when() {
    let folder = tempfile::tempdir().unwrap();
    turned_round(&folder.path().join("wrong.json"));
    let rig = story().join("rig");
    let rig = rig.to_str().unwrap();
    for way in [&[][..], &["--measured"][..]] {
        let mut arguments = vec!["respond", rig, "wrong.json", "--record", "valid.csv"];
        arguments.extend(way);
        let said = succeed(folder.path(), &arguments);
        says(&said, &["valid.csv: the simulation diverged at"]);
        let how = ["half-ranges from the middle", "beyond all numbers"];
        assert!(how.iter().any(|how| said.contains(how)), "{said}");
        arguments.extend(["-o", "states.csv"]);
        let told = json(folder.path(), &arguments);
        let record = &told["records"][0];
        let diverged = &record["diverged"][0];
        let time_s = diverged["time_s"].as_f64().unwrap();
        println!("{way:?}: diverged at {time_s} s");
        assert!(time_s > 0.0 && time_s < 5.0);
        // A state that is no number any more has no distance either.
        assert!(diverged["half_ranges"].as_f64().is_none_or(|h| h > 10.0));
        let share = record["simulated"].as_f64().unwrap();
        assert!(share > 0.0 && share < 1.0);
        assert!(record["axes"]["x"]["outside_range"].as_f64().unwrap() > 0.0);
        // The states end where the simulation did, the measurement goes on.
        let states = fs::read_to_string(folder.path().join("states.csv")).unwrap();
        let cells: Vec<Vec<&str>> = states.lines().map(|l| l.split(',').collect()).collect();
        assert_eq!(cells[0].len(), 9);
        let stopped = cells.iter().skip(1).find(|row| row[1].is_empty()).unwrap();
        assert!((stopped[0].parse::<f64>().unwrap() - time_s).abs() < 1e-9);
        assert!(cells.last().unwrap()[1].is_empty() && !cells.last().unwrap()[2].is_empty());
    }
    // With restarts it diverges again and again, and is taken up again each time.
    let told = json(
        folder.path(),
        &["respond", rig, "wrong.json", "--restart", "1"],
    );
    let record = told["records"].as_array().unwrap().last().unwrap();
    assert!(record["diverged"].as_array().unwrap().len() > 2);
}

#[test]
fn a_good_model_follows_the_rig_and_the_states_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| story().join(name).to_str().unwrap().to_owned();
    let (rig, model) = (path("rig"), path("model.json"));
    let arguments = ["respond", &rig, &model, "--record", "valid.csv"];
    let said = succeed(
        folder.path(),
        &[&arguments[..], &["-o", "states.csv"]].concat(),
    );
    for part in ["displacement NMSE", "velocity NMSE", "8 Hz", "x amplitude"] {
        assert!(said.contains(part), "{part} is missing in {said}");
    }
    assert!(!said.contains("diverged"), "{said}");
    let response = respond(&story_study(), &story_model(), &Options::default()).unwrap();
    for (name, figures) in moving(&response) {
        let nmse = figures.displacement_nmse_percent;
        println!("{name}: displacement NMSE {nmse:.2} %");
        assert!(nmse < 20.0, "{name}: {nmse} %");
        // A polynomial cannot have the corners of the clearance.
        assert!(nmse > 0.1, "{name}: {nmse} %");
    }
    // The file holds what the figures were made from.
    let states = fs::read_to_string(folder.path().join("states.csv")).unwrap();
    let mut lines = states.lines();
    assert_eq!(
        lines.next().unwrap().split(',').take(3).collect::<Vec<_>>(),
        [
            "time_s",
            "x_displacement_simulated_m",
            "x_displacement_measured_m"
        ]
    );
    let rows: Vec<Vec<f64>> = lines
        .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
        .collect();
    assert_eq!(rows.len(), 12_000);
    assert!((rows[2000][0] - 1.0).abs() < 1e-12);
    let peak = rows.iter().map(|r| (r[1] - r[2]).abs()).fold(0.0, f64::max);
    assert_eq!(peak, axis(&response, "valid.csv", "x").peak_error);
}

#[test]
fn a_nearer_horizon_is_easier_to_see() {
    let (study, model) = (story_study(), story_model());
    for measured in [false, true] {
        let nmse = |restart_s| {
            let options = Options {
                record: Some("valid.csv".into()),
                restart_s,
                measured,
            };
            let response = respond(&study, &model, &options).unwrap();
            axis(&response, "valid.csv", "x").displacement_nmse_percent
        };
        let [far, near, nearest] = [None, Some(0.05), Some(0.005)].map(nmse);
        println!("measured {measured}: {far:.3} %, 50 ms {near:.4} %, 5 ms {nearest:.2e} %");
        assert!(near < 0.5 * far && nearest < 0.05 * near);
    }
}

/// Writes an axis whose motion is a sum of sines and whose force follows from it: mass, damper and
/// spring.
fn spring_study(folder: &Path, stiffness: f64) {
    let lines = [[0.7, 0.010, 0.3], [1.9, 0.006, 1.1], [4.3, 0.003, 2.0]];
    let mut log = String::from("t_s,x_m,force_N\n");
    for row in 0..6000 {
        let time = f64::from(row) * 1e-3;
        let (mut x, mut v, mut a) = (0.0, 0.0, 0.0);
        for [frequency, amplitude, phase] in lines {
            let omega = std::f64::consts::TAU * frequency;
            x += amplitude * (omega * time + phase).sin();
            v += amplitude * omega * (omega * time + phase).cos();
            a -= amplitude * omega * omega * (omega * time + phase).sin();
        }
        let force = 5.0 * a
            + 40.0 * v
            + stiffness * x
            + 0.05 * (f64::from(row * 7919 % 1009) / 504.0 - 1.0);
        log.push_str(&format!("{time:.3},{x:.12e},{force:.12e}\n"));
    }
    fs::create_dir_all(folder.join("axis")).unwrap();
    fs::write(folder.join("axis/log.csv"), log).unwrap();
    fs::write(
        folder.join("axis/study.toml"),
        "time = \"t_s\"\nband_hz = 20.0\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = \"x_m\"\n\
         force = \"force_N\"\ninertia = 5.0\n[[record]]\nfile = \"log.csv\"\nrole = \"train\"\n",
    )
    .unwrap();
}

#[test]
fn an_axis_without_a_spring_drifts_and_is_told_so() {
    let folder = tempfile::tempdir().unwrap();
    for (stiffness, drifts) in [(0.0, true), (2000.0, false)] {
        spring_study(folder.path(), stiffness);
        let study = Study::read(&folder.path().join("axis")).unwrap();
        let model = learnt(&study);
        model.write(&folder.path().join("model.json")).unwrap();
        let said = succeed(folder.path(), &["respond", "axis", "model.json"]);
        assert_eq!(
            said.contains("x has no restoring stiffness to speak of"),
            drifts,
            "{said}"
        );
        let response = respond(&study, &model, &Options::default()).unwrap();
        let figures = axis(&response, "log.csv", "x");
        println!(
            "{stiffness} N/m: displacement NMSE {:.1e} %, velocity NMSE {:.1e} %",
            figures.displacement_nmse_percent, figures.velocity_nmse_percent
        );
        assert!(figures.velocity_nmse_percent < 1e-3);
    }
}

/// The friction law that the data set's authors publish, in newtons.
#[derive(Clone)]
struct PublishedFriction;

impl JointLaw for PublishedFriction {
    fn force(&self, [_, v, ..]: [f64; 4], _contacts: [Contact; 2]) -> [f64; 2] {
        let dry = if v == 0.0 { 0.0 } else { 20.394 * v.signum() };
        [-(203.50 * v + dry - 3.165), 0.0]
    }
}

#[test]
fn the_published_friction_moves_the_measured_slide() {
    let Some(data) = measurements("data/emps") else {
        return;
    };
    let logs = ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"];
    let toml = include_str!("../../../docs/measured-axis.toml");
    let folder = study_with_logs(&data, &logs, toml);
    let study = Study::read(folder.path()).unwrap();
    let mut model = learnt(&study);
    model.axes[0].inertia = 95.109;
    for restart_s in [None, Some(1.0)] {
        let options = Options {
            restart_s,
            ..Options::default()
        };
        let response = respond_with(&study, &model, &PublishedFriction, &options).unwrap();
        for (name, figures) in moving(&response) {
            println!(
                "{name}, restart {restart_s:?}: displacement {:.4} %, velocity {:.4} % NMSE",
                figures.displacement_nmse_percent, figures.velocity_nmse_percent
            );
            assert!(figures.velocity_nmse_percent < 0.6, "{name}");
        }
        assert!(
            response
                .notes
                .iter()
                .any(|n| n.contains("no restoring stiffness"))
        );
    }
}

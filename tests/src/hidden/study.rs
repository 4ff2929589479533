//! Writing a case as a user would have it: study.toml and a CSV per record; the truth only on
//! request.

use super::cases::Case;
use super::drive::RATE_HZ;
use super::sensors::{InstrumentFault, log, noise_of};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use std::fmt::Write as _;
use std::fs;
use std::io::{self, Write};
use std::path::Path;

/// What a study calls its two axes and their columns.
const AXES: [AxisNames; 2] = [
    AxisNames {
        name: "x",
        kind: "translation",
        position: ["x2_m", "x3_m"],
        acceleration: ["a2_m_s2", "a3_m_s2"],
        force: "force_N",
    },
    AxisNames {
        name: "phi",
        kind: "rotation",
        position: ["phi2_rad", "phi3_rad"],
        acceleration: ["alpha2_rad_s2", "alpha3_rad_s2"],
        force: "torque_Nm",
    },
];

struct AxisNames {
    name: &'static str,
    kind: &'static str,
    position: [&'static str; 2],
    acceleration: [&'static str; 2],
    force: &'static str,
}

/// The name of an axis in a study.
pub fn axis_name(axis: usize) -> &'static str {
    AXES[axis].name
}

/// The text of study.toml, as the user would write it.
fn description(case: &Case) -> String {
    let mut text = format!("name = \"study\"\nsample_rate_hz = {RATE_HZ:.1}\ntime = \"t_s\"\n");
    for (axis, names) in AXES.iter().enumerate().take(case.axes) {
        let mut inertia = case.rig.chains[axis].inertia[1];
        for faulty in case.faults.iter().filter(|f| f.axis == axis) {
            if faulty.fault == InstrumentFault::WrongInertia {
                inertia *= 1.0 + faulty.strength;
            }
        }
        if let Some(tolerances) = &case.tolerances {
            inertia *= 1.0 + tolerances.inertia[axis];
        }
        let _ = write!(
            text,
            "\n[[axis]]\nname = \"{}\"\nkind = \"{}\"\ndisplacement = [\"{}\", \"{}\"]\nbody_position = \"{}\"\nacceleration = \"{}\"\nforce = \"{}\"\ninertia = {inertia}\nrestoring_force = \"inertia_minus_force\"\nencoder_step = {:e}\n",
            names.name,
            names.kind,
            names.position[1],
            names.position[0],
            names.position[0],
            names.acceleration[0],
            names.force,
            case.encoder_step[axis],
        );
    }
    for plan in &case.plans {
        let role = if plan.training { "train" } else { "validate" };
        let _ = write!(
            text,
            "\n[[record]]\nfile = \"{}\"\nrole = \"{role}\"\n",
            plan.file
        );
    }
    let terms: Vec<String> = case.base_terms.iter().map(|t| format!("\"{t}\"")).collect();
    let _ = write!(text, "\n[base]\nterms = [{}]\n", terms.join(", "));
    text
}

/// Writes the case's study into a folder that exists.
///
/// # Errors
/// When the files cannot be written.
pub fn write(case: &Case, folder: &Path) -> io::Result<()> {
    fs::write(folder.join("study.toml"), description(case))?;
    let training: Vec<_> = case
        .traces
        .iter()
        .zip(&case.plans)
        .filter(|(_, plan)| plan.training)
        .map(|(trace, _)| trace.clone())
        .collect();
    let noise = noise_of(&training, case.snr_db);
    let sizes = noise_of(&training, Some(0.0));
    let mut rng = ChaCha8Rng::seed_from_u64(case.noise_seed);
    for (trace, plan) in case.traces.iter().zip(&case.plans) {
        let mut header = vec!["t_s"];
        let mut positions = Vec::new();
        let mut accelerations = Vec::new();
        let mut forces = Vec::new();
        for axis in 0..case.axes {
            let tolerances = case.tolerances.as_ref();
            let step = case.encoder_step[axis];
            let log = log(
                trace,
                axis,
                &case.faults,
                &[noise[axis], sizes[axis]],
                tolerances,
                step,
                &mut rng,
            );
            positions.extend(log.position);
            accelerations.extend(log.acceleration);
            forces.push(log.force);
        }
        let names = &AXES[..case.axes];
        header.extend(names.iter().flat_map(|n| n.position));
        header.extend(names.iter().flat_map(|n| n.acceleration));
        header.extend(names.iter().map(|n| n.force));
        let columns: Vec<Vec<f64>> = [positions, accelerations, forces].concat();
        let mut file = io::BufWriter::new(fs::File::create(folder.join(plan.file))?);
        writeln!(file, "{}", header.join(","))?;
        for row in 0..columns[0].len() {
            write!(file, "{}", row as f64 / RATE_HZ)?;
            for column in &columns {
                // Adding zero takes the sign from a negative one.
                write!(file, ",{:.8e}", column[row] + 0.0)?;
            }
            writeln!(file)?;
        }
        file.flush()?;
    }
    Ok(())
}

/// Writes what was hidden beside the study, in the form of `truth.json`.
///
/// # Errors
/// When the file cannot be written.
pub fn write_truth(case: &Case, folder: &Path) -> io::Result<()> {
    let effects: Vec<_> = case
        .hidden
        .iter()
        .map(|h| {
            json!({
                "effect": h.subject.name,
                "axis": if h.subject.acts_on_both { "both" } else { axis_name(h.axis) },
                "share_of_rms_force": h.shares.whole,
                "share_that_the_base_cannot_take_over": h.shares.visible,
            })
        })
        .collect();
    let truth = json!({
        "effects": effects,
        "expected_verdict": super::judge::Truth::of(case).expected.word(),
        "snr_db": case.snr_db,
        "instrument_tolerances": case.tolerances.is_some(),
    });
    fs::write(folder.join("truth.json"), format!("{truth:#}\n"))
}

//! Writing a simulated study: study.toml, its logs, and the folder `truth` with what was hidden in
//! them.

use super::sensors::COLUMNS;
use super::simulation::{Simulation, SimulationOptions, simulate};
use crate::text::error::{Error, Result};
use crate::text::output;
use std::fmt::Write as _;
use std::fs;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Simulates the rig and writes the study into the folder `dir`, which is made: `study.toml`, one
/// CSV per record with nine significant digits, and `truth/` with `truth.json` (all parameters, SI)
/// and per record the noise-free states and restoring force. The folder appears only when it is
/// complete.
///
/// # Errors
/// One sentence when an option is out of range, when `dir` exists and is not empty, or when writing
/// fails.
pub fn write_study(dir: &Path, options: &SimulationOptions) -> Result<Simulation> {
    let failed = |error: std::io::Error| {
        Error::failed(format!(
            "cannot write the simulated study to {}: {error}",
            dir.display()
        ))
    };
    output::check_free(dir).map_err(failed)??;
    let simulation = simulate(options)?;
    let parent = match dir.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    fs::create_dir_all(parent).map_err(failed)?;
    // Beside the goal, so that the last move stays on one file system.
    let unfinished = folder_next_to(parent).map_err(failed)?;
    write_into(unfinished.path(), options, &simulation).map_err(failed)?;
    fs::rename(unfinished.path(), dir).map_err(failed)?;
    // Renamed away: there is nothing left to remove.
    let _ = unfinished.keep();
    Ok(simulation)
}

/// A temporary folder is private to its user; a study is a folder like any other.
fn folder_next_to(parent: &Path) -> std::io::Result<tempfile::TempDir> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o777));
    }
    builder.prefix(".jointwatch-simulate-").tempdir_in(parent)
}

fn write_into(
    dir: &Path,
    options: &SimulationOptions,
    simulation: &Simulation,
) -> std::io::Result<()> {
    let truth_dir = dir.join("truth");
    fs::create_dir(&truth_dir)?;
    fs::write(dir.join("study.toml"), study_toml(simulation))?;
    let hidden = simulation.hidden.iter().map(|hidden| {
        serde_json::json!({
            "effect": hidden.term.effect,
            "axis": hidden.term.axis,
            "share_of_rms_force": hidden.share,
            "parameters": hidden.term.parameters,
        })
    });
    let truth = serde_json::json!({
        "effects": hidden.collect::<Vec<_>>(),
        "expected_verdict": if simulation.hidden.is_some() { "effect" } else { "none" },
        "seed": options.seed,
        "snr_db": options.snr_db,
        "quantised": options.quantised,
        "sample_rate_hz": options.sample_rate_hz,
        "drive_band_hz": options.band_hz,
        "validation_level": options.validation_level,
        "noise_rms": COLUMNS.iter().zip(simulation.noise_rms)
            .map(|(column, rms)| ((*column).to_string(), rms.into()))
            .collect::<serde_json::Map<_, _>>(),
        "rig": options.rig,
    });
    fs::write(
        truth_dir.join("truth.json"),
        format!("{}\n", serde_json::to_string_pretty(&truth)?),
    )?;
    let axes = simulation.study.axes.len();
    for (index, record) in simulation.study.records.iter().enumerate() {
        let (names, series): (Vec<_>, Vec<_>) = COLUMNS
            .iter()
            .zip(&simulation.columns[index])
            .enumerate()
            .filter(|(column, _)| axes == 2 || ![2, 3, 6, 7, 9].contains(column))
            .map(|(_, (name, series))| (*name, series.as_slice()))
            .unzip();
        let rate = options.sample_rate_hz;
        write_csv(&dir.join(&record.file), rate, &names, &series)?;
        let truth = &simulation.truth[index];
        let names = ["x_m", "v_m_s", "phi_rad", "omega_rad_s"];
        let forces = ["restoring_force_N", "restoring_torque_Nm"];
        let states = names.iter().take(2 * axes);
        let names: Vec<&str> = states.chain(forces.iter().take(axes)).copied().collect();
        let series: Vec<&[f64]> = truth
            .states
            .iter()
            .chain(&truth.restoring_force)
            .map(Vec::as_slice)
            .collect();
        write_csv(&truth_dir.join(&record.file), rate, &names, &series)?;
    }
    Ok(())
}

fn study_toml(simulation: &Simulation) -> String {
    let study = &simulation.study;
    let mut text = format!(
        "name = \"{}\"\nsample_rate_hz = {:?}\ntime = \"t_s\"\n",
        study.name, study.sample_rate_hz
    );
    for (i, axis) in study.axes.iter().enumerate() {
        let kind = axis.kind.name();
        let (near, far) = (COLUMNS[2 * i], COLUMNS[2 * i + 1]);
        let (acceleration, force) = (COLUMNS[4 + 2 * i], COLUMNS[8 + i]);
        // Every simulated axis states its inertia.
        let inertia = axis.inertia.unwrap_or_default();
        let _ = write!(
            text,
            "\n[[axis]]\nname = \"{}\"\nkind = \"{kind}\"\ndisplacement = [\"{far}\", \"{near}\"]\n\
             body_position = \"{near}\"\nacceleration = \"{acceleration}\"\nforce = \"{force}\"\n\
             inertia = {inertia:?}\nrestoring_force = \"inertia_minus_force\"\n",
            axis.name
        );
        if let Some(step) = axis.encoder_step {
            let _ = writeln!(text, "encoder_step = {step:?}");
        }
    }
    for record in &study.records {
        let role = record.role.name();
        let _ = write!(
            text,
            "\n[[record]]\nfile = \"{}\"\nrole = \"{role}\"\n",
            record.file
        );
    }
    let terms: Vec<_> = study
        .base_terms
        .iter()
        .map(|t| format!("\"{t}\""))
        .collect();
    let _ = write!(text, "\n[base]\nterms = [{}]\n", terms.join(", "));
    text
}

fn write_csv(
    path: &Path,
    sample_rate_hz: f64,
    names: &[&str],
    series: &[&[f64]],
) -> std::io::Result<()> {
    let mut file = BufWriter::new(fs::File::create(path)?);
    writeln!(file, "t_s,{}", names.join(","))?;
    let mut line = String::new();
    for row in 0..series[0].len() {
        line.clear();
        push_number(&mut line, row as f64 / sample_rate_hz);
        for values in series {
            line.push(',');
            push_number(&mut line, values[row]);
        }
        line.push('\n');
        file.write_all(line.as_bytes())?;
    }
    file.flush()
}

/// Nine significant digits without trailing zeros: more than any logger resolves, less than half
/// the bytes of all seventeen.
fn push_number(line: &mut String, value: f64) {
    let start = line.len();
    // Writing to a string cannot fail.
    let _ = write!(line, "{value:.8e}");
    if let Some(e) = line[start..].find('e').map(|at| at + start) {
        let mantissa = line[start..e]
            .trim_end_matches('0')
            .trim_end_matches('.')
            .len();
        line.replace_range(start + mantissa..e, "");
        if line.ends_with("e0") {
            line.truncate(line.len() - 2);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(axes: usize) -> SimulationOptions {
        SimulationOptions {
            duration_s: 1.0,
            axes,
            ..Default::default()
        }
    }

    #[test]
    fn numbers_are_short_and_read_back() {
        for value in [0.0, -2e-6, 0.0005, 1.0, 123_456.789, -0.013_358_130_5] {
            let mut text = String::new();
            push_number(&mut text, value);
            let back: f64 = text.parse().unwrap();
            assert!((back - value).abs() <= 1e-8 * value.abs(), "{text}");
        }
        let mut text = String::new();
        push_number(&mut text, 0.0);
        assert_eq!(text, "0");
    }

    #[test]
    fn a_study_is_complete_and_never_overwritten() {
        let parent = tempfile::tempdir().unwrap();
        for axes in [1, 2] {
            let dir = parent.path().join(format!("deep/rig{axes}"));
            let simulation = write_study(&dir, &options(axes)).unwrap();
            let toml: toml::Table = fs::read_to_string(dir.join("study.toml"))
                .unwrap()
                .parse()
                .unwrap();
            assert_eq!(toml["axis"].as_array().unwrap().len(), axes);
            for record in &simulation.study.records {
                let text = fs::read_to_string(dir.join(&record.file)).unwrap();
                let mut lines = text.lines();
                let heading = lines.next().unwrap();
                assert_eq!(heading.split(',').count(), 1 + 5 * axes);
                for axis in toml["axis"].as_array().unwrap() {
                    assert!(heading.contains(axis["force"].as_str().unwrap()));
                }
                assert_eq!(lines.count(), 2000);
                assert!(dir.join("truth").join(&record.file).exists());
            }
            let truth = fs::read_to_string(dir.join("truth/truth.json")).unwrap();
            let truth: serde_json::Value = serde_json::from_str(&truth).unwrap();
            assert_eq!(truth["rig"]["joint"]["lever_arm_m"], 0.03);
            assert!(write_study(&dir, &options(axes)).is_err());
        }
        // Nothing but the two studies is left behind.
        let left = fs::read_dir(parent.path().join("deep")).unwrap().count();
        assert_eq!(left, 2);
    }
}

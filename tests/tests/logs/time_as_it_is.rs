//! Time stamps as loggers write them: uneven, rounded, doubled, out of order, with gaps, and
//! channels at different rates. A rig whose parameters are known gives them back, and what was done
//! stands in the notes and in the model.

use jointwatch::fit::identify;
use jointwatch::model::file::ModelFile;
use jointwatch::simulate::{SimulationOptions, simulate};
use jointwatch::study::{Role, Study};
use jointwatch_tests::program::says;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const RATE: f64 = 2000.0;
const EVEN: &str = "time = \"t\"\n";
const RESAMPLED: &str = "time = { column = \"t\", resample_hz = 2000 }\n";

/// One row of a log: its time and four channels, each perhaps empty.
#[derive(Clone)]
struct Row {
    t: f64,
    cells: [Option<f64>; 4],
}

/// The rows of a simulated rig's record: far side, body, acceleration, force.
fn rows(study: &Study) -> Vec<(Role, Vec<Row>)> {
    let records = study.records.iter().map(|record| {
        let axis = &record.axes[0];
        let columns = [
            &axis.displacement_first,
            axis.displacement_second.as_ref().unwrap(),
            axis.acceleration.as_ref().unwrap(),
            &axis.force,
        ];
        let row = |at: usize| Row {
            t: at as f64 / RATE,
            cells: columns.map(|c| Some(c[at])),
        };
        (record.role, (0..record.rows).map(row).collect())
    });
    records.collect()
}

fn rig() -> Study {
    let options = SimulationOptions {
        axes: 1,
        duration_s: 6.0,
        seed: 5,
        ..SimulationOptions::default()
    };
    simulate(&options).unwrap().study
}

/// Writes logs and study.toml; `records` is what stands behind each file, perhaps several records.
fn write(folder: &Path, study: &Study, time: &str, logs: &[(Role, Vec<Row>)], parts: &[&str]) {
    let mut text = format!(
        "{time}[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = [\"far\", \"body\"]\nbody_position = \
         \"body\"\nacceleration = \"a\"\nforce = \"F\"\ninertia = {:?}\nrestoring_force = \"inertia_minus_force\"\nencoder_step = \
         2e-6\n[base]\nterms = [\"stiffness@x\", \"viscous@x\", \"clearance@x\"]\n",
        study.axes[0].inertia.unwrap()
    );
    for (index, (role, rows)) in logs.iter().enumerate() {
        let file = format!("log{index}.csv");
        let role = if *role == Role::Train {
            "train"
        } else {
            "validate"
        };
        for part in parts {
            text += &format!("[[record]]\nfile = {file:?}\nrole = {role:?}\n{part}\n");
        }
        let mut log = String::from("t,far,body,a,F\n");
        for row in rows {
            log += &format!("{:.7}", row.t);
            for cell in row.cells {
                log += &cell.map_or(",".to_owned(), |v| format!(",{v}"));
            }
            log.push('\n');
        }
        fs::write(folder.join(file), log).unwrap();
    }
    fs::write(folder.join("study.toml"), text).unwrap();
}

/// What the logs give, spoilt.
fn learnt(
    study: &Study,
    time: &str,
    parts: &[&str],
    spoil: impl Fn(Vec<Row>) -> Vec<Row>,
) -> (Study, ModelFile) {
    let folder = TempDir::new().unwrap();
    let logs: Vec<(Role, Vec<Row>)> = rows(study)
        .into_iter()
        .map(|(role, rows)| (role, spoil(rows)))
        .collect();
    write(folder.path(), study, time, &logs, parts);
    let read = Study::read(folder.path()).unwrap();
    let model = identify::physical(&read).unwrap().model;
    (read, model)
}

/// Largest relative difference of a parameter.
fn difference(one: &ModelFile, other: &ModelFile) -> f64 {
    let values = |m: &ModelFile| -> Vec<f64> {
        let parameters = m.effects.iter().flat_map(|e| &e.parameters);
        parameters.map(|p| p.value).collect()
    };
    let (one, other) = (values(one), values(other));
    assert_eq!(one.len(), other.len());
    one.iter()
        .zip(&other)
        .fold(0.0, |most: f64, (a, b)| most.max((a / b - 1.0).abs()))
}

/// Even noise from 0 to 1.
pub(super) fn noise() -> impl FnMut() -> f64 {
    let mut state = 11_u64;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 33) as f64 / f64::from(1_u32 << 31)
    }
}

/// The channels at any time: the polynomial through the eight rows around it.
fn between(rows: &[Row], t: f64) -> Row {
    let first = ((t * RATE).floor() as usize)
        .saturating_sub(3)
        .min(rows.len() - 8);
    let nodes = &rows[first..first + 8];
    let mut cells = [Some(0.0); 4];
    for (i, node) in nodes.iter().enumerate() {
        let others = nodes.iter().enumerate().filter(|(j, _)| *j != i);
        let weight: f64 = others.map(|(_, o)| (t - o.t) / (node.t - o.t)).product();
        for (sum, value) in cells.iter_mut().zip(node.cells) {
            *sum = Some(sum.unwrap() + weight * value.unwrap());
        }
    }
    Row { t, cells }
}

/// Rows at times off by up to `share` of a period, with what the channels had then.
fn jittered(rows: Vec<Row>, share: f64) -> Vec<Row> {
    let mut noise = noise();
    let end = rows.len() - 1;
    (0..=end)
        .map(|at| match at {
            at if at == 0 || at == end => rows[at].clone(),
            at => between(&rows, (at as f64 + share * (2.0 * noise() - 1.0)) / RATE),
        })
        .collect()
}

#[test]
fn a_rig_gives_its_parameters_whatever_its_logger_did_to_the_time() {
    let study = rig();
    let (_, sound) = learnt(&study, EVEN, &[""], |rows| rows);
    let check = |name: &str,
                 time: &str,
                 tolerance: f64,
                 note: &str,
                 spoil: &dyn Fn(Vec<Row>) -> Vec<Row>| {
        let (read, model) = learnt(&study, time, &[""], spoil);
        let off = difference(&model, &sound);
        println!("{name}: parameters differ by {off:.1e}, relative");
        assert!(off < tolerance, "{name}: {off}");
        assert_eq!(read.sample_rate_hz, RATE, "{name}");
        assert!(
            read.notes.iter().any(|n| n.contains(note)),
            "{name}: {:?}",
            read.notes
        );
        for source in &model.records {
            assert!(
                source.time.iter().any(|t| t.contains(note)),
                "{name}: {source:?}"
            );
        }
    };
    check(
        "resampled at its own rate",
        RESAMPLED,
        1e-3,
        "band-limited",
        &|rows| rows,
    );
    check("rounded", EVEN, 1e-9, "rounded to", &|mut rows| {
        rows.iter_mut()
            .for_each(|r| r.t = (r.t * 1e3).round() / 1e3);
        rows
    });
    check(
        "jitter taken as even",
        EVEN,
        1e-3,
        "off an even grid",
        &|rows| jittered(rows, 0.4),
    );
    check(
        "jitter resampled",
        RESAMPLED,
        1e-3,
        "band-limited",
        &|rows| jittered(rows, 0.4),
    );
    check(
        "wild jitter resampled",
        RESAMPLED,
        1e-3,
        "band-limited",
        &|rows| jittered(rows, 0.8),
    );
    check(
        "every fifth row lost",
        RESAMPLED,
        1e-3,
        "band-limited",
        &|rows| {
            let mut noise = noise();
            rows.into_iter()
                .filter(|r| r.t < 0.02 || noise() > 0.2)
                .collect()
        },
    );
    check("some rows twice", RESAMPLED, 1e-3, "times twice", &|rows| {
        let twice = |(at, row): (usize, Row)| vec![row; 1 + usize::from(at % 97 == 5)];
        rows.into_iter().enumerate().flat_map(twice).collect()
    });
    check(
        "rows out of order",
        RESAMPLED,
        1e-3,
        "out of order",
        &|mut rows| {
            (100..rows.len() - 1)
                .step_by(97)
                .for_each(|at| rows.swap(at, at + 1));
            rows
        },
    );
    check(
        "two loggers interleaved",
        RESAMPLED,
        1e-3,
        "rows without a value",
        &|rows| {
            let split = |row: Row| {
                let [far, body, a, force] = row.cells;
                let first = Row {
                    t: row.t,
                    cells: [far, body, None, None],
                };
                [
                    first,
                    Row {
                        t: row.t,
                        cells: [None, None, a, force],
                    },
                ]
            };
            rows.into_iter().flat_map(split).collect()
        },
    );
}

#[test]
fn channels_at_different_rates_and_with_times_of_their_own_are_brought_to_one() {
    let study = rig();
    let half = "time = { column = \"t\", resample_hz = 1000 }\n";
    let (_, sound) = learnt(&study, EVEN, &[""], |rows| rows);
    let slow_positions = |rows: Vec<Row>| -> Vec<Row> {
        let slow = |(at, mut row): (usize, Row)| {
            if at % 2 == 1 {
                (row.cells[0], row.cells[1]) = (None, None);
            }
            row
        };
        rows.into_iter().enumerate().map(slow).collect()
    };
    let (read, model) = learnt(&study, half, &[""], slow_positions);
    assert_eq!(read.sample_rate_hz, 1000.0);
    let off = difference(&model, &sound);
    println!("positions at half the rate: {off:.1e}");
    assert!(off < 2e-3, "{off}");
    // At the rate of the faster channels the study says that the slower ones cannot fill it.
    let (read, _) = learnt(&study, RESAMPLED, &[""], slow_positions);
    let said = read.notes.iter().any(|n| {
        n.contains("\"body\" sampled at about 1000 Hz") && n.contains("resample_hz = 1000")
    });
    assert!(said, "{:?}", read.notes);
}

#[test]
fn a_gap_of_two_seconds_is_two_records() {
    let study = rig();
    let cut = |rows: Vec<Row>| -> Vec<Row> {
        rows.into_iter()
            .filter(|r| !(2.0..4.0).contains(&r.t))
            .collect()
    };
    let (split, one) = learnt(&study, EVEN, &[""], cut);
    let (apart, two) = learnt(
        &study,
        EVEN,
        &["rows = [0, 4000]", "rows = [4000, 8000]"],
        cut,
    );
    assert_eq!(split.records.len(), 6);
    for (a, b) in split.records.iter().zip(&apart.records) {
        assert_eq!(a.axes, b.axes);
    }
    assert_eq!(split.records[1].first_row, 8000);
    assert_eq!(one.effects, two.effects);
    let note = split
        .notes
        .iter()
        .find(|n| n.contains("log0.csv: split at a gap"))
        .unwrap();
    assert!(note.contains("row 4002 (line of the file)"), "{note}");
    // Resampled, the same gap is seen, and nothing is interpolated across it.
    let (resampled, model) = learnt(&study, RESAMPLED, &[""], cut);
    let rows: Vec<usize> = resampled.records.iter().map(|r| r.rows).collect();
    assert_eq!(rows, [4000; 6]);
    assert_eq!(resampled.records[1].first_row, 8000);
    assert!(difference(&model, &one) < 1e-3);
}

/// The sentence with which a log is refused.
fn refused(time: &str, spoil: impl Fn(Vec<Row>) -> Vec<Row>) -> String {
    let (folder, study) = (TempDir::new().unwrap(), rig());
    let (role, rows) = rows(&study).remove(0);
    write(folder.path(), &study, time, &[(role, spoil(rows))], &[""]);
    let error = Study::read(folder.path()).expect_err("it was accepted");
    assert_eq!(error.exit_code(), 3, "{error}");
    error.sentence
}

#[test]
fn what_cannot_be_put_right_is_refused_with_what_to_try() {
    let uneven = refused(EVEN, |rows| jittered(rows, 0.9));
    assert!(uneven.contains("resample_hz = 2000 }"), "{uneven}");
    let empty = refused(EVEN, |mut rows| {
        rows[70].cells[3] = None;
        rows
    });
    says(&empty, &["row 72 ", "resample_hz"]);
    let anew = refused(RESAMPLED, |mut rows| {
        rows.iter_mut().skip(5000).for_each(|r| r.t -= 2.5);
        rows
    });
    says(&anew, &["row 5002 ", "began anew"]);
    let pieces = refused(RESAMPLED, |rows| {
        rows.into_iter()
            .filter(|r| ((r.t * 10.0) as u64).is_multiple_of(2))
            .collect()
    });
    assert!(pieces.contains("no stretch of"), "{pieces}");
    let both = refused(&format!("sample_rate_hz = 2000\n{RESAMPLED}"), |rows| rows);
    says(&both, &["line 1", "resample_hz"]);
    let none = refused("time = { column = \"t\", resample_hz = 0 }\n", |rows| rows);
    says(&none, &["line 1", "above 0"]);
}

//! A run that two loggers recorded, each by its own clock: offset and drift come back, and so do
//! the rig's parameters.

use jointwatch::fit::identify;
use jointwatch::model::file::ModelFile;
use jointwatch::simulate::{SimulationOptions, simulate};
use jointwatch::study::{Channels, MemoryLog, Role, Study};
use jointwatch_tests::program::{fail, says};
use std::fmt::Write as _;
use std::fs;
use tempfile::TempDir;

const RATE: f64 = 2000.0;
/// Rows of the second logger that are left out at its beginning and end, so that the eight rows
/// around each time are there.
const EDGE: usize = 40;

/// A clock: the record's time is 1 + drift times its own, plus the offset.
#[derive(Clone, Copy)]
struct Truth {
    offset_s: f64,
    drift: f64,
}

fn rig() -> Study {
    let options = SimulationOptions {
        axes: 1,
        duration_s: 8.0,
        seed: 5,
        ..SimulationOptions::default()
    };
    simulate(&options).unwrap().study
}

/// A series between its rows: the polynomial through the eight around.
fn between(series: &[f64], at: f64) -> f64 {
    let first = at.floor() as usize - 3;
    (first..first + 8)
        .map(|i| {
            let others = (first..first + 8).filter(|j| *j != i);
            let weight: f64 = others
                .map(|j| (at - j as f64) / (i as f64 - j as f64))
                .product();
            weight * series[i]
        })
        .sum()
}

fn times(rows: usize) -> Vec<f64> {
    (0..rows).map(|row| row as f64 / RATE).collect()
}

/// What the first logger has: acceleration, force, and a copy of the far side's position in other
/// units.
fn first(channels: &Channels, name: &str) -> MemoryLog {
    let copy = channels.displacement_first.iter().map(|x| 0.02 - 1e3 * x);
    MemoryLog {
        name: name.into(),
        columns: vec![
            ("t".into(), times(channels.force.len())),
            ("a".into(), channels.acceleration.clone().unwrap()),
            ("F".into(), channels.force.clone()),
            ("copy".into(), copy.collect()),
        ],
    }
}

/// What the second logger has: both positions, by its own clock at 1500 Hz.
fn second(channels: &Channels, name: &str, truth: Truth) -> MemoryLog {
    let rows = channels.force.len();
    let begin = EDGE as f64 / RATE;
    let end = (rows - EDGE) as f64 / RATE;
    let own = |record_s: f64| (record_s - truth.offset_s) / (1.0 + truth.drift);
    let count = ((own(end) - own(begin)) * 1500.0) as usize;
    let stamps: Vec<f64> = (0..count)
        .map(|row| own(begin) + row as f64 / 1500.0)
        .collect();
    let at = |stamp: &f64| (truth.offset_s + (1.0 + truth.drift) * stamp) * RATE;
    let logged = |series: &[f64]| stamps.iter().map(|s| between(series, at(s))).collect();
    let columns = vec![
        ("far".into(), logged(&channels.displacement_first)),
        (
            "body".into(),
            logged(channels.displacement_second.as_ref().unwrap()),
        ),
        ("t".into(), stamps.iter().map(|s| s * 1e3).collect()),
    ];
    MemoryLog {
        name: name.into(),
        columns,
    }
}

const CLOCKS: [Truth; 3] = [
    Truth {
        offset_s: 1.234_567,
        drift: 80e-6,
    },
    Truth {
        offset_s: -40.5,
        drift: -250e-6,
    },
    Truth {
        offset_s: 0.000_3,
        drift: 0.0,
    },
];

fn logs(study: &Study) -> Vec<MemoryLog> {
    let records = study.records.iter().enumerate();
    records
        .flat_map(|(n, record)| {
            let channels = &record.axes[0];
            [
                first(channels, &format!("daq{n}")),
                second(channels, &format!("enc{n}"), CLOCKS[n % 3]),
            ]
        })
        .collect()
}

/// The study of two loggers, its [[clock]] tables with these lines.
fn text(study: &Study, common: &str) -> String {
    let mut text = format!(
        "time = {{ column = \"t\", resample_hz = 1500 }}\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = [\"far\", \
         \"body\"]\nbody_position = \"body\"\nacceleration = \"a\"\nforce = \"F\"\ninertia = {:?}\nrestoring_force = \
         \"inertia_minus_force\"\n[base]\nterms = [\"stiffness@x\", \"viscous@x\", \"clearance@x\"]\n",
        study.axes[0].inertia.unwrap()
    );
    for (n, record) in study.records.iter().enumerate() {
        let role = match record.role {
            Role::Train => "train",
            Role::Validate => "validate",
        };
        let _ = write!(
            text,
            "[[record]]\nfile = \"daq{n}\"\nrole = \"{role}\"\n[[clock]]\nfile = \"enc{n}\"\nrecord = \"daq{n}\"\ntime = {{ column = \
             \"t\", unit = \"ms\" }}\n{common}\n"
        );
    }
    text
}

fn values(model: &ModelFile) -> Vec<f64> {
    let parameters = model.effects.iter().flat_map(|e| &e.parameters);
    parameters.map(|p| p.value).collect()
}

#[test]
fn offset_and_drift_of_a_second_logger_come_back_and_so_do_the_parameters() {
    let study = rig();
    let sound = values(&identify::physical(&study).unwrap().model);
    for (common, offset_within_s) in [
        ("common = [\"far\", \"copy\"]", 2e-5),
        ("common = [\"body\", \"a\"]\nderivative = 2", 1e-4),
    ] {
        let read = Study::of_memory("memory", &text(&study, common), &logs(&study)).unwrap();
        for (n, source) in read.sources.iter().enumerate() {
            let (truth, clock) = (CLOCKS[n % 3], &source.clocks[0]);
            let offset_s = truth.offset_s + truth.drift * clock.at_s;
            let off = [
                clock.offset_s - offset_s,
                clock.drift_ppm - 1e6 * truth.drift,
            ];
            println!(
                "{common}: off by {:.1e} s and {:.2} ppm: {clock:?}",
                off[0], off[1]
            );
            assert!(off[0].abs() < offset_within_s, "{clock:?}");
            assert!(clock.offset_within_s < offset_within_s, "{clock:?}");
            assert!(
                off[1].abs() < (2.0 * clock.drift_within_ppm).max(1.0),
                "{clock:?}"
            );
            assert!(
                source.time.iter().any(|t| t.contains("was put right")),
                "{source:?}"
            );
        }
        let model = identify::physical(&read).unwrap().model;
        assert_eq!(model.records, read.sources);
        for (one, other) in sound.iter().zip(values(&model)) {
            println!("{common}: {one} with one logger, {other} with two");
            assert!((other / one - 1.0).abs() < 1e-2, "{one} {other}");
        }
    }
}

/// Writes logs and study, and gives the sentence with which it is refused.
fn refused(text: &str, logs: &[MemoryLog]) -> String {
    let folder = TempDir::new().unwrap();
    for log in logs {
        let names: Vec<&str> = log.columns.iter().map(|c| c.0.as_str()).collect();
        let mut csv = names.join(",") + "\n";
        for row in 0..log.columns[0].1.len() {
            let cells: Vec<String> = log.columns.iter().map(|c| c.1[row].to_string()).collect();
            csv += &(cells.join(",") + "\n");
        }
        fs::write(folder.path().join(&log.name), csv).unwrap();
    }
    fs::write(folder.path().join("study.toml"), text).unwrap();
    fail(folder.path(), &["identify", ".", "--model", "physical"], 3)
}

#[test]
fn what_cannot_be_put_in_time_is_refused_with_what_to_do() {
    let study = rig();
    let good = text(&study, "common = [\"far\", \"copy\"]");
    let sound = logs(&study);
    let expect = |text: &str, logs: &[MemoryLog], words: &[&str]| {
        let said = refused(text, logs);
        says(&said, words);
    };
    let with = |old: &str, new: &str| {
        assert!(good.contains(old), "{old}");
        good.replacen(old, new, 1)
    };
    expect(
        &with(", resample_hz = 1500", ""),
        &sound,
        &["line", "resample_hz"],
    );
    expect(
        &with("record = \"daq0\"", "record = \"dac0\""),
        &sound,
        &["line", "\"dac0\"", "daq0"],
    );
    expect(
        &with("file = \"enc0\"", "file = \"daq0\""),
        &sound,
        &["line", "itself"],
    );
    expect(
        &with("file = \"enc0\"", "file = \"enk0\""),
        &sound,
        &["enk0", "cannot be read"],
    );
    expect(
        &with("[\"far\", \"copy\"]", "[\"fat\", \"copy\"]"),
        &sound,
        &["enc0", "\"fat\"", "far"],
    );
    expect(
        &with("[\"far\", \"copy\"]", "[\"far\", \"copi\"]"),
        &sound,
        &["daq0", "\"copi\"", "copy"],
    );
    expect(&with("[\"far\", \"copy\"]", "[\"far\"]"), &sound, &["line"]);
    expect(
        &with("[\"far\", \"copy\"]", "[\"far\", \"F\"]\nderivative = 3"),
        &sound,
        &["line", "derivative"],
    );
    expect(
        &with("force = \"F\"", "force = \"G\""),
        &sound,
        &["\"G\"", "neither has enc0"],
    );
    let twice = "[[clock]]\nfile = \"enc0\"\nrecord = \"daq0\"\ntime = \"t\"\ncommon = [\"far\", \"copy\"]\n";
    expect(&format!("{good}{twice}"), &sound, &["line", "twice"]);
    expect(
        &with("role = \"train\"", "role = \"train\"\nrows = [0, 900]"),
        &sound,
        &["line", "rows"],
    );
    // A log that the study does not need.
    let useless = good.replace(
        "displacement = [\"far\", \"body\"]\nbody_position = \"body\"",
        "displacement = \"copy\"",
    );
    expect(&useless, &sound, &["enc0", "gives no column"]);
    // Another run's log.
    let mut other = sound.clone();
    other[1] = second(&study.records[1].axes[0], "enc0", CLOCKS[0]);
    expect(&good, &other, &["enc0", "nothing in them is alike"]);
    // A motion that repeats itself.
    let tone = |log: &MemoryLog, scale: f64| {
        let mut log = log.clone();
        let stamps = log.columns.iter().find(|c| c.0 == "t").unwrap().1.clone();
        for (name, values) in &mut log.columns {
            if ["far", "copy"].contains(&name.as_str()) {
                let wave = |t: &f64| (std::f64::consts::TAU * 10.0 * scale * t).sin();
                *values = stamps.iter().map(wave).collect();
            }
        }
        log
    };
    let mut periodic = sound.clone();
    (periodic[0], periodic[1]) = (tone(&sound[0], 1.0), tone(&sound[1], 1e-3));
    expect(&good, &periodic, &["repeats itself after 0.", "knock"]);
    // Too short.
    let mut short = sound.clone();
    short[1].columns.iter_mut().for_each(|c| c.1.truncate(500));
    expect(&good, &short, &["enc0", "768"]);
    // A clock that stands still.
    let mut still = sound.clone();
    still[1].columns[2].1.fill(3.0);
    expect(&good, &still, &["enc0", "no two rows at different times"]);
}
